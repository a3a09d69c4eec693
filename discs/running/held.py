"""How long a motion can be followed: the time until a change of the last place has grown to a tolerance.

Where small changes grow without bound, no step reaches a tolerance beyond some time, as positions are rounded. This is shown by
three runs that are compared at COUNT times:

1. A run with steps h and one with steps h/FINER agree within the tolerances until a time t_1: until then h resolves the motion.
2. A run with steps h whose initial positions differ by one unit in the last place leaves the tolerances at a time t_2.
3. If t_1 is at least RESOLVED times t_2, the growth is that of the motion and not of unresolved steps, and t_2 is the time until
   which tolerances can be held. It hardly depends on h: a change grows from rounding to the tolerance, and shorter steps only make
   other roundings.

Sweeps converge to CONVERGED, as what they leave grows, too.
"""

from collections.abc import Generator, Mapping

import numpy as np

from discs.arrays import Float
from discs.integrators import Integrator
from discs.problem import Problem
from discs.running import estimates
from discs.running.failure import SimulationError
from discs.solution import Solution

COUNT = 400  # times at which runs are compared
FINER = 1.5
RESOLVED = 0.4
CONVERGED = 1e-15  # tolerance of sweeps


def held_until(
    problem: Problem, integrator: Integrator, dt: float, end: float, bound: Mapping[str, float]
) -> Generator[tuple[Problem, Integrator, float, Float], Solution, float]:
    """The time from which on no step holds the tolerances `bound`; infinite if it is after `end` or not shown by steps of dt."""
    times = end * np.arange(1.0, COUNT + 1) / COUNT
    sharp = integrator.with_sweeps(CONVERGED)
    try:
        run = yield problem, sharp, dt, times
        finer = yield problem, sharp, dt / FINER, times
        moved = yield estimates.nudged(problem), sharp, dt, times
    except SimulationError:
        return np.inf
    if any(each.stats["unconverged"] for each in (run, finer, moved)):
        return np.inf
    resolved, lost = (_parted(run, other, bound) for other in (finer, moved))
    return lost if resolved >= RESOLVED * lost else np.inf


def _parted(run: Solution, other: Solution, bound: Mapping[str, float]) -> float:
    """The first time at which two runs differ by more than the tolerances; infinite if they never do."""
    size = estimates.sizes(run, bound)
    apart = np.zeros(run.t.size)
    for name, tol in bound.items():
        off = np.abs(getattr(run, name) - getattr(other, name)).reshape(run.t.size, -1).max(axis=1)
        apart = np.maximum(apart, off / (tol * size[name]))
    late = np.flatnonzero(apart > 1)
    return float(run.t[late[0]]) if late.size else np.inf
