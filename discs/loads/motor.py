r"""Motors: discs whose rate of roll or of turning is given.

A motor at disc i adds a torque tau and the condition omega_i = rate(t). Implicit steps impose it where they evaluate forces: the
row of the disc in their linear system is replaced by a damper of strength HELD on the difference omega_i - rate. All other entries
of the row vanish beside it in double precision, so elimination gives omega_i to the last bits. The torque follows from the row that
was replaced, pi'_i = c_i . (f - grad V) + c_i tau.

The midpoint rule and collocation methods impose the rate inside the steps. At the ends of steps it is as accurate as the method,
and exact for Radau methods, whose last stage is there.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from discs import checks
from discs.arrays import Float, Matrix
from discs.kernels.limits import HELD
from discs.loads import signals
from discs.loads.binding import Discs, OnRod, spread
from discs.loads.linear import Linear, tabled, with_arrays
from discs.loads.signals import Signal
from discs.skew import Load, Parameters


@dataclass(frozen=True)
class Motor(OnRod):
    """A motor or, with rate 0, a brake that holds: the disc nearest to a place rolls at a given rate.

    Parameters
    ----------
    rate : rad per time, a number or a function of t. The initial rate of the disc must agree.
    at : place along the rod.
    about : "roll", or "turn" for the rate of turning of discs with their own headings.
    """

    rate: float | Signal
    at: float
    about: str = "roll"

    def on(self, chain: Discs) -> "Held":
        return Held((Axle(self._row(chain, self.about), self._disc(chain, self.at), self.signal),), Linear(spread(chain, {})))

    @property
    def signal(self) -> Signal:
        """The rate as a function of t."""
        rate: Any = self.rate
        return rate if callable(rate) else signals.table([0.0], [checks.number("rate of Motor", rate)])


class Axle(NamedTuple):
    """A driven angle: its row of q, its disc and its rate."""

    row: int
    disc: int
    rate: Signal


def change(rate: Signal, t: float, duration: float) -> float:
    """The derivative of a rate at a time, by differences of second order within the duration."""
    step = 1e-5 * duration
    times = np.clip(t - step, 0.0, duration - 2 * step) + step * np.arange(3)
    x = (t - times[1]) / step
    return float(signals.values(rate, times, "Motor") @ np.array([x - 0.5, -2 * x, x + 0.5]) / step)


class Held(Load):
    """Motors, and another load. `force` has dampers in the place of motors, `applied` is the force of the other load.

    Attributes
    ----------
    axles : the driven angles. where : (rows, discs), their index in q. other : the other load.
    """

    def __init__(self, axles: tuple[Axle, ...], other: Load) -> None:
        self.axles, self.other = axles, other
        self.where = np.array([axle.row for axle in axles]), np.array([axle.disc for axle in axles])
        self.damping, self.stiffness = other.damping.copy(), other.stiffness
        self.damping[self.where] += HELD
        self.viscosity, self.section = other.viscosity, other.section

    def rates(self, t: float) -> Float:
        """The given rates at a time, (motors,)."""
        return np.array([signals.values(axle.rate, np.array([t]), "Motor")[0] for axle in self.axles])

    def changes(self, t: float, duration: float) -> Float:
        """Rates of change of the given rates, (motors,)."""
        return np.array([change(axle.rate, t, duration) for axle in self.axles])

    def applied(self, t: float, q: Float, v: Float) -> Float:
        return self.other.force(t, q, v)

    def force(self, t: float, q: Float, v: Float) -> Float:
        found = np.array(self.applied(t, q, v), dtype=float)
        found[self.where] += HELD * (self.rates(t) - v[self.where])
        return found

    def derivatives(self, t: float, q: Float, v: Float) -> tuple[Matrix, Matrix]:
        return self.other.derivatives(t, q, v)

    def potential(self, t: float, q: Float) -> float:
        return self.other.potential(t, q)

    def driven(self, t: float, q: Float) -> float:
        return self.other.driven(t, q)

    def bands(self, t: float, q: Float, c: Float, d: complex, g: complex) -> Any:
        return self.other.bands(t, q, c, d, g)

    def power(self, t: float, q: Float, v: Float) -> tuple[float, float]:
        """Without that of the motors, see `discs.integrators.base.Work.react`."""
        return self.other.power(t, q, v)

    @cached_property
    def parameters(self) -> Parameters:
        other = self.other.parameters
        return None if other is None else with_arrays(other, axles=np.array([(axle.row, axle.disc) for axle in self.axles]))

    @property
    def signals(self) -> tuple[tuple[Signal, str], ...]:  # type: ignore[override]
        return *self.other.signals, *((axle.rate, "Motor") for axle in self.axles)

    def timed(self, times: Float, h: float) -> Parameters:
        return tabled(self, times, h)
