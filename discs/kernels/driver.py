"""The compiled driver: any method's steps of any chain, with the guards that every run has.

Its plain twin is `discs.running.time_loop`.

Methods fill in `step` beside their plain form, in `discs.integrators`; chains what a step asks of them, beside this file.
"""

import numpy as np

from discs.kernels import protocol as do
from discs.kernels.compiled import interrupted, kernel, part
from discs.kernels.shared import ahead, forward
from discs.skew import Phase


@kernel
def march(method, chain, state, t, h, steps, bound):
    """`steps` steps from a state at the time t, in place.

    Returns (taken, gradients, solves, unconverged, lost). It stops after a step whose kinetic energy is not below `bound`, and
    after one in which disc `lost` >= 0 loses its heading: on the straight way that it went or, if the step did not converge or is
    explicit, on the way that its velocity pointed. The state is then undefined, as it is where `taken` is -1: Ctrl-C was pressed.
    """
    work, room = do.workspace(chain), do.room(method, chain, state)
    before, after = state, do.like(state)
    rows, n = before.hi.shape
    half, c, slope = np.empty((rows, n)), np.empty((rows, n)), np.zeros((2, n))
    gradients, solves, unconverged, lost = 0, 0, 0, -1
    do.settle(chain, work, before.hi, before.lo)
    do.lost(chain, work, slope)
    for step in range(steps):
        if interrupted():
            return -1, gradients, solves, unconverged, -1
        new = do.step(method, chain, work, room, before, after, t + step * h, h)
        if new[0] < 0:
            return -1, gradients, solves, unconverged, -1
        gradients, solves, unconverged = gradients + new[0], solves + new[1], unconverged + new[2]
        if do.vanishing(chain) and (new[2] > 0 or do.jumps(method)):
            do.settle(chain, work, before.hi, before.lo)
            do.rate(before, chain, work, c, 0.5 * h, half)
            lost = ahead(chain, work, before, half, slope)
            if lost >= 0:
                return step + 1, gradients, solves, unconverged, lost
        do.settle(chain, work, after.hi, after.lo)
        lost = do.lost(chain, work, slope)
        before, after = after, before
        if lost >= 0 or not do.kinetic(before, chain, h) <= bound:
            steps = step + 1
            break
    if steps % 2:
        do.take(before, state)
    return steps, gradients, solves, unconverged, lost


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


@kernel
def look(chain, state, v, q):
    """v = the velocities at a state, and what `seen` returns."""
    work, c = do.workspace(chain), np.empty_like(v)
    do.settle(chain, work, state.hi, state.lo)
    do.rate(state, chain, work, c, 1.0, v)
    return seen(chain, work, c, state.hi, state.lo, v, q)


@kernel
def observe(chain, hi, lo, v, q):
    """What `seen` returns at hi + lo and rates v."""
    work, c = do.workspace(chain), np.empty_like(hi)
    do.settle(chain, work, hi, lo)
    do.frame(chain, work, np.zeros_like(hi), c)
    return seen(chain, work, c, hi, lo, v, q)


@kernel
def reduced(chain, t, y, out):
    """The reduced equations q. = C pi, pi. = -C^T (grad V - f) at a time, y = (q, pi) disc by disc, (n (rows + columns),)."""
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
    do.pullback(chain, work, Phase(hi, still, p), t, still, c, p, g)
    for i in range(n):
        for row in range(rows):
            out[width * i + row] = v[row, i]
        for row in range(columns):
            out[width * i + rows + row] = -g[row, i]
