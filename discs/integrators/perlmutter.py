"""The reversible scheme of McLachlan and Perlmutter."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from discs import checks
from discs.integrators.base import OneStep, Work
from discs.system import Phase, RollingDiscs, add


@dataclass(frozen=True)
class McLachlanPerlmutter(OneStep):
    r"""Half a drift, a kick with the ground force taken in the middle, half a drift:

    q_h = q_0 + h/2 v_0,   M (v_1 - v_0) = -h grad V(q_h) + h A(q_h)^T lambda,   q_1 = q_h + h/2 v_1,   A(q_1) v_1 = 0.

    Admissible velocities are v = C(q) pi, and C(q_h)^T annihilates A(q_h)^T, so with v_1 = C(q_1) pi_1

        C(q_h)^T M C(q_1) pi_1 = C(q_h)^T (M v_0 - h grad V(q_h)),

    one equation for each disc (and one for its heading). q_1 stands on both sides: it is iterated, from the explicit q_0 + h v_0.
    Swapping the ends of a step and the signs of the velocities gives the same equations, so the scheme is reversible. Forces are
    explicit: h is limited as for "leapfrog".

    Parameters
    ----------
    sweeps, tolerance : as for `Midpoint`; a sweep costs no solve.
    """

    sweeps: int = 50
    tolerance: float = 1e-14

    name: ClassVar[str] = "mclachlan-perlmutter"
    order: ClassVar[int] = 2
    preserves: ClassVar[str] = "reversibility; the rolling constraint at the ends of steps"
    reference: ClassVar[str] = "McLachlan, Perlmutter, J. Nonlinear Sci. 16 (2006) 283, (4.18)"
    stability_limit: ClassVar[float] = 2.0

    def __post_init__(self) -> None:
        checks.iteration(self.sweeps, self.tolerance)

    def step(self, system: RollingDiscs, z: Phase, h: float, work: Work) -> Phase:
        shape = system.shape(z.hi, z.lo)
        v = system.forward(system.frame(shape), z.pi)
        half, move = 0.5 * h * v, h * v
        middle = system.moved(shape, half)
        c = system.frame(middle)
        pull = system.back(c, system.weights * v - h * system.gradient(middle))
        for sweep in range(1, self.sweeps + 1):  # noqa: B007, counted below
            after = system.frame(system.moved(shape, move))
            pi = pull / system.back(c, system.weights * system.forward(after, np.ones_like(pull)))
            last, move = move, half + 0.5 * h * system.forward(after, pi)
            if (np.abs(move - last).max(axis=1) <= self.tolerance * system.scale).all():
                break
        work.gradients += 1
        work.unconverged += sweep == self.sweeps and self.tolerance > 0
        return Phase(*add(z.hi, z.lo, move), pi)

    def kernel(self, chain: Any, hi: NDArray, lo: NDArray, pi: NDArray, h: float, steps: int, bound: float) -> Any:
        import discs.kernels.methods as methods

        return methods.perlmutter(chain, hi, lo, pi, h, steps, self.sweeps, float(self.tolerance), bound)
