r"""Gradients of a cost by the discrete adjoint: exact for the computed motion, in one pass back.

A collocation step K_i = f(Y_i), Y_i = y_n + h sum_j a_ij K_j, y_{n+1} = y_n + h sum_i b_i K_i takes the derivative lambda_{n+1} of
the cost back to that before the step by its transpose (`discs.analysis.sparse_tangent`), which has a u_i for each stage:

    lambda_n = lambda_{n+1} + sum_i u_i,   dJ/dp += sum_i M_i . df/dp(Y_i),   M_i = h (b_i lambda_{n+1} + sum_j a_ji u_j).

The midpoint rule has one stage in the middle. Where V is not quadratic, it takes the mean force of the step there
(`discs.analysis.secants`).
(Sanz-Serna, Symplectic Runge-Kutta schemes for adjoint equations, SIAM Review 58, 2016.)
"""

from collections.abc import Callable, Iterable
from math import isqrt
from typing import Any

import numpy as np

from discs import checks
from discs.analysis.costs import RATES, cost_by_frame
from discs.analysis.parameters import INERTIAS, STIFFNESSES, Parameters
from discs.analysis.sparse_tangent import tangent
from discs.analysis.stages import At, equations
from discs.analysis.steps import Steps
from discs.analysis.swept import ready, sweeps
from discs.arrays import Float
from discs.integrators import Integrator, Midpoint, find
from discs.integrators.collocated import Collocated
from discs.kernels.background import usual
from discs.problem import Problem
from discs.running.frames import frame_times
from discs.running.progress import NO_BAR, Progress
from discs.running.suggest import suggest_dt
from discs.running.whole_steps import check_steps, steps_before
from discs.simulation import simulate
from discs.skew import Phase
from discs.solution import Solution

FEWEST = 256  # steps between two states that are kept
INITIAL = ("x", "y", "theta", "phi", "omega", "phi_rate")


def gradient(
    problem: Problem,
    cost: Callable[[Any], Any],
    wrt: Iterable[str],
    method: str | Integrator = "midpoint",
    dt: float | None = None,
    frames: Any = 1,
    cost_gradient: Callable[[Any], dict[str, Any]] | None = None,
    progress: bool = True,
    engine: str | None = None,
) -> dict[str, Float]:
    """The derivatives of a cost of the frames of a run with respect to its initial state and its parameters.

    Parameters
    ----------
    problem : the chain, its initial state, loads and duration; without motors.
    cost : of the frames, as `lambda run: run.y[-1, 0] ** 2`: a function of run.t, (F,), and of run.x, y, theta, omega (phi,
        phi_rate), (F, n), written in NumPy. It is differentiated by dual numbers (`discs.analysis.duals`). It may be None if
        `cost_gradient` is given.
    wrt : names: of the initial state, "x", "y", "theta", "omega" ("phi", "phi_rate"), the others held; or of the chain, "radius",
        "density", "spin_inertia", "torsion_stiffness", "bending_stiffness" ("heading_inertia", "stretch_stiffness",
        "shear_stiffness"), the initial state held; or of a load and its signal, as "loads[0].pattern", "loads[1].signal.rate",
        numbers and arrays of loads that are linear in positions and velocities.
    method, dt, frames : as for `simulate`; "midpoint" or a collocation method, as "gauss4".
    cost_gradient : instead of dual numbers: run -> the derivatives of the cost, arrays (F, n) by the names of its quantities.
    progress : show a progress bar for more than a second.
    engine : as for `simulate`. With linear loads the pass back is compiled too, for the linear curvature and, by collocation
        methods, for own headings; elsewhere it takes sparse matrices of SciPy.

    Returns
    -------
    {name: array}, (n,) for the initial state, otherwise of the shape that the parameter has in the chain: (n,), (links,) or
    (bends,). Where all discs share one number its derivative is the sum. They are the derivatives of the computed cost, not only of
    the exact one, to the tolerance of the sweeps of a step.

    The run is made by `simulate` first, with its warnings and errors: where steps do not converge the gradient is as doubtful.
    Memory grows like the root of the number of steps.

    Raises
    ------
    ValueError : for other methods, unknown names, motors, or a cost that is no number or cannot be differentiated.
    """
    if not isinstance(problem, Problem):
        raise ValueError(f"gradient takes a Problem, as `compare.lump(scene, n)` makes; got {checks.shown(problem)}")
    for name, function, other in (("cost", cost, cost_gradient), ("cost_gradient", cost_gradient, cost)):
        if not (callable(function) or (function is None and other is not None)):
            raise ValueError(f"{name} must be a function of a run; got {checks.shown(function)}")
    names = _names(problem, wrt)
    integrator = _checked(problem, method)
    h = suggest_dt(problem, integrator) if dt is None else checks.number("dt", dt, positive=True)
    if h > problem.duration:
        raise ValueError(f"dt must be at most the duration {problem.duration:g}; got {h:g}")
    check_steps(problem.duration, h)
    times = frame_times(frames, problem.duration)
    engine = usual() if engine is None else engine
    adjoint = _Adjoint(problem, integrator, h, names, ready(problem, integrator, engine))
    with Progress("gradient", steps_before(float(times[-1]), h)[0]) if progress else NO_BAR as bar:
        return adjoint.gradient(times, cost, cost_gradient, engine, bar.update)


def _names(problem: Problem, wrt: Iterable[str]) -> tuple[str, ...]:
    names = checks.several("wrt", wrt, "names of parameters")
    steered = len(problem.system.rows) == 4
    known = [name for name in (*INITIAL, *INERTIAS, *STIFFNESSES) if name in vars(problem.chain) or name in problem.system.rows]
    known += ["omega", *["phi_rate"] * steered]
    if not names or not all(isinstance(name, str) and (name in known or name.startswith("loads[")) for name in names):
        known += ["'loads[0].pattern' and the like"] if problem.loads else []
        raise ValueError(f"wrt must be names among {', '.join(dict.fromkeys(known))}; got {checks.shown(wrt)}")
    return names


def _checked(problem: Problem, method: str | Integrator) -> Integrator:
    """The method, if it has an adjoint here."""
    integrator = find(method)
    if problem.system.load is not None and problem.system.load.axles:
        raise ValueError("gradient takes no motors: a motor prescribes a rate, which then has no momentum; use a Torque")
    if isinstance(integrator, Collocated | Midpoint):
        return integrator
    raise ValueError(f"gradient takes 'midpoint' or a collocation method, as 'gauss4'; got {integrator.name!r}")


class _Adjoint:
    """The pass back along a run.

    The run is made once and kept at every so manyeth step. From there the steps between are taken again, with their stages.
    """

    def __init__(self, problem: Problem, integrator: Any, h: float, names: tuple[str, ...], compiled: bool) -> None:
        self.problem, self.system, self.integrator, self.h, self.names = problem, problem.system, integrator, h, names
        self.steps = Steps(problem, integrator, compiled)
        self.equations = equations(problem, self.steps.secant)
        self.sweeps, self.parameters = sweeps(self.steps), Parameters(self.equations, names)

    def gradient(
        self,
        times: Float,
        cost: Callable[[Any], Any],
        cost_gradient: Callable[[Any], dict[str, Any]] | None,
        engine: str,
        update: Callable[[int], None],
    ) -> dict[str, Float]:
        """The gradient of a cost of frames at times (F,)."""
        h, places = self.h, [steps_before(float(time), self.h) for time in times]
        last = places[-1][0]
        stride = max(FEWEST, isqrt(last))
        wanted = {(number, 0.0): number * h for number in [*range(0, last, stride), *(number for number, rest in places if rest)]}
        wanted |= dict(zip(places, times.tolist(), strict=True))
        order = {place: i for i, place in enumerate(sorted(wanted))}
        run = simulate(self.problem, self.integrator, h, [wanted[place] for place in order], progress=False, engine=engine)
        states = self._states(run)
        shown = np.array([order[place] for place in places])
        values = {name: np.asarray(getattr(run, name))[shown] for name in (*self.system.rows, *self.system.rates[2:])}
        at = self.equations.at(states[0][shown], states[1][shown], times)
        seeds = self._seeds(at, cost_by_frame(times, values, cost, cost_gradient))
        due: dict[int, Float] = {}
        for (number, rest), seed in zip(places, seeds, strict=True):
            if rest:
                seed = self._back(self._start(states, order[number, 0.0]), number, number + 1, rest, seed, {})
            due[number] = due.get(number, 0.0) + seed
        value = np.zeros_like(seeds[0])
        for first in reversed(range(0, last, stride)):
            end = min(first + stride, last)
            after = {number - first - 1: seed for number, seed in due.items() if first < number <= end}
            value = self._back(self._start(states, order[first, 0.0]), first, end, h, value, after)
            update(last - first)
        return self._of_start(value + due.get(0, 0.0))

    def _states(self, run: Solution) -> tuple[Float, Float]:
        """Positions (F, rows, n) and momenta (F, columns, n) of the frames of a run."""
        q = np.stack([getattr(run, name) for name in self.system.rows], axis=1)
        rates = np.stack([getattr(run, name) for name in self.system.rates[2:]], axis=1)
        momenta = (self.system.momentum(self.system.shape(of), rate) for of, rate in zip(q, rates, strict=True))
        return q, np.array([np.atleast_2d(pi) for pi in momenta])

    def _start(self, states: tuple[Float, Float], frame: int) -> Phase:
        q, pi = states[0][frame], states[1][frame]
        return Phase(q, np.zeros_like(q), pi.reshape(self.problem.start().pi.shape))

    def _back(self, z: Phase, first: int, end: int, h: float, value: Float, seeds: dict[int, Float]) -> Float:
        """The value before the steps `first` to `end` of size h from a state; what parameters do in them is added up."""
        t, left, value = first * self.h, end - first, value.copy()
        taken = self.steps.take(z, t, h, left)
        while left:
            if self.sweeps is not None:
                done, sums, passed = self.sweeps.back(taken, t, h, left, value, seeds, self.parameters.rates)
                self.parameters.add(sums, passed)
                left -= done
            elif left - 1 in seeds:
                value += seeds[left - 1]
            if left:  # a step that sweeps do not solve
                left -= 1
                value = self._back_by_matrix(taken.q[left], taken.pi[left], t + h * left, h, value)
        return value

    def _back_by_matrix(self, q: Float, pi: Float, t: float, h: float, value: Float) -> Float:
        """The value before one step with these stages."""
        here = self.equations.over(h)
        at = here.at(q, pi, t + h * self.steps.rule.nodes)
        step = tangent(self.steps.rule, h, at.each or here.each(q, pi, at.t))
        u = step.stages_back(value)
        self.parameters.add_stages(at, step.rates_back(value, u))
        found: Float = value + u.sum(axis=0)
        return found

    def _seeds(self, at: At, slopes: list[dict[str, Float]]) -> Float:
        """The derivatives of the cost by the states of frames, (F, size): omega = C_theta pi."""
        q, pi = np.zeros_like(at.q), np.zeros_like(at.pi)
        by_disc = {name: self.parameters.basis_by(at, name) for name in self.parameters.by_disc}
        for name in slopes[0]:
            given = np.array([slope[name] for slope in slopes])
            if name not in RATES:
                q[:, self.system.rows.index(name)] += given
                continue
            row = RATES[name]
            pi[:, row - 2] += given * at.c[:, row]
            for i, (into, heading) in enumerate(self.equations.headings):
                q[:, into] += (heading.T @ (given * at.turned[:, i, row]).T).T
            for inertia, change in by_disc.items():
                self.parameters.by_disc[inertia] += (given * at.pi[:, row - 2] * change[:, row]).sum(axis=0)
        return np.concatenate([q.reshape(len(q), -1), pi.reshape(len(q), -1)], axis=1)

    def _of_start(self, value: Float) -> dict[str, Float]:
        """The gradient by the initial state, whose momenta are omega/C_theta, and in the shapes of the parameters."""
        problem, z = self.problem, self.problem.start()
        # C and dC/dh at the start: those of momenta 1
        at = self.equations.at(z.hi[None], np.ones((1, *np.atleast_2d(z.pi).shape)), np.zeros(1))
        c, turned = at.c[0], at.turned[0]
        q = value[: z.hi.size].reshape(z.hi.shape).copy()
        pi = value[z.hi.size :].reshape(-1, self.system.n)
        given = {"omega": np.asarray(problem.initial.omega), "phi_rate": np.asarray(problem.initial.phi_rate)}
        rates = {}
        for name, row in list(RATES.items())[: len(pi)]:
            rates[name] = pi[row - 2] / c[row]
            shrink = -rates[name] * given[name] / c[row]
            for i, (into, heading) in enumerate(self.equations.headings):
                q[into] += heading.T @ (shrink * turned[i, row])
            for inertia in self.parameters.by_disc:
                self.parameters.by_disc[inertia] += shrink * self.parameters.basis_by(at, inertia)[0, row]
        found = dict(zip(self.system.rows, q, strict=True)) | rates | self.parameters.found()
        return {name: found[name] for name in self.names}
