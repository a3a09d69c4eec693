"""The classical explicit Runge-Kutta method on the reduced equations."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from discs.integrators.base import OneStep, Work
from discs.system import Phase, SkewGradient, add


@dataclass(frozen=True)
class RK4(OneStep):
    """Runge-Kutta of order 4 on q' = C(q) pi, pi' = -C(q)^T grad V(q). For few discs: h must stay below about
    0.7 k^2 sqrt(rho/K)."""

    name: ClassVar[str] = "rk4"
    order: ClassVar[int] = 4
    preserves: ClassVar[str] = "the rolling constraint"
    reference: ClassVar[str] = "Kutta, Z. Math. Phys. 46 (1901) 435"
    stability_limit: ClassVar[float] = 2.8

    def step(self, system: SkewGradient, z: Phase, h: float, work: Work) -> Phase:
        shape = system.shape(z.hi, z.lo)
        work.gradients += 4

        def rate(dq: NDArray, dpi: NDArray) -> tuple[NDArray, NDArray]:
            moved = system.moved(shape, dq)
            c = system.frame(moved)
            return system.forward(c, z.pi + dpi), -system.back(c, system.gradient(moved))

        q1, p1 = rate(np.zeros_like(z.hi), np.zeros_like(z.pi))
        q2, p2 = rate(h / 2 * q1, h / 2 * p1)
        q3, p3 = rate(h / 2 * q2, h / 2 * p2)
        q4, p4 = rate(h * q3, h * p3)
        dq, dpi = (h / 6 * (a + 2 * b + 2 * c + d) for a, b, c, d in ((q1, q2, q3, q4), (p1, p2, p3, p4)))
        return Phase(*add(z.hi, z.lo, dq), z.pi + dpi)

    def kernel(self, chain: Any, hi: NDArray, lo: NDArray, pi: NDArray, h: float, steps: int, bound: float) -> Any:
        import discs.kernels.methods as methods

        return methods.rk4(chain, hi, lo, pi, h, steps, bound)
