"""The classical explicit Runge-Kutta method on the reduced equations."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from discs.arrays import Float
from discs.integrators.base import OneStep
from discs.integrators.work import Work
from discs.kernels import protocol as do
from discs.kernels.compiled import Cost, fill
from discs.kernels.shared import add as advance
from discs.kernels.shared import copy, forward
from discs.skew import Parameters, Phase, SkewGradient, add


@dataclass(frozen=True)
class RK4(OneStep):
    """Runge-Kutta method of order 4 for q' = C(q) pi, pi' = -C(q)^T grad V(q). It suits few discs, as h must stay below about
    0.7 k^2 sqrt(rho/K)."""

    name: ClassVar[str] = "rk4"
    order: ClassVar[int] = 4
    preserves: ClassVar[str] = "the rolling constraint"
    reference: ClassVar[str] = "Kutta, Z. Math. Phys. 46 (1901) 435"
    stability_limit: ClassVar[float] = 2.8

    def step(self, system: SkewGradient, z: Phase, t: float, h: float, work: Work) -> Phase:
        shape = system.shape(z.hi, z.lo)
        work.gradients += 4

        def rate(tau: float, weight: float, dq: Float, dpi: Float) -> tuple[Float, Float]:
            moved, p = system.moved(shape, dq), z.pi + dpi
            c = system.basis(moved)
            v = system.forward(c, p)
            work.spend(system.load, t + tau, weight, z, dq, v)
            return v, -system.pull(c, system.gradient(moved), t + tau, z, dq, p)

        q1, p1 = rate(0.0, h / 6, np.zeros_like(z.hi), np.zeros_like(z.pi))
        q2, p2 = rate(h / 2, h / 3, h / 2 * q1, h / 2 * p1)
        q3, p3 = rate(h / 2, h / 3, h / 2 * q2, h / 2 * p2)
        q4, p4 = rate(h, h / 6, h * q3, h * p3)
        dq, dpi = (h / 6 * (a + 2 * b + 2 * c + d) for a, b, c, d in ((q1, q2, q3, q4), (p1, p2, p3, p4)))
        return Phase(*add(z.hi, z.lo, dq), z.pi + dpi)

    @cached_property
    def parameters(self) -> "Explicit":
        return Explicit(np.array([0.0, 0.5, 0.5, 1.0, 0.0]), np.array([1.0, 2.0, 2.0, 1.0]))


class Explicit(NamedTuple):
    """Parameters of the compiled form. nodes : (5,), places of the stages in units of h, and a last 0. weights : (4,)."""

    nodes: Float
    weights: Float


class Room(NamedTuple):
    """Workspace: c, move, v, total like positions; g, kick, p like momenta."""

    c: Float
    move: Float
    v: Float
    total: Float
    g: Float
    kick: Float
    p: Float


@fill(do.room, Explicit, _nrt=True)
def _room(method: Explicit, chain: Parameters, state: Phase) -> Room:
    c, move, v, total = np.empty_like(state.hi), np.empty_like(state.hi), np.empty_like(state.hi), np.empty_like(state.hi)
    return Room(c, move, v, total, np.empty_like(state.pi), np.empty_like(state.pi), np.empty_like(state.pi))


@fill(do.step, Explicit, forceinline=True)
def _step(method: Explicit, chain: Parameters, work: Any, room: Room, before: Phase, after: Phase, t: float, h: float) -> Cost:
    c, move, v, total, g, kick, p = room
    nodes, weights, pi = method.nodes, method.weights, before.pi
    move[:], total[:], kick[:] = 0.0, 0.0, 0.0
    copy(pi, p)
    for i in range(4):
        do.basis(chain, work, move, c)
        forward(c, p, v)
        do.pullback(chain, work, before, t + nodes[i] * h, move, c, p, g)
        do.spend(chain, before, t + nodes[i] * h, weights[i] * h / 6, move, v, 1.0)
        for row in range(v.shape[0]):
            rate, so_far, to = v[row], total[row], move[row]
            for k in range(rate.size):
                so_far[k] += weights[i] * rate[k]
                to[k] = nodes[i + 1] * h * rate[k]
        for row in range(g.shape[0]):
            pull, so_far, start, to = g[row], kick[row], pi[row], p[row]
            for k in range(pull.size):
                so_far[k] += weights[i] * pull[k]
                to[k] = start[k] - nodes[i + 1] * h * pull[k]
    advance(before, total, h / 6, after)
    for row in range(g.shape[0]):
        for k in range(g.shape[1]):
            after.pi[row, k] = pi[row, k] - h / 6 * kick[row, k]
    do.settle(chain, work, after.hi, after.lo)
    return 4, 0, 0


@fill(do.jumps, Explicit)
def _jumps(method: Explicit) -> bool:
    return True
