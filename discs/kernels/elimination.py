r"""The linear systems of discs with slaved headings, in lanes of one chain: symmetric and pentadiagonal.

The last two rows of each segment separate it from the next one. The others are eliminated downwards, all lanes at
once: row i has couplings u to row i + 1, w to row i + 2, and p, q to the two separators before its segment (to begin with only rows
0 and 1). That leaves the separators, a block tridiagonal system of eight 2 x 2 blocks, closed around a ring (a Schur complement):

    D_l -> D_l - sum over rows of l + 1 of (p, q)^T (p, q)/a,   K_l = the couplings p, q of the separators of l to those of l - 1,

which `discs.kernels.blocks` solves. Corners of consistent ends are eliminated before all else, with the end discs.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import orders
from discs.kernels.compiled import fill, part
from discs.kernels.lanes import Order
from discs.kernels.parts import Part
from discs.kernels.vectors import LANES, load, store

ONE = Order, Part
LEAD = LANES + 1  # rows that may be coupled around a ring


class Matrix(NamedTuple):
    """A factored matrix, real or complex, (n',) in lanes: 1/a, u/a, w/a, p/a, q/a.

    lead : (2, LANES LEAD), couplings around a ring, 0 elsewhere. corner : (2,). ends : (2, 4), multipliers and reciprocal pivots of
    the end discs. joints : of the separators.
    """

    a: NDArray
    u: NDArray
    w: NDArray
    p: NDArray
    q: NDArray
    lead: NDArray
    corner: NDArray
    ends: NDArray
    joints: Any


@fill(orders.matrices, *ONE, _nrt=True)
def _matrices(order, g, count):
    n, kind = LANES * order.rows, np.array([g]).dtype
    a, u, w, p, q = np.zeros((5, count, n), kind)
    lead, corner, ends = np.zeros((count, 2, LANES * LEAD), kind), np.zeros((count, 2), kind), np.zeros((count, 2, 4), kind)
    return Matrix(a, u, w, p, q, lead, corner, ends, orders.separators(order, g, count))


@fill(orders.pick, Matrix)
def _pick(m, j):
    return Matrix(m.a[j], m.u[j], m.w[j], m.p[j], m.q[j], m.lead[j], m.corner[j], m.ends[j], orders.pick(m.joints, j))


@part
def eliminate_ends(order, m):
    """Eliminate the end discs of a chain with corners; they are then coupled to none."""
    a, u, w = m.a, m.u, m.w
    for end in range(order.left, order.right):
        # places of four discs from the end inwards, and of the entries that couple them
        e, f, g, h = (0, 1, 2, 3) if end == 0 else (order.n - 1, order.n - 2, order.n - 3, order.n - 4)
        e, f, g, h = order.places[e], order.places[f], order.places[g], order.places[h]
        ef, fg, gh, eg, fh = (e, f, g, e, f) if end == 0 else (f, g, h, g, h)
        first, second, third, top = u[ef], w[eg], m.corner[end], 1 / a[e]
        m.ends[end, 0], m.ends[end, 1], m.ends[end, 2], m.ends[end, 3] = first * top, second * top, third * top, top
        a[f] -= first * top * first
        u[fg] -= first * top * second
        w[fh] -= first * top * third
        a[g] -= second * top * second
        u[gh] -= second * top * third
        a[h] -= third * top * third
        a[e], u[ef], w[eg] = 1.0, 0.0, 0.0


@fill(orders.factor, *ONE)
def _factor(order, ring, ghosts, m):
    if ghosts:
        eliminate_ends(order, m)
    a, u, w, lead, last = m.a, m.u, m.w, m.lead, LANES * (order.rows - 1)
    if ring:
        orders.lead(order, m)
    # the couplings of the first rows to the separators before them: those of the lane before
    inner, (w0, u0), (w1, _) = (
        load(order.inner, 0),
        orders.previous(order, load(w, last - LANES), load(u, last)),
        orders.previous(order, load(w, last), load(w, last)),
    )
    p0, q0 = load(lead[0], 0) + inner * w0, load(lead[1], 0) + inner * u0
    p1, q1 = load(lead[0], LANES), load(lead[1], LANES) + inner * w1
    a0, u0, a1 = load(a, 0), load(u, 0), load(a, LANES)
    pp, pq, qq = 0.0 * a0, 0.0 * a0, 0.0 * a0
    for row in range(order.rows - 2):
        i = LANES * row
        top, second = 1.0 / a0, load(w, i)
        l1, l2, p, q = u0 * top, second * top, p0 * top, q0 * top
        pp, pq, qq = pp + p * p0, pq + p * q0, qq + q * q0
        p2, q2 = -l2 * p0, -l2 * q0
        if row < LEAD - 2:
            p2, q2 = load(lead[0], i + 2 * LANES) + p2, load(lead[1], i + 2 * LANES) + q2
        p0, q0, p1, q1 = p1 - l1 * p0, q1 - l1 * q0, p2, q2
        store(a, i, top)
        store(u, i, l1)
        store(w, i, l2)
        store(m.p, i, p)
        store(m.q, i, q)
        a0 = a1 - l1 * u0
        u0 = load(u, i + LANES) - l1 * second
        a1 = load(a, i + 2 * LANES) - l2 * second
    orders.factor_separators(order, ring, m.joints, (a0, u0, a1), (pp, pq, qq), (p0, p1, q0, q1))


@fill(orders.solve, *ONE)
def _solve(order, ring, ghosts, m, b):
    n, ends, one, other = order.n, m.ends, order.places[0], order.places[order.n - 1]
    first, last = b[one], b[other]
    if ghosts:
        for end in range(order.left, order.right):
            e, start, way, given = (one, 1, 1, first) if end == 0 else (other, n - 2, -1, last)
            b[e] = 0.0
            for k in range(3):
                b[order.places[start + way * k]] -= ends[end, k] * given
    b0, b1 = load(b, 0), load(b, LANES)
    at_p, at_q = 0.0 * b0, 0.0 * b0
    for row in range(order.rows - 2):
        i = LANES * row
        store(b, i, b0)
        at_p, at_q = at_p + load(m.p, i) * b0, at_q + load(m.q, i) * b0
        b0, b1 = b1 - load(m.u, i) * b0, load(b, i + 2 * LANES) - load(m.w, i) * b0
    x1, x2, p, q = orders.solve_separators(order, ring, m.joints, b0, b1, at_p, at_q)
    store(b, LANES * (order.rows - 2), x1)
    store(b, LANES * (order.rows - 1), x2)
    for row in range(order.rows - 3, -1, -1):
        i = LANES * row
        known = load(b, i) * load(m.a, i) - load(m.p, i) * p - load(m.q, i) * q
        x1, x2 = known - load(m.w, i) * x2 - load(m.u, i) * x1, x1
        store(b, i, x1)
    if ghosts:
        for end in range(order.left, order.right):
            e, start, way, given = (one, 1, 1, first) if end == 0 else (other, n - 2, -1, last)
            b[e] = ends[end, 3] * given
            for k in range(3):
                b[e] -= ends[end, k] * b[order.places[start + way * k]]
