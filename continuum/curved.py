r"""Rest curvature of a rod whose headings follow the line, in Galerkin's method (`continuum.weak`).

The energy int K |r'' - kappa J r'|^2/2 has, beside int K |r''|^2/2,

    U = int K (kappa^2 |z|^2/2 - kappa Im(conj(z) z')),   z = r' as complex numbers.

With coefficients a of the line, z = Z a + c and z' = B a at the places of a quadrature (c is the mean slope of a closed rod),

    -dU/da = sum w K (kappa (i B^T z - i Z^T z') - kappa^2 Z^T z) = -(H a + h),
    H = int K (kappa^2 Z^T Z - i kappa (B^T Z - Z^T B)),

a Hermitian matrix, so H is real for x and y together: U stays quadratic, and Gauss steps conserve or balance the energy. kappa is
the sum of a constant part and of parts times signals. At free ends the natural condition is then J r' . r'' = kappa |r'|^2; see
`discs.loads.bends` for this and for beta (theta' - tau_0) = K e . (r'' - kappa J r')'.
"""

from typing import NamedTuple

import numpy as np

from discs.arrays import Complex, Float


class Curved(NamedTuple):
    """U on n functions, for P parts of kappa, the first of them constant.

    parts : indices of the drives that multiply the others. turn : (P, n, n + 1), int K kappa_p (B^T Z - Z^T B) and, last,
    int K kappa_p B^T c. stretch : (P, P, n, n + 1), the same of int K kappa_p kappa_q Z^T Z and Z^T c. level : (P, P), of |c|^2/2.
    """

    parts: list[int]
    turn: Complex
    stretch: Complex
    level: Float

    @classmethod
    def of(cls, kappas: Float, parts: list[int], weights: Float, slope: Float, bend: Float, mean: complex) -> "Curved":
        """For kappa (P, S), weights K w (S,), and the matrices Z and B (S, n)."""
        extended = np.column_stack([slope, np.full(len(slope), mean)])
        bare = np.column_stack([bend, np.zeros(len(bend))])
        heavy = weights * kappas
        turn = np.array([(bend.T * k) @ extended - (slope.T * k) @ bare for k in heavy])
        stretch = np.array([[(slope.T * (k * other)) @ extended for other in kappas] for k in heavy])
        return cls(parts, turn, stretch, 0.5 * abs(mean) ** 2 * heavy @ kappas.T)

    def split(self) -> Float:
        """h of the constant part, (2, n), which becomes zero here."""
        h = self.rest[:, -1]
        self.turn[0, :, -1], self.stretch[0, 0, :, -1] = 0, 0
        return np.array([h.real, h.imag])

    def matrices(self, values: Float) -> Complex:
        """H and, as a last column, h, for signals of the drives (m, L): (m, n, n + 1)."""
        now = self._now(values)
        found: Complex = np.einsum("mp,mq,pqij->mij", now, now, self.stretch) - 1j * np.einsum("mp,pij->mij", now, self.turn)
        return found

    @property
    def rest(self) -> Complex:
        """H and h of the constant part, (n, n + 1)."""
        found: Complex = self.stretch[0, 0] - 1j * self.turn[0]
        return found

    def _now(self, values: Float) -> Float:
        return np.column_stack([np.ones(len(values)), values[:, self.parts]])

    def energies(self, values: Float, q: Float) -> Float:
        """U at signals (m, L) and positions (m, 3, n)."""
        now = self._now(values)
        total: Float = energies(self.matrices(values), q) + np.einsum("mp,mq,pq->m", now, now, self.level)
        return total


def forces(matrix: Complex, q: Float) -> Float:
    """-dU/dr, (..., 2, n), for H and h (..., n, n + 1) and positions (..., 3, n)."""
    a = q[..., 0, :] + 1j * q[..., 1, :]
    pull = -(matrix[..., :-1] @ a[..., None])[..., 0] - matrix[..., -1]
    return np.stack([pull.real, pull.imag], axis=-2)


def energies(matrix: Complex, q: Float) -> Float:
    """The part of U that depends on positions (..., 3, n)."""
    a = q[..., 0, :] + 1j * q[..., 1, :]
    total: Float = (a.conj() * (0.5 * (matrix[..., :-1] @ a[..., None])[..., 0] + matrix[..., -1])).real.sum(axis=-1)
    return total


def product(matrix: Complex, moves: Float) -> Float:
    """The matrix (m, m) of the second variation of U for moves (m, 2, n)."""
    u = moves[:, 0] + 1j * moves[:, 1]
    found: Float = (u.conj() @ matrix[:, :-1] @ u.T).real
    return found
