"""The paper's law (constraints), r. = R omega J r': h(z) = z."""

from typing import NamedTuple

from discs.arrays import Complex, Float
from discs.chains.rolling.law import RollingLaw
from discs.kernels import protocol as do
from discs.kernels.compiled import fill


class FieldRolling(NamedTuple):
    """Parameters of the compiled form, chosen by this type alone. (For numba a NamedTuple must have a field.)"""

    stretching: float


class FieldLaw(RollingLaw):
    """A disc travels R |r'| per radian of roll: more where the line is stretched."""

    name = "field"
    formula = "the paper's law, ṙ = RωJr'"
    vanishing = False
    parameters = FieldRolling(1.0)

    def size(self, length: Float) -> Float:
        return length

    def arm(self, radius: float | Float, z: Float) -> float | Float:
        return radius

    def rate(self, z: Float, dz: Float) -> Float:
        return dz

    def jet(self, z: Complex, z1: Complex, z2: Complex) -> tuple[Complex, Complex, Complex]:
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
