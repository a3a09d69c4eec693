r"""The rod with headings of its own, by spectral elements: fields to 1e-7 and better.

The planar geometrically exact (Simo-Reissner) rod with rolling sections: centre line r, heading phi, roll theta; d_1 = (cos phi,
sin phi), strains Gamma = T(-phi) r' - (1, 0) (stretch, shear), T the turn by an angle; energies per length

    rho |r.|^2/2 + alpha theta.^2/2 + J phi.^2/2   and   A Gamma_1^2/2 + G Gamma_2^2/2 + beta theta'^2/2 + K phi'^2/2,

rolling r. = e theta., e = R (-sin phi, cos phi). For admissible variations (e psi, psi, chi) d'Alembert's principle reads

    int (alpha + rho R^2) theta.. psi + J phi.. chi  =  - int n . (e psi)' + beta theta' psi' + K phi' chi' + (n x r') chi,

n = T(phi) (A Gamma_1, G Gamma_2); its natural ends are e.n + beta theta' = 0 and K phi' = 0. Integrals become Gauss-Lobatto
sums over elements with polynomials of degree p (weights w, derivative D), for fields and variations alike, so that the nodes'
inertia is diagonal and the energy of the sums is constant. n . (e psi)' is kept as a force -D^T w n on r, projected on e. Time:
DOP853 with an error far below that of the elements. This shares nothing with the chain but the equations.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import lcm

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from tqdm import tqdm

from continuum.bounds import missed, over
from continuum.rod import Scene, SteeredRod
from discs import Solution

DEGREE = 10
COUNTS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256)  # of elements
PLACES = 1024  # of a solution, or a multiple
UNKNOWNS = ("x", "y", "theta", "phi", "omega", "phi_rate")


def lobatto(p: int) -> tuple[NDArray, NDArray, NDArray]:
    """Gauss-Lobatto nodes and weights of degree p on [-1, 1], (p+1,), and the derivative of the polynomial through them."""
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

    Unknowns are rows (6, n), named by UNKNOWNS, at the n nodes; a closed rod's last node is its first.
    """

    scene: Scene
    count: int

    @cached_property
    def _rule(self) -> tuple[NDArray, NDArray, NDArray]:
        x, w, d = lobatto(DEGREE)
        half = self.scene.rod.length / self.count / 2
        return x, w * half, d / half

    @cached_property
    def _index(self) -> NDArray:
        """Nodes of each element, (count, DEGREE + 1)."""
        index = DEGREE * np.arange(self.count)[:, None] + np.arange(DEGREE + 1)
        return index % self.n if self.scene.closed else index

    @property
    def n(self) -> int:
        """Number of nodes."""
        return DEGREE * self.count + (not self.scene.closed)

    @cached_property
    def s(self) -> NDArray:
        """Places of the nodes, (n,)."""
        x = self._rule[0]
        width = self.scene.rod.length / self.count
        local = width * (np.arange(self.count)[:, None] + (x + 1) / 2)
        return local[:, :-1].ravel() if self.scene.closed else np.append(local[:, :-1].ravel(), local[-1, -1])

    @cached_property
    def weights(self) -> NDArray:
        """Length that each node stands for, (n,)."""
        return self._sum(np.broadcast_to(self._rule[1], self._index.shape))

    def _sum(self, local: NDArray) -> NDArray:
        """Add values of elements (..., count, DEGREE + 1) up at the nodes, (..., n)."""
        total = np.empty((*local.shape[:-2], self.n))
        inner = self.n - (not self.scene.closed)
        total[..., :inner] = local[..., :-1].reshape(*local.shape[:-2], -1)
        if self.scene.closed:
            total[..., 0] += local[..., -1, -1]
        else:
            total[..., -1] = local[..., -1, -1]
        total[..., DEGREE:inner:DEGREE] += local[..., :-1, -1]
        return total

    def local(self, q: NDArray) -> NDArray:
        """Rows x, y, theta, phi on elements, (4, count, DEGREE + 1); around a closed rod with its shift and turns."""
        values = q[:4, self._index]
        if self.scene.closed:
            values[:2, -1, -1] += np.array(self.scene.shift)
            values[3, -1, -1] += 2 * np.pi * self.scene.turns
        return values

    def _strains(self, q: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        values = self.local(q)
        dx, dy, twist, bend = values @ self._rule[2].T
        cos, sin = np.cos(values[3]), np.sin(values[3])
        return np.stack([cos * dx + sin * dy, cos * dy - sin * dx]), twist, bend, np.stack([cos, sin])

    def energy(self, q: NDArray) -> float:
        """Kinetic and potential energy of (6, n)."""
        rod = self._rod
        u, twist, bend, _ = self._strains(q)
        stiffness = np.array([rod.stretch_stiffness, rod.shear_stiffness, rod.torsion_stiffness, rod.bending_stiffness])
        density = np.tensordot(stiffness, np.stack([u[0] - 1, u[1], twist, bend]) ** 2, axes=1)
        kinetic = self.weights @ (rod.inertia * q[4] ** 2 + rod.heading_inertia * q[5] ** 2)
        return 0.5 * float((self._rule[1] * density).sum() + kinetic)

    @property
    def _rod(self) -> SteeredRod:
        assert isinstance(self.scene.rod, SteeredRod)  # solve sends nothing else here
        return self.scene.rod

    def rate(self, _: float, flat: NDArray) -> NDArray:
        """The time derivative of the unknowns, flat."""
        rod, (w, d) = self._rod, self._rule[1:]
        q = flat.reshape(6, -1)
        u, twist, bend, (cos, sin) = self._strains(q)
        n1, n2 = rod.stretch_stiffness * (u[0] - 1), rod.shear_stiffness * u[1]
        flux = np.stack([cos * n1 - sin * n2, sin * n1 + cos * n2, rod.torsion_stiffness * twist, rod.bending_stiffness * bend])
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

    def run(self, times: NDArray, tol: float) -> NDArray:
        """The unknowns at the times, (F, 6, n), with an error in time below tol."""
        fields = self.scene.fields(self.s)
        start = np.stack([fields[name] for name in UNKNOWNS])
        span = 0.0, max(float(times[-1]), 1e-300)
        found = solve_ivp(self.rate, span, start.ravel(), "DOP853", t_eval=times, rtol=1e-12, atol=tol)
        if not found.success:
            raise ValueError(f"the field could not be integrated: {found.message}")
        return found.y.T.reshape(len(times), 6, -1)

    def sample(self, q: NDArray, cells: int) -> NDArray:
        """Rows x, y, theta, phi, theta., phi. of (6, n) at equally spaced places, `cells` of them to an element, (6, places)."""
        x = self._rule[0]
        fine = np.linspace(-1, 1, cells, endpoint=False)
        through = legendre.legvander(fine, DEGREE) @ np.linalg.inv(legendre.legvander(x, DEGREE))
        values = np.concatenate([self.local(q), q[4:, self._index]])
        places = (values @ through.T).reshape(6, -1)
        return places if self.scene.closed else np.column_stack([places, q[:, -1]])


def solve_elements(scene: Scene, bound: Mapping[str, float], times: NDArray, progress: bool) -> Solution:
    """The fields within bounds by name, their error measured on more elements.

    Elements are added until the next number of them changes nothing by more than the tolerance. That change, and a half for what
    the finer one errs itself (a third of it or less: 4/3 the elements divide the error by 3 to 20 on the twisted rod), is the
    error of the coarser one, which is the solution.

    Returns
    -------
    Solution on equally spaced nodes, a multiple of 1024 to the length.
    """
    tol = min(bound.values())
    rest = min(tol / 100, 1e-7)  # of the steps, far below what even the fewest elements err
    with tqdm(desc=f"field to {tol:g}", unit="run", delay=1, disable=not progress) as bar:
        fine = Elements(scene, COUNTS[0])
        after = fine.run(times, rest)
        for count in COUNTS[1:]:
            bar.update()
            system, found, fine = fine, after, Elements(scene, count)
            after = fine.run(times, rest)
            places = lcm(PLACES, system.count, fine.count)
            values, finer = (
                np.stack([e.sample(q, places // e.count) for q in frames], axis=1) for e, frames in ((system, found), (fine, after))
            )
            changes = np.abs(values - finer).max(axis=(1, 2))
            error = {name: 1.5 * float(change) + rest for name, change in zip(UNKNOWNS, changes, strict=True)}
            if over(error, bound) <= 1:
                break
        else:
            raise ValueError(missed(error, bound, f"on {system.n} nodes"))
    return Solution(
        t=times,
        s=scene.rod.length / places * np.arange(values.shape[-1]),
        energy=np.array([system.energy(q) for q in found]),
        stats={"method": "elements", "order": DEGREE, "elements": system.count, "nodes": system.n, "dt": None},
        error_estimate=error,
        **dict(zip(UNKNOWNS, values, strict=True)),
    )
