"""Loads of a rod on n functions in compiled code; the plain twin is `continuum.weak.Weak`."""

from typing import NamedTuple

import numpy as np

from discs.arrays import Complex, Float
from discs.kernels.compiled import part


class Load(NamedTuple):
    """Parameters of the loads; arrays have no entries where there are none.

    patterns : (L, 3 n), forces. signals : (s, L), their signals at the stages, set before each step; 1 for forces with a potential.
    damping : (n, n), on omega. stiffness : (n, n), of springs, on x and on y. bent : (s, n, n + 1), of rest curvature at the
    stages, see `continuum.curved.Curved.matrices`, set before each step. viscosity, turns, back : (F,), (n, 2 F), (2 F, n), of
    bending, as in `continuum.viscous`.
    """

    patterns: Float
    signals: Float
    damping: Float
    stiffness: Float
    bent: Complex
    viscosity: Float
    turns: Float
    back: Float


_EMPTY = np.empty((0, 0))
NONE = Load(_EMPTY, _EMPTY, _EMPTY, _EMPTY, np.empty((0, 0, 0), complex), np.empty(0), _EMPTY, _EMPTY)


@part(_nrt=True)
def press(load, work, moves, c, shift):
    """Forces at the stages, (s, 3, n), after each of `moves` from the base; c has the rates."""
    s, _, n = moves.shape
    f = np.dot(load.signals, load.patterns).reshape(s, 3, n)
    if load.damping.shape[0]:
        lost = np.dot(c.omega, load.damping)
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
    if load.viscosity.size:
        drag(load, c, shift, f)
    return f


@part(_nrt=True)
def drag(load, c, shift, f):
    """Add the force of viscosity of bending, from the line and its rates c.xy."""
    s, _, n = f.shape
    finer = load.viscosity.size
    fast, pull = np.dot(c.xy, load.turns), np.empty((2 * s, 2 * finer))
    for i in range(s):
        for k in range(finer):
            zx, zy = c.line[2 * i, n + k] + shift.real, c.line[2 * i + 1, n + k] + shift.imag
            bx, by = c.line[2 * i, n + finer + k], c.line[2 * i + 1, n + finer + k]
            rate = fast[2 * i, k] * by - fast[2 * i + 1, k] * bx
            rate += zx * fast[2 * i + 1, finer + k] - zy * fast[2 * i, finer + k]
            moment = load.viscosity[k] * rate
            pull[2 * i, k], pull[2 * i + 1, k] = -moment * by, moment * bx
            pull[2 * i, finer + k], pull[2 * i + 1, finer + k] = moment * zy, -moment * zx
    moved = np.dot(pull, load.back)
    for i in range(s):
        for k in range(n):
            f[i, 0, k] += moved[2 * i, k]
            f[i, 1, k] += moved[2 * i + 1, k]
