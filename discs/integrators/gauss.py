"""Collocation at Gauss points."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from discs import checks
from discs.integrators.base import OneStep, Work
from discs.integrators.collocation import Collocation, Tableau, tableau
from discs.skew import Phase, SkewGradient, add


class Guide(ABC):
    """What guides the sweeps of a step: a first guess, and a C that does not change from sweep to sweep."""

    @abstractmethod
    def rates(self, p: NDArray) -> NDArray:
        """A first guess of the rates of the stages, (s, rows, n), for their momenta (s, ...)."""

    @abstractmethod
    def solve(self, value: complex, rest: NDArray) -> NDArray:
        """Solve (I + h value C^T D C + (h value)^2 C^T S C) p = rest for p, of the shape of pi."""

    @abstractmethod
    def moved(self, change: NDArray, before: NDArray, v: NDArray, p: NDArray) -> tuple[float, NDArray, NDArray]:
        """How far a sweep moved the stages, in units of the system's scale, and rates and momenta to go on with.

        The sweep changed the momenta by `change` to p and the rates from `before` to v.
        """


class Common(Guide):
    """C in the middle of the step, by the velocity at its start."""

    def __init__(self, system: SkewGradient, z: Phase, h: float) -> None:
        self._system, self._h = system, h
        shape = system.shape(z.hi, z.lo)
        middle = system.moved(shape, 0.5 * h * system.forward(system.basis(shape), z.pi))
        self._c, self._secant = system.basis(middle), system.secant(middle, np.zeros_like(z.hi))

    def rates(self, p: NDArray) -> NDArray:
        return np.array([self._system.forward(self._c, stage) for stage in p])

    def solve(self, value: complex, rest: NDArray) -> NDArray:
        return self._system.solve(self._secant, self._c, self._h * self._h * value**2, rest, self._h * value)

    def moved(self, change: NDArray, before: NDArray, v: NDArray, p: NDArray) -> tuple[float, NDArray, NDArray]:
        far = np.abs([0.5 * self._h * self._system.forward(self._c, stage) for stage in change]).max(axis=(0, 2))
        return float((far / self._system.scale).max()), v, p


def collocate(
    system: SkewGradient, z: Phase, t: float, h: float, rule: Tableau, guide: Guide, sweeps: int, tolerance: float
) -> tuple[Phase, NDArray, NDArray, int]:
    """The state a time h after z at t, the rates (s, rows, n) and momenta (s, ...) of the stages, and the number of sweeps."""
    shape = system.shape(z.hi, z.lo)
    parts = [
        *zip(rule.real, rule.real_in, rule.real_out, strict=True),
        *zip(rule.pairs, rule.pairs_in, rule.pairs_out, strict=True),
    ]
    p = np.array([z.pi] * rule.b.size)
    v = guide.rates(p)
    for sweep in range(1, sweeps + 1):  # noqa: B007, returned
        c = system.bases(shape, h * _mix(rule.a, v))
        force = system.pulls(c, shape, t + h * rule.nodes, z, h * _mix(rule.a, system.forwards(c, p)), p)
        rest = z.pi - p - h * _mix(rule.a, force)
        change = np.zeros_like(p)
        for value, into, out in parts:
            change += np.multiply.outer(out, guide.solve(value, _mix(into, rest))).real
        p, before = p + change, v
        moved, v, p = guide.moved(change, before, system.forwards(c, p), p)
        if moved <= tolerance:
            break
    return Phase(*add(z.hi, z.lo, h * _mix(rule.b, v)), z.pi + _mix(rule.last, p - z.pi)), v, p, sweep


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
        rule = tableau(self.stages)
        after, _, _, sweep = collocate(system, z, t, h, rule, Common(system, z, h), self.sweeps, self.tolerance)
        work.gradients += sweep * self.stages
        work.solves += sweep * (rule.real.size + rule.pairs.size)
        work.unconverged += sweep == self.sweeps and self.tolerance > 0
        return after

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
