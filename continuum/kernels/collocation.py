"""A compiled Gauss step of a rod on n functions; the plain twin is `continuum.collocation.step`."""

from discs.integrators.collocation import collocate
from discs.kernels import protocol as do
from discs.kernels.compiled import kernel


@kernel
def step(method, rod, before, after, t, h, v, p):
    """The state `after` a time h after `before` at t; returns the `Cost` of the step.

    v, p : (s, 3, n) and (s, 1, n), filled with the rates and momenta of the stages.
    """
    work, room = do.workspace(rod), do.room(method, rod, before)
    do.settle(rod, work, before.hi, before.lo)
    cost = collocate(method, rod, work, room, before, after, t, h)
    v[:], p[:] = room.v, room.p
    return cost
