r"""Viscosity of bending of a rod whose headings follow the line, in Galerkin's method (`continuum.weak`).

The power is int eta kappa.^2 with kappa = J r' . r'' = Im(conj(z) z'), z = r' as complex numbers. With coefficients a of the line,
z = Z a + c and z' = B a at the finer points of the functions,

    kappa. = Re(W a.),   W = -i (conj(z) B - conj(z') Z),   and the force on a is  -int eta kappa. conj(W).

Z and B are those of headings, without the highest functions. `discs.loads.bends` derives what viscosity does at free ends.
"""

from typing import NamedTuple

import numpy as np

from continuum.functions import Functions
from discs.arrays import Complex, Float


class Viscous(NamedTuple):
    """eta : (F,), viscosity times shares of the length. turns : (n, 2 F), from coefficients to z - c and z'. mean : c."""

    eta: Float
    turns: Float
    mean: complex

    @classmethod
    def of(cls, eta: Float, functions: Functions, mean: complex) -> "Viscous":
        """For a viscosity (F,) at the finer points."""
        n, finer = functions.s.size, eta.size
        turns = np.ascontiguousarray(functions.bends[n : n + 2 * finer].T)
        return cls(functions.shares * eta, turns, mean)

    def _line(self, q: Float) -> tuple[Complex, Complex]:
        """z and z', (..., F), for positions (..., 2 or 3, n)."""
        a: Complex = q[..., 0, :] + 1j * q[..., 1, :]
        finer = self.eta.size
        return a @ self.turns[:, :finer] + self.mean, a @ self.turns[:, finer:]

    def rates(self, q: Float, v: Float) -> Float:
        """kappa., (..., F), at positions and rates (..., 3, n)."""
        z, z1 = self._line(q)
        dz, dz1 = self._line(v)
        found: Float = ((dz - self.mean).conj() * z1 + z.conj() * dz1).imag
        return found

    def dissipated(self, q: Float, v: Float) -> Float:
        """The power, (...,)."""
        return self.rates(q, v) ** 2 @ self.eta

    def force(self, q: Float, v: Float) -> Float:
        """(..., 2, n)."""
        z, z1 = self._line(q)
        moment = self.eta * self.rates(q, v)
        pull = np.concatenate([1j * moment * z1, -1j * moment * z], axis=-1) @ self.turns.T
        return np.stack([pull.real, pull.imag], axis=-2)

    def product(self, q: Float, moves: Float) -> Float:
        """The matrix (m, m) of the power for moves (m, 2, n) from a position (3, n)."""
        rates = self.rates(q, moves)
        return (rates * self.eta) @ rates.T
