"""Collocation at Gauss points."""

from abc import ABC
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from discs import checks
from discs.integrators.base import OneStep, Work
from discs.integrators.collocation import Collocation, tableau
from discs.skew import Phase, SkewGradient, add


@dataclass(frozen=True)
class Gauss(OneStep, ABC):
    r"""Stages Q_i = q_n + h sum_j a_ij C(Q_j) P_j and P_i = pi_n - h sum_j a_ij C(Q_j)^T grad V(Q_j), the new state

        q_{n+1} = q_n + h sum_i b_i C(Q_i) P_i,   pi_{n+1} = pi_n + sum_i (b^T a^{-1})_i (P_i - pi_n).

    Gauss methods conserve quadratic invariants, H with linear curvature among them.

    A sweep takes C at the stages' positions, lets it carry them on, and solves for the change of the P_i with one common C,
    that in the middle of the step: for this C the equations are linear, I + h^2 a^2 (x) C^T S C, and fall apart along the
    eigenvectors of a into systems I + h^2 lambda^2 C^T S C, one complex one for each pair. They are factored once a step. (With
    own headings S is the springs' stiffness without what their tension adds.) Unlike in a midpoint step the energy is exact
    only when the sweeps have converged; when h is many times larger than the time in which a wave passes from disc to disc they
    do not: take "midpoint" then.

    Parameters
    ----------
    sweeps, tolerance : as for `Midpoint`.
    """

    sweeps: int = 50
    tolerance: float = 1e-12

    stages: ClassVar[int]
    preserves: ClassVar[str] = "energy exactly where V is quadratic; the rolling constraint; reversible"
    reference: ClassVar[str] = "Hairer, Lubich, Wanner, Geometric Numerical Integration, II.1.3, IV.2, VIII.6"
    stability_limit: ClassVar[float] = np.inf

    def __post_init__(self) -> None:
        checks.iteration(self.sweeps, self.tolerance)

    @property
    def sweep_tolerance(self) -> float:
        return self.tolerance

    def with_sweeps(self, tolerance: float) -> "Gauss":
        return replace(self, tolerance=tolerance) if self.tolerance else self

    def step(self, system: SkewGradient, z: Phase, t: float, h: float, work: Work) -> Phase:
        a, b, nodes, last, real, real_in, real_out, pairs, pairs_in, pairs_out = tableau(self.stages)
        shape = system.shape(z.hi, z.lo)
        middle = system.moved(shape, 0.5 * h * system.forward(system.basis(shape), z.pi))
        common = system.basis(middle)
        secant = system.secant(middle, np.zeros_like(z.hi))
        parts = [*zip(real, real_in, real_out, strict=True), *zip(pairs, pairs_in, pairs_out, strict=True)]
        p = np.array([z.pi] * self.stages)
        v = np.array([system.forward(common, stage) for stage in p])
        for sweep in range(1, self.sweeps + 1):  # noqa: B007, counted below
            c = system.bases(shape, h * _mix(a, v))
            force = system.pulls(c, shape, t + h * nodes, z, h * _mix(a, system.forwards(c, p)), p)
            rest = z.pi - p - h * _mix(a, force)
            change = np.zeros_like(p)
            for value, into, out in parts:
                part = system.solve(secant, common, h * h * value**2, _mix(into, rest), h * value)
                change += np.multiply.outer(out, part).real
            p = p + change
            v = system.forwards(c, p)
            moved = np.abs([0.5 * h * system.forward(common, stage) for stage in change]).max(axis=(0, 2))
            if (moved <= self.tolerance * system.scale).all():
                break
        work.gradients += sweep * self.stages
        work.solves += sweep * len(parts)
        work.unconverged += sweep == self.sweeps and self.tolerance > 0
        return Phase(*add(z.hi, z.lo, h * _mix(b, v)), z.pi + _mix(last, p - z.pi))

    @cached_property
    def parameters(self) -> "Collocation":
        return Collocation(tableau(self.stages), self.sweeps, float(self.tolerance))


def _mix(weights: NDArray, stages: NDArray) -> NDArray:
    """Sums of stages (s, ...) with weights (s,) or (m, s)."""
    return (weights @ stages.reshape(len(stages), -1)).reshape(*weights.shape[:-1], *stages.shape[1:])


class Gauss4(Gauss):
    """Two stages."""

    name: ClassVar[str] = "gauss4"
    order: ClassVar[int] = 4
    stages: ClassVar[int] = 2


class Gauss6(Gauss):
    """Three stages."""

    name: ClassVar[str] = "gauss6"
    order: ClassVar[int] = 6
    stages: ClassVar[int] = 3


class Gauss8(Gauss):
    """Four stages."""

    name: ClassVar[str] = "gauss8"
    order: ClassVar[int] = 8
    stages: ClassVar[int] = 4
