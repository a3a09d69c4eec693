"""The integrators but Gauss collocation in compiled form, for every chain; their plain twins are in `discs.integrators`.

Each takes `steps` steps from hi + lo and pi (or what the method remembers), in place, and returns (taken, gradients, solves,
unconverged, lost): it stops after a step whose kinetic energy is not below `bound`, and in one in which disc `lost` >= 0 loses its
heading, on the straight way that it went or, if the step did not converge or is explicit, on the way that its velocity pointed (the
moves of leapfrog are its velocity). Where the discs are means nothing then: the step may not be made, or in part. Nor does it
where `taken` is -1: Ctrl-C was pressed.
"""

import numpy as np

from discs.kernels import chain as do
from discs.kernels.compiled import interrupted, kernel, part
from discs.kernels.shared import add, ahead, back, copy, forward, kinetic, largest, renew


@kernel
def compose(chain, hi, lo, pi, fractions, h, steps, sweeps, tolerance, bound):
    """Midpoint steps of fractions of h, `discs.integrators.midpoint` and `composition`."""
    work, p, move, half = do.workspace(chain), np.empty_like(pi), np.empty_like(hi), np.empty_like(hi)
    several = fractions.size > 1
    start_hi, start_lo, start_pi = (np.empty_like(hi), np.empty_like(lo), np.empty_like(pi)) if several else (hi, lo, pi)
    still, slope, change = np.zeros_like(hi), np.zeros((2, hi.shape[1])), np.empty(hi.shape[1])
    solves, unconverged, lost = 0, 0, -1
    do.settle(chain, work, hi, lo)
    do.lost(chain, work, slope)
    for step in range(steps):
        if several:
            copy(hi, start_hi)
            copy(lo, start_lo)
            copy(pi, start_pi)
        stuck = False
        for fraction in fractions:
            tau = fraction * h
            do.frame(chain, work, still, work.c)
            copy(pi, p)
            renew(work.c, p, 0.5 * tau, move, chain.scale, change)
            sweep, change_of_move = 0, np.inf
            while sweep < sweeps and not change_of_move <= tolerance:
                if interrupted():
                    return -1, solves, solves, unconverged, -1
                change_of_move = do.sweep(chain, work, tau, pi, p, move, sweep == 0)
                sweep += 1
            solves += sweep
            if tolerance > 0 and sweep == sweeps:
                unconverged += 1
                if not stuck:
                    stuck = True
                    do.settle(chain, work, start_hi, start_lo)
                    do.frame(chain, work, still, work.c)
                    forward(work.c, start_pi, half, 0.5 * h)
                    lost = ahead(chain, work, start_hi, start_lo, half, slope)
                    if lost >= 0:
                        return step + 1, solves, solves, unconverged, lost
            add(hi, lo, move, 2.0)
            for row in range(pi.shape[0]):
                for i in range(pi.shape[1]):
                    pi[row, i] = 2 * p[row, i] - pi[row, i]
            do.settle(chain, work, hi, lo)
        lost = do.lost(chain, work, slope)
        if lost >= 0 or not kinetic(pi) <= bound:
            return step + 1, solves, solves, unconverged, lost
    return steps, solves, solves, unconverged, lost


@kernel
def rk4(chain, hi, lo, pi, h, steps, bound):
    """The classical Runge-Kutta method, `discs.integrators.rk4`."""
    work, c, move, still = do.workspace(chain), np.empty_like(hi), np.empty_like(hi), np.zeros_like(hi)
    v, total, g, kick, p = np.empty_like(hi), np.empty_like(hi), np.empty_like(pi), np.empty_like(pi), np.empty_like(pi)
    slope, lost = np.zeros((2, hi.shape[1])), -1
    nodes, weights = np.array([0.5, 0.5, 1.0, 0.0]), np.array([1.0, 2.0, 2.0, 1.0])
    do.settle(chain, work, hi, lo)
    do.lost(chain, work, slope)
    for step in range(steps):
        if interrupted():
            return -1, 4 * step, 0, 0, -1
        if do.vanishing(chain):
            do.frame(chain, work, still, c)
            forward(c, pi, move, 0.5 * h)
            lost = ahead(chain, work, hi, lo, move, slope)
            if lost >= 0:
                return step + 1, 4 * step, 0, 0, lost
        move[:], total[:], kick[:] = 0.0, 0.0, 0.0
        copy(pi, p)
        for i in range(4):
            do.frame(chain, work, move, c)
            forward(c, p, v)
            do.pullback(chain, work, move, c, g)
            for row in range(v.shape[0]):
                for k in range(v.shape[1]):
                    total[row, k] += weights[i] * v[row, k]
                    move[row, k] = nodes[i] * h * v[row, k]
            for row in range(g.shape[0]):
                for k in range(g.shape[1]):
                    kick[row, k] += weights[i] * g[row, k]
                    p[row, k] = pi[row, k] - nodes[i] * h * g[row, k]
        add(hi, lo, total, h / 6)
        for row in range(pi.shape[0]):
            for k in range(pi.shape[1]):
                pi[row, k] -= h / 6 * kick[row, k]
        do.settle(chain, work, hi, lo)
        lost = do.lost(chain, work, slope)
        if lost >= 0 or not kinetic(pi) <= bound:
            return step + 1, 4 * (step + 1), 0, 0, lost
    return steps, 4 * steps, 0, 0, lost


@kernel
def leapfrog(chain, hi, lo, last, following, h, steps, bound):
    """The paper's two-step scheme, `discs.integrators.leapfrog`; last and following are the moves before and after hi + lo."""
    work, c, still, g = do.workspace(chain), np.empty_like(hi), np.zeros_like(hi), np.empty_like(hi)
    p, slope, lost = np.empty((hi.shape[0] - 2, hi.shape[1])), np.zeros((2, hi.shape[1])), -1
    do.settle(chain, work, hi, lo)
    do.lost(chain, work, slope)
    for step in range(steps):
        if interrupted():
            return -1, step, 0, 0, -1
        add(hi, lo, following, 1.0)
        do.settle(chain, work, hi, lo)
        do.frame(chain, work, still, c)
        do.gradient(chain, work, still, g)
        energy = 0.0
        for row in range(g.shape[0]):
            for k in range(g.shape[1]):
                g[row, k] = 2 * chain.weights[row, k] * following[row, k] - h * h * g[row, k]
        back(c, g, p)
        copy(following, last)
        forward(c, p, following)
        for row in range(g.shape[0]):
            for k in range(g.shape[1]):
                following[row, k] -= last[row, k]
                energy += chain.weights[row, k] * following[row, k] * following[row, k]
        lost = do.lost(chain, work, slope)
        if lost >= 0 or not 0.5 * energy / (h * h) <= bound:
            return step + 1, step + 1, 0, 0, lost
    return steps, steps, 0, 0, lost


@kernel
def perlmutter(chain, hi, lo, pi, h, steps, sweeps, tolerance, bound):
    """The reversible scheme of McLachlan and Perlmutter, `discs.integrators.perlmutter`."""
    work, c, after, still = do.workspace(chain), np.empty_like(hi), np.empty_like(hi), np.zeros_like(hi)
    half, move, v, g = np.empty_like(hi), np.empty_like(hi), np.empty_like(hi), np.empty_like(hi)
    pull, share, ones = np.empty_like(pi), np.empty_like(pi), np.ones_like(pi)
    slope, change = np.zeros((2, hi.shape[1])), np.empty(hi.shape[1])
    unconverged, lost = 0, -1
    do.settle(chain, work, hi, lo)
    do.lost(chain, work, slope)
    for step in range(steps):
        do.frame(chain, work, still, c)
        forward(c, pi, v)
        for row in range(v.shape[0]):
            for k in range(v.shape[1]):
                half[row, k] = 0.5 * h * v[row, k]
                move[row, k] = 2 * half[row, k]
        do.frame(chain, work, half, c)
        do.gradient(chain, work, half, g)
        for row in range(v.shape[0]):
            for k in range(v.shape[1]):
                g[row, k] = chain.weights[row, k] * v[row, k] - h * g[row, k]
        back(c, g, pull)
        sweep, moved = 0, np.inf
        while sweep < sweeps and not moved <= tolerance:
            if interrupted():
                return -1, step, 0, unconverged, -1
            sweep += 1
            do.frame(chain, work, move, after)
            forward(after, ones, v)
            for row in range(v.shape[0]):
                for k in range(v.shape[1]):
                    v[row, k] *= chain.weights[row, k]
            back(c, v, share)
            for row in range(pi.shape[0]):
                for k in range(pi.shape[1]):
                    pi[row, k] = pull[row, k] / share[row, k]
            forward(after, pi, v)
            moved = 0.0
            for row in range(v.shape[0]):
                for k in range(v.shape[1]):
                    new = half[row, k] + 0.5 * h * v[row, k]
                    change[k] = abs(new - move[row, k])
                    move[row, k] = new
                moved = max(moved, largest(change) / chain.scale[row])
        unconverged += tolerance > 0 and sweep == sweeps
        if do.vanishing(chain):
            lost = ahead(chain, work, hi, lo, half, slope)
            if lost >= 0:
                return step + 1, step + 1, 0, unconverged, lost
        add(hi, lo, move, 1.0)
        do.settle(chain, work, hi, lo)
        lost = do.lost(chain, work, slope)
        if lost >= 0 or not kinetic(pi) <= bound:
            return step + 1, step + 1, 0, unconverged, lost
    return steps, steps, 0, unconverged, lost


@part
def seen(chain, work, c, hi, lo, v, q):
    """q = hi + lo, which the work is settled at; returns the energy and the largest slip |r. - e omega| at rates v."""
    energy, slip = do.potential(chain, work), 0.0
    for row in range(hi.shape[0]):
        for i in range(hi.shape[1]):
            q[row, i] = hi[row, i] + lo[row, i]
            energy += 0.5 * chain.weights[row, i] * v[row, i] * v[row, i]
    for i in range(hi.shape[1]):
        x, y = v[0, i] - c[0, i] / c[2, i] * v[2, i], v[1, i] - c[1, i] / c[2, i] * v[2, i]
        slip = max(slip, np.sqrt(x * x + y * y))
    return energy, slip


@kernel
def look(chain, hi, lo, pi, v, q):
    """v = C pi at hi + lo, and what `seen` returns."""
    work, c = do.workspace(chain), np.empty_like(hi)
    do.settle(chain, work, hi, lo)
    do.frame(chain, work, np.zeros_like(hi), c)
    forward(c, pi, v)
    return seen(chain, work, c, hi, lo, v, q)


@kernel
def observe(chain, hi, lo, v, q):
    """What `seen` returns at hi + lo and rates v."""
    work, c = do.workspace(chain), np.empty_like(hi)
    do.settle(chain, work, hi, lo)
    do.frame(chain, work, np.zeros_like(hi), c)
    return seen(chain, work, c, hi, lo, v, q)


@kernel
def reduced(chain, y, out):
    """The reduced equations q. = C pi, pi. = -C^T grad V for y = (q, pi), disc by disc, (n (rows + columns),)."""
    n, rows = chain.weights.shape[1], chain.scale.size
    columns = rows - 2
    work, hi, v, c = do.workspace(chain), np.empty((rows, n)), np.empty((rows, n)), np.empty((rows, n))
    still, p, g = np.zeros((rows, n)), np.empty((columns, n)), np.empty((columns, n))
    width = rows + columns
    for i in range(n):
        for row in range(rows):
            hi[row, i] = y[width * i + row]
        for row in range(columns):
            p[row, i] = y[width * i + rows + row]
    do.settle(chain, work, hi, still)
    do.frame(chain, work, still, c)
    forward(c, p, v)
    do.pullback(chain, work, still, c, g)
    for i in range(n):
        for row in range(rows):
            out[width * i + row] = v[row, i]
        for row in range(columns):
            out[width * i + rows + row] = -g[row, i]
