"""The linear systems of discs with own headings, in lanes: block tridiagonal, blocks of two (roll and turn of a disc).

The last row of each lane separates it from the next one. The others are eliminated downwards, all lanes at once: row i has the
block O_i to row i + 1 and P_i to the separator before it, to begin with only row 0 (on a ring of one chain the row of disc 0).
With L = O_i^T D_i^{-1},

    D_{i+1} -> D_{i+1} - L O_i,   P_{i+1} = -L P_i,   D of the separator before -> D - sum of P_i^T D_i^{-1} P_i.

That leaves the separators. Of one chain they are a block tridiagonal system, closed around a ring, which `discs.kernels.blocks`
solves. Chains side by side have one each, tied to itself on a ring: D -> D + P + P^T; at free ends there is no P.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import blocks
from discs.kernels.abreast import Abreast
from discs.kernels.compiled import fill, part, stub
from discs.kernels.lanes import Order
from discs.kernels.orders import present, previous
from discs.kernels.steered_matrix import border, solve_border
from discs.kernels.vectors import LANES, after, load, store


class Blocks(NamedTuple):
    """A matrix, real or complex, factored in place: d (3, n'), o (4, n') as in `discs.kernels.blocks`, then D^{-1} and L;
    p (4, n'), D^{-1} P, without entries for chains side by side with free ends.

    sums : (3, LANES), of P^T D^{-1} P. ends, links, columns, edge : the separators of
    one chain. rest : (2, LANES), their right side.
    """

    d: NDArray
    o: NDArray
    p: NDArray
    sums: NDArray
    ends: NDArray
    links: NDArray
    columns: NDArray
    edge: NDArray
    rest: NDArray


@part(_nrt=True)
def matrices(order, ring, g, count):
    """Workspace for `count` matrices of zeros, real or complex as g."""
    n, kind = LANES * order.rows, np.array([g]).dtype
    d, o, p = np.zeros((count, 3, n), kind), np.zeros((count, 4, n), kind), np.zeros((count, 4, n * tied(order, ring)), kind)
    sums, ends, links = np.zeros((count, 3, LANES), kind), np.zeros((count, 3, LANES), kind), np.zeros((count, 4, LANES), kind)
    columns, edge, rest = np.zeros((count, 2, 2, LANES), kind), np.zeros((count, 11), kind), np.zeros((count, 2, LANES), kind)
    return Blocks(d, o, p, sums, ends, links, columns, edge, rest)


@part
def pick(m, j):
    """One of `matrices`."""
    return Blocks(m.d[j], m.o[j], m.p[j], m.sums[j], m.ends[j], m.links[j], m.columns[j], m.edge[j], m.rest[j])


@stub
def tied(order, ring):
    """Whether rows are tied to separators."""


@stub
def factor_separators(order, ring, m):
    """Factor the system of the separators, whose blocks D and P are in the last row."""


@stub
def separators(order, ring, m, x, y, at_x, at_y):
    """The solution (x, y) at the separators, for their right side (x, y), of which the lanes after them take (at_x, at_y)."""


@part
def factor(order, ring, m):
    """Factor a matrix, whose entries are d and o; the last block of o ties a lane to the next one."""
    d, o, w, last, bound = m.d, m.o, m.p, LANES * (order.rows - 1), tied(order, ring)
    p, q, r = load(d[0], 0), load(d[1], 0), load(d[2], 0)
    x0, x1, x2, x3 = (
        previous(order, load(o[0], last)),
        previous(order, load(o[2], last)),
        previous(order, load(o[1], last)),
        previous(order, load(o[3], last)),
    )
    s0, s1, s2 = 0.0 * p, 0.0 * p, 0.0 * p
    y0, y1, y2, y3, inner = x0, x1, x2, x3, present(order, 0)
    if order.first > 0:  # disc 0 is further down
        x0, x1, x2, x3 = inner * x0, inner * x1, inner * x2, inner * x3
    for i in range(0, last, LANES):
        if i > 0 and i == LANES * order.first:
            x0, x1, x2, x3 = x0 + (y0 - inner * y0), x1 + (y1 - inner * y1), x2 + (y2 - inner * y2), x3 + (y3 - inner * y3)
        det = 1.0 / (p * r - q * q)
        p, q, r = r * det, -q * det, p * det
        a, b, e, f = load(o[0], i), load(o[1], i), load(o[2], i), load(o[3], i)
        l0, l1, l2, l3 = a * p + e * q, a * q + e * r, b * p + f * q, b * q + f * r
        store(d[0], i, p)
        store(d[1], i, q)
        store(d[2], i, r)
        store(o[0], i, l0)
        store(o[1], i, l1)
        store(o[2], i, l2)
        store(o[3], i, l3)
        if bound:
            z0, z1, z2, z3 = p * x0 + q * x2, p * x1 + q * x3, q * x0 + r * x2, q * x1 + r * x3
            store(w[0], i, z0)
            store(w[1], i, z1)
            store(w[2], i, z2)
            store(w[3], i, z3)
            s0, s1, s2 = s0 + (x0 * z0 + x2 * z2), s1 + (x0 * z1 + x2 * z3), s2 + (x1 * z1 + x3 * z3)
            x0, x1, x2, x3 = -(l0 * x0 + l1 * x2), -(l0 * x1 + l1 * x3), -(l2 * x0 + l3 * x2), -(l2 * x1 + l3 * x3)
        p = load(d[0], i + LANES) - (l0 * a + l1 * e)
        q = load(d[1], i + LANES) - (l0 * b + l1 * f)
        r = load(d[2], i + LANES) - (l2 * b + l3 * f)
    store(d[0], last, p)
    store(d[1], last, q)
    store(d[2], last, r)
    if bound:
        for k, value in enumerate((x0, x1, x2, x3)):
            store(w[k], last, value)
        for k, value in enumerate((s0, s1, s2)):
            store(m.sums[k], 0, value)
    factor_separators(order, ring, m)


@part
def solve(order, ring, m, b):
    """Solve with the factors of `factor`, b (2, n') in place."""
    d, o, w, last, bound = m.d, m.o, m.p, LANES * (order.rows - 1), tied(order, ring)
    roll, turn = b[0], b[1]
    x, y = load(roll, 0), load(turn, 0)
    at_x, at_y = 0.0 * x, 0.0 * y
    for i in range(0, last, LANES):
        store(roll, i, x)
        store(turn, i, y)
        if bound:
            at_x = at_x + (load(w[0], i) * x + load(w[2], i) * y)
            at_y = at_y + (load(w[1], i) * x + load(w[3], i) * y)
        x, y = (
            load(roll, i + LANES) - (load(o[0], i) * x + load(o[1], i) * y),
            load(turn, i + LANES) - (load(o[2], i) * x + load(o[3], i) * y),
        )
    x, y = separators(order, ring, m, x, y, at_x, at_y)
    store(roll, last, x)
    store(turn, last, y)
    p, q = previous(order, x), previous(order, y)
    for i in range(last - LANES, -1, -LANES):
        r, s = load(roll, i), load(turn, i)
        x, y = (
            load(d[0], i) * r + load(d[1], i) * s - (load(o[0], i) * x + load(o[2], i) * y),
            load(d[1], i) * r + load(d[2], i) * s - (load(o[1], i) * x + load(o[3], i) * y),
        )
        if bound:
            x, y = x - (load(w[0], i) * p + load(w[1], i) * q), y - (load(w[2], i) * p + load(w[3], i) * q)
        store(roll, i, x)
        store(turn, i, y)


# One chain


@fill(tied, Order)
def _tied(order, ring):
    return True


@fill(factor_separators, Order)
def _factor_separators(order, ring, m):
    last = LANES * (order.rows - 1)
    for k in range(3):
        store(m.ends[k], 0, load(m.d[k], last) - after(load(m.sums[k], 0)))
    for k, row in enumerate((0, 2, 1, 3)):  # transposed
        store(m.links[k], 0, after(load(m.p[row], last)))
    if ring:
        border(m.ends, m.links, m.columns, m.edge)
    else:
        blocks.factor(m.ends, m.links, LANES)


@fill(separators, Order)
def _separators(order, ring, m, x, y, at_x, at_y):
    store(m.rest[0], 0, x - after(at_x))
    store(m.rest[1], 0, y - after(at_y))
    if ring:
        solve_border(m.ends, m.links, m.columns, m.edge, m.rest)
    else:
        blocks.substitute(m.ends, m.links, m.rest, LANES)
    return load(m.rest[0], 0), load(m.rest[1], 0)


# Chains side by side


@fill(tied, Abreast)
def _tied_abreast(order, ring):
    return ring


@fill(factor_separators, Abreast)
def _factor_last(order, ring, m):
    d, last = m.d, LANES * (order.rows - 1)
    p, q, r = load(d[0], last), load(d[1], last), load(d[2], last)
    if ring:
        s0, s1, s2, x0, x1 = load(m.sums[0], 0), load(m.sums[1], 0), load(m.sums[2], 0), load(m.p[0], last), load(m.p[1], last)
        p, q, r = p - s0 + 2.0 * x0, q - s1 + (x1 + load(m.p[2], last)), r - s2 + 2.0 * load(m.p[3], last)
    det = 1.0 / (p * r - q * q)
    store(d[0], last, r * det)
    store(d[1], last, -q * det)
    store(d[2], last, p * det)


@fill(separators, Abreast)
def _last(order, ring, m, x, y, at_x, at_y):
    d, last = m.d, LANES * (order.rows - 1)
    if ring:
        x, y = x - at_x, y - at_y
    return load(d[0], last) * x + load(d[1], last) * y, load(d[1], last) * x + load(d[2], last) * y
