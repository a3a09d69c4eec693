"""Whether tolerances are kept: random scenes by `solve` and by `simulate(..., "auto")`, against references of another kind.

A scene is drawn (`compare.random_scenes`), and a tolerance for each of the two. What they find is held against

* chains : N discs, 2N and 4N, with ends of second order, extrapolated by the law 1/N^2: another discretisation. Their error is the
  change from one extrapolation to the next over three (`continuum.solver`), and that of their steps. They reach 1e-4 to 1e-6.
* finer : where chains err by more than a fifth of the tolerance, the field itself to a tenth of it, and to a fifth of its estimate:
  it would be the same run where that is small. It is another run and not another kind, so chains are compared too: `unlike` says by
  how many times their own error they differ from it.
* gauss8 : of discs, "gauss8" with steps eight times shorter; its error is what steps four times shorter change.

A reference that errs by more than a fifth of the tolerance is none, and the row says so. A run is given so many seconds of
processor time, and is cut off after.
"""

import re
import signal
import time as clock
import warnings
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from compare.lump import lump
from compare.random_scenes import Drawn, random_scene
from compare.sweeps import Result, sweep
from compare.trust_table import LEAST, Row, Trust
from continuum import Scene, breathing_ring, solve, steered_rod, untwisting_rod
from discs import Gauss8, SimulationError, Solution, checks, simulate
from discs.arrays import Float

FRAMES = 6
SIZES = (128, 256, 512)  # links of the chains of a reference
FINER = 10.0  # times smaller is the tolerance of a field that another is held against
KNOWN = 3.0  # an error below this many times the reference's own is not told from it: it has no ratio


class TimeUp(BaseException):
    """The processor time is used up; not an `Exception`, so that nothing on the way takes it for a failure."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise `TimeUp` after so much processor time of this process; where there is no such clock (Windows) never."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def up(*_: object) -> None:
        raise TimeUp

    before = signal.signal(signal.SIGPROF, up)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def examine(case: list[float]) -> list[list[Any]]:
    """The two rows of a case [seed, index, seconds]: called in other processes."""
    seed, index, seconds = int(case[0]), int(case[1]), float(case[2])
    _warm_up()
    drawn = random_scene(seed, index)
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


@cache
def _warm_up() -> None:
    """Have kernels compiled or loaded before any time counts."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for scene in (untwisting_rod(duration=0.1), steered_rod(duration=0.1), breathing_ring(duration=0.1)):
            solve(scene, 1e-3, frames=1, progress=False)
            for method in ("midpoint", "gauss6", "gauss8"):
                simulate(lump(scene, 9), method, 0.05, 1, progress=False)


def field_row(drawn: Drawn, row: Row, seconds: float) -> Row:
    """The field of a scene by `solve`."""
    scene = drawn.scene
    found, row = _tried(lambda: solve(scene, row.tol, frames=FRAMES, progress=False), row, seconds)
    if found is None:
        return row._replace(shown=_chains_end(drawn, seconds)) if row.outcome == "refused" else row
    names = ["x", "y", "theta", *(["phi"] if scene.steered else [])]
    estimate = max((found.error_estimate or {})[name] for name in names)
    row = row._replace(estimate=estimate)
    try:
        with at_most(2 * seconds), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            other, off = _chains(scene, names, row.tol)
            error = _apart(scene, found, other, names)
            if off <= row.tol / LEAST:
                return _judged(row, error, off, "chains")
            finer = solve(scene, min(row.tol / FINER, estimate / LEAST), frames=FRAMES, progress=False)
            own = max((finer.error_estimate or {})[name] for name in names)
            unlike = _apart(scene, finer, other, names) / off
            row = row._replace(unlike=unlike)
            return _judged(row, _apart(scene, found, finer, names), own, "finer")
    except (TimeUp, ValueError, SimulationError, ArithmeticError) as error:
        return row._replace(outcome="no reference", says=shorten(f"{row.says} reference: {type(error).__name__} {error}", 200))


def discs_row(drawn: Drawn, row: Row, seconds: float) -> Row:
    """The discs of a scene by `simulate(..., "auto")`."""
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
        with at_most(4 * seconds), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            near, far = (simulate(problem, Gauss8(tolerance=1e-14, sweeps=20), h / m, FRAMES, progress=False) for m in (8, 4))
        return _judged(row, apart(found, near), apart(near, far), "gauss8")
    except (TimeUp, ValueError, SimulationError, ArithmeticError) as error:
        return row._replace(outcome="no reference", says=shorten(f"reference: {type(error).__name__} {error}", 200))


def _tried(compute: Any, row: Row, seconds: float) -> tuple[Solution | None, Row]:
    """What is computed within the time, and the row with the seconds and what was said."""
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
    """The row with its error, known up to what the reference errs."""
    row = row._replace(error=float(error), estimate=float(row.estimate), reference=reference, reference_error=float(off))
    if off > row.tol / LEAST:
        return row._replace(outcome="no reference")
    ratio = row.estimate / row.error if error > KNOWN * off else np.nan
    return row._replace(outcome="within" if error <= row.tol + off else "ABOVE", ratio=ratio)


def _chains(scene: Scene, names: Iterable[str], tol: float) -> tuple[Solution, float]:
    """Chains extrapolated, and their error. Steps to a hundredth of the tolerance, or to what chains can err."""
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
    """The largest difference of two fields at the places of the one with fewer."""
    a, b = sorted((a, b), key=lambda run: run.s.size)
    return max(float(np.abs(getattr(a, name) - _at(scene, b, name, a.s)).max()) for name in names)


def _at(scene: Scene, field: Solution, name: str, s: Float) -> Float:
    """A field at places s, by its own nodes or a spline of degree 5 through them."""
    near = np.clip(np.searchsorted(field.s, s), 0, field.s.size - 1)
    near -= (near > 0) & (np.abs(field.s[near - 1] - s) < np.abs(field.s[near] - s))
    values: Float = getattr(field, name)
    if np.allclose(field.s[near], s, rtol=0, atol=1e-9 * scene.rod.length):
        return values[:, near]
    places = field.s
    if scene.closed:
        more = {"x": scene.shift[0], "y": scene.shift[1], "phi": 2 * np.pi * scene.turns}.get(name, 0.0)
        places, values = np.append(places, scene.rod.length), np.concatenate([values, values[:, :1] + more], axis=1)
    found: Float = make_interp_spline(places, values, 5, axis=1)(s)
    return found


def _chains_end(drawn: Drawn, seconds: float) -> str:
    """What chains of "gauss8" with short steps do where a field or a run was refused: whether, and when, they end too."""
    said = []
    for n in (65, 129):
        try:
            with at_most(seconds / 2), warnings.catch_warnings():
                warnings.simplefilter("ignore")
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
) -> Trust:
    """Solve and run random scenes to random tolerances, 1e-2 to 1e-7, and measure their errors.

    Parameters
    ----------
    scenes : how many, from number `first` on; their kinds take turns (`random_scenes.KINDS`).
    seed : of the scenes and tolerances.
    seconds : processor time that one `solve` or `simulate` may take, s; its reference two to four times that.
    executor, archive, progress : as for `compare.sweep`.

    Raises
    ------
    ValueError : for numbers outside their range.
    """
    start = checks.whole("first", first, 0)
    last = start + checks.whole("scenes", scenes, 1)
    limit = checks.number("seconds", seconds, positive=True)
    cases = [[checks.whole("seed", seed, 0), index, limit] for index in range(start, last)]
    return gathered(sweep(examine, cases, executor, archive, progress))


def gathered(results: Iterable[Result]) -> Trust:
    """The rows of what a sweep has found so far."""
    found = sorted(results, key=lambda result: result.case)
    return Trust([Row(*row) for r in found if not r.error for row in r.value], [r for r in found if r.error])
