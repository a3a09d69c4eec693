"""The rod: its parameters, and a scene that it moves in."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from discs import checks
from discs.chain import ROLLING

Fields = Callable[[NDArray], tuple[NDArray, NDArray, NDArray, NDArray]]


@dataclass(frozen=True, kw_only=True)
class Rod:
    """A nonholonomic Cosserat rod, the paper's section 3; any consistent unit system.

    Kinetic energy per length rho |r.|**2/2 + alpha omega**2/2, potential beta theta'**2/2 + K |r''|**2/2.

    Parameters
    ----------
    length : of the rod, > 0.
    density : rho, mass per length, > 0.
    spin_inertia : alpha, moment of inertia about the discs' axle per length, >= 0.
    torsion_stiffness : beta, >= 0.
    bending_stiffness : K, >= 0.
    radius : R, of the discs, > 0.

    Raises
    ------
    ValueError : for a parameter outside its range.
    """

    length: float
    density: float
    spin_inertia: float
    torsion_stiffness: float
    bending_stiffness: float
    radius: float

    def __post_init__(self) -> None:
        for name in ("length", "density", "radius"):
            object.__setattr__(self, name, checks.number(name, getattr(self, name), positive=True))
        for name in ("spin_inertia", "torsion_stiffness", "bending_stiffness"):
            value = checks.number(name, getattr(self, name))
            if value < 0:
                raise ValueError(f"{name} must be at least 0; got {value!r}")
            object.__setattr__(self, name, value)

    @property
    def inertia(self) -> float:
        """M = alpha + rho R**2, inertia per length against rolling while |r'| = 1."""
        return self.spin_inertia + self.density * self.radius**2


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A rod, its law of rolling, its ends, its initial fields and how long it moves.

    Parameters
    ----------
    rod : the rod.
    initial : a function of the places s (n,) that returns x, y, theta, omega, each (n,).
    duration : time, > 0.
    rolling : "field", r. = R omega J r' (the paper's (constraints)), or "unit", r. = R omega J r'/|r'| (constraintsphi).
    closed : periodic in s rather than with two free ends.
    shift : for a closed rod, r(s + length) - r(s); (0, 0) is a ring, (length, 0) a straight periodic rod.
    name : for titles.

    Raises
    ------
    ValueError : for an unknown law, a duration that is not positive, or a shift of a rod that is not closed.
    """

    rod: Rod
    initial: Fields = field(repr=False)
    duration: float
    rolling: str = "field"
    closed: bool = False
    shift: tuple[float, float] = (0.0, 0.0)
    name: str = "scene"

    def __post_init__(self) -> None:
        if not isinstance(self.rod, Rod) or not callable(self.initial):
            raise ValueError(f"a scene needs a Rod and a function of s; got {self.rod!r} and {self.initial!r}")
        if not isinstance(self.closed, bool):
            raise ValueError(f"closed must be True or False; got {self.closed!r}")
        checks.choice("rolling", self.rolling, ROLLING)
        object.__setattr__(self, "duration", checks.number("duration", self.duration, positive=True))
        shift = checks.field("shift", self.shift, 2)
        if shift.any() and not self.closed:
            raise ValueError(f"shift belongs to a closed rod; got shift={self.shift} with closed=False")
        object.__setattr__(self, "shift", tuple(np.asarray(shift).tolist()))
