"""Torques and forces, and those of slopes and springs, which have a potential."""

from dataclasses import dataclass

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.loads.binding import Discs, OnRod, Pattern, spread, within
from discs.loads.linear import Linear
from discs.loads.signals import Signal


@dataclass(frozen=True, eq=False)
class Torque(OnRod):
    """A torque about the axles: signal(t) pattern w on a disc with the share w of the length.

    Parameters
    ----------
    pattern : torque per length, a number, an array (n,) or a function of s; with `at` a torque.
    signal : a function of t; None for 1.
    at : place of the one disc that it acts on, the nearest; None for all.
    about : "roll", or "turn" for a torque about the vertical on discs with their own headings.
    """

    pattern: Pattern
    signal: Signal | None = None
    at: float | None = None
    about: str = "roll"

    def on(self, chain: Discs) -> Linear:
        (torque,) = self._shared(chain, self.at, pattern=self.pattern)
        return self._push(chain, {self._row(chain, self.about): torque}, self.signal)


@dataclass(frozen=True, eq=False)
class Force(OnRod):
    """A force on the contact points: signal(t) (x, y) w on a disc with the share w of the length.

    Parameters
    ----------
    x, y : force per length, numbers, arrays (n,) or functions of s; with `at` a force.
    signal, at : as for `Torque`.
    """

    x: Pattern = 0.0
    y: Pattern = 0.0
    signal: Signal | None = None
    at: float | None = None

    def on(self, chain: Discs) -> Linear:
        x, y = self._shared(chain, self.at, x=self.x, y=self.y)
        return self._push(chain, {0: x, 1: y}, self.signal)


@dataclass(frozen=True)
class Slope(OnRod):
    """Gravity along an inclined plane: the force m (gx, gy) on a disc of mass m, with the potential -m (gx x + gy y)."""

    gx: float = 0.0
    gy: float = 0.0

    def on(self, chain: Discs) -> Linear:
        mass = chain.w * np.asarray(chain.density)
        g = (checks.number(f"{name} of Slope", getattr(self, name)) for name in ("gx", "gy"))
        return Linear(constant=spread(chain, {row: mass * value for row, value in enumerate(g)}))


@dataclass(frozen=True, eq=False)
class Spring(OnRod):
    """Springs from the contact points to places in the plane: the potential stiffness |r - (x, y)|^2/2.

    Parameters
    ----------
    x, y : the places, numbers, arrays (n,) or functions of s.
    stiffness : force per length of the spring, per length of the rod, >= 0, as `x`; with `at` that of the one spring.
    at : as for `Torque`.
    """

    x: Pattern
    y: Pattern
    stiffness: Pattern
    at: float | None = None

    def on(self, chain: Discs) -> Linear:
        (stiffness,) = self._shared(chain, self.at, 0.0, stiffness=self.stiffness)
        x, y = (self._place(name, value, chain) for name, value in (("x", self.x), ("y", self.y)))
        if self.at is not None and chain.ends == "ring" and self.at > chain.length - chain.k / 2:
            x, y = x - chain.shift[0], y - chain.shift[1]  # the disc at s = 0 is that at s = length one period back
        return Linear(
            constant=spread(chain, {0: stiffness * x, 1: stiffness * y}),
            stiffness=spread(chain, {0: stiffness, 1: stiffness}),
            offset=0.5 * float(stiffness @ (x * x + y * y)),
            floor=0.0,
            about=spread(chain, {0: x, 1: y}),
        )

    def _place(self, name: str, value: Pattern, chain: Discs) -> Float:
        return self._sampled(name, value if self.at is None else self._number(name, value), within(chain, chain.s))
