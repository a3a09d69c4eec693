r"""The tangent of a step, and its transpose: how a small change of the state before a step changes the state after it.

A Gauss method with coefficients a, b and times c solves Y_i = y + h sum_j a_ij F(Y_j) and returns y + h sum_j b_j F(Y_j). With the
matrices A_j of the linearised equations at its stages, the tangent T is exactly

    M dY = (dy, ..., dy),   T dy = dy + h sum_j b_j A_j dY_j,   M = 1 - h (a x 1) diag(A_1, ..., A_s),

and its transpose is T^T w = w + sum_j u_j with M^T u = h (b_1 A_1^T w, ..., b_s A_s^T w). M is sparse, with the bands of the step:
T dy and T^T w take O(n). One stage is the midpoint rule; `midpoint` steps are the same for the linear curvature, where V is
quadratic (otherwise they take a mean force that keeps the energy).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs import checks
from discs.analysis.linear import Linearised
from discs.analysis.steady import Steady
from discs.arrays import Float, Matrix
from discs.integrators.tableaux import Tableau, tableau
from discs.problem import Problem
from discs.running.failure import SimulationError
from discs.skew import Phase

STAGES = {"midpoint": 1, "gauss4": 2, "gauss6": 3, "gauss8": 4}
SWEEPS = 60
TOLERANCE = 1e-13  # of a step's stages, relative


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


def tangent(table: Tableau, h: float, stages: list[Linearised]) -> Tangent:
    """The tangent of a step with these equations at its stages."""
    matrices = [lin.matrix for lin in stages]
    blocks = [[-h * weight * matrix for weight, matrix in zip(row, matrices, strict=True)] for row in table.a]
    whole = scipy.sparse.block_array(blocks, format="csc")
    factors = scipy.sparse.linalg.splu(scipy.sparse.eye_array(whole.shape[0], format="csc") + whole)
    return Tangent(table, h, matrices, factors)


class Flow:
    """Steps of a Gauss method with their tangents, on the plain engine.

    Parameters
    ----------
    problem : the chain and its loads. method : "midpoint" (for the linear curvature), "gauss4", "gauss6" or "gauss8".

    The unknowns y (size,) are those of `Linearised`: q, then the momenta that no motor prescribes.
    """

    def __init__(self, problem: Problem, method: str = "gauss4") -> None:
        stages = STAGES[checks.choice("method (with tangents)", method, STAGES)]
        if stages == 1 and not problem.system.quadratic:
            raise ValueError(
                "tangents of midpoint steps need a quadratic potential, as that of the linear curvature; take 'gauss4'"
            )
        self.problem, self.table = problem, tableau(stages)
        self._first = Linearised(problem, problem.start())
        self.start = self._first.join(self._first.z.hi, self._first.z.pi)
        self._last: Tangent | None = None

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

    def step(self, y: Float, t: float, h: float) -> tuple[Float, Tangent]:
        """The state after a step from t to t + h, and the tangent of the step. SimulationError if its equations are not solved."""
        table, s, times = self.table, self.table.b.size, t + h * self.table.nodes
        now = self._last
        if now is None or now.h != h:
            now = self._tangent([self.at(y, t)] * s, h)
        stages = np.concatenate([y + c * h * self.at(y, t).rate for c in table.nodes])
        scale, before = np.max(np.abs(y)), np.inf
        for _ in range(SWEEPS):
            rates = np.array([self.at(part, time).rate for part, time in zip(stages.reshape(s, -1), times, strict=True)])
            off = (np.tile(y, s).reshape(s, -1) + h * table.a @ rates).ravel() - stages
            change = now.factors.solve(off)
            stages = stages + change
            moved = float(np.abs(change).max())
            if moved <= TOLERANCE * scale or not np.isfinite(moved):
                break
            if moved > 0.3 * before:
                now = self._tangent([self.at(part, time) for part, time in zip(stages.reshape(s, -1), times, strict=True)], h)
            before = moved
        if not moved <= 1e3 * TOLERANCE * scale:
            disc = int(np.argmax(np.abs(change))) % self.problem.chain.n
            raise SimulationError(
                "a step did not converge: it is too long for this motion; take a smaller dt", round(t / h), t, disc
            )
        here = [self.at(part, time) for part, time in zip(stages.reshape(s, -1), times, strict=True)]
        self._last = now = self._tangent(here, h)
        after: Float = y + h * table.b @ np.array([lin.rate for lin in here])
        return after, now

    def _tangent(self, stages: list[Linearised], h: float) -> Tangent:
        return tangent(self.table, h, stages)


def units(flow: Flow) -> Float:
    """Units of the unknowns, (size,): a length of the chain, a radian, and a momentum from the slowest rate."""
    lin = flow.at(flow.start, 0.0)
    slow = Steady(lin, np.zeros(2), 0.0).slow or 1 / flow.problem.duration
    places = np.broadcast_to(lin.system.scale[:, None], lin.basis.shape)
    return lin.join(places, (slow / lin.basis[2:]).reshape(lin.z.pi.shape))
