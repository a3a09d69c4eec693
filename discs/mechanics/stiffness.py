r"""A test for stiffness: whether an implicit method is faster.

Hairer's test: with two stages y_1, y_2 at the end of a step h, h |f(y_1) - f(y_2)|/|y_1 - y_2| estimates h times the largest
eigenvalue. If it stays above 6.1, the limit of DOP853's stability, in 15 steps (and not below in 6 in a row), the steps are
limited by stability. Radau is then tried for 24 steps, and taken if the second half of them advances at least twice as far per
evaluation.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.2.
"""

from collections import deque
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float

LIMIT, SHOWN, CALM = 6.1, 15, 6
PAUSE = 1000  # steps to the next trial
TRIAL, SCORED = 24, 12


class Stiffness:
    """Counts the steps of DOP853 that stability limits."""

    def __init__(self) -> None:
        self.limited = self.free = self.pause = 0
        self.steps: deque[float] = deque(maxlen=20)

    def shown(self, solver: "scipy.integrate.OdeSolver") -> bool:
        """Whether steps up to the last one of `solver` are limited by stability."""
        h = solver.step_size
        self.steps.append(abs(h))
        if self.pause:
            self.pause -= 1
            return False
        between = h * (solver.K[:11].T @ solver.A[11, :11] - solver.K[:12].T @ solver.B)
        scale = solver.atol + solver.rtol * np.abs(solver.y)
        near, far = (np.linalg.norm(d / scale) for d in (between, h * (solver.K[11] - solver.K[12])))
        if far > LIMIT * near > 0:
            self.limited, self.free = self.limited + 1, 0
        else:
            self.free += 1
            if self.free == CALM:
                self.limited = 0
        return self.limited >= SHOWN

    def implicit_step(self, rate: Any, solver: "scipy.integrate.OdeSolver", rtol: float, atol: Float) -> float | None:
        """Radau's step length from the state of `solver`, if Radau advances further per evaluation of the rate; else None."""
        self.limited, self.free, self.pause = 0, 0, PAUSE
        first = min(abs(solver.step_size), abs(solver.t_bound - solver.t))
        trial = scipy.integrate.Radau(rate, solver.t, solver.y, solver.t_bound, rtol=rtol, atol=atol, first_step=first)
        t, evaluations = solver.t, rate.evaluations
        for step in range(TRIAL):
            if trial.status != "running":
                break
            trial.step()
            if step == TRIAL - SCORED - 1:
                t, evaluations = trial.t, rate.evaluations
        done = rate.evaluations - evaluations
        if trial.status == "failed" or not done or abs(trial.t - t) / done < 2 * np.mean(self.steps) / 12:
            return None
        return abs(float(trial.step_size))
