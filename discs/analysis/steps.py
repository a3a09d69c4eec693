"""Steps of a run together with their stages, where the linearised equations are taken."""

import signal
from typing import Any, NamedTuple

import numpy as np

from discs.arrays import Float
from discs.integrators import Midpoint, Work
from discs.integrators.collocated import Collocated, Common, collocate
from discs.integrators.tableaux import tableau
from discs.problem import Problem
from discs.skew import Phase


class Taken(NamedTuple):
    """Steps that were taken.

    after : the state after the last one. q : (steps, s, rows, n) and pi : (steps, s, columns, n), of their stages.
    unconverged : how many did not converge.
    """

    after: Phase
    q: Float
    pi: Float
    unconverged: int


class Steps:
    """Steps of "midpoint", whose stage is its middle, or of a collocation method.

    Parameters
    ----------
    problem : the chain and its loads. integrator : `Midpoint` or `Collocated`.
    compiled : whether they are compiled; see `discs.analysis.swept.ready`.

    Attributes
    ----------
    rule : the coefficients. secant : whether a step takes a secant, as the potential is not quadratic.
    """

    def __init__(self, problem: Problem, integrator: Any, compiled: bool) -> None:
        self.problem, self.system, self.integrator = problem, problem.system, integrator
        self.rule = tableau(1) if isinstance(integrator, Midpoint) else integrator.rule
        self.secant = isinstance(integrator, Midpoint) and not problem.system.quadratic
        self.compiled = compiled

    def take(self, z: Phase, t: float, h: float, count: int) -> Taken:
        """Take steps of size h from a state at the time t."""
        if not self.compiled:
            return self._plain(z, t, h, count)
        from discs.kernels.trace import trace  # numba is slow to import

        chain, s, (rows, n) = self.timed(t, h, count), self.rule.b.size, z.hi.shape
        state = Phase(*[np.array(part, ndmin=2) for part in z])
        q, pi = np.empty((count, s, rows, n)), np.empty((count, s, len(state.pi), n))
        unconverged = trace(self.integrator.parameters, self.integrator.twin_of(self.system, chain), state, t, h, q, pi)
        if unconverged < 0:
            signal.raise_signal(signal.SIGINT)
            raise KeyboardInterrupt
        return Taken(Phase(state.hi, state.lo, state.pi.reshape(z.pi.shape)), q, pi, unconverged)

    def times(self, t: float, h: float, count: int) -> Float:
        """The times of the stages of some steps of size h from the time t, one step after the other."""
        times: Float = (t + h * np.add.outer(np.arange(float(count)), self.rule.nodes)).ravel()
        return times

    def timed(self, t: float, h: float, count: int) -> Any:
        """The parameters of the chain for compiled steps, with the values of signals in these steps."""
        chain, load = self.system.parameters, self.system.load
        if load is None or load.conservative:
            return chain
        times = np.add.outer(t + h * np.arange(count + 1.0), h * np.array([0.0, *self.integrator.parameters.nodes]))
        return chain._replace(load=load.timed(times.ravel(), abs(h)))

    def _plain(self, z: Phase, t: float, h: float, count: int) -> Taken:
        places, momenta, work, stuck = [], [], Work(), 0
        for time in t + h * np.arange(count):
            if isinstance(self.integrator, Collocated):
                rule, sweeps, tolerance = self.rule, self.integrator.sweeps, self.integrator.tolerance
                guide = Common(self.system, z, time, h, rule)
                after, v, p, taken = collocate(self.system, z, time, h, rule, guide, sweeps, tolerance)
                q = z.hi + (z.lo + h * np.tensordot(rule.a, v, 1))
                stuck += taken == sweeps and tolerance > 0
            else:
                after = self.integrator.step(self.system, z, time, h, work)
                start, end = z.hi + z.lo, after.hi + after.lo
                q, p = (start + 0.5 * (end - start))[None], 0.5 * (z.pi + after.pi)[None]
            places.append(q)
            momenta.append(p.reshape(len(q), -1, self.system.n))
            z = after
        return Taken(z, np.array(places), np.array(momenta), stuck + work.unconverged)
