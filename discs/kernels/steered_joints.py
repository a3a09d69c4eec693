"""What joins discs with their own headings: links (degree 1), or quadratic elements (degree 2) as in `discs.chains.elements`, where
the derivation and the plain twin are.

Each function has a form for both; those for links leave all as it is. Element e has discs 2e, 2e + 1 and 2e + 2 and links 2e + 1
and 2e + 2, whose places in arrays its two strain points take. The middle disc is joined to its two neighbours only. It is
eliminated first, which leaves a block tridiagonal matrix for the even discs.
"""

from typing import NamedTuple

from numpy.typing import NDArray

from discs.chains.elements import SLOPES, VALUES
from discs.kernels.banded import reciprocal
from discs.kernels.compiled import fill, part, stub


class Links(NamedTuple):
    """Parameters of links. first : the link where tiles begin."""

    first: int


class Elements(NamedTuple):
    """Parameters of elements. first : the link where tiles of whole elements begin. slopes, values : (2, 3)."""

    first: int
    slopes: NDArray
    values: NDArray


JOINTS = {1: Links(0), 2: Elements(1, SLOPES, VALUES)}


class Matrix(NamedTuple):
    """The matrix of a step: blocks d (3, n), o (4, n) as in `blocks`, factored in place.

    ends, far, right : (3, ends), (4, elements), (2, ends), for elements: the system of their first and last discs, and its right
    side; empty for links. columns : (2, 2, n), on a ring those of the last disc, which border the others. edge : (11,), two blocks
    of the border and the inverse of its Schur complement.
    """

    d: NDArray
    o: NDArray
    ends: NDArray
    far: NDArray
    right: NDArray
    columns: NDArray
    edge: NDArray


@stub
def sizes(joints, n):
    """(ends, elements), the numbers of discs and elements of the condensed system of n discs; 0 for links."""


@stub
def to_points(joints, d, middle, a, b):
    """Differences d (4, n + 1) and mean headings (n + 1,) of links a to b, in place, at the strain points."""


@stub
def to_links(joints, tension, couple, a, b):
    """The transpose of `to_points`, in place; a couple is half the derivative by a mean heading."""


@stub
def close(joints, tension, couple):
    """Fill in link 0, where tiles do not begin with it: it is the last link, on a ring and, without stiffness, at free ends."""


@stub
def entries(joints, chain, work, c, one, g, m):
    """`steered_matrix.assemble`."""


@stub
def condense(joints, m):
    """Eliminate the middle discs j: d holds D_j^{-1}, o holds L = O D_j^{-1} before them and O^T D_j^{-1} after them.

    Returns the block tridiagonal matrix that is left, (d, o).
    """


@stub
def reduce(joints, m, b):
    """The condensed matrix, and its right side from that of all discs, b (2, n): (d, o, right)."""


@stub
def expand(joints, m, b):
    """All discs b (2, n), in place, from the solution of the condensed system."""


@fill(sizes, Links)
def _no_sizes(joints, n):
    return 0, 0


@fill(to_points, Links)
def _stay(joints, d, middle, a, b):
    pass


@fill(to_links, Links)
def _stay_too(joints, tension, couple, a, b):
    pass


@fill(close, Links)
def _closed(joints, tension, couple):
    pass


@fill(condense, Links)
def _all(joints, m):
    return m.d, m.o


@fill(reduce, Links)
def _all_of(joints, m, b):
    return m.d, m.o, b


@fill(expand, Links)
def _expanded(joints, m, b):
    pass


@fill(sizes, Elements)
def _sizes(joints, n):
    return (n + 1) // 2, n // 2


@part
def whole(links, a, b):
    """The range of first links of elements among links a to b, of `links` places: without link 0, and the last one at free ends."""
    return max(a, 1), min(b, (links - 1) // 2 * 2)


@fill(to_points, Elements)
def _to_points(joints, d, middle, a, b):
    a, b = whole(middle.size, a, b)
    near, far = joints.slopes[1, 2], joints.slopes[0, 2]
    for j in range(a, b, 2):
        first, second = middle[j], middle[j + 1]
        bent = (d[3, j + 1] - d[3, j]) / 12
        middle[j], middle[j + 1] = near * first + far * second - bent, far * first + near * second - bent
        for row in range(4):
            first, second = d[row, j], d[row, j + 1]
            d[row, j], d[row, j + 1] = near * first + far * second, far * first + near * second


@fill(to_links, Elements)
def _to_links(joints, tension, couple, a, b):
    a, b = whole(couple.size, a, b)
    near, far = joints.slopes[1, 2], joints.slopes[0, 2]
    for j in range(a, b, 2):
        for row in range(4):
            first, second = tension[row, j], tension[row, j + 1]
            tension[row, j], tension[row, j + 1] = near * first + far * second, far * first + near * second
        first, second = couple[j], couple[j + 1]
        bent = (first + second) / 6
        tension[3, j] += bent
        tension[3, j + 1] -= bent
        couple[j], couple[j + 1] = near * first + far * second, far * first + near * second


@fill(close, Elements)
def _close(joints, tension, couple):
    last = couple.size - 1
    couple[0] = couple[last]
    for row in range(4):
        tension[row, 0] = tension[row, last]


@fill(entries, Elements)
def _entries(joints, chain, work, c, one, g, m):
    """work.joined has the entries of B C at a strain point for the three discs: stretch,
    shear and torsion by the roll of a disc, stretch, shear and bending by its turn."""
    n = c.shape[1]
    per = 1 / chain.k
    for i in range(n):
        m.d[0, i], m.d[1, i], m.d[2, i] = one, 0.0, one
    m.o[:] = 0.0
    m.far[:] = 0.0
    k, u = chain.stiffness, work.joined
    for j in range(1, n // 2 * 2 + 1):
        first, p = (j - 1) // 2 * 2, (j - 1) % 2
        ax, ay, bx, by = work.along[0, j], work.along[1, j], work.across[0, j], work.across[1, j]
        for a in range(3):
            i = first + a if first + a < n else 0
            slope, turn = joints.slopes[p, a], joints.values[p, a] * c[3, i]
            x, y = slope * c[0, i], slope * c[1, i]
            u[a, 0], u[a, 1], u[a, 2] = ax * x + ay * y, ax * y - ay * x, slope * c[2, i] * per
            u[a, 3], u[a, 4], u[a, 5] = bx * turn, by * turn, slope * c[3, i] * per
        for a in range(3):
            stretch, shear, twist = g * k[0, j] * u[a, 0], g * k[1, j] * u[a, 1], g * k[2, j] * u[a, 2]
            bent, cut, bend = g * k[0, j] * u[a, 3], g * k[1, j] * u[a, 4], g * k[3, j] * u[a, 5]
            for b in range(a, 3):
                roll = stretch * u[b, 0] + shear * u[b, 1] + twist * u[b, 2]
                roll_turn, turn_roll = stretch * u[b, 3] + shear * u[b, 4], bent * u[b, 0] + cut * u[b, 1]
                turn = bent * u[b, 3] + cut * u[b, 4] + bend * u[b, 5]
                if a == b:
                    i = first + a if first + a < n else 0
                    m.d[0, i] += roll
                    m.d[1, i] += roll_turn
                    m.d[2, i] += turn
                else:
                    to, i = (m.far, first // 2) if b - a == 2 else (m.o, first + a)
                    to[0, i] += roll
                    to[1, i] += roll_turn
                    to[2, i] += turn_roll
                    to[3, i] += turn


@fill(condense, Elements)
def _condense(joints, m):
    n = m.d.shape[1]
    for row in range(3):
        for e in range(m.ends.shape[1]):
            m.ends[row, e] = m.d[row, 2 * e]
    for e in range(n // 2):
        i, j = 2 * e, 2 * e + 1
        to = e + 1 if j + 1 < n else 0
        p, q, r = m.d[0, j], m.d[1, j], m.d[2, j]
        det = reciprocal(p * r - q * q)
        p, q, r = r * det, -q * det, p * det
        m.d[0, j], m.d[1, j], m.d[2, j] = p, q, r
        a0, a1, a2, a3 = m.o[0, i], m.o[1, i], m.o[2, i], m.o[3, i]
        b0, b1, b2, b3 = m.o[0, j], m.o[2, j], m.o[1, j], m.o[3, j]  # transposed: rows of the last disc of the element
        x0, x1, x2, x3 = a0 * p + a1 * q, a0 * q + a1 * r, a2 * p + a3 * q, a2 * q + a3 * r
        y0, y1, y2, y3 = b0 * p + b1 * q, b0 * q + b1 * r, b2 * p + b3 * q, b2 * q + b3 * r
        m.o[0, i], m.o[1, i], m.o[2, i], m.o[3, i] = x0, x1, x2, x3
        m.o[0, j], m.o[1, j], m.o[2, j], m.o[3, j] = y0, y1, y2, y3
        m.ends[0, e] -= x0 * a0 + x1 * a1
        m.ends[1, e] -= x0 * a2 + x1 * a3
        m.ends[2, e] -= x2 * a2 + x3 * a3
        m.ends[0, to] -= y0 * b0 + y1 * b1
        m.ends[1, to] -= y0 * b2 + y1 * b3
        m.ends[2, to] -= y2 * b2 + y3 * b3
        m.far[0, e] -= x0 * b0 + x1 * b1
        m.far[1, e] -= x0 * b2 + x1 * b3
        m.far[2, e] -= x2 * b0 + x3 * b1
        m.far[3, e] -= x2 * b2 + x3 * b3
    return m.ends, m.far


@fill(reduce, Elements)
def _reduce(joints, m, b):
    n, right = b.shape[1], m.right
    for row in range(2):
        for e in range(right.shape[1]):
            right[row, e] = b[row, 2 * e]
    for e in range(n // 2):
        i, j = 2 * e, 2 * e + 1
        to = e + 1 if j + 1 < n else 0
        x, y = b[0, j], b[1, j]
        right[0, e] -= m.o[0, i] * x + m.o[1, i] * y
        right[1, e] -= m.o[2, i] * x + m.o[3, i] * y
        right[0, to] -= m.o[0, j] * x + m.o[1, j] * y
        right[1, to] -= m.o[2, j] * x + m.o[3, j] * y
    return m.ends, m.far, right


@fill(expand, Elements)
def _expand(joints, m, b):
    n, right = b.shape[1], m.right
    for e in range(n // 2):
        i, j = 2 * e, 2 * e + 1
        to = e + 1 if j + 1 < n else 0
        x, y = b[0, j], b[1, j]
        u, v, w, z = right[0, e], right[1, e], right[0, to], right[1, to]
        b[0, j] = m.d[0, j] * x + m.d[1, j] * y - (m.o[0, i] * u + m.o[2, i] * v) - (m.o[0, j] * w + m.o[2, j] * z)
        b[1, j] = m.d[1, j] * x + m.d[2, j] * y - (m.o[1, i] * u + m.o[3, i] * v) - (m.o[1, j] * w + m.o[3, j] * z)
    for row in range(2):
        for e in range(right.shape[1]):
            b[row, 2 * e] = right[row, e]
