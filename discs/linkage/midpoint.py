r"""The midpoint rule for linkages, in mixed form: energy-exact, with rigid links as the case of no compliance.

With w the mean velocity of a step, q_1 = q_0 + h C(phi_m) w and phi_m = phi_0 + h phi'/2, the unknowns are w and the forces n of
links:

    (2/h) m (w - w_0) + C(phi_m)^T (B^T n + mean grad V - f) = 0,   compliance n = (gap_0 + gap_1)/2,   rigid: gap_1 = 0,

with B the secant of the gaps over the step, gap_1 - gap_0 = B (q_1 - q_0). The first equation times h w is the balance of energy:
w.C^T B^T n h = n.(gap_1 - gap_0) is the change of |gap|^2/(2 compliance), or zero. Newton's matrix couples a node to its neighbours
and their links only (block-tridiagonal); it is taken by the complex step, a few columns at a time, and kept while it converges
quickly. Rigid links and wheels hold exactly at the ends of steps; w_1 = 2 w - w_0 obeys rigid links up to h^2.
"""

from typing import Any, NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Array, Float
from discs.linkage.equations import Equations, columns

SETTLED = 1e-15  # of moves, relative to the length, or rad
ROUNDED = 1e-11  # moves that do not shrink any more below this are rounding
SWEEPS = 30
FRESH, KEPT = 10.0, 0.2  # a sweep may leave so much of the last change, with a matrix of this step and with an older one


class Moment(NamedTuple):
    """A state: q (4, n), w (3, n), and the forces of links in the step that led there, (2, n_links)."""

    q: Float
    w: Float
    stress: Float


class Stepper:
    """Steps of a linkage; it keeps the factors of Newton's matrix, and counts.

    Attributes
    ----------
    solves, matrices : linear systems solved, and matrices factored.
    """

    def __init__(self, of: Equations) -> None:
        self.of, self.solves, self.matrices = of, 0, 0
        self._factors: Any = None  # of SuperLU
        self._for = 0.0
        self._pattern()

    def _pattern(self) -> None:
        """Columns that no row shares get one colour: nodes three apart, and on a closed chain the one or two left over."""
        of, n = self.of, self.of.n
        whole = n - n % 3 if of.closed else n
        colour = np.where(np.arange(n) < whole, np.arange(n) % 3, 3 + np.arange(n) - whole)
        column = np.arange(of.size)
        kind = 5 * colour[column // 5] + column % 5
        self._kinds = np.unique(kind)
        place = np.searchsorted(self._kinds, kind)
        self._seeds = (self._kinds[:, None] == kind).astype(float)
        near = []
        for step in (-1, 0, 1):
            node = column // 5 + step
            node = node % n if of.closed else node
            for slot in range(5):
                row = 5 * node + slot
                fits = (row >= 0) & (row < of.size)
                near.append((row[fits], column[fits], place[fits]))
        rows, cols, places = (np.concatenate(part) for part in zip(*near, strict=True))
        order = scipy.sparse.coo_array((np.arange(1.0, rows.size + 1), (rows, cols)), shape=(of.size, of.size)).tocsc()
        pick = order.data.astype(int) - 1
        self._rows, self._places, self._csc = rows[pick], places[pick], order

    def residual(self, y: Array, z: Moment, h: float, rest: Float) -> Array:
        """The equations of the step for y = (w, n), (..., size)."""
        of = self.of
        w, stress = of.unpack(y)
        phi = z.q[3] + 0.5 * h * w[..., 2, :]
        v = of.forward(phi, w)
        a, b = of.shape(z.q), of.shape(z.q + h * v)
        along, across = of.secant(a, b)
        moment = 0.5 * (of.moments(a, rest) + of.moments(b, rest))
        g = of.gradient(along, across, stress, moment, 0.5 * of.torsion * (a.twist + b.twist))
        force = (2 / h) * of.inertia * (w - z.w) + of.back(phi, of.dragged(v, g))
        one, two = of.gap(a), of.gap(b)
        link = np.where(of.compliance > 0, of.compliance * stress - 0.5 * (one + two), -0.5 * two)
        return of.pack(np.where(of.fixed, w, force), (2 / h) * link)

    def step(self, z: Moment, t: float, h: float) -> tuple[Moment, Float]:
        """The state a step h after z at the time t, and the work of muscles and the energy lost to drag in it, (2,).

        ArithmeticError if Newton's method does not converge.
        """
        of = self.of
        before, after = of.of.rest(t), of.of.rest(t + h)
        rest = 0.5 * (before + after)
        y, fresh = of.pack(z.w, z.stress), self._for != h
        while True:
            if fresh:
                self._factor(y, z, h, rest)
            found = self._newton(y, z, h, rest, FRESH if fresh else KEPT)
            if found is not None:
                break
            if fresh:
                raise ArithmeticError
            fresh = True
        w, stress = of.unpack(found)
        v = of.forward(z.q[3] + 0.5 * h * w[2], w)
        q = z.q + h * v
        bend = 0.5 * (of.shape(z.q).bend + of.shape(q).bend)
        work = -float((of.bending * of.k * (bend - of.k * rest) * (after - before)).sum())
        return Moment(q, 2 * w - z.w, stress), np.array([work, h * float((of.drag * v[2] ** 2).sum())])

    def _factor(self, y: Float, z: Moment, h: float, rest: Float) -> None:
        parts = columns(lambda at: self.residual(at, z, h, rest), y, self._seeds)
        self._csc.data = parts[self._places, self._rows]
        try:
            self._factors = scipy.sparse.linalg.splu(self._csc)
        except RuntimeError:  # singular
            raise ArithmeticError from None
        self._for, self.matrices = h, self.matrices + 1

    def _newton(self, y: Float, z: Moment, h: float, rest: Float, slowest: float) -> Float | None:
        """The solution near y, or None if it was not reached."""
        of, last = self.of, np.inf
        for _ in range(SWEEPS):
            change = self._factors.solve(self.residual(y, z, h, rest))
            self.solves += 1
            y = y - change
            w = np.abs(of.unpack(change)[0])
            moves = h * max(float(w[:2].max()) / of.of.length, float(w[2].max()))
            if moves <= SETTLED or (moves <= ROUNDED and moves >= 0.5 * last):
                return y
            if not moves < slowest * last:
                return None
            last = moves
        return None
