"""Several chains of equal numbers of discs in lanes: each lane is a chain, so that lanes are not joined (`discs.kernels.orders`).

Elimination. Rows are eliminated downwards, all lanes at once: row i has couplings u to row i + 1 and w to row i + 2. On a ring the
last two rows separate its ends: the other rows have couplings p, q to these, too, to begin with only rows 0 and 1, and leave

    D -> D - sum over rows of (p, q)^T (p, q)/a + K + K^T,   K = the couplings p, q of the separators to themselves,

a 2 x 2 block. Corners of consistent ends are eliminated before all else, with the end discs.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import orders
from discs.kernels.compiled import fill, part
from discs.kernels.lanes import HALO
from discs.kernels.slaved_matrix import GHOST, RING
from discs.kernels.vectors import LANES, load, store, zero

FEWEST = 8  # discs of chains with consistent ends, whose two corners must not overlap
END = 2.0, -5.0, 4.0, -1.0  # r_-1 - 2 r_0 + r_1 with the ghost disc r_-1 of a consistent end, by its first four discs


class Abreast(NamedTuple):
    """The order of LANES chains of n discs side by side. Disc i of a chain is in row i of its lane: `rows` is n, `first` 0."""

    n: int
    rows: int
    first: int
    ring: bool
    disc: int = 0


class Bands(NamedTuple):
    """A factored matrix, real or complex, (n',): 1/a, u/a, w/a and, of rings, p/a, q/a.

    corner : (2 LANES,). ends : (2, 4 LANES), multipliers and reciprocal pivots of the end discs.
    """

    a: NDArray
    u: NDArray
    w: NDArray
    p: NDArray
    q: NDArray
    corner: NDArray
    ends: NDArray


@fill(orders.matrices, Abreast, _nrt=True)
def _matrices(order, g, count):
    n, kind = LANES * order.rows, np.array([g]).dtype
    a, u, w = np.zeros((3, count, n), kind)
    p, q = np.zeros((2, count, n * order.ring), kind)
    return Bands(a, u, w, p, q, np.zeros((count, 2 * LANES), kind), np.zeros((count, 2, 4 * LANES), kind))


@fill(orders.pick, Bands)
def _pick(m, j):
    return Bands(m.a[j], m.u[j], m.w[j], m.p[j], m.q[j], m.corner[j], m.ends[j])


@fill(orders.previous, Abreast)
def _previous(order, v, w):
    return v, w


@fill(orders.present, Abreast)
def _present(order, i):
    return 1.0


@fill(orders.record, Abreast)
def _record(order, state, v, energy, slip, spare, q, rates, told):
    for row in range(q.shape[0]):
        for i in range(q.shape[1]):
            q[row, i] = state.hi[row, i] + state.lo[row, i]
    for row in range(rates.shape[0]):
        for i in range(rates.shape[1]):
            rates[row, i] = v[row + 2, i]
    for k, value in enumerate((energy, slip)):
        store(spare, 0, value)
        for lane in range(LANES):
            told[LANES * k + lane] = spare[lane]


@fill(orders.join, Abreast)
def _join(order, ring, x):
    end = HALO + LANES * order.rows
    for row in range(x.shape[0]):
        to = x[row]
        for k in range(2):
            store(to, LANES * k, load(to, LANES * (order.rows + k)) if ring else zero())
            store(to, end + LANES * k, load(to, HALO + LANES * k) if ring else zero())


@fill(orders.wrap, Abreast)
def _wrap(order, x):
    for row in range(x.shape[0]):
        to = x[row]
        for k in range(2):
            store(to, LANES * (order.rows + k), load(to, LANES * k))


@fill(orders.first_links, Abreast)
def _first_links(order, ring, shift, x, e, to):
    for row in range(x.shape[0]):
        store(to[row], HALO, load(to[row], HALO) + load(shift[row], 0) if ring else zero())


@fill(orders.rejoin, Abreast)
def _rejoin(order, base, move, to):
    pass  # as `previous` has the last disc


@fill(orders.close_links, Abreast)
def _close_links(order, ends, x):
    first, last, end = HALO, HALO + LANES * (order.rows - 1), HALO + LANES * order.rows
    for axis in range(2):
        to = x[axis]
        if ends == RING:
            store(to, end, load(to, first))
        elif ends == GHOST:
            for at, way in ((first, LANES), (end, -LANES)):
                store(to, at, 3.0 * (load(to, at + way) - load(to, at + 2 * way)) + load(to, at + 3 * way))
        else:
            store(to, first, 2.0 * load(to, first + LANES) - load(to, first + 2 * LANES))
            store(to, end, 2.0 * load(to, last) - load(to, last - LANES))


@fill(orders.pull_ends, Abreast)
def _pull_ends(order, springs, base, half, c, g):
    last = LANES * (order.rows - 1)
    for end in range(2):
        start, way, sign = (0, LANES, 1.0) if end == 0 else (last, -LANES, -1.0)
        for axis in range(2):
            force = sign * load(springs, LANES * end) * end_moment(base[axis], half[axis], start, end)
            for k in range(4):
                i = start + way * k
                store(g, i, load(g, i) + END[k] * load(c[axis], i) * force)


@fill(orders.bend_ends, Abreast)
def _bend_ends(order, springs, base, still):
    energy, last = zero(), LANES * (order.rows - 1)
    for end in range(2):
        for axis in range(2):
            moment = end_moment(base[axis], still[axis], 0 if end == 0 else last, end)
            energy = energy + load(springs, LANES * end) * (moment * moment)
    return energy


@part
def end_moment(base, half, start, end):
    """The change of links at a consistent end after the move `half`, away from disc `start`, (times -1 at the last end)."""
    way, near = (LANES, LANES) if end == 0 else (-LANES, 0)  # a link is in the row of the disc after it
    i = HALO + start + near
    return -2.0 * link(base, half, i) + 3.0 * link(base, half, i + way) - link(base, half, i + 2 * way)


@part
def link(base, half, i):
    return load(base, i) + (load(half, i) - load(half, i - LANES))


@fill(orders.corners, Abreast)
def _corners(order, given, g, c, to):
    x, y, last = c[0], c[1], LANES * (order.rows - 4)
    for end, i in ((0, 0), (1, last)):
        j = i + 3 * LANES
        store(to, LANES * end, g * load(given, LANES * end) * (load(x, i) * load(x, j) + load(y, i) * load(y, j)))


@part
def eliminate_ends(order, m):
    """Eliminate the end discs of chains with corners; they are then coupled to none."""
    a, u, w, none, last = m.a, m.u, m.w, 0.0 * load(m.a, 0), LANES * (order.rows - 1)
    for end in range(2):
        # rows of four discs from the end inwards, and of the entries that couple them
        way = LANES if end == 0 else -LANES
        e = 0 if end == 0 else last
        f, g, h = e + way, e + 2 * way, e + 3 * way
        ef, fg, gh, eg, fh = (e, f, g, e, f) if end == 0 else (f, g, h, g, h)
        top = 1.0 / load(a, e)
        first, second, third, to = load(u, ef), load(w, eg), load(m.corner, LANES * end), m.ends[end]
        store(to, 0, first * top)
        store(to, LANES, second * top)
        store(to, 2 * LANES, third * top)
        store(to, 3 * LANES, top)
        store(a, f, load(a, f) - first * top * first)
        store(u, fg, load(u, fg) - first * top * second)
        store(w, fh, load(w, fh) - first * top * third)
        store(a, g, load(a, g) - second * top * second)
        store(u, gh, load(u, gh) - second * top * third)
        store(a, h, load(a, h) - third * top * third)
        for lane in range(LANES):
            a[e + lane] = 1.0
        store(u, ef, none)
        store(w, eg, none)


@fill(orders.factor, Abreast)
def _factor(order, ring, ghosts, m):
    if ghosts:
        eliminate_ends(order, m)
    a, u, w, last = m.a, m.u, m.w, LANES * (order.rows - 1)
    a0, u0, a1 = load(a, 0), load(u, 0), load(a, LANES)
    none = 0.0 * a0
    p0, q0, p1, q1, pp, pq, qq = none, none, none, none, none, none, none
    if ring:
        p0, q0, q1 = load(w, last - LANES), load(u, last), load(w, last)
    for i in range(0, last - LANES, LANES):
        top, second = 1.0 / a0, load(w, i)
        l1, l2 = u0 * top, second * top
        store(a, i, top)
        store(u, i, l1)
        store(w, i, l2)
        if ring:
            p, q = p0 * top, q0 * top
            store(m.p, i, p)
            store(m.q, i, q)
            pp, pq, qq = pp + p * p0, pq + p * q0, qq + q * q0
            p0, q0, p1, q1 = p1 - l1 * p0, q1 - l1 * q0, -l2 * p0, -l2 * q0
        a0 = a1 - l1 * u0
        u0 = load(u, i + LANES) - l1 * second
        a1 = load(a, i + 2 * LANES) - l2 * second
    if ring:
        a0, u0, a1 = a0 - pp + 2.0 * p0, u0 - pq + q0 + p1, a1 - qq + 2.0 * q1
    top = 1.0 / a0
    store(a, last - LANES, top)
    store(u, last - LANES, u0 * top)
    store(a, last, 1.0 / (a1 - u0 * top * u0))


@fill(orders.solve, Abreast)
def _solve(order, ring, ghosts, m, b):
    last = LANES * (order.rows - 1)
    first_end, last_end = load(b, 0), load(b, last)
    if ghosts:
        for end in range(2):
            e, way, given = (0, LANES, first_end) if end == 0 else (last, -LANES, last_end)
            store(b, e, 0.0 * given)
            for k in range(3):
                i = e + way * (k + 1)
                store(b, i, load(b, i) - load(m.ends[end], LANES * k) * given)
    b0, b1 = load(b, 0), load(b, LANES)
    at_p, at_q = 0.0 * b0, 0.0 * b0
    for i in range(0, last - LANES, LANES):
        store(b, i, b0)
        if ring:
            at_p, at_q = at_p + load(m.p, i) * b0, at_q + load(m.q, i) * b0
        b0, b1 = b1 - load(m.u, i) * b0, load(b, i + 2 * LANES) - load(m.w, i) * b0
    b0, b1 = b0 - at_p, b1 - at_q
    across = load(m.u, last - LANES)
    x2 = (b1 - across * b0) * load(m.a, last)
    x1 = b0 * load(m.a, last - LANES) - across * x2
    p, q = x1, x2
    store(b, last - LANES, x1)
    store(b, last, x2)
    for i in range(last - 2 * LANES, -1, -LANES):
        known = load(b, i) * load(m.a, i)
        if ring:
            known = known - load(m.p, i) * p - load(m.q, i) * q
        x1, x2 = known - load(m.w, i) * x2 - load(m.u, i) * x1, x1
        store(b, i, x1)
    if ghosts:
        for end in range(2):
            e, way, given = (0, LANES, first_end) if end == 0 else (last, -LANES, last_end)
            found = load(m.ends[end], 3 * LANES) * given
            for k in range(3):
                found = found - load(m.ends[end], LANES * k) * load(b, e + way * (k + 1))
            store(b, e, found)
