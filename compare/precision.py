"""Speed against error: our methods and what a user would take instead, one problem, one machine, one run."""

import csv
import time as clock
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from tqdm import tqdm

from compare import figures
from compare.entrants import ours, peers
from compare.lump import lump
from compare.peers.peer import Cutoff, Peer
from continuum import Scene
from discs import Gauss8, Problem, SimulationError, checks, simulate
from discs.arrays import Float

SIZES = (32, 128, 512, 2048)
WRONG = 100.0  # a run that says it met a tolerance and is off by this many times more is marked
FAILURES = (ArithmeticError, SimulationError, RuntimeError, ValueError)  # of a run, that stay in the table
ERRORS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)


class Row(NamedTuple):
    """One method with one setting on one problem.

    error : largest error of positions and angles at the end, each relative to its largest value; NaN if there is none.
    seconds : median of the rounds, or mean of a long run's two times. steps, gradients, solves : what it took, None where a peer
    does not tell. remark : why there is no result, or what is wrong with it.
    """

    problem: str
    n: int
    method: str
    ours: bool
    setting: float = np.nan
    error: float = np.nan
    seconds: float = np.nan
    steps: int | None = None
    gradients: int | None = None
    solves: int | None = None
    remark: str = ""


@dataclass(frozen=True, eq=False)
class WorkPrecision:
    """Speed against error.

    Attributes
    ----------
    rows : one for each method, setting and problem, failures included.
    references : (problem, n) -> estimated error of the reference.
    differences : method -> how it differs from the problem the others solve.
    """

    rows: list[Row]
    references: dict[tuple[str, int], float]
    differences: dict[str, str]

    @property
    def problems(self) -> list[tuple[str, int]]:
        """The problems, by name and number of discs."""
        return list(dict.fromkeys((row.problem, row.n) for row in self.rows))

    def curve(self, problem: str, n: int, method: str) -> tuple[Float, Float]:
        """Errors and seconds of a method, from loose to tight, without what is slower and less accurate than another of its
        runs."""
        found = [(r.error, r.seconds) for r in self.rows if (r.problem, r.n, r.method) == (problem, n, method) and r.error < 1]
        best = [(e, s) for e, s in found if not any(f <= e and t <= s and (f, t) != (e, s) for f, t in found)]
        errors, seconds = np.array(sorted(best, reverse=True)).reshape(-1, 2).T
        return errors, seconds

    def time_at(self, error: float, problem: str, n: int, ours: bool) -> tuple[float, str]:
        """The least time that any method takes to an error (interpolated between its runs, log-log), and its name; infinite if
        none does."""
        best = np.inf, ""
        for method in dict.fromkeys(r.method for r in self.rows if r.ours == ours):
            errors, seconds = self.curve(problem, n, method)
            if errors.size and errors[-1] <= error:
                at = float(np.exp(np.interp(-np.log(error), -np.log(errors), np.log(seconds))))
                best = min(best, (at, method))
        return best

    def speedups(self, errors: Iterable[float] = ERRORS) -> str:
        """How many times faster ours are than the fastest peer at equal error, as a table."""
        lines = ["| problem | N | error | ours | | fastest peer | | times |", "| --- " * 8 + "|"]
        for problem, n in self.problems:
            for error in errors:
                (ours, mine), (peers, other) = self.time_at(error, problem, n, True), self.time_at(error, problem, n, False)
                if not np.isfinite(ours):
                    continue
                ratio = f"{peers / ours:.0f}" if np.isfinite(peers) else "no peer"
                there = f"{1e3 * peers:.3g} ms" if np.isfinite(peers) else "–"
                lines.append(
                    f"| {problem} | {n} | {error:.0e} | {mine} | {1e3 * ours:.3g} ms | {other or '–'} | {there} | {ratio} |"
                )
        return "\n".join(lines)

    def table(self) -> str:
        """All runs, as a table."""
        lines = ["| problem | N | method | setting | error | ms | steps | gradients | solves | remark |", "| --- " * 10 + "|"]
        for r in self.rows:
            counts = " | ".join("–" if c is None else str(c) for c in (r.steps, r.gradients, r.solves))
            error = f"{r.error:.1e}" if np.isfinite(r.error) else "–"
            lines.append(
                f"| {r.problem} | {r.n} | {r.method} | {r.setting:.3g} | {error} | {1e3 * r.seconds:.3g} | {counts} | {r.remark} |"
            )
        return "\n".join(lines)

    def report(self) -> str:
        """Speedups, what differs, and all runs, in Markdown."""
        floor = max(self.references.values(), default=0.0)
        return "\n\n".join(
            [
                "# Speed against error",
                f"Ours against the fastest peer at equal error. Reference: gauss8 with short steps, off by at most {floor:.1e}.",
                self.speedups(),
                *(f"* {name}: {how}." for name, how in self.differences.items()),
                "All runs; errors relative to the largest value of each of x, y, θ (φ); times are medians, "
                "of long runs means of two.",
                self.table(),
            ]
        )

    def save(self, path: str | Path) -> None:
        """All runs, as CSV."""
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(Row._fields)
            writer.writerows(self.rows)

    def plot(self, path: str | Path | None = None) -> Sequence[Axes]:
        """Error against time, a panel for each problem; saved if a path is given."""
        axes = figures.precision(self)
        if path is not None:
            figures.save(axes[0], path)
        return axes


def reference(problem: Problem) -> tuple[Float, float]:
    """Positions at the end by "gauss8" with short steps, (rows, n), and what halving them changes."""
    found = []
    for steps in (1000, 2000) if problem.system.kernel is not None else (250, 500):  # the plain form takes 50 times as long
        run = simulate(problem, Gauss8(tolerance=1e-14, sweeps=20), problem.duration / steps, frames=1, progress=False)
        found.append(np.array([getattr(run, row)[-1] for row in problem.system.rows]))
    return found[1], distance(found[0], found[1])


def distance(q: Float, exact: Float) -> float:
    """Largest difference, each row relative to its largest value, absolute of a row that is zero."""
    size = np.abs(exact).max(axis=1)
    return float((np.abs(q - exact).max(axis=1) / np.where(size > 0, size, 1.0)).max())


def work_precision(
    scenes: Scene | dict[str, Scene],
    n: Sequence[int] = SIZES,
    methods: Callable[[Problem], list[Peer]] | None = None,
    repeats: int = 5,
    seconds: float = 10.0,
    progress: bool = True,
    into: WorkPrecision | None = None,
) -> WorkPrecision:
    """Measure speed against error at the end of scenes.

    Every method runs from loose to tight settings, once. A run is cut off after `seconds`; after two such runs, or once a method
    has taken three times that, its tighter settings are left out, and the table says so. (CVODE may crawl at one tolerance and
    not at the next.) What took less than `seconds`/(4 `repeats`) is then timed in `repeats` rounds, of which the median counts: a
    round runs all methods and settings, each to warm up and then for the clock. So a machine that slows down for a minute does so
    for all of them. What took longer runs once more, in the first round, and has the mean of its two times.

    Parameters
    ----------
    scenes : a scene, or several by name.
    n : numbers of discs, with plain springs at free ends. Chains with true curvature run in NumPy, by every method.
    methods : problem -> methods to run; None takes ours and the peers that are installed.
    repeats : rounds, how often each short run is timed.
    seconds : the longest time for one run; three times that for all runs of a method on a problem.
    progress : show a progress bar.
    into : filled and returned, problem by problem, so that an interrupted run leaves those it has finished; a new one by default.

    Raises
    ------
    ValueError : for sizes, repeats or times that are not positive.
    """
    checks.whole("repeats", repeats, 1)
    checks.number("seconds", seconds, positive=True)
    named = scenes if isinstance(scenes, dict) else {scenes.name: scenes}
    into = WorkPrecision([], {}, {}) if into is None else into
    for name, scene in named.items():
        for size in n:
            problem = lump(scene, size)
            exact, floor = reference(problem)
            mine = ours(problem)
            others = peers(problem) if methods is None else methods(problem)
            entries: list[_Entry] = []
            for peer in tqdm([*mine, *others], desc=f"{name}, N = {size}", disable=not progress, leave=False):
                entries += _first_runs(peer, Row(name, size, peer.name, peer in mine), exact, seconds)
            timed = [entry for entry in entries if not np.isnan(entry.row.error)]
            for turn in tqdm(range(repeats), desc=f"{name}, N = {size}, rounds", disable=not progress, leave=False):
                for entry in timed:
                    if entry.row.seconds < seconds / (4 * repeats):
                        entry.run_again(seconds)
                    elif not turn:
                        entry.run_once_more(seconds)
            into.rows.extend(entry.result() for entry in entries)
            into.references[name, size] = floor
            into.differences.update({peer.name: peer.tells for peer in [*mine, *others] if peer.tells})
    return into


@dataclass(eq=False)
class _Entry:
    """A row with the time of its first run, how to run it again, and the times that count, s."""

    row: Row
    peer: Peer
    times: list[float] = field(default_factory=list)

    def run_again(self, limit: float) -> None:
        """To warm up, and for the clock."""
        with suppress(Cutoff, *FAILURES), _quiet():
            self.peer.run(self.row.setting, limit)
            self.times.append(self.peer.run(self.row.setting, limit).seconds)

    def run_once_more(self, limit: float) -> None:
        """Without warming up; the first run counts too."""
        self.times.append(self.row.seconds)
        with suppress(Cutoff, *FAILURES), _quiet():
            self.times.append(self.peer.run(self.row.setting, limit).seconds)

    def result(self) -> Row:
        return self.row._replace(seconds=float(np.median(self.times))) if self.times else self.row


@contextmanager
def _quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _first_runs(peer: Peer, blank: Row, exact: Float, limit: float) -> list[_Entry]:
    """A method's runs from loose to tight."""
    entries: list[_Entry] = []
    started, cut = clock.perf_counter(), 0

    def add(row: Row) -> None:
        entries.append(_Entry(row, peer))

    for setting in peer.settings:
        begun = clock.perf_counter()
        row, more = blank._replace(setting=setting), setting != peer.settings[-1]
        try:
            with _quiet():
                found = peer.run(setting, limit)
                if not entries:  # what a method loads and compiles at first is not part of its time
                    started = clock.perf_counter()
                    found = peer.run(setting, limit)
        except Cutoff:
            cut += 1
            remark = f"cut off after {limit:g} s" + "; tighter left out" * (cut == 2 and more)
            add(row._replace(seconds=clock.perf_counter() - begun, remark=remark))
            if cut == 2:
                break
            continue
        except FAILURES as error:
            add(row._replace(seconds=clock.perf_counter() - begun, remark=f"failed: {error}".replace("\n", " ")[:100]))
            continue
        off = distance(found.q, exact)
        tolerance = setting if setting < 1 else np.nan
        remark = "says it succeeded, and is wrong" if off > max(WRONG * tolerance, 0.01) else ""
        row = row._replace(error=off, seconds=found.seconds, steps=found.steps or None, gradients=found.gradients)
        add(row._replace(solves=found.solves, remark=remark))
        if clock.perf_counter() - started > 3 * limit and more:
            add(blank._replace(setting=setting, remark=f"tighter left out after {3 * limit:g} s"))
            break
    return entries
