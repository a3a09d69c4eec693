r"""True curvature: bending energy K phi'**2/2 with phi the direction of the line, and stretch energy A (|r'| - 1)**2/2.

Strains are the turning of the line at disc i per length, (arg d_i - arg d_{i-1})/k with links d_i = r_{i+1} - r_i, and the stretch
|d_i|/k - 1. Their secants are exact: with D = d_1 - d_0 and M = (d_0 + d_1)/2,

    arg d_1 - arg d_0 = delta = (delta/sin delta) J M . D/(|d_0||d_1|),   |d_1| - |d_0| = 2 M . D/(|d_0| + |d_1|),

since d_0 x d_1 = M x D. The ends have no bending spring: the natural condition is phi' = 0.
"""

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Complex, Float
from discs.arrays import Matrix as SparseMatrix
from discs.chains import stencils
from discs.chains.links.law import LinkLaw
from discs.chains.rolling_discs import Assembly, Strains, folded
from discs.kernels import protocol as do
from discs.kernels.compiled import fill, part
from discs.kernels.slaved_matrix import RING, Matrix

if TYPE_CHECKING:
    from discs.chains.chain import Chain


class Line(NamedTuple):
    """Secant of the true curvature: links before and after a step, (3, n_links), and gradients of their angle and length.

    turn, stretch : (2, n_links), vectors; their product with the change of a link is the change of its angle and of its length.
    """

    before: Float
    after: Float
    turn: Float
    stretch: Float


class TrueCurvature(LinkLaw):
    """Bending energy K (phi' - rest)**2/2 with phi the direction of the line, and stretch energy A (|r'| - 1)**2/2.

    rest : the rest curvature, (n_bends,).
    """

    name = "true"
    quadratic, end_bends, stretches, directed = False, False, True, True

    @staticmethod
    def density(bending: Float, stretching: Float, z: Complex, z1: Complex) -> Float:
        turning = (z.conj() * z1).imag / np.abs(z) ** 2 if np.any(bending) else 0.0
        density: Float = bending * turning**2 + stretching * (np.abs(z) - 1) ** 2
        return density

    def __init__(self, chain: "Chain", rest: Float | float = 0.0) -> None:
        n, k = chain.n, chain.k
        self._rest, self._k, self._ring = rest, k, chain.ends == "ring"
        self._n, self._ends = n, chain.ends
        self._bending = np.asarray(chain.bending_stiffness) * chain.bend_shares
        self._stretching = np.asarray(chain.stretch_stiffness) * k
        self._torsion = np.asarray(chain.torsion_stiffness) * k
        self._first = np.arange(n if self._ring else n - 1)  # a link's first and second disc
        self._second = (self._first + 1) % n
        middle = np.arange(n) if self._ring else np.arange(1, n - 1)
        place = np.argsort(folded(n)) if self._ring else np.arange(n)
        bends = np.stack([place[middle - 1], place[middle], place[(middle + 1) % n]], axis=1)
        self._assembly = Assembly(bends, np.stack([place[self._first], place[self._second]], axis=1))

    def _neighbours(self, values: Float) -> tuple[Float, Float]:
        """Values of links (..., n_links) before and after each bend."""
        return (np.roll(values, 1, axis=-1), values) if self._ring else (values[..., :-1], values[..., 1:])

    def _around(self, values: Float) -> tuple[Float, Float]:
        """Values of bends (n_bends,) at the first and the second disc of each link; zero where there is no bend."""
        at_discs = values if self._ring else np.pad(values, 1)
        return at_discs[self._first], at_discs[self._second]

    def _turning(self, d: Float) -> Float:
        """Curvature at the bends, (n_bends,), from turns of less than 180 degrees."""
        a, b = self._neighbours(d[:2])
        turned: Float = np.arctan2(a[0] * b[1] - a[1] * b[0], (a * b).sum(axis=0)) / self._k
        return turned

    def potential(self, d: Float) -> float:
        stretch, twist = np.hypot(d[0], d[1]) / self._k - 1, d[2] / self._k
        bend = self._turning(d) - self._rest
        return 0.5 * float(self._bending @ bend**2 + self._stretching @ stretch**2 + self._torsion @ twist**2)

    def energies(self, d: Float) -> dict[str, float]:
        bending, torsion = self._bending @ (self._turning(d) - self._rest) ** 2, self._torsion @ (d[2] / self._k) ** 2
        stretch = self._stretching @ (np.hypot(d[0], d[1]) / self._k - 1) ** 2
        return {"bending": 0.5 * float(bending), "torsion": 0.5 * float(torsion), "stretch": 0.5 * float(stretch)}

    def polarised(self, d: Float, other: Float) -> float:
        raise ValueError("V is not quadratic with curvature='true'")

    def secant(self, d: Float, change: Float) -> Line:
        after = d + change
        middle = (d + 0.5 * change)[:2]
        a, b = np.hypot(d[0], d[1]), np.hypot(after[0], after[1])
        across = np.array([-middle[1], middle[0]])
        delta = np.arctan2((across * change[:2]).sum(axis=0), (d[:2] * after[:2]).sum(axis=0))
        # delta/sin(delta), safe at zero; a link that turns by half a turn in one step has no mean direction
        return Line(d, after, across / (np.sinc(delta / np.pi) * a * b), 2 * middle / (a + b))

    def tension(self, secant: Line) -> Float:
        before, after, turn, stretch = secant
        moment = self._bending * (0.5 * (self._turning(before) + self._turning(after)) - self._rest)
        length = 0.5 * (np.hypot(before[0], before[1]) + np.hypot(after[0], after[1]))
        tension = np.empty_like(before)
        before_bend, after_bend = self._around(moment)
        tension[:2] = (turn * (before_bend - after_bend) + stretch * (self._stretching * (length / self._k - 1))) / self._k
        tension[2] = self._torsion * 0.5 * (before[2] + after[2]) / self._k**2
        return tension

    def strains(self, d: Float) -> Strains:
        """With grad arg d = J d/|d|^2 and grad |d| = d/|d|; their second derivatives are in the directions of both.

        d^2 arg = -(J d d^T + d (J d)^T)/|d|^4 and d^2 |d| = J d (J d)^T/|d|^3.
        """
        n, k, length = self._n, self._k, np.hypot(d[0], d[1])
        along = d[:2] / length
        across = np.array([-along[1], along[0]])
        link = stencils.matrix(lambda r: stencils.links(r, self._ends), n, self._ends)
        matrix = self.strain_matrix(across / length, along)
        stiffness = np.concatenate([self._bending, self._stretching, self._torsion])
        first, second = self._around(self._bending * (self._turning(d) - self._rest) / k)
        turning, stretching = (second - first) / length**2, self._stretching * (length / k - 1) / (k * length)
        parts = [
            [turning * (across[a] * along[b] + along[a] * across[b]) + stretching * across[a] * across[b] for b in (0, 1)]
            for a in (0, 1)
        ]
        blocks = [[link.T @ scipy.sparse.diags_array(part) @ link for part in row] for row in parts]
        bent = scipy.sparse.block_diag([scipy.sparse.block_array(blocks), 0 * blocks[0][0]], format="csr")
        strain = np.concatenate([self._turning(d) - self._rest, length / k - 1, d[2] / k])
        return Strains(matrix, stiffness, bent, strain)

    def strain_matrix(self, turn: Float, stretch: Float) -> SparseMatrix:
        """B, sparse (springs, 3 n), for gradients of the angles and lengths of links, both (2, n_links)."""
        link = stencils.matrix(lambda r: stencils.links(r, self._ends), self._n, self._ends)
        none = scipy.sparse.csr_array(link.shape)
        angle, longer = (
            scipy.sparse.hstack([*(scipy.sparse.diags_array(a) @ link for a in u), none], format="csr") for u in (turn, stretch)
        )
        number: Any = np.arange(turn.shape[1])
        before, after = self._neighbours(number)
        parts = [angle[after] - angle[before], longer, scipy.sparse.hstack([none, none, link])]
        return scipy.sparse.vstack(parts, format="csr") / self._k

    def stiffness(self, secant: Line, c: Float) -> Float:
        """Bends join a disc with its two neighbours, links join two discs."""
        k, sides = self._k, (self._first, self._second)
        turn = [(secant.turn * c[:2, disc]).sum(axis=0) / k for disc in sides]
        (before_first, after_first), (before_second, after_second) = (self._neighbours(t) for t in turn)
        bends = np.stack([before_first, -before_second - after_first, after_second], axis=1)[:, None, :]
        links = np.empty((self._first.size, 2, 2))
        for side, (disc, sign) in enumerate(zip(sides, (-1 / k, 1 / k), strict=True)):
            links[:, 0, side] = sign * (secant.stretch * c[:2, disc]).sum(axis=0)
            links[:, 1, side] = sign * c[2, disc]
        stiffness = np.stack([self._stretching, self._torsion], axis=1)
        return self._assembly((bends, self._bending[:, None]), (links, stiffness))

    @cached_property
    def parameters(self) -> "TrueSprings":
        n, ring = self._n, self._ring
        bends, links = slice(None) if ring else slice(1, n - 1), slice(1, n + ring)
        bend, rest, stretch, torsion = np.zeros(n), np.zeros(n), np.zeros(n + 1), np.zeros(n + 1)
        bend[bends], rest[bends] = self._bending, self._rest
        stretch[links], torsion[links] = self._stretching, self._torsion
        stretch[0], torsion[0] = stretch[n], torsion[n]
        return TrueSprings(bend, rest, stretch, torsion, self._k)


class TrueSprings(NamedTuple):
    """Parameters of the compiled form, whose links are those of `discs.kernels.slaved`: link j is before disc j.

    bend : (n,), K times the share of the disc, 0 where there is no bending spring. rest : (n,), the rest curvature.
    stretch, torsion : (n + 1,), A k and beta k of the links, 0 for ghost links.
    """

    bend: Float
    rest: Float
    stretch: Float
    torsion: Float
    k: float


@part
def opening(cross: float, dot: float) -> float:
    """The angle of two vectors over their cross product, arctan(x)/x/dot with x = cross/dot; for small angles by its series."""
    if abs(cross) > 0.1 * dot:
        return math.atan2(cross, dot) / cross
    over = 1 / dot
    x = (cross * over) ** 2
    high = 1 / 9 - x * (1 / 11 - x * (1 / 13 - x * (1 / 15 - x / 17)))
    return over * (1 - x * (1 / 3 - x * (1 / 5 - x * (1 / 7 - x * high))))


@part
def turned(d: Float, i: int) -> float:
    """The angle between the links before and after disc i."""
    ax, ay, bx, by = d[0, i], d[1, i], d[0, i + 1], d[1, i + 1]
    cross, dot = ax * by - ay * bx, ax * bx + ay * by
    return cross * opening(cross, dot) if dot > 0 else math.atan2(cross, dot)


@part
def link(before: Float, d: Float, j: int) -> tuple[float, float, float, float]:
    """Of link j with the middle M = d: w and u of the gradients w J M of its angle and u M of its length, mean length, delta."""
    x, y, ax, ay = d[0, j], d[1, j], before[0, j], before[1, j]
    dx, dy = 2 * (x - ax), 2 * (y - ay)
    bx, by = ax + dx, ay + dy
    lengths, cross = math.sqrt(ax * ax + ay * ay) + math.sqrt(bx * bx + by * by), x * dy - y * dx
    w = opening(cross, ax * bx + ay * by)
    return w, 2 / lengths, 0.5 * lengths, w * cross


@fill(do.elastic, TrueSprings)
def _elastic(law: TrueSprings, d: Float) -> float:
    total = 0.0
    for i in range(law.bend.size):
        length = math.sqrt(d[0, i + 1] * d[0, i + 1] + d[1, i + 1] * d[1, i + 1])
        stretch, twist = length / law.k - 1, d[2, i + 1] / law.k
        total += law.stretch[i + 1] * stretch * stretch + law.torsion[i + 1] * twist * twist
        if law.bend[i] != 0:
            bend = turned(d, i) / law.k - law.rest[i]
            total += law.bend[i] * bend * bend
    return 0.5 * total


@part
def moment(law: TrueSprings, before: Float, turn: Float, i: int) -> Any:
    """The mean moment of disc i over a step in which link j turns by turn[j]; the angle before and after is within (-pi, pi]."""
    if law.bend[i] == 0:
        return 0.0
    start = turned(before, i)
    end = start + (turn[i + 1] - turn[i])
    if end > math.pi:
        end -= 2 * math.pi
    elif end < -math.pi:
        end += 2 * math.pi
    return law.bend[i] * (0.5 * (start + end) / law.k - law.rest[i])


@fill(do.tension, TrueSprings)
def _tension(law: TrueSprings, ends: int, before: Float, d: Float, g: Float) -> None:
    n, per, ring, (x, y, theta), (gx, gy, turn) = d.shape[1] - 1, 1 / law.k, ends == RING, d, g
    links = n + 1 if ring else n
    for j in range(1, links):  # for now w and the pull of the length's gradient, and the turn
        w, u, length, turn[j] = link(before, d, j)
        gx[j], gy[j] = per * w, per * u * law.stretch[j] * (per * length - 1)
    turn[0] = turn[n]
    first = moment(law, before, turn, 0) if ring else 0.0
    last = first
    for j in range(1, links):
        next_ = first if j == n else moment(law, before, turn, j)
        bent, pull = gx[j] * (last - next_), gy[j]
        gx[j], gy[j] = pull * x[j] - bent * y[j], pull * y[j] + bent * x[j]
        last = next_
    for row in range(2):
        if not ring:
            g[row, n] = 0.0
        g[row, 0] = g[row, n]
    for j in range(n + 1):
        turn[j] = per * per * law.torsion[j] * theta[j]


@fill(do.assemble, TrueSprings)
def _assemble(law: TrueSprings, ends: int, before: Float, d: Float, c: Float, one: float, g: float, matrix: Matrix) -> None:
    n, per, ring, (x, y, _), (cx, cy, ct) = d.shape[1] - 1, 1 / law.k, ends == RING, d, c
    a, u, w = matrix.a, matrix.u, matrix.w
    matrix.corner[0] = matrix.corner[1] = 0
    for i in range(n):
        a[i], u[i], w[i] = one, 0.0, 0.0
    last, last_first, last_second = n - 1, 0.0, 0.0  # the turn of the link before by each of its two discs
    for j in range(0 if ring else 1, n + 1 if ring else n):
        i, m = j - 1 if j > 0 else n - 1, j if j < n else 0  # its discs
        turn, pull, _, _ = link(before, d, j)
        turn, pull = per * turn, per * pull
        first, second = turn * (x[j] * cy[i] - y[j] * cx[i]), turn * (x[j] * cy[m] - y[j] * cx[m])
        if j > 0:
            bend, middle = g * law.bend[i], last_second + first
            stretch, twist = g * law.stretch[j], g * per * per * law.torsion[j]
            along, beyond = pull * (x[j] * cx[i] + y[j] * cy[i]), pull * (x[j] * cx[m] + y[j] * cy[m])
            a[last] += bend * last_first * last_first
            u[last] -= bend * last_first * middle
            w[last] += bend * last_first * second
            a[i] += bend * middle * middle + stretch * along * along + twist * ct[i] * ct[i]
            u[i] -= bend * middle * second + stretch * along * beyond + twist * ct[i] * ct[m]
            a[m] += bend * second * second + stretch * beyond * beyond + twist * ct[m] * ct[m]
        last, last_first, last_second = i, first, second
