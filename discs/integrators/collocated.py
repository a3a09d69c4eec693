"""Collocation methods in (q, pi); the compiled twin is `discs.integrators.collocation`."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.integrators.base import OneStep
from discs.integrators.collocation import Collocation
from discs.integrators.tableaux import Tableau
from discs.integrators.work import Work
from discs.skew import Load, Phase, SkewGradient, add


class Guide(ABC):
    """The frozen part of the sweeps of a step: a first guess, and linear systems with one C for all sweeps."""

    @abstractmethod
    def rates(self, p: Float) -> Float:
        """A first guess of the rates of the stages, (s, rows, n), for their momenta (s, ...)."""

    @abstractmethod
    def solve(self, value: complex, rest: Float) -> Float:
        """Solve (I + h value C^T D C + (h value)^2 C^T S C) p = rest for p, of the shape of pi."""

    @abstractmethod
    def moved(self, change: Float, before: Float, v: Float, p: Float) -> tuple[float, Float, Float]:
        """The largest move of a stage by a sweep, in units of the scale of the system, and rates and momenta for the next sweep.

        The sweep changed the momenta by `change` to p and the rates from `before` to v.
        """


class Common(Guide):
    """C in the middle of the step, extrapolated with the velocity at its start."""

    def __init__(self, system: SkewGradient, z: Phase, t: float, h: float, rule: Tableau) -> None:
        self._system, self._h = system, h
        shape = system.shape(z.hi, z.lo)
        move = 0.5 * h * system.forward(system.basis(shape), z.pi)
        middle, self._middle = system.moved(shape, move), (t + rule.nodes[rule.b.size // 2] * h, z.hi + move)
        self._c, self._secant = system.basis(middle), system.secant(middle, np.zeros_like(z.hi))

    def rates(self, p: Float) -> Float:
        return np.array([self._system.forward(self._c, stage) for stage in p])

    def solve(self, value: complex, rest: Float) -> Float:
        return self._system.solve(self._secant, self._c, self._h * self._h * value**2, rest, self._h * value, *self._middle)

    def moved(self, change: Float, before: Float, v: Float, p: Float) -> tuple[float, Float, Float]:
        far = np.abs([0.5 * self._h * self._system.forward(self._c, stage) for stage in change]).max(axis=(0, 2))
        return float((far / self._system.scale).max()), v, p


def collocate(
    system: SkewGradient, z: Phase, t: float, h: float, rule: Tableau, guide: Guide, sweeps: int, tolerance: float
) -> tuple[Phase, Float, Float, int]:
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
class Collocated(OneStep, ABC):
    r"""Stages Q_i = q_n + h sum_j a_ij C(Q_j) P_j and P_i = pi_n - h sum_j a_ij C(Q_j)^T (grad V(Q_j) - f_j), the new state

        q_{n+1} = q_n + h sum_i b_i C(Q_i) P_i,   pi_{n+1} = pi_n + sum_i (b^T a^{-1})_i (P_i - pi_n).

    A sweep evaluates C at the stages, moves the stages with it, and solves for the change of the P_i with one common C, the one in
    the middle of the step. For this C the equations are linear, with the matrix I + h a (x) C^T D C + h^2 a^2 (x) C^T S C, D the
    damping of loads. The eigenvectors of a decouple it into systems I + h lambda C^T D C + h^2 lambda^2 C^T S C, one for each real
    eigenvalue and a complex one for each pair. They are factored once per step. (With own headings S is the stiffness of the
    springs without the part due to their tension.) The sweeps do not converge if h is many times the time in which a wave passes
    from disc to disc: take "midpoint" then.

    Parameters
    ----------
    sweeps, tolerance : as for `Midpoint`.
    """

    sweeps: int = 50
    tolerance: float = 1e-12

    stages: ClassVar[int]
    stability_limit: ClassVar[float] = np.inf
    takes_motors: ClassVar[bool] = True
    in_lanes: ClassVar[bool] = True

    @property
    @abstractmethod
    def rule(self) -> Tableau:
        """The coefficients."""

    def __post_init__(self) -> None:
        checks.iteration(self.sweeps, self.tolerance)

    @property
    def sweep_tolerance(self) -> float:
        return self.tolerance

    def with_sweeps(self, tolerance: float) -> "Collocated":
        return replace(self, tolerance=tolerance) if self.tolerance else self

    def step(self, system: SkewGradient, z: Phase, t: float, h: float, work: Work) -> Phase:
        rule = self.rule
        after, v, p, sweep = collocate(system, z, t, h, rule, Common(system, z, t, h, rule), self.sweeps, self.tolerance)
        for node, b, move, rate in zip(rule.nodes, rule.b, h * _mix(rule.a, v), v, strict=True):
            work.spend(system.load, t + node * h, b * h, z, move, rate)
        if system.load is not None and system.load.axles:
            self._react(system, system.load, z, t, h, v, p, work)
        work.gradients += sweep * self.stages
        work.solves += sweep * (rule.real.size + rule.pairs.size)
        work.unconverged += sweep == self.sweeps and self.tolerance > 0
        return after

    def _react(self, system: SkewGradient, load: Load, z: Phase, t: float, h: float, v: Float, p: Float, work: Work) -> None:
        """Book the work of motors: h b_j c_j tau_j P_j, where P_i = pi_n - h sum_j a_ij (C^T (grad V - f) - c tau)_j."""
        rule, shape = self.rule, system.shape(z.hi, z.lo)
        parts = rule.nodes, rule.b, h * _mix(rule.a, v), p, _mix(rule.inverse, p - z.pi)
        for node, b, move, mean, gained in zip(*parts, strict=True):
            moved = system.moved(shape, move)
            c = system.basis(moved)
            f = load.applied(t + node * h, z.hi + (z.lo + move), system.forward(c, mean))
            work.react(load, b * (gained + h * system.back(c, system.gradient(moved) - f)), mean)

    @cached_property
    def parameters(self) -> "Collocation":
        return Collocation(self.rule, self.sweeps, float(self.tolerance))


def _mix(weights: Float, stages: Float) -> Float:
    """Sums of stages (s, ...) with weights (s,), or several with weights (m, s)."""
    mixed: Float = (weights @ stages.reshape(len(stages), -1)).reshape(*weights.shape[:-1], *stages.shape[1:])
    return mixed
