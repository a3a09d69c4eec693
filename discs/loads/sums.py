"""The sum of several loads."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from discs.arrays import Float, Matrix
from discs.loads.bends import Bends
from discs.loads.linear import Linear, tabled
from discs.loads.motor import Held
from discs.loads.own import OwnLoad
from discs.loads.signals import Signal
from discs.skew import Load, Parameters


@dataclass(frozen=True, eq=False)
class Total(Load):
    """The sum of loads, of which at most one is linear. It has a compiled form if numba compiles the functions of the others."""

    loads: tuple[Load, ...]

    def __post_init__(self) -> None:
        for name in ("damping", "stiffness"):
            object.__setattr__(self, name, np.sum([getattr(load, name) for load in self.loads], axis=0))
        for name in ("viscosity", "section"):
            object.__setattr__(self, name, _present(self.loads, name))
        object.__setattr__(self, "conservative", all(load.conservative for load in self.loads))
        object.__setattr__(self, "passive", all(load.conservative or load.passive for load in self.loads))
        object.__setattr__(self, "least", sum(load.least for load in self.loads))

    def potential(self, t: float, q: Float) -> float:
        return sum(load.potential(t, q) for load in self.loads)

    def driven(self, t: float, q: Float) -> float:
        return sum(load.driven(t, q) for load in self.loads)

    def power(self, t: float, q: Float, v: Float) -> tuple[float, float]:
        work, dissipated = np.sum([load.power(t, q, v) for load in self.loads], axis=0)
        return float(work), float(dissipated)

    def bands(self, t: float, q: Float, c: Float, d: complex, g: complex) -> Any:
        return next((found for load in self.loads if (found := load.bands(t, q, c, d, g)) is not None), None)

    def force(self, t: float, q: Float, v: Float) -> Float:
        found: Float = np.sum([load.force(t, q, v) for load in self.loads], axis=0)
        return found

    def derivatives(self, t: float, q: Float, v: Float) -> tuple[Matrix, Matrix]:
        found = [load.derivatives(t, q, v) for load in self.loads]
        return sum(of_q for of_q, _ in found), sum(of_v for _, of_v in found)

    @cached_property
    def linear(self) -> Linear:
        """The linear one, zero if there is none."""
        return next((load for load in self.loads if isinstance(load, Linear)), Linear(np.zeros_like(self.damping)))

    @cached_property
    def parameters(self) -> Parameters:
        """For the compiled form; None if one of the loads has none."""
        linear, own = self.linear.parameters, [load for load in self.loads if isinstance(load, OwnLoad)]
        functions = [load.functions for load in own]
        if linear is None or None in functions or any(not isinstance(load, Linear | OwnLoad) for load in self.loads):
            return None
        from discs.kernels import functions as kernels  # numba is slow to import

        found = kernels.addresses(tuple(functions))
        return found and kernels.Functions(linear, own[0].w, *found, linear.spent)

    @property
    def signals(self) -> tuple[tuple[Signal, str], ...]:  # type: ignore[override]
        """The signal of each drive, with the name of its load."""
        return self.linear.signals

    def timed(self, times: Float, h: float) -> Parameters:
        return tabled(self, times, h)


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
        rest = total(tuple(load for load in loads if not isinstance(load, Held))) or Linear(np.zeros_like(motors[0].damping))
        return Held(tuple(axle for load in motors for axle in load.axles), rest)
    others = tuple(load for load in loads if not isinstance(load, Linear))
    if linear := [load for load in loads if isinstance(load, Linear)]:  # one, as rest shapes of several loads are one strain
        others = (_linear(linear), *others)
    return others[0] if len(others) == 1 and not isinstance(others[0], OwnLoad) else Total(others)


def _linear(loads: list[Linear]) -> Linear:
    """The sum of linear loads."""
    stiffness = np.sum([load.stiffness for load in loads], axis=0)
    moments = np.sum([load.stiffness * load.about for load in loads], axis=0)
    return Linear(
        constant=np.sum([load.constant for load in loads], axis=0),
        damping=np.sum([load.damping for load in loads], axis=0),
        stiffness=stiffness,
        viscosity=_present(loads, "viscosity"),
        section=_present(loads, "section"),
        bends=_bends([load.bends for load in loads if load.bends is not None]),
        offset=sum(load.offset for load in loads),
        strain=sum(load.strain for load in loads),
        drives=tuple(drive for load in loads for drive in load.drives),
        floor=_floor(loads),
        degree=max(load.degree for load in loads),
        about=np.divide(moments, stiffness, out=np.zeros_like(moments), where=stiffness > 0),
    )


def _bends(all_: list[Bends]) -> Bends | None:
    """The bends of several loads on one chain."""
    if not all_:
        return None
    viscosity, rest = (np.sum([getattr(bends, name) for bends in all_], axis=0) for name in ("viscosity", "rest"))
    return replace(all_[0], viscosity=viscosity, rest=rest)
