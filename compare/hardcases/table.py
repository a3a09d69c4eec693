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
MARK = {"lost": "LOST"}


class Row(NamedTuple):
    """One method on one case: see `compare.hardcases.runs.Found`. verdict : `Expectation.verdict`. expected : "yes", "NO", or ""
    for peers and runs without a result."""

    case: str
    setting: str
    method: str
    verdict: str
    expected: str
    found: Found

    @property
    def wrong(self) -> bool:
        """Whether it ran to the end with an error above `WRONG` in positions, angles or energy."""
        f = self.found
        return f.outcome == "done" and (f.off > WRONG or not f.energy <= WRONG)

    @property
    def warned(self) -> bool:
        """Whether the run says that it may be wrong."""
        return bool(self.found.says or self.found.unconverged)


@dataclass(frozen=True, eq=False)
class Stability:
    """Hard cases by methods.

    Attributes
    ----------
    rows : one for each case and method.
    cases : the cases, in their order.
    """

    rows: list[Row]
    cases: list[Case]

    @property
    def failures(self) -> list[Row]:
        """Runs of ours that did not meet the expectation."""
        return [row for row in self.rows if row.expected == "NO"]

    @property
    def unsaid(self) -> list[Row]:
        """Runs of ours that are wrong without a warning, and default runs above their tolerance without one."""
        ours = [row for row in self.rows if row.method in OURS and not row.warned]
        return [row for row in ours if row.wrong or (row.method == "default" and row.found.off > USUAL)]

    def promise(self) -> str:
        """How many runs of ours are wrong, and which of them have no warning, in lines of Markdown."""
        ended = [row for row in self.rows if row.method in OURS and row.found.outcome == "done"]
        known, wrong = sum(bool(np.isfinite(row.found.off)) for row in ended), sum(row.wrong for row in ended)
        lines = [
            f"{len(ended)} runs of ours ran to the end, {known} have a reference. {wrong} are wrong by more than {100 * WRONG:g} % "
            f"in positions, angles or energy. Of these, and of default runs with an error above {USUAL:g}, {len(self.unsaid)} are "
            f"without a warning{':' if self.unsaid else '.'}"
        ]
        for row in self.unsaid:
            off = f"error {_short(row.found.off)}, energy {_short(row.found.energy)}"
            lines.append(f"* {row.case}, {row.setting}, `{row.method}`, h = {_short(row.found.dt)}: {off}")
        return "\n".join(lines)

    def grid(self) -> str:
        """Cases by methods, as a table in Markdown; bold marks failures of ours."""
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
        """Failures of ours, in lines of Markdown."""
        told = [r for r in self.rows if r.expected]
        lines = [f"{len(told)} runs of ours, {len(self.failures)} not as expected{':' if self.failures else '.'}"]
        for row in self.failures:
            f = row.found
            how = f"{row.verdict}, error {_short(f.error)}, energy {_short(f.energy)}"
            parts = "; ".join(part for part in (how, f.note, _first(f.says)) if part)
            lines.append(f"* {row.case}, {row.setting}, `{row.method}`: {parts}")
        return "\n".join(lines)

    @property
    def words(self) -> str:
        """Meaning of the words in the grid."""
        return (
            "passed: ran to the end; energy (relative error shown) and, where known, positions within the bound. warned: outside "
            "the bound, with a warning or unconverged steps. **LOST**: outside the bound, without a warning. stopped: an error "
            "with time and disc. refused: an error before the start. failed: a peer's error. cut off: predicted to exceed its "
            "time. †: some steps did not converge. ·: not run, as the case does not apply: a tolerance hides waves and rounding, "
            "the parasitic mode belongs to the two-step scheme, and Radau methods, which do not keep the energy, are for dampers. "
            f"Bold: a method of ours that did not meet the expectation. auto runs to {TOL:g}, default is `simulate(problem)` with "
            f"nothing set, to {USUAL:g}; peers run to rtol {RTOL:g}; the energy of peers is that at the end, and their variables "
            "satisfy rolling exactly. error: as the case defines it; off: of positions and angles at the end, relative to the "
            "largest of each in the motion. Seconds are processor time."
        )

    def report(self) -> str:
        """Everything, in Markdown."""
        wants = dict.fromkeys(_wanted(case) for case in self.cases)
        told = [self.promise(), self.summary(), self.words, self.grid()]
        return "\n\n".join(["# Hard cases", *told, "## What is expected", "\n".join(wants), "## All runs", self.table()])

    def save(self, path: str | Path) -> None:
        """All runs, as CSV."""
        write_csv(path, [[*Row._fields[:-1], *Found._fields], *([*row[:-1], *row.found] for row in self.rows)])

    @cached_property
    def waves(self) -> dict[str, Growth]:
        """Growth on the rolling straight rod under both laws, by midpoint, for the figure."""
        found = {law: rolling_waves(33, law, 0.7, 4.0, "midpoint", np.inf)[1] for law in ("field", "unit")}
        return {law: growth for law, growth in found.items() if growth is not None}

    def drifts(self) -> tuple[str, dict[str, list[tuple[float, float, int]]]]:
        """Of the largest chain with steps above the explicit limit: its size, and by method h/k, drift and unconverged steps."""
        found: dict[str, dict[str, list[tuple[float, float, int]]]] = {}
        for row in (row for row in self.rows if row.case == "step above the explicit limit"):
            size, step = row.setting.split(", h = ")
            drift = max(row.found.energy, 1e-16) if row.found.outcome == "done" else np.nan
            found.setdefault(size, {}).setdefault(row.method, []).append((float(step.split()[0]), drift, row.found.unconverged))
        return list(found.items())[-1] if found else ("", {})

    def plot(self, path: str | Path | None = None) -> "list[Axes]":
        """Energy error against h/k of each method, and the growth of waves; saved if a path is given."""
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
    """Run hard cases by every method: steps far above the explicit limit, long times, parasitic modes, growing waves, ill-posed and
    collapsing motions, rough starts, extreme parameters, few and many discs.

    Parameters
    ----------
    quick : small cases only, less than a minute.
    names : of the cases, as `compare.hardcases.cases` has them; all by default.
    methods : names of ours and of peers; all by default.
    seconds : limit of processor time; a run that is predicted to take longer is cut off; 60, or 1 if quick. At most 2 for peers.
    executor : as for `sweep`; by default one other process, so that times are comparable.
    archive : file to keep results in, and to resume from.
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
    """The results of an interrupted run, from its archive."""
    found = [result for result in read(archive) if result.case["quick"] == quick]
    return tabulated(found, cases(quick))


def tabulated(results: list[Result], listed: list[Case]) -> Stability:
    """The table of a sweep's results."""
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
    """Run a case in any process; it is found by its name, as JSON cannot store it."""
    return _listed(order["quick"])[order["case"]].run(order["method"], order["seconds"])._asdict()


def _wanted(case: Case) -> str:
    """The expectation of a case, and the methods that must meet it."""
    e = case.expectation
    everyone = e.kind == "must refuse" or set(case.methods) & set(OURS) <= set(e.must)
    who = "all of ours" if everyone else "; ".join(filter(None, (", ".join(e.must), "no other lost without a warning")))
    return f"* **{case.name}**: {case.what}{'' if case.what.endswith('?') else '.'} {e.kind.capitalize()} ({who}): {e.words}."


def _first(says: str, most: int = 160) -> str:
    """The beginning of a message, on one line."""
    return shorten(says, most, placeholder=" ...")


def _short(value: float) -> str:
    return "–" if not np.isfinite(value) else f"{value:.2g}"


def _cell(row: Row | None) -> str:
    """A verdict and its number."""
    if row is None:
        return "·"
    f, word = row.found, MARK.get(row.verdict, row.verdict)
    number = f" t={f.t:.2g}" if row.verdict == "stopped" else f" {_short(f.energy)}" if f.outcome == "done" else ""
    number += "†" if f.unconverged else ""
    return f"**{word}{number}**" if row.expected == "NO" else word + number
