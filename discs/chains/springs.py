r"""The springs of discs whose headings are slaved to the centre line: two laws of bending, one of torsion.

Strains are the twist of links, (theta_{i+1} - theta_i)/k, and either

* linear curvature: the vectors r''_i, so that V is quadratic and its secant the same for every step; or
* true curvature: the turning of the line at disc i per length, (arg d_i - arg d_{i-1})/k with links d_i = r_{i+1} - r_i, and
  the stretch |d_i|/k - 1. Their secants are exact: with D = d_1 - d_0 and M = (d_0 + d_1)/2,
      arg d_1 - arg d_0 = delta = (delta/sin delta) J M . D/(|d_0||d_1|),   |d_1| - |d_0| = 2 M . D/(|d_0| + |d_1|),
  since the cross product of d_0 and d_1 is that of M and D.

A law has the methods potential (V of links, (3, n_links), rows x, y, theta), secant (mean geometry of a step that changes the
links), tension (mean derivative of V by the links over it) and stiffness (bands of C^T B^T (stiffness) B C, in the system's order).
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import NDArray

from discs.chains import stencils
from discs.chains.chain import Chain
from discs.chains.rolling_discs import Assembly, folded


class LinearCurvature:
    """Bending energy K |r''|**2/2; the secant of a step is its middle links.

    Attributes
    ----------
    bend : (n,), K w/k**4, against `stencils.bends`; zero where there is no spring.
    twist : (n_links,), beta/k, against the difference of theta.
    """

    quadratic = True

    def __init__(self, chain: Chain) -> None:
        self._n, self._ends = chain.n, chain.ends
        stiffness = np.asarray(chain.bending_stiffness) * chain.bend_shares / chain.k**4
        self.bend = np.pad(stiffness, (chain.n - stiffness.size) // 2)
        self.twist = np.asarray(chain.torsion_stiffness) / chain.k
        self._order = folded(chain.n) if chain.ends == "ring" else None

    def potential(self, d: NDArray) -> float:
        return self.polarised(d, d)

    def polarised(self, d: NDArray, other: NDArray) -> float:
        """The symmetric bilinear form of which V is the square."""
        bends, others = stencils.bends(d[:2], self._ends), stencils.bends(other[:2], self._ends)
        return 0.5 * float((self.bend * bends * others).sum() + (self.twist * d[2]) @ other[2])

    def secant(self, d: NDArray, change: NDArray) -> NDArray:
        return d + 0.5 * change

    def tension(self, secant: NDArray) -> NDArray:
        tension = np.empty_like(secant)
        moments = self.bend * stencils.bends(secant[:2], self._ends)
        tension[:2] = stencils.gathered(stencils.pull(moments, "springs"), self._ends)
        tension[2] = self.twist * secant[2]
        return tension

    def stiffness(self, secant: NDArray, c: NDArray) -> NDArray:
        if self._order is not None:
            c = c[:, self._order]
        width, n = len(self._ordered) - 1, self._n
        matrix = np.zeros((width + 1, n), order="F")
        for j, band in enumerate(self._ordered):
            matrix[width - j, j:] = (band[:, j:] * c[:, j:] * c[:, : n - j]).sum(axis=0)
        return matrix

    def bands(self) -> tuple[NDArray, NDArray]:
        """grad^2 V by x or y (4, n), and by theta (2, n): [j, i] couples discs i and i + j, around a ring n and 0 too."""
        after = self.twist if self._ends == "ring" else np.append(self.twist, 0.0)
        return stencils.bend_bands(self.bend, self._ends), np.array([np.roll(after, 1) + after, -after])

    def hessians(self) -> "tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]":
        """grad^2 V by x or y, and by theta, (n, n)."""
        bending, torsion = (_symmetric(bands) for bands in self.bands())
        return bending, torsion

    @cached_property
    def _ordered(self) -> NDArray:
        """The bands in the system's order, (width + 1, 3, n): [j, :, i] couples discs i - j and i; no more than are not zero."""
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


def _symmetric(bands: NDArray) -> "scipy.sparse.csr_array":
    """The matrix, (n, n), of bands as `LinearCurvature.bands` gives them."""
    n = bands.shape[1]
    j, first = np.nonzero(bands)
    second, values = (first + j) % n, bands[j, first]
    off = j > 0
    rows, columns = np.append(first, second[off]), np.append(second, first[off])
    return scipy.sparse.csr_array((np.append(values, values[off]), (rows, columns)), shape=(n, n))


class Line(NamedTuple):
    """Secant of the true curvature: links before and after a step, (3, n_links), and gradients of their angle and length.

    turn, stretch : (2, n_links), the vectors whose product with the change of a link is the change of its angle, length.
    """

    before: NDArray
    after: NDArray
    turn: NDArray
    stretch: NDArray


class TrueCurvature:
    """Bending energy K phi'**2/2 with phi the direction of the line, and stretch energy A (|r'| - 1)**2/2."""

    quadratic = False

    def __init__(self, chain: Chain) -> None:
        n, k = chain.n, chain.k
        self._k, self._ring = k, chain.ends == "ring"
        self._bending = np.asarray(chain.bending_stiffness) * chain.bend_shares
        self._stretching = np.asarray(chain.stretch_stiffness) * k
        self._torsion = np.asarray(chain.torsion_stiffness) * k
        self._first = np.arange(n if self._ring else n - 1)  # a link's first and second disc
        self._second = (self._first + 1) % n
        middle = np.arange(n) if self._ring else np.arange(1, n - 1)
        place = np.argsort(folded(n)) if self._ring else np.arange(n)
        bends = np.stack([place[middle - 1], place[middle], place[(middle + 1) % n]], axis=1)
        self._assembly = Assembly(bends, np.stack([place[self._first], place[self._second]], axis=1))

    def _neighbours(self, values: NDArray) -> tuple[NDArray, NDArray]:
        """Values of links (..., n_links) before and after each bend."""
        return (np.roll(values, 1, axis=-1), values) if self._ring else (values[..., :-1], values[..., 1:])

    def _around(self, values: NDArray) -> tuple[NDArray, NDArray]:
        """Values of bends (n_bends,) at the first and the second disc of each link; zero where there is no bend."""
        at_discs = values if self._ring else np.pad(values, 1)
        return at_discs[self._first], at_discs[self._second]

    def _turning(self, d: NDArray) -> NDArray:
        """Turning per length at the bends, (n_bends,): each less than half a turn."""
        a, b = self._neighbours(d[:2])
        return np.arctan2(a[0] * b[1] - a[1] * b[0], (a * b).sum(axis=0)) / self._k

    def potential(self, d: NDArray) -> float:
        stretch, twist = np.hypot(d[0], d[1]) / self._k - 1, d[2] / self._k
        return 0.5 * float(self._bending @ self._turning(d) ** 2 + self._stretching @ stretch**2 + self._torsion @ twist**2)

    def secant(self, d: NDArray, change: NDArray) -> Line:
        after = d + change
        middle = (d + 0.5 * change)[:2]
        a, b = np.hypot(d[0], d[1]), np.hypot(after[0], after[1])
        across = np.array([-middle[1], middle[0]])
        delta = np.arctan2((across * change[:2]).sum(axis=0), (d[:2] * after[:2]).sum(axis=0))
        # delta/sin(delta), safe at zero; a link that turns by half a turn in one step has no mean direction
        return Line(d, after, across / (np.sinc(delta / np.pi) * a * b), 2 * middle / (a + b))

    def tension(self, secant: Line) -> NDArray:
        before, after, turn, stretch = secant
        moment = self._bending * 0.5 * (self._turning(before) + self._turning(after))
        length = 0.5 * (np.hypot(before[0], before[1]) + np.hypot(after[0], after[1]))
        tension = np.empty_like(before)
        before_bend, after_bend = self._around(moment)
        tension[:2] = (turn * (before_bend - after_bend) + stretch * (self._stretching * (length / self._k - 1))) / self._k
        tension[2] = self._torsion * 0.5 * (before[2] + after[2]) / self._k**2
        return tension

    def stiffness(self, secant: Line, c: NDArray) -> NDArray:
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
