r"""Gradients of a cost by the discrete adjoint: exact for the computed motion, in one pass back.

A collocation step K_i = f(Y_i), Y_i = y_n + h sum_j a_ij K_j, y_{n+1} = y_n + h sum_i b_i K_i takes the derivative lambda_{n+1} of
the cost back to that before the step by its transpose (`discs.analysis.tangent`), which has a u_i for each stage:

    lambda_n = lambda_{n+1} + sum_i u_i,   dJ/dp += sum_i M_i . df/dp(Y_i),   M_i = h (b_i lambda_{n+1} + sum_j a_ji u_j).

The midpoint rule has one stage in the middle, where V is quadratic; otherwise it takes a secant, and Gauss methods are to be taken.
(Sanz-Serna, Symplectic Runge-Kutta schemes for adjoint equations, SIAM Review 58, 2016.)
"""

from collections.abc import Callable, Iterable
from math import isqrt
from typing import Any

import numpy as np

from discs import checks
from discs.analysis.costs import RATES, cost_by_frame
from discs.analysis.linear import Linearised
from discs.analysis.parameters import INERTIAS, STIFFNESSES, Springs, basis_by, by_inertia
from discs.analysis.tangent import tangent
from discs.arrays import Float
from discs.integrators import Integrator, Midpoint, Work, find
from discs.integrators.collocated import Collocated, Common, collocate
from discs.integrators.tableaux import tableau
from discs.problem import Problem
from discs.running.frames import frame_times, steps_before
from discs.running.progress import NO_BAR, Progress
from discs.running.suggest import suggest_dt
from discs.simulation import simulate
from discs.skew import Phase

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
) -> dict[str, Float]:
    """The derivatives of a cost of the frames of a run with respect to its initial state and its parameters.

    Parameters
    ----------
    problem : the chain, its initial state, loads and duration; without motors.
    cost : of the frames, as `lambda run: run.y[-1, 0] ** 2`: a function of run.t, (F,), and of run.x, y, theta, omega (phi,
        phi_rate), (F, n), written in NumPy. It is differentiated by dual numbers (`discs.analysis.duals`).
    wrt : names: of the initial state, "x", "y", "theta", "omega" ("phi", "phi_rate"), the others held; or of the chain, "radius",
        "density", "spin_inertia", "torsion_stiffness", "bending_stiffness" ("heading_inertia", "stretch_stiffness",
        "shear_stiffness"), the initial state held.
    method, dt, frames : as for `simulate`; "midpoint" (where V is quadratic: slaved headings, linear curvature) or a collocation
        method, as "gauss4".
    cost_gradient : instead of dual numbers: run -> the derivatives of the cost, arrays (F, n) by the names of its quantities.
    progress : show a progress bar for more than a second.

    Returns
    -------
    {name: array}, (n,) for the initial state, otherwise of the shape that the parameter has in the chain: (n,), (links,) or
    (bends,). Where all discs share one number its derivative is the sum. They are the derivatives of the computed cost, not only of
    the exact one, to the tolerance of the sweeps of a step.

    The run is made by `simulate` first, with its warnings and errors: where steps do not converge the gradient is as doubtful. The
    pass back is on the plain engine; memory grows like the root of the number of steps.

    Raises
    ------
    ValueError : for other methods, unknown names, motors, or a cost that is no number or cannot be differentiated.
    """
    if not isinstance(problem, Problem):
        raise ValueError(f"gradient takes a Problem, as `compare.lump(scene, n)` makes; got {checks.shown(problem)}")
    names = _names(problem, wrt)
    integrator = _checked(problem, method)
    h = suggest_dt(problem, integrator) if dt is None else checks.number("dt", dt, positive=True)
    if h > problem.duration:
        raise ValueError(f"dt must be at most the duration {problem.duration:g}; got {h:g}")
    times = frame_times(frames, problem.duration)
    places = [steps_before(float(time), h) for time in times]
    simulate(problem, integrator, h, times[-1:], progress=False, engine="ready")  # which warns of, or stops, what is no motion
    steps = _Steps(problem, integrator, h)
    with Progress("gradient", 2 * places[-1][0]) if progress else NO_BAR as bar:
        told = bar.update if bar else _unseen
        steps.forward(places[-1][0], told)
        shown = [steps.after(count, rest) for count, rest in places]
        seeds = cost_by_frame(problem, times, shown, cost, cost_gradient)
        return steps.back(places, shown, seeds, names, told)


def _unseen(step: int) -> None:
    """No progress bar."""


def _names(problem: Problem, wrt: Iterable[str]) -> tuple[str, ...]:
    names = (wrt,) if isinstance(wrt, str) else tuple(wrt)
    steered = len(problem.system.rows) == 4
    known = [name for name in (*INITIAL, *INERTIAS, *STIFFNESSES) if name in vars(problem.chain) or name in problem.system.rows]
    known += ["omega", *["phi_rate"] * steered]
    if not names or any(name not in known for name in names):
        raise ValueError(f"wrt must be names among {', '.join(dict.fromkeys(known))}; got {checks.shown(wrt)}")
    return names


def _checked(problem: Problem, method: str | Integrator) -> Integrator:
    """The method, if it has an adjoint here."""
    integrator = find(method)
    if problem.system.load is not None and problem.system.load.axles:
        raise ValueError("gradient takes no motors: a motor prescribes a rate, which then has no momentum; use a Torque")
    if isinstance(integrator, Collocated) or (isinstance(integrator, Midpoint) and problem.system.quadratic):
        return integrator
    why = ", whose steps take a secant, as the potential is not quadratic here" if isinstance(integrator, Midpoint) else ""
    need = "'midpoint' where the potential is quadratic, or a collocation method, as 'gauss4'"
    raise ValueError(f"gradient takes {need}; got {integrator.name!r}{why}")


class _Steps:
    """The steps of a run, kept at every so manyeth, and their adjoints."""

    def __init__(self, problem: Problem, integrator: Any, h: float) -> None:
        self.problem, self.system, self.integrator, self.h = problem, problem.system, integrator, h
        self.rule = tableau(1) if isinstance(integrator, Midpoint) else integrator.rule
        self.kept: dict[int, Phase] = {0: problem.start()}
        self.near: dict[int, Phase] = {}  # those of the last part that was asked for
        self.stride, self.count = 1, 0
        self._known: dict[str, Springs] = {}

    def step(self, z: Phase, number: int, h: float) -> Phase:
        after: Phase = self.integrator.step(self.system, z, number * self.h, h, Work())
        return after

    def forward(self, count: int, update: Callable[[int], None]) -> None:
        """Take `count` steps."""
        self.stride, self.count, z = max(1, isqrt(count)), count, self.kept[0]
        for number in range(count):
            z = self.step(z, number, self.h)
            if (number + 1) % self.stride == 0:
                self.kept[number + 1] = z
            update(number + 1)

    def at(self, number: int) -> Phase:
        """The state after so many steps, computed again from the last one that was kept."""
        if number in self.kept:
            return self.kept[number]
        if number not in self.near:
            first = number - number % self.stride
            self.near, z = {}, self.kept[first]
            for later in range(first, min(first + self.stride - 1, self.count)):
                z = self.step(z, later, self.h)
                self.near[later + 1] = z
        return self.near[number]

    def after(self, count: int, rest: float) -> Phase:
        """The state a time `rest` after so many steps."""
        z = self.at(count)
        return self.step(z, count, rest) if rest else z

    def stages(self, z: Phase, number: int, h: float) -> list[Linearised]:
        """The linearised equations at the stages of a step."""
        t = number * self.h
        if isinstance(self.integrator, Midpoint):
            end = self.step(z, number, h)
            q, pi = 0.5 * (z.hi + z.lo + end.hi + end.lo), 0.5 * (z.pi + end.pi)
            return [Linearised(self.problem, Phase(q, 0 * q, pi), t + 0.5 * h)]
        rule = self.rule
        guide = Common(self.system, z, t, h, rule)
        _, v, p, _ = collocate(self.system, z, t, h, rule, guide, self.integrator.sweeps, self.integrator.tolerance)
        q = z.hi + z.lo + h * np.tensordot(rule.a, v, 1)
        stages = zip(q, p, rule.nodes, strict=True)
        return [Linearised(self.problem, Phase(at, 0 * at, pi), t + node * h) for at, pi, node in stages]

    def adjoint(self, z: Phase, number: int, h: float, after: Float, found: dict[str, Float]) -> Float:
        """The derivative before a step from that after it; what parameters do in it is added to `found`."""
        stages = self.stages(z, number, h)
        step = tangent(self.rule, h, stages)
        u = step.stages_back(after)
        for lin, at in zip(stages, step.rates_back(after, u), strict=True):
            for name in found:
                if name in INERTIAS:
                    found[name] += by_inertia(lin, at, name)
                elif name in STIFFNESSES:
                    found[name] += self._springs(name).by_stiffness(lin, at)
        before: Float = after + u.sum(axis=0)
        return before

    def _springs(self, name: str) -> "Springs":
        if name not in self._known:
            self._known[name] = Springs(self.problem, name)
        return self._known[name]

    def back(
        self,
        places: list[tuple[int, float]],
        shown: list[Phase],
        seeds: list[dict[str, Float]],
        names: tuple[str, ...],
        update: Callable[[int], None],
    ) -> dict[str, Float]:
        """The gradient from the derivatives of the cost by the frames, {name: (n,)} for each."""
        chain, n = self.problem.chain, self.system.n
        found = {name: np.zeros(n if name in INERTIAS else np.size(getattr(chain, name))) for name in names if name not in INITIAL}
        last = places[-1][0]
        value, waiting = np.zeros(self.kept[0].hi.size + self.kept[0].pi.size), len(places) - 1
        for number in range(last, -1, -1):
            while waiting >= 0 and places[waiting][0] == number:
                rest, z = places[waiting][1], shown[waiting]
                seed = self._of_frame(z, seeds[waiting], found)
                value = value + (self.adjoint(self.at(number), number, rest, seed, found) if rest else seed)
                waiting -= 1
            if number:
                value = self.adjoint(self.at(number - 1), number - 1, self.h, value, found)
                update(2 * last - number + 1)
        return self._of_start(value, found, names)

    def _of_frame(self, z: Phase, seed: dict[str, Float], found: dict[str, Float]) -> Float:
        """The derivative of the cost by the state of a frame: omega = C_theta pi."""
        lin = Linearised(self.problem, z)
        q, pi = np.zeros_like(z.hi), np.zeros((len(lin.basis) - 2, self.system.n))
        momenta = np.atleast_2d(z.pi)
        for name, given in seed.items():
            if name not in RATES:
                q[self.system.rows.index(name)] += given
                continue
            row = RATES[name]
            pi[row - 2] += given * lin.basis[row]
            for turn in self.system.turns(lin.shape):
                q[turn.row] += turn.heading.T @ (given * momenta[row - 2] * turn.basis[row])
            for inertia in found.keys() & set(INERTIAS):
                found[inertia] += given * momenta[row - 2] * basis_by(lin, inertia)[row]
        return np.concatenate([q.ravel(), pi.ravel()])

    def _of_start(self, value: Float, found: dict[str, Float], names: tuple[str, ...]) -> dict[str, Float]:
        """The gradient by the initial state, whose momenta are omega/C_theta, and in the shapes of the parameters."""
        problem, lin = self.problem, Linearised(self.problem, self.kept[0])
        q = value[: lin.basis.size].reshape(lin.basis.shape).copy()
        pi = value[lin.basis.size :].reshape(-1, self.system.n)
        given = {"omega": np.asarray(problem.initial.omega), "phi_rate": np.asarray(problem.initial.phi_rate)}
        rates = {}
        for name, row in list(RATES.items())[: len(pi)]:
            rates[name] = pi[row - 2] / lin.basis[row]
            shrink = -rates[name] * given[name] / lin.basis[row]
            for turn in self.system.turns(lin.shape):
                q[turn.row] += turn.heading.T @ (shrink * turn.basis[row])
            for inertia in found.keys() & set(INERTIAS):
                found[inertia] += shrink * basis_by(lin, inertia)[row]
        at_start = dict(zip(self.system.rows, q, strict=True)) | rates
        return {name: at_start[name] if name in INITIAL else found[name] for name in names}
