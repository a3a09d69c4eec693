"""The reversible scheme of McLachlan and Perlmutter."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.chains.rolling_discs import RollingDiscs
from discs.integrators.base import OneStep
from discs.integrators.work import Work
from discs.kernels import protocol as do
from discs.kernels.compiled import CUT, Cost, fill
from discs.kernels.interrupts import interrupted
from discs.kernels.shared import add as advance
from discs.kernels.shared import back, forward, largest, stuck, unsettled
from discs.skew import Phase, add


@dataclass(frozen=True)
class McLachlanPerlmutter(OneStep):
    r"""A half drift, a kick with the ground force of the middle, a half drift:

    q_h = q_0 + h/2 v_0,   M (v_1 - v_0) = -h grad V(q_h) + h A(q_h)^T lambda,   q_1 = q_h + h/2 v_1,   A(q_1) v_1 = 0.

    Admissible velocities are v = C(q) pi, and C(q_h)^T annihilates A(q_h)^T, so with v_1 = C(q_1) pi_1

        C(q_h)^T M C(q_1) pi_1 = C(q_h)^T (M v_0 - h grad V(q_h)),

    one equation for each disc (and one for its heading). q_1 is on both sides and is found by iteration from q_0 + h v_0.
    The equations do not change if the ends of a step are exchanged and velocities change sign: the scheme is reversible. Forces are
    explicit, so h is limited as for "leapfrog".

    Parameters
    ----------
    sweeps, tolerance : as for `Midpoint`; a sweep needs no solve.
    """

    sweeps: int = 50
    tolerance: float = 1e-14

    name: ClassVar[str] = "mclachlan-perlmutter"
    order: ClassVar[int] = 2
    preserves: ClassVar[str] = "reversibility; the rolling constraint at the ends of steps"
    reference: ClassVar[str] = "McLachlan, Perlmutter, J. Nonlinear Sci. 16 (2006) 283, (4.18)"
    stability_limit: ClassVar[float] = 2.0
    takes_loads: ClassVar[bool] = False

    def __post_init__(self) -> None:
        checks.iteration(self.sweeps, self.tolerance)

    def step(self, system: RollingDiscs, z: Phase, t: float, h: float, work: Work) -> Phase:
        shape = system.shape(z.hi, z.lo)
        v = system.forward(system.basis(shape), z.pi)
        half, move = 0.5 * h * v, h * v
        middle = system.moved(shape, half)
        c = system.basis(middle)
        gradient = system.gradient(middle)
        if system.load is not None:
            gradient = gradient - system.load.force(t + 0.5 * h, z.hi + (z.lo + half), v)
        pull = system.back(c, system.weights * v - h * gradient)
        for sweep in range(1, self.sweeps + 1):  # noqa: B007, counted below
            after = system.basis(system.moved(shape, move))
            pi = pull / system.back(c, system.weights * system.forward(after, np.ones_like(pull)))
            last, move = move, half + 0.5 * h * system.forward(after, pi)
            if (np.abs(move - last).max(axis=1) <= self.tolerance * system.scale).all():
                break
        work.gradients += 1
        work.unconverged += sweep == self.sweeps and self.tolerance > 0
        return Phase(*add(z.hi, z.lo, move), pi)

    @cached_property
    def parameters(self) -> "Swept":
        return Swept(self.sweeps, float(self.tolerance))


class Swept(NamedTuple):
    """Parameters of the compiled form: the limits of the iteration."""

    sweeps: int
    tolerance: float


class Room(NamedTuple):
    """Workspace: c, after, still (zero), half, move, v, g like positions; pull, share, ones like momenta; change (n,)."""

    c: Float
    after: Float
    still: Float
    half: Float
    move: Float
    v: Float
    g: Float
    pull: Float
    share: Float
    ones: Float
    change: Float


@fill(do.room, Swept, _nrt=True)
def _room(method: Swept, chain: Any, state: Phase) -> Room:
    q, pi = state.hi, state.pi
    one, two, three, four, five, six = (
        np.empty_like(q),
        np.empty_like(q),
        np.empty_like(q),
        np.empty_like(q),
        np.empty_like(q),
        np.empty_like(q),
    )
    return Room(
        one,
        two,
        np.zeros_like(q),
        three,
        four,
        five,
        six,
        np.empty_like(pi),
        np.empty_like(pi),
        np.ones_like(pi),
        np.empty(q.shape[1]),
    )


@fill(do.step, Swept, forceinline=True)
def _step(method: Swept, chain: Any, work: Any, room: Room, before: Phase, after: Phase, t: float, h: float) -> Cost:
    c, end, still, half, move, v, g, pull, share, ones, change = room
    do.basis(chain, work, still, c)
    forward(c, before.pi, v)
    for row in range(v.shape[0]):
        rate, part, whole = v[row], half[row], move[row]
        for k in range(rate.size):
            part[k] = 0.5 * h * rate[k]
            whole[k] = 2 * part[k]
    do.basis(chain, work, half, c)
    do.gradient(chain, work, half, g)
    for row in range(v.shape[0]):
        w, rate, to = chain.weights[row], v[row], g[row]
        for k in range(to.size):
            to[k] = w[k] * rate[k] - h * to[k]
    back(c, g, pull)
    do.push(chain.load, before, t + 0.5 * h, half, c, before.pi, h, pull)
    sweep, moved = 0, np.inf
    while unsettled(method, sweep, moved):
        if interrupted(before.hi.size):
            return CUT
        sweep += 1
        do.basis(chain, work, move, end)
        forward(end, ones, v)
        for row in range(v.shape[0]):
            w, to = chain.weights[row], v[row]
            for k in range(to.size):
                to[k] *= w[k]
        back(c, v, share)
        for row in range(pull.shape[0]):
            a, b, to = pull[row], share[row], after.pi[row]
            for k in range(to.size):
                to[k] = a[k] / b[k]
        forward(end, after.pi, v)
        moved = 0.0
        for row in range(v.shape[0]):
            rate, part, whole = v[row], half[row], move[row]
            for k in range(rate.size):
                new = part[k] + 0.5 * h * rate[k]
                change[k] = abs(new - whole[k])
                whole[k] = new
            moved = max(moved, largest(change) / chain.scale[row])
    advance(before, move, 1.0, after)
    do.settle(chain, work, after.hi, after.lo)
    return 1, 0, stuck(method, sweep)


@fill(do.jumps, Swept)
def _jumps(method: Swept) -> bool:
    return True
