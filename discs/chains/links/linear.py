"""The paper's link law, linear curvature: bending energy K |r''|**2/2; V is quadratic."""

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Complex, Float
from discs.chains import stencils
from discs.chains.links.law import LinkLaw
from discs.chains.rolling_discs import Strains, folded
from discs.kernels import protocol as do
from discs.kernels.compiled import fill, part
from discs.kernels.slaved_matrix import GHOST, RING, Matrix, assemble

if TYPE_CHECKING:
    from discs.chains.chain import Chain


class LinearCurvature(LinkLaw):
    """Bending energy K |r''|**2/2. The secant of a step is the mean of its links.

    Attributes
    ----------
    bend : (n,), K w/k**4, stiffness for `stencils.bends`; zero where there is no spring.
    twist : (n_links,), beta/k, stiffness for differences of theta.
    """

    name = "linear"
    quadratic, end_bends, stretches, directed = True, True, False, False

    @staticmethod
    def density(bending: Float, stretching: Float, z: Complex, z1: Complex) -> Float:
        density: Float = bending * np.abs(z1) ** 2
        return density

    def __init__(self, chain: "Chain") -> None:
        self._n, self._ends = chain.n, chain.ends
        stiffness = np.asarray(chain.bending_stiffness) * chain.bend_shares / chain.k**4
        self.bend = np.pad(stiffness, (chain.n - stiffness.size) // 2)
        self.twist = np.asarray(chain.torsion_stiffness) / chain.k
        self._order = folded(chain.n) if chain.ends == "ring" else None

    def potential(self, d: Float) -> float:
        return self.polarised(d, d)

    def energies(self, d: Float) -> dict[str, float]:
        bending = (self.bend * stencils.bends(d[:2], self._ends) ** 2).sum()
        return {"bending": 0.5 * float(bending), "torsion": 0.5 * float(self.twist @ d[2] ** 2)}

    def polarised(self, d: Float, other: Float) -> float:
        """The symmetric bilinear form V(d, d') with V(d, d) = V(d)."""
        bends, others = stencils.bends(d[:2], self._ends), stencils.bends(other[:2], self._ends)
        return 0.5 * float((self.bend * bends * others).sum() + (self.twist * d[2]) @ other[2])

    def secant(self, d: Float, change: Float) -> Float:
        return d + 0.5 * change

    def tension(self, secant: Float) -> Float:
        tension = np.empty_like(secant)
        moments = self.bend * stencils.bends(secant[:2], self._ends)
        tension[:2] = stencils.gathered(stencils.pull(moments, "springs"), self._ends)
        tension[2] = self.twist * secant[2]
        return tension

    def strains(self, d: Float) -> Strains:
        bends = stencils.bends(d[:2], self._ends)
        return self._strains._replace(strain=np.concatenate([bends[0], bends[1], d[2]]))

    @cached_property
    def _strains(self) -> Strains:
        """Bends along x and along y, and twists; without their values."""
        n, ends = self._n, self._ends
        bend = stencils.matrix(lambda r: stencils.bends(stencils.links(r, ends), ends), n, ends)
        twist = stencils.matrix(lambda theta: stencils.links(theta, ends), n, ends)
        matrix = scipy.sparse.block_diag([bend, bend, twist], format="csr")
        stiffness = np.concatenate([self.bend, self.bend, self.twist])
        return Strains(matrix, stiffness, scipy.sparse.csr_array((3 * n, 3 * n)), np.empty(0))

    def stiffness(self, secant: Float, c: Float) -> Float:
        if self._order is not None:
            c = c[:, self._order]
        width, n = len(self._ordered) - 1, self._n
        matrix = np.zeros((width + 1, n), order="F")
        for j, band in enumerate(self._ordered):
            matrix[width - j, j:] = (band[:, j:] * c[:, j:] * c[:, : n - j]).sum(axis=0)
        return matrix

    def bands(self) -> tuple[Float, Float]:
        """grad^2 V by x or y (4, n), and by theta (2, n): [j, i] couples discs i and i + j (modulo n on a ring)."""
        after = self.twist if self._ends == "ring" else np.append(self.twist, 0.0)
        return stencils.bend_bands(self.bend, self._ends), np.array([np.roll(after, 1) + after, -after])

    def hessians(self) -> "tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]":
        """grad^2 V by x or y, and by theta, (n, n)."""
        bending, torsion = (_symmetric(bands) for bands in self.bands())
        return bending, torsion

    @cached_property
    def parameters(self) -> "LinearSprings":
        n, ring = self._n, self._ends == "ring"
        torsion, corner = np.zeros(n + 1), np.zeros(2)
        torsion[1 : n + ring] = self.twist
        torsion[0] = torsion[n]
        hessian, twist = self.bands()
        if self._ends == "consistent":
            corner[:] = hessian[3, [0, n - 4]]
        return LinearSprings(self.bend, torsion, hessian[:3], corner, twist)

    @cached_property
    def _ordered(self) -> Float:
        """The bands in the system's order, (width + 1, 3, n): [j, :, i] couples discs i - j and i; without bands of zeros."""
        place = np.arange(self._n) if self._order is None else np.argsort(self._order)
        found = []
        for rows, bands in zip(([0, 1], [2]), self.bands(), strict=True):
            for j, band in enumerate(bands):
                first = np.flatnonzero(band)
                low, high = np.sort([place[first], place[(first + j) % self._n]], axis=0)
                found += [(high - low, row, high, band[first]) for row in rows]
        ordered = np.zeros((1 + max(int(apart.max(initial=0)) for apart, *_ in found), 3, self._n))
        for apart, row, high, values in found:
            ordered[apart, row, high] = values
        return ordered


def _symmetric(bands: Float) -> "scipy.sparse.csr_array":
    """The matrix (n, n) of bands as `LinearCurvature.bands` returns them."""
    n = bands.shape[1]
    j, first = np.nonzero(bands)
    second, values = (first + j) % n, bands[j, first]
    off = j > 0
    rows, columns = np.append(first, second[off]), np.append(second, first[off])
    return scipy.sparse.csr_array((np.append(values, values[off]), (rows, columns)), shape=(n, n))


class LinearSprings(NamedTuple):
    """Parameters of the compiled form. bend : (n,), stiffness for the change of links at a disc. torsion : (n + 1,), beta/k.

    hessian : (3, n), grad^2 V by x or y: diagonal, i with i + 1, i with i + 2. corner : (2,), 0 with 3 and n - 4 with n - 1.
    twist : (2, n), grad^2 V by theta: diagonal, i with i + 1.
    """

    bend: Float
    torsion: Float
    hessian: Float
    corner: Float
    twist: Float


@fill(do.elastic, LinearSprings)
def _elastic(law: LinearSprings, d: Float) -> float:
    total = 0.0
    for i in range(law.bend.size):
        x, y = d[0, i + 1] - d[0, i], d[1, i + 1] - d[1, i]
        total += law.bend[i] * (x * x + y * y) + law.torsion[i + 1] * d[2, i + 1] ** 2
    return 0.5 * total


@fill(do.tension, LinearSprings)
def _tension(law: LinearSprings, ends: int, before: Float, d: Float, g: Float) -> None:
    n, bend = d.shape[1] - 1, law.bend
    for row in range(2):
        x, to = d[row], g[row]
        # the tension of a link is a difference of the moments bend (d_{i+1} - d_i) of its two discs
        first = bend[0] * (x[1] - x[0])
        to[0] = -first
        for j in range(1, n):
            to[j] = bend[j - 1] * (x[j] - x[j - 1]) - bend[j] * (x[j + 1] - x[j])
        to[n] = bend[n - 1] * (x[n] - x[n - 1])
        fold(ends, to)
    theta, to = d[2], g[2]
    for j in range(n + 1):
        to[j] = law.torsion[j] * theta[j]


@part
def fold(ends: int, to: Float) -> None:
    """Add the tensions of ghost links in `to`, (n + 1,), to the links that define them; see `discs.kernels.slaved`."""
    n = to.size - 1
    if ends == RING:
        to[n] += to[0]
        to[0] = to[n]
    elif ends == GHOST:
        first, last = to[0], to[n]
        to[1] += 3 * first
        to[2] -= 3 * first
        to[3] += first
        to[n - 1] += 3 * last
        to[n - 2] -= 3 * last
        to[n - 3] += last
        to[0], to[n] = 0.0, 0.0


@fill(do.assemble, LinearSprings)
def _assemble(law: LinearSprings, ends: int, before: Float, d: Float, c: Float, one: float, g: float, matrix: Matrix) -> None:
    assemble(law, ends, c, one, g, matrix)
