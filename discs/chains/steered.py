r"""Discs with their own headings phi: a chain of N vertical rolling discs, as in textbooks.

Disc i (share of length w) has mass rho w, spin inertia alpha w and heading inertia J w, an axle along d_1 = (cos phi, sin phi), and
rolls along J d_1: r. = e theta. with e = R (-sin phi, cos phi). As |e| = R, Lagrange-d'Alembert gives, with F_q = -dV/dq,

    (alpha + rho R^2) w theta.. = e . F_r + F_theta,   J w phi.. = F_phi,

since e.e. = 0: the inertia is constant, and there are no gyroscopic forces. C has two columns for a disc,
(e, 1, 0)/sqrt((alpha + rho R^2) w) and (0, 0, 1)/sqrt(J w) in (x, y, theta, phi).

Strains of a link, with d = r_{i+1} - r_i, mean heading m = (phi_i + phi_{i+1})/2 and T(m) the turn by m:

    stretch and shear Gamma = T(-m) d/k - (1, 0),   torsion (theta_{i+1} - theta_i)/k,   bending (phi_{i+1} - phi_i)/k,

V = sum_links k/2 (A Gamma_1^2 + G Gamma_2^2 + beta torsion^2 + K bending^2). Over a step in which d changes by D and m by delta,

    Gamma_1 - Gamma_0 = cos(delta/2) T(-mu) D/k - delta sinc(delta/2) J T(-mu) M/k

exactly, with mu and M the means of m and d. This is the secant of Gamma in closed form.

Free ends of the limit N -> infinity, the planar Simo-Reissner rod rho r.. = n' + lambda, J phi.. = K phi'' + r' x n,
alpha theta.. = beta theta'' - e.lambda, follow from the admissible variations: K phi' = 0 and e.n + beta theta' = 0.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float, Int, Matrix
from discs.chains import elements, stencils
from discs.chains.chain import SteeredChain
from discs.chains.rolling_discs import Assembly, Joined, RollingDiscs, Strains, Turn, folded
from discs.skew import Load, Parameters, Placed


class Links(NamedTuple):
    """Shape of a steered chain.

    d : (4, n_links), differences of neighbours. middle : (n_links,), mean headings of links. phi : (n,), headings.
    For elements of degree 2, d and middle at their strain points, see `discs.chains.elements`.
    """

    d: Float
    middle: Float
    phi: Float


class Section(NamedTuple):
    """Mean geometry of a step: d Gamma = along @ d(d) + across d(m), and the mean strains.

    along : (2, 2, n_links). across : (2, n_links). strain : (4, n_links): stretch, shear, torsion, bending.
    """

    along: Float
    across: Float
    strain: Float


class SteeredSystem(RollingDiscs):
    """The equations of motion of a `SteeredChain`."""

    rows = ("x", "y", "theta", "phi")
    quadratic = renewed = False
    vanishing = False

    def __init__(self, chain: SteeredChain, load: Load | None = None) -> None:
        self.n, self._k, self._ends, self._chain = chain.n, chain.k, chain.ends, chain
        self.load = load
        self.closed = chain.ends == "ring"
        self.reach = self._degree = chain.degree
        self.scale = np.array([chain.length, chain.length, 1.0, 1.0])
        self._shift = np.array([*chain.shift, 0.0, 2 * np.pi * chain.turns])
        self._radius = np.asarray(chain.radius)
        mass, spin, turn = (chain.w * np.asarray(p) for p in (chain.density, chain.spin_inertia, chain.heading_inertia))
        self.weights = np.array([mass, mass, spin, turn])
        self._roots = np.sqrt(np.array([spin + mass * self._radius**2, turn]))
        stiff = chain.stretch_stiffness, chain.shear_stiffness, chain.torsion_stiffness, chain.bending_stiffness
        self._stiffness = chain.k * np.array(stiff)
        norm = 4 * 4 / 3 if chain.degree == 2 else 4  # of B^T B: at most 4 for links, and 4/3 for `elements.mixed` squared
        self.stiffest = norm * float(np.max(self._stiffness) / np.min(self._roots) ** 2) / chain.k**2

    # Kinematics

    def _middle(self, phi: Float, close: float) -> Float:
        """Means of neighbours; on a ring the last mean takes the whole turns `close` into account."""
        if self._ends != "ring":
            middle: Float = 0.5 * (phi[1:] + phi[:-1])
        else:
            middle = 0.5 * (phi + np.append(phi[1:], phi[0] + close))
        return middle

    def shape(self, hi: Float, lo: Float | None = None) -> Links:
        d = stencils.links(hi, self._ends)
        phi = hi[3]
        if lo is not None:
            d += stencils.links(lo, self._ends)
            phi = phi + lo[3]
        if self._ends == "ring":
            d[:, -1] += self._shift
        return Links(*self._strained(d, self._middle(phi, self._shift[3])), phi)

    def _strained(self, d: Float, middle: Float) -> tuple[Float, Float]:
        """Differences and mean headings of links, where strains are taken."""
        return elements.at_points(d, middle) if self._degree == 2 else (d, middle)

    def moved(self, shape: Links, dq: Float) -> Links:
        d, middle = self._strained(stencils.links(dq, self._ends), self._middle(dq[3], 0.0))
        return Links(shape.d + d, shape.middle + middle, shape.phi + dq[3])

    def slope(self, shape: Links) -> Float:
        return np.array([np.cos(shape.phi), np.sin(shape.phi)])

    def contact(self, shape: Links) -> Float:
        e: Float = self._radius * np.array([-np.sin(shape.phi), np.cos(shape.phi)])
        return e

    def contact_rate(self, shape: Links, v: Float) -> Float:
        rate: Float = -self._radius * v[3] * self.slope(shape)
        return rate

    def basis(self, shape: Links) -> Float:
        c = np.empty((4, self.n))
        c[2:] = 1 / self._roots
        c[:2] = self.contact(shape) * c[2]
        return c

    def forward(self, c: Float, p: Float) -> Float:
        q = np.empty((4, self.n))
        np.multiply(c[:3], p[0], out=q[:3])
        np.multiply(c[3], p[1], out=q[3])
        return q

    def back(self, c: Float, g: Float) -> Float:
        return np.array([(c[:3] * g[:3]).sum(axis=0), c[3] * g[3]])

    def momentum(self, shape: Links, rates: Float) -> Float:
        pi: Float = self._roots * rates
        return pi

    def lost_heading(self, before: Placed, after: Placed) -> int | None:
        return None

    def turns(self, shape: Links) -> list[Turn]:
        """de/dphi = J e."""
        c = self.basis(shape)
        return [Turn(3, scipy.sparse.eye_array(self.n, format="csr"), np.array([-c[1], c[0], 0 * c[2], 0 * c[3]]))]

    # Springs

    @cached_property
    def joining(self) -> tuple[Matrix, Matrix]:
        """Sparse matrices (n_links, n): differences, and mean headings, where strains are taken."""
        points = np.arange(self._stiffness.shape[1])

        def joining(name: str) -> Matrix:
            parts = [(np.broadcast_to(getattr(j, name), points.shape), (points, j.disc)) for j in self._joined]
            found = [scipy.sparse.csr_array(part, shape=(points.size, self.n)) for part in parts]
            return sum(found[1:], start=found[0])

        return joining("slope"), joining("mean")

    def strain_matrix(self, section: Section) -> Matrix:
        """B, sparse (springs, 4 n), of a section."""
        (apart, mean), diagonal = self.joining, scipy.sparse.diags_array
        scaled, none = apart / self._k, 0 * mean
        rows = [
            [diagonal(section.along[a, 0]) @ apart, diagonal(section.along[a, 1]) @ apart, none, diagonal(section.across[a]) @ mean]
            for a in (0, 1)
        ]
        return scipy.sparse.block_array([*rows, [none, none, scaled, none], [none, none, none, scaled]], format="csr")

    def strains(self, shape: Links) -> Strains:
        """With Gamma = u - (1, 0) and u = T(-m) d/k: dGamma/dm = -J u, and a second derivative by m, one by m and d."""
        (apart, mean), section, diagonal = self.joining, self.secant(shape, self._no_step), scipy.sparse.diags_array
        stress = self._stiffness[:2] * section.strain[:2]
        u = np.array([-section.across[1], section.across[0]])
        mixed = [mean.T @ diagonal(stress[0] * section.along[1, a] - stress[1] * section.along[0, a]) @ apart for a in (0, 1)]
        twice = mean.T @ diagonal(-(stress * u).sum(axis=0)) @ mean
        blank = 0 * twice
        bent = [[blank] * 3 + [mixed[0].T], [blank] * 3 + [mixed[1].T], [blank] * 4, [*mixed, blank, twice]]
        bent = scipy.sparse.block_array(bent, format="csr")
        return Strains(self.strain_matrix(section), self._stiffness.ravel(), bent, section.strain.ravel())

    def _strain(self, d: Float, middle: Float) -> Float:
        cos, sin, k = np.cos(middle), np.sin(middle), self._k
        found = np.array([(cos * d[0] + sin * d[1]) / k - 1, (cos * d[1] - sin * d[0]) / k, d[2] / k, d[3] / k])
        if self.load is not None and self.load.section is not None:
            found[:2] -= self.load.section
        return found

    def potential(self, shape: Links) -> float:
        return 0.5 * float((self._stiffness * self._strain(shape.d, shape.middle) ** 2).sum())

    def springs(self, shape: Links) -> dict[str, float]:
        energies = 0.5 * (self._stiffness * self._strain(shape.d, shape.middle) ** 2).sum(axis=1)
        return dict(zip(("stretch", "shear", "torsion", "bending"), energies.tolist(), strict=True))

    def polarised(self, shape: Links, other: Links) -> float:
        raise ValueError("V is not quadratic for discs with their own headings")

    def secant(self, shape: Links, dq: Float) -> Section:
        after = self.moved(shape, dq)
        half = 0.5 * (after.middle - shape.middle)
        mu = shape.middle + half
        x, y = 0.5 * (shape.d[:2] + after.d[:2]) / self._k
        cos, sin = np.cos(mu), np.sin(mu)
        scale = np.cos(half) / self._k
        along = np.array([[scale * cos, scale * sin], [-scale * sin, scale * cos]])
        # -J T(-mu) M/k is (second, -first) component of T(-mu) M/k
        shorter = np.sinc(half / np.pi)
        across = np.array([shorter * (cos * y - sin * x), -shorter * (cos * x + sin * y)])
        strain = 0.5 * (self._strain(shape.d, shape.middle) + self._strain(after.d, after.middle))
        return Section(along, across, strain)

    def mean_force(self, secant: Section) -> Float:
        stress = self._stiffness * secant.strain
        tension = np.empty_like(stress)
        tension[0] = secant.along[0, 0] * stress[0] + secant.along[1, 0] * stress[1]
        tension[1] = secant.along[0, 1] * stress[0] + secant.along[1, 1] * stress[1]
        tension[2:] = stress[2:] / self._k
        couple = 0.5 * (secant.across * stress[:2]).sum(axis=0)
        if self._degree == 2:
            tension, couple = elements.on_links(tension, couple)
        force = stencils.pull(tension, self._ends)
        if self._ends == "ring":
            force[3] += couple + np.roll(couple, 1)
        else:
            force[3, :-1] += couple
            force[3, 1:] += couple
        return force

    # The linear system of an implicit step

    @cached_property
    def order(self) -> Int:
        """Roll and heading of a disc side by side; discs in natural order, on a ring in `folded` order."""
        discs = folded(self.n) if self._ends == "ring" else np.arange(self.n)
        return np.stack([discs, discs + self.n], axis=1).ravel()

    @cached_property
    def _joined(self) -> tuple[Joined, ...]:
        return super()._joined if self._degree == 1 else tuple(map(Joined._make, elements.joined(self.n, self.closed)))

    @cached_property
    def _assembly(self) -> Assembly:
        place = np.argsort(self.order)
        return Assembly(np.stack([place[disc + row] for disc, _, _ in self._joined for row in (0, self.n)], axis=1))

    def stiffness(self, secant: Section, c: Float) -> Float:
        b = np.zeros((self._stiffness.shape[1], 4, 2 * len(self._joined)))
        for i, (disc, slope, mean) in enumerate(self._joined):
            b[:, :2, 2 * i] = (slope * (secant.along * c[:2, disc]).sum(axis=1)).T
            b[:, :2, 2 * i + 1] = (mean * secant.across * c[3, disc]).T
            b[:, 2, 2 * i] = slope / self._k * c[2, disc]
            b[:, 3, 2 * i + 1] = slope / self._k * c[3, disc]
        return self._assembly((b, self._stiffness.T))

    @cached_property
    def parameters(self) -> Parameters:
        if self.load is not None and self.load.parameters is None:
            return None
        from discs.kernels import steered  # numba is slow to import

        load = () if self.load is None else (self.load.parameters,)
        return steered.parameters(self._chain, self.weights, self._roots, self.scale, self._shift, self._stiffness, *load)

    @cached_property
    def lanes(self) -> Parameters:
        """The same parameters in lanes (`discs.kernels.steered_lanes`), for methods that take them; None for few or very many."""
        if self._degree != 1 or self.parameters is None:
            return None
        from discs.kernels import lanes, steered_lanes, steered_passes, steered_stages  # noqa: F401, the sweeps

        fit = steered_lanes.MANY <= self.n <= steered_lanes.MOST and lanes.local(self.parameters.load)
        return steered_lanes.arranged(self.parameters) if fit else None

    def part(self, own: Parameters) -> Parameters:
        from discs.kernels import steered_lanes

        return steered_lanes.arranged(self.parameters, own)
