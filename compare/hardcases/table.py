"""One table of every hard case by every method."""

from collections.abc import Iterable
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from compare.background import background
from compare.hardcases.cases import Case, cases
from compare.hardcases.problems import rolling_waves
from compare.hardcases.runs import OURS, PEERS, RTOL, TOL, WRONG, Found
from compare.results import Growth
from compare.sweeps import Result, read, sweep
from compare.tables import markdown, write_csv
from discs import checks
from discs.running.tolerance import USUAL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SECONDS = {True: 1.0, False: 60.0}  # limit for a run: quick, or not
PEER_SECONDS = 2.0  # peers are many, and slow
MARK = {"lost": "LOST"}  # in capitals in the table


class Row(NamedTuple):
    """One method on one case. found : see `compare.hardcases.runs.Found`. verdict : `Expectation.verdict`. expected : whether the
    result is the expected one, "yes" or "NO"; "" for peers and for runs without a result."""

    case: str
    setting: str
    method: str
    verdict: str
    expected: str
    found: Found

    @property
    def wrong(self) -> bool:
        """True if the run reached the end with an error above `WRONG` in positions, angles or energy."""
        f = self.found
        return f.outcome == "done" and (f.off > WRONG or not f.energy <= WRONG)

    @property
    def warned(self) -> bool:
        """True if the run warned that it may be wrong."""
        return bool(self.found.says or self.found.unconverged)


@dataclass(frozen=True, eq=False)
class Stability:
    """The results of all methods on the hard cases.

    Attributes
    ----------
    rows : one for each case and method.
    cases : in the order of the table.
    """

    rows: list[Row]
    cases: list[Case]

    @property
    def failures(self) -> list[Row]:
        """Runs of our methods that did not end as expected."""
        return [row for row in self.rows if row.expected == "NO"]

    @property
    def unsaid(self) -> list[Row]:
        """Runs of our methods that are wrong and gave no warning, and default runs above their tolerance that gave none."""
        ours = [row for row in self.rows if row.method in OURS and not row.warned]
        return [row for row in ours if row.wrong or (row.method == "default" and row.found.off > USUAL)]

    def promise(self) -> str:
        """The number of wrong runs of our methods, and those of them that gave no warning, in lines of Markdown."""
        ended = [row for row in self.rows if row.method in OURS and row.found.outcome == "done"]
        known, wrong = sum(bool(np.isfinite(row.found.off)) for row in ended), sum(row.wrong for row in ended)
        lines = [
            f"{len(ended)} runs of our methods reached the end. {known} of them can be compared with a reference. {wrong} have an "
            f"error above {100 * WRONG:g} % in positions, angles or energy. Of these, and of the default runs with an error above "
            f"{USUAL:g}, {len(self.unsaid)} gave no warning{':' if self.unsaid else '.'}"
        ]
        for row in self.unsaid:
            off = f"error {_short(row.found.off)}, energy {_short(row.found.energy)}"
            lines.append(f"* {row.case}, {row.setting}, `{row.method}`, h = {_short(row.found.dt)}: {off}")
        return "\n".join(lines)

    def grid(self) -> str:
        """A table in Markdown: a row for each case, a column for each method. Failures of our methods are bold."""
        at = {(row.case, row.setting, row.method): row for row in self.rows}
        methods = [m for m in (*OURS, *PEERS) if any(row.method == m for row in self.rows)]
        lines = []
        for case in self.cases:
            cells = [_cell(at.get((case.name, case.setting, m))) for m in methods]
            if any(cell != "·" for cell in cells):
                lines.append([f"{case.name}: {case.setting}", *cells])
        return markdown(["case", *methods], lines)

    def table(self) -> str:
        """All runs, as a table in Markdown."""
        words = "case", "method", "as expected", "result", "t", "h", "error", "off", "energy", "slip"
        head = (*words, "unconverged", "steps", "s", "remark")
        lines = []
        for row in self.rows:
            f = row.found
            numbers = [_short(v) for v in (f.t, f.dt, f.error, f.off, f.energy, f.residual)]
            says = "; ".join(part for part in (f.note, _first(f.says)) if part).replace("|", "\\|")
            cells = [
                f"{row.case}: {row.setting}",
                row.method,
                row.expected,
                row.verdict,
                *numbers,
                str(f.unconverged),
                str(f.steps),
            ]
            lines.append([*cells, _short(f.seconds), says])
        return markdown(head, lines)

    def summary(self) -> str:
        """Failures of our methods, in lines of Markdown."""
        told = [r for r in self.rows if r.expected]
        lines = [f"{len(told)} runs of our methods, {len(self.failures)} not as expected{':' if self.failures else '.'}"]
        for row in self.failures:
            f = row.found
            how = f"{row.verdict}, error {_short(f.error)}, energy {_short(f.energy)}"
            parts = "; ".join(part for part in (how, f.note, _first(f.says)) if part)
            lines.append(f"* {row.case}, {row.setting}, `{row.method}`: {parts}")
        return "\n".join(lines)

    @property
    def words(self) -> str:
        """The meaning of the words in the tables, in Markdown."""
        return "\n".join(
            [
                "* passed: ran to the end; energy (relative drift shown) and, where known, positions within the bound.",
                "* warned: outside the bound, with a warning or with steps that did not converge.",
                "* **LOST**: outside the bound, without a warning.",
                "* stopped: ended by an error that names the time and the disc. refused: an error before the start.",
                "* failed: an error of a peer. cut off: it would take longer than its time limit.",
                "* †: some steps did not converge. Bold: a method of ours that did not end as expected.",
                "* ·: not run, because the case does not apply. A tolerance hides waves and rounding. Only the two-step scheme has "
                "the parasitic mode. Radau methods do not keep the energy; they are for dampers.",
                f'* auto: `simulate(problem, "auto", tol={TOL:g})`. default: `simulate(problem)`, with the tolerance {USUAL:g}. '
                f"Peers: rtol {RTOL:g}; their energy is that at the end, and their variables satisfy rolling exactly.",
                "* error: as the case defines it. off: error of positions and angles at the end, relative to the largest value of "
                "each in the motion. s: seconds of processor time.",
            ]
        )

    def report(self) -> str:
        """All tables, in Markdown."""
        wants = dict.fromkeys(_wanted(case) for case in self.cases)
        told = [self.promise(), self.summary(), self.words, self.grid()]
        return "\n\n".join(["# Hard cases", *told, "## What is expected", "\n".join(wants), "## All runs", self.table()])

    def save(self, path: str | Path) -> None:
        """Write all runs to a CSV file."""
        write_csv(path, [[*Row._fields[:-1], *Found._fields], *([*row[:-1], *row.found] for row in self.rows)])

    @cached_property
    def waves(self) -> dict[str, Growth]:
        """Growth of waves on the straight rolling rod by both laws, with the midpoint method, for the figure."""
        found = {law: rolling_waves(33, law, 0.7, 4.0, "midpoint", np.inf)[1] for law in ("field", "unit")}
        return {law: growth for law, growth in found.items() if growth is not None}

    def drifts(self) -> tuple[str, dict[str, list[tuple[float, float, int]]]]:
        """Of the largest chain with steps above the explicit limit: its size, and for each method h/k, energy drift and the
        number of unconverged steps.
        """
        found: dict[str, dict[str, list[tuple[float, float, int]]]] = {}
        for row in (row for row in self.rows if row.case == "step above the explicit limit"):
            size, step = row.setting.split(", h = ")
            drift = max(row.found.energy, 1e-16) if row.found.outcome == "done" else np.nan
            found.setdefault(size, {}).setdefault(row.method, []).append((float(step.split()[0]), drift, row.found.unconverged))
        return list(found.items())[-1] if found else ("", {})

    def plot(self, path: str | Path | None = None) -> "list[Axes]":
        """Plot the energy error of each method against h/k, and the growth of waves. Saved if a path is given."""
        from compare import figures

        axes = figures.stability(*self.drifts(), self.waves)
        if path is not None:
            figures.save(axes[0], path)
        return axes


def stability(
    quick: bool = False,
    names: Iterable[str] | None = None,
    methods: Iterable[str] | None = None,
    seconds: float | None = None,
    executor: Executor | None = None,
    archive: str | Path | None = None,
    progress: bool = True,
) -> Stability:
    """Run every method on hard cases: steps far above the explicit limit, long times, parasitic modes, growing waves, ill-posed
    motions, a collapse, rough initial states, extreme parameters, few and many discs.

    Parameters
    ----------
    quick : small cases only, less than a minute.
    names : names of cases, as in `compare.hardcases.cases`; all by default.
    methods : names of our methods and of peers; all by default.
    seconds : limit of processor time for a run; 60 by default, 1 if quick; at most 2 for peers. A run is cut off if it would take
        longer.
    executor : as for `sweep`; by default one other process, so that times are comparable.
    archive : file that keeps the results; an interrupted call goes on from it.
    progress : show a progress bar.

    Raises
    ------
    ValueError : for unknown names or methods, or seconds that are not positive.
    """
    listed = cases(quick)
    known = tuple(dict.fromkeys(case.name for case in listed))
    chosen = known if names is None else tuple(checks.choice("names", name, known) for name in names)
    by = (*OURS, *PEERS) if methods is None else tuple(checks.choice("methods", m, (*OURS, *PEERS)) for m in methods)
    limit = SECONDS[quick] if seconds is None else checks.number("seconds", seconds, positive=True)
    listed = [case for case in listed if case.name in chosen]
    todo = [_order(c, m, quick, min(limit, PEER_SECONDS) if m in PEERS else limit) for c in listed for m in by if m in c.methods]
    with nullcontext(executor) if executor else background() as worker:
        return tabulated(sweep(_run, todo, worker, archive, progress), listed)


def kept(archive: str | Path, quick: bool) -> Stability:
    """Read the results of an interrupted call from its archive."""
    found = [result for result in read(archive) if result.case["quick"] == quick]
    return tabulated(found, cases(quick))


def tabulated(results: list[Result], listed: list[Case]) -> Stability:
    """Make the table from the results of a sweep."""
    by_key, rows = {case.key: case for case in listed}, []
    for result in results:
        case, method = by_key[result.case["case"]], result.case["method"]
        found = Found(**result.value) if result.value else Found("failed", says=result.error, seconds=result.seconds)
        met = case.expectation.met(method, found)
        expected = "" if met is None else "yes" if met else "NO"
        rows.append(Row(case.name, case.setting, method, case.expectation.verdict(method, found), expected, found))
    return Stability(rows, listed)


def _order(case: Case, method: str, quick: bool, seconds: float) -> dict[str, Any]:
    return {"case": case.key, "method": method, "quick": quick, "seconds": seconds}


@cache
def _listed(quick: bool) -> dict[str, Case]:
    return {case.key: case for case in cases(quick)}


def _run(order: dict[str, Any]) -> dict[str, Any]:
    """Run one case in a worker process. The order holds the name of the case, because JSON cannot store the case itself."""
    return _listed(order["quick"])[order["case"]].run(order["method"], order["seconds"])._asdict()


def _wanted(case: Case) -> str:
    """What is expected of a case, and of which methods."""
    e = case.expectation
    everyone = e.kind == "must refuse" or set(case.methods) & set(OURS) <= set(e.must)
    others = "others may stop or warn"
    who = "all of our methods" if everyone else "; ".join(filter(None, (", ".join(e.must), others)))
    return f"* **{case.name}**: {case.what}{'' if case.what.endswith('?') else '.'} {e.kind.capitalize()} ({who}): {e.words}."


def _first(says: str, most: int = 160) -> str:
    """The first part of a message, on one line."""
    return shorten(says, most, placeholder=" ...")


def _short(value: float) -> str:
    return "–" if not np.isfinite(value) else f"{value:.2g}"


def _cell(row: Row | None) -> str:
    """A cell of the grid: the verdict and its number."""
    if row is None:
        return "·"
    f, word = row.found, MARK.get(row.verdict, row.verdict)
    number = f" t={f.t:.2g}" if row.verdict == "stopped" else f" {_short(f.energy)}" if f.outcome == "done" else ""
    number += "†" if f.unconverged else ""
    return f"**{word}{number}**" if row.expected == "NO" else word + number
