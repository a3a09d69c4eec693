"""Runs side by side in the lanes of a vector (`discs.kernels.bundle`): eight chains of the same kind, law and number of discs.

Sweeps of a step go on until every chain of a bundle has converged, so trajectories are those of `simulate` to what the tolerance of
sweeps leaves: some units in the last place by default. Whatever would need a word - steps that do not converge or are long for the
motion, a lost heading, blow-up, a drift of energy - is left to `simulate`: the chains of that bundle are then run one by one.
"""

import time as clock
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from discs.arrays import Bool, Float
from discs.chains import stencils
from discs.chains.chain import Chain
from discs.chains.links import LinearCurvature
from discs.integrators import FixedStep
from discs.integrators.work import NO_LOOKS
from discs.kernels.vectors import LANES
from discs.problem import Problem
from discs.running.album import all_steps_before
from discs.running.calls import heed_halt
from discs.running.frames import ROUNDING
from discs.running.stats import Stats
from discs.running.step_error import SUSPECTED, Watch, estimated
from discs.running.time_loop import CHUNK

LEAST = {"consistent": 8}  # discs of a chain in a bundle, whose two ends do not overlap then
FEWEST = 3  # runs that pay side by side
MOST = 1024  # discs up to which it pays
DRIFT = 0.01  # of the energy, relative: more is left to `simulate`, which warns
DIGITS = 0.1  # of the error that rounding leaves in a sweep, as in `discs.running.rounding`


def kind_of(problem: Problem) -> tuple[Any, ...] | None:
    """What chains in a bundle have in common; None for a problem that is not for bundles."""
    chain = problem.chain
    if problem.loads or not isinstance(chain, Chain) or not LEAST.get(chain.ends, 0) <= chain.n <= MOST:
        return None
    if chain.link_law is not LinearCurvature or chain.rolling_law.parameters is None or problem.ill_posed:
        return None
    return chain.n, chain.ends, chain.rolling, problem.duration


class Found(NamedTuple):
    """Runs side by side. done : (B,), those that need no word; the others are undefined. rows : by name, (B, F, ...).

    errors : (B,), `step_error`. solves, gradients : (B,), of the bundles. seconds : of all.
    """

    done: Bool
    rows: dict[str, Float]
    errors: Float
    solves: Any
    gradients: Any
    steps: int
    seconds: float

    def stats(self, i: int) -> Stats:
        """The cost of one of the runs."""
        gradients, solves, seconds = int(self.gradients[i]), int(self.solves[i]), self.seconds / self.done.size
        return {"steps": self.steps, "gradients": gradients, "solves": solves, "unconverged": 0, "seconds": seconds}


def side_by_side(problems: Sequence[Problem], integrator: FixedStep, h: float, times: Float, checked: bool = True) -> Found | None:
    """Runs of problems of one kind with steps h, to times (F,); None if there are no steps to take.

    checked : estimate the error of the steps, and look at the energy.
    """
    from discs.kernels.bundle import Phases, bundles

    begun = clock.perf_counter()
    steps, rests = all_steps_before(times, h)
    count, last = len(problems), int(steps[-1])
    if not last or h > (1 + ROUNDING) * problems[0].duration:
        return None
    cloud = Cloud(problems)
    padded = np.minimum(np.arange(-(-count // LANES) * LANES), count - 1).reshape(-1, LANES)
    q, pi, bounds = cloud.q, cloud.momenta, cloud.bounds
    n, frames = q.shape[2], times.size

    def laned(values: Float) -> Float:
        """(B, rows, n) as (bundles, rows, n LANES)."""
        return np.ascontiguousarray(values[padded].transpose(0, 2, 3, 1)).reshape(len(padded), values.shape[1], -1)

    hi, momenta, work = laned(q), laned(pi[:, None]), np.zeros((len(padded), 2), int)
    size, clean, watch = n * LANES, np.zeros(len(padded), bool), Watch(last, 3, n)
    if not checked:
        watch.looks = watch.looks[:0]
    defects = np.zeros((len(padded), watch.looks.size, 2, 3 * LANES))
    shown, rates = np.empty((len(padded), 3, frames, size)), np.empty((len(padded), 1, frames, size))
    told, lo = np.empty((len(padded), 2 * LANES, frames)), np.zeros_like(hi[0])
    for m, bundle in enumerate(bundles(cloud.parameters, cloud.chains[padded], bounds[padded])):
        stops = steps, rests, shown[m], rates[m], told[m]
        clean[m] = advance(integrator, bundle, Phases(hi[m], lo.copy(), momenta[m]), h, watch, defects[m], stops, work[m])
    looked = defects.reshape(len(padded), watch.looks.size, 2, 3, LANES)
    errors = np.array([estimated(seen, last) for seen in looked]).ravel()[:count] if checked else np.zeros(count)

    def by_chain(values: Float) -> Float:
        """(bundles, F, n LANES) as (B, F, n)."""
        found: Float = values.reshape(len(padded), frames, n, LANES).transpose(0, 3, 1, 2).reshape(-1, frames, n)[:count]
        return found

    rows = {name: by_chain(shown[:, row]) for row, name in enumerate(("x", "y", "theta"))} | {"omega": by_chain(rates[:, 0])}
    energies = told.reshape(len(padded), 2, LANES, frames).swapaxes(1, 2).reshape(-1, 2, frames)[:count]
    rows |= {"energy": energies[:, 0], "rolling_residual": energies[:, 1]}
    fit = np.repeat(clean, LANES)[:count] & (errors <= SUSPECTED[0]) & (1.1e-16 * h * h * cloud.stiffest <= DIGITS)
    if checked:
        fit &= np.abs(rows["energy"] - cloud.energy[:, None]).max(axis=1) <= DRIFT * bounds / 10
    gradients, solves = np.repeat(work, LANES, axis=0)[:count].T
    return Found(fit, rows, errors, solves, gradients, last, clock.perf_counter() - begun)


def advance(
    integrator: FixedStep, bundle: Any, state: Any, h: float, watch: Watch, defects: Float, stops: tuple[Any, ...], work: Float
) -> bool:
    """Take all steps of a bundle, and its frames; returns whether no step needs a word.

    watch : the steps to be looked at. defects : of each look, (m, 2, 3 LANES), filled in. stops : steps before frames, rests and
    arrays of frames, as for compiled steps. work : (2,), gradients and solves, are added.
    """
    size, frames, last = state.hi.shape[1], stops[0].size, int(stops[0][-1])
    places = np.empty((1, 3, size))
    done, framed, passed, doubted = 0, 0, 0, False
    while done < last or framed < frames:
        heed_halt()
        several = 1 if doubted else min(CHUNK // size or 1, last - done)
        if doubted:  # compare the step with two of half its size
            finer, one = (type(state)(*[part.copy() for part in state]) for _ in range(2))
            integrator.steps(bundle, finer, done * h, 0.5 * h, 2, np.inf)
            integrator.steps(bundle, one, done * h, h, 1, np.inf)
            compared = [np.abs(value).reshape(3, -1, LANES).max(axis=1).ravel() for value in (finer.hi - one.hi, finer.hi)]
            longer = defects[passed, 0] > watch.limit * defects[passed, 1]
            defects[passed] = np.where(longer, compared, defects[passed])
            passed += 1
        looks = NO_LOOKS if doubted else (done, watch.looks[passed:], places, defects[passed:], watch.limit)
        tally = integrator.steps(bundle, state, done * h, h, several, 1.0, looks, (1, done, framed, *stops))
        if tally.unconverged or tally.blown or tally.lost >= 0:
            return False
        done, framed, passed, doubted = done + tally.steps, tally.framed, passed + tally.passed, tally.doubted
        if done == last and framed < frames and not tally.steps:
            return False  # a frame whose step fails
        work += tally.gradients, tally.solves
    return True


class Cloud:
    """Chains of one kind as arrays, by the formulas of `discs.chains.slaved`.

    Attributes
    ----------
    parameters : of the chains that differ. chains : (B,), the number of each problem's chain in them.
    q : (B, 3, n), initial positions. momenta : (B, n). energy : (B,), at the start. bounds : (B,), as `Problem.blown_up`.
    stiffest : (B,), as in `SlavedSystem`.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        number: dict[int, int] = {}
        first: list[Problem] = []
        for problem in problems:
            if id(problem.chain) not in number:
                number[id(problem.chain)] = len(first)
                first.append(problem)
        self.chains = np.array([number[id(problem.chain)] for problem in problems])
        systems, ends = [problem.system for problem in first], first[0].chain.ends
        self.parameters = [system.parameters for system in systems]

        def each(values: Sequence[Any]) -> Float:
            found: Float = np.array(values, float)[self.chains]
            return found

        starts = [problem.initial for problem in problems]
        self.q = np.array([(start.x, start.y, start.theta) for start in starts])
        links = stencils.links(self.q, ends)
        if ends == "ring":
            links[..., -1] += each([given.shift for given in self.parameters])
        slope = stencils.slopes(links[:, :2], each([given.k for given in self.parameters])[:, None, None], ends).swapaxes(0, 1)
        assert isinstance(first[0].chain, Chain)
        arm = first[0].chain.rolling_law.arm(each([given.radius for given in self.parameters]), slope)
        weights = each([given.weights for given in self.parameters])
        inertia = weights[:, 2] + weights[:, 0] * ((slope[1] * arm) ** 2 + (slope[0] * arm) ** 2)
        self.momenta = np.sqrt(inertia) * np.array([start.omega for start in starts])
        bends = (stencils.bends(links[:, :2], ends) ** 2).sum(axis=1)
        torsion = each([given.links.torsion for given in self.parameters])[:, 1 : 1 + links.shape[2]]
        twice = (each([given.links.bend for given in self.parameters]) * bends).sum(axis=1) + (torsion * links[:, 2] ** 2).sum(
            axis=1
        )
        self.energy = 0.5 * ((self.momenta**2).sum(axis=1) + twice)
        chains = [problem.chain for problem in first]
        rounding = [1e-16 * (np.max(c.torsion_stiffness) + np.max(c.bending_stiffness)) / c.length for c in chains]
        self.bounds = 10 * self.energy + each(rounding)
        self.stiffest = each([system.stiffest for system in systems])
