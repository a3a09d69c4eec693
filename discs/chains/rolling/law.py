"""The interface of a law of rolling; see `discs.chains.rolling`."""

from typing import ClassVar, Protocol

import numpy as np

from discs.arrays import Complex, Float
from discs.skew import Parameters


class RollingLaw(Protocol):
    """A disc rolls by r. = e omega with e = R J h(z), z = r' the slope of the centre line and J the turn by +90 degrees.

    h(z) = (|h|/|z|) z points along z. All laws agree on the rod at its natural length: |h| = 1 where |z| = 1.

    Attributes
    ----------
    name : as given to `Chain(rolling=...)` and `Scene(rolling=...)`.
    formula : the law in words, for reports.
    vanishing : whether h has no limit as z -> 0; a run then stops if a slope vanishes.
    parameters : for the compiled form, a NamedTuple whose type the stubs `contact`, `jet` and `vanishing` of
        `discs.kernels.protocol` are filled in for. None if there is none: runs then take the plain engine.
    """

    name: ClassVar[str]
    formula: ClassVar[str]
    vanishing: ClassVar[bool]
    parameters: ClassVar[Parameters]

    def size(self, length: Float) -> Float:
        """|h| from |z|, of any shape."""

    def arm(self, radius: float | Float, z: Float) -> float | Float:
        """R |h|/|z|, (n,), for slopes (2, n): e = arm J z. Length."""

    def rate(self, z: Float, dz: Float) -> Float:
        """The derivative of h at z along dz; all three (2, ...)."""

    def jet(self, z: Complex, z1: Complex, z2: Complex) -> tuple[Complex, Complex, Complex]:
        """h, h', h'' from z, z', z'' of one shape, a prime for d/ds; vectors are complex numbers x + i y."""


def stretching(law: RollingLaw) -> float:
    """gamma = d|h|/d|z| at |z| = 1, the relative growth of travel with stretch: 1 for the field law, 0 for the unit law.

    Small waves of the straight rod depend on the law by gamma only, see `continuum.dispersion`.
    """
    along = np.array([1.0, 0.0])
    return float(law.rate(along, along)[0])
