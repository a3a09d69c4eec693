r"""The error of a run of fixed steps: the estimate `step_error`, and steps that did not converge.

One to eight of a run's N steps, spread over the run, are sampled ("looks"); the trajectory does not change. A look computes the
defect of the step, |q_{n+1} - 3 q_n + 3 q_{n-1} - q_{n-2}|/12, about h^3 |q'''|/12, from known positions. The error of a midpoint
step is (h w)^3/12 of an oscillation of rate w, so the defect is the error of a step of order 2. For steps of higher order that
resolve the motion it is a bound; the defect of an unresolved oscillation is as large as the oscillation. Errors of smooth motions
add up. So `step_error` is twice N times the mean defect, relative to the largest value of each of x, y, theta (and phi), or to
LEAST of the largest position or angle, if that is larger: smaller values are rounding. Runs of one or two steps have no third
difference. There the defect is h^2 C (f_m - f_0)/6, from the change of the force C^T grad V between
the start and the middle of the step, with f_m = (pi_1 - pi_0)/h.

A step is compared if its look alone would raise the estimate above 1 %, or if a heading turns by more than a radian in it, which
may hide whole turns: it is computed again as two steps of h/2, and their difference replaces the defect. (It is the error of the
step up to a factor 1 - 2^-p near one.) The estimate is then near the error of smooth motions, up to ten times too large where the
errors of waves do not add up, and too small where the motion amplifies differences. A short run whose estimate is still between the
values SUSPECTED is computed again with half the step, and 4/3 of the change, the error if it goes like h^2, replaces the estimate.
"""

import numpy as np

from discs.arrays import Float
from discs.chains.rolling_discs import RollingDiscs
from discs.integrators.base import FixedStep
from discs.integrators.work import Looks, Memory, Tally, Work
from discs.kernels.limits import TURNED
from discs.skew import Parameters, Phase

EVERY = 50  # steps per look
MOST = 8  # looks in a run, at most
FEW = 3  # least number of steps with a third difference
SAFETY = 2.0  # factor of the estimate
DOUBTFUL = 0.01  # relative estimate above which a step is compared
SUSPECTED = 0.02, 1.0  # relative estimates between which a run is computed again ...
SHORT = 200_000  # ... if steps times discs are at most this: some hundredths of a second
LEAST = 1e-10  # of the largest position or angle: a row of smaller ones is rounding
HALVINGS = 8  # of a step that did not converge, at most


class Watch:
    """The looks at some steps of a run, and the error estimate from them.

    Parameters
    ----------
    steps : number of steps of the run. rows, n : shape of its positions.

    Attributes
    ----------
    looks : (m,), the steps that are looked at, counted from 1. passed : the number of looks done.
    doubted : whether the next step is to be compared.
    limit : the largest relative defect that needs no comparison.
    short : whether the run may be computed again.
    places : (m, rows, n), positions after each look of a short run; otherwise (1, rows, n), workspace.
    defects : (m, 2, rows), for each look the largest defect (or difference) over the discs, and the largest positions and angles.
    """

    def __init__(self, steps: int, rows: int, n: int) -> None:
        count = MOST if steps > MOST * EVERY else 1 + steps // EVERY
        looks = [max(FEW, int((i + 0.5) * steps / count) + 1) for i in range(count)] if steps >= FEW else [1]
        self.looks = np.array(looks, np.int64)
        self.steps, self.passed, self.doubted = steps, 0, False
        self.limit = DOUBTFUL / (SAFETY * (steps or 1))
        self.short = steps * n <= SHORT
        self.places = np.empty((count if self.short else 1, rows, n))
        self.defects = np.empty((count, 2, rows))

    def arguments(self, first: int) -> Looks:
        """The arguments about looks for compiled steps, after `first` steps."""
        k = self.passed
        if not k:
            return first, self.looks, self.places, self.defects, self.limit
        return first, self.looks[k:], self.places[k if self.short else 0 :], self.defects[k:], self.limit

    def look(self, step: int, before: Float, after: Float) -> bool:
        """The plain form of a look, from positions before and after the step number `step`; returns whether to compare the step."""
        if self.passed == self.looks.size or not 0 <= (ahead := int(self.looks[self.passed]) - step) < FEW:
            return False
        if self.steps < FEW:
            return ahead == 0
        place = self.places[self.passed if self.short else 0]
        if ahead == 2:
            place[:] = 0.0
        place += (-3.0, 3.0, -1.0)[ahead] * before
        if ahead:
            return False
        defect = np.abs(place + after).max(axis=1) / 12
        size, turned = np.abs(after).max(axis=1), np.abs(after - before).max(axis=1)
        if (defect > self.limit * np.where(size > 0, size, 1.0)).any() or (turned[3:] > TURNED).any():
            return True
        self._take(defect, size, after)
        return False

    def compare(self, one: Float, two: Float) -> None:
        """Record a look from positions (rows, n) after one step and after two half steps."""
        self._take(np.abs(one - two).max(axis=1), np.abs(two).max(axis=1), one)

    def _take(self, off: Float, size: Float, place: Float) -> None:
        self.defects[self.passed] = off, size
        self.places[self.passed if self.short else 0] = place
        self.passed, self.doubted = self.passed + 1, False

    def put_off(self, step: int) -> None:
        """Postpone a look that was interrupted after a step."""
        if self.passed < self.looks.size and self.looks[self.passed] - step < FEW:
            self.looks[self.passed], self.doubted = step + min(FEW, self.steps), False

    def estimate(self) -> float:
        """The estimate from the looks done so far."""
        seen = self.defects if self.passed == len(self.defects) else self.defects[: self.passed]
        return estimated(seen, self.steps)[0] if self.passed else 0.0

    def again(
        self, system: RollingDiscs, start: Phase, integrator: FixedStep, last: Float, h: float, parameters: Parameters
    ) -> float | None:
        """The error against a run with half the step, at the positions kept and at the `last` ones; None if that run fails."""
        done, worst, memory = 0, 0.0, integrator.begin(system, start, 0.5 * h, Work(), parameters)
        _, size = estimated(self.defects[: self.passed], self.steps)
        steps = [*self.looks.tolist(), self.steps] if self.steps else []
        for step, place in zip(steps, [*self.places, last], strict=True):
            memory, tally = advanced(system, integrator, memory, done * h, 0.5 * h, 2 * (step - done), parameters)
            if tally.lost >= 0 or not np.isfinite(memory.hi).all():
                return None
            done, off = step, np.abs(memory.hi - place).max(axis=1)
            worst = max(worst, float((off / size).max()))
        return 4 / 3 * worst


def estimated(seen: Float, steps: int) -> tuple[float, list[float]]:
    """The estimate of a run of some steps from looks (m, 2, rows) as in `Watch`, and what errors of each row are relative to."""
    (total, size), *others = seen.tolist()  # numbers, as NumPy takes longer for arrays so small
    for off, large in others:
        total = [a + b for a, b in zip(total, off, strict=True)]
        size = list(map(max, size, large))
    worst, least = 0.0, LEAST * max(size[0], size[1])
    for row, most in enumerate(size):
        if row == 2:
            least = LEAST * max(size[2:])
        if not most > least:
            size[row] = most = least or 1.0
        if total[row] > worst * most:
            worst = total[row] / most
    return worst / len(seen) * SAFETY * (steps or 1), size


def advanced(
    system: RollingDiscs, integrator: FixedStep, memory: Memory, t: float, h: float, steps: int, parameters: Parameters
) -> tuple[Memory, Tally]:
    """The memory of the integrator some steps later, and the tally of these steps."""
    if parameters is not None:
        return integrator.march(system, parameters, memory, t, h, steps, np.inf)
    work = Work()
    for _ in range(steps):
        memory, t = integrator.advance(system, memory, t, h, work), t + h
    return memory, Tally(steps, work.gradients, work.solves, work.unconverged, -1, 0, False, False)


def converging(
    system: RollingDiscs, integrator: FixedStep, before: Memory, t: float, steps: int, h: float, parameters: Parameters
) -> float:
    """A step with which the first unconverged one of `steps` steps would converge; h/2^HALVINGS if none was found."""
    for _ in range(steps):
        after, tally = advanced(system, integrator, before, t, h, 1, parameters)
        if tally.unconverged:
            break
        before, t = after, t + h
    shorter, count = h, 1
    for _ in range(HALVINGS):
        shorter, count = 0.5 * shorter, 2 * count
        after, tally = advanced(system, integrator, before, t, shorter, 1, parameters)  # most fail in the first step
        if not tally.unconverged:
            _, tally = advanced(system, integrator, after, t + shorter, shorter, count - 1, parameters)
        if not tally.unconverged:
            break
    return shorter
