"""Functions shared by chains and methods. Each row of C has one entry per disc, for the momentum `column(row)`.

c, v : (rows, n). p : (1, n), or (2, n) for steered discs.
"""

import numpy as np

from discs.kernels import orders
from discs.kernels import protocol as do
from discs.kernels.compiled import fill, part, stub
from discs.kernels.interrupts import interrupted
from discs.skew import Phase


@part
def column(row):
    """The momentum of a row of q: 0 (roll) for x, y and theta, 1 (turning) for phi."""
    return row // 3


@part
def columns(rows):
    """The number of momenta of a disc with `rows` coordinates."""
    return column(rows - 1) + 1


@part
def copy(a, to):
    """Copy a two-dimensional array a to `to`."""
    for row in range(a.shape[0]):
        for i in range(a.shape[1]):
            to[row, i] = a[row, i]


@part
def disc_by_disc(chain, a, to):
    """Copy a (rows, n) in the order of a chain to `to`, in that of the discs."""
    for row in range(to.shape[0]):
        for i in range(to.shape[1]):
            to[row, i] = a[row, do.place(chain, i)]


@part
def forward(c, p, v, tau=1.0):
    """v = tau C p."""
    for row in range(c.shape[0]):
        a, q, to = c[row], p[column(row)], v[row]
        for i in range(to.size):
            to[i] = tau * a[i] * q[i]


@part
def back(c, g, p):
    """p = C^T g."""
    cx, cy, ct, gx, gy, gt, roll = c[0], c[1], c[2], g[0], g[1], g[2], p[0]
    for i in range(roll.size):
        roll[i] = cx[i] * gx[i] + cy[i] * gy[i] + ct[i] * gt[i]
    for row in range(3, c.shape[0]):
        a, b, to = c[row], g[row], p[1]
        for i in range(to.size):
            to[i] = a[i] * b[i]


@part(fastmath={"contract", "nnan", "nsz", "reassoc"})
def largest(a):
    """The largest entry of a (n,), whose entries are not negative."""
    m = 0.0
    for i in range(a.size):
        m = a[i] if a[i] > m else m
    return m


@part
def renew(c, p, tau, move, scale, change):
    """move = tau C p; returns its largest change, each row in units of its `scale`."""
    furthest = 0.0
    for row in range(c.shape[0]):
        a, q, to = c[row], p[column(row)], move[row]
        for i in range(to.size):
            new = tau * a[i] * q[i]
            change[i] = abs(new - to[i])
            to[i] = new
        furthest = max(furthest, largest(change) / scale[row])
    return furthest


@part
def unsettled(method, sweep, moved):
    """Whether a step needs another sweep after `sweep` sweeps, of which the last moved it by `moved`, in units of its scale."""
    return sweep < method.sweeps and not moved <= method.tolerance


@part
def stuck(method, sweep):
    """Whether a step stopped at its limit of sweeps without reaching its tolerance."""
    return method.tolerance > 0 and sweep == method.sweeps


@part
def add(state, increment, factor, to):
    """Positions of `to` = those of `state` + factor * increment, without losing low digits (Knuth's two-sum)."""
    for row in range(increment.shape[0]):
        a, b, d, hi, lo = state.hi[row], state.lo[row], increment[row], to.hi[row], to.lo[row]
        for i in range(a.size):
            term = factor * d[i] + b[i]
            total = a[i] + term
            part = total - a[i]
            lo[i] = (a[i] - (total - part)) + (term - part)
            hi[i] = total


@stub
def reach(chain, start, p, move, end):
    """The end of a midpoint step from `start`: twice the half step `move` later, with mean momenta p."""


@fill(reach, object)
def _reach(chain, start, p, move, end):
    add(start, move, 2.0, end)
    for row in range(p.shape[0]):
        mean, before, after = p[row], start.pi[row], end.pi[row]
        for i in range(mean.size):
            after[i] = 2 * mean[i] - before[i]


@part(fastmath={"contract", "reassoc"})
def square(a, b):
    """Sum of a b^2, both (n,)."""
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i] * b[i]
    return total


@fill(do.like, Phase, _nrt=True)
def _like(state):
    return Phase(np.empty_like(state.hi), np.empty_like(state.lo), np.empty_like(state.pi))


@fill(do.take, Phase)
def _take(state, to):
    copy(state.hi, to.hi)
    copy(state.lo, to.lo)
    copy(state.pi, to.pi)


@fill(do.kinetic, Phase, fastmath={"contract", "reassoc"})
def _kinetic(state, chain, h):
    total = 0.0
    for row in range(state.pi.shape[0]):
        pi = state.pi[row]
        for i in range(pi.size):
            total += pi[i] * pi[i]
    return do.added(chain, 0.5 * total)


@fill(do.rate, Phase)
def _rate(state, chain, work, c, tau, move):
    move[:] = 0.0
    do.basis(chain, work, move, c)
    forward(c, state.pi, move, tau)


@fill(do.kick, Phase)
def _kick(before, after, chain, work, t, h, c, g, defect):
    do.settle(chain, work, before.hi, before.lo)
    defect[:] = 0.0
    do.basis(chain, work, defect, c)
    do.pullback(chain, work, before, t, defect, c, before.pi, g)
    for row in range(c.shape[0]):
        a, pull, start, end, to = c[row], g[column(row)], before.pi[column(row)], after.pi[column(row)], defect[row]
        for i in range(to.size):
            to[i] = 2 * h * a[i] * (h * pull[i] + (end[i] - start[i]))
    do.settle(chain, work, after.hi, after.lo)


@part
def ahead(chain, work, state, h, c, half, slope):
    """A disc whose heading vanishes if the discs keep their velocities at a state, the base position, for a time h; or -1.

    `slope` is that of the state; c and half are workspace like positions.
    """
    do.rate(state, chain, work, c, 0.5 * h, half)
    for row in range(half.shape[0]):
        for i in range(half.shape[1]):
            half[row, i] = state.hi[row, i] + 2 * half[row, i]
    do.settle(chain, work, half, state.lo)
    lost = do.lost(chain, work, slope)
    do.settle(chain, work, state.hi, state.lo)
    do.lost(chain, work, slope)
    return lost


@fill(do.place, object)
def _place(chain, i):
    return i


@fill(do.most, object)
@fill(orders.most, object)
def _most(chain, x):
    return x


@fill(do.added, object)
@fill(orders.added, object)
def _added(chain, x):
    return x


@fill(do.halted, object)
@fill(orders.halted, object)
def _halted(chain, size):
    return interrupted(size)


@fill(do.enter, object, _nrt=True)
def _enter(chain, state):
    return state


@fill(do.leave, object)
def _leave(chain, own, state):
    do.take(own, state)


@part
def seen(chain, work, c, hi, lo, v, q):
    """q = hi + lo, the base position; returns the energy and the largest slip |r. - e omega| at rates v."""
    energy, slip = do.potential(chain, work), 0.0
    for row in range(hi.shape[0]):
        for i in range(hi.shape[1]):
            q[row, i] = hi[row, i] + lo[row, i]
            energy += 0.5 * chain.weights[row, i] * v[row, i] * v[row, i]
    for i in range(hi.shape[1]):
        x, y = v[0, i] - c[0, i] / c[2, i] * v[2, i], v[1, i] - c[1, i] / c[2, i] * v[2, i]
        slip = max(slip, np.sqrt(x * x + y * y))
    return energy, slip


@fill(do.frame, object)
def _frame(chain, work, state, c, v, q, rates, told):
    do.rate(state, chain, work, c, 1.0, v)
    for row in range(rates.shape[0]):
        for i in range(rates.shape[1]):
            rates[row, i] = v[row + 2, i]
    told[0], told[1] = seen(chain, work, c, state.hi, state.lo, v, q)


@fill(do.bases, object)
def _bases(chain, work, moves, c):
    for i in range(moves.shape[0]):
        do.basis(chain, work, moves[i], c[i])


@fill(do.forwards, object)
def _forwards(chain, work, c, p, v):
    for i in range(p.shape[0]):
        forward(c[i], p[i], v[i])


@fill(do.forces, object)
def _forces(chain, work, state, t, moves, c, p, g):
    for i in range(p.shape[0]):
        do.pullback(chain, work, state, t[i], moves[i], c[i], p[i], g[i])
        do.hold(chain.load, t[i], c[i], p[i], -1.0, g[i])


@fill(do.book_motors, object)
def _book_motors(chain, work, state, t, h, p, move):
    pass


@part
def torques(load, start, h, p, g):
    """Book the work of the motors of a midpoint step from the momenta `start` to 2 p - `start`, for g = C^T (mean grad V - f)."""
    for row in range(p.shape[0]):
        for i in range(p.shape[1]):
            g[row, i] = 2 * (p[row, i] - start[row, i]) + h * g[row, i]
    do.react(load, g, p)


# Loads without motors, and without more than diagonals and what is beside them


@fill(do.stiffen, object)
def _stiffen(load, state, t, move, c, d, g, matrix):
    pass


@fill(do.driven, object)
def _driven(load):
    return False


@fill(do.hold, object)
def _hold(load, t, c, p, factor, g):
    pass


@fill(do.react, object)
def _react(load, gained, p):
    pass
