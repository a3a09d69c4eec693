"""The sum of several loads."""

from dataclasses import dataclass

import numpy as np

from discs.arrays import Float
from discs.loads.linear import Linear
from discs.loads.motor import Held
from discs.skew import Load


@dataclass(frozen=True, eq=False)
class Total(Load):
    """The sum of loads."""

    loads: tuple[Load, ...]

    def __post_init__(self) -> None:
        for name in ("damping", "stiffness"):
            object.__setattr__(self, name, np.sum([getattr(load, name) for load in self.loads], axis=0))
        for name in ("viscosity", "section"):
            object.__setattr__(self, name, _present(self.loads, name))
        object.__setattr__(self, "conservative", all(load.conservative for load in self.loads))
        object.__setattr__(self, "least", sum(load.least for load in self.loads))

    def potential(self, t: float, q: Float) -> float:
        return sum(load.potential(t, q) for load in self.loads)

    def driven(self, t: float, q: Float) -> float:
        return sum(load.driven(t, q) for load in self.loads)

    def power(self, t: float, q: Float, v: Float) -> tuple[float, float]:
        work, dissipated = np.sum([load.power(t, q, v) for load in self.loads], axis=0)
        return float(work), float(dissipated)

    def force(self, t: float, q: Float, v: Float) -> Float:
        found: Float = np.sum([load.force(t, q, v) for load in self.loads], axis=0)
        return found


def _present(loads: tuple[Load, ...] | list[Linear], name: str) -> Float | None:
    """The sum of an attribute of loads, None if none has it."""
    present = [value for load in loads if (value := getattr(load, name)) is not None]
    found: Float | None = np.sum(present, axis=0) if present else None
    return found


def _floor(loads: list[Linear]) -> float | None:
    """The floor of the sum: the given ones, and the least of the sum of those without; None if none is given."""
    rest, given = [load for load in loads if load.floor is None], [load.floor for load in loads if load.floor is not None]
    if not given:
        return None
    other = total(tuple(rest))
    return sum(given) + (0.0 if other is None else other.least)


def total(loads: tuple[Load, ...]) -> Load | None:
    """One load that is the sum of all, or None; a sum of linear loads is linear, and so has a compiled form."""
    if not loads:
        return None
    if motors := [load for load in loads if isinstance(load, Held)]:
        rest = total(tuple(load for load in loads if not isinstance(load, Held)))
        return Held(tuple(axle for load in motors for axle in load.axles), np.zeros_like(motors[0].damping), rest)
    linear = [load for load in loads if isinstance(load, Linear)]
    if len(linear) == len(loads):
        return Linear(
            constant=np.sum([load.constant for load in linear], axis=0),
            damping=np.sum([load.damping for load in linear], axis=0),
            stiffness=np.sum([load.stiffness for load in linear], axis=0),
            viscosity=_present(linear, "viscosity"),
            section=_present(linear, "section"),
            offset=sum(load.offset for load in linear),
            strain=sum(load.strain for load in linear),
            drives=tuple(drive for load in linear for drive in load.drives),
            floor=_floor(linear),
        )
    return loads[0] if len(loads) == 1 else Total(loads)
