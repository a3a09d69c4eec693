"""The paper's explicit two-step scheme."""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from discs.arrays import Float
from discs.chains.rolling_discs import RollingDiscs
from discs.integrators.base import FixedStep
from discs.integrators.rk4 import RK4
from discs.integrators.work import Frame, Work
from discs.kernels import protocol as do
from discs.kernels.compiled import Cost, fill
from discs.kernels.shared import add as advance
from discs.kernels.shared import back, columns, copy, forward, square
from discs.skew import Parameters, Phase, add


class TwoStep(NamedTuple):
    """The memory of the scheme: q_n = hi + lo, and the moves q_n - q_{n-1} and q_{n+1} - q_n, all (rows, n)."""

    hi: Float
    lo: Float
    last: Float
    next: Float


@dataclass(frozen=True)
class Leapfrog(FixedStep):
    r"""Central differences in time with the constraint at n, the paper's section 4.3 ((discconstr1), (discconstr2)):

    M (q_{n+1} - 2 q_n + q_{n-1})/h^2 = -S q_n + A(q_n)^T lambda,   A(q_n) (q_{n+1} - q_{n-1}) = 0.

    With q* = 2 q_n - q_{n-1} - h^2 M^{-1} S q_n, the admissible move is the projection of q* - q_{n-1}, and C^T M C = 1:
    q_{n+1} - q_{n-1} = C C^T M (q* - q_{n-1}). For a disc, (alpha + rho |e|^2) u = rho e.(r* - r_{n-1}) + alpha (theta* -
    theta_{n-1}) and a move (e, 1) u.

    It conserves the "modified_energy" |v|^2/2 + V(q_n, q_{n+1}) exactly, with v = (q_{n+1} - q_n)/h in the norm of the masses and V
    the bilinear form. (Multiply by q_{n+1} - q_{n-1}, which A annihilates.) It needs h <= k^2/2 sqrt(rho/K). It has a parasitic
    mode: the part of v that violates the constraint can change its sign every step, and grow.

    Loads that are part of the energy are forces like those of springs. The first move and frames between steps are computed by a
    Runge-Kutta step. Velocities at frames are the central differences (q_{n+1} - q_{n-1})/2h.
    """

    name: ClassVar[str] = "leapfrog"
    order: ClassVar[int] = 2
    preserves: ClassVar[str] = "a modified energy exactly; the rolling constraint of the central differences"
    reference: ClassVar[str] = "Vankerschaver, A class of nonholonomic kinematic constraints in elasticity, section 4.3"
    stability_limit: ClassVar[float] = 2.0
    takes_loads: ClassVar[bool] = False
    offers: ClassVar[tuple[str, ...]] = ("modified_energy",)

    def begin(self, system: RollingDiscs, z: Phase, h: float, work: Work, chain: Parameters = None) -> TwoStep:
        first = RK4().step(system, z, 0.0, h, work)
        move = (first.hi - z.hi) + (first.lo - z.lo)
        central = 2 * h * system.forward(system.basis(system.shape(z.hi, z.lo)), z.pi)
        return TwoStep(z.hi, z.lo, central - move, move)

    def advance(self, system: RollingDiscs, memory: TwoStep, t: float, h: float, work: Work) -> TwoStep:
        hi, lo = add(memory.hi, memory.lo, memory.next)
        shape = system.shape(hi, lo)
        c = system.basis(shape)
        gradient = system.gradient(shape)
        if system.load is not None:
            gradient = gradient - system.load.force(t + h, hi + lo, 0 * hi)
        free = 2 * system.weights * memory.next - h * h * gradient  # M (q* - q_{n-1})
        work.gradients += 1
        return TwoStep(hi, lo, memory.next, system.forward(c, system.back(c, free)) - memory.next)

    @property
    def parameters(self) -> "Central":
        return CENTRAL

    def at(
        self, system: RollingDiscs, memory: TwoStep, t: float, tau: float, h: float, work: Work, chain: Parameters = None
    ) -> Frame:
        rate = (memory.last + memory.next) / (2 * h)
        if not tau:
            return Frame(memory.hi, memory.lo, rate)
        return RK4().at(system, self._phase(system, memory, rate), t, tau, h, work, chain)

    def finer(self, system: RollingDiscs, memory: TwoStep, t: float, h: float, chain: Parameters = None) -> Float:
        return RK4().finer(system, self._phase(system, memory, (memory.last + memory.next) / (2 * h)), t, h, chain)

    def _phase(self, system: RollingDiscs, memory: TwoStep, rate: Float) -> Phase:
        pi = system.back(system.basis(system.shape(memory.hi, memory.lo)), system.weights * rate)
        return Phase(memory.hi, memory.lo, pi)

    def kinetic(self, system: RollingDiscs, memory: TwoStep, h: float) -> float:
        return system.kinetic(memory.next / h)

    def keep(self, memory: TwoStep) -> dict[str, Any]:
        return memory._asdict()

    def recall(self, memory: TwoStep, kept: dict[str, Any]) -> TwoStep:
        return TwoStep(**kept)

    def extras(self, system: RollingDiscs, memory: TwoStep, h: float) -> dict[str, float]:
        shape = system.shape(memory.hi, memory.lo)
        polarised = system.polarised(shape, system.moved(shape, memory.next))
        if (load := system.load) is not None:  # of a quadratic U the same bilinear form
            q = memory.hi + memory.lo
            ends = load.potential(0.0, q) + load.potential(0.0, q + memory.next)
            polarised += 2 * load.potential(0.0, q + 0.5 * memory.next) - 0.5 * ends
        return {"modified_energy": self.kinetic(system, memory, h) + polarised}


class Central(NamedTuple):
    """Parameters of the compiled form. weight : of `next` in M (q* - q_{n-1})."""

    weight: float


CENTRAL = Central(2.0)


class Room(NamedTuple):
    """Workspace: c, still (zero), g like positions; p like momenta."""

    c: Float
    still: Float
    g: Float
    p: Float


@fill(do.room, Central, _nrt=True)
def _room(method: Central, chain: Parameters, state: TwoStep) -> Room:
    q = state.hi
    return Room(np.empty_like(q), np.zeros_like(q), np.empty_like(q), np.empty((columns(q.shape[0]), q.shape[1])))


@fill(do.step, Central, forceinline=True)
def _step(method: Central, chain: Parameters, work: Any, room: Room, before: TwoStep, after: TwoStep, t: float, h: float) -> Cost:
    c, still, g, p = room
    advance(before, before.next, 1.0, after)
    do.settle(chain, work, after.hi, after.lo)
    do.basis(chain, work, still, c)
    do.gradient(chain, work, still, g)
    for row in range(g.shape[0]):
        w, move, to = chain.weights[row], before.next[row], g[row]
        for k in range(to.size):
            to[k] = method.weight * w[k] * move[k] - h * h * to[k]
    back(c, g, p)
    do.push(chain.load, after, t + h, still, c, p, h * h, p)
    copy(before.next, after.last)
    forward(c, p, after.next)
    for row in range(g.shape[0]):
        last, to = before.next[row], after.next[row]
        for k in range(to.size):
            to[k] -= last[k]
    return 1, 0, 0


@fill(do.jumps, Central)
def _jumps(method: Central) -> bool:
    return False  # its moves are its velocities


@fill(do.like, TwoStep, _nrt=True)
def _like(state: TwoStep) -> TwoStep:
    return TwoStep(np.empty_like(state.hi), np.empty_like(state.lo), np.empty_like(state.last), np.empty_like(state.next))


@fill(do.take, TwoStep)
def _take(state: TwoStep, to: TwoStep) -> None:
    copy(state.hi, to.hi)
    copy(state.lo, to.lo)
    copy(state.last, to.last)
    copy(state.next, to.next)


@fill(do.kinetic, TwoStep)
def _kinetic(state: TwoStep, chain: Parameters, h: float) -> float:
    total = 0.0
    for row in range(state.next.shape[0]):
        total += square(chain.weights[row], state.next[row])
    return 0.5 * total / (h * h)


@fill(do.rate, TwoStep)
def _rate(state: TwoStep, chain: Parameters, work: Any, c: Float, tau: float, move: Float) -> None:
    copy(state.next, move)


@fill(do.kick, TwoStep)
def _kick(
    before: TwoStep, after: TwoStep, chain: Parameters, work: Any, t: float, h: float, c: Float, g: Float, defect: Float
) -> None:
    defect[:] = np.inf  # a run of so few steps is always compared
