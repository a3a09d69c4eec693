"""Parameters of a rod: numbers, or functions of the place s."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeAlias, TypeVar

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float

Function: TypeAlias = Callable[[Float], ArrayLike]
Parameter: TypeAlias = float | Function
T = TypeVar("T", float, Float)

POSITIVE = ("density", "heading_inertia")  # the others may be 0
CHECKED = 1025  # equally spaced places at which a new rod's functions are read, the ends included


@dataclass(frozen=True, kw_only=True)
class Section(Generic[T]):
    """The parameters of a rod, named as in `Rod` and `SteeredRod`: numbers, or arrays over places along the rod.

    An array of a parameter that does not vary has no dimensions. Parameters that a rod does not have are 0.
    """

    density: T
    spin_inertia: T
    torsion_stiffness: T
    bending_stiffness: T
    radius: T
    stretch_stiffness: T
    shear_stiffness: T
    heading_inertia: T

    @property
    def inertia(self) -> T:
        """M = alpha + rho R**2, the inertia of rolling per length while |r'| = 1."""
        return self.spin_inertia + self.density * (self.radius * self.radius)  # a power would raise where this is inf


def sample(name: str, parameter: Parameter, s: Float) -> Float:
    """A parameter at places s of any shape: an array of this shape, or one without dimensions if it is a number.

    Raises
    ------
    ValueError : if the function fails, returns anything but a finite number for each place, or is negative (zero, for a density or
        an inertia about the vertical). The message names s.
    """
    if not callable(parameter):
        return np.asarray(parameter)
    places = s.ravel()
    need = f"{name} must be a number or a function of places s (m,) that returns (m,) numbers"
    try:
        with np.errstate(all="ignore"):
            given = parameter(places.copy())
    except Exception as error:
        raise ValueError(f"{need}; {checks.shown(parameter)} raised {type(error).__name__}: {error}") from error
    values = checks.array(name, given, f"a number or a function of places s that returns finite numbers (s of shape {s.shape})")
    if values.shape not in ((), places.shape):
        raise ValueError(f"{need}; got shape {values.shape} for s of shape {places.shape}, from s = {places[0]:g} on")
    values = np.broadcast_to(values, places.shape)
    strict = name in POSITIVE
    bad = ~np.isfinite(values) | (values <= 0 if strict else values < 0)
    if bad.any():
        i = int(np.argmax(bad))
        raise ValueError(
            f"{name} must be finite and {'above' if strict else 'at least'} 0; got {values[i]:g} at s = {places[i]:.6g}"
        )
    return values.reshape(s.shape)


@dataclass(frozen=True)
class polynomial:
    """c_0 + c_1 s + c_2 s^2 + ...: coefficients c (m,)."""

    coefficients: ArrayLike

    def __post_init__(self) -> None:
        given = checks.array("coefficients of polynomial", self.coefficients)
        if given.ndim != 1 or not given.size or not np.isfinite(given).all():
            raise ValueError(f"coefficients of polynomial must be a list of finite numbers; got {checks.shown(self.coefficients)}")
        object.__setattr__(self, "coefficients", tuple(given.tolist()))

    def __call__(self, s: Float) -> Float:
        found: Float = np.polynomial.polynomial.polyval(s, np.asarray(self.coefficients))
        return found


@dataclass(frozen=True, repr=False)
class table:
    """Values at given places and, between them, cubics that are monotone where the values are (PCHIP): none is negative if the
    values are not, and the slope is continuous. Before the first and after the last place it has the value there.

    s : (m,), increasing. values : (m,).
    """

    s: ArrayLike
    values: ArrayLike

    def __post_init__(self) -> None:
        s = checks.array("s of table", self.s)
        if s.ndim != 1 or s.size < 2 or not np.isfinite(s).all() or (np.diff(s) <= 0).any():
            raise ValueError(f"s of table must be two or more increasing places; got {checks.shown(self.s)}")
        object.__setattr__(self, "s", tuple(s.tolist()))
        object.__setattr__(self, "values", tuple(checks.field("values of table", self.values, s.size).tolist()))

    def __repr__(self) -> str:
        s, values = np.asarray(self.s), np.asarray(self.values)
        return f"table({s.size} values, {values.min():g} to {values.max():g}, s = {s[0]:g} to {s[-1]:g})"

    def __call__(self, s: Float) -> Float:
        known = np.asarray(self.s)
        found: Float = scipy.interpolate.PchipInterpolator(known, np.asarray(self.values))(np.clip(s, known[0], known[-1]))
        return found


NAMES: dict[str, type[polynomial | table]] = {"polynomial": polynomial, "table": table}
