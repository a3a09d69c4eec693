"""A run to a tolerance: which method, which step, by comparing runs with steps that shrink."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discs import checks
from discs.integrators import Gauss6, Integrator, Midpoint, find
from discs.integrators.composition import Composition
from discs.integrators.gauss import Gauss
from discs.marching import SimulationError
from discs.problem import Problem
from discs.solution import Solution
from discs.step import suggest_dt

LOOSE = 3e-4  # from here on "auto" takes the midpoint method
FEWEST = 20  # steps to begin with
PROBES = 33  # frames that runs are compared at
SAFETY = 2.0  # steps are not yet small when errors are large: found by experiment
ATTEMPTS = 20


def method_for(method: str | Integrator, tol: float) -> Integrator:
    """The integrator for a tolerance, its sweeps converged well below it; "auto" chooses."""
    if method == "auto":
        return Midpoint(tolerance=1e-2 * tol) if tol >= LOOSE else Gauss6(tolerance=max(1e-3 * tol, 1e-13))
    integrator = find(method)
    if isinstance(method, str) and isinstance(integrator, Midpoint | Gauss):
        return replace(integrator, tolerance=max(1e-3 * tol, 1e-13))
    if isinstance(method, str) and isinstance(integrator, Composition):
        return replace(integrator, base=Midpoint(tolerance=max(1e-3 * tol, 1e-13)))
    if integrator.adaptive:
        raise ValueError(f"{integrator.name} has tolerances of its own: {type(integrator).__name__}(rtol=..., atol=...)")
    return integrator


def to_tolerance(
    problem: Problem,
    method: str | Integrator,
    tol: float,
    times: NDArray,
    run: Callable[[Integrator, float, NDArray], Solution],
) -> Solution:
    """Run with smaller and smaller steps until the last change says that positions and angles are within `tol`.

    Errors of two runs, steps h and h/r, are taken to be as 1 to r^-2 even for methods of higher order, whose order stiff modes
    reduce: the error of the finer is then the change over r^2 - 1; twice that is the estimate.

    Parameters
    ----------
    problem, method : as `simulate` takes them.
    tol : largest error of x, y, theta (and phi) over discs and frames, relative to the largest value of each.
    times : frames, (F,).
    run : (integrator, dt, times) -> Solution.

    Returns
    -------
    Solution of the last run, with `error_estimate`; stats["attempts"] counts the runs.

    Raises
    ------
    SimulationError : if runs with smaller steps fail too, or the tolerance is not reached.
    """
    tol = checks.number("tol", tol, positive=True)
    integrator = method_for(method, tol)
    some = times if times.size <= PROBES else times[np.unique(np.linspace(0, times.size - 1, PROBES).round().astype(int))]
    steps, last, failure, stalls, estimate = FEWEST, None, None, 0, np.inf
    if np.isfinite(integrator.stability_limit):
        steps = max(steps, int(np.ceil(times[-1] / suggest_dt(problem, integrator))))
    rows = problem.system.rows
    for attempt in range(1, ATTEMPTS + 1):
        dt = times[-1] / steps
        try:
            found = run(integrator, dt, some)
        except SimulationError as error:
            if failure and error.message == failure.message and abs(error.time - failure.time) < 0.02 * failure.time:
                raise  # shorter steps end there too
            found, failure = None, error
        if found is None or found.stats["unconverged"]:
            steps, last = 2 * steps, None
            continue
        if last is not None:
            ratio = ((last.stats["dt"] / dt) ** 2 - 1) / SAFETY
            errors = {row: float(np.abs(getattr(found, row) - getattr(last, row)).max()) / ratio for row in rows}
            before, estimate = estimate, max(errors[row] / (np.abs(getattr(found, row)).max() or 1.0) for row in rows)
            stalls += estimate > 0.7 * before
            if estimate <= tol:
                if some.size < times.size:
                    found = run(integrator, dt, times)
                return replace(found, error_estimate=errors, stats=found.stats | {"tol": tol, "attempts": attempt})
        last = found
        if stalls == 3:  # rounding, not the step, is what is left
            break
        growth = 2.0 if not np.isfinite(estimate) else float(np.clip(1.1 * (estimate / tol) ** 0.4, 1.3, 4.0))
        steps = int(np.ceil(growth * steps))
    if failure and last is None:
        raise failure
    what = f"tol = {tol:g} was not reached: the error is estimated at {estimate:.1e} with dt = {dt:g}"
    raise SimulationError(f"{what}; take a larger tol or another method", last.stats["steps"] if last else 0, times[-1], 0)
