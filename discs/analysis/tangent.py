"""Steps of a run with their tangents: how a small change of the state before a step changes the state after it.

`discs.analysis.sparse_tangent` has the equations and tangents by sparse matrices, `discs.analysis.swept` those by compiled sweeps.
"""

from typing import Any

import numpy as np

from discs import checks
from discs.analysis.linear import Linearised
from discs.analysis.sparse_tangent import Tangent, tangent
from discs.analysis.stages import equations
from discs.analysis.steady import Steady
from discs.analysis.steps import Steps
from discs.analysis.swept import Swept, ready, sweeps
from discs.arrays import Float
from discs.integrators import find
from discs.problem import Problem
from discs.running.failure import SimulationError
from discs.skew import Phase

METHODS = ("midpoint", "gauss4", "gauss6", "gauss8")


class Flow:
    """Steps of a Gauss method with their tangents.

    Parameters
    ----------
    problem : the chain and its loads. method : "midpoint", "gauss4", "gauss6" or "gauss8".
    engine : as for `simulate`; None for the usual one.

    The unknowns y (size,) are those of `Linearised`: q, then the momenta that no motor prescribes.
    """

    def __init__(self, problem: Problem, method: str = "gauss4", engine: str | None = None) -> None:
        integrator: Any = find(checks.choice("method (with tangents)", method, METHODS))
        self.problem = problem
        self._steps = Steps(problem, integrator, ready(problem, integrator, engine))
        self._equations, self._sweeps = equations(problem, self._steps.secant), sweeps(self._steps)
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
        taken = self._steps.take(self.at(y, t).z, t, h, 1)
        if taken.unconverged or not np.isfinite(taken.after.pi).all():
            raise SimulationError("a step did not converge: it is too long for this motion; take a smaller dt", round(t / h), t, 0)
        end = lin.join(taken.after.hi + taken.after.lo, taken.after.pi)
        if self._sweeps is not None and lin.free.all():
            return end, Swept(self._sweeps, taken, t, h)
        return end, tangent(table, h, self._equations.over(h).each(taken.q[0], taken.pi[0], t + h * table.nodes))


def units(flow: Flow) -> Float:
    """Units of the unknowns, (size,): a length of the chain, a radian, and a momentum from the slowest rate."""
    lin = flow.at(flow.start, 0.0)
    slow = Steady(lin, np.zeros(2), 0.0).slow or 1 / flow.problem.duration
    places = np.broadcast_to(lin.system.scale[:, None], lin.basis.shape)
    return lin.join(places, (slow / lin.basis[2:]).reshape(lin.z.pi.shape))
