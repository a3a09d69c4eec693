"""Motors of a field: places whose rate of roll or of turning is given, or that are held."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from continuum.timing import Timing
from discs.arrays import Float
from discs.loads import signals
from discs.loads.motor import change
from discs.loads.signals import Signal


class Axle(NamedTuple):
    """A driven angle: its row of q, 2 for theta and 3 for phi, its place and its rate."""

    row: int
    at: float
    rate: Signal


class Motors:
    """The motors of a scene; places a `period` apart, on a closed one, are one place.

    Attributes
    ----------
    axles : the driven angles.

    Raises
    ------
    ValueError : for initial rates (motors,) that are not those of the motors, for two motors at one place about one axis, and for
        rates that jump, which would take infinite torques.
    """

    def __init__(self, axles: Sequence[Axle], timing: Timing, duration: float, initial: Float, period: float = np.inf) -> None:
        self.axles, self._duration = tuple(axles), duration
        for i, (axle, rate, given) in enumerate(zip(axles, self.rates(np.zeros(1))[0], initial, strict=True)):
            if not abs(given - rate) <= 1e-9 * max(1.0, abs(rate)):
                name = "omega" if axle.row == 2 else "phi_rate"
                raise ValueError(
                    f"Motor: its rate at t = 0 must be the initial {name} at s = {axle.at:g}, {given:g}; got {rate:g}: "
                    "change one, or start the motor smoothly"
                )
            if any(axle.row == other.row and (axle.at - other.at) % period in (0.0, period) for other in self.axles[:i]):
                raise ValueError(f"Motor: s = {axle.at:g} has two motors about the same axis; leave one out")
        short = 1e-9 * duration
        for t in timing.stops[:-1] if axles else ():
            before, after = self.rates(np.array([t - short, t + short]))
            if (np.abs(after - before) > 1e-6 * np.maximum(1.0, np.abs(before))).any():
                raise ValueError(
                    f"Motor: its rate jumps at t = {t:g}, which takes an infinite torque; take signals.smooth or a ramp"
                )

    def rates(self, t: Float) -> Float:
        """The given rates at times (m,), (m, motors)."""
        return np.array([signals.values(axle.rate, t, "Motor") for axle in self.axles]).reshape(-1, t.size).T

    def changes(self, t: Float) -> Float:
        """Their rates of change, (m, motors)."""
        return np.array([[change(axle.rate, time, self._duration) for axle in self.axles] for time in t]).reshape(t.size, -1)
