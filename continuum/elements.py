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
is constant. n . (e psi)' is computed as a force -D^T w n on r, projected on e. Time is integrated by DOP853, with an error far
below that of the elements.

The method is independent of the chain of discs: it shares only the equations.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.polynomial import legendre

from continuum.initial import resolve
from continuum.parameters import Section, sample
from continuum.pieces import POINTS
from continuum.rod import Scene
from discs.arrays import Float, Int

DEGREE = 10
MOST_CALLS = 12 * 2**17  # evaluations of the rates, twelve per step
TRIED = 12 * 2**8  # evaluations after which their total is predicted
UNKNOWNS = ("x", "y", "theta", "phi", "omega", "phi_rate")


def lobatto(p: int) -> tuple[Float, Float, Float]:
    """Gauss-Lobatto nodes and weights on [-1, 1], (p+1,), and the derivative matrix of the polynomial of degree p through them."""
    basis = legendre.Legendre.basis(p)
    x = np.concatenate([[-1.0], np.sort(basis.deriv().roots().real), [1.0]])
    for _ in range(3):  # Newton steps on the inner roots of P_p', to round-off
        x[1:-1] -= basis.deriv()(x[1:-1]) / basis.deriv(2)(x[1:-1])
    values = basis(x)
    weights = 2 / (p * (p + 1) * values**2)
    gap = x[:, None] - x[None, :]
    np.fill_diagonal(gap, 1.0)
    d = values[:, None] / values[None, :] / gap
    np.fill_diagonal(d, 0.0)
    np.fill_diagonal(d, -d.sum(axis=1))
    return x, weights, d


@dataclass(frozen=True)
class Elements:
    """A scene of a `SteeredRod` on `count` equal elements of degree `DEGREE`.

    Unknowns are rows (6, n) at the n nodes, named by UNKNOWNS. The last node of a closed rod is its first.
    """

    scene: Scene
    count: int

    @cached_property
    def _rule(self) -> tuple[Float, Float, Float]:
        x, w, d = lobatto(DEGREE)
        half = self.scene.rod.length / self.count / 2
        return x, w * half, d / half

    @cached_property
    def _expand(self) -> Float:
        """The matrix from values at the nodes of an element to Legendre coefficients, (DEGREE + 1, DEGREE + 1)."""
        return np.linalg.inv(legendre.legvander(self._rule[0], DEGREE)).astype(np.float64, copy=False)

    @cached_property
    def _index(self) -> Int:
        """Nodes of each element, (count, DEGREE + 1)."""
        index = DEGREE * np.arange(self.count)[:, None] + np.arange(DEGREE + 1)
        return index % self.n if self.scene.closed else index

    @property
    def n(self) -> int:
        """Number of nodes."""
        return DEGREE * self.count + (not self.scene.closed)

    @cached_property
    def s(self) -> Float:
        """Places of the nodes, (n,)."""
        x = self._rule[0]
        width = self.scene.rod.length / self.count
        local = width * (np.arange(self.count)[:, None] + (x + 1) / 2)
        return local[:, :-1].ravel() if self.scene.closed else np.append(local[:, :-1].ravel(), local[-1, -1])

    @cached_property
    def weights(self) -> Float:
        """Share of the length of each node, (n,)."""
        return self._sum(np.broadcast_to(self._rule[1], self._index.shape))

    def _sum(self, local: Float) -> Float:
        """Sum of the values of elements (..., count, DEGREE + 1) at the nodes, (..., n)."""
        total = np.empty((*local.shape[:-2], self.n))
        inner = self.n - (not self.scene.closed)
        total[..., :inner] = local[..., :-1].reshape(*local.shape[:-2], -1)
        if self.scene.closed:
            total[..., 0] += local[..., -1, -1]
        else:
            total[..., -1] = local[..., -1, -1]
        total[..., DEGREE:inner:DEGREE] += local[..., :-1, -1]
        return total

    def local(self, q: Float) -> Float:
        """Rows x, y, theta, phi on elements, (4, count, DEGREE + 1); the last node of a closed rod includes its shift and turns."""
        values = q[:4, self._index]
        if self.scene.closed:
            values[:2, -1, -1] += np.array(self.scene.shift)
            values[3, -1, -1] += 2 * np.pi * self.scene.turns
        return values

    def _strains(self, q: Float) -> tuple[Float, Float, Float, Float]:
        values = self.local(q)
        dx, dy, twist, bend = values @ self._rule[2].T
        cos, sin = np.cos(values[3]), np.sin(values[3])
        return np.stack([cos * dx + sin * dy, cos * dy - sin * dx]), twist, bend, np.stack([cos, sin])

    @cached_property
    def _at_nodes(self) -> Section[Float]:
        return self.scene.rod.at(self.s)

    @cached_property
    def _in_elements(self) -> Section[Float]:
        x, width = self._rule[0], self.scene.rod.length / self.count
        return self.scene.rod.at(np.minimum(width * (np.arange(self.count)[:, None] + (x + 1) / 2), self.scene.rod.length))

    def energy(self, q: Float) -> float:
        """Kinetic and potential energy of (6, n)."""
        rod, there = self._at_nodes, self._in_elements
        u, twist, bend, _ = self._strains(q)
        stiffness = there.stretch_stiffness, there.shear_stiffness, there.torsion_stiffness, there.bending_stiffness
        density = sum(k * strain**2 for k, strain in zip(stiffness, (u[0] - 1, u[1], twist, bend), strict=True))
        kinetic = self.weights @ (rod.inertia * q[4] ** 2 + rod.heading_inertia * q[5] ** 2)
        return 0.5 * float((self._rule[1] * density).sum() + kinetic)

    def rate(self, _: float, flat: Float) -> Float:
        """The time derivative of the unknowns, flat."""
        rod, there, (w, d) = self._at_nodes, self._in_elements, self._rule[1:]
        q = flat.reshape(6, -1)
        u, twist, bend, (cos, sin) = self._strains(q)
        n1, n2 = there.stretch_stiffness * (u[0] - 1), there.shear_stiffness * u[1]
        flux = np.stack([cos * n1 - sin * n2, sin * n1 + cos * n2, there.torsion_stiffness * twist, there.bending_stiffness * bend])
        local = -(w * flux) @ d
        local[3] += w * (u[0] * n2 - u[1] * n1)
        force = self._sum(local)
        e = rod.radius * np.stack([-np.sin(q[3]), np.cos(q[3])])
        out = np.empty_like(q)
        out[:2] = e * q[4]
        out[2:4] = q[4:]
        out[4] = (e[0] * force[0] + e[1] * force[1] + force[2]) / (rod.inertia * self.weights)
        out[5] = force[3] / (rod.heading_inertia * self.weights)
        return out.ravel()

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
        truth, parameters = self.scene.fields(s), [*self.scene.rod.varying]
        there = [getattr(self._in_elements, name) for name in parameters]
        known = np.concatenate([self.local(self.start), self.start[4:, self._index], *(values[None] for values in there)])
        at = s / self.scene.rod.length * self.count
        element = np.minimum(at.astype(int), self.count - 1)
        found = np.einsum("fsk,sk->fs", (known @ self._expand.T)[:, element], legendre.legvander(2 * (at - element) - 1, DEGREE))
        off = {name: float(np.abs(row - truth[name]).max()) for name, row in zip(UNKNOWNS, found, strict=False)}
        for name, row in zip(parameters, found[len(UNKNOWNS) :], strict=True):
            value = sample(name, self.scene.rod.varying[name], s)
            off[name] = float(np.abs(row - value).max() / max(np.ptp(value), 1e-9 * value.max()))
        return off

    def run(self, times: Float, tol: float) -> Float:
        """The unknowns at the times, (F, 6, n), with an error of the time steps below tol."""
        calls = 0

        def rate(t: float, flat: Float) -> Float:
            nonlocal calls
            calls += 1
            if calls > MOST_CALLS or (calls == TRIED and t * MOST_CALLS < TRIED * span[1]):
                raise ValueError(
                    f"tol is not reached in {MOST_CALLS // 12} time steps of {self.count} elements: "
                    "ask for a larger tol or a shorter duration"
                )
            return self.rate(t, flat)

        span = 0.0, max(float(times[-1]), 1e-300)
        found = scipy.integrate.solve_ivp(rate, span, self.start.ravel(), "DOP853", t_eval=times, rtol=1e-12, atol=tol)
        if not found.success:
            raise ValueError(f"the field could not be integrated: {found.message}; ask for a larger tol or a shorter duration")
        unknowns: Float = found.y.T.reshape(len(times), 6, -1)
        return unknowns

    def sample(self, q: Float, cells: int) -> Float:
        """Rows x, y, theta, phi, theta., phi. of (6, n) at equally spaced places, `cells` in each element, (6, places)."""
        through = legendre.legvander(np.linspace(-1, 1, cells, endpoint=False), DEGREE) @ self._expand
        values = np.concatenate([self.local(q), q[4:, self._index]])
        places = (values @ through.T).reshape(6, -1)
        return places if self.scene.closed else np.column_stack([places, q[:, -1]])
