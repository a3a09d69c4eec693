"""The paper's explicit two-step scheme."""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from numpy.typing import NDArray

from discs.integrators.base import FixedStep, Frame, Tally, Work, tally
from discs.integrators.rk4 import RK4
from discs.system import Phase, RollingDiscs, add


class TwoStep(NamedTuple):
    """What the scheme remembers: q_n = hi + lo, and the moves q_n - q_{n-1} and q_{n+1} - q_n, all (3, n)."""

    hi: NDArray
    lo: NDArray
    last: NDArray
    next: NDArray


@dataclass(frozen=True)
class Leapfrog(FixedStep):
    r"""Central differences in time with the constraint at n, the paper's section 4.3 ((discconstr1), (discconstr2)):

    M (q_{n+1} - 2 q_n + q_{n-1})/h^2 = -S q_n + A(q_n)^T lambda,   A(q_n) (q_{n+1} - q_{n-1}) = 0.

    With q* = 2 q_n - q_{n-1} - h^2 M^{-1} S q_n, the admissible move is the projection of q* - q_{n-1}, and C^T M C = 1:
    q_{n+1} - q_{n-1} = C C^T M (q* - q_{n-1}). For a disc, (alpha + rho |e|^2) u = rho e.(r* - r_{n-1}) + alpha (theta* -
    theta_{n-1}) and a move (e, 1) u.

    It conserves |v|^2/2 + V(q_n, q_{n+1}) exactly, v = (q_{n+1} - q_n)/h weighed with the masses and V the bilinear form
    ("modified_energy"): multiply by q_{n+1} - q_{n-1}, which A annihilates. It needs h <= k^2/2 sqrt(rho/K), and carries
    a parasitic mode: the part of v off the constraint can flip its sign every step, and grow.

    The move before the first one and frames between steps come from a Runge-Kutta step; velocities at frames are the
    central differences (q_{n+1} - q_{n-1})/2h.
    """

    name: ClassVar[str] = "leapfrog"
    order: ClassVar[int] = 2
    preserves: ClassVar[str] = "a modified energy exactly; the rolling constraint of the central differences"
    reference: ClassVar[str] = "Vankerschaver, A class of nonholonomic kinematic constraints in elasticity, section 4.3"
    stability_limit: ClassVar[float] = 2.0
    offers: ClassVar[tuple[str, ...]] = ("modified_energy",)

    def begin(self, system: RollingDiscs, z: Phase, h: float, work: Work, chain: Any = None) -> TwoStep:
        first = RK4().step(system, z, h, work)
        move = (first.hi - z.hi) + (first.lo - z.lo)
        central = 2 * h * system.forward(system.frame(system.shape(z.hi, z.lo)), z.pi)
        return TwoStep(z.hi, z.lo, central - move, move)

    def advance(self, system: RollingDiscs, memory: TwoStep, h: float, work: Work) -> TwoStep:
        hi, lo = add(memory.hi, memory.lo, memory.next)
        shape = system.shape(hi, lo)
        c = system.frame(shape)
        free = 2 * system.weights * memory.next - h * h * system.gradient(shape)  # M (q* - q_{n-1})
        work.gradients += 1
        return TwoStep(hi, lo, memory.next, system.forward(c, system.back(c, free)) - memory.next)

    def march(self, chain: Any, memory: TwoStep, h: float, steps: int, bound: float) -> tuple[TwoStep, Tally]:
        import discs.kernels.methods as methods

        after = TwoStep(*(array.copy() for array in memory))
        return after, tally(methods.leapfrog(chain, *after, h, steps, bound))

    def at(self, system: RollingDiscs, memory: TwoStep, tau: float, h: float, work: Work, chain: Any = None) -> Frame:
        rate = (memory.last + memory.next) / (2 * h)
        if not tau:
            return Frame(memory.hi, memory.lo, rate)
        return RK4().at(system, self._phase(system, memory, rate), tau, h, work, chain)

    def finer(self, system: RollingDiscs, memory: TwoStep, h: float, chain: Any = None) -> NDArray:
        rate = (memory.last + memory.next) / (2 * h)
        return RK4().at(system, self._phase(system, memory, rate), h, h, Work(), chain).hi

    def _phase(self, system: RollingDiscs, memory: TwoStep, rate: NDArray) -> Phase:
        pi = system.back(system.frame(system.shape(memory.hi, memory.lo)), system.weights * rate)
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
        return {"modified_energy": self.kinetic(system, memory, h) + polarised}
