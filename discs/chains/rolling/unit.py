"""True rolling of a disc of radius R (constraintsphi), r. = R omega J r'/|r'|: h(z) = z/|z|."""

from typing import NamedTuple

import numpy as np

from discs.arrays import Complex, Float
from discs.chains.rolling.law import RollingLaw
from discs.kernels import protocol as do
from discs.kernels.compiled import fill


class UnitRolling(NamedTuple):
    """Parameters of the compiled form, chosen by this type alone. (For numba a NamedTuple must have a field.)"""

    stretching: float


class UnitLaw(RollingLaw):
    """A disc travels R per radian of roll, independent of the stretch of the line."""

    name = "unit"
    formula = "true rolling, ṙ = RωJr'/|r'|"
    vanishing = True
    parameters = UnitRolling(0.0)

    def size(self, length: Float) -> Float:
        return np.ones_like(length)

    def arm(self, radius: float | Float, z: Float) -> float | Float:
        arm: Float = radius / np.hypot(*z)
        return arm

    def rate(self, z: Float, dz: Float) -> Float:
        """The component of dz perpendicular to z, over |z|."""
        square = (z * z).sum(axis=0)
        across: Float = (dz - z * ((z * dz).sum(axis=0) / square)) / np.sqrt(square)
        return across

    def jet(self, z: Complex, z1: Complex, z2: Complex) -> tuple[Complex, Complex, Complex]:
        """h = exp(i phi) with phi' = Im(z'/z): h' = i phi' h and h'' = (i phi'' - phi'^2) h."""
        h, log = z / np.abs(z), z1 / z
        rate, turning = 1j * log.imag, 1j * (z2 / z - log * log).imag
        return h, rate * h, (turning + rate * rate) * h


@fill(do.contact, UnitRolling)
def _contact(law: UnitRolling, radius: float, half: float, x: float, y: float) -> tuple[float, float, float, float]:
    return x, y, radius / np.sqrt(x * x + y * y), radius * radius


@fill(do.jet, UnitRolling)
def _jet(law: UnitRolling, z: complex, z1: complex, z2: complex) -> tuple[complex, complex, complex]:
    square = z.real * z.real + z.imag * z.imag
    inverse = z.conjugate() * (1 / square)
    log = z1 * inverse
    rate, turning = log.imag, (z2 * inverse - log * log).imag
    h = z * (1 / np.sqrt(square))
    return h, 1j * rate * h, complex(-rate * rate, turning) * h


@fill(do.vanishing, UnitRolling)
def _vanishing(law: UnitRolling) -> bool:
    return True
