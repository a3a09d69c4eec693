"""The paper's law (constraints), r. = R omega J r': h(z) = z."""

from typing import Any, NamedTuple

from numpy.typing import NDArray

from discs.chains.rolling.law import RollingLaw
from discs.kernels import protocol as do
from discs.kernels.compiled import fill


class FieldRolling(NamedTuple):
    """The compiled form needs no numbers but a kind of its own."""

    stretching: float


class FieldLaw(RollingLaw):
    """A disc's travel for an angle of roll is R times the slope, so that it grows where the line is stretched."""

    name = "field"
    formula = "the paper's law, ṙ = RωJr'"
    vanishing = False
    parameters = FieldRolling(1.0)

    def size(self, length: Any) -> Any:
        return length

    def arm(self, radius: Any, z: Any) -> Any:
        return radius

    def rate(self, z: NDArray, dz: NDArray) -> NDArray:
        return dz

    def jet(self, z: NDArray, z1: NDArray, z2: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        return z, z1, z2


@fill(do.contact, FieldRolling)
def _contact(law: FieldRolling, radius: float, half: float, x: float, y: float) -> tuple[float, float, float, float]:
    a = radius * half
    x, y = x * a, y * a
    return x, y, 1.0, x * x + y * y


@fill(do.jet, FieldRolling)
def _jet(law: FieldRolling, z: complex, z1: complex, z2: complex) -> tuple[complex, complex, complex]:
    return z, z1, z2


@fill(do.vanishing, FieldRolling)
def _vanishing(law: FieldRolling) -> bool:
    return False
