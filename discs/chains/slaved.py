r"""Discs whose headings are slaved to the centre line: the paper's rod.

Lagrange-d'Alembert for disc i (a dot is d/dt, w its share of length, F = -dV/dr_i, F_theta = -dV/dtheta_i):

    rho w r.. = F + lambda,   alpha w theta.. = F_theta - e.lambda,   r. = e theta.

Eliminating lambda, with r.. = e omega. + e. omega:

    w (alpha + rho |e|^2) omega. + w rho omega e.e. = e.F + F_theta.

Put m = w (alpha + rho |e|^2) and pi = sqrt(m) omega. Then pi. = (m omega. + m. omega/2)/sqrt(m) and m./2 = w rho e.e., so

    (r_i, theta_i). = c_i pi_i,  pi_i. = -c_i . dV/d(r_i, theta_i),  c_i = (e_i, 1)/sqrt(m_i).
"""

from functools import cached_property

import numpy as np

from discs.arrays import Float, Int, Matrix
from discs.chains import stencils
from discs.chains.chain import Chain
from discs.chains.links import LinearCurvature
from discs.chains.rolling_discs import RollingDiscs, Strains, Turn, folded
from discs.kernels.limits import LOST_HEADING
from discs.skew import Load, Parameters, Placed, Secant


class SlavedSystem(RollingDiscs):
    """The equations of motion of a `Chain`. A shape is its links, (3, n_links); `discs.chains.links` gives V,
    `discs.chains.rolling` gives e."""

    rows = ("x", "y", "theta")

    def __init__(self, chain: Chain, load: Load | None = None) -> None:
        n, ends = chain.n, chain.ends
        self.n, self._k, self._ends, self._chain = n, chain.k, ends, chain
        self.load = load
        self.closed, self.reach = ends == "ring", 3 if ends == "consistent" else 2
        self.scale = np.array([chain.length, chain.length, 1.0])
        rest = () if load is None or load.section is None else (load.section,)
        self._law, self._springs = chain.rolling_law, chain.link_law(chain, *rest)
        self.quadratic = self._springs.quadratic
        self._shift = np.array([*chain.shift, 0.0])
        self.vanishing = self._law.vanishing
        self._radius = np.asarray(chain.radius)
        mass = chain.w * np.asarray(chain.density)
        self.weights = np.array([mass, mass, chain.w * np.asarray(chain.spin_inertia)])
        inertia = np.asarray(chain.spin_inertia) + np.asarray(chain.density) * self._radius**2
        point = np.max(self._radius**2 / np.maximum(inertia, 1e-300))
        self.stiffest = 4 * float(np.max(chain.bending_stiffness) * point) / chain.k**4

    # Kinematics

    def shape(self, hi: Float, lo: Float | None = None) -> Float:
        d = stencils.links(hi, self._ends)
        if lo is not None:
            d += stencils.links(lo, self._ends)
        if self._ends == "ring":
            d[:, -1] += self._shift
        return d

    def moved(self, shape: Float, dq: Float) -> Float:
        return shape + stencils.links(dq, self._ends)

    def slope(self, shape: Float) -> Float:
        return stencils.slopes(shape[:2], self._k, self._ends)

    def contact(self, shape: Float) -> Float:
        slope = self.slope(shape)
        e: Float = slope[::-1] * self._law.arm(self._radius, slope)
        np.negative(e[0], out=e[0])
        return e

    def contact_rate(self, shape: Float, v: Float) -> Float:
        turning = self._law.rate(self.slope(shape), self.slope(stencils.links(v, self._ends)))
        rate: Float = self._radius * np.array([-turning[1], turning[0]])
        return rate

    def inertia(self, e: Float) -> Float:
        """Inertia of each disc for rolling, m = w (alpha + rho |e|**2), (n,)."""
        m: Float = self.weights[2] + self.weights[0] * (e[0] ** 2 + e[1] ** 2)
        return m

    def basis(self, shape: Float) -> Float:
        c = np.empty((3, self.n), shape.dtype)
        c[:2] = self.contact(shape)
        c[2] = 1 / np.sqrt(self.inertia(c[:2]))
        c[:2] *= c[2]
        return c

    def forward(self, c: Float, p: Float) -> Float:
        return c * p

    def back(self, c: Float, g: Float) -> Float:
        pulled: Float = (c * g).sum(axis=0)
        return pulled

    def momentum(self, shape: Float, rates: Float) -> Float:
        pi: Float = np.sqrt(self.inertia(self.contact(shape))) * rates[0]
        return pi

    def lost_heading(self, before: Placed, after: Placed) -> int | None:
        """A disc whose |r'| falls below `LOST_HEADING` on the straight line between two configurations, or None."""
        if not self.vanishing:
            return None
        a, b = (self.slope(self.shape(z.hi, z.lo)) for z in (before, after))
        move = b - a
        square = np.maximum((move * move).sum(axis=0), 1e-300)
        nearest = np.hypot(*(a + move * np.clip(-(a * move).sum(axis=0) / square, 0.0, 1.0)))
        disc = int(np.argmin(nearest))
        return disc if nearest[disc] < LOST_HEADING else None

    def turns(self, shape: Float) -> list[Turn]:
        """With z = r': de = R J dh and d(1/sqrt m) = -w rho e . de/m^(3/2)."""
        z, e = self.slope(shape), self.contact(shape)
        root = np.sqrt(self.inertia(e))
        found = []
        for row in (0, 1):
            along = np.zeros_like(z)
            along[row] = 1.0
            turned = self._law.rate(z, along)
            de = self._radius * np.array([-turned[1], turned[0]])
            shrink = -self.weights[0] * (e * de).sum(axis=0) / root**3
            found.append(Turn(row, self._headings, np.array([*(de / root + e * shrink), shrink])))
        return found

    @cached_property
    def _headings(self) -> Matrix:
        return stencils.matrix(lambda r: stencils.slopes(stencils.links(r, self._ends), self._k, self._ends), self.n, self._ends)

    # Springs

    def potential(self, shape: Float) -> float:
        return self._springs.potential(shape)

    def springs(self, shape: Float) -> dict[str, float]:
        return self._springs.energies(shape)

    def strains(self, shape: Float) -> Strains:
        return self._springs.strains(shape)

    def polarised(self, shape: Float, other: Float) -> float:
        return self._springs.polarised(shape, other)

    def secant(self, shape: Float, dq: Float) -> Secant:
        return self._springs.secant(shape, stencils.links(dq, self._ends))

    def mean_force(self, secant: Secant) -> Float:
        return stencils.pull(self._springs.tension(secant), self._ends)

    # The linear system of an implicit step

    @cached_property
    def order(self) -> Int | None:
        return folded(self.n) if self._ends == "ring" else None

    def stiffness(self, secant: Secant, c: Float) -> Float:
        return self._springs.stiffness(secant, c)

    @cached_property
    def parameters(self) -> Parameters:
        parts = [part.parameters for part in (self._law, self._springs, self.load) if part is not None]
        if None in parts:
            return None
        from discs.kernels import slaved  # numba is slow to import

        return slaved.parameters(self._chain, self.weights, self.scale, self._shift, *parts)

    @cached_property
    def lanes(self) -> Parameters:
        """The same parameters in lanes (`discs.kernels.slaved_lanes`), for methods that take them; None for few or very many."""
        if not isinstance(self._springs, LinearCurvature) or self.parameters is None:
            return None
        from discs.kernels import lanes, slaved_lanes, slaved_stages  # noqa: F401, and the sweeps

        fit = slaved_lanes.MANY <= self.n <= slaved_lanes.MOST and lanes.local(self.parameters.load)
        return slaved_lanes.arranged(self.parameters) if fit else None

    def part(self, own: Parameters) -> Parameters:
        from discs.kernels import slaved_lanes

        return slaved_lanes.arranged(self.parameters, own)
