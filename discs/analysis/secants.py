r"""The linearised equations of a midpoint step that takes a secant, where V is not quadratic: own headings, true curvature.

The step solves q_1 - q_0 = h v, pi_1 - pi_0 = -h C^T (F - f) with v = C P, where C and f are taken at the middle Q = (q_0 + q_1)/2,
P = (pi_0 + pi_1)/2. The mean force F depends on q_0 and q_1, which are Q -+ h v/2. So the step is the midpoint rule of the system
q' = C pi, pi' = -C^T (F(q - h v/2, q + h v/2) - f), whose matrix A gives the tangent (`discs.analysis.sparse_tangent`). It is that
of `discs.analysis.linear` with

    g = F - f,   S = F_0 + F_1,   f_v - h (F_1 - F_0)/2 in place of f_v,   F_e = dF/dq_e.

F = Bm^T n with the secants Bm of the strains, s_1 - s_0 = Bm (q_1 - q_0), and the stresses n = (stiffness) (s_0 + s_1)/2. Hence

    F_e = Bm^T (stiffness) B(q_e)/2 + (d Bm/dq_e)^T n.

The last term is a small matrix for each link, below: the derivative of its tension at constant n. S is not symmetric.

Own headings. With z = T(-mu) M/k, M and mu the mean difference and heading, e = delta/2 half the change of the heading, and
sigma = sin(e)/e, the secant of Gamma is cos(e) T(-mu)/k by the difference and -sigma J z by the heading. With the stress N, the
tension cos(e) T(mu) N/k and the couple -sigma N . J z change by

    d tension = T(mu) (cos(e) J N dmu - sin(e) N de)/k,
    d couple  = sigma (T(mu) J N/k) . dM - sigma N . z dmu - sigma'(e) N . J z de.

They depend on Q only by M and mu, and on the step only by e: their derivatives by Q and by the step are found separately.

True curvature. A link that changes from d_0 to d_1, of lengths l_0 and l_1, turns by delta. With M = (d_0 + d_1)/2 its secants are
w J M with w = delta/(sin(delta) l_0 l_1) and 2 M/(l_0 + l_1). With the stress p for its turn and r for its length, the tension
w p J M + 2 r M/(l_0 + l_1) changes with d_e by

    w p J/2 + r/(l_0 + l_1) + p (J M) dw/dd_e - 2 r/(l_0 + l_1)^2 M d_e^T/l_e,
    dw/dd_e = w (+- psi J d_e - d_e)/l_e^2,   psi = 1/delta - cot(delta), + for e = 1,

because the angle of d_e changes by J d_e/l_e^2 and d log(delta/sin(delta)) = psi ddelta.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.analysis.linear import Linearised
from discs.arrays import Float, Matrix
from discs.chains import stencils
from discs.chains.rolling_discs import Strains
from discs.chains.steered import Links, SteeredSystem

SMALL = 0.1  # rad; below, series to rounding


@dataclass(frozen=True, eq=False)
class Secant(Linearised):
    """Those of a midpoint step of size h at its middle, z, where `gradient` is the mean force.

    `strains` has the mean strains, their secants, and in `bent` the rest of S.
    """

    h: float = 0.0

    @cached_property
    def gradient(self) -> Float:
        return self.system.mean_force(self._secant)

    @cached_property
    def strains(self) -> Strains:
        return self._derivatives[0]

    @cached_property
    def forces(self) -> tuple[Matrix, Matrix]:
        of_q, of_v = super().forces
        return of_q, of_v - self.h * self._derivatives[1]

    @cached_property
    def _before(self) -> Any:
        return self.system.moved(self.shape, -0.5 * self.h * self.velocity)

    @cached_property
    def _secant(self) -> Any:
        return self.system.secant(self._before, self.h * self.velocity)

    @cached_property
    def _derivatives(self) -> tuple[Strains, Matrix]:
        """`strains`, and (F_1 - F_0)/2, sparse (rows n, rows n)."""
        middle: Any = self.shape
        after: Any = self.system.moved(middle, 0.5 * self.h * self.velocity)
        start, end = self.system.strains(self._before), self.system.strains(after)
        stiffness, strain = start.stiffness, 0.5 * (start.strain + end.strain)
        stress = stiffness * strain
        if isinstance(self.system, SteeredSystem):
            secants = self.system.strain_matrix(self._secant)
            by_q, by_step = _own_headings(self.system, self.problem.chain.k, middle, after, stress)
        else:
            law: Any = self.problem.chain.link_law(self.problem.chain)  # type: ignore[union-attr, arg-type]
            secants = law.strain_matrix(self._secant.turn, self._secant.stretch)
            by_q, by_step = _true_curvature(self.problem.chain, self._before, after, self._secant, secants, stress)
        pull = secants.T @ scipy.sparse.diags_array(stiffness)
        bent = by_q + pull @ (0.5 * (start.matrix + end.matrix) - secants)
        return Strains(secants, stiffness, bent, strain), by_step + 0.25 * pull @ (end.matrix - start.matrix)


def _own_headings(system: SteeredSystem, k: float, middle: Links, after: Links, stress: Float) -> tuple[Matrix, Matrix]:
    """(d Bm)^T n by q, and by the step, for the stresses n."""
    apart, mean = system.joining
    e, (n1, n2) = after.middle - middle.middle, stress.reshape(4, -1)[:2]
    cos, sigma = np.cos(e), np.sinc(e / np.pi)
    small = np.abs(e) < SMALL
    by_series = -e / 3 * (1 - e**2 / 10 * (1 - e**2 / 28 * (1 - e**2 / 54)))
    slope = np.where(small, by_series, (cos - sigma) / np.where(small, 1.0, e))
    c, s = np.cos(middle.middle) / k, np.sin(middle.middle) / k
    by_e = np.array([c * n1 - s * n2, s * n1 + c * n2])  # T(mu) N/k
    by_mu = _quarter(by_e)  # T(mu) J N/k
    along, across = (by_e * middle.d[:2]).sum(axis=0), -(by_mu * middle.d[:2]).sum(axis=0)  # N . z, N . J z
    none = np.zeros_like(e)
    by_q = [[none, none, cos * by_mu[0]], [none, none, cos * by_mu[1]], [sigma * by_mu[0], sigma * by_mu[1], -sigma * along]]
    by_step = [[none, none, -np.sin(e) * by_e[0]], [none, none, -np.sin(e) * by_e[1]], [none, none, -slope * across]]
    joining = {0: apart, 1: apart, 3: mean}
    # e is half the change of the heading, so the derivative by a change has half of the second
    return _spread(joining, by_q, 4), 0.5 * _spread(joining, by_step, 4)


def _true_curvature(chain: Any, before: Float, after: Float, line: Any, secants: Matrix, stress: Float) -> tuple[Matrix, Matrix]:
    """The same for a line with the true curvature."""
    link = stencils.matrix(lambda r: stencils.links(r, chain.ends), chain.n, chain.ends)
    first, last = before[:2], after[:2]
    sizes, middle = (np.hypot(*first), np.hypot(*last)), 0.5 * (first + last)
    delta = np.arctan2(first[0] * last[1] - first[1] * last[0], (first * last).sum(axis=0))
    small, total = np.abs(delta) < SMALL, sizes[0] + sizes[1]
    safe, square = np.where(small, 1.0, delta), delta**2
    psi = np.where(small, delta / 3 * (1 + square / 15 * (1 + square * (2 / 21 + square / 105))), 1 / safe - 1 / np.tan(safe))
    w = 1 / (np.sinc(delta / np.pi) * sizes[0] * sizes[1])
    bends = stress.size - 2 * delta.size
    at_discs = stress[:bends] if chain.ends == "ring" else np.pad(stress[:bends], 1)
    p = (at_discs[: delta.size] - np.roll(at_discs, -1)[: delta.size]) / chain.k
    r = stress[bends : bends + delta.size] / chain.k
    ends = []
    for sign, d, size in zip((-1, 1), (first, last), sizes, strict=True):
        of_w = w * (sign * psi * _quarter(d) - d) / size**2
        block = p * _quarter(middle)[:, None] * of_w - 2 * r / total**2 * middle[:, None] * (d / size)
        block += 0.5 * w * p * np.array([[0.0, -1.0], [1.0, 0.0]])[:, :, None] + r / total * np.eye(2)[:, :, None]
        ends.append(_spread({0: link, 1: link}, block, 3))
    return ends[0] + ends[1], 0.5 * (ends[1] - ends[0])


def _quarter(d: Float) -> Float:
    """J d: vectors (2, n_links) turned by a quarter turn."""
    return np.array([-d[1], d[0]])


def _spread(joining: dict[int, Matrix], blocks: Any, rows: int) -> Matrix:
    """The sum over links of L^T (block) L, sparse (rows n, rows n); joining : the rows L of each coordinate that has any."""
    none = scipy.sparse.csr_array((next(iter(joining.values())).shape[1],) * 2)
    found = [[none] * rows for _ in range(rows)]
    for (a, left), line in zip(joining.items(), blocks, strict=True):
        for (b, right), part in zip(joining.items(), line, strict=True):
            found[a][b] = left.T @ scipy.sparse.diags_array(part) @ right
    return scipy.sparse.block_array(found, format="csr")
