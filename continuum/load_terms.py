"""The loads of a scene at places along the rod: what each load of `discs.loads` is, in the terms of `continuum.weak`."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import singledispatch
from typing import Any, NamedTuple, Self

import numpy as np

from continuum.load_places import read
from continuum.motors import Axle
from continuum.rod import Scene
from discs import checks
from discs.arrays import Complex, Float
from discs.loads import Damping, Force, Motor, OnRod, Rest, Slope, Spring, Torque, signals
from discs.loads.binding import nonzero, signal_of
from discs.loads.signals import Signal

X, Y, ROLL, TWIST = range(4)  # what a force acts on: x, y, theta, theta'


class Drive(NamedTuple):
    """A force that a signal multiplies: on x, y, theta and theta' at places, (4, S). strain, curvature : as in `Terms`."""

    push: Float
    signal: Signal
    name: str
    strain: Float | float = 0.0
    curvature: Float | float = 0.0


@dataclass(eq=False)
class Terms:
    """Loads at places along the rod, weights of the quadrature included.

    s, w : (S,), places and weights; a place of a point load has the weight 0.
    push : (4, S), constant forces on x, y, theta, theta', with a potential.
    damping : (2, S), on omega and omega'. stiffness : (S,), of springs. offset : energy.
    strain : (S,), the constant rest twist times sqrt(beta w); the square of the sum of rest twists is part of the energy.
    curvature : (S,), the constant rest curvature.
    """

    scene: Scene
    s: Float
    w: Float
    push: Float = field(init=False)
    damping: Float = field(init=False)
    stiffness: Float = field(init=False)
    strain: Float = field(init=False)
    curvature: Float = field(init=False)
    offset: float = 0.0
    drives: list[Drive] = field(default_factory=list)
    axles: list[Axle] = field(default_factory=list)

    def __post_init__(self) -> None:
        n = self.s.size
        self.push, self.damping = np.zeros((4, n)), np.zeros((2, n))
        self.stiffness, self.strain, self.curvature = np.zeros((3, n))

    @classmethod
    def along(cls, scene: Scene, loads: tuple[OnRod, ...], s: Float, form: Callable[[Any, Any], None] | None = None) -> Self:
        """The loads at places (S,), per length; those at points as they are. form : adds a load, by default `add`."""
        terms = cls(scene, s, np.ones(s.size))
        for load in loads:
            (form or add)(load, terms)
        return terms

    def at(self, load: OnRod, name: str, least: float | None = None) -> Float:
        """A pattern at the places, (S,)."""
        return read(f"{name} of {type(load).__name__}", getattr(load, name), self.s, least)

    def shared(self, load: Any, name: str, least: float | None = None) -> Float:
        """A pattern times the weights, (S,), or the number at the place of a point load; ValueError for a pattern there."""
        values = self.at(load, name, least)
        if load.at is None:
            return self.w * values
        if callable(getattr(load, name)):
            raise ValueError(f"{name} of {type(load).__name__} with at= is one number; got a function")
        there = self.s == load.at
        shared: Float = np.where(there, values, 0.0) / max(np.count_nonzero(there), 1)
        return shared

    def row(self, load: Any) -> int:
        """The row of the angle that a load is about; ValueError for "turn", as headings follow the line here."""
        if load.about != "roll":
            name = type(load).__name__
            raise ValueError(f"{name}: about={load.about!r} is for rods with headings of their own; here they follow the line")
        return ROLL

    def drive(self, load: Any, rows: dict[int, Float], strain: Float | float = 0.0, curvature: Float | float = 0.0) -> None:
        push = np.zeros((4, self.s.size))
        for row, values in rows.items():
            push[row] = values
        name = type(load).__name__
        self.drives.append(Drive(push, signal_of(name, load.signal), name, strain, curvature))

    def _driven(self, t: Float, constant: Float, driven: list[Float | float]) -> Float:
        """What is constant, and what the signals of the drives multiply, at times (k,), (k, S)."""
        total: Float = np.tile(constant, (t.size, 1))
        for drive, part in zip(self.drives, driven, strict=True):
            total += np.outer(signals.values(drive.signal, t, drive.name), part + 0 * self.s)
        return total

    def force(self, t: Float, r: Complex) -> Complex:
        """The forces at times (k,) on a line r = x + i y, (k, S)."""
        push = (self._driven(t, self.push[row], [drive.push[row] for drive in self.drives]) for row in (X, Y))
        found: Complex = next(push) + 1j * next(push) - self.stiffness * r
        return found

    def torque(self, t: Float, omega: Float) -> Float:
        """The torques about the axles, those of rest shapes and of viscosity left out, (k, S)."""
        found: Float = self._driven(t, self.push[ROLL], [drive.push[ROLL] for drive in self.drives]) - self.damping[0] * omega
        return found

    def rest(self, t: Float, name: str) -> Float:
        """`strain` or `curvature` at times (k,), (k, S)."""
        return self._driven(t, getattr(self, name), [getattr(drive, name) for drive in self.drives])


@singledispatch
def add(load: Any, to: Terms) -> None:
    """Add a load to the terms; a form for each class of loads."""


def spread_and_points(scene: Scene) -> tuple[tuple[OnRod, ...], tuple[OnRod, ...]]:
    """The loads that act along the rod, and those that act at points."""
    points = tuple(load for load in scene.loads if getattr(load, "at", None) is not None)
    return tuple(load for load in scene.loads if load not in points), points


def viscosity(loads: tuple[OnRod, ...], s: Float) -> Float:
    """The viscosity of bending at places (S,)."""
    total = np.zeros(s.size)
    for load in loads:
        if isinstance(load, Damping):
            total += read("bending of Damping", load.bending, s, 0.0)
    return total


def check_taken(loads: tuple[OnRod, ...]) -> None:
    """ValueError for a load that has no form."""
    for load in loads:
        if add.dispatch(type(load)) is add.dispatch(object):
            raise ValueError(
                f"{type(load).__name__}: the spectral solver has no form of it; take method='richardson', or "
                "simulate(lump(scene, n))"
            )


def _refuse_headings(load: OnRod, *names: str) -> None:
    for name in names:
        if nonzero(getattr(load, name)):
            raise ValueError(f"{type(load).__name__}: {name} is for rods with headings of their own; here they follow the line")


@add.register
def _(load: Torque, to: Terms) -> None:
    to.drive(load, {to.row(load): to.shared(load, "pattern")})


@add.register
def _(load: Force, to: Terms) -> None:
    to.drive(load, {X: to.shared(load, "x"), Y: to.shared(load, "y")})


@add.register
def _(load: Motor, to: Terms) -> None:
    if to.scene.closed or load.at not in (0, to.scene.rod.length):
        raise ValueError(
            f"Motor: at s = {load.at:g} it makes a corner inside the rod, which the functions of the spectral method do not have; "
            "drive an end, or take a SteeredRod, or discs: simulate(lump(scene, n)), or method='richardson'"
        )
    to.axles.append(Axle(to.row(load), load.at, load.signal))


@add.register
def _(load: Slope, to: Terms) -> None:
    for row, g in ((X, load.gx), (Y, load.gy)):
        to.push[row] += to.scene.rod.at(to.s).density * checks.number("g of Slope", g) * to.w


@add.register
def _(load: Spring, to: Terms) -> None:
    stiffness = to.shared(load, "stiffness", 0.0)
    x, y = to.at(load, "x"), to.at(load, "y")
    to.stiffness += stiffness
    to.push[X] += stiffness * x
    to.push[Y] += stiffness * y
    to.offset += 0.5 * float(stiffness @ (x * x + y * y))


@add.register
def _(load: Damping, to: Terms) -> None:
    _refuse_headings(load, "turning")
    for row, name in enumerate(("rolling", "torsion")):
        to.damping[row] += to.w * to.at(load, name, least=0.0)


@add.register
def _(load: Rest, to: Terms) -> None:
    _refuse_headings(load, "stretch", "shear", "mounting_angle")
    root = np.sqrt(to.scene.rod.at(to.s).torsion_stiffness * to.w)
    strain, curvature = root * to.at(load, "twist"), to.at(load, "curvature")
    if load.signal is None:
        to.push[TWIST] += root * strain
        to.strain += strain
        to.curvature += curvature
    else:
        to.drive(load, {TWIST: root * strain}, strain, curvature)
