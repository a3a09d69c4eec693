"""A run to a tolerance: which method, which step.

Given a problem, tolerances and frames, find a run and the errors of what it records.

1. Run with FEWEST steps, and with twice as many and one (steps that alternate are not to agree by chance).
2. The run with shorter steps measures the error of the one before. Errors C (h r)^p and C h^p differ by C (h r)^p (1 - r^-p): the
   longer steps err by d/(1 - r^-p), d the largest difference over discs and frames. SAFETY times that, and what sweeps may leave,
   is the estimate. It hardly depends on p. So the run with the *longer* steps is the result: its error is known. That of the
   shorter ones, d/(r^p - 1), is known only as well as p, which changes by up to 4 from run to run while waves are not yet resolved.
3. Three runs show p: the last measures the errors of both before. After two runs p = 1. Estimates count on MOST_ORDER at most.
4. If the estimate is within every tolerance, that is the result. If not, go to 2 with more steps, by a factor within GROWTH: so
   many that C h^p reaches the tolerance over AIM.
5. The error has stalled if p is at most LEAST_ORDER. "auto" takes a method of higher order after two stalls in a row. Where there
   is none, a stall asks for the cause: a run whose positions start one unit in the last place away. If it differs by a tenth of the
   error or more, rounding is the limit, and `NotReached` is raised. For tolerances below FINE such a run is made as soon as errors
   are below RESOLVED; if it differs by more than the tolerance, no step can help.
6. A run that fails, or whose sweeps do not converge, is followed by one of twice as many steps. The motion itself ends where a disc
   loses its heading: told by its |r'| a step before, and by runs of two steps that lose it at one time.

Sweeps converge to a tolerance that leaves SWEPT of what is asked for after all steps (`discs.running.estimates.sweeps_to`). The
constants in capitals were found by experiment, on random problems of other seeds than those of docs/trust.md.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discs import checks
from discs.integrators import Gauss6, Gauss8, Integrator, Midpoint, find, from_settings
from discs.problem import Problem
from discs.running import estimates
from discs.running.estimates import LEAST_ORDER
from discs.running.stats import Stats
from discs.running.suggest import suggest_dt
from discs.running.time_loop import SimulationError
from discs.solution import Solution

USUAL = 1e-3  # the tolerance where none is given
LEAST = 1e-12  # the least tolerance: some thousand times the rounding of a position
LOOSE = 3e-4  # from here on "auto" begins with the midpoint method
FEWEST = 20  # steps to begin with
PROBES = 101  # frames that runs are compared at during the search, at most
GROWTH = 1.5, 3.0  # of the number of steps from run to run
AIM = 1.3  # times fewer errors than the order foretells are aimed at
RESOLVED = 1e-2  # relative error: from here on a motion tells what rounding does to it
FINE = 1e-6  # tolerances below are held against rounding first
ENDED = 0.01  # |r'| of a disc a step before it loses its heading; where it is larger, the step is too long
ATTEMPTS, FAILURES = 24, 12  # runs, and those of them that may stop early

WANTED = {"velocity": ("x_rate", "y_rate"), "slope": ("slope_x", "slope_y"), "contact_force": ("contact_force",)}
LADDER = Midpoint(), Gauss6(), Gauss8()  # what "auto" takes, one after the other

Run = Callable[[Problem, Integrator, float, NDArray], Solution]


def names(problem: Problem, want: Iterable[str] = ()) -> tuple[str, ...]:
    """The quantities that a run records and a tolerance can bind."""
    system = problem.system
    return (*system.rows, *system.rates[2:], *(name for key in want for name in WANTED.get(key, ())))


def methods_for(method: str | Integrator, tol: float) -> tuple[Integrator, ...]:
    """The integrators for a tolerance: the first, and those that follow where one stalls."""
    if method == "auto":
        return LADDER if tol >= LOOSE else LADDER[1:]
    integrator = find(method)
    if integrator.adaptive:
        raise ValueError(f"{integrator.name} has tolerances of its own: {type(integrator).__name__}(rtol=..., atol=...)")
    return (integrator,)


def to_tolerance(
    problem: Problem,
    method: str | Integrator,
    tol: float | Mapping[str, float],
    times: NDArray,
    run: Run,
    want: Iterable[str] = (),
) -> Solution:
    """Run with shorter and shorter steps until a run is known to be within the tolerance; the algorithm is that of the module.

    Parameters
    ----------
    problem, method : as `simulate` takes them.
    tol : largest error over discs and frames, relative to the largest value: of x, y, theta (and phi), or of the quantities named.
    times : frames, (F,).
    run : (problem, integrator, dt, times) -> Solution.
    want : what is recorded besides.

    Returns
    -------
    Solution with `error_estimate` of every quantity recorded, over all frames. stats["attempts"] counts the runs, and
    stats["limited_by"] says what made it as accurate as it is: "tolerance"; "fewest steps", where its method went with no longer
    steps, or "sweeps", most of the estimate: then the error may be far below the tolerance, or the estimate.

    Raises
    ------
    ValueError : for a tolerance below what doubles can reach, or of what is not recorded.
    NotReached : if the tolerance is not reached.
    SimulationError : if the motion ends before, or runs fail at every step.
    """
    bound = checks.tolerances(tol, names(problem, want), problem.system.rows, LEAST)
    integrator, *higher = methods_for(method, min(bound.values()))
    if not times[-1]:
        start = run(problem, integrator, problem.duration / FEWEST, times)
        return _told(start, dict.fromkeys(estimates.compared(start), 0.0), tol, 1, "fewest steps")
    end, some = float(times[-1]), some_of(times)
    steps = _fewest(problem, integrator, end)
    runs: list[Solution] = []  # of one method, each with shorter steps than the one before, three at most
    size: dict[str, float] = {}
    failure: SimulationError | None = None
    looked, stalls, failures = False, 0, 0
    for attempt in range(1, ATTEMPTS + 1):
        dt = end / steps
        sharp = _sharpened(integrator, isinstance(method, str), estimates.sweeps_to(problem, bound, size, dt, end))
        try:
            found, failure = run(problem, sharp, dt, some), None
        except SimulationError as error:
            if failure and error.slope < ENDED and abs(error.time - failure.time) < 3 * dt:  # the last dt was twice that
                raise
            failure, failures = error, failures + 1
            if failures == FAILURES:
                raise
        if failure or found.stats["unconverged"]:
            steps, runs = 2 * steps, []
            continue
        runs, size = [*runs[-2:], found], estimates.sizes(found, bound)
        if len(runs) == 1:
            steps = 2 * steps + 1
            continue
        first = len(runs) == 2
        order = {} if first else estimates.orders(runs[0], runs[1], found, integrator.order)
        longer = runs[-2]
        errors = estimates.errors(longer, found, order)
        worst = _worst(errors, bound, size)
        if worst <= 1 and some.size < times.size:
            pair = (from_settings(longer.stats["settings"]), longer.stats["dt"]), (sharp, dt)
            longer, shorter = (run(problem, settings, h, times) for settings, h in pair)
            errors = estimates.errors(longer, shorter, order)
            worst = _worst(errors, bound, estimates.sizes(shorter, bound))
        swept = dict.fromkeys(bound, 0.0) | estimates.unswept(longer)
        limit = "fewest steps" if first else "sweeps" if _worst(swept, bound, size) > worst / 2 else "tolerance"
        best = _told(longer, errors, tol, attempt, limit)
        if worst <= 1:
            return best
        seen = 1.0 if first else order[max(bound, key=lambda name: errors[name] / bound[name] / size[name])]
        stalls = stalls + 1 if not first and seen <= LEAST_ORDER else 0
        resolved = min(bound.values()) < FINE and not looked and max(errors[name] / size[name] for name in bound) < RESOLVED
        if resolved or (stalls and not higher):
            looked = True
            floor = _worst(estimates.differences(found, run(estimates.nudged(problem), sharp, dt, found.t)), bound, size)
            if floor > (1 if resolved else worst / 10):
                raise NotReached(min(bound.values()), worst, best.stats["dt"], floor, best)
        if stalls >= 2 and higher:
            integrator, *higher = higher
            steps, runs, stalls = max(FEWEST, steps // 4), [], 0
            continue
        least, most = GROWTH
        wanted = longer.stats["steps"] * (AIM * worst) ** (1 / (integrator.order if first else max(seen, 1.0)))
        steps = int(np.ceil(np.clip(wanted, least * steps, most * steps)))
    if len(runs) < 2:
        raise failure or SimulationError(f"steps do not converge, down to dt = {dt:g}; take another method", 0, 0.0, 0)
    raise NotReached(min(bound.values()), worst, best.stats["dt"], None, best)


def some_of(times: NDArray) -> NDArray:
    """The frames that the search looks at, of all."""
    return times if times.size <= PROBES else times[np.linspace(0, times.size - 1, PROBES).round().astype(int)]


class NotReached(SimulationError):
    """A tolerance that was not reached.

    Attributes
    ----------
    best : the last run whose error is known, with its estimate.
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


def _sharpened(integrator: Integrator, free: bool, tolerance: float) -> Integrator:
    """The integrator with its sweeps converged to a tolerance, or to a smaller one of its own unless that is `free`."""
    return integrator.with_sweeps(tolerance if free else min(tolerance, integrator.sweep_tolerance))


def _worst(errors: Mapping[str, float], bound: Mapping[str, float], size: Mapping[str, float]) -> float:
    """The largest error in units of its tolerance."""
    return max(errors[name] / (tol * size[name]) for name, tol in bound.items())


def _told(run: Solution, errors: dict[str, float], tol: float | Mapping[str, float], attempts: int, limit: str) -> Solution:
    """The run with what was found out about it."""
    told: Stats = {"tol": dict(tol) if isinstance(tol, Mapping) else tol, "attempts": attempts, "limited_by": limit}
    return replace(run, error_estimate=errors, stats=run.stats | told)


def _fewest(problem: Problem, integrator: Integrator, end: float) -> int:
    """Steps to begin with."""
    if not np.isfinite(integrator.stability_limit):
        return FEWEST
    return max(FEWEST, int(np.ceil(end / suggest_dt(problem, integrator))))
