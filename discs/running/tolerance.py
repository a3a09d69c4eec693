"""A run to a tolerance: which method, which step, by comparing runs with steps that shrink."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discs import checks
from discs.integrators import Gauss6, Gauss8, Integrator, Midpoint, find
from discs.integrators.composition import Composition
from discs.integrators.gauss import Gauss
from discs.problem import Problem, State
from discs.running.stats import Stats
from discs.running.suggest import suggest_dt
from discs.running.time_loop import SimulationError
from discs.solution import Solution

USUAL = 1e-3  # the tolerance where none is given
LEAST = 1e-12  # the least tolerance: some thousand times the rounding of a position
LOOSE = 3e-4  # from here on "auto" begins with the midpoint method
FEWEST = 20  # steps to begin with
PROBES = 101  # frames that runs are compared at during the search, at most
ORDERS = (2.0, 1.75, 1.5, 1.25, 1.0, 0.75, 0.5)  # of errors, as they are seen
SAFETY = 2.0  # steps are not yet small when errors are large: found by experiment
SURE = 1.5  # no error is estimated below so many times the change
STALL = 0.5  # order seen from run to run: at it or below the error has stalled
GROWTH = 1.5, 3.0  # of the number of steps from run to run
ENDED = 0.01  # |r'| of a disc a step before it loses its heading; where it is larger, the step is too long
ATTEMPTS, FAILURES = 20, 12  # runs, and those of them that may stop early
SHARED = 100  # steps that may each leave what the sweeps' tolerance says
SWEPT = 10.0  # what sweeps leave, in units of their tolerance
ROUNDED = 1e-12  # largest value of what is rounding only, in units of its scale

RATES = ("omega", "phi_rate", "x_rate", "y_rate")
DERIVED = (*RATES, "slope_x", "slope_y", "contact_force", "modified_energy")
WANTED = {"velocity": ("x_rate", "y_rate"), "slope": ("slope_x", "slope_y"), "contact_force": ("contact_force",)}

Run = Callable[[Problem, Integrator, float, NDArray], Solution]


def names(problem: Problem, want: Iterable[str] = ()) -> tuple[str, ...]:
    """The quantities that a run records and a tolerance can bind."""
    rows = problem.system.rows
    turning = ("phi_rate",) if "phi" in rows else ()
    return (*rows, "omega", *turning, *(name for key in want for name in WANTED.get(key, ())))


def method_for(method: str | Integrator, tol: float, stalled: int = 0) -> Integrator:
    """The integrator for a tolerance, its sweeps converged well below it; "auto" chooses, and goes on where one has `stalled`."""
    if method == "auto":
        if tol >= LOOSE and not stalled:
            return Midpoint(tolerance=min(1e-2 * tol, 1e-4))
        return (Gauss8 if stalled + (tol < LOOSE) > 1 else Gauss6)(tolerance=_swept(min(tol, LOOSE)))
    integrator = find(method)
    if isinstance(method, str) and isinstance(integrator, Midpoint | Gauss):
        return replace(integrator, tolerance=_swept(tol))
    if isinstance(method, str) and isinstance(integrator, Composition):
        return replace(integrator, base=Midpoint(tolerance=_swept(tol)))
    if integrator.adaptive:
        raise ValueError(f"{integrator.name} has tolerances of its own: {type(integrator).__name__}(rtol=..., atol=...)")
    return integrator


def _swept(tol: float) -> float:
    return max(1e-3 * tol, 1e-13)


def sharpened(integrator: Integrator, steps: int) -> Any:
    """The integrator with its sweeps' tolerance shared out among steps beyond SHARED: what sweeps leave adds up."""
    if isinstance(integrator, Composition):
        return replace(integrator, base=sharpened(integrator.base, steps))
    if isinstance(integrator, Midpoint | Gauss) and integrator.tolerance > 0:
        return replace(integrator, tolerance=min(integrator.tolerance, max(integrator.tolerance * SHARED / steps, 1e-13)))
    return integrator


def tolerance_of(integrator: Integrator) -> float:
    """The tolerance of its sweeps, 0 for an explicit one."""
    return float(getattr(getattr(integrator, "base", integrator), "tolerance", 0.0))


def to_tolerance(
    problem: Problem,
    method: str | Integrator,
    tol: float | Mapping[str, float],
    times: NDArray,
    run: Run,
    want: Iterable[str] = (),
) -> Solution:
    """Run with smaller and smaller steps until the last change says that the tolerance is kept.

    Errors of two runs, steps h and h/r, are taken to be as 1 to r^-p: the error of the finer is then the change over r^p - 1; twice
    that, and no less than 1.5 times the change, is the estimate. The order p is what the last three runs show, at most 2 (stiff
    modes reduce that of higher methods), and little where waves that no step resolves yet are in what changes; it is 1 after two
    runs. What sweeps leave, some times their tolerance, is added. The energy is known: its error is what it changed by.

    A motion ends where a disc loses its heading: told by its |r'| a step before, and by runs of two steps that lose it at one time.
    "auto" goes on with a method of higher order where the change stalls, twice in a row. The search fails where the change of two
    runs is that of two runs that start one unit in the last place apart: then it is rounding, amplified by the motion.

    Parameters
    ----------
    problem, method : as `simulate` takes them.
    tol : largest error over discs and frames, relative to the largest value: of x, y, theta (and phi), or of the quantities named.
    times : frames, (F,).
    run : (problem, integrator, dt, times) -> Solution.
    want : what is recorded besides.

    Returns
    -------
    Solution of the last run, with `error_estimate` of every quantity recorded, over all frames; stats["attempts"] counts the runs.

    Raises
    ------
    ValueError : for a tolerance below what doubles can reach, or of what is not recorded.
    NotReached : if the tolerance is not reached.
    SimulationError : if the motion ends before, or runs fail at every step.
    """
    rows = problem.system.rows
    bound = checks.tolerances(tol, names(problem, want), rows, LEAST)
    sharpest = min(value if name in rows else 1e-2 * value for name, value in bound.items())  # sweeps are told by moves, not rates
    integrator = method_for(method, sharpest)
    if not times[-1]:
        start = run(problem, integrator, problem.duration / FEWEST, times)
        return _told(start, dict.fromkeys(_compared(start), 0.0), tol, 1)
    some = some_of(times)
    steps, level, stalls, failures, worst = _fewest(problem, integrator, times[-1]), 0, 0, 0, np.inf
    last: Solution | None = None
    change: Change | None = None
    failure: SimulationError | None = None
    for attempt in range(1, ATTEMPTS + 1):
        dt, sharp = times[-1] / steps, sharpened(integrator, steps)
        try:
            found = run(problem, sharp, dt, some)
            failure = None
        except SimulationError as error:
            if failure and error.slope < ENDED and abs(error.time - failure.time) < 3 * dt:  # the last dt was twice that
                raise
            failure, failures = error, failures + 1
            if failures == FAILURES:
                raise
        if failure or found.stats["unconverged"]:
            steps, last, change = 2 * steps, None, None
            continue
        if last is not None:
            earlier, change = change, Change(last, found)
            errors = estimates(found, change, earlier, tolerance_of(sharp))
            worst = _worst(found, errors, bound)
            if worst <= 1 and some.size < times.size:
                last, found = (run(problem, sharp, h, times) for h in (last.stats["dt"], dt))
                errors = estimates(found, Change(last, found), earlier, tolerance_of(sharp))
                worst = _worst(found, errors, bound)
            if worst <= 1:
                return _told(found, errors, tol, attempt)
            stalled = earlier is not None and min(change.order(name, earlier) for name in bound) <= STALL
            stalls = stalls + 1 if stalled else 0
            if stalls >= 2:
                if method == "auto" and method_for(method, sharpest, level + 1) != integrator:
                    level, stalls, worst, last, change = level + 1, 0, np.inf, None, None
                    integrator, steps = method_for(method, sharpest, level), max(FEWEST, steps // 4)
                    continue
                floor = _worst(found, _differences(found, run(_nudged(problem), sharp, dt, found.t)), bound)
                if floor > worst / 10:
                    raise NotReached(_tight(bound), worst, dt, floor, _told(found, errors, tol, attempt))
        last = found
        growth = 2.0 if not np.isfinite(worst) else float(np.clip(1.1 * worst**0.4, *GROWTH))
        steps = int(np.ceil(growth * steps))
    if last is None or change is None:
        raise failure or SimulationError(f"steps do not converge, down to dt = {dt:g}; take another method", 0, 0.0, 0)
    raise NotReached(_tight(bound), worst, dt, None, _told(found, errors, tol, ATTEMPTS))


def some_of(times: NDArray) -> NDArray:
    """The frames that the search looks at, of all."""
    return times if times.size <= PROBES else times[np.linspace(0, times.size - 1, PROBES).round().astype(int)]


class NotReached(SimulationError):
    """A tolerance that was not reached.

    Attributes
    ----------
    best : the last run, with its estimate.
    """

    def __init__(self, tol: float, worst: float, dt: float, floor: float | None, best: Solution) -> None:
        what = f"tol = {tol:g} was not reached: the error is estimated at {tol * worst:.1e} with dt = {dt:g}"
        if floor is None:
            why = f"and {ATTEMPTS} runs with smaller and smaller steps were made; take a larger tol or another method"
        else:
            why = f"and runs that start one unit in the last place apart differ by {tol * floor:.1e}, so rounding is what is left; "
            why += "take a larger tol, or end the run earlier"
        super().__init__(f"{what}, {why}", best.stats["steps"], best.t[-1], 0)
        self.best, self._given = best, (tol, worst, dt, floor, best)

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), self._given


class Change:
    """What changed from a run to one with shorter steps: `ratio` of the steps, largest differences `of` each quantity."""

    def __init__(self, last: Solution, found: Solution) -> None:
        self.ratio, self.of = last.stats["dt"] / found.stats["dt"], _differences(found, last)

    def order(self, name: str, earlier: "Change | None") -> float:
        """The order of a quantity's error, from this change and an earlier one, of the steps before: of ORDERS; 1 if not known.

        Errors C h^p change by C h^p (r^p - 1) from steps h r to h, so changes are as r^p (s^p - 1) to r^p - 1, s the ratio before.
        """
        if earlier is None:
            return 1.0
        r, s, now, then = self.ratio, earlier.ratio, self.of[name], earlier.of[name]
        return next((p for p in ORDERS if then * (r**p - 1) >= now * r**p * (s**p - 1)), ORDERS[-1])


def estimates(found: Solution, change: Change, earlier: Change | None, swept: float) -> dict[str, float]:
    """Errors of a run, largest over discs and frames; see `to_tolerance`. swept : the sweeps' tolerance."""
    assert found.problem is not None
    system, dt = found.problem.system, found.stats["dt"]
    length = float(system.scale[0])
    left = dict(zip(system.rows, system.scale.tolist(), strict=True))
    left |= {"omega": 1 / dt, "phi_rate": 1 / dt, "x_rate": length / dt, "y_rate": length / dt}
    errors = {
        name: value * max(SURE, SAFETY / (change.ratio ** change.order(name, earlier) - 1)) + SWEPT * swept * left.get(name, 0.0)
        for name, value in change.of.items()
    }
    return errors | {"energy": float(np.abs(found.energy - found.problem.energy()).max())}


def _compared(found: Solution) -> list[str]:
    """Names of what a run records of its motion."""
    assert found.problem is not None
    recorded = (*found.problem.system.rows, *DERIVED, "energy")
    return [name for name in recorded if getattr(found, name) is not None]


def _differences(one: Solution, other: Solution) -> dict[str, float]:
    return {name: float(np.abs(getattr(one, name) - getattr(other, name)).max()) for name in _compared(one)}


def _worst(found: Solution, errors: dict[str, float], bound: dict[str, float]) -> float:
    """The largest error in units of its tolerance."""
    assert found.problem is not None
    system = found.problem.system
    scale = dict(zip(system.rows, system.scale, strict=True))

    def size(name: str) -> float:
        largest = float(np.abs(getattr(found, name)).max())
        return largest if largest > ROUNDED * scale.get(name, 0.0) else scale.get(name, 1.0)

    return max(errors[name] / (tol * size(name)) for name, tol in bound.items())


def _told(found: Solution, errors: dict[str, float], tol: float | Mapping[str, float], attempts: int) -> Solution:
    """The run with what was found out about it."""
    told: Stats = {"tol": dict(tol) if isinstance(tol, Mapping) else tol, "attempts": attempts}
    return replace(found, error_estimate=errors, stats=found.stats | told)


def _tight(bound: dict[str, float]) -> float:
    return min(bound.values())


def _fewest(problem: Problem, integrator: Integrator, end: float) -> int:
    """Steps to begin with."""
    if not np.isfinite(integrator.stability_limit):
        return FEWEST
    return max(FEWEST, int(np.ceil(end / suggest_dt(problem, integrator))))


def _nudged(problem: Problem) -> Problem:
    """The problem from positions and angles one unit in the last place away, to either side."""
    start, rng = problem.initial, np.random.default_rng(0)

    def nudge(value: NDArray) -> NDArray:
        return np.nextafter(value, value + rng.choice((-1.0, 1.0), value.shape))

    moved = {name: nudge(np.array(getattr(start, name))) for name in problem.system.rows}
    rates = {"omega": start.omega, "phi_rate": start.phi_rate}
    return replace(problem, initial=State(**moved, **rates))
