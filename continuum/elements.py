"""The steered rod (sections with headings of their own) by spectral elements: fields to 1e-7 and better.

The planar geometrically exact (Simo-Reissner) rod with rolling sections has centre line r, heading phi and roll angle theta. With
d_1 = (cos phi, sin phi) and T(a) the rotation by an angle a, the strains are Gamma = T(-phi) r' - (1, 0) (stretch, shear). The
energies per length are

    rho |r.|^2/2 + alpha theta.^2/2 + J phi.^2/2   and   A Gamma_1^2/2 + G Gamma_2^2/2 + beta theta'^2/2 + K phi'^2/2,

and rolling is r. = e theta., e = R (-sin phi, cos phi). For admissible variations (e psi, psi, chi) d'Alembert's principle reads

    int (alpha + rho R^2) theta.. psi + J phi.. chi  =  - int n . (e psi)' + beta theta' psi' + K phi' chi' + (n x r') chi,

with n = T(phi) (A Gamma_1, G Gamma_2). The natural end conditions are e.n + beta theta' = 0 and K phi' = 0.

Integrals are replaced by Gauss-Lobatto sums over elements with polynomials of degree p (weights w, derivative D), for fields and
variations alike; parameters that vary are taken at the nodes. The inertia of the nodes is then diagonal, and the energy of the sums
is constant. n . (e psi)' is computed as a force -D^T w n on r, projected on e. Time is integrated by DOP853, or by Radau's method
where damping is stiff, with an error far below that of the elements. Loads: see `continuum.element_loads`.

The method is independent of the chain of discs: it shares only the equations.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used

from continuum.element_grid import Grid
from continuum.element_loads import ElementLoads, breaks
from continuum.element_march import march
from continuum.element_whole import march as whole
from continuum.element_whole import parameters, ready
from continuum.initial import resolve
from continuum.parameters import Section, sample
from continuum.pieces import POINTS
from continuum.rod import Scene
from discs.arrays import Float, Matrix

STIFF = 150.0  # steps are implicit where damping is faster than this times tol^(-1/5), in units of 1/duration
NONE = np.empty(0)
UNKNOWNS = ("x", "y", "theta", "phi", "omega", "phi_rate")


@dataclass(frozen=True)
class Elements:
    """A scene of a `SteeredRod` on spectral elements of degree `DEGREE`: `count` equal ones without loads.

    Loads that act at a point and patterns that jump have edges there (`element_loads.breaks`). Of the parts of the length between
    these, each has a multiple of `count` elements, so that twice the count is half the width everywhere.

    Unknowns are rows (6, n) at the n nodes, named by UNKNOWNS. The last node of a closed rod is its first.
    """

    scene: Scene
    count: int

    @cached_property
    def grid(self) -> Grid:
        """The nodes."""
        length = self.scene.rod.length
        parts = np.array([0.0, *breaks(self.scene), length])
        each = np.maximum(1, np.rint(np.diff(parts) / length * (parts.size - 1))).astype(int) * self.count
        inner = [a + (b - a) * np.arange(m) / m for a, b, m in zip(parts, parts[1:], each, strict=False)]
        return Grid(np.append(np.concatenate(inner), length), self.scene.closed)

    @property
    def n(self) -> int:
        """Number of nodes."""
        return self.grid.n

    @property
    def s(self) -> Float:
        """Places of the nodes, (n,)."""
        return self.grid.s

    def local(self, q: Float) -> Float:
        """Rows x, y, theta, phi of (6, ..., n) on elements, (4, ..., P, DEGREE + 1); the last node of a closed rod is shifted and
        turned."""
        values: Float = q[:4, ..., self.grid.index]
        if self.scene.closed:
            for row, added in zip((0, 1, 3), (*self.scene.shift, 2 * np.pi * self.scene.turns), strict=True):
                values[row, ..., -1, -1] += added
        return values

    def _strains(self, q: Float) -> tuple[Float, Float, Float, Float]:
        values = self.local(q)
        dx, dy, twist, bend = self.grid.slope(values)
        cos, sin = np.cos(values[3]), np.sin(values[3])
        return np.stack([cos * dx + sin * dy, cos * dy - sin * dx]), twist, bend, np.stack([cos, sin])

    @cached_property
    def _at_nodes(self) -> Section[Float]:
        return self.scene.rod.at(self.s)

    @cached_property
    def stiffness(self) -> Float:
        """Of stretch, shear, torsion and bending on the elements, (4, P, DEGREE + 1)."""
        there, shape = self.scene.rod.at(self.grid.places), self.grid.places.shape
        found = there.stretch_stiffness, there.shear_stiffness, there.torsion_stiffness, there.bending_stiffness
        return np.stack([np.broadcast_to(values, shape) for values in found])

    @cached_property
    def radius(self) -> Float:
        """At the nodes, (n,)."""
        return np.broadcast_to(np.asarray(self._at_nodes.radius, dtype=float), self.n).copy()

    @cached_property
    def loads(self) -> ElementLoads | None:
        """The loads of the scene; None for none."""
        if not self.scene.loads:
            return None
        return ElementLoads(self.scene, self.grid)

    def energy(self, q: Float, rest: Float | float = 0.0) -> float:
        """Kinetic and potential energy of (6, n), with rest strains (4, P, DEGREE + 1)."""
        rod = self._at_nodes
        u, twist, bend, _ = self._strains(q)
        density = (self.stiffness * (np.stack([u[0] - 1, u[1], twist, bend]) - rest) ** 2).sum(axis=0)
        kinetic = self.grid.weights @ (rod.inertia * q[4] ** 2 + rod.heading_inertia * q[5] ** 2)
        own = 0.0 if self.loads is None else self.loads.energy(q)
        return own + 0.5 * float((self.grid.w * density).sum() + kinetic)

    def stresses(self, q: Float, values: Float) -> tuple[Float, Float, tuple[Float, Float, Float]]:
        """Of (6, n) and values of signals: strains less those at rest, and stresses, (4, P, DEGREE + 1); also d_1 and
        Gamma + (1, 0) (2, P, DEGREE + 1), and omega' and phi.' alike, without loads 0."""
        loads, bent = self.loads, np.zeros(1)
        u, twist, bend, along = self._strains(q)
        strain = np.stack([u[0] - 1, u[1], twist, bend])
        if loads is not None:
            strain -= loads.at_rest(values)
        stress = self.stiffness * strain
        if loads is not None:
            bent = self.grid.slope(q[4:, self.grid.index])
            stress[2:] += loads.viscosity * bent
        return strain, stress, (along, u, bent)

    def spins(self, t: float, q: Float) -> tuple[Float, Float]:
        """omega. at the nodes (n,) at a time, and the torques about the axles of motors at the two ends (2,)."""
        loads, reaction = self.loads, np.zeros(2)
        torque, inertia = self._torques(q, NONE if loads is None else loads.values(t))[0][0], self.inertia[0]
        spin: Float = torque / inertia
        if loads is not None and loads.motors.axles:
            for row, node, change in zip(*loads.driven, loads.motors.changes(np.array([t]))[0], strict=True):
                if row == 0:
                    spin[node] = change
                    reaction[min(node, 1)] = change * inertia[node] - torque[node]
        return spin, reaction

    def _torques(self, q: Float, values: Float) -> tuple[Float, Float, Float]:
        """Of (6, n) and values of signals: torques about the axles and the vertical, but for motors (2, n); e (2, n); and
        omega' and phi.' as in `stresses`."""
        loads, w = self.loads, self.grid.w
        _, stress, ((cos, sin), u, bent) = self.stresses(q, values)
        n1, n2 = stress[:2]
        flux = np.stack([cos * n1 - sin * n2, sin * n1 + cos * n2, stress[2], stress[3]])
        local = -(w * flux / self.grid.half) @ self.grid.d.T
        local[3] += w * (u[0] * n2 - u[1] * n1)
        force = self.grid.sum(local)
        e = self.radius * np.stack([-np.sin(q[3]), np.cos(q[3])])
        if loads is not None:
            force += loads.force(values, q, e)
        return np.stack([e[0] * force[0] + e[1] * force[1] + force[2], force[3]]), e, bent

    def rate(self, t: float, flat: Float) -> Float:
        """The time derivative of the unknowns, flat; with loads followed by the rates of work and dissipation."""
        loads, q, values = self.loads, flat[: 6 * self.n].reshape(6, -1), NONE
        if loads is not None:
            values = loads.values(t)
            q = loads.held(values, q)
        torque, e, bent = self._torques(q, values)
        out = np.empty_like(q)
        out[:2] = e * q[4]
        out[2:4] = q[4:]
        out[4:] = torque / self.inertia
        if loads is None:
            return out.ravel()
        out[4:][loads.driven] = 0.0  # `held` sets these rates
        power = loads.power(values, q[:4], out[:4], self.stiffness[2:], bent)
        power[0] -= torque[loads.driven] @ q[4:][loads.driven]
        return np.concatenate([out.ravel(), power])

    def _balance(self, times: Float, q: Float, values: Float, spent: Float) -> tuple[Float, Float | None]:
        """Work and dissipation (F, 2), and torques of motors (F, motors), of a motion (F, 6, n) with signals (F, L + motors + 1).

        spent : (F, 2), the integrals of what `rate` returns for the first two.
        """
        loads = self.loads
        assert loads is not None

        def driven(now: Float, z: Float) -> float:
            """Energy that depends on time, and that of discs that motors drive."""
            kinetic = 0.5 * self.inertia[loads.driven] @ z[4:][loads.driven] ** 2
            return self.energy(z, loads.at_rest(now)) - self.energy(z, loads.rest) + float(kinetic)

        gained = np.array([driven(*pair) for pair in zip(values, q, strict=True)]) - driven(loads.values(0.0), self.start)
        balance = np.stack([spent[:, 0] + gained, spent[:, 1]], axis=1)
        if not loads.motors.axles:
            return balance, None
        torques = [self._torques(z, now)[0][loads.driven] for now, z in zip(values, q, strict=True)]
        return balance, loads.motors.changes(times) * self.inertia[loads.driven] - np.array(torques)

    @cached_property
    def inertia(self) -> Float:
        """Of rolling and turning at the nodes, (2, n)."""
        return np.stack([self._at_nodes.inertia * self.grid.weights, self._at_nodes.heading_inertia * self.grid.weights])

    @cached_property
    def start(self) -> Float:
        """The unknowns of the initial fields, (6, n)."""
        fields = self.scene.fields(self.s)
        return np.stack([fields[name] for name in UNKNOWNS])

    @cached_property
    def misfit(self) -> dict[str, float]:
        """Largest difference between the initial fields and their polynomials on the elements, for each field; also for parameters
        of the rod that vary, over their range."""
        s, _ = resolve(self.scene).quadrature(POINTS)
        truth, varying = self.scene.fields(s), self.scene.rod.varying
        there = [sample(name, function, self.grid.places)[None] for name, function in varying.items()]
        found = self.grid.sample(np.concatenate([self.local(self.start), self.start[4:, self.grid.index], *there]), s)
        off = {name: float(np.abs(row - truth[name]).max()) for name, row in zip(UNKNOWNS, found, strict=False)}
        for (name, function), row in zip(varying.items(), found[len(UNKNOWNS) :], strict=True):
            value = sample(name, function, s)
            off[name] = float(np.abs(row - value).max() / max(np.ptp(value), 1e-9 * value.max()))
        return off

    def sample(self, q: Float, s: Float) -> Float:
        """Rows x, y, theta, phi, theta., phi. of (6, ..., n) at places s (S,), (6, ..., S)."""
        return self.grid.sample(np.concatenate([self.local(q), q[4:, ..., self.grid.index]]), s)

    def run(self, times: Float, tol: float) -> "Course":
        """The motion at the times, with an error of the time steps below tol."""
        loads, start, size = self.loads, self.start.ravel(), 6 * self.n
        what = f"{self.grid.count} elements"
        if loads is None:
            if ready():
                closing = np.array([*self.scene.shift, 0.0, 2 * np.pi * self.scene.turns]) if self.scene.closed else np.zeros(4)
                rod = parameters(self.grid, self.stiffness, self.radius, self.inertia, closing)
                q = whole(rod, self.start, times, tol, what)
            else:
                q = march(self.rate, start, times, np.zeros(1), tol, what).reshape(-1, 6, self.n)
            return Course(q, np.array([self.energy(z) for z in q]))
        fastest = loads.fastest(self.inertia, float(np.max(self._at_nodes.radius)))
        # explicit steps are below 5/fastest; the number of implicit ones, which cost more, grows like tol^(-1/5)
        pattern = self._pattern if fastest * times[-1] > STIFF * tol**-0.2 else None
        found = march(self.rate, np.append(start, [0.0, 0.0]), times, loads.timing.edges, tol, what, pattern)
        q = found[:, :size].reshape(-1, 6, self.n)
        values = np.array([loads.values(t) for t in times])
        q = np.array([loads.held(now, z) for now, z in zip(values, q, strict=True)])
        energy = np.array([self.energy(z, loads.at_rest(now)) for now, z in zip(values, q, strict=True)])
        return Course(q, energy, *self._balance(times, q, values, found[:, size:]))

    @cached_property
    def _pattern(self) -> Matrix:
        """Where the Jacobian of `rate` has entries: between unknowns of one element. Work and dissipation act on nothing. Their own
        rows are left out, which delays them by one iteration of a step: each column would have entries there, and none could be
        differenced together."""
        near = scipy.sparse.lil_array((self.n, self.n))
        for nodes in self.grid.index:
            near[np.ix_(nodes, nodes)] = 1
        return scipy.sparse.block_diag([scipy.sparse.kron(np.ones((6, 6)), near), np.zeros((2, 2))], format="csc")


class Course(NamedTuple):
    """A motion at times: unknowns (F, 6, n) and energy (F,); with loads work and dissipation (F, 2) and torques of motors."""

    q: Float
    energy: Float
    balance: Float | None = None
    reaction: Float | None = None
