"""The linear systems of discs with slaved headings: five diagonals, a corner at each consistent end, and a border for rings."""

from typing import NamedTuple

from numpy.typing import NDArray

from discs.kernels import banded
from discs.kernels.compiled import part

PLAIN, GHOST, RING = 0, 1, 2


class Matrix(NamedTuple):
    """A factored matrix: `banded`, and on a ring the columns of the last two discs, which border the others.

    columns : (2, n), solutions for the border. edge : (9,), six entries of the border and the inverse of its Schur complement.
    """

    a: NDArray
    u: NDArray
    w: NDArray
    corner: NDArray
    columns: NDArray
    edge: NDArray


@part
def assemble(law, ends, c, one, g, m):
    """Entries of `one` I + g C^T (grad^2 V) C, for a link law with the bands of grad^2 V."""
    a, u, w, corner = m.a, m.u, m.w, m.corner
    n = a.size
    cx, cy, ct = c[0], c[1], c[2]
    s0, s1, s2 = law.hessian[0], law.hessian[1], law.hessian[2]
    t0, t1 = law.twist[0], law.twist[1]
    for i in range(n):
        a[i] = one + g * (s0[i] * (cx[i] * cx[i] + cy[i] * cy[i]) + t0[i] * (ct[i] * ct[i]))
    for i in range(n - 1):
        u[i] = g * (s1[i] * (cx[i] * cx[i + 1] + cy[i] * cy[i + 1]) + t1[i] * (ct[i] * ct[i + 1]))
    for i in range(n - 2):
        w[i] = g * (s2[i] * (cx[i] * cx[i + 2] + cy[i] * cy[i + 2]))
    u[n - 1], w[n - 2], w[n - 1] = 0.0, 0.0, 0.0
    if ends == RING:
        u[n - 1] = g * (s1[n - 1] * (cx[n - 1] * cx[0] + cy[n - 1] * cy[0]) + t1[n - 1] * (ct[n - 1] * ct[0]))
        w[n - 2] = g * (s2[n - 2] * (cx[n - 2] * cx[0] + cy[n - 2] * cy[0]))
        w[n - 1] = g * (s2[n - 1] * (cx[n - 1] * cx[1] + cy[n - 1] * cy[1]))
    corner[0] = corner[1] = 0
    if ends == GHOST:
        corner[0] = g * (law.corner[0] * (cx[0] * cx[3] + cy[0] * cy[3]))
        corner[1] = g * (law.corner[1] * (cx[n - 4] * cx[n - 1] + cy[n - 4] * cy[n - 1]))


@part
def border(m):
    """Factor the matrix of a ring: the chain without its last two discs, then the border of these two."""
    n = m.a.size
    edge = m.edge
    edge[0], edge[1], edge[2] = m.w[n - 4], m.u[n - 3], m.w[n - 2]  # disc n - 2 with n - 4, n - 3, 0
    edge[3], edge[4], edge[5] = m.w[n - 3], m.u[n - 1], m.w[n - 1]  # disc n - 1 with n - 3, 0, 1
    banded.factor(m.a[: n - 2], m.u[: n - 2], m.w[: n - 2], m.corner)
    first, second = m.columns[0, : n - 2], m.columns[1, : n - 2]
    first[:], second[:] = 0, 0
    first[n - 4] += edge[0]
    first[n - 3] += edge[1]
    first[0] += edge[2]
    second[n - 3] += edge[3]
    second[0] += edge[4]
    second[1] += edge[5]
    banded.substitute(m.a[: n - 2], m.u[: n - 2], m.w[: n - 2], m.corner, m.columns[:, : n - 2])
    x = m.a[n - 2] - (edge[0] * first[n - 4] + edge[1] * first[n - 3] + edge[2] * first[0])
    y = m.u[n - 2] - (edge[0] * second[n - 4] + edge[1] * second[n - 3] + edge[2] * second[0])
    z = m.a[n - 1] - (edge[3] * second[n - 3] + edge[4] * second[0] + edge[5] * second[1])
    det = banded.reciprocal(x * z - y * y)
    edge[6], edge[7], edge[8] = z * det, -y * det, x * det


@part
def factor(chain, m):
    if chain.ends == RING:
        border(m)
    else:
        banded.factor(m.a, m.u, m.w, m.corner)


@part
def solve(chain, m, b):
    if chain.ends != RING:
        banded.substitute(m.a, m.u, m.w, m.corner, b)
        return
    n = b.size
    edge = m.edge
    banded.substitute(m.a[: n - 2], m.u[: n - 2], m.w[: n - 2], m.corner, b[: n - 2])
    x = b[n - 2] - (edge[0] * b[n - 4] + edge[1] * b[n - 3] + edge[2] * b[0])
    y = b[n - 1] - (edge[3] * b[n - 3] + edge[4] * b[0] + edge[5] * b[1])
    x, y = edge[6] * x + edge[7] * y, edge[7] * x + edge[8] * y
    first, second = m.columns[0], m.columns[1]
    for i in range(n - 2):
        b[i] -= first[i] * x + second[i] * y
    b[n - 2], b[n - 1] = x, y
