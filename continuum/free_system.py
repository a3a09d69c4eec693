"""The free rod: the planar inextensible Cosserat rod without rolling, (freeFE) and (constrinext).

    rho r.. + K r'''' = (p r')',   alpha theta.. = beta theta'',   |r'| = 1.

The tension p is the multiplier of |r'| = 1. Free ends: p r' - K r''' = 0 and r'' = theta' = 0, hence also p = K r''' . r' = 0.

**In s.** Nodes have shares w. Links d = r_{i+1} - r_i = (L r)_i keep their initial length l, which is k up to the k^2 of a chord.
The Lagrangian (roddensity) becomes

    sum_nodes w (rho |v|^2 + alpha omega^2)/2 - r.S r/2 - theta.S_t theta/2 - sum_links k p/2 (|d|^2 - l^2)/k^2,

with S and S_t of plain springs, whose ends are the natural ones here. With M = rho w and the force L^T (p d/k) of the tension,

    M r.. = -S r - L^T (p d/k),   |d| = l,   and d.L r.. + |L v|^2 = 0 gives p, by one tridiagonal system:

    d . L M^{-1} L^T (p d/k) = |L v|^2 - d . L M^{-1} S r.                                                                 (tension)

**In t.** The variational integrator of L_h = h T(u/h) - h V((r_n + r_{n+1})/2), u = r_{n+1} - r_n, with the constraint at every
step: the midpoint rule for bending, RATTLE for the constraint,

    M u/h = M v_n - h/2 S (r_n + u/2) - L^T (mu d_n)/h,               |L (r_n + u)| = l,
    M v_{n+1} = M u/h - h/2 S (r_n + u/2) - L^T (nu d_{n+1}),         d_{n+1} . L v_{n+1} = 0.

The first line is solved for u and mu together by Newton's method, with banded matrices. The system for nu is tridiagonal. The step
is symplectic, reversible and of order 2, and bending does not limit it. Momentum and angular momentum are conserved to rounding,
because L_h has these symmetries. So are the lengths, which are solved for. The energy is exact for theta and for small waves. The
energy of the centre line oscillates by O(h^2), as long as h is short compared with the periods that carry energy
(docs/continuum.md has a table).
"""

from typing import NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs import Chain
from discs.arrays import Float, Int
from discs.chains import stencils
from discs.chains.links.linear import LinearCurvature
from discs.chains.rolling_discs import folded

MOST_SWEEPS = 30


class State(NamedTuple):
    """Positions and velocities (2, n), torsion and its rate (n,)."""

    r: Float
    v: Float
    theta: Float
    omega: Float


class Banded:
    """Solver for sparse systems with a fixed pattern, which is banded in a given order of the unknowns."""

    def __init__(self, places: list[tuple[Int, Int]], order: Int) -> None:
        place = np.argsort(order)
        row, column = (place[np.concatenate(index)] for index in zip(*places, strict=True))
        self._width, self._order, self._back = int(abs(row - column).max()), order, place
        self._slots = (self._width + row - column) * order.size + column

    def __call__(self, entries: Float, right: Float) -> Float:
        """The solution, (size,). Entries at one place add up."""
        shape = 2 * self._width + 1, right.size
        matrix = np.bincount(self._slots, entries, shape[0] * shape[1]).reshape(shape)
        both = self._width, self._width
        found = scipy.linalg.solve_banded(both, matrix, right[self._order], overwrite_ab=True, check_finite=False)
        solution: Float = found[self._back]
        return solution


class FreeRod:
    """The semidiscrete free rod and its step. Positions and velocities are (2, n), tensions (n_links,).

    Parameters
    ----------
    chain : plain springs or a ring; its law of rolling and its radius have no effect.
    r : (2, n), positions that define the lengths of the links.

    Attributes
    ----------
    length : (n_links,), lengths of the links.
    """

    def __init__(self, chain: Chain, r: Float) -> None:
        n, self._ends, self._k = chain.n, chain.ends, chain.k
        self.length = np.hypot(*self.links(r))
        here = np.arange(n - (chain.ends != "ring"))  # link i joins nodes i and i + 1
        self._mass, self._spin = (chain.w * np.asarray(values, np.float64) for values in (chain.density, chain.spin_inertia))
        self._first, self._second = here, (here + 1) % n
        self._springs = LinearCurvature(chain)
        bending, torsion = self._springs.hessians()
        order = folded(n) if chain.ends == "ring" else np.arange(n)
        # unknowns of Newton's method (x, y, mu), ordered so that those of a node and its link are neighbours
        bends, nodes = scipy.sparse.coo_array(bending), np.arange(2 * n)
        self._bends = np.tile(bends.data, 2)
        tips = [(2 * n + here, tip + a * n) for a in (0, 1) for tip in (self._first, self._second)]
        places = [(bends.row + a * n, bends.col + a * n) for a in (0, 1)] + [(nodes, nodes)]
        places += [(node, link) for link, node in tips] + tips
        stacked = (order[:, None] + n * np.arange(3)).ravel()
        self._newton = Banded(places, stacked[stacked < 2 * n + here.size])
        # L M^{-1} L^T couples neighbouring links
        self._pairs = a, b = (here, (here + 1) % n) if chain.ends == "ring" else (here[:-1], here[1:])
        self._triangle = Banded([(here, here), (a, b), (b, a)], order[order < here.size])
        twists, nodes = scipy.sparse.coo_array(torsion), np.arange(n)
        self._twists = twists.data
        self._roll = Banded([(twists.row, twists.col), (nodes, nodes)], order)

    def links(self, values: Float) -> Float:
        """L, differences of neighbours, (..., n_links)."""
        return stencils.links(values, self._ends)

    def pull(self, d: Float, multiplier: Float) -> Float:
        """L^T (multiplier d), (2, n)."""
        return stencils.pull(multiplier * d, self._ends)

    def gradient(self, x: Float, y: Float, theta: Float) -> Float:
        """S r and S_t theta, rows (3, n)."""
        return stencils.pull(self._springs.tension(self.links(np.array([x, y, theta]))), self._ends)

    def bent(self, r: Float) -> Float:
        """S r, (2, n)."""
        return self.gradient(r[0], r[1], np.zeros_like(r[0]))[:2]

    def _constrain(self, d: Float, right: Float) -> Float:
        """The multiplier of d . L M^{-1} L^T (multiplier d) = right."""
        a, b = self._pairs
        diagonal = (d * d).sum(axis=0) * (1 / self._mass[self._first] + 1 / self._mass[self._second])
        beside = -(d[:, a] * d[:, b]).sum(axis=0) / self._mass[self._second[a]]
        return self._triangle(np.concatenate([diagonal, beside, beside]), right)

    def admissible(self, r: Float, v: Float) -> Float:
        """The velocity nearest to v, in the norm of the mass, that changes the length of no link."""
        d = self.links(r)
        return v - self.pull(d, self._constrain(d, (d * self.links(v)).sum(axis=0))) / self._mass

    def tension(self, r: Float, v: Float) -> Float:
        """(tension): p in the links, (n_links,)."""
        d, rate = self.links(r), self.links(v)
        push = self.links(self.bent(r) / self._mass)
        return self._k * self._constrain(d, (rate * rate).sum(axis=0) - (d * push).sum(axis=0))

    def energy(self, z: State) -> float:
        """Kinetic and potential energy."""
        kinetic = (self._mass * z.v**2).sum() + self._spin @ z.omega**2
        return 0.5 * float(kinetic) + self._springs.potential(self.links(np.array([*z.r, z.theta])))

    def line_energy(self, z: State) -> float:
        """Energy of the centre line about its centre of mass; conserved, because momentum and the energy of theta are."""
        v = z.v - (self._mass * z.v).sum(axis=1, keepdims=True) / self._mass.sum()
        return self.energy(State(z.r, v, np.zeros_like(z.theta), np.zeros_like(z.omega)))

    def turns(self, before: Float, after: Float) -> Float:
        """Angles by which links turn between two positions r, (n_links,)."""
        a, b = self.links(before), self.links(after)
        turns: Float = np.arctan2(a[0] * b[1] - a[1] * b[0], (a * b).sum(axis=0))
        return turns

    def rate(self, z: State) -> float:
        """The fastest turning rate of a link, rad per time."""
        return float((np.hypot(*self.links(z.v)) / self.length).max())

    def advance(self, z: State, h: float) -> State:
        """The state after a step h. LinAlgError if Newton's method does not converge."""
        return State(*self.step(z.r, z.v, h), *self.twist(z.theta, z.omega, h))

    def step(self, r: Float, v: Float, h: float) -> tuple[Float, Float]:
        """Positions and velocities after a step h. LinAlgError if Newton's method does not converge."""
        n, d, bent = r.shape[1], self.links(r), self.bent(r)
        u, mu = h * v, np.zeros(self.length.size)
        for _ in range(MOST_SWEEPS):
            after = d + self.links(u)
            push = self._mass * (u - h * v) + 0.5 * h * h * (bent + 0.5 * self.bent(u)) + self.pull(d, mu)
            stretch = 0.5 * ((after * after).sum(axis=0) - self.length**2)
            tips = [sign * row for links in (d, after) for row in links for sign in (-1, 1)]
            entries = [0.25 * h * h * self._bends, np.tile(self._mass, 2), *tips]
            change = self._newton(np.concatenate(entries), -np.concatenate([push.ravel(), stretch]))
            u, mu = u + change[: 2 * n].reshape(2, n), mu + change[2 * n :]
            if np.abs(change[: 2 * n]).max() <= 1e-9 * self._k:  # quadratic convergence: the next change would be its square
                moved = r + u
                return moved, self.admissible(moved, u / h - 0.5 * h * (bent + 0.5 * self.bent(u)) / self._mass)
        raise np.linalg.LinAlgError("Newton's method does not converge")

    def twist(self, theta: Float, omega: Float, h: float) -> tuple[Float, Float]:
        """theta and omega after a step h of the midpoint rule; they do not depend on the centre line."""
        still, entries = np.zeros_like(theta), np.concatenate([0.25 * h * h * self._twists, self._spin])
        mean = self._roll(entries, self._spin * omega - 0.5 * h * self.gradient(still, still, theta)[2])
        return theta + h * mean, 2 * mean - omega
