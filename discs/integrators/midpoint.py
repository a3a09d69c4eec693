"""Implicit midpoint in (q, pi), solved by sweeps with frozen geometry."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from discs import checks
from discs.integrators.base import OneStep, Work
from discs.system import Phase, SkewGradient, add

WHOLE = np.ones(1)  # the fractions of a step that a composition of this one alone takes


@dataclass(frozen=True)
class Midpoint(OneStep):
    r"""Implicit midpoint rule on q' = C pi, pi' = -C^T S q.

    q_{n+1} - q_n = h C p,   pi_{n+1} - pi_n = -h C^T S (q_n + h/2 C p),   p = (pi_n + pi_{n+1})/2,

    with C taken at (q_n + q_{n+1})/2. For a frozen C the step is linear; eliminating q leaves one symmetric positive
    definite banded system in p,

        (I + h^2/4 C^T S C) p = pi_n - h/2 C^T S q_n.

    A sweep solves it and takes C again at the midpoint it gives. The energy is exact after any number of sweeps, since
    H is quadratic and the same C stands in both equations; the step is the midpoint rule, and reversible, when the
    sweeps have converged.

    Where V is not quadratic the step's secant takes the place of S, and the energy is exact when the sweeps have converged, not
    before. Then the matrix only guides the way there: that of the first sweep serves all of a step's sweeps. (Measured on rods
    with own headings, slack and stiff, h = k ... 16k: no sweep more than with a new matrix for each, and the factors saved are
    nearly half of a sweep.)

    The matrix has entries up to h^2 K/(M k^4) and costs a solve as many digits. So a sweep solves for the change of p,
    with the right side pi_n - p - h/2 C^T grad V(q_n + h/2 C p) formed from the links: the digits lost are those of a
    small change, and the energy keeps 13 to 15 digits where solving for p itself kept 8 to 10.

    Parameters
    ----------
    sweeps : the most sweeps in one step.
    tolerance : a step is converged when a sweep changes no move of the step by more than this part of the chain's length,
        or of a radian; 0 makes every step take all `sweeps`.
    """

    sweeps: int = 50
    tolerance: float = 1e-12

    name: ClassVar[str] = "midpoint"
    order: ClassVar[int] = 2
    preserves: ClassVar[str] = "energy exactly; the rolling constraint; reversible when converged"
    reference: ClassVar[str] = "Hairer, Lubich, Wanner, Geometric Numerical Integration, IV.2"
    stability_limit: ClassVar[float] = np.inf

    def __post_init__(self) -> None:
        checks.iteration(self.sweeps, self.tolerance)

    def step(self, system: SkewGradient, z: Phase, h: float, work: Work) -> Phase:
        shape = system.shape(z.hi, z.lo)
        p, move = z.pi, 0.5 * h * system.forward(system.frame(shape), z.pi)
        guide: tuple[Any, Any] | None = None
        for sweep in range(1, self.sweeps + 1):  # noqa: B007, counted below
            c = system.frame(system.moved(shape, move))
            secant = system.secant(shape, h * system.forward(c, p))
            if guide is None or system.quadratic:
                guide = secant, c
            change = system.solve(*guide, 0.25 * h * h, z.pi - p - 0.5 * h * system.back(c, system.mean_force(secant)))
            p = p + change
            last, move = move, 0.5 * h * system.forward(c, p)
            if (np.abs(move - last).max(axis=1) <= self.tolerance * system.scale).all():
                break
        work.gradients += sweep
        work.solves += sweep
        work.unconverged += sweep == self.sweeps and self.tolerance > 0
        return Phase(*add(z.hi, z.lo, 2 * move), 2 * p - z.pi)

    def kernel(self, chain: Any, hi: NDArray, lo: NDArray, pi: NDArray, h: float, steps: int, bound: float) -> Any:
        import discs.kernels.methods as methods

        return methods.compose(chain, hi, lo, pi, WHOLE, h, steps, self.sweeps, float(self.tolerance), bound)
