r"""The tangent of a step, and its transpose: how a small change of the state before a step changes the state after it.

A Gauss method with coefficients a, b and times c solves Y_i = y + h sum_j a_ij F(Y_j) and returns y + h sum_j b_j F(Y_j). With the
matrices A_j of the linearised equations at its stages, the tangent T is exactly

    M dY = (dy, ..., dy),   T dy = dy + h sum_j b_j A_j dY_j,   M = 1 - h (a x 1) diag(A_1, ..., A_s),

and its transpose is T^T w = w + sum_j u_j with M^T u = h (b_1 A_1^T w, ..., b_s A_s^T w). M is sparse, with the bands of the step:
T dy and T^T w take O(n). One stage is the midpoint rule; `midpoint` steps are the same for the linear curvature, where V is
quadratic (otherwise they take a mean force that keeps the energy).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs import checks
from discs.analysis.linear import Linearised
from discs.analysis.stages import At, ConstantEquations, Equations, equations
from discs.analysis.steady import Steady
from discs.analysis.steps import Steps
from discs.arrays import Float, Matrix
from discs.integrators import find
from discs.integrators.tableaux import Tableau
from discs.kernels.background import missing, usual
from discs.problem import Problem
from discs.running.engine import plain_because
from discs.running.failure import SimulationError
from discs.skew import Phase

METHODS = ("midpoint", "gauss4", "gauss6", "gauss8")
TOLERANCE = 1e-13  # of sweeps, relative


@dataclass(frozen=True, eq=False)
class Tangent:
    """The tangent of one step.

    matrices : of the linearised equations at the stages, sparse (size, size). factors : of M.
    """

    table: Tableau
    h: float
    matrices: list[Matrix]
    factors: Any

    def forward(self, dy: Float) -> Float:
        """T dy, for dy (size,) or (size, m)."""
        s, size = len(self.matrices), len(dy)
        stages = self.factors.solve(np.concatenate([dy] * s))
        parts = [
            b * (a @ stages[j * size : (j + 1) * size]) for j, (a, b) in enumerate(zip(self.matrices, self.table.b, strict=True))
        ]
        found: Float = dy + self.h * np.sum(parts, axis=0)
        return found

    def back(self, w: Float) -> Float:
        """T^T w, for w (size,) or (size, m)."""
        found: Float = w + self.stages_back(w).sum(axis=0)
        return found

    def stages_back(self, w: Float) -> Float:
        """u, (s, size) or (s, size, m): what changes of the stages' positions in phase space would add to w . y after the step."""
        right = np.concatenate([self.h * b * (a.T @ w) for a, b in zip(self.matrices, self.table.b, strict=True)])
        found: Float = self.factors.solve(right, "T").reshape(-1, *w.shape)
        return found

    def rates_back(self, w: Float, u: Float) -> Float:
        """What changes of the stages' rates would add to w . y after the step: h (b_i w + sum_j a_ji u_j), of the shape of u."""
        found: Float = self.h * (np.multiply.outer(self.table.b, w) + np.tensordot(self.table.a.T, u, 1))
        return found


def tangent(table: Tableau, h: float, stages: Sequence[Linearised]) -> Tangent:
    """The tangent of a step with these equations at its stages."""
    matrices = [lin.matrix for lin in stages]
    blocks = [[-h * weight * matrix for weight, matrix in zip(row, matrices, strict=True)] for row in table.a]
    whole = scipy.sparse.block_array(blocks, format="csc")
    factors = scipy.sparse.linalg.splu(scipy.sparse.eye_array(whole.shape[0], format="csc") + whole)
    return Tangent(table, h, matrices, factors)


@dataclass(frozen=True, eq=False)
class Swept:
    """The same by compiled sweeps; by the sparse matrix where these do not converge."""

    table: Tableau
    h: float
    equations: ConstantEquations
    at: At

    @cached_property
    def _sparse(self) -> Tangent:
        return tangent(self.table, self.h, self.equations.each(self.at.q, self.at.pi, self.at.t))

    @cached_property
    def _given(self) -> Any:
        return self.equations.compiled(self.at)

    def forward(self, dy: Float) -> Float:
        """T dy, for dy (size,) or (size, m)."""
        from discs.kernels.tangent import forward  # numba is slow to import

        columns, s = dy.reshape(len(dy), -1).T, self.table.b.size
        found = []
        for column in columns:
            right = np.array([column] * s)
            y = right.copy()
            if forward(self.table, self._given, self.equations.order, self.h, TOLERANCE, right, y) < 0:
                return self._sparse.forward(dy)
            found.append(column + self.table.last @ (y - column))
        return np.array(found).T.reshape(dy.shape)

    def back(self, w: Float) -> Float:
        """T^T w, for w (size,) or (size, m)."""
        found = [back(self.table, self.h, self.equations, self.at, column, True)[0] for column in w.reshape(len(w), -1).T]
        return np.array(found).T.reshape(w.shape)


def back(
    table: Tableau, h: float, equations: Equations, at: At, value: Float, compiled: bool, seeds: dict[int, Float] | None = None
) -> tuple[Float, Float]:
    """A derivative by the state, (size,), taken back from the end of some steps to their start, and M of their stages.

    Parameters
    ----------
    at : the stages of the steps, one step after the other. seeds : what is added to the value before it is taken back through the
        step of that number.

    Returns
    -------
    (size,), and (stages, size): what changes of the rates of the stages would add to the cost.
    """
    s, value, seeds = table.b.size, value.copy(), seeds or {}
    steps = len(at.q) // s
    multipliers = np.empty((steps, s, value.size))
    compiled = compiled and isinstance(equations, ConstantEquations)
    if compiled:
        from discs.kernels.tangent import back as sweep  # numba is slow to import

        given, order = equations.compiled(at), equations.order  # type: ignore[attr-defined]
        rows, index = np.array([*seeds.values()]).reshape(-1, value.size), np.full(steps, -1)
        index[list(seeds)] = np.arange(len(seeds))
    last = steps
    while last:
        if compiled:
            done = sweep(table, given, order, h, TOLERANCE, rows, index[:last], value, multipliers[:last])
            if done < 0:
                raise KeyboardInterrupt
            last -= done
            if not last:
                break
        elif last - 1 in seeds:
            value += seeds[last - 1]
        part = slice((last - 1) * s, last * s)
        one = tangent(table, h, equations.each(at.q[part], at.pi[part], at.t[part]))
        u = one.stages_back(value)
        multipliers[last - 1], value = one.rates_back(value, u), value + u.sum(axis=0)
        last -= 1
    return value, multipliers.reshape(steps * s, -1)


def ready(problem: Problem, integrator: Any, engine: str | None = None) -> bool:
    """Whether the kernels of steps and tangents are there; with the engine "compiled" they are, as it waits.

    engine : as for `simulate`; None for the usual one.
    """
    engine = engine or usual()
    if plain_because(problem, integrator, engine, ()):
        return False
    if engine != "compiled":
        return not missing(prepare, problem, integrator, compiles=engine == "auto")
    prepare(problem, integrator)
    return True


def prepare(problem: Problem, integrator: Any) -> None:
    """Call the kernels of steps and tangents once, which compiles them or reads them from disc."""
    steps, found, z = Steps(problem, integrator, True), equations(problem), problem.start()
    steps.take(z, 0.0, 1.0, 0)
    if isinstance(found, ConstantEquations):
        from discs.kernels import tangent as kernels  # numba is slow to import

        rule, s = steps.rule, steps.rule.b.size
        given = found.compiled(found.at(np.array([z.hi] * s), np.array([np.atleast_2d(z.pi)] * s), np.zeros(s)))
        y = np.zeros((s, z.hi.size + z.pi.size))
        kernels.back(rule, given, found.order, 1.0, 0.0, y, np.zeros(0, int), y[0], np.zeros((0, *y.shape)))
        kernels.forward(rule, given, found.order, 1.0, np.inf, y, y.copy())


class Flow:
    """Steps of a Gauss method with their tangents.

    Parameters
    ----------
    problem : the chain and its loads. method : "midpoint" (where V is quadratic), "gauss4", "gauss6" or "gauss8".
    engine : as for `simulate`; None for the usual one.

    The unknowns y (size,) are those of `Linearised`: q, then the momenta that no motor prescribes.
    """

    def __init__(self, problem: Problem, method: str = "gauss4", engine: str | None = None) -> None:
        integrator: Any = find(checks.choice("method (with tangents)", method, METHODS))
        if method == "midpoint" and not problem.system.quadratic:
            raise ValueError(
                "tangents of midpoint steps need a quadratic potential, as that of the linear curvature; take 'gauss4'"
            )
        self.problem = problem
        self._steps = Steps(problem, integrator, ready(problem, integrator, engine))
        self._equations = equations(problem)
        self._first = Linearised(problem, problem.start())
        self.start = self._first.join(self._first.z.hi, self._first.z.pi)

    def at(self, y: Float, t: float) -> Linearised:
        """The linearised equations at a state and time; driven discs turn at the rates of their motors."""
        lin, system = self._first, self.problem.system
        q = y[: lin.basis.size].reshape(lin.basis.shape)
        pi = np.zeros(lin.z.pi.size)
        pi[lin.free] = y[lin.basis.size :]
        if not lin.free.all():
            roots = system.basis(system.shape(q))[2:]
            for axle, rate in zip(system.load.axles, system.load.rates(t), strict=True):  # type: ignore[union-attr]
                pi[(axle.row - 2) * system.n + axle.disc] = rate / roots[axle.row - 2, axle.disc]
        return Linearised(self.problem, Phase(q, np.zeros_like(q), pi.reshape(lin.z.pi.shape)), t)

    def step(self, y: Float, t: float, h: float) -> tuple[Float, Tangent | Swept]:
        """The state after a step from t to t + h, and the tangent of the step. SimulationError if its equations are not solved."""
        table, lin = self._steps.rule, self._first
        after, q, pi, stuck = self._steps.take(self.at(y, t).z, t, h, 1)
        if stuck or not np.isfinite(after.pi).all():
            raise SimulationError("a step did not converge: it is too long for this motion; take a smaller dt", round(t / h), t, 0)
        times = t + h * table.nodes
        end = lin.join(after.hi + after.lo, after.pi)
        if self._steps.compiled and lin.free.all() and isinstance(self._equations, ConstantEquations):
            return end, Swept(table, h, self._equations, self._equations.at(q[0], pi[0], times))
        return end, tangent(table, h, self._equations.each(q[0], pi[0], times))


def units(flow: Flow) -> Float:
    """Units of the unknowns, (size,): a length of the chain, a radian, and a momentum from the slowest rate."""
    lin = flow.at(flow.start, 0.0)
    slow = Steady(lin, np.zeros(2), 0.0).slow or 1 / flow.problem.duration
    places = np.broadcast_to(lin.system.scale[:, None], lin.basis.shape)
    return lin.join(places, (slow / lin.basis[2:]).reshape(lin.z.pi.shape))
