"""Loads of a rod on n functions in compiled code; the plain twin is `continuum.weak.Weak`."""

from typing import NamedTuple

import numpy as np

from discs.arrays import Complex, Float
from discs.kernels.compiled import part


class Load(NamedTuple):
    """Parameters of the loads; arrays have no entries where there are none.

    patterns : (L, 3 n), forces. signals : (s, L), their signals at the stages, set before each step; 1 for forces with a potential.
    damping : (n, n), on omega. stiffness : (n, n), of springs, on x and on y. bent : (s, n, n + 1), of rest curvature at the
    stages, see `continuum.curved.Curved.matrices`, set before each step.
    """

    patterns: Float
    signals: Float
    damping: Float
    stiffness: Float
    bent: Complex


_EMPTY = np.empty((0, 0))
NONE = Load(_EMPTY, _EMPTY, _EMPTY, _EMPTY, np.empty((0, 0, 0), complex))


@part(_nrt=True)
def press(load, work, moves, omega):
    """Forces at the stages, (s, 3, n), after each of `moves` from the base, with the rates omega (s, n)."""
    s, _, n = moves.shape
    f = np.dot(load.signals, load.patterns).reshape(s, 3, n)
    if load.damping.shape[0]:
        lost = np.dot(omega, load.damping)
        for i in range(s):
            for k in range(n):
                f[i, 2, k] -= lost[i, k]
    if load.stiffness.shape[0]:
        for row in range(2):
            for i in range(s):
                held = np.dot(work[row] + moves[i, row], load.stiffness)
                for k in range(n):
                    f[i, row, k] -= held[k]
    if load.bent.shape[0]:
        a = np.ones(n + 1, np.complex128)
        for i in range(s):
            for k in range(n):
                a[k] = complex(work[0, k] + moves[i, 0, k], work[1, k] + moves[i, 1, k])
            held = np.dot(load.bent[i], a)
            for k in range(n):
                f[i, 0, k] -= held[k].real
                f[i, 1, k] -= held[k].imag
    return f
