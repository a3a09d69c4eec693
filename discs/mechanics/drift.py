r"""Drift off the constraints, and its correction.

The equations of motion contain the constraint A v = b only in differentiated form, so the errors of the steps add up. After each
step v is projected, orthogonally in M, onto the velocities that the constraints allow. A row whose one-form A_a dq is closed,
d(A_a dq) = 0, is the gradient of a function c_a(q), as for a loop of bars or a pendulum's rod, and c_a must be c_a(0) + b_a t. The
drift of c_a is the line integral of A_a dq over the steps, which does not depend on the path: Gauss's formula is applied on the
straight line from q_n to q_{n+1}. Newton's method along M^{-1} A^T corrects q. If b_a is a function of t, c_a(0) + int b_a dt takes
the place of c_a(0) + b_a t, by the same formula; rows of a b_a that depends on q, or of phi(q, v), are not closed.
"""

import numpy as np

from discs.arrays import Bool, Float
from discs.mechanics import saddle
from discs.mechanics.equations import Equations
from discs.mechanics.inputs import Given
from discs.mechanics.saddle import dense
from discs.mechanics.sizes import Sizes, residual_size

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
EPS = float(np.finfo(float).eps)
CLOSED = 1e-6  # dA(u, w) relative to the two terms whose difference it is


class Drift:
    """Drift of a motion off its constraints.

    rows : (c,), which rows of A are closed.
    off : drift of the functions c_a behind the closed rows, (number of closed rows,).
    """

    def __init__(self, system: Equations, sizes: Sizes, start: float) -> None:
        self.system, self.sizes, self.m, self.start = system, sizes, sizes.m, start
        self.rows = self._closed()
        self.off = np.zeros(int(self.rows.sum()))

    def _closed(self) -> Bool:
        """Rows with dA_a(u, w) = (dA_a.u) w - (dA_a.w) u = 0 for random u, w, at the start and near it."""
        rng, system = np.random.default_rng(1), self.system
        closed = np.full(len(system.owners), system.phi is None)
        if not closed.any():
            return closed
        for near in (0.0, 1.0, 2.0):
            q = self.sizes.start + near * self.sizes.shift * rng.standard_normal(self.m)
            for u, w in self.sizes.unit * rng.standard_normal((2, 2, self.m)):
                try:
                    one, other = system.constraint_rate(q, u) @ w, system.constraint_rate(q, w) @ u
                except (ArithmeticError, ValueError):  # the formulas are not defined at q
                    return np.zeros(len(system.owners), dtype=bool)
                closed &= np.abs(one - other) <= CLOSED * (np.abs(one) + np.abs(other))
            if isinstance(system.drive, Given):
                try:
                    closed &= ~system.drive.slopes(self.start, q)[:, 1:].any(axis=1)
                except (ArithmeticError, ValueError):
                    return np.zeros(len(system.owners), dtype=bool)
        return closed

    def add(self, before: Float, after: Float, start: float, end: float) -> None:
        """Add the drift of a step between two times, from q `before` to q `after`."""
        if self.off.size:
            self.off = self.off + self._change(before, after) - self._driven(after, start, end)

    def _driven(self, q: Float, start: float, end: float) -> Float:
        """The integral of b over time, of the closed rows, which do not depend on q."""
        if not callable(drive := self.system.drive):
            return drive[self.rows] * (end - start)
        times = start + (0.5 + 0.5 * NODES) * (end - start)
        found: Float = (end - start) * 0.5 * (WEIGHTS @ np.array([drive(t, q) for t in times]))[self.rows]
        return found

    def positions(self, q: Float) -> Float:
        """q with its drift corrected; q itself if there is none."""
        for _ in range(4):
            if not self.off.size:
                break
            rows = dense(self.system.constraint(q))[self.rows]
            if (np.abs(self.off) <= 4 * EPS * np.abs(rows) @ (np.abs(q) + self.sizes.shift)).all():
                break
            owners = [o for o, row in zip(self.system.owners, self.rows, strict=True) if row]
            shift, _ = saddle.solve(dense(self.system.mass(q)), rows, np.zeros(self.m), -self.off, self.system.names, owners)
            self.off, q = self.off + self._change(q, q + shift), q + shift
        return q

    def corrected(self, y: Float, t: float) -> Float:
        """(q, v, ...) with q and v back on the constraints; y itself where they are, or where the rows of A are dependent."""
        try:
            q = self.positions(y[: self.m])
            v = y[self.m : 2 * self.m]
            if (np.abs(self.system.residual(q, v, t)) > 8 * EPS * residual_size(self.system, q, v, t)).any():
                v = self.system.consistent_velocity(q, v, t)
            elif q is y[: self.m]:
                return y
        except ValueError:
            return y
        return np.concatenate([q, v, y[2 * self.m :]])

    def _change(self, before: Float, after: Float) -> Float:
        """c_a(after) - c_a(before) by Gauss's formula."""
        way = after - before
        places = (before + (0.5 + 0.5 * node) * way for node in NODES)
        rows = (dense(self.system.constraint(q))[self.rows] @ way for q in places)
        found: Float = np.sum([0.5 * w * row for w, row in zip(WEIGHTS, rows, strict=True)], axis=0)
        return found
