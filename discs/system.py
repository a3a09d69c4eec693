r"""The discs as a skew-gradient system, q' = C(q) pi, pi' = -C(q)^T grad V(q).

Lagrange-d'Alembert for disc i (a dot is d/dt, w its share of length, F = -dV/dr_i, F_theta = -dV/dtheta_i):

    rho w r.. = F + lambda,   alpha w theta.. = F_theta - e.lambda,   r. = e theta.

Eliminating lambda, with r.. = e omega. + e. omega:

    w (alpha + rho |e|^2) omega. + w rho omega e.e. = e.F + F_theta.

Put m = w (alpha + rho |e|^2) and pi = sqrt(m) omega. Then pi. = (m omega. + m. omega/2)/sqrt(m) and m./2 = w rho e.e., so

    (r_i, theta_i). = c_i pi_i,  pi_i. = -c_i . dV/d(r_i, theta_i),  c_i = (e_i, 1)/sqrt(m_i).

H = |pi|^2/2 + V(q) is constant because the two factors C are each other's transpose, and quadratic because V is.
The rolling constraint holds identically. Arrays are (3, n): rows x, y, theta.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg.lapack import dpbsv

from discs import stencils
from discs.chain import Chain


class Phase(NamedTuple):
    """A point of phase space: positions as an unevaluated sum of two doubles, and momenta.

    hi, lo : (3, n), rows x, y, theta; q = hi + lo with lo below half a unit in the last place of hi.
    pi : (n,), square root of the inertia times the rate of roll.
    """

    hi: NDArray
    lo: NDArray
    pi: NDArray


def add(hi: NDArray, lo: NDArray, increment: NDArray) -> tuple[NDArray, NDArray]:
    """Add an increment to hi + lo without losing its low digits (Knuth's two-sum)."""
    term = increment + lo
    total = hi + term
    part = total - hi
    return total, (hi - (total - part)) + (term - part)


class RollingSystem:
    """The equations of motion of a chain whose headings are slaved to its centre line.

    Attributes
    ----------
    weights : (3, n), inertia of each disc against x., y., theta.: rho w, rho w, alpha w.
    """

    def __init__(self, chain: Chain) -> None:
        n, k, ends = chain.n, chain.k, chain.ends
        self.chain = chain
        self._ends = ends
        self._shift = np.array([*chain.shift, 0.0])
        self._unit = chain.rolling == "unit"
        self._radius = np.asarray(chain.radius)
        mass = chain.w * np.asarray(chain.density)
        self.weights = np.array([mass, mass, chain.w * np.asarray(chain.spin_inertia)])
        slope = stencils.slope_matrix(n, k, ends)
        bend = stencils.bend_matrix(n, k, ends)
        self._slope = sp.csr_array(sp.block_diag([slope, slope]))
        self._bend = sp.csr_array(sp.block_diag([bend, bend]))
        self._bend_stiffness = np.tile(np.asarray(chain.bending_stiffness) * stencils.bend_shares(n, k, ends), 2)
        self._torsion_stiffness = np.asarray(chain.torsion_stiffness) / k

    # Kinematics

    def links(self, hi: NDArray, lo: NDArray | None = None) -> NDArray:
        """Differences of neighbours, (3, n_links), from both parts of the positions."""
        d = stencils.links(hi, self._ends)
        if lo is not None:
            d += stencils.links(lo, self._ends)
        if self._ends == "ring":
            d[:, -1] += self._shift
        return d

    def increments(self, dq: NDArray) -> NDArray:
        """Change of the links for a change (3, n) of the positions."""
        return stencils.links(dq, self._ends)

    def slope(self, d: NDArray) -> NDArray:
        """Headings r', (2, n), from links."""
        return (self._slope @ d[:2].ravel()).reshape(2, -1)

    def contact(self, d: NDArray) -> NDArray:
        """Contact directions e, (2, n): a disc moves by e per unit of roll. Length per rad."""
        slope = self.slope(d)
        e = slope[::-1] * (self._radius / np.hypot(*slope) if self._unit else self._radius)
        np.negative(e[0], out=e[0])
        return e

    def inertia(self, e: NDArray) -> NDArray:
        """Inertia w (alpha + rho |e|**2) of each disc against rolling, (n,)."""
        return self.weights[2] + self.weights[0] * (e[0] ** 2 + e[1] ** 2)

    def frame(self, d: NDArray) -> NDArray:
        """The columns c_i = (e_i, 1)/sqrt(m_i) of C, as (3, n)."""
        c = np.empty((3, self.chain.n))
        c[:2] = self.contact(d)
        c[2] = 1 / np.sqrt(self.inertia(c[:2]))
        c[:2] *= c[2]
        return c

    def momentum(self, d: NDArray, omega: NDArray) -> NDArray:
        """pi from the rates of roll."""
        return np.sqrt(self.inertia(self.contact(d))) * omega

    def kinetic(self, v: NDArray) -> float:
        """Kinetic energy of rates (3, n) of x, y, theta."""
        return 0.5 * float(np.vdot(v, self.weights * v))

    # Springs

    def gradient(self, d: NDArray) -> NDArray:
        """grad V, (3, n), from links."""
        tension = np.empty_like(d)
        tension[:2] = (self._bend_tension @ d[:2].ravel()).reshape(2, -1)
        tension[2] = self._torsion_stiffness * d[2]
        return stencils.pull(tension, self._ends)

    def potential(self, d: NDArray, other: NDArray | None = None) -> float:
        """V of links d; with `other` the symmetric bilinear form of which V is the square, V(d, other)."""
        other = d if other is None else other
        bends = self._bend @ d[:2].ravel(), self._bend @ other[:2].ravel()
        twist = self._torsion_stiffness * d[2] @ other[2]
        return 0.5 * float((self._bend_stiffness * bends[0]) @ bends[1] + twist)

    @cached_property
    def _bend_tension(self) -> sp.csr_array:
        return sp.csr_array(self._bend.T @ sp.diags_array(self._bend_stiffness) @ self._bend)

    # The linear system of an implicit step

    def solve(self, c: NDArray, h: float, rhs: NDArray) -> NDArray:
        """Solve (I + h**2/4 C^T S C) p = rhs for p, (n,), where S is the Hessian of V; banded Cholesky, O(n).

        On a ring the discs are taken in the folded order 0, n-1, 1, n-2, ..., in which neighbours are at most two
        places apart: the matrix is banded there as well.
        """
        order, bands = self._bands
        if order is not None:
            c, rhs = c[:, order], rhs[order]
        width, n = bands.shape[0] - 1, c.shape[1]
        scaled = (0.25 * h * h) * c
        matrix = np.zeros((width + 1, n), order="F")
        for j, band in enumerate(bands):
            matrix[width - j, j:] = (band[:, j:] * scaled[:, j:] * c[:, : n - j]).sum(axis=0)
        matrix[width] += 1
        _, p, info = dpbsv(matrix, rhs, overwrite_ab=True)
        if info:
            p = np.full(n, np.nan)  # not positive definite: C is not finite, or all digits are lost
        if order is not None:
            unfolded = np.empty_like(p)
            unfolded[order] = p
            return unfolded
        return p

    @cached_property
    def _bands(self) -> tuple[NDArray | None, NDArray]:
        """Order of the discs (None as they stand) and S in it, (width + 1, 3, n): [j, :, i] couples discs i - j and i."""
        n = self.chain.n
        link = stencils.link_matrix(n, self._ends)
        bending = link.T @ self._bend_tension[: link.shape[0], : link.shape[0]] @ link
        torsion = link.T @ sp.diags_array(self._torsion_stiffness) @ link
        hessians = [sp.csr_array(bending), sp.csr_array(torsion)]
        order = None
        if self._ends == "ring":
            order = np.empty(n, dtype=int)
            order[0::2] = np.arange((n + 1) // 2)
            order[1::2] = np.arange(n - 1, (n - 1) // 2, -1)
            hessians = [a[order][:, order] for a in hessians]
        # nonzero() leaves out springs of no stiffness, and the bands they would fill
        width = max(int(abs(row - col).max(initial=0)) for row, col in (a.nonzero() for a in hessians))
        bands = np.zeros((width + 1, 3, n))
        for j, band in enumerate(bands):
            band[:2, j:] = hessians[0].diagonal(j)
            band[2, j:] = hessians[1].diagonal(j)
        return order, bands
