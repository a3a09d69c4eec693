"""The linear systems of discs with own headings, in lanes: block tridiagonal, blocks of two (roll and turn of a disc).

The last row of each lane separates it from the next one. The others are eliminated downwards, all lanes at once: row i has the
block O_i to row i + 1 and P_i to the separator before it, to begin with only row 0 (on a ring of one chain the row of disc 0).
With L = O_i^T D_i^{-1},

    D_{i+1} -> D_{i+1} - L O_i,   P_{i+1} = -L P_i,   D of the separator before -> D - sum of P_i^T D_i^{-1} P_i.

That leaves the separators. Of one chain they are a block tridiagonal system, closed around a ring, which `discs.kernels.blocks`
solves. Chains side by side have one each, tied to itself on a ring: D -> D + P + P^T; at free ends there is no P.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import orders
from discs.kernels.abreast import Abreast
from discs.kernels.compiled import fill, part, stub
from discs.kernels.lanes import Order
from discs.kernels.orders import present, previous
from discs.kernels.parts import Part
from discs.kernels.vectors import LANES, load, store


class Blocks(NamedTuple):
    """A matrix, real or complex, factored in place: d (3, n'), o (4, n') as in `discs.kernels.blocks`, then D^{-1} and L;
    p (4, n'), D^{-1} P, without entries for chains side by side with free ends.

    joints : of the separators of one chain.
    """

    d: NDArray
    o: NDArray
    p: NDArray
    joints: Any


@part(_nrt=True)
def matrices(order, ring, g, count):
    """Workspace for `count` matrices of zeros, real or complex as g."""
    n, kind = LANES * order.rows, np.array([g]).dtype
    d, o, p = np.zeros((count, 3, n), kind), np.zeros((count, 4, n), kind), np.zeros((count, 4, n * tied(order, ring)), kind)
    return Blocks(d, o, p, orders.separators(order, g, count))


@part
def pick(m, j):
    """One of `matrices`."""
    return Blocks(m.d[j], m.o[j], m.p[j], orders.pick(m.joints, j))


@stub
def tied(order, ring):
    """Whether rows are tied to separators."""


@part
def factor(order, ring, m):
    """Factor a matrix, whose entries are d and o; the last block of o ties a lane to the next one."""
    d, o, w, last, bound = m.d, m.o, m.p, LANES * (order.rows - 1), tied(order, ring)
    p, q, r = load(d[0], 0), load(d[1], 0), load(d[2], 0)
    x0, x1 = previous(order, load(o[0], last), load(o[2], last))
    x2, x3 = previous(order, load(o[1], last), load(o[3], last))
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
    orders.factor_separators(order, ring, m.joints, (p, q, r), (s0, s1, s2), (x0, x2, x1, x3))  # P transposed


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
    x, y, p, q = orders.solve_separators(order, ring, m.joints, x, y, at_x, at_y)
    store(roll, last, x)
    store(turn, last, y)
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


@fill(tied, Order, Part)
def _tied(order, ring):
    return True


# Chains side by side


@fill(tied, Abreast)
def _tied_abreast(order, ring):
    return ring


class Last(NamedTuple):
    """The inverse of the block of the last row of chains side by side, d (3, LANES)."""

    d: NDArray


@fill(orders.separators, Abreast, _nrt=True)
def _separators(order, g, count):
    return Last(np.zeros((count, 3, LANES), np.array([g]).dtype))


@fill(orders.pick, Last)
def _pick(m, j):
    return Last(m.d[j])


@fill(orders.factor_separators, Abreast)
def _factor_last(order, ring, m, own, sums, ties):
    p, q, r = own
    if ring:
        p, q, r = p - sums[0] + 2.0 * ties[0], q - sums[1] + (ties[2] + ties[1]), r - sums[2] + 2.0 * ties[3]
    det = 1.0 / (p * r - q * q)
    store(m.d[0], 0, r * det)
    store(m.d[1], 0, -q * det)
    store(m.d[2], 0, p * det)


@fill(orders.solve_separators, Abreast)
def _last(order, ring, m, x, y, at_x, at_y):
    p, q, r = load(m.d[0], 0), load(m.d[1], 0), load(m.d[2], 0)
    if ring:
        x, y = x - at_x, y - at_y
    x, y = p * x + q * y, q * x + r * y
    return x, y, x, y
