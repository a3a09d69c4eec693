"""Until when a tolerance can be held: the time in which a change of the last place grows to the tolerance.

Positions are rounded. Where small changes grow without bound, no step holds a tolerance beyond some time. A search whose runs do
not come nearer to each other looks for this time:

1. Two runs start a unit in the last place apart (`discs.running.estimates.nudged`). They differ by more than the tolerances from
   a time t_2 on.
2. A run with steps shorter by FINER agrees with the first one, within the tolerances, until a time t_1.
3. Until t_1 the steps resolve the motion, so the growth until then is its own. If that is SHOWN of the whole growth, on a
   logarithmic scale, t_2 is the time: it hardly depends on the steps, as shorter ones only make other roundings.

A search looks once it has taken COSTLY gradients, summed over the discs, while its errors are above LARGE, and again after AGAIN
times as many. The runs of a look take about SHARE of the gradients so far, those of a look in vain about half of that, and end
after as many steps: t_2 is mostly a small part of a long duration. If they do not resolve the motion, the next look has shorter
steps. If they do, and t_2 is not before the end of the run, there is no other look. So most searches have none, and the looks of
the others take less than a tenth of their time.
"""

from collections.abc import Generator, Mapping

import numpy as np

from discs.arrays import Float
from discs.integrators import Gauss8, Integrator
from discs.problem import Problem
from discs.running import estimates
from discs.running.failure import SimulationError
from discs.running.suggest import suggest_dt
from discs.solution import Solution

COSTLY = 3e7  # gradients times discs: half a second of a processor
AGAIN = 3.0
SHARE = 0.1
LARGE = 0.3  # relative error
PART = 1 / 3  # of `suggest_dt`: the first step of a look
EACH = 40  # gradients of a step, about
FINER = 1.5
COUNT = 400  # times at which runs are compared, at most
SHOWN = 0.4
CONVERGED = 1e-15  # tolerance of sweeps: what they leave grows, too
FEWEST = 20  # steps of a look


class Looks:
    """The looks of a search, which counts its gradients.

    Parameters
    ----------
    problem : the problem. end : the last time of its run.
    """

    def __init__(self, problem: Problem, end: float) -> None:
        self.problem, self.end = problem, end
        self.used, self.due = 0, COSTLY / problem.chain.n
        self._part = PART

    def count(self, run: Solution) -> None:
        """Count a run of the search."""
        self.used += run.stats["gradients"]

    def wanted(self, error: float) -> bool:
        """Whether to look, with runs of this relative error."""
        return error > LARGE and self.used >= self.due

    def look(self, allowed: Mapping[str, float]) -> Generator[tuple[Problem, Integrator, float, Float], Solution, float]:
        """The time from which on no step holds the errors `allowed`; infinite if it is not before the end, or was not found."""
        self.due = AGAIN * self.used
        h = min(self._part * suggest_dt(self.problem, "gauss8"), self.end / FEWEST)
        steps = min(int(SHARE * self.used / EACH / (2 + FINER)), int(self.end / h))
        stride = 2 * max(1, steps // (2 * COUNT))  # even: every time is reached by steps of h and of h/FINER
        times = stride * h * np.arange(1.0, steps // stride + 1)
        if steps < FEWEST:
            return np.inf
        method = Gauss8(tolerance=CONVERGED)
        try:
            run = yield self.problem, method, h, times
            moved = yield estimates.nudged(self.problem), method, h, times
            grown = apart(run, moved, allowed)
            lost = np.flatnonzero(grown >= 1)
            if not lost.size:
                self.due = np.inf if times[-1] + stride * h > self.end else self.due
                return np.inf
            finer = yield self.problem, method, h / FINER, times[: lost[0] + 1]
        except SimulationError:
            self._part /= 2
            return np.inf
        unresolved = np.flatnonzero(apart(run, finer, allowed) >= 1)
        last = min(unresolved[0], lost[0]) if unresolved.size else lost[0]
        least = grown[0]
        if least < 1 and np.log(grown[last] / least) >= SHOWN * np.log(1 / least):
            return float(times[lost[0]])
        self._part /= 2
        return np.inf


def parted(run: Solution, other: Solution, allowed: Mapping[str, float]) -> float:
    """The first frame at which two runs differ by more than is allowed; infinite if there is none."""
    lost = np.flatnonzero(apart(run, other, allowed) >= 1)
    return float(run.t[lost[0]]) if lost.size else np.inf


def apart(run: Solution, other: Solution, allowed: Mapping[str, float]) -> Float:
    """The largest difference of two runs up to each time of the shorter one, in units of what is allowed."""
    count, parts = min(run.t.size, other.t.size), []
    for name, most in allowed.items():
        off = np.abs(getattr(run, name)[:count] - getattr(other, name)[:count])
        parts.append(off.reshape(count, -1).max(axis=1) / most)
    found: Float = np.maximum.accumulate(np.maximum(np.max(parts, axis=0), np.finfo(float).tiny))
    return found
