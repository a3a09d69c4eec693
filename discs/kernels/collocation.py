"""Gauss collocation in compiled form, for every chain; what it takes and returns is that of `discs.kernels.methods`."""

import numpy as np

from discs.kernels import chain as do
from discs.kernels.compiled import interrupted, kernel, part
from discs.kernels.shared import add, ahead, copy, forward, kinetic, largest, renew


@part
def combine(weights, parts, h, total):
    """total = h sum_j weights[j] parts[j], (rows, n)."""
    for row in range(total.shape[0]):
        to = total[row]
        a, x = h * weights[0], parts[0, row]
        for i in range(to.size):
            to[i] = a * x[i]
        for j in range(1, weights.size):
            a, x = h * weights[j], parts[j, row]
            for i in range(to.size):
                to[i] += a * x[i]


@part
def transform(weights, parts, out):
    """out = sum_j weights[j] parts[j], real or complex, (columns, n)."""
    for row in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[row, i] = weights[0] * parts[0, row, i]
        for j in range(1, weights.size):
            for i in range(out.shape[1]):
                out[row, i] += weights[j] * parts[j, row, i]


@part
def spread(weights, z, parts):
    """parts[j] += weights[j] z for real ones; twice the real part of it for complex ones, which stand for themselves and their
    conjugates."""
    for j in range(weights.size):
        for row in range(z.shape[0]):
            to, x = parts[j, row], z[row]
            for i in range(to.size):
                to[i] += (weights[j] * x[i]).real


@part
def reach(c, p, tau, scale, change):
    """The largest entry of tau C p, each row in units of its `scale`."""
    furthest = 0.0
    for row in range(c.shape[0]):
        a, q = c[row], p[row // 3]
        for i in range(change.size):
            change[i] = abs(tau * a[i] * q[i])
        furthest = max(furthest, largest(change) / scale[row])
    return furthest


@kernel
def gauss(chain, hi, lo, pi, tableau, h, steps, sweeps, tolerance, bound):
    """Gauss collocation, `discs.integrators.gauss`, which says what the tableau is."""
    a, b, last, real, real_in, real_out, pairs, pairs_in, pairs_out = tableau
    rows, n = hi.shape
    columns, s = pi.shape[0], b.size
    work, c, still, move = do.workspace(chain), np.empty_like(hi), np.zeros_like(hi), np.empty_like(hi)
    p, force, rest = np.empty((s, columns, n)), np.empty((s, columns, n)), np.empty((s, columns, n))
    stages, v = np.empty((s, rows, n)), np.empty((s, rows, n))
    x, z = np.empty((columns, n)), np.empty((columns, n), np.complex128)
    slope, change = np.zeros((2, n)), np.empty(n)
    stiff, single, first, second = do.factors(chain, 1.0), do.factors(chain, 1.0), do.factors(chain, 1.0j), do.factors(chain, 1.0j)
    gradients, solves, unconverged, lost = 0, 0, 0, -1
    do.settle(chain, work, hi, lo)
    do.lost(chain, work, slope)
    for step in range(steps):
        do.frame(chain, work, still, c)
        renew(c, pi, 0.5 * h, move, chain.scale, change)
        do.frame(chain, work, move, c)
        do.stiffness(chain, work, move, c, stiff)
        if real.size:
            do.precondition(chain, stiff, h * h * real[0] ** 2, single)
        do.precondition(chain, stiff, h * h * pairs[0] ** 2, first)
        if pairs.size > 1:
            do.precondition(chain, stiff, h * h * pairs[1] ** 2, second)
        for i in range(s):
            copy(pi, p[i])
            forward(c, p[i], v[i])
        sweep, moved = 0, np.inf
        while sweep < sweeps and not moved <= tolerance:
            if interrupted():
                return -1, gradients, solves, unconverged, -1
            sweep += 1
            # C where the stages are, velocities by it, and forces where these lead
            for i in range(s):
                combine(a[i], v, h, move)
                do.frame(chain, work, move, stages[i])
            for i in range(s):
                forward(stages[i], p[i], v[i])
            for i in range(s):
                combine(a[i], v, h, move)
                do.pullback(chain, work, move, stages[i], force[i])
            for i in range(s):
                combine(a[i], force, -h, rest[i])
                for row in range(columns):
                    for k in range(n):
                        rest[i, row, k] += pi[row, k] - p[i, row, k]
            # the change of p, eigenvector by eigenvector
            force[:] = 0.0
            if real.size:
                transform(real_in[0], rest, x)
                do.correct(chain, single, x)
                spread(real_out[0], x, force)
            transform(pairs_in[0], rest, z)
            do.correct(chain, first, z)
            spread(pairs_out[0], z, force)
            if pairs.size > 1:
                transform(pairs_in[1], rest, z)
                do.correct(chain, second, z)
                spread(pairs_out[1], z, force)
            moved = 0.0
            for i in range(s):
                moved = max(moved, reach(c, force[i], 0.5 * h, chain.scale, change))
                for row in range(columns):
                    for k in range(n):
                        p[i, row, k] += force[i, row, k]
                forward(stages[i], p[i], v[i])
        gradients += s * sweep
        solves += sweep * (real.size + pairs.size)
        if tolerance > 0 and sweep == sweeps:
            unconverged += 1
            do.frame(chain, work, still, c)
            forward(c, pi, move, 0.5 * h)
            lost = ahead(chain, work, hi, lo, move, slope)
            if lost >= 0:
                return step + 1, gradients, solves, unconverged, lost
        combine(b, v, h, move)
        add(hi, lo, move, 1.0)
        for row in range(columns):
            for k in range(n):
                start, total = pi[row, k], 0.0
                for i in range(s):
                    total += last[i] * (p[i, row, k] - start)
                pi[row, k] = start + total
        do.settle(chain, work, hi, lo)
        lost = do.lost(chain, work, slope)
        if lost >= 0 or not kinetic(pi) <= bound:
            return step + 1, gradients, solves, unconverged, lost
    return steps, gradients, solves, unconverged, lost
