"""One chain in lanes: its discs cut into LANES segments of equal length, which fill the lanes of `discs.kernels.vectors`.

A recurrence along a chain waits for itself at every disc; eight segments side by side wait once for eight discs.

Order. With `rows` discs to a segment, disc i is at j = i + first: row j % rows of lane j // rows, entry `places` of an array (n',),
n' = LANES rows >= n. The first entries of lane 0, `first` = n' - n of them, belong to no disc; they do not move. Arrays with two
more rows at both ends, (n' + 2 HALO,), hold in them the neighbours of each lane, see `orders.join`. The last rows of each lane
separate it from the next one; what links them is a small system of its own (`discs.kernels.elimination`).
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


class Order(NamedTuple):
    """The order of n discs in lanes. places : (n,), the entries of the discs. inner : (LANES,), 1 but 0 in the first lane.

    left, right : the ends of the chain that it has, range(left, right), of 0 and 1. disc : 0, the first disc.
    """

    n: int
    rows: int
    first: int
    places: NDArray
    inner: NDArray
    left: int = 0
    right: int = 2
    disc: int = 0


class Separators(NamedTuple):
    """The system of the separators: d (3, L), o (4, L) as in `discs.kernels.blocks`, columns (2, 2, L), edge (11,) as in
    `discs.kernels.steered_matrix`. rest : (2, L), its right side. L is LANES for each thread."""

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


def put(order, values, rest=0.0, halo=0, ring=False):
    """Values (..., n) of the discs of a whole chain in lanes, (..., n' + 2 halo), and `rest` elsewhere."""
    n, rows, more = values.shape[-1], order.rows, halo // LANES
    row, lane = np.divmod(np.arange(LANES * (rows + 2 * more)), LANES)
    disc = order.disc + rows * lane + row - more - order.first
    there = (disc >= (-more if ring else 0)) & (disc < (n + more if ring else n))
    return np.ascontiguousarray(np.where(there, values[..., disc % n], rest))


def loaded(order, load):
    """The parameters of a load that is `local`, in lanes: arrays (..., n')."""

    def of_discs(values):
        return put(order, values) if values.size > 0 else np.zeros((*values.shape[:-1], 0))

    own = {name: of_discs(getattr(load, name)) for name in ("constant", "damping", "stiffness", "patterns")}
    return load._replace(**own, spent=np.zeros_like(load.spent))


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


def most(chain, x):
    return orders.most(chain.order, x)


def added(chain, x):
    return orders.added(chain.order, x)


def halted(chain, size):
    return orders.halted(chain.order, size)


@part(_nrt=True)
def tied(n, g, count):
    """Workspace for `count` systems of n separators."""
    kind = np.array([g]).dtype
    d, o, columns = np.zeros((count, 3, n), kind), np.zeros((count, 4, n), kind), np.zeros((count, 2, 2, n), kind)
    return Separators(d, o, columns, np.zeros((count, 11), kind), np.zeros((count, 2, n), kind))


@part
def factor_tied(ring, m, n):
    """Factor the system of n separators, on a ring closed."""
    if ring:
        border(m.d, m.o, m.columns, m.edge)
    else:
        blocks.factor(m.d, m.o, n)


@part
def solve_tied(ring, m, n):
    """Solve it for its right side, in place."""
    if ring:
        solve_border(m.d, m.o, m.columns, m.edge, m.rest)
    else:
        blocks.substitute(m.d, m.o, m.rest, n)


@fill(orders.separators, Order, _nrt=True)
def _separators(order, g, count):
    return tied(LANES, g, count)


@fill(orders.pick, Separators)
def _pick(m, j):
    return Separators(m.d[j], m.o[j], m.columns[j], m.edge[j], m.rest[j])


@fill(orders.present, Order)
def present(order, i):
    return load(order.inner, 0) if i < LANES * order.first else 1.0 + zero()


@fill(orders.record, Order)
def record(order, state, v, energy, slip, spare, q, rates, told):
    for i in range(order.n):
        j = order.places[i]
        for row in range(q.shape[0]):
            q[row, i] = state.hi[row, j] + state.lo[row, j]
        for row in range(rates.shape[0]):
            rates[row, i] = v[row + 2, j]
    told[0], told[1] = orders.added(order, total(energy, spare)), orders.most(order, largest(slip, spare))


@fill(orders.previous, Order)
def _previous(order, v, w):
    return before(v), before(w)


@fill(orders.join, Order)
def _join(order, ring, x):
    end = HALO + LANES * order.rows
    for row in range(x.shape[0]):
        to = x[row]
        for k in range(2):
            store(to, LANES * k, before(load(to, LANES * (order.rows + k))))
            store(to, end + LANES * k, after(load(to, HALO + LANES * k)))
            to[LANES * k], to[end + LANES * (k + 1) - 1] = 0.0, 0.0
        for k in range(2 * ring):  # the two entries before disc 0 too, which may be in the rows above
            to[LANES * (order.first + k)] = to[LANES * (order.rows + k) + LANES - 1]
            to[end + LANES * (k + 1) - 1] = to[HALO + order.places[k]]


@fill(orders.wrap, Order)
def _wrap(order, x):
    for row in range(x.shape[0]):
        to = x[row]
        for k in range(2):
            i = LANES * (order.rows + k)
            store(to, i, after(load(to, LANES * k)))
            to[i + LANES - 1] = to[order.places[k]]


@fill(orders.first_links, Order)
def _first_links(order, ring, shift, x, e, to):
    for row in range(x.shape[0]):
        for i in range(0, LANES * (order.first + 1), LANES):
            to[row, HALO + i] = 0.0
        if ring:
            i, end = LANES * order.first, x.shape[1] - 1
            to[row, HALO + i] = (x[row, i] - x[row, end]) + (e[row, i] - e[row, end]) + shift[row]


@fill(orders.rejoin, Order)
def _rejoin(order, base, move, to):
    i = LANES * order.first
    for row in range(2):
        to[row, HALO + i] = base[row, HALO + i] + (move[row, i] - move[row, move.shape[1] - 1])


@fill(orders.lead, Order)
def _lead(order, m):
    i, end, u, w = LANES * order.first, LANES * order.rows - 1, m.u, m.w
    m.lead[0, i], m.lead[1, i], m.lead[1, i + LANES] = w[end - LANES], u[end], w[end]


@fill(orders.factor_separators, Order)
def _factor_separators(order, ring, m, own, sums, ties):
    for k in range(3):
        store(m.d[k], 0, own[k] - after(sums[k]))
    for k in range(4):
        store(m.o[k], 0, after(ties[k]))
    factor_tied(ring, m, LANES)


@fill(orders.solve_separators, Order)
def _solve_separators(order, ring, m, x, y, at_x, at_y):
    store(m.rest[0], 0, x - after(at_x))
    store(m.rest[1], 0, y - after(at_y))
    solve_tied(ring, m, LANES)
    x, y = load(m.rest[0], 0), load(m.rest[1], 0)
    return x, y, before(x), before(y)
