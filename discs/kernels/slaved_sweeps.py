"""Sweeps of many discs with slaved headings, in lanes; see `discs.kernels.slaved_lanes`.

Ghost links at free ends serve headings only; the springs of consistent ends act on the first and the last four discs by themselves.
"""

import numpy as np

from discs.kernels import protocol as do
from discs.kernels.abreast import END
from discs.kernels.compiled import fill, part
from discs.kernels.elimination import ONE
from discs.kernels.lanes import HALO
from discs.kernels.orders import bend_ends, corners, factor, join, most, pick, present, pull_ends, record, solve, wrap
from discs.kernels.shared import forward, reach
from discs.kernels.slaved_lanes import LANED, moved
from discs.kernels.slaved_matrix import GHOST, RING
from discs.kernels.vectors import LANES, larger, largest, load, store, zero


@part
def contact(chain, i, x, y):
    """C of the discs i ... i + LANES - 1, for the sums of their two links."""
    a, b, e, square = do.contact(chain.rolling, load(chain.radius, i), load(chain.half, 0), x, y)
    t = 1.0 / np.sqrt(load(chain.weights[2], i) + load(chain.weights[0], i) * square)
    e = e * t
    return -b * e, a * e, t


@fill(do.basis, *LANED)
def _basis(chain, work, move, c):
    moved(chain, work.base, move, work.links)
    (dx, dy, _), (cx, cy, ct) = work.links, c
    x, y = load(dx, HALO), load(dy, HALO)
    for i in range(0, chain.radius.size, LANES):
        next_x, next_y = load(dx, HALO + LANES + i), load(dy, HALO + LANES + i)
        a, b, t = contact(chain, i, x + next_x, y + next_y)
        store(cx, i, a)
        store(cy, i, b)
        store(ct, i, t)
        x, y = next_x, next_y


@part
def frozen(chain, work, tau, p, c, move, start):
    """c = C for the moved links, and tau C p in `move`, (3, at least n'), from the entry `start` on."""
    dx, dy, cx, cy, ct = work.links[0], work.links[1], c[0], c[1], c[2]
    x, y = load(dx, HALO), load(dy, HALO)
    for i in range(0, chain.radius.size, LANES):
        j = HALO + i
        next_x, next_y = load(dx, j + LANES), load(dy, j + LANES)
        a, b, t = contact(chain, i, x + next_x, y + next_y)
        r = tau * load(p, i)
        store(cx, i, a)
        store(cy, i, b)
        store(ct, i, t)
        store(move[0], start + i, a * r)
        store(move[1], start + i, b * r)
        store(move[2], start + i, t * r)
        x, y = next_x, next_y


@part
def link(base, move, j):
    """A row of links after a move."""
    return load(base, j) + (load(move, j) - load(move, j - LANES))


@part
def bent(bend, base, move, j, last):
    """A row of links, and the moments of the discs between it and the row before."""
    found = link(base, move, j)
    return found, load(bend, j - LANES) * (found - last)


@part
def pulled(chain, work, c, g):
    """g = C^T grad V after the move work.half."""
    base, half, bend, torsion = work.base, work.half, chain.bend, chain.torsion
    bx, by, bt, vx, vy, vt, cx, cy, ct = base[0], base[1], base[2], half[0], half[1], half[2], c[0], c[1], c[2]
    join(chain.order, chain.ends == RING, half)
    link_x, before_x = bent(bend, bx, vx, HALO, link(bx, vx, LANES))
    link_y, before_y = bent(bend, by, vy, HALO, link(by, vy, LANES))
    link_x, moment_x = bent(bend, bx, vx, HALO + LANES, link_x)
    link_y, moment_y = bent(bend, by, vy, HALO + LANES, link_y)
    tension_x, tension_y, tension = before_x - moment_x, before_y - moment_y, load(torsion, HALO) * link(bt, vt, HALO)
    for i in range(0, g.size, LANES):
        j = HALO + 2 * LANES + i
        link_x, after_x = bent(bend, bx, vx, j, link_x)
        link_y, after_y = bent(bend, by, vy, j, link_y)
        next_x, next_y, next_ = moment_x - after_x, moment_y - after_y, load(torsion, j - LANES) * link(bt, vt, j - LANES)
        pull = load(cx, i) * (tension_x - next_x) + load(cy, i) * (tension_y - next_y) + load(ct, i) * (tension - next_)
        store(g, i, pull)
        moment_x, moment_y, tension_x, tension_y, tension = after_x, after_y, next_x, next_y, next_
    for i in range(chain.order.first):
        g[LANES * i] = 0.0
    if chain.ends == GHOST:
        pull_ends(chain.order, chain.springs, base, half, c, g)


@part
def end_moment(order, base, half, end):
    """As in `discs.kernels.abreast`."""
    moment, last = 0.0, order.n - 1
    for k, share in enumerate((-2.0, 3.0, -1.0)):  # of the three links from the end inwards
        i = HALO + order.places[k + 1 if end == 0 else last - k]
        j = HALO + order.places[k if end == 0 else last - k - 1]
        moment += share * (base[i] + (half[i] - half[j]))
    return moment


@fill(bend_ends, *ONE)
def _bend_ends(order, springs, base, still):
    energy = 0.0
    for end in range(order.left, order.right):
        for axis in range(2):
            energy += springs[end] * end_moment(order, base[axis], still[axis], end) ** 2
    return (energy / LANES) + zero()


@fill(pull_ends, *ONE)
def _pull_ends(order, springs, base, half, c, g):
    last = order.n - 1
    for end in range(order.left, order.right):
        for axis in range(2):
            moment = end_moment(order, base[axis], half[axis], end)
            for k, share in enumerate(END):
                i = order.places[k if end == 0 else last - k]
                g[i] += c[axis, i] * (share if end == 0 else -share) * springs[end] * moment


@fill(corners, *ONE)
def _corners(order, given, g, c, to):
    for end in range(order.left, order.right):
        i, j = order.places[0 if end == 0 else order.n - 4], order.places[3 if end == 0 else order.n - 1]
        to[end] = g * (given[end] * (c[0, i] * c[0, j] + c[1, i] * c[1, j]))


@part
def assemble(chain, c, one, g, m):
    """Entries of `one` I + g C^T (grad^2 V) C; fills in the last two rows of c, (3, n' + HALO)."""
    a, u, w, n = m.a, m.u, m.w, m.a.size
    s0, s1, s2, t0, t1 = chain.hessian[0], chain.hessian[1], chain.hessian[2], chain.twist[0], chain.twist[1]
    cx, cy, ct = c[0], c[1], c[2]
    wrap(chain.order, c)
    x, y, t, x1, y1, t1_ = load(cx, 0), load(cy, 0), load(ct, 0), load(cx, LANES), load(cy, LANES), load(ct, LANES)
    for i in range(0, n, LANES):
        x2, y2, t2 = load(cx, i + HALO), load(cy, i + HALO), load(ct, i + HALO)
        store(a, i, one + g * (load(s0, i) * (x * x + y * y) + load(t0, i) * (t * t)))
        store(u, i, g * (load(s1, i) * (x * x1 + y * y1) + load(t1, i) * (t * t1_)))
        store(w, i, g * (load(s2, i) * (x * x2 + y * y2)))
        x, y, t, x1, y1, t1_ = x1, y1, t1_, x2, y2, t2
    if chain.ends == GHOST:
        corners(chain.order, chain.corner, g, c, m.corner)


@fill(do.sweep, *LANED)
def _sweep(chain, work, state, t, h, p, move, first):
    c, q, b, half, start = work.c, p[0], work.b[0], 0.5 * h, state.pi[0]
    moved(chain, work.base, move, work.links)
    frozen(chain, work, half, q, c, work.half, HALO)
    pulled(chain, work, c, b)
    for i in range(0, b.size, LANES):
        store(b, i, load(start, i) - load(q, i) - half * load(b, i))
    if do.loaded(chain.load):
        forward(c, p, work.step, half)
        do.push(chain.load, state, t + half, work.step, c, p, half, work.b)
    matrix = pick(work.matrix, 0)
    assemble(chain, c, 1.0, half * half, matrix)
    do.guide(chain.load, c, half, half * half, matrix.a, matrix.u, matrix.a, matrix.u)
    factor(chain.order, chain.ends == RING, chain.ends == GHOST, matrix)
    solve(chain.order, chain.ends == RING, chain.ends == GHOST, matrix, b)
    cx, cy, ct, x, y, theta = c[0], c[1], c[2], move[0], move[1], move[2]
    far_x, far_y, far = zero(), zero(), zero()
    for i in range(0, b.size, LANES):
        r = load(q, i) + load(b, i)
        store(q, i, r)
        r = half * r
        new_x, new_y, new = load(cx, i) * r, load(cy, i) * r, load(ct, i) * r
        far_x = larger(abs(new_x - load(x, i)), far_x)
        far_y = larger(abs(new_y - load(y, i)), far_y)
        far = larger(abs(new - load(theta, i)), far)
        store(x, i, new_x)
        store(y, i, new_y)
        store(theta, i, new)
    return most(chain.order, max(largest(larger(far_x, far_y) / load(chain.length, 0), work.spare), largest(far, work.spare)))


@fill(reach, *LANED)
def _reach(chain, start, p, move, end):
    """As disc by disc, see `discs.kernels.shared`."""
    for row in range(3):
        a, b, d, hi, lo = start.hi[row], start.lo[row], move[row], end.hi[row], end.lo[row]
        for i in range(0, d.size, LANES):
            given, term = load(a, i), 2.0 * load(d, i) + load(b, i)
            total = given + term
            part = total - given
            store(lo, i, (given - (total - part)) + (term - part))
            store(hi, i, total)
    mean, before, after = p[0], start.pi[0], end.pi[0]
    for i in range(0, mean.size, LANES):
        store(after, i, 2.0 * load(mean, i) - load(before, i))


@fill(do.pullback, *LANED)
def _pullback(chain, work, state, t, move, c, p, g):
    for axis in range(3):
        x, to = move[axis], work.half[axis]
        for i in range(0, x.size, LANES):
            store(to, HALO + i, load(x, i))
    pulled(chain, work, c, g[0])
    do.push(chain.load, state, t, move, c, p, -1.0, g)


@fill(do.stiffness, *LANED)
def _stiffness(chain, work, move, c, matrix):
    for axis in range(3):
        for i in range(0, matrix.a.size, LANES):
            store(work.c[axis], i, load(c[axis], i))
    assemble(chain, work.c, 0.0, 1.0, matrix)


@fill(do.precondition, *LANED)
def _precondition(chain, stiff, state, t, move, c, d, g, matrix):
    for i in range(stiff.a.size):
        matrix.a[i] = 1 + g * stiff.a[i]
        matrix.u[i] = g * stiff.u[i]
        matrix.w[i] = g * stiff.w[i]
    for i in range(stiff.corner.size):
        matrix.corner[i] = g * stiff.corner[i]
    do.guide(chain.load, c, d, g, matrix.a, matrix.u, matrix.a, matrix.u)
    factor(chain.order, chain.ends == RING, chain.ends == GHOST, matrix)


@fill(do.correct, *LANED)
def _correct(chain, matrix, r):
    solve(chain.order, chain.ends == RING, chain.ends == GHOST, matrix, r[0])


@fill(do.frame, *LANED)
def _frame(chain, work, state, c, v, q, rates, told):
    do.rate(state, chain, work, c, 1.0, v)
    x, y, theta = work.base[0], work.base[1], work.base[2]
    energy, slip = zero(), zero()
    for i in range(0, chain.radius.size, LANES):
        j = HALO + i
        bend_x, bend_y = load(x, j + LANES) - load(x, j), load(y, j + LANES) - load(y, j)
        twist, p, rate = load(theta, j), load(state.pi[0], i), load(v[2], i)
        elastic = load(chain.bend, j) * (bend_x * bend_x + bend_y * bend_y) + load(chain.torsion, j) * (twist * twist)
        energy = energy + present(chain.order, i) * (elastic + p * p)
        turn = rate / load(c[2], i)
        off_x, off_y = load(v[0], i) - load(c[0], i) * turn, load(v[1], i) - load(c[1], i) * turn
        slip = larger(np.sqrt(off_x * off_x + off_y * off_y), slip)
    if chain.ends == GHOST:
        work.half[:] = 0.0
        energy = energy + bend_ends(chain.order, chain.springs, work.base, work.half)
    record(chain.order, state, v, 0.5 * energy, slip, work.spare, q, rates, told)
