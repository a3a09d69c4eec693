r"""One chain in lanes: its discs cut into LANES segments of equal length, which fill the lanes of `discs.kernels.vectors`.

A recurrence along a chain waits for itself at every disc; eight segments side by side wait once for eight discs.

Order. With `rows` discs to a segment, disc i is at j = i + first: row j % rows of lane j // rows, entry `places` of an array (n',),
n' = LANES rows >= n. The first entries of lane 0, `first` = n' - n of them, belong to no disc; they do not move. Arrays with two
more rows at both ends, (n' + 2 HALO,), hold in them the neighbours of each lane, see `join`.

Linear system. The last two rows of each segment separate it from the next one. The others are eliminated downwards, all lanes at
once: row i has couplings u to row i + 1, w to row i + 2, and p, q to the two separators before its segment (to begin with only rows
0 and 1). That leaves the separators, a block tridiagonal system of eight 2 x 2 blocks, closed around a ring (a Schur complement):

    D_l -> D_l - sum over rows of l + 1 of (p, q)^T (p, q)/a,   K_l = the couplings p, q of the separators of l to those of l - 1,

which `discs.kernels.blocks` solves. Corners of consistent ends are eliminated before all else, with the end discs.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import blocks, orders
from discs.kernels.compiled import fill, part
from discs.kernels.load import Linear
from discs.kernels.shared import disc_by_disc
from discs.kernels.steered_matrix import border, solve_border
from discs.kernels.vectors import LANES, after, before, largest, load, store, total, zero
from discs.skew import Phase

HALO = 2 * LANES
LEAD = LANES + 1  # rows that may be coupled around a ring


class Order(NamedTuple):
    """The order of n discs in lanes. places : (n,), the entries of the discs. inner : (LANES,), 1 but 0 in the first lane."""

    n: int
    rows: int
    first: int
    places: NDArray
    inner: NDArray


class Matrix(NamedTuple):
    """A factored matrix, real or complex, (n',) in lanes: 1/a, u/a, w/a, p/a, q/a.

    lead : (2, LANES LEAD), couplings around a ring, 0 elsewhere. corner : (2,). ends : (2, 4), multipliers and reciprocal pivots of
    the end discs. d, o, columns, edge : of the separators, see `discs.kernels.steered_matrix`. rest : (2, LANES), their right side.
    """

    a: NDArray
    u: NDArray
    w: NDArray
    p: NDArray
    q: NDArray
    lead: NDArray
    corner: NDArray
    ends: NDArray
    d: NDArray
    o: NDArray
    columns: NDArray
    edge: NDArray
    rest: NDArray


def order(n: int) -> Order:
    """The order of n discs."""
    rows = -(-n // LANES)
    first = LANES * rows - n
    j, inner = np.arange(first, n + first), np.ones(LANES)
    inner[0] = 0.0
    return Order(n, rows, first, j % rows * LANES + j // rows, inner)


def local(load):
    """Whether a compiled load acts on each disc by itself, so that it can be put in lanes."""
    return type(load) is Linear and load.viscosity.size == load.bends.rest.size == load.axles.size == 0


def loaded(order, load):
    """The parameters of a load that is `local`, in lanes: arrays (..., n')."""

    def put(values):
        to = np.zeros((*values.shape[:-1], LANES * order.rows * (values.size > 0)))
        if values.size > 0:
            to[..., order.places] = values
        return to

    return load._replace(**{name: put(getattr(load, name)) for name in ("constant", "damping", "stiffness", "patterns")})


# Forms of `discs.kernels.protocol` for chains in this order


def place(chain, i):
    return chain.order.places[i]


def enter(chain, state):
    n, (rows, columns) = LANES * chain.order.rows, (state.hi.shape[0], state.pi.shape[0])
    own = Phase(np.zeros((rows, n)), np.zeros((rows, n)), np.zeros((columns, n)))
    for array, to in ((state.hi, own.hi), (state.lo, own.lo), (state.pi, own.pi)):
        for row in range(array.shape[0]):
            for i in range(array.shape[1]):
                to[row, chain.order.places[i]] = array[row, i]
    return own


def leave(chain, own, state):
    for array, to in ((own.hi, state.hi), (own.lo, state.lo), (own.pi, state.pi)):
        disc_by_disc(chain, array, to)


@fill(orders.matrices, Order, _nrt=True)
def matrices(order, g, count):
    n, kind = LANES * order.rows, np.array([g]).dtype
    a, u, w, p, q = np.zeros((5, count, n), kind)
    lead, corner, ends = np.zeros((count, 2, LANES * LEAD), kind), np.zeros((count, 2), kind), np.zeros((count, 2, 4), kind)
    d, o, rest = np.zeros((count, 3, LANES), kind), np.zeros((count, 4, LANES), kind), np.zeros((count, 2, LANES), kind)
    columns, edge = np.zeros((count, 2, 2, LANES), kind), np.zeros((count, 11), kind)
    return Matrix(a, u, w, p, q, lead, corner, ends, d, o, columns, edge, rest)


@fill(orders.pick, Matrix)
def pick(m, j):
    lead, corner, ends, d, o, columns, edge = m.lead[j], m.corner[j], m.ends[j], m.d[j], m.o[j], m.columns[j], m.edge[j]
    return Matrix(m.a[j], m.u[j], m.w[j], m.p[j], m.q[j], lead, corner, ends, d, o, columns, edge, m.rest[j])


@fill(orders.present, Order)
def _present(order, i):
    return load(order.inner, 0) if i < LANES * order.first else 1.0 + zero()


@fill(orders.record, Order)
def _record(order, state, v, energy, slip, spare, q, rates, told):
    for i in range(order.n):
        j = order.places[i]
        for row in range(q.shape[0]):
            q[row, i] = state.hi[row, j] + state.lo[row, j]
        for row in range(rates.shape[0]):
            rates[row, i] = v[row + 2, j]
    told[0], told[1] = total(energy, spare), largest(slip, spare)


@fill(orders.previous, Order)
def _previous(order, v):
    return before(v)


@fill(orders.join, Order)
def join(order, ring, x):
    end = HALO + LANES * order.rows
    for k in range(2):
        store(x, LANES * k, before(load(x, LANES * (order.rows + k))))
        store(x, end + LANES * k, after(load(x, HALO + LANES * k)))
        x[LANES * k], x[end + LANES * (k + 1) - 1] = 0.0, 0.0
    for k in range(2 * ring):  # the two entries before disc 0 too, which may be in the rows above
        x[LANES * (order.first + k)] = x[LANES * (order.rows + k) + LANES - 1]
        x[end + LANES * (k + 1) - 1] = x[HALO + order.places[k]]


@fill(orders.wrap, Order)
def _wrap(order, x):
    for k in range(2):
        i = LANES * (order.rows + k)
        store(x, i, after(load(x, LANES * k)))
        x[i + LANES - 1] = x[order.places[k]]


@fill(orders.first_links, Order)
def _first_links(order, ring, shift, x, e, to):
    for i in range(0, LANES * (order.first + 1), LANES):
        to[HALO + i] = 0.0
    if ring:
        i, end = LANES * order.first, x.size - 1
        to[HALO + i] = (x[i] - x[end]) + (e[i] - e[end]) + shift


@fill(orders.rejoin, Order)
def _rejoin(order, base, move, to):
    i = LANES * order.first
    to[HALO + i] = base[HALO + i] + (move[i] - move[move.size - 1])


@part
def eliminate_ends(order, m):
    """Eliminate the end discs of a chain with corners; they are then coupled to none."""
    a, u, w = m.a, m.u, m.w
    for end in range(2):
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


@fill(orders.factor, Order)
def factor(order, ring, ghosts, m):
    if ghosts:
        eliminate_ends(order, m)
    a, u, w, lead, d, o, last = m.a, m.u, m.w, m.lead, m.d, m.o, LANES * (order.rows - 1)
    if ring:
        i, end = LANES * order.first, last + LANES - 1
        lead[0, i], lead[1, i], lead[1, i + LANES] = w[end - LANES], u[end], w[end]
    # the couplings of the first rows to the separators before them: those of the lane before
    inner = load(order.inner, 0)
    p0 = load(lead[0], 0) + inner * before(load(w, last - LANES))
    q0 = load(lead[1], 0) + inner * before(load(u, last))
    p1, q1 = load(lead[0], LANES), load(lead[1], LANES) + inner * before(load(w, last))
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
    # what the lanes leave on the separators before them, and the blocks that couple separators of a lane and the next one
    store(d[0], 0, a0 - after(pp))
    store(d[1], 0, u0 - after(pq))
    store(d[2], 0, a1 - after(qq))
    store(o[0], 0, after(p0))
    store(o[1], 0, after(p1))
    store(o[2], 0, after(q0))
    store(o[3], 0, after(q1))
    if ring:
        border(d, o, m.columns, m.edge)
    else:
        blocks.factor(d, o, d.shape[1])


@fill(orders.solve, Order)
def solve(order, ring, ghosts, m, b):
    n, ends, one, other = order.n, m.ends, order.places[0], order.places[order.n - 1]
    first, last = b[one], b[other]
    if ghosts:
        b[one], b[other] = 0.0, 0.0
        for k in range(3):
            b[order.places[k + 1]] -= ends[0, k] * first
            b[order.places[n - 2 - k]] -= ends[1, k] * last
    b0, b1 = load(b, 0), load(b, LANES)
    at_p, at_q = 0.0 * b0, 0.0 * b0
    for row in range(order.rows - 2):
        i = LANES * row
        store(b, i, b0)
        at_p, at_q = at_p + load(m.p, i) * b0, at_q + load(m.q, i) * b0
        b0, b1 = b1 - load(m.u, i) * b0, load(b, i + 2 * LANES) - load(m.w, i) * b0
    store(m.rest[0], 0, b0 - after(at_p))
    store(m.rest[1], 0, b1 - after(at_q))
    if ring:
        solve_border(m.d, m.o, m.columns, m.edge, m.rest)
    else:
        blocks.substitute(m.d, m.o, m.rest, m.d.shape[1])
    x1, x2 = load(m.rest[0], 0), load(m.rest[1], 0)
    p, q = before(x1), before(x2)
    store(b, LANES * (order.rows - 2), x1)
    store(b, LANES * (order.rows - 1), x2)
    for row in range(order.rows - 3, -1, -1):
        i = LANES * row
        known = load(b, i) * load(m.a, i) - load(m.p, i) * p - load(m.q, i) * q
        x1, x2 = known - load(m.w, i) * x2 - load(m.u, i) * x1, x1
        store(b, i, x1)
    if ghosts:
        b[one], b[other] = ends[0, 3] * first, ends[1, 3] * last
        for k in range(3):
            b[one] -= ends[0, k] * b[order.places[k + 1]]
            b[other] -= ends[1, k] * b[order.places[n - 2 - k]]
