"""A test of tolerances: random scenes by `solve` and by `simulate(..., "auto")`, compared with independent references.

A scene is drawn (`compare.random_scenes`), and a tolerance for each of the two solvers. The references are

* chains : N, 2N and 4N discs, with ends of second order, extrapolated by the law 1/N^2. This is another discretisation. Its error
  is the change from one extrapolation to the next, over three (`continuum.solver`), plus that of the steps. It reaches 1e-4 to
  1e-6.
* finer : if the error of the chains is more than a fifth of the tolerance, the field itself, to a tenth of its tolerance and a
  fifth of its estimate (with the tolerance alone it could be the same run, if that estimate is small). It is another run, but of
  the same kind. So it is compared with the chains, too: `unlike` is their difference over the error of the chains.
* gauss8 : for discs, "gauss8" with steps eight times shorter. Its error is the change to steps four times shorter.

If the error of a reference is more than a fifth of the tolerance, the reference is not used, and the row says so. Runs are limited
to a given processor time.
"""

import re
import signal
import time as clock
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from compare.lump import lump
from compare.random_loads import loaded
from compare.random_scenes import Drawn, random_scene
from compare.sweeps import Result, sweep
from compare.trust_table import LEAST, Row, Trust
from continuum import Scene, breathing_ring, solve, steered_rod, untwisting_rod
from discs import Gauss8, SimulationError, Solution, checks, simulate
from discs.arrays import Float

FRAMES = 6
SIZES = (128, 256, 512)  # links of the chains of a reference
FINER = 10.0  # tolerance of a field over that of its reference
KNOWN = 3.0  # an error below this many times that of the reference is unknown: it has no ratio


class TimeUp(BaseException):
    """The processor time is used up. It is not an `Exception`, so that no handler treats it as a failure."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise `TimeUp` after this processor time of the process; without effect on systems that have no such timer (Windows)."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def up(*_: object) -> None:
        raise TimeUp

    before = signal.signal(signal.SIGPROF, up)
    signal.setitimer(signal.ITIMER_PROF, seconds, 0.5)  # again and again: an exception in a callback of LLVM is lost
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def examine(case: list[float]) -> list[list[Any]]:
    """The two rows of a case (`cases_of`); called in other processes."""
    seed, index, seconds = int(case[0]), int(case[1]), float(case[2])
    _warm_up()
    drawn = scene_of(case)
    rng = np.random.default_rng([seed, index, 1])
    tolerances = 10 ** -rng.uniform(2, 7, 2)
    begin = Row(f"{seed}:{index}", drawn.kind, drawn.scene.rolling, drawn.words, drawn.scene.duration, "", np.nan, "")
    if drawn.scene.steered:
        begin = begin._replace(law="own")
    by = (field_row, "solve"), (discs_row, "simulate")
    rows = []
    for (found, name), tol in zip(by, tolerances.tolist(), strict=True):
        blank = begin._replace(by=name, tol=float(f"{tol:.1e}"))
        rows.append(list(found(drawn, blank, seconds)))
    return rows


def scene_of(case: list[float]) -> Drawn:
    """The scene of a case."""
    seed, index = int(case[0]), int(case[1])
    return loaded(random_scene(seed, index), seed, index) if len(case) > 3 else random_scene(seed, index)


def cases_of(seed: int, first: int, count: int, seconds: float, loads: bool) -> list[list[float]]:
    """Cases [seed, index, seconds], with a fourth number for rods that vary and have loads, from an index on."""
    start = checks.whole("first", first, 0)
    case = [checks.whole("seed", seed, 0), checks.number("seconds", seconds, positive=True)]
    return [[case[0], index, case[1], *[1.0] * loads] for index in range(start, start + count)]


@cache
def _warm_up() -> None:
    """Compile or load the kernels before any time is measured."""
    with warnings.catch_warnings(action="ignore"):
        for scene in (untwisting_rod(duration=0.1), steered_rod(duration=0.1), breathing_ring(duration=0.1)):
            solve(scene, 1e-3, frames=1, progress=False)
            for method in ("midpoint", "gauss6", "gauss8"):
                simulate(lump(scene, 9), method, 0.05, 1, progress=False)


def field_row(drawn: Drawn, row: Row, seconds: float) -> Row:
    """The row of the field, by `solve`."""
    scene = drawn.scene
    found, row = _tried(lambda: solve(scene, row.tol, frames=FRAMES, progress=False), row, seconds)
    if found is None:
        return row._replace(shown=_chains_end(drawn, seconds)) if row.outcome == "refused" else row
    names = ["x", "y", "theta", *(["phi"] if scene.steered else [])]
    estimate = max((found.error_estimate or {})[name] for name in names)
    row = row._replace(estimate=estimate)
    try:
        with at_most(2 * seconds), warnings.catch_warnings(action="ignore"):
            other, off = _chains(scene, names, row.tol)
            error = _apart(scene, found, other, names)
            if off <= row.tol / LEAST:
                return _judged(row, error, off, "chains")
            finer = solve(scene, min(row.tol / FINER, estimate / LEAST), frames=FRAMES, progress=False)
            finer_off = max((finer.error_estimate or {})[name] for name in names)
            row = row._replace(unlike=_apart(scene, finer, other, names) / off)
            return _judged(row, _apart(scene, found, finer, names), finer_off, "finer")
    except (TimeUp, ValueError, SimulationError, ArithmeticError) as error:
        return row._replace(outcome="no reference", says=shorten(f"{row.says} reference: {type(error).__name__} {error}", 200))


def discs_row(drawn: Drawn, row: Row, seconds: float) -> Row:
    """The row of the discs, by `simulate(..., "auto")`."""
    try:
        problem = lump(drawn.scene, drawn.n, "springs" if drawn.scene.steered or drawn.n % 2 else "consistent")
    except ValueError as error:
        return row._replace(outcome="refused", says=str(error), shown="no such chain")
    names, row = problem.system.rows, row._replace(words=f"{row.words}, N = {drawn.n}, {problem.chain.ends}")
    found, row = _tried(lambda: simulate(problem, "auto", tol=row.tol, frames=FRAMES, progress=False), row, seconds)
    if found is None:
        return row._replace(shown=_chains_end(drawn, seconds)) if row.outcome == "refused" else row

    def relative(errors: Iterable[float]) -> float:
        return max(e / (np.abs(getattr(found, name)).max() or 1.0) for e, name in zip(errors, names, strict=True))

    def apart(a: Solution, b: Solution) -> float:
        return relative(float(np.abs(getattr(a, name) - getattr(b, name)).max()) for name in names)

    estimate = relative((found.error_estimate or {})[name] for name in names)
    row = row._replace(estimate=estimate, limited=found.stats.get("limited_by", ""))
    h = problem.duration / max(round(problem.duration / found.stats["dt"]), 25)
    try:
        with at_most(4 * seconds), warnings.catch_warnings(action="ignore"):
            near, far = (simulate(problem, Gauss8(tolerance=1e-14, sweeps=20), h / m, FRAMES, progress=False) for m in (8, 4))
        return _judged(row, apart(found, near), apart(near, far), "gauss8")
    except (TimeUp, ValueError, SimulationError, ArithmeticError) as error:
        return row._replace(outcome="no reference", says=shorten(f"reference: {type(error).__name__} {error}", 200))


def _tried(compute: Callable[[], Solution], row: Row, seconds: float) -> tuple[Solution | None, Row]:
    """The result, or None if it took too long or failed; and the row with the processor time, warnings and errors."""
    begun = clock.process_time()
    found, outcome, says = None, "", ""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            with at_most(seconds):
                found = compute()
        except TimeUp:
            outcome = "cut off"
        except (ValueError, SimulationError, ArithmeticError) as error:
            outcome, says = "refused", f"{type(error).__name__}: {error}"
    told = " ".join([says, *dict.fromkeys(str(w.message) for w in heard)])
    return found, row._replace(outcome=outcome, says=re.sub(r"\s+", " ", told).strip(), seconds=clock.process_time() - begun)


def _judged(row: Row, error: float, off: float, reference: str) -> Row:
    """The row with its error and its outcome, given the error `off` of the reference."""
    row = row._replace(error=float(error), estimate=float(row.estimate), reference=reference, reference_error=float(off))
    if off > row.tol / LEAST:
        return row._replace(outcome="no reference")
    ratio = row.estimate / row.error if error > KNOWN * off else np.nan
    return row._replace(outcome="within" if error <= row.tol + off else "ABOVE", ratio=ratio)


def _chains(scene: Scene, names: Iterable[str], tol: float) -> tuple[Solution, float]:
    """Extrapolated chains, and their error. Steps are to a hundredth of the tolerance, within the limits of chains."""
    runs = []
    for size in SIZES:
        problem = lump(scene, size if scene.closed else size + 1, "springs" if scene.steered else "consistent")
        runs.append(simulate(problem, "auto", tol=float(np.clip(tol / 100, 1e-9, 1e-6)), frames=FRAMES, progress=False))
    a, b, c = ({name: getattr(run, name)[:, ::every] for name in names} for run, every in zip(runs, (1, 2, 4), strict=True))
    once = {name: b[name] + (b[name] - a[name]) / 3 for name in names}
    twice = {name: c[name] + (c[name] - b[name]) / 3 for name in names}
    off = max(
        float(np.abs(twice[name] - once[name]).max()) / 3 + max((r.error_estimate or {})[name] for r in runs) for name in names
    )
    places = {name: twice[name] for name in names} | {"s": runs[0].s, "omega": 0 * twice["theta"]}
    return Solution(t=runs[0].t, energy=runs[0].energy, **places), off


def _apart(scene: Scene, a: Solution, b: Solution, names: Iterable[str]) -> float:
    """The largest difference of two fields, at the places of the one with fewer places."""
    a, b = sorted((a, b), key=lambda run: run.s.size)
    return max(float(np.abs(getattr(a, name) - _at(scene, b, name, a.s)).max()) for name in names)


def _at(scene: Scene, field: Solution, name: str, s: Float) -> Float:
    """A field at places s: the values at its nodes, or a spline of degree 5 through them."""
    near = np.clip(np.searchsorted(field.s, s), 0, field.s.size - 1)
    near -= (near > 0) & (np.abs(field.s[near - 1] - s) < np.abs(field.s[near] - s))
    values: Float = getattr(field, name)
    if np.allclose(field.s[near], s, rtol=0, atol=1e-9 * scene.rod.length):
        return values[:, near]
    places = field.s
    if scene.closed:
        more = {"x": scene.shift[0], "y": scene.shift[1], "phi": 2 * np.pi * scene.turns}.get(name, 0.0)
        places, values = np.append(places, scene.rod.length), np.concatenate([values, values[:, :1] + more], axis=1)
    found: Float = scipy.interpolate.make_interp_spline(places, values, 5, axis=1)(s)
    return found


def _chains_end(drawn: Drawn, seconds: float) -> str:
    """What chains of "gauss8" with short steps do after a refusal: whether they end too, and when."""
    said = []
    for n in (65, 129):
        try:
            with at_most(seconds / 2), warnings.catch_warnings(action="ignore"):
                problem = lump(drawn.scene, n, "springs" if drawn.scene.steered else "consistent")
                dt = min(problem.chain.k / 4, problem.duration / 400)
                run = simulate(problem, Gauss8(tolerance=1e-12, sweeps=20), dt, 2, progress=False)
            said.append(f"N = {n} goes on to the end, {run.stats['unconverged']} steps unconverged")
        except TimeUp:
            said.append(f"N = {n} took too long")
        except (ValueError, SimulationError, ArithmeticError) as error:
            said.append(f"N = {n}: {error}")
    return "; ".join(said)


def trust(
    scenes: int = 200,
    seed: int = 0,
    first: int = 0,
    seconds: float = 60.0,
    executor: Executor | None = None,
    archive: str | Path | None = None,
    progress: bool = True,
    loads: bool = False,
) -> Trust:
    """Solve and run random scenes to random tolerances, 1e-2 to 1e-7, and measure the errors.

    Parameters
    ----------
    scenes : number of scenes, from index `first` on; their kinds alternate (`random_scenes.KINDS`).
    seed : seed of the scenes and tolerances.
    seconds : processor time allowed for one `solve` or `simulate`, s; two to four times that for its reference.
    executor, archive, progress : as for `compare.sweep`.
    loads : whether parameters vary along the rod, and scenes have loads (`compare.random_loads`).

    Raises
    ------
    ValueError : for numbers outside their range.
    """
    cases = cases_of(seed, first, checks.whole("scenes", scenes, 1), seconds, loads)
    return gathered(sweep(examine, cases, executor, archive, progress))


def gathered(results: Iterable[Result]) -> Trust:
    """The rows of the results of a sweep so far."""
    found = sorted(results, key=lambda result: result.case)
    return Trust([Row(*row) for r in found if not r.error for row in r.value], [r for r in found if r.error])
