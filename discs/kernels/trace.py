"""Compiled: steps that record their stages, for the linearised equations there (`discs.analysis.trace` has the plain twin)."""

from discs.integrators.collocation import Collocation
from discs.integrators.midpoint import Composed
from discs.kernels import protocol as do
from discs.kernels.compiled import fill, kernel, stub


@stub
def stages(method, chain, room, before, after, h, q, p):
    """Positions q (s, rows, n) and momenta p (s, columns, n), disc by disc, of the stages of a step that was just taken."""


@fill(stages, Composed)
def _midpoint(method, chain, room, before, after, h, q, p):
    for i in range(q.shape[2]):
        j = do.place(chain, i)
        for row in range(q.shape[1]):
            start, end = before.hi[row, j] + before.lo[row, j], after.hi[row, j] + after.lo[row, j]
            q[0, row, i] = start + 0.5 * (end - start)
        for row in range(p.shape[1]):
            p[0, row, i] = 0.5 * (before.pi[row, j] + after.pi[row, j])


@fill(stages, Collocation)
def _collocation(method, chain, room, before, after, h, q, p):
    a, v = method.tableau.a, room.v
    for k in range(q.shape[0]):
        for i in range(q.shape[2]):
            j = do.place(chain, i)
            for row in range(q.shape[1]):
                move = before.lo[row, j]
                for other in range(q.shape[0]):
                    move += h * a[k, other] * v[other, row, j]
                q[k, row, i] = before.hi[row, j] + move
            for row in range(p.shape[1]):
                p[k, row, i] = room.p[k, row, j]


@kernel
def trace(method, chain, state, t, h, q, p):
    """Steps from a state at the time t, in place, whose stages are recorded in q (steps, s, rows, n) and p (steps, s, columns, n).

    Returns how many did not converge; -1 after Ctrl-C.
    """
    before = do.enter(chain, state)
    work, room, after, unconverged = do.workspace(chain), do.room(method, chain, before), do.like(before), 0
    do.settle(chain, work, before.hi, before.lo)
    for step in range(q.shape[0]):
        new = do.step(method, chain, work, room, before, after, t + step * h, h)
        if new[0] < 0:
            return -1
        stages(method, chain, room, before, after, h, q[step], p[step])
        unconverged += new[2]
        before, after = after, before
    do.leave(chain, before, state)
    return unconverged
