r"""How far a run of fixed steps may be trusted: the error of its steps, and steps that did not converge.

A step of size h and two of h/2 from the same state differ by the error of the step, up to a factor 1 - 2^-p near one. On a few of
the run's N steps, spread over it, the step that was taken is compared so; the trajectory is not touched. Errors of smooth motions
add up: N times the mean difference, relative to the largest value of each of x, y, theta (and phi), doubled, is the estimate
`step_error`. It is near the error of smooth motions, up to ten times too large where the errors of waves do not add up, and too
small where the motion amplifies differences. A run of few steps and discs that is so suspected is taken again with half the step,
and the change (4/3 of it, the error if that goes like h^2) takes the place of the estimate.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from discs.chains.rolling_discs import RollingDiscs
from discs.integrators.base import FixedStep, Tally, Work
from discs.running.stats import Stats
from discs.skew import Phase

EVERY = 50  # steps, of which one is compared
MOST = 8  # steps compared in a run
SAFETY = 2.0
SUSPECTED = 0.02, 1.0  # of the largest position or angle: between these a run is taken again ...
SHORT = 200_000  # ... if it has at most so many steps times discs: some hundredths of a second
WARNED = 0.05  # of the largest position or angle: a run is warned of
AIM = 1e-3  # relative error that a warning suggests a step for
HALVINGS = 8  # of a step that did not converge, in search of one that does


class Watch:
    """The error of a run's steps, on some of them.

    Parameters
    ----------
    steps : how many the run takes.

    Attributes
    ----------
    due : the next step to compare, counted from 0.
    total : (rows,), sum of the largest differences over the discs. size : (rows,), largest positions and angles seen.
    count : steps compared.
    short : whether the run may be taken again. places : positions (rows, n) after each step compared, of a short run.
    """

    def __init__(self, steps: int, n: int) -> None:
        self.short = 0 < steps * n <= SHORT
        self.places: list[NDArray] = []
        self.steps, self.apart = steps, steps / (MOST if steps > MOST * EVERY else 1 + steps // EVERY)
        self.total: Any = 0.0
        self.size: Any = 0.0
        self.count, self.due = 0, int(0.5 * self.apart)

    def compare(self, one: NDArray, two: NDArray) -> None:
        """Count in a step: positions (rows, n) by one step and by two halves."""
        size, off = np.maximum.reduce(np.abs(two), 1), np.maximum.reduce(np.abs(one - two), 1)
        self.size, self.total = (np.maximum(self.size, size), self.total + off) if self.count else (size, off)
        if self.short:
            self.places.append(one)
        self.count += 1
        self.due = int((self.count + 0.5) * self.apart)

    def again(
        self, system: RollingDiscs, start: Phase, integrator: FixedStep, last: NDArray, h: float, kernel: Any
    ) -> float | None:
        """The error by a run with half the step, at the places kept and at the `last` one; None if that run fails."""
        done, worst, memory = 0, 0.0, integrator.begin(system, start, 0.5 * h, Work(), kernel)
        steps = [int((i + 0.5) * self.apart) + 1 for i in range(len(self.places))]
        for step, place in zip([*steps, self.steps], [*self.places, last], strict=True):
            memory, tally = advanced(system, integrator, memory, done * h, 0.5 * h, 2 * (step - done), kernel)
            if tally.lost >= 0 or not np.isfinite(memory.hi).all():
                return None
            done, off = step, np.abs(memory.hi - place).max(axis=1)
            worst = max(worst, float((off / np.where(self.size > 0, self.size, 1.0)).max()))
        return 4 / 3 * worst

    def estimate(self) -> float:
        """The estimate from the steps compared."""
        if not self.count:
            return 0.0
        worst = 0.0
        for off, size in zip(self.total, self.size, strict=True):
            if off > worst * (size or 1.0):
                worst = off / (size or 1.0)
        return float(SAFETY * (self.steps or 1) / self.count * worst)


def advanced(
    system: RollingDiscs, integrator: FixedStep, memory: Any, t: float, h: float, steps: int, kernel: Any
) -> tuple[Any, Tally]:
    """What the integrator remembers some steps later, and what they cost."""
    if kernel is not None:
        return integrator.march(kernel, memory, t, h, steps, np.inf)
    work = Work()
    for _ in range(steps):
        memory, t = integrator.advance(system, memory, t, h, work), t + h
    return memory, Tally(steps, work.gradients, work.solves, work.unconverged, -1)


def converging(system: RollingDiscs, integrator: FixedStep, before: Any, t: float, steps: int, h: float, kernel: Any) -> float:
    """A step with which the first of `steps` steps that does not converge, from a state, would; h/2^HALVINGS if none was found."""
    for _ in range(steps):
        after, tally = advanced(system, integrator, before, t, h, 1, kernel)
        if tally.unconverged:
            break
        before, t = after, t + h
    for halving in range(1, HALVINGS + 1):
        if not advanced(system, integrator, before, t, h / 2**halving, 2**halving, kernel)[1].unconverged:
            break
    return h / 2**halving


def doubts(stats: Stats) -> list[str]:
    """Why a run is not to be trusted, in words, from what it tells of itself."""
    found = []
    if stats.get("unconverged") and (stuck := _number(stats["unconverged"])):
        steps = _number(stats.get("steps")) + _number(stats.get("short_steps"))
        found.append(f"{stuck} of {steps} steps did not converge")
    error = stats.get("step_error")
    if isinstance(error, float) and error > WARNED:
        off = f"by about {100 * error:.0f} %" if error < 1 else "altogether"
        found.append(f"dt = {_number(stats.get('dt')):.3g} is too long for this motion, positions or angles may be off {off}")
    return found


def cure(stats: Stats) -> str:
    """A step that might do, in words: with it the run's steps converge, and err by AIM if errors go like its square."""
    shorter = stats["dt"] * np.sqrt(min(AIM / (stats.get("step_error") or AIM), 1.0))
    return f"dt = {min(shorter, stats.get('converging_dt', np.inf)):.2g}"


def _number(value: object) -> float:
    """What a run tells of itself, 0 where that is no number: a file may hold anything."""
    return value if isinstance(value, int | float) else 0
