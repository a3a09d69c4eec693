"""Runs to a tolerance: the choice of method and step.

Input: a problem, tolerances and frames. Output: a run within the tolerances, with estimates of its errors.

1. Run with a number of steps that is guessed from the chain, then with more (`discs.running.steps`).
2. Estimate the error of the run with longer steps from the run with shorter ones. Errors C (h r)^p and C h^p differ by
   C (h r)^p (1 - r^-p), so the error of the longer steps is d/(1 - r^-p), with d the largest difference over discs and frames. The
   estimate is SAFETY times that, plus the error left by sweeps. It hardly depends on p, so the run with the *longer* steps is the
   result. The error of the shorter ones, d/(r^p - 1), depends on p, which varies by up to 4 from run to run while waves are not
   resolved.
3. Three runs give p: the last one is the reference for the errors of the two before. After two runs p = 1. If the difference,
   relative to the largest value, is below RESOLVED, p is at least 2 after two runs, and 1 after three. Estimates use at most
   MOST_ORDER.
4. If the estimate is within every tolerance, stop. Otherwise go to 2 with more steps, such that C h^p is the tolerance over AIM;
   or, if the run with shorter steps is finer than that needs, with fewer steps than it has: it then is the reference again. The p
   assumed is that of step 3, at least SLOWEST; after two runs it is the usual one.
5. The error has stalled if p is at most LEAST_ORDER, or if it does not fall below those before. After two stalls in a row "auto"
   takes a method of higher order. If there is none, the last run is repeated with initial positions moved by one unit in the last
   place. If they differ by a tenth of the error or more, or if sweeps that converged to rounding may leave as much, rounding is
   the limit, and `NotReached` is raised. For tolerances below FINE, or after LATE runs, this test is made as soon as errors are
   below RESOLVED; if the difference exceeds the tolerance, no step can reach it.
6. A search that has taken long while its errors stay large looks until when the tolerance can be held at all
   (`discs.running.held`). If that is before the end, `NotReached` names the time.
7. If a run fails, or its sweeps do not converge, the number of steps is doubled, or grows more if the run failed early. If a disc
   loses its heading, the motion itself ends there, provided that its |r'| one step before is below ENDED and that two runs in a row
   lose it at the same time.

The tolerance of sweeps is such that all steps together leave an error of SWEPT times the tolerance
(`discs.running.estimates.sweeps_to`). The constants in capitals were found by experiment, on random problems with other seeds than
those of docs/trust.md.
"""

from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.integrators import Gauss6, Gauss8, Integrator, Midpoint, find
from discs.problem import Problem
from discs.running import estimates
from discs.running.by_dop853 import search_explicit
from discs.running.estimates import LEAST_ORDER
from discs.running.failure import NotReached, SimulationError
from discs.running.held import Looks, parted
from discs.running.steps import FEWEST, SLOWEST, after_failure, first_steps, next_steps, second_steps, usual
from discs.solution import Solution
from discs.stats import Stats

USUAL = 1e-3  # the default tolerance
LEAST = 1e-12  # the least tolerance: some thousand times the rounding of a position
LOOSE = {3: 3e-4, 4: 3e-3}  # least tolerance at which "auto" begins with the midpoint method, by rows: slaved and own headings
TIGHT = 1e-6  # largest tolerance at which "auto" begins with the last method
PROBES = 101  # frames at which runs are compared during the search, at most
RESOLVED = 1e-2  # relative error below which a motion is resolved, and the effect of rounding is tested
ORDERS, SMOOTH_ORDERS = (
    (1.0, LEAST_ORDER),
    (2.0, 1.0),
)  # least orders in estimates, after two runs and after more; of resolved motions
FINE = 1e-9  # tolerance below which the effect of rounding is tested early
STALLED = 2  # stalls in a row after which the search changes
LATE = 8  # runs after which it is tested in any case
ENDED = 0.01  # |r'| of a disc one step before it loses its heading; if it is larger, the step is too long
ATTEMPTS, FAILURES = 28, 16  # runs at most, and failures among them
COARSE = 4  # steps to a factor of two that searches side by side choose from: more runs then have the same step

WANTED = {"velocity": ("x_rate", "y_rate"), "slope": ("slope_x", "slope_y"), "contact_force": ("contact_force",)}
LADDER = Midpoint(), Gauss6(), Gauss8()  # the methods of "auto", in this order

Request = tuple[Problem, Integrator, float, Float]  # a run: problem, method, step, times of frames
Run = Callable[[Problem, Integrator, float, Float], Solution]
Found = TypeVar("Found")
Search = Generator[Request, Solution, Found]  # asks for runs and is sent them, or thrown their `SimulationError`


def names(problem: Problem, want: Iterable[str] = ()) -> tuple[str, ...]:
    """The recorded quantities that a tolerance can apply to."""
    system = problem.system
    return (*system.rows, *system.rates[2:], *(name for key in want for name in WANTED.get(key, ())))


def methods_for(method: str | Integrator, tol: float, rows: int = 3) -> tuple[Integrator, ...]:
    """The integrators for a tolerance of a system with so many rows: the first one, and those to take after a stall."""
    if method == "auto":
        return LADDER if tol >= LOOSE[rows] else LADDER[1:] if tol > TIGHT else LADDER[2:]
    integrator = find(method)
    if integrator.adaptive:
        raise ValueError(f"{integrator.name} has tolerances of its own: {type(integrator).__name__}(rtol=..., atol=...)")
    return (integrator,)


def to_tolerance(
    problem: Problem,
    method: str | Integrator,
    tol: float | Mapping[str, float],
    times: Float,
    run: Run,
    want: Iterable[str] = (),
) -> Solution:
    """The run that `search` finds. run : (problem, integrator, dt, times) -> Solution."""
    return answered(search(problem, method, tol, times, want), run)


def answered(asking: Search[Found], run: Run) -> Found:
    """The result of a search whose runs are made one after the other."""
    reply: Callable[[], Request] = partial(next, asking)
    while True:
        try:
            request = reply()
        except StopIteration as done:
            found: Found = done.value
            return found
        try:
            reply = partial(asking.send, run(*request))
        except SimulationError as error:
            reply = partial(asking.throw, error)


def search_with_doubt(
    problem: Problem,
    method: str | Integrator,
    tol: float | Mapping[str, float] | None,
    times: Float,
    want: Iterable[str] = (),
    coarse: bool = False,
    explicit: bool = False,
) -> Search[tuple[Solution, str]]:
    """As `search`, and a warning or "". With "auto" and without a tolerance the last run is the result even if `USUAL` was not
    reached, with a warning."""
    try:
        return (yield from search(problem, method, USUAL if tol is None else tol, times, want, coarse, explicit)), ""
    except NotReached as error:
        if tol is not None or method != "auto":
            raise
        return error.best, f"{error.message}: this is the last run"


def search(
    problem: Problem,
    method: str | Integrator,
    tol: float | Mapping[str, float],
    times: Float,
    want: Iterable[str] = (),
    coarse: bool = False,
    explicit: bool = False,
) -> Search[Solution]:
    """Run with shorter and shorter steps until the estimated error is within the tolerance; the algorithm is above.

    Parameters
    ----------
    problem, method : as `simulate` takes them.
    tol : tolerance of the largest error over discs and frames, relative to the largest value, for x, y, theta (and phi) or for the
        quantities named.
    times : frames, (F,).
    want : further quantities to record.
    coarse : choose steps and tolerances of sweeps from a few, the next ones that are not larger; begin with FEWEST steps.
    explicit : "auto" may try "DOP853" first.

    Returns
    -------
    Solution with `error_estimate` of every recorded quantity, over all frames. stats["attempts"] is the number of runs.
    stats["limited_by"] says what determined the accuracy: "tolerance"; "fewest steps", if there was no run with longer steps; or
    "sweeps", if they are most of the estimate. In the last two cases the error may be far below the tolerance or the estimate.

    Raises
    ------
    ValueError : for a tolerance below the accuracy of doubles, or for a quantity that is not recorded.
    NotReached : if the tolerance is not reached.
    SimulationError : if the motion ends before the last frame, or if runs fail with every step.
    """
    bound = checks.tolerances(tol, names(problem, want), problem.system.rows, LEAST)
    least_tol = min(bound.values())
    integrator, *higher = methods_for(method, least_tol, len(problem.system.rows))
    if not times[-1]:
        start = yield problem, integrator, problem.duration / FEWEST, times
        return _with_search(start, dict.fromkeys(estimates.compared(start), 0.0), tol, 1, "fewest steps")
    end, some, made = float(times[-1]), some_of(times), 0
    if method == "auto" and explicit and some.size == times.size:
        fitting, known, made = yield from search_explicit(problem, bound, times)
        if fitting is not None:
            return _with_search(fitting, known, tol, made, "fewest steps" if made == 2 else "tolerance")
    rows = len(problem.system.rows)
    steps = FEWEST if coarse else first_steps(problem, integrator, least_tol, end)
    runs: list[Solution] = []  # of one method, at most three, with shorter and shorter steps
    sweeps: dict[float, Integrator] = {}  # the method with its tolerance of sweeps, by the step of a run
    size: dict[str, float] = {}
    failure: SimulationError | None = None
    failed_dt = 0.0
    looked, stalls, failures, best_yet, looks = False, 0, 0, np.inf, Looks(problem, end)

    def assumed(least: float, names: Iterable[str] | None = None) -> dict[str, float]:
        """The orders, at least `least`, of the errors of some quantities, or of all."""
        if len(runs) < 3:
            return dict.fromkeys(estimates.compared(runs[0]) if names is None else names, least)
        found = estimates.orders(runs[0], runs[1], runs[2], integrator.order, names)
        return {name: max(order, least) for name, order in found.items()}

    def result(longer: Solution, shorter: Solution, limit: str) -> Solution:
        """The run with longer steps, with estimates of all its errors."""
        errors = estimates.errors(longer, shorter, assumed(least_order), sweeps[longer.stats["dt"]].sweep_tolerance)
        return _with_search(longer, errors, tol, made + attempt, limit)

    for attempt in range(1, ATTEMPTS + 1):
        dt = end / steps
        swept = estimates.sweeps_to(problem, bound, size, dt, end)
        swept = float(4.0 ** np.floor(0.5 * np.log2(swept))) if coarse else swept
        sharp = _sharpened(integrator, isinstance(method, str), swept)
        try:
            found = yield problem, sharp, dt, some
            failure = None
            looks.count(found)
        except SimulationError as error:
            if failure and error.slope < ENDED and abs(error.time - failure.time) < 1.5 * failed_dt:
                raise
            failure, failures, failed_dt = error, failures + 1, dt
            if failures == FAILURES:
                raise
        if failure or found.stats["unconverged"]:
            steps, runs = after_failure(steps, failure.time if failure else None, end), []
            continue
        runs = sorted([*runs[-2:], found], key=lambda run: -run.stats["dt"])
        size, sweeps[dt] = estimates.sizes(runs[-1], bound), sharp
        if len(runs) == 1:
            steps = second_steps(steps)
            continue
        first, longer, shorter = len(runs) == 2, runs[-2], runs[-1]
        apart = estimates.differences(longer, shorter, bound)
        smooth = max(apart[name] / size[name] for name in bound) < RESOLVED
        least_order = (SMOOTH_ORDERS if smooth else ORDERS)[not first]
        order = assumed(least_order, bound)
        swept = sweeps[longer.stats["dt"]].sweep_tolerance
        errors = estimates.errors(longer, shorter, order, swept, bound)
        worst = estimates.worst(errors, bound, size)
        if worst <= 1 and some.size < times.size:
            longer = yield problem, sweeps[longer.stats["dt"]], longer.stats["dt"], times
            shorter = yield problem, sweeps[shorter.stats["dt"]], shorter.stats["dt"], times
            errors = estimates.errors(longer, shorter, order, swept, bound)
            worst = estimates.worst(errors, bound, estimates.sizes(shorter, bound))
        left = estimates.worst(estimates.unswept(longer, swept), bound, size)
        limit = "fewest steps" if first else "sweeps" if left > worst / 2 else "tolerance"
        if worst <= 1:
            return result(longer, shorter, limit)
        largest = max(bound, key=lambda name: errors[name] / bound[name] / size[name])
        seen = ORDERS[0] if first else assumed(LEAST_ORDER, (largest,))[largest]
        stalls = stalls + 1 if not first and (seen <= LEAST_ORDER or worst >= best_yet) else 0
        best_yet = best_yet if first else min(best_yet, worst)
        relative = max(errors[name] / size[name] for name in bound)
        allowed = {name: tolerance * size[name] for name, tolerance in bound.items()}
        if looks.wanted(relative):
            until = yield from looks.look(allowed)
            if until < end:
                raise NotReached(least_tol, worst, longer.stats["dt"], None, result(longer, shorter, limit), attempt, until)
        due = not looked and (attempt >= LATE or least_tol < FINE)
        resolved = due and relative < RESOLVED
        if resolved or (stalls >= STALLED and not higher):
            looked = True
            other = yield estimates.nudged(problem), sharp, dt, found.t
            floor = estimates.worst(estimates.differences(found, other), bound, size)
            if sharp.sweep_tolerance <= estimates.LEAST_SWEPT:  # sweeps that converged to rounding
                floor = max(floor, estimates.worst(estimates.unswept(found, sharp.sweep_tolerance), bound, size))
            if floor > (1 if resolved else worst / 10):
                until = parted(found, other, allowed)
                raise NotReached(least_tol, worst, longer.stats["dt"], floor, result(longer, shorter, limit), attempt, until)
        if stalls >= STALLED and higher:
            integrator, *higher = higher
            steps, runs, stalls, best_yet = max(FEWEST, steps // 4), [], 0, np.inf
            continue
        p = usual(integrator.order, rows) if first else max(seen, SLOWEST)
        steps = _one_of_a_few(next_steps(longer.stats["steps"], shorter.stats["steps"], worst, p, first), coarse)
    if len(runs) < 2:
        raise failure or SimulationError(f"steps do not converge, down to dt = {dt:g}; take another method", 0, 0.0, 0)
    raise NotReached(least_tol, worst, longer.stats["dt"], None, result(longer, shorter, limit), ATTEMPTS)


def some_of(times: Float) -> Float:
    """The times at which the search compares runs, at most PROBES."""
    return times if times.size <= PROBES else times[np.linspace(0, times.size - 1, PROBES).round().astype(int)]


def _sharpened(integrator: Integrator, free: bool, tolerance: float) -> Integrator:
    """The integrator with this tolerance of sweeps; unless `free`, with its own one if that is smaller."""
    return integrator.with_sweeps(tolerance if free else min(tolerance, integrator.sweep_tolerance))


def _one_of_a_few(steps: float, coarse: bool) -> int:
    """The number of steps; if coarse, the next one of COARSE to a factor of two."""
    return int(np.ceil(2.0 ** (np.ceil(COARSE * np.log2(steps)) / COARSE) if coarse else steps))


def _with_search(run: Solution, errors: dict[str, float], tol: float | Mapping[str, float], attempts: int, limit: str) -> Solution:
    """The run with its estimates and the stats of the search."""
    told: Stats = {"tol": dict(tol) if isinstance(tol, Mapping) else tol, "attempts": attempts, "limited_by": limit}
    return replace(run, error_estimate=errors, stats=run.stats | told)
