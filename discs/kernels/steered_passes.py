"""Sweeps of discs with own headings in lanes; see `discs.kernels.steered_lanes`. The formulas are those of
`discs.kernels.steered_links` and `discs.kernels.steered_matrix`, in two passes down the rows."""

import numpy as np

from discs.kernels import protocol as do
from discs.kernels.compiled import fill, part
from discs.kernels.lanes import HALO
from discs.kernels.orders import join, most, present, record, wrap
from discs.kernels.shared import forward
from discs.kernels.steered_blocks import factor, pick, solve
from discs.kernels.steered_lanes import TURNING
from discs.kernels.steered_links import turn
from discs.kernels.vectors import LANES, chosen, larger, largest, load, store, zero


@part
def contact(chain, work, i, dphi):
    """C of x and y of the discs i ... i + LANES - 1, after headings turned by dphi."""
    cos, sin, point = load(work.heading[0], i), load(work.heading[1], i), load(chain.paces[0], i)
    a, b = turn(dphi)
    return -point * (sin * a + cos * b), point * (cos * a - sin * b)


@fill(do.basis, *TURNING)
def _basis(chain, work, move, c):
    for i in range(0, move.shape[1], LANES):
        x, y = contact(chain, work, i, load(move[3], i))
        store(c[0], i, x)
        store(c[1], i, y)
        store(c[2], i, load(chain.paces[1], i))
        store(c[3], i, load(chain.paces[2], i))


@part
def frozen(chain, work, tau, p, move, c, to, start):
    """The rows x and y of c = C after a move, and tau C p in `to` from `start` on; `to` may be `move`."""
    for i in range(0, move.shape[1], LANES):
        j = start + i
        x, y = contact(chain, work, i, load(move[3], i))
        roll = tau * load(p[0], i)
        store(c[0], i, x)
        store(c[1], i, y)
        store(to[0], j, x * roll)
        store(to[1], j, y * roll)
        store(to[2], j, load(chain.paces[1], i) * roll)
        store(to[3], j, load(chain.paces[2], i) * (tau * load(p[1], i)))


@part
def link(chain, work, j, full, keep):
    """Tensions of x, y, theta and phi, and the couple, of the links j ... j + LANES - 1 after `work.half`: the means over a step of
    which this is half if `full`, otherwise those there. Their geometry is kept in `work.section` if `keep`."""
    base, half, per = work.base, work.half, load(chain.per, 0)
    bx, by, k = load(base[0], j), load(base[1], j), j - LANES
    before, after = load(half[3], k), load(half[3], j)
    angle = 0.5 * (after + before)
    dx, dy = load(half[0], j) - load(half[0], k), load(half[1], j) - load(half[1], k)
    twist = load(base[2], j) + (load(half[2], j) - load(half[2], k))
    bend = load(base[3], j) + (after - before)
    cos, sin = turn(angle)
    cos0, sin0 = load(work.middle[0], j), load(work.middle[1], j)
    ax, ay = cos0 * cos - sin0 * sin, sin0 * cos + cos0 * sin
    x, y = (bx + dx) * per, (by + dy) * per
    over_x, over_y = ax * y - ay * x, -(ax * x + ay * y)
    if full:  # the end of the step: the angle of the half step and the change of links twice
        c, s = ax * cos - ay * sin, ay * cos + ax * sin
        x, y = bx + 2.0 * dx, by + 2.0 * dy
        stretch = 0.5 * (load(work.strain[0], j) + ((c * x + s * y) * per - 1.0))
        shear = 0.5 * (load(work.strain[1], j) + (c * y - s * x) * per)
        small, one = 1e-8 + zero(), 1.0 + zero()
        shorter = chosen(abs(angle), small, sin, one) / chosen(abs(angle), small, angle, one)
        over_x, over_y = over_x * shorter, over_y * shorter
        scale = cos * per
    else:
        stretch, shear, scale = -over_y - 1.0, over_x, per + zero()
    ax, ay = ax * scale, ay * scale
    if keep:
        for row, value in enumerate((ax, ay, over_x, over_y)):
            store(work.section[row], j - HALO, value)
    n, q = load(chain.stiffness[0], j) * stretch, load(chain.stiffness[1], j) * shear
    tension = load(chain.stiffness[2], j) * twist, load(chain.stiffness[3], j) * bend
    return ax * n - ay * q, ay * n + ax * q, tension[0], tension[1], 0.5 * (over_x * n + over_y * q)


@part
def pulled(chain, work, c, g, full, keep):
    """g = C^T grad V after work.half, see `link`."""
    join(chain.order, chain.ring, work.half)
    x, y, t, p, couple = link(chain, work, HALO, full, keep)
    for i in range(0, g.shape[1], LANES):
        x1, y1, t1, p1, next_ = link(chain, work, HALO + LANES + i, full, keep)
        roll = load(c[0], i) * (x - x1) + load(c[1], i) * (y - y1) + load(chain.paces[1], i) * (t - t1)
        store(g[0], i, roll)
        store(g[1], i, load(chain.paces[2], i) * ((p - p1) + (couple + next_)))
        x, y, t, p, couple = x1, y1, t1, p1, next_


@part
def assemble(chain, work, c, one, g, m):
    """Entries of `one` I + g C^T B^T (stiffness) B C for the links in work.section; fills in the last two rows of c,
    (4, n' + HALO)."""
    along_x, along_y, across_x, across_y = work.section[0], work.section[1], work.section[2], work.section[3]
    d, o, k = m.d, m.o, chain.stiffness
    wrap(chain.order, c)
    cx, cy, ct, cp = load(c[0], 0), load(c[1], 0), load(c[2], 0), load(c[3], 0)
    ax, ay, bx, by = load(along_x, 0), load(along_y, 0), load(across_x, 0), load(across_y, 0)
    s0, s1, s2, s3 = load(k[0], HALO), load(k[1], HALO), load(k[2], HALO), load(k[3], HALO)
    n, q, half = ax * cx + ay * cy, ax * cy - ay * cx, 0.5 * cp
    # what the links before discs add to their entries
    p0 = s0 * n * n + s1 * q * q + s2 * ct * ct
    q0 = half * (s0 * n * bx + s1 * q * by)
    r0 = half * half * (s0 * bx * bx + s1 * by * by) + s3 * cp * cp
    for i in range(0, d.shape[1], LANES):
        j, far = i + LANES, HALO + LANES + i
        ax, ay, bx, by = load(along_x, j), load(along_y, j), load(across_x, j), load(across_y, j)
        s0, s1, s2, s3 = load(k[0], far), load(k[1], far), load(k[2], far), load(k[3], far)
        n, q = ax * cx + ay * cy, ax * cy - ay * cx
        cross, straight = s0 * n * bx + s1 * q * by, s0 * bx * bx + s1 * by * by
        store(d[0], i, one + g * (p0 + s0 * n * n + s1 * q * q + s2 * ct * ct))
        store(d[1], i, g * (q0 - half * cross))
        store(d[2], i, one + g * (r0 + half * half * straight + s3 * cp * cp))
        cx, cy, t1, p1 = load(c[0], j), load(c[1], j), load(c[2], j), load(c[3], j)
        n1, q1, next_ = ax * cx + ay * cy, ax * cy - ay * cx, 0.5 * p1
        crossed = s0 * n1 * bx + s1 * q1 * by
        store(o[0], i, -g * (s0 * n * n1 + s1 * q * q1 + s2 * ct * t1))
        store(o[1], i, -g * next_ * cross)
        store(o[2], i, g * half * crossed)
        store(o[3], i, g * (half * next_ * straight - s3 * cp * p1))
        p0, q0 = s0 * n1 * n1 + s1 * q1 * q1 + s2 * t1 * t1, next_ * crossed
        r0 = next_ * next_ * straight + s3 * p1 * p1
        ct, cp, half = t1, p1, next_


@fill(do.sweep, *TURNING)
def _sweep(chain, work, state, t, h, p, move, first):
    c, b, half, matrix = work.c, work.b, 0.5 * h, pick(work.matrix, 0)
    frozen(chain, work, half, p, move, c, work.half, HALO)
    pulled(chain, work, c, b, True, first)
    for row in range(2):
        start, mean, to = state.pi[row], p[row], b[row]
        for i in range(0, to.size, LANES):
            store(to, i, load(start, i) - load(mean, i) - half * load(to, i))
    if do.loaded(chain.load):
        forward(c, p, work.step, half)
        do.push(chain.load, state, t + half, work.step, c, p, half, b)
    if first:  # later sweeps of a step use the same matrix, see `discs.integrators.midpoint`
        assemble(chain, work, c, 1.0, half * half, matrix)
        do.guide(chain.load, c, half, half * half, matrix.d[0], matrix.o[0], matrix.d[2], matrix.o[3])
        factor(chain.order, chain.ring, matrix)
    solve(chain.order, chain.ring, matrix, b)
    return renewed(chain, work, c, half, p, b, move)


@part
def renewed(chain, work, c, half, p, change, move):
    """p += change, move = half C p; returns its largest change, in units of the scale."""
    far, turned, roll, turns = zero(), zero(), p[0], p[1]
    x, y, theta, phi = move[0], move[1], move[2], move[3]
    for i in range(0, roll.size, LANES):
        r, q = load(roll, i) + load(change[0], i), load(turns, i) + load(change[1], i)
        store(roll, i, r)
        store(turns, i, q)
        r = half * r
        new_x, new_y = load(c[0], i) * r, load(c[1], i) * r
        new, angle = load(chain.paces[1], i) * r, load(chain.paces[2], i) * (half * q)
        far = larger(abs(new_x - load(x, i)), larger(abs(new_y - load(y, i)), far))
        turned = larger(abs(new - load(theta, i)), larger(abs(angle - load(phi, i)), turned))
        store(x, i, new_x)
        store(y, i, new_y)
        store(theta, i, new)
        store(phi, i, angle)
    return most(chain.order, max(largest(far / load(chain.length, 0), work.spare), largest(turned, work.spare)))


@part
def placed(work, move):
    for row in range(4):
        x, to = move[row], work.half[row]
        for i in range(0, x.size, LANES):
            store(to, HALO + i, load(x, i))


@fill(do.pullback, *TURNING)
def _pullback(chain, work, state, t, move, c, p, g):
    placed(work, move)
    pulled(chain, work, c, g, False, False)
    do.push(chain.load, state, t, move, c, p, -1.0, g)


@fill(do.stiffness, *TURNING)
def _stiffness(chain, work, move, c, matrix):
    placed(work, move)
    pulled(chain, work, c, work.b, False, True)
    for row in range(4):
        for i in range(0, move.shape[1], LANES):
            store(work.c[row], i, load(c[row], i))
    assemble(chain, work, work.c, 0.0, 1.0, matrix)


@fill(do.precondition, *TURNING)
def _precondition(chain, stiff, state, t, move, c, d, g, matrix):
    for row in range(3):
        one = 0.0 if row == 1 else 1.0
        for i in range(stiff.d.shape[1]):
            matrix.d[row, i] = one + g * stiff.d[row, i]
    for row in range(4):
        for i in range(stiff.o.shape[1]):
            matrix.o[row, i] = g * stiff.o[row, i]
    do.guide(chain.load, c, d, g, matrix.d[0], matrix.o[0], matrix.d[2], matrix.o[3])
    factor(chain.order, chain.ring, matrix)


@fill(do.correct, *TURNING)
def _correct(chain, matrix, r):
    solve(chain.order, chain.ring, matrix, r)


@fill(do.frame, *TURNING)
def _frame(chain, work, state, c, v, q, rates, told):
    do.rate(state, chain, work, c, 1.0, v)
    energy, slip = zero(), zero()
    for i in range(0, c.shape[1], LANES):
        j, roll, turns = HALO + i, load(state.pi[0], i), load(state.pi[1], i)
        stretch, shear, twist, bend = load(work.strain[0], j), load(work.strain[1], j), load(work.base[2], j), load(work.base[3], j)
        elastic = load(chain.stiffness[0], j) * (stretch * stretch) + load(chain.stiffness[1], j) * (shear * shear)
        elastic = elastic + load(chain.stiffness[2], j) * (twist * twist) + load(chain.stiffness[3], j) * (bend * bend)
        energy = energy + present(chain.order, i) * (elastic + (roll * roll + turns * turns))
        pace = load(chain.paces[1], i)
        turn = load(v[2], i) / (pace + (1.0 - present(chain.order, i)))
        off_x, off_y = load(v[0], i) - load(c[0], i) * turn, load(v[1], i) - load(c[1], i) * turn
        slip = larger(np.sqrt(off_x * off_x + off_y * off_y), slip)
    record(chain.order, state, v, 0.5 * energy, slip, work.spare, q, rates, told)
