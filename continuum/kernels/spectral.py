"""A rod on n functions as a compiled chain; the plain twin is `continuum.galerkin.SpectralRod`.

All stages of a step are computed at once, because the matrices are full: arrays have a row for each of the s stages. F is the
number of finer points. `continuum.collocation` describes the sweeps.
"""

from typing import Any, NamedTuple

import numpy as np

from continuum.kernels.mixing import History, mix
from continuum.kernels.spectral_load import Load, press
from discs.arrays import Complex, Float
from discs.integrators.collocation import spread, transform
from discs.kernels import protocol as do
from discs.kernels.compiled import fill
from discs.kernels.shared import copy
from discs.skew import Parameters


class Spectral(NamedTuple):
    """Parameters. Matrices and weights are those of `continuum.functions.Functions`, for row vectors on their left.

    bends : (n, n + 3 F). rates : (n, 3 F). back : (3 F, n). project : (F + n, n). pull : (n, F + n). bending : (n,).
    torsion : (n, n). twist : (n,), moment of the initial twist. mass, spin : (n,), w rho and w alpha. scale : (3,).
    modes : `continuum.modes.Modes` of a nearby configuration. load : the loads.
    """

    bends: Float
    rates: Float
    back: Float
    project: Float
    pull: Float
    bending: Float
    torsion: Float
    twist: Float
    mass: Float
    spin: Float
    scale: Float
    shift: complex
    radius: float
    rolling: Parameters
    modes: Any
    load: Load


class Stages(NamedTuple):
    """C at the stages, and workspace.

    e : (s, n) and t : (s, n), 1/sqrt(w (alpha + rho |e|^2)), at the nodes. finer : (s, 3, F), e'', 2 e', e.
    xy : (2 s, n), rows x and y of each stage. line : (2 s, n + 3 F). omega : (s, n). rates : (s, 3 F). moves : (2 s, F + n).
    """

    e: Complex
    t: Float
    finer: Complex
    xy: Float
    line: Float
    omega: Float
    rates: Float
    moves: Float


class Room(NamedTuple):
    """Workspace of the sweeps. c : C at the stages. z : (1, n), complex. parts, modal : (2 pairs, n), real and imaginary parts.

    guess : (s, 3, n), the rates before a sweep, and then their change. history : the last sweeps.
    """

    c: Stages
    z: Complex
    parts: Float
    modal: Float
    guess: Float
    history: History


@fill(do.workspace, Spectral, _nrt=True)
def _workspace(rod):
    return np.empty((3, rod.twist.size))


@fill(do.settle, Spectral, _nrt=True)
def _settle(rod, work, hi, lo):
    work[:] = hi + lo


@fill(do.stages, Spectral, _nrt=True)
def _stages(rod, method, rows, columns):
    n, finer, s, pairs = rod.twist.size, rod.rates.shape[1], method.tableau.b.size, method.tableau.pairs.size
    e, t, fine = np.empty((s, n), np.complex128), np.empty((s, n)), np.empty((s, 3, finer // 3), np.complex128)
    line, moves = np.empty((2 * s, n + finer)), np.empty((2 * s, finer // 3 + n))
    c = Stages(e, t, fine, np.empty((2 * s, n)), line, np.empty((s, n)), np.empty((s, finer)), moves)
    z, parts, modal, guess = (
        np.empty((1, n), np.complex128),
        np.empty((2 * pairs, n)),
        np.empty((2 * pairs, n)),
        np.empty((s, 3, n)),
    )
    return Room(c, z, parts, modal, guess, History(np.zeros((3, 3 * s * n)), np.zeros((3, 3 * s * n)), np.zeros((3, s * n))))


@fill(do.bases, Spectral, _nrt=True)
def _bases(rod, work, moves, c):
    s, _, n = moves.shape
    points = c.finer.shape[2]
    for i in range(s):
        for k in range(n):
            c.xy[2 * i, k], c.xy[2 * i + 1, k] = work[0, k] + moves[i, 0, k], work[1, k] + moves[i, 1, k]
    np.dot(c.xy, rod.bends, c.line)
    for i in range(s):
        x, y = c.line[2 * i], c.line[2 * i + 1]
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


@fill(do.forwards, Spectral, _nrt=True)
def _forwards(rod, work, c, p, v):
    s, _, n = p.shape
    points = c.finer.shape[2]
    omega, moves = c.omega, c.moves
    for i in range(s):
        t = c.t[i]
        for k in range(n):
            omega[i, k] = t[k] * p[i, 0, k]
    np.dot(omega, rod.rates, c.rates)
    for i in range(s):
        e, finer, rates = c.e[i], c.finer[i], c.rates[i]
        for f in range(points):
            move = finer[0, f] * rates[f] + finer[1, f] * rates[points + f] + finer[2, f] * rates[2 * points + f]
            moves[2 * i, f], moves[2 * i + 1, f] = move.real, move.imag
        for k in range(n):
            move = e[k] * omega[i, k]
            moves[2 * i, points + k], moves[2 * i + 1, points + k] = move.real, move.imag
    np.dot(moves, rod.project, c.xy)
    for i in range(s):
        for k in range(n):
            v[i, 0, k], v[i, 1, k], v[i, 2, k] = c.xy[2 * i, k], c.xy[2 * i + 1, k], omega[i, k]


@fill(do.forces, Spectral, _nrt=True)
def _forces(rod, work, state, t, moves, c, p, g):
    s, _, n = moves.shape
    points, pull = c.finer.shape[2], g.reshape(s, n)
    loaded = rod.load.patterns.shape[0] > 0
    push = press(rod.load, work, moves, c, rod.shift) if loaded else moves  # before c.omega is used for theta
    for i in range(s):
        for k in range(n):
            c.xy[2 * i, k] = rod.bending[k] * (work[0, k] + moves[i, 0, k])
            c.xy[2 * i + 1, k] = rod.bending[k] * (work[1, k] + moves[i, 1, k])
            c.omega[i, k] = work[2, k] + moves[i, 2, k]
    if loaded:
        for i in range(s):
            for k in range(n):
                c.xy[2 * i, k] -= push[i, 0, k]
                c.xy[2 * i + 1, k] -= push[i, 1, k]
    np.dot(c.xy, rod.pull, c.moves)
    for i in range(s):
        x, y, fine = c.moves[2 * i], c.moves[2 * i + 1], c.rates[i]
        for j in range(3):
            finer = c.finer[i, j]
            for f in range(points):
                fine[j * points + f] = finer[f].real * x[f] + finer[f].imag * y[f]
    np.dot(c.rates, rod.back, pull)
    np.dot(c.omega, rod.torsion, c.xy[:s])
    if loaded:
        for i in range(s):
            for k in range(n):
                c.xy[i, k] -= push[i, 2, k]
    for i in range(s):
        x, y, e = c.moves[2 * i], c.moves[2 * i + 1], c.e[i]
        for k in range(n):
            pull[i, k] += e[k].real * x[points + k] + e[k].imag * y[points + k] + c.xy[i, k] + rod.twist[k]
            pull[i, k] *= c.t[i, k]


@fill(do.begin, Spectral, _nrt=True)
def _begin(rod, work, method, room, before, h):
    moves = room.moves.ravel()
    for i in range(moves.size):
        moves[i] = 0.0
    do.bases(rod, work, room.moves, room.stages.c)
    do.forwards(rod, work, room.stages.c, room.p, room.v)
    for i in range(room.v.shape[0]):
        copy(room.v[i], room.stages.guess[i])


@fill(do.solve, Spectral, _nrt=True)
def _solve(rod, method, room, h):
    rule, z, parts, modal = method.tableau, room.stages.z, room.stages.parts, room.stages.modal
    if rod.modes.inverses.shape[0]:
        room.force[:] = 0.0
        for j in range(rule.pairs.size):
            transform(rule.pairs_in[j], room.rest, z)
            z[0] = np.dot(rod.modes.inverses[j], z[0])
            spread(rule.pairs_out[j], z, room.force)
        return
    for j in range(rule.pairs.size):
        transform(rule.pairs_in[j], room.rest, z)
        parts[2 * j], parts[2 * j + 1] = z[0].real, z[0].imag
    np.dot(parts, rod.modes.vectors, modal)
    for j in range(rule.pairs.size):
        g = h * h * rule.pairs[j] * rule.pairs[j]
        y = (modal[2 * j] + 1j * modal[2 * j + 1]) / (1 + g * rod.modes.values)
        modal[2 * j], modal[2 * j + 1] = y.real, y.imag
    np.dot(modal, rod.modes.back, parts)
    room.force[:] = 0.0
    for j in range(rule.pairs.size):
        z[0] = parts[2 * j] + 1j * parts[2 * j + 1]
        spread(rule.pairs_out[j], z, room.force)


@fill(do.moved, Spectral, _nrt=True)
def _moved(rod, method, room, sweep, h):
    v, change, furthest = room.v, room.stages.guess, 0.0
    for i in range(v.shape[0]):
        for row in range(3):
            to, x, unit = change[i, row], v[i, row], 0.5 * h / rod.scale[row]
            for k in range(x.size):
                to[k] = x[k] - to[k]
                far = abs(unit * to[k])
                furthest = furthest if far <= furthest else far  # NaN stays
    if furthest > method.tolerance:
        mix(room.stages.history, sweep, change.ravel(), v.ravel(), room.p.ravel())
        for i in range(v.shape[0]):
            copy(v[i], change[i])
    return furthest


@fill(do.finish, Spectral)
def _finish(rod, work, method, room, before, h):
    """Nothing: `continuum.stepping` computes the work of loads, step by step as they are accepted."""
