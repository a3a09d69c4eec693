"""A rod on n functions in compiled form; the plain twin is `continuum.galerkin.SpectralRod`.

Arrays have a row for each stage, `s` of them, F finer points.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import protocol as do
from discs.kernels.compiled import part as _part


def part(function):
    """A part of a kernel that multiplies matrices, for which numba makes arrays."""
    return _part(function, _nrt=True)


class Spectral(NamedTuple):
    """Parameters. The matrices and weights are those of `continuum.functions.Functions`, for row vectors on their left.

    bends : (n, n + 3 F). rates : (n, 3 F), back : (3 F, n). project : (F + n, n), pull : (n, F + n). bending : (n,).
    torsion : (n, n). twist : (n,), moment of the initial twist. mass, spin : (n,), w rho and w alpha. scale : (3,).
    """

    bends: NDArray
    rates: NDArray
    back: NDArray
    project: NDArray
    pull: NDArray
    bending: NDArray
    torsion: NDArray
    twist: NDArray
    mass: NDArray
    spin: NDArray
    scale: NDArray
    shift: complex
    radius: float
    rolling: Any


class Basis(NamedTuple):
    """C. e : (s, n) and t : (s, n), 1/sqrt(w (alpha + rho |e|^2)), at the nodes. finer : (s, 3, F), e'', 2 e', e."""

    e: NDArray
    t: NDArray
    finer: NDArray


class Work(NamedTuple):
    """xy : (2 s, n), rows x and y of each stage. line : (2 s, n + 3 F). omega : (s, n). rates : (s, 3 F). moves : (2 s, F + n)."""

    xy: NDArray
    line: NDArray
    omega: NDArray
    rates: NDArray
    moves: NDArray


@part
def blank(rod, s):
    """A basis and the work of `s` stages."""
    n, finer = rod.bends.shape[0], rod.rates.shape[1]
    c = Basis(np.empty((s, n), np.complex128), np.empty((s, n)), np.empty((s, 3, finer // 3), np.complex128))
    work = Work(
        np.empty((2 * s, n)),
        np.empty((2 * s, n + finer)),
        np.empty((s, n)),
        np.empty((s, finer)),
        np.empty((2 * s, finer // 3 + n)),
    )
    return c, work


@part
def basis(rod, work, q, c):
    """C at configurations q (s, 3, n)."""
    s, _, n = q.shape
    points = c.finer.shape[2]
    for i in range(s):
        for k in range(n):
            work.xy[2 * i, k], work.xy[2 * i + 1, k] = q[i, 0, k], q[i, 1, k]
    np.dot(work.xy, rod.bends, work.line)
    for i in range(s):
        x, y = work.line[2 * i], work.line[2 * i + 1]
        for k in range(n):
            slope = complex(x[k], y[k]) + rod.shift
            a, b, factor, _ = do.contact(rod.rolling, rod.radius, 1.0, slope.real, slope.imag)
            e = complex(a, b) * (1j * factor)
            c.e[i, k] = e
            c.t[i, k] = 1 / np.sqrt(rod.spin[k] + rod.mass[k] * (e.real * e.real + e.imag * e.imag))
        for f in range(points):
            at, first, second = n + f, n + points + f, n + 2 * points + f
            slope = complex(x[at], y[at]) + rod.shift
            bend, bent = complex(x[first], y[first]), complex(x[second], y[second])
            h, h1, h2 = do.jet(rod.rolling, slope, bend, bent)
            ir = 1j * rod.radius
            c.finer[i, 0, f], c.finer[i, 1, f], c.finer[i, 2, f] = ir * h2, 2 * ir * h1, ir * h


@part
def settle(hi, lo, q):
    """q = hi + lo, (1, 3, n)."""
    for row in range(3):
        for k in range(q.shape[2]):
            q[0, row, k] = hi[row, k] + lo[row, k]


@part
def forward(rod, work, c, p, v):
    """v = C p, (s, 3, n)."""
    s, n = p.shape
    points = c.finer.shape[2]
    omega, moves = work.omega, work.moves
    for i in range(s):
        t = c.t[i]
        for k in range(n):
            omega[i, k] = t[k] * p[i, k]
    np.dot(omega, rod.rates, work.rates)
    for i in range(s):
        e, finer, rates = c.e[i], c.finer[i], work.rates[i]
        for f in range(points):
            move = finer[0, f] * rates[f] + finer[1, f] * rates[points + f] + finer[2, f] * rates[2 * points + f]
            moves[2 * i, f], moves[2 * i + 1, f] = move.real, move.imag
        for k in range(n):
            move = e[k] * omega[i, k]
            moves[2 * i, points + k], moves[2 * i + 1, points + k] = move.real, move.imag
    np.dot(moves, rod.project, work.xy)
    for i in range(s):
        for k in range(n):
            v[i, 0, k], v[i, 1, k], v[i, 2, k] = work.xy[2 * i, k], work.xy[2 * i + 1, k], omega[i, k]


@part
def force(rod, work, q, c, pull):
    """pull = C^T grad V at configurations q (s, 3, n)."""
    s, _, n = q.shape
    points, p = c.finer.shape[2], pull.reshape(s, n)
    for i in range(s):
        for k in range(n):
            work.xy[2 * i, k], work.xy[2 * i + 1, k] = rod.bending[k] * q[i, 0, k], rod.bending[k] * q[i, 1, k]
            work.omega[i, k] = q[i, 2, k]
    np.dot(work.xy, rod.pull, work.moves)
    for i in range(s):
        x, y, fine = work.moves[2 * i], work.moves[2 * i + 1], work.rates[i]
        for j in range(3):
            finer = c.finer[i, j]
            for f in range(points):
                fine[j * points + f] = finer[f].real * x[f] + finer[f].imag * y[f]
    np.dot(work.rates, rod.back, p)
    np.dot(work.omega, rod.torsion, work.xy[:s])
    for i in range(s):
        x, y, e = work.moves[2 * i], work.moves[2 * i + 1], c.e[i]
        for k in range(n):
            p[i, k] += e[k].real * x[points + k] + e[k].imag * y[points + k] + work.xy[i, k] + rod.twist[k]
            p[i, k] *= c.t[i, k]
