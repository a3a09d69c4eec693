"""Collocation at Gauss or Radau points: the compiled step; the plain twin is `discs.integrators.collocated`."""

from typing import Any, NamedTuple

import numpy as np

from discs.arrays import Complex, Float
from discs.integrators.tableaux import Tableau
from discs.kernels import protocol as do
from discs.kernels.compiled import CUT, Cost, fill, part
from discs.kernels.shared import add as advance
from discs.kernels.shared import column, copy, forward, largest, renew, stuck, unsettled
from discs.skew import Phase


class Collocation(NamedTuple):
    """Parameters of the compiled form: the coefficients, and the limits of sweeps."""

    tableau: Tableau
    sweeps: int
    tolerance: float

    @property
    def nodes(self) -> Float:
        """Times of the forces in a step, in units of h."""
        return self.tableau.nodes


class Room(NamedTuple):
    """Workspace. times : (s,). moves, v : (s, rows, n). p, rest, force (later the change of p) : (s, columns, n).
    stages : `do.stages` of the chain."""

    times: Float
    moves: Float
    v: Float
    p: Float
    force: Float
    rest: Float
    stages: Any


class Stages(NamedTuple):
    """Workspace for the stages of discs. c : (s, rows, n), C of each stage. common : (rows, n), C in the middle of the step.

    x, z : like momenta, z complex. change : (n,). stiff, single, double : matrices of the chain, single and double one for each
    real eigenvalue and each pair.
    """

    c: Float
    common: Float
    x: Float
    z: Complex
    change: Float
    stiff: Any
    single: Any
    double: Any


@part
def combine(weights: Float, parts: Float, h: float, total: Float) -> None:
    """total = h sum_j weights[j] parts[j], (rows, n)."""
    for row in range(total.shape[0]):
        to = total[row]
        a, x = h * weights[0], parts[0, row]
        for i in range(to.size):
            to[i] = a * x[i]
        for j in range(1, weights.size):
            a, x = h * weights[j], parts[j, row]
            for i in range(to.size):
                to[i] += a * x[i]


@part
def transform(weights: Float, parts: Float, out: Float) -> None:
    """out = sum_j weights[j] parts[j], real or complex, (columns, n)."""
    for row in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[row, i] = weights[0] * parts[0, row, i]
        for j in range(1, weights.size):
            for i in range(out.shape[1]):
                out[row, i] += weights[j] * parts[j, row, i]


@part
def spread(weights: Float, z: Float, parts: Float) -> None:
    """parts[j] += Re(weights[j] z)."""
    for j in range(weights.size):
        for row in range(z.shape[0]):
            to, x = parts[j, row], z[row]
            for i in range(to.size):
                to[i] += (weights[j] * x[i]).real


@part
def reach(c: Float, p: Float, tau: float, scale: Float, change: Float) -> float:
    """The largest entry of tau C p, each row in units of its `scale`."""
    furthest = 0.0
    for row in range(c.shape[0]):
        a, q = c[row], p[column(row)]
        for i in range(change.size):
            change[i] = abs(tau * a[i] * q[i])
        furthest = max(furthest, largest(change) / scale[row])
    return furthest


@fill(do.stages, object, _nrt=True)
def _stages(chain: Any, method: Collocation, rows: int, columns: int) -> Stages:
    rule, n = method.tableau, chain.weights.shape[1]
    c, common, x = np.empty((rule.b.size, rows, n)), np.empty((rows, n)), np.empty((columns, n))
    z, change, stiff = np.empty((columns, n), np.complex128), np.empty(n), do.factors(chain, 1.0, 1)
    single, double = do.factors(chain, 1.0, rule.real.size), do.factors(chain, 1.0j, rule.pairs.size)
    return Stages(c, common, x, z, change, stiff, single, double)


@fill(do.begin, object)
def _begin(chain: Any, work: Any, method: Collocation, room: Room, before: Phase, h: float) -> None:
    rule, own, move = method.tableau, room.stages, room.moves[0]
    c, stiff = own.common, do.pick(chain, own.stiff, 0)
    move[:] = 0.0
    do.basis(chain, work, move, c)
    renew(c, before.pi, 0.5 * h, move, chain.scale, own.change)
    do.basis(chain, work, move, c)
    do.stiffness(chain, work, move, c, stiff)
    t = room.times[rule.b.size // 2]
    for j in range(rule.real.size):
        value, matrix = rule.real[j], do.pick(chain, own.single, j)
        do.precondition(chain, stiff, before, t, move, c, h * value, h * h * value**2, matrix)
    for j in range(rule.pairs.size):
        pair, factors = rule.pairs[j], do.pick(chain, own.double, j)
        do.precondition(chain, stiff, before, t, move, c, h * pair, h * h * pair**2, factors)
    for i in range(rule.b.size):
        forward(c, before.pi, room.v[i])


@fill(do.solve, object)
def _solve(chain: Any, method: Collocation, room: Room, h: float) -> None:
    rule, own, x, z = method.tableau, room.stages, room.stages.x, room.stages.z
    room.force[:] = 0.0
    for j in range(rule.real.size):
        transform(rule.real_in[j], room.rest, x)
        do.correct(chain, do.pick(chain, own.single, j), x)
        spread(rule.real_out[j], x, room.force)
    for j in range(rule.pairs.size):
        transform(rule.pairs_in[j], room.rest, z)
        do.correct(chain, do.pick(chain, own.double, j), z)
        spread(rule.pairs_out[j], z, room.force)


@fill(do.moved, object)
def _moved(chain: Any, method: Collocation, room: Room, sweep: int, h: float) -> float:
    furthest = 0.0
    for i in range(room.force.shape[0]):
        furthest = max(furthest, reach(room.stages.common, room.force[i], 0.5 * h, chain.scale, room.stages.change))
    return furthest


@fill(do.finish, object)
def _finish(chain: Any, work: Any, method: Collocation, room: Room, before: Phase, h: float) -> None:
    rule, moves = method.tableau, room.moves
    if chain.load.spent.size > 0:
        for i in range(rule.b.size):
            combine(rule.a[i], room.v, h, moves[i])
            do.spend(chain, before, room.times[i], h * rule.b[i], moves[i], room.v[i], 1.0)
    if do.driven(chain.load):
        do.bases(chain, work, moves, room.stages.c)
        for i in range(rule.b.size):
            gained, p = room.force[i], room.p[i]
            do.pullback(chain, work, before, room.times[i], moves[i], room.stages.c[i], p, gained)
            for row in range(p.shape[0]):
                for k in range(p.shape[1]):
                    gained[row, k] *= h
                    for j in range(rule.b.size):
                        gained[row, k] += rule.inverse[i, j] * (room.p[j, row, k] - before.pi[row, k])
                    gained[row, k] *= rule.b[i]
            do.react(chain.load, gained, p)


@fill(do.room, Collocation, _nrt=True)
def _room(method: Collocation, chain: Any, state: Phase) -> Room:
    (rows, n), columns, s = state.hi.shape, state.pi.shape[0], method.tableau.b.size
    moves, v, p = np.empty((s, rows, n)), np.empty((s, rows, n)), np.empty((s, columns, n))
    force, rest = np.empty((s, columns, n)), np.empty((s, columns, n))
    return Room(np.empty(s), moves, v, p, force, rest, do.stages(chain, method, rows, columns))


@fill(do.refine, object, forceinline=True)
def _refine(chain: Any, work: Any, method: Collocation, room: Room, before: Phase, h: float, sweep: int) -> float:
    times, moves, v, p, force, rest, stages = room
    pi, c, a, s = before.pi, stages.c, method.tableau.a, method.tableau.b.size
    # C at the stages, velocities with it, and forces at the stages that these give
    for i in range(s):
        combine(a[i], v, h, moves[i])
    do.bases(chain, work, moves, c)
    do.forwards(chain, work, c, p, v)
    for i in range(s):
        combine(a[i], v, h, moves[i])
    do.forces(chain, work, before, times, moves, c, p, force)
    for i in range(s):
        combine(a[i], force, -h, rest[i])
        for row in range(pi.shape[0]):
            for k in range(pi.shape[1]):
                rest[i, row, k] += pi[row, k] - p[i, row, k]
    do.solve(chain, method, room, h)
    for i in range(s):
        for row in range(pi.shape[0]):
            for k in range(pi.shape[1]):
                p[i, row, k] += force[i, row, k]
    do.forwards(chain, work, c, p, v)
    furthest: float = do.moved(chain, method, room, sweep, h)
    return furthest


@fill(do.step, Collocation, forceinline=True)
@part
def collocate(method: Collocation, chain: Any, work: Any, room: Room, before: Phase, after: Phase, t: float, h: float) -> Cost:
    times, moves, v, p = room.times, room.moves, room.v, room.p
    rule, pi, s = method.tableau, before.pi, method.tableau.b.size
    for i in range(s):
        times[i] = t + rule.nodes[i] * h
        copy(pi, p[i])
    do.begin(chain, work, method, room, before, h)
    sweep, moved = 0, np.inf
    while unsettled(method, sweep, moved):
        if do.halted(chain, moves.size):
            return CUT
        moved = do.refine(chain, work, method, room, before, h, sweep)
        sweep += 1
    do.finish(chain, work, method, room, before, h)
    move = moves[0]
    combine(rule.b, v, h, move)
    advance(before, move, 1.0, after)
    for row in range(pi.shape[0]):
        for k in range(pi.shape[1]):
            start, total = pi[row, k], 0.0
            for i in range(s):
                total += rule.last[i] * (p[i, row, k] - start)
            after.pi[row, k] = start + total
    do.settle(chain, work, after.hi, after.lo)
    return s * sweep, sweep * (rule.real.size + rule.pairs.size), stuck(method, sweep)


@fill(do.jumps, Collocation)
def _jumps(method: Collocation) -> bool:
    return False
