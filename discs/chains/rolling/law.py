"""What a law of rolling is; see `discs.chains.rolling`."""

from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray


class RollingLaw(Protocol):
    """A disc rolls by r. = e omega with e = R J h(z), z = r' the slope of the centre line and J the turn by +90 degrees.

    h(z) = (|h|/|z|) z points along z. All laws agree on the rod at its natural length: |h| = 1 where |z| = 1.

    Attributes
    ----------
    name : as given to `Chain(rolling=...)` and `Scene(rolling=...)`.
    formula : the law in words, for reports.
    vanishing : whether h has no limit as z -> 0; runs then stop where a slope vanishes.
    parameters : for the compiled form, a NamedTuple that stubs of `discs.kernels.protocol` are filled for. None if there is none:
        runs then take the plain engine.
    """

    name: ClassVar[str]
    formula: ClassVar[str]
    vanishing: ClassVar[bool]
    parameters: ClassVar[Any]

    def size(self, length: Any) -> Any:
        """|h| for |z|, of any shape."""

    def arm(self, radius: Any, z: Any) -> Any:
        """R |h|/|z| (n,) for slopes (2, n): e = arm J z. Length."""

    def rate(self, z: NDArray, dz: NDArray) -> NDArray:
        """The derivative of h at z along dz, (2, ...) all three."""

    def jet(self, z: NDArray, z1: NDArray, z2: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """h, h', h'' for z, z', z'' of any one shape, a prime for d/ds; vectors as complex numbers x + i y."""


def stretching(law: RollingLaw) -> float:
    """gamma = d|h|/d|z| at |z| = 1: how a disc's travel grows where the line is stretched. 1 for the field law, 0 for the unit law.

    It alone tells how small waves of the straight rod differ from law to law, see `continuum.dispersion`.
    """
    along = np.array([1.0, 0.0])
    return float(law.rate(along, along)[0])
