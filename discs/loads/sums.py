"""The sum of several loads."""

from dataclasses import dataclass

import numpy as np

from discs.arrays import Float
from discs.loads.linear import Linear
from discs.skew import Load


@dataclass(frozen=True, eq=False)
class Total(Load):
    """The sum of loads."""

    loads: tuple[Load, ...]

    def __post_init__(self) -> None:
        for name in ("damping", "stiffness"):
            object.__setattr__(self, name, np.sum([getattr(load, name) for load in self.loads], axis=0))
        object.__setattr__(self, "conservative", all(load.conservative for load in self.loads))
        object.__setattr__(self, "least", sum(load.least for load in self.loads))

    def potential(self, q: Float) -> float:
        return sum(load.potential(q) for load in self.loads)

    def force(self, t: float, q: Float, v: Float) -> Float:
        found: Float = np.sum([load.force(t, q, v) for load in self.loads], axis=0)
        return found


def total(loads: tuple[Load, ...]) -> Load | None:
    """One load that is the sum of all, or None; a sum of linear loads is linear, and so has a compiled form."""
    if not loads:
        return None
    linear = [load for load in loads if isinstance(load, Linear)]
    if len(linear) == len(loads):
        return Linear(*(np.sum([getattr(load, name) for load in linear], axis=0) for name in ("constant", "damping", "stiffness")))
    return loads[0] if len(loads) == 1 else Total(loads)
