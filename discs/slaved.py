r"""Discs whose headings are slaved to the centre line: the paper's rod.

Lagrange-d'Alembert for disc i (a dot is d/dt, w its share of length, F = -dV/dr_i, F_theta = -dV/dtheta_i):

    rho w r.. = F + lambda,   alpha w theta.. = F_theta - e.lambda,   r. = e theta.

Eliminating lambda, with r.. = e omega. + e. omega:

    w (alpha + rho |e|^2) omega. + w rho omega e.e. = e.F + F_theta.

Put m = w (alpha + rho |e|^2) and pi = sqrt(m) omega. Then pi. = (m omega. + m. omega/2)/sqrt(m) and m./2 = w rho e.e., so

    (r_i, theta_i). = c_i pi_i,  pi_i. = -c_i . dV/d(r_i, theta_i),  c_i = (e_i, 1)/sqrt(m_i).

Strains are the twist of links, (theta_{i+1} - theta_i)/k, and either

* linear curvature: the vectors r''_i, so that V and H are quadratic, or
* true curvature: the turning of the line at disc i per length, (arg d_i - arg d_{i-1})/k with links d_i = r_{i+1} - r_i, and the
  stretch |d_i|/k - 1. Their secants are exact: with D = d_1 - d_0 and M = (d_0 + d_1)/2,
      arg d_1 - arg d_0 = delta = (delta/sin delta) J M . D/(|d_0||d_1|),   |d_1| - |d_0| = 2 M . D/(|d_0| + |d_1|),
  since the cross product of d_0 and d_1 is that of M and D.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from discs import stencils
from discs.chain import Chain
from discs.system import Assembly, Phase, SkewGradient, folded


class Line(NamedTuple):
    """Secants of the true curvature over a step: links before and after, (3, n_links), and gradients of angle and length.

    turn, stretch : (2, n_links), the vectors whose product with the change of a link is the change of its angle, length.
    """

    before: NDArray
    after: NDArray
    turn: NDArray
    stretch: NDArray


class SlavedSystem(SkewGradient):
    """The equations of motion of a `Chain`; a shape is its links, (3, n_links)."""

    rows = ("x", "y", "theta")

    def __init__(self, chain: Chain) -> None:
        n, k, ends = chain.n, chain.k, chain.ends
        self.n, self._k, self._ends = n, k, ends
        self.scale = np.array([chain.length, chain.length, 1.0])
        self.quadratic = chain.curvature == "linear"
        self._shift = np.array([*chain.shift, 0.0])
        self._unit = chain.rolling == "unit"
        self._radius = np.asarray(chain.radius)
        mass = chain.w * np.asarray(chain.density)
        self.weights = np.array([mass, mass, chain.w * np.asarray(chain.spin_inertia)])
        slope = stencils.slope_matrix(n, k, ends)
        bend = stencils.bend_matrix(n, k, ends)
        self._slope = sp.csr_array(sp.block_diag([slope, slope]))
        self._bend = sp.csr_array(sp.block_diag([bend, bend]))
        self._bending = np.asarray(chain.bending_stiffness) * chain.bend_shares
        self._stretching = np.asarray(chain.stretch_stiffness) * k
        self._torsion = np.asarray(chain.torsion_stiffness) / k

    # Kinematics

    def shape(self, hi: NDArray, lo: NDArray | None = None) -> NDArray:
        d = stencils.links(hi, self._ends)
        if lo is not None:
            d += stencils.links(lo, self._ends)
        if self._ends == "ring":
            d[:, -1] += self._shift
        return d

    def moved(self, shape: NDArray, dq: NDArray) -> NDArray:
        return shape + stencils.links(dq, self._ends)

    def slope(self, shape: NDArray) -> NDArray:
        return (self._slope @ shape[:2].ravel()).reshape(2, -1)

    def contact(self, shape: NDArray) -> NDArray:
        slope = self.slope(shape)
        e = slope[::-1] * (self._radius / np.hypot(*slope) if self._unit else self._radius)
        np.negative(e[0], out=e[0])
        return e

    def contact_rate(self, shape: NDArray, v: NDArray) -> NDArray:
        turning = self.slope(stencils.links(v, self._ends))
        if self._unit:  # of r'/|r'|: the part of the rate across r', over |r'|
            slope = self.slope(shape)
            square = (slope * slope).sum(axis=0)
            turning = (turning - slope * ((slope * turning).sum(axis=0) / square)) / np.sqrt(square)
        return self._radius * np.array([-turning[1], turning[0]])

    def inertia(self, e: NDArray) -> NDArray:
        """Inertia m = w (alpha + rho |e|**2) of each disc against rolling, (n,)."""
        return self.weights[2] + self.weights[0] * (e[0] ** 2 + e[1] ** 2)

    def frame(self, shape: NDArray) -> NDArray:
        c = np.empty((3, self.n))
        c[:2] = self.contact(shape)
        c[2] = 1 / np.sqrt(self.inertia(c[:2]))
        c[:2] *= c[2]
        return c

    def forward(self, c: NDArray, p: NDArray) -> NDArray:
        return c * p

    def back(self, c: NDArray, g: NDArray) -> NDArray:
        return (c * g).sum(axis=0)

    def momentum(self, shape: NDArray, rates: NDArray) -> NDArray:
        return np.sqrt(self.inertia(self.contact(shape))) * rates[0]

    def lost_heading(self, before: Phase, after: Phase) -> int | None:
        """Under the unit law: a disc whose r', on the straight way between two configurations, comes below 1e-3."""
        if not self._unit:
            return None
        a, b = (self.slope(self.shape(z.hi, z.lo)) for z in (before, after))
        move = b - a
        square = np.maximum((move * move).sum(axis=0), 1e-300)
        nearest = np.hypot(*(a + move * np.clip(-(a * move).sum(axis=0) / square, 0.0, 1.0)))
        disc = int(np.argmin(nearest))
        return disc if nearest[disc] < 1e-3 else None

    # Springs

    def potential(self, shape: NDArray) -> float:
        if self.quadratic:
            return self.polarised(shape, shape)
        angle = self._turning(shape)
        stretch = np.hypot(shape[0], shape[1]) / self._k - 1
        twist = self._torsion * shape[2] @ shape[2]
        return 0.5 * float(self._bending @ angle**2 + (self._stretching * stretch) @ stretch + twist)

    def polarised(self, shape: NDArray, other: NDArray) -> float:
        if not self.quadratic:
            raise ValueError("V is not quadratic with curvature='true'")
        bends = self._bend @ shape[:2].ravel(), self._bend @ other[:2].ravel()
        twist = self._torsion * shape[2] @ other[2]
        return 0.5 * float((np.tile(self._bending, 2) * bends[0]) @ bends[1] + twist)

    def secant(self, shape: NDArray, dq: NDArray) -> NDArray | Line:
        if self.quadratic and dq is self._no_step:
            return shape
        change = stencils.links(dq, self._ends)
        if self.quadratic:
            return shape + 0.5 * change
        after = shape + change
        middle = (shape + 0.5 * change)[:2]
        a, b = np.hypot(shape[0], shape[1]), np.hypot(after[0], after[1])
        across = np.array([-middle[1], middle[0]])
        sine = (across * change[:2]).sum(axis=0) / (a * b)
        delta = np.arctan2(sine, (shape[:2] * after[:2]).sum(axis=0) / (a * b))
        # delta/sin(delta), safe at zero; a link that turns by half a turn in one step has no mean direction
        turn = across * (1 / np.sinc(delta / np.pi)) / (a * b)
        return Line(shape, after, turn, 2 * middle / (a + b))

    def mean_force(self, secant: NDArray | Line) -> NDArray:
        tension = np.empty((3, self._torsion.size))
        if isinstance(secant, Line):
            before, after = secant.before, secant.after
            moment = self._bending * 0.5 * (self._turning(before) + self._turning(after))
            couple = self._difference.T @ moment
            lengths = np.hypot(before[0], before[1]) + np.hypot(after[0], after[1])
            pull = self._stretching * (0.5 * lengths / self._k - 1) / self._k
            tension[:2] = secant.turn * couple + secant.stretch * pull
            tension[2] = self._torsion * 0.5 * (before[2] + after[2])
        else:
            tension[:2] = (self._bend_tension @ secant[:2].ravel()).reshape(2, -1)
            tension[2] = self._torsion * secant[2]
        return stencils.pull(tension, self._ends)

    def _turning(self, shape: NDArray) -> NDArray:
        """Turning per length at the inner discs (all discs of a ring), (n_bends,): each less than half a turn."""
        after = shape[:2] if self._ends == "ring" else shape[:2, 1:]
        before = np.roll(shape[:2], 1, axis=1) if self._ends == "ring" else shape[:2, :-1]
        return np.arctan2(before[0] * after[1] - before[1] * after[0], (before * after).sum(axis=0)) / self._k

    @cached_property
    def _difference(self) -> sp.csr_array:
        """Angles of links -> turning per length, (n_bends, n_links)."""
        return stencils.bend_matrix(self.n, self._k, "ring" if self._ends == "ring" else "springs") * self._k

    @cached_property
    def _bend_tension(self) -> sp.csr_array:
        bend = self._bend
        return sp.csr_array(bend.T @ sp.diags_array(np.tile(self._bending, 2)) @ bend)

    # The linear system of an implicit step

    @cached_property
    def order(self) -> NDArray | None:
        return folded(self.n) if self._ends == "ring" else None

    def stiffness(self, secant: NDArray | Line, c: NDArray) -> NDArray:
        """Bands of C^T S C; for the true curvature S is rebuilt from the step's secants."""
        if isinstance(secant, Line):
            return self._curvature_stiffness(secant, c)
        bands = self._bands
        if self.order is not None:
            c = c[:, self.order]
        width, n = bands.shape[0] - 1, self.n
        matrix = np.zeros((width + 1, n), order="F")
        for j, band in enumerate(bands):
            matrix[width - j, j:] = (band[:, j:] * c[:, j:] * c[:, : n - j]).sum(axis=0)
        return matrix

    @cached_property
    def _bands(self) -> NDArray:
        """The Hessian S of a quadratic V, (width + 1, 3, n) in `order`: [j, :, i] couples discs i - j and i."""
        n = self.n
        link = stencils.link_matrix(n, self._ends)
        bending = link.T @ self._bend_tension[: link.shape[0], : link.shape[0]] @ link
        torsion = link.T @ sp.diags_array(self._torsion) @ link
        hessians = [sp.csr_array(bending), sp.csr_array(torsion)]
        if self.order is not None:
            hessians = [a[self.order][:, self.order] for a in hessians]
        # nonzero() leaves out springs of no stiffness, and the bands they would fill
        width = max(int(abs(row - col).max(initial=0)) for row, col in (a.nonzero() for a in hessians))
        bands = np.zeros((width + 1, 3, n))
        for j, band in enumerate(bands):
            band[:2, j:] = hessians[0].diagonal(j)
            band[2, j:] = hessians[1].diagonal(j)
        return bands

    def _curvature_stiffness(self, secant: Line, c: NDArray) -> NDArray:
        """Bends join a disc with its two neighbours, links join two discs."""
        n, k, ring = self.n, self._k, self._ends == "ring"
        first = np.arange(n) if ring else np.arange(n - 1)  # a link's first and second disc
        second = (first + 1) % n
        turn_first = (secant.turn * c[:2, first]).sum(axis=0) / k
        turn_second = (secant.turn * c[:2, second]).sum(axis=0) / k
        if ring:  # link i - 1 and link i at disc i
            before_first, before_second = np.roll(turn_first, 1), np.roll(turn_second, 1)
            after_first, after_second = turn_first, turn_second
        else:
            before_first, before_second = turn_first[:-1], turn_second[:-1]
            after_first, after_second = turn_first[1:], turn_second[1:]
        bends = np.stack([before_first, -before_second - after_first, after_second], axis=1)[:, None, :]
        links = np.empty((first.size, 2, 2))
        for side, disc, sign in ((0, first, -1 / k), (1, second, 1 / k)):
            links[:, 0, side] = sign * (secant.stretch * c[:2, disc]).sum(axis=0)
            links[:, 1, side] = sign * c[2, disc]
        torsion = self._torsion * k**2
        stiffness = np.stack([np.broadcast_to(self._stretching, torsion.shape), torsion], axis=1)
        return self._assembly((bends, self._bending[:, None]), (links, stiffness))

    @cached_property
    def _assembly(self) -> Assembly:
        n = self.n
        place = np.arange(n) if self.order is None else np.argsort(self.order)
        middle = np.arange(n) if self._ends == "ring" else np.arange(1, n - 1)
        link = np.arange(n) if self._ends == "ring" else np.arange(n - 1)
        bends = np.stack([place[middle - 1], place[middle], place[(middle + 1) % n]], axis=1)
        return Assembly(bends, np.stack([place[link], place[(link + 1) % n]], axis=1))
