"""Frames that compiled steps record themselves. This takes a tenth of the time of asking for each frame from Python."""

from typing import Any

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.chains.rolling_discs import RollingDiscs
from discs.integrators.work import Stops
from discs.running.whole_steps import all_steps_before


class Album:
    """Frames that compiled steps record: all but the quantities in `want` and those of loads.

    Parameters
    ----------
    times : (F,), of the frames. h : the step. last : whole steps before the last frame, and the time from there.

    Attributes
    ----------
    times : (F,). steps, rests : (F,), the whole steps before each frame, and the time from there. done : number of frames recorded.
    q, rates : (rows, F, n), (rows - 2, F, n), positions, and rates of the rows from theta on.
    energy_slip : (2, F), energy and largest slip.
    """

    def __init__(self, system: RollingDiscs, times: Float, h: float, last: tuple[int, float] | None = None) -> None:
        rows, n, count = len(system.rows), system.n, times.size
        if count > 1:
            checks.fits(f"frames = {count}", (2 * rows * n + 2) * count)
        self.system, self.times, self.done = system, np.ascontiguousarray(times), 0
        if count == 1 and last is not None:
            self.steps, self.rests = np.array([last[0]], np.int64), np.array([last[1]])
        else:
            self.steps, self.rests = all_steps_before(times, h)
        self.q, self.rates, self.energy_slip = np.empty((rows, count, n)), np.empty((rows - 2, count, n)), np.empty((2, count))

    def arguments(self, first: int, stuck: int) -> Stops:
        """The arguments about frames for compiled steps, after `first` steps, of which `stuck` did not converge.

        The steps end when that number has doubled, so that `March` can remember where it was.
        """
        return stuck or 1, first, self.done, self.steps, self.rests, self.q, self.rates, self.energy_slip

    def write(self, found: dict[str, Any]) -> None:
        """Store the next frame, if compiled steps left it."""
        for name, to in self.rows.items():
            to[self.done] = found[name]
        self.done += 1

    @property
    def rows(self) -> dict[str, Float]:
        """The frames, by the names of their quantities."""
        found = {"energy": self.energy_slip[0], "rolling_residual": self.energy_slip[1]}
        for row, name in enumerate(self.system.rows):
            found[name] = self.q[row]
        for row, name in enumerate(self.system.rates[2:]):
            found[name] = self.rates[row]
        return found
