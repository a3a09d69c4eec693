r"""Rest curvature and viscosity of bending, for discs whose headings follow the line.

With the differences r' = (r_{i+1} - r_{i-1})/2k and r'' = (r_{i+1} - 2 r_i + r_{i-1})/k^2 at the bend of disc i, w its share of the
length, put kappa = J r' . r''.

**Rest curvature.** The energy w K |r''|^2/2 of a bend becomes w K |r'' - kappa_0 J r'|^2/2, by the addition of

    U = w K (kappa_0^2 |r'|^2/2 - kappa_0 kappa),

which is quadratic in r and does not change in rigid motions. Its derivatives are -w K kappa_0 J r' by r'' and
w K (kappa_0^2 r' + kappa_0 J r'') by r'.

**Viscosity** acts on the rate of kappa, with the power w eta kappa.^2: kappa does not change when a bent rod turns, while r'' does.
The moment w eta kappa. acts on J r'. . r'' + J r' . r''..

**Free ends** of the limit N -> infinity. With m = K (r'' - kappa_0 J r') the virtual work of V on r = e psi leaves at s = 0

    psi': m . e + eta kappa. R |r'|^2 = 0 (field law), so  K (kappa - kappa_0 |r'|^2) + eta |r'|^2 kappa. = 0,
    psi:  beta (theta' - tau_0) = e . m' + R |r'|^2 (eta kappa.)'   (field law; R |r'| for the unit law),

the second where kappa. = 0 or eta = 0 at the end: m is along r' then, and the terms m . e' and kappa_0 J m . e cancel. Without
viscosity the end has kappa = kappa_0 |r'|^2, so that d|r'|^2/dt = 2 omega r' . e' gives |r'| = exp(-R kappa_0 dtheta) by the field
law, and |r'| = 1 - R kappa_0 dtheta by the unit law, dtheta = theta - theta(0). With viscosity alone kappa = 0 stays at the end,
and so does |r'| = 1: viscosity adds to the point force there and not to the couple.

**Consistent ends.** With M = m + eta kappa. J r' and N = kappa_0 J m - eta kappa. J r'' the limit has N . e = -M . e' at an end;
without rest curvature both are 0. The slopes of second order from four discs are (-4, 7, -4, 1)/2k + g (-1, 3, -3, 1)/2k there,
g = 0 for the ghost disc. As k -> 0 they leave on these discs the forces N . e (-6 - g, 19 + 3 g, -20 - 3 g, 7 + g)/4, which are in
equilibrium, but change the curvature of the next discs by O(k), for g = 0 that of the end too: r and theta then converge at order
1. No stencil leaves none, as the second moment, k^2 N . e/2, does not depend on g. At small kappa_0 the rest of the rod feels no
couple if g = -72/11; otherwise g depends on the motion, measured -6.6 to -6.8 for both laws, bent rods and rods that are bent by a
signal. With g = -20/3 the error of order 1 is a hundredth of that with g = 0, and seen where few others are left, see
docs/loads.md. Where headings are taken, the slope stays that of the ghost disc.

**True curvature**: kappa is the turn of the line over k, with the rate (b./b - a./a).imag/k for the links a and b before and
after the disc, as complex numbers. Its rest value is part of the link law (`discs.chains.links.true`).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Complex, Float, Int, Matrix
from discs.chains.chain import Chain
from discs.chains.rolling_discs import Assembly, folded

END_SLOPE, END_BEND = np.array([8.0, -39.0, 48.0, -17.0]) / 6, np.array([2.0, -5.0, 4.0, -1.0])  # of consistent ends; see above


def bends_of(chain: Chain, curvature: Float | float = 0.0, viscosity: Float | float = 0.0) -> "Bends":
    """The bends of a chain with a rest curvature and a viscosity, numbers or (B,)."""
    w, linear = chain.bend_shares, chain.link_law.quadratic
    return Bends(chain, w * np.asarray(chain.bending_stiffness) * linear, w * viscosity, curvature + 0 * w)


@dataclass(frozen=True, eq=False)
class Bends:
    """Rest curvatures and viscosity at the bends of a chain, B of them. Vectors are complex numbers x + i y.

    Attributes
    ----------
    stiffness : (B,), w K, zero for the true curvature. viscosity : (B,), w eta. rest : (B,), the constant kappa_0.
    """

    chain: Chain
    stiffness: Float
    viscosity: Float
    rest: Float

    @cached_property
    def stencil(self) -> tuple[Int, Int, Float, Float]:
        """Discs of a bend (B, 4), how often each is beyond the seam of a ring, and their parts in r' and in r''."""
        n, k = self.chain.n, self.chain.k
        middle = np.arange(n) if self.rest.size == n else np.arange(1, n - 1)
        along = middle[:, None] + np.array([-1, 0, 1, 1])  # the fourth has no part
        slope, bend = np.zeros((2, *along.shape))
        slope[:], bend[:] = (-0.5, 0, 0.5, 0), (1, -2, 1, 0)
        if self.chain.ends == "consistent" and middle.size == n:
            along[0], slope[0], bend[0] = np.arange(4), END_SLOPE, END_BEND
            along[-1], slope[-1], bend[-1] = np.arange(n - 4, n), -END_SLOPE[::-1], END_BEND[::-1]
        return along % n, along // n, slope / k, bend / k**2

    def _line(self, q: Float) -> tuple[Complex, Complex]:
        """r' and r'' at the bends, (B,), from differences of positions."""
        discs, wrap, slope, bend = self.stencil
        r = q[0] + 1j * q[1]
        away = r[discs] - r[discs[:, 1:2]] + complex(*self.chain.shift) * wrap
        return (slope * away).sum(axis=1), (bend * away).sum(axis=1)

    def _turns(self, z: Complex, z1: Complex) -> Complex:
        """W (B, 4) with kappa. = sum Re(W r.) over the discs of a bend."""
        _, _, slope, bend = self.stencil
        of_slope, of_bend = -z1.conj(), z.conj()
        if not self.chain.link_law.quadratic:
            k = self.chain.k
            before, after = 1 / (z - 0.5 * k * z1), 1 / (z + 0.5 * k * z1)  # 1/links, times k
            of_slope, of_bend = (after - before) / k, 0.5 * (after + before)
        return -1j * (of_slope[:, None] * slope + of_bend[:, None] * bend)

    def potential(self, kappa: Float, q: Float) -> float:
        """U for rest curvatures (B,)."""
        z, z1 = self._line(q)
        return float(self.stiffness @ (0.5 * np.abs(kappa * z) ** 2 - kappa * (z.conj() * z1).imag))

    def force(self, kappa: Float, q: Float, other: Float | None = None) -> Float:
        """-grad U, (2, n). With `other`, one of the two factors kappa of kappa^2 in U is `other`."""
        _, _, slope, bend = self.stencil
        z, z1 = self._line(q)
        moment, other = self.stiffness * kappa, kappa if other is None else other
        return self._at_discs(bend * (1j * moment * z)[:, None] - slope * (moment * (other * z + 1j * z1))[:, None])

    def mutual(self, kappa: Float, q: Float, other: Float) -> float:
        """U with one of the two factors kappa of kappa^2 replaced by `other`."""
        z, z1 = self._line(q)
        return float(self.stiffness @ (kappa * (0.5 * other * np.abs(z) ** 2 - (z.conj() * z1).imag)))

    def drag(self, q: Float, v: Float) -> Float:
        """The force of viscosity, (2, n)."""
        turns, rate = self._rate(q, v)
        return self._at_discs(-(self.viscosity * rate)[:, None] * turns.conj())

    def derivatives(self, kappa: Float, q: Float, v: Float) -> tuple[Matrix, Matrix]:
        """The derivatives of `force` + `drag` by q and by v, sparse (3 n, 3 n): disc by disc of a bend, along x and along y."""
        discs, _, slope, bend = self.stencil
        z, z1 = self._line(q)
        turns, rate = self._rate(q, v)
        moves, n, k = (v[0] + 1j * v[1])[discs], self.chain.n, self.chain.k
        moment, places = (self.stiffness * kappa)[:, None], np.arange(discs.size).reshape(discs.shape)
        of_q, of_v = [], []
        for row, step in enumerate((1, 1j)):
            for slot in range(4):
                dz, dz1 = step * slope[:, slot], step * bend[:, slot]
                of_slope, of_bend = -dz1.conj(), dz.conj()
                if not self.chain.link_law.quadratic:
                    before, after = -(dz - 0.5 * k * dz1) / (z - 0.5 * k * z1) ** 2, -(dz + 0.5 * k * dz1) / (z + 0.5 * k * z1) ** 2
                    of_slope, of_bend = (after - before) / k, 0.5 * (after + before)
                turned = -1j * (of_slope[:, None] * slope + of_bend[:, None] * bend)
                more = (turned * moves).real.sum(axis=1)
                elastic = moment * (bend * (1j * dz)[:, None] - slope * (kappa * dz + 1j * dz1)[:, None])
                drag = -self.viscosity[:, None] * (more[:, None] * turns.conj() + rate[:, None] * turned.conj())
                own = -self.viscosity[:, None] * (turns[:, slot] * step).real[:, None] * turns.conj()
                column = row * n + discs[places // 4, slot]
                of_q.append((elastic + drag, column))
                of_v.append((own, column))
        return self._sparse(of_q), self._sparse(of_v)

    def _sparse(self, parts: list[tuple[Complex, Int]]) -> Matrix:
        """The matrix of forces on the discs of bends (B, 4), each with the columns that it belongs to, of the same shape."""
        n, discs = self.chain.n, self.stencil[0]
        values = np.concatenate([part.ravel() for forces, _ in parts for part in (forces.real, forces.imag)])
        rows = np.concatenate([(a * n + discs).ravel() for _ in parts for a in (0, 1)])
        columns = np.concatenate([column.ravel() for _, column in parts for _ in (0, 1)])
        return scipy.sparse.csr_array((values, (rows, columns)), shape=(3 * n, 3 * n))

    def dissipated(self, q: Float, v: Float) -> float:
        """The power of viscosity."""
        return float(self.viscosity @ self._rate(q, v)[1] ** 2)

    def _rate(self, q: Float, v: Float) -> tuple[Complex, Float]:
        """W, and kappa. (B,)."""
        turns = self._turns(*self._line(q))
        return turns, (turns * (v[0] + 1j * v[1])[self.stencil[0]]).real.sum(axis=1)

    def _at_discs(self, forces: Complex) -> Float:
        total = np.zeros(self.chain.n, forces.dtype)
        np.add.at(total, self.stencil[0], forces)
        return np.array([total.real, total.imag])

    @cached_property
    def _assembly(self) -> Assembly:
        place = np.argsort(folded(self.chain.n)) if self.chain.ends == "ring" else np.arange(self.chain.n)
        return Assembly(place[self.stencil[0]])

    def bands(self, kappa: Float, q: Float, c: Float, d: complex, g: complex) -> Any:
        """Upper bands of d C^T D C + g C^T (grad^2 U) C, discs in the order of the chain's systems."""
        discs, _, slope, bend = self.stencil
        moves = (c[0] + 1j * c[1])[discs]
        bent = bend * moves
        off = bent - 1j * kappa[:, None] * slope * moves
        strains = np.stack([off.real, off.imag, bent.real, bent.imag], axis=1)
        found = g * self._assembly((strains, np.outer(self.stiffness, [1, 1, -1, -1])))
        if self.viscosity.any():
            turns = (self._turns(*self._line(q)) * moves).real
            found = found + d * self._assembly((turns[:, None, :], self.viscosity[:, None]))
        return found

    def parameters(self, driven: Float) -> Any:
        """Those of the compiled form; driven (K, B), the rest curvatures of the drives."""
        from discs.kernels.bends import Bends

        shift = np.array(self.chain.shift)
        return Bends(*self.stencil, self.stiffness, self.viscosity, self.rest, driven, shift)
