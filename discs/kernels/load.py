"""Compiled loads that are linear, or none: one type, so that a load needs no kernels of its own. Plain twins: `discs.loads`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import protocol as do
from discs.kernels.compiled import fill
from discs.kernels.shared import column


class Linear(NamedTuple):
    """f = constant - damping v - stiffness q, all (rows, n); without rows for none."""

    constant: NDArray
    damping: NDArray
    stiffness: NDArray


NONE = np.empty((0, 0))
UNLOADED = Linear(NONE, NONE, NONE)


@fill(do.loaded, Linear)
def _loaded(load):
    return load.constant.size > 0


@fill(do.push, Linear)
def _push(load, state, t, move, c, p, factor, g):
    for row in range(load.constant.shape[0]):
        a, rate, to = c[row], p[column(row)], g[column(row)]
        constant, damping, stiffness = load.constant[row], load.damping[row], load.stiffness[row]
        hi, lo, step = state.hi[row], state.lo[row], move[row]
        for i in range(a.size):
            f = constant[i] - damping[i] * (a[i] * rate[i]) - stiffness[i] * (hi[i] + (lo[i] + step[i]))
            to[i] += factor * a[i] * f


@fill(do.guide, Linear)
def _guide(load, c, d, g, roll, turn):
    for row in range(load.constant.shape[0]):
        a, damping, stiffness = c[row], load.damping[row], load.stiffness[row]
        to = turn if column(row) else roll
        for i in range(a.size):
            to[i] += a[i] * a[i] * (d * damping[i] + g * stiffness[i])
