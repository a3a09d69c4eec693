"""Compiled loads: none, and linear ones. The plain twins are in `discs.loads`."""

from typing import NamedTuple

from numpy.typing import NDArray

from discs.kernels import protocol as do
from discs.kernels.compiled import fill
from discs.kernels.shared import column


class Unloaded(NamedTuple):
    """No loads. (For numba a NamedTuple must have a field.)"""

    loads: int


UNLOADED = Unloaded(0)


class Linear(NamedTuple):
    """f = constant - damping v - stiffness q, all (rows, n)."""

    constant: NDArray
    damping: NDArray
    stiffness: NDArray


@fill(do.loaded, Unloaded)
def _unloaded(load):
    return False


@fill(do.push, Unloaded)
def _no_push(load, state, t, move, c, p, factor, g):
    pass


@fill(do.guide, Unloaded)
def _no_guide(load, c, d, g, roll, turn):
    pass


@fill(do.loaded, Linear)
def _loaded(load):
    return True


@fill(do.push, Linear)
def _push(load, state, t, move, c, p, factor, g):
    for row in range(c.shape[0]):
        a, rate, to = c[row], p[column(row)], g[column(row)]
        constant, damping, stiffness = load.constant[row], load.damping[row], load.stiffness[row]
        hi, lo, step = state.hi[row], state.lo[row], move[row]
        for i in range(a.size):
            f = constant[i] - damping[i] * (a[i] * rate[i]) - stiffness[i] * (hi[i] + (lo[i] + step[i]))
            to[i] += factor * a[i] * f


@fill(do.guide, Linear)
def _guide(load, c, d, g, roll, turn):
    for row in range(c.shape[0]):
        a, damping, stiffness = c[row], load.damping[row], load.stiffness[row]
        to = turn if column(row) else roll
        for i in range(a.size):
            to[i] += a[i] * a[i] * (d * damping[i] + g * stiffness[i])
