r"""The equations of a linkage, derived in docs/snakes.md.

Coordinates q are x, y, theta, phi, (4, n). Velocities w are (3, n): (u, 0, phi') at a wheel, with u the speed along J d_1, and
(x', y', phi') at a free node, so that q' = C(phi) w. As C at a node depends on its own phi only and u J d_1 turns at right angles
to itself, C^T M C is constant and there are no gyroscopic forces:

    m w' = -C^T (B^T n + grad V - f),   compliance n = gap(q),

with n the forces of links (2, n_links), stretch and shear, V the bending, torsion and dead loads, f the drag. The gap of a link is

    gap = T(-m) (r_j - r_i) - (k, 0),   m = (1 - a) b_i + a b_j,   b = phi - psi,   B = d gap/dq,

and its compliance k/A, k/G: zero is rigid, in the same equations. All functions take complex numbers, and further axes in front.
"""

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from discs.arrays import Array, Bool, Float
from discs.linkage.linkage import Linkage


class Shape(NamedTuple):
    """Of links: d (..., 2, n_links), differences of places; middle, bend, twist (..., n_links), direction, changes of b, theta."""

    d: Array
    middle: Array
    bend: Array
    twist: Array


class Equations:
    """The equations of motion of a linkage.

    Attributes
    ----------
    inertia : (3, n), of the velocities w. fixed : (3, n), which of them are zero: across wheels, and what is held.
    compliance : (2, n_links), k/A and k/G. links : n_links.
    """

    def __init__(self, of: Linkage) -> None:
        self.of, self.n, self.wheel, self.closed = of, of.n, of.wheels, of.closed
        self.first, self.second = of.ends
        self.links = self.first.size
        self.k, self.share, self.psi = (np.asarray(a) for a in (of.link_length, of.second_share, of.mounting_angle))
        self.radius, self.drag = np.asarray(of.radius), np.where(self.wheel, np.asarray(of.rolling_drag), 0.0)
        mass, turn = np.asarray(of.mass), np.asarray(of.heading_inertia)
        spin = np.where(self.wheel, np.asarray(of.spin_inertia) / self.radius**2, 0.0)
        self.inertia = np.array([mass + spin, mass, turn])
        self.fixed: Bool = np.zeros((3, self.n), dtype=bool)
        self.fixed[1] = self.wheel
        for node, what in of.held:
            self.fixed[{"x": 0, "roll": 0, "y": 1, "phi": 2}[what], node] = True
        self.compliance = np.array([of.stretch_compliance, of.shear_compliance]) * self.k
        self.bending, self.torsion = np.asarray(of.bending_stiffness) / self.k, np.asarray(of.torsion_stiffness) / self.k
        self.load = np.array([of.force_x, of.force_y])

    # Kinematics

    def forward(self, phi: Array, w: Array) -> Array:
        """q' = C w, (..., 4, n)."""
        u, across, turn = w[..., 0, :], w[..., 1, :], w[..., 2, :]
        x = np.where(self.wheel, -np.sin(phi) * u, u)
        y = np.where(self.wheel, np.cos(phi) * u, across)
        return np.stack([x, y, np.where(self.wheel, u / self.radius, 0.0), turn], axis=-2)

    def back(self, phi: Array, g: Array) -> Array:
        """C^T g, (..., 3, n)."""
        x, y, theta, turn = (g[..., row, :] for row in range(4))
        along = np.where(self.wheel, np.cos(phi) * y - np.sin(phi) * x + theta / self.radius, x)
        return np.stack([along, np.where(self.wheel, 0.0, y), turn], axis=-2)

    def shape(self, q: Array) -> Shape:
        """The shape of the links at coordinates (..., 4, n)."""
        one, two = q[..., self.first], q[..., self.second]
        d = two - one
        begin, end = one[..., 3, :] - self.psi[self.first], two[..., 3, :] - self.psi[self.second]
        if self.closed:
            d[..., :2, -1] += self.of.shift
            end[..., -1] += 2 * np.pi * self.of.turns
        return Shape(d[..., :2, :], (1 - self.share) * begin + self.share * end, end - begin, d[..., 2, :])

    def gap(self, shape: Shape) -> Array:
        """The gaps of links, (..., 2, n_links)."""
        gap = turned(shape.middle, shape.d)
        gap[..., 0, :] -= self.k
        return gap

    def secant(self, a: Shape, b: Shape) -> tuple[Array, Array]:
        """The secant of the gaps: gap_b - gap_a = along (d_b - d_a) + across (m_b - m_a) exactly, see `discs.chains.steered`.

        along : (..., 2, 2, n_links). across : (..., 2, n_links).
        """
        half = 0.5 * (b.middle - a.middle)
        mu = a.middle + half
        cos, sin, scale = np.cos(mu), np.sin(mu), np.cos(half)
        along = np.stack([np.stack([cos, sin], axis=-2), np.stack([-sin, cos], axis=-2)], axis=-3) * scale[..., None, None, :]
        mean = turned(mu, 0.5 * (a.d + b.d)) * np.sinc(half / np.pi)[..., None, :]
        return along, np.stack([mean[..., 1, :], -mean[..., 0, :]], axis=-2)

    # Forces

    def gradient(self, along: Array, across: Array, stress: Array, moment: Array, torque: Array) -> Array:
        """B^T n + grad V, (..., 4, n), for forces (..., 2, n_links), moments and torques (..., n_links) of links."""
        pull = (along * stress[..., :, None, :]).sum(axis=-3)
        couple = (across * stress).sum(axis=-2)
        near = np.stack([-pull[..., 0, :], -pull[..., 1, :], -torque, (1 - self.share) * couple - moment], axis=-2)
        far = np.stack([pull[..., 0, :], pull[..., 1, :], torque, self.share * couple + moment], axis=-2)
        found = self.spread(near, far)
        found[..., :2, :] -= self.load
        return found

    def spread(self, near: Array, far: Array) -> Array:
        """From the first and the second nodes of links, (..., n_links), to nodes, (..., n)."""
        found = np.zeros((*near.shape[:-1], self.n), dtype=near.dtype)
        found[..., : self.links] = near
        if self.closed:
            found += np.roll(far, 1, axis=-1)
        else:
            found[..., 1:] += far
        return found

    def moments(self, shape: Shape, rest: Float) -> Array:
        """Moments of links, (..., n_links), for rest curvatures (n_links,)."""
        found: Array = self.bending * (shape.bend - self.k * rest)
        return found

    def dragged(self, v: Array, g: Array) -> Array:
        """g less the drag of wheels at velocities q' = v, both (..., 4, n)."""
        g[..., 2, :] += self.drag * v[..., 2, :]
        return g

    def energy(self, q: Float, w: Float, t: float) -> float:
        """Kinetic and potential energy, that of the dead loads included."""
        shape = self.shape(q)
        gap, soft = self.gap(shape), self.compliance > 0
        stretch = np.sum(gap[soft] ** 2 / self.compliance[soft])
        bent = (self.bending * (shape.bend - self.k * self.of.rest(t)) ** 2).sum()
        twisted = (self.torsion * shape.twist**2).sum()
        kinetic = (self.inertia * w**2).sum()
        return float(0.5 * (stretch + bent + twisted + kinetic) - (self.load * q[:2]).sum())

    # The equations, for accelerations

    def balance(self, q: Array, w: Array, change: Array, stress: Array, rest: Float) -> tuple[Array, Array]:
        """Residuals of m w' + C^T (...) = 0 at nodes, (..., 3, n), and of links, (..., 2, n_links): compliance n - gap, or gap''.

        change : w', (..., 3, n). stress : n, (..., 2, n_links). rest : rest curvatures, (n_links,).
        """
        phi, shape = q[..., 3, :], self.shape(q)
        v = self.forward(phi, w)
        along, across = self.secant(shape, shape)
        g = self.gradient(along, across, stress, self.moments(shape, rest), self.torsion * shape.twist)
        force = self.inertia * change + self.back(phi, self.dragged(v, g))
        soft = self.compliance * stress - self.gap(shape)
        return np.where(self.fixed, change, force), np.where(self.compliance > 0, soft, self.gap_twice(shape, phi, w, v, change))

    def gap_twice(self, shape: Shape, phi: Array, w: Array, v: Array, change: Array) -> Array:
        """gap'' = T(-m) (d'' - 2 m' J d' - m'' J d - m'^2 d), with r'' = C w' + C' w and C' w = -u phi' d_1 at wheels."""
        inward = np.where(self.wheel, w[..., 0, :] * w[..., 2, :], 0.0)
        a = self.forward(phi, change)
        a[..., 0, :] -= inward * np.cos(phi)
        a[..., 1, :] -= inward * np.sin(phi)
        rate, twice = self._differences(v), self._differences(a)
        d, m, mm = shape.d, rate[1][..., None, :], twice[1][..., None, :]
        return turned(shape.middle, twice[0] - 2 * m * quarter(rate[0]) - mm * quarter(d) - m**2 * d)

    def gap_rate(self, q: Float, v: Float) -> Float:
        """gap' at velocities q' = v (4, n), (2, n_links)."""
        shape, (d, m) = self.shape(q), self._differences(v)
        return turned(shape.middle, d - m * quarter(shape.d))

    def _differences(self, v: Array) -> tuple[Array, Array]:
        """Rates of d (..., 2, n_links) and of m (..., n_links)."""
        one, two = v[..., self.first], v[..., self.second]
        return (two - one)[..., :2, :], (1 - self.share) * one[..., 3, :] + self.share * two[..., 3, :]

    # The order of unknowns

    @property
    def size(self) -> int:
        """Number of unknowns (w, n)."""
        return 3 * self.n + 2 * int(self.links)

    def pack(self, w: Array, stress: Array) -> Array:
        """Node after node, each with its link: from (..., 3, n) and (..., 2, n_links) to (..., size)."""
        found = np.zeros((*w.shape[:-2], self.n, 5), dtype=np.result_type(w, stress))
        found[..., :3] = np.swapaxes(w, -1, -2)
        found[..., : self.links, 3:] = np.swapaxes(stress, -1, -2)
        return found.reshape(*w.shape[:-2], 5 * self.n)[..., : self.size]

    def unpack(self, y: Array) -> tuple[Array, Array]:
        """The inverse of `pack`."""
        whole = np.zeros((*y.shape[:-1], 5 * self.n), dtype=y.dtype)
        whole[..., : self.size] = y
        both = np.swapaxes(whole.reshape(*y.shape[:-1], self.n, 5), -1, -2)
        return both[..., :3, :], both[..., 3:, : self.links]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the velocities, (3 n,), row after row."""
        rows = [[("roll" if row == 0 and wheel else name) for wheel in self.wheel] for row, name in enumerate(("x", "y", "phi"))]
        return tuple(f"{name} of node {i}" for row in rows for i, name in enumerate(row))


def turned(angle: Array, d: Array) -> Array:
    """T(-angle) d, for angles (..., n) and vectors (..., 2, n)."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = d[..., 0, :], d[..., 1, :]
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=-2)


def quarter(d: Array) -> Array:
    """J d, (..., 2, n)."""
    return np.stack([-d[..., 1, :], d[..., 0, :]], axis=-2)


def columns(call: Any, at: Array, seeds: Array) -> Array:
    """Derivatives of call(y) at y = at (size,) along the rows of seeds (m, size), exact by the complex step: (m, ...)."""
    tiny = 1e-40
    found: Array = call(at + 1j * tiny * seeds).imag / tiny
    return found
