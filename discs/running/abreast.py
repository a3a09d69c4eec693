"""Runs side by side in the lanes of a vector (`discs.kernels.bundle`): eight chains of the same kind and number of discs.

Sweeps of a step go on until every chain of a bundle has converged, so trajectories are those of `simulate` to what the tolerance of
sweeps leaves: some units in the last place by default. Runs with an error or a warning - steps that do not converge or are long for
the motion, a lost heading, blow-up, a drift of energy - are left to `simulate`: the chains of that bundle are then run one by one.
"""

import time as clock
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from discs.arrays import Bool, Float
from discs.chains.chain import SteeredChain
from discs.chains.links import LinearCurvature
from discs.integrators import FixedStep
from discs.integrators.work import NO_LOOKS
from discs.kernels.vectors import LANES
from discs.problem import BLOW_UP, Problem
from discs.running.calls import heed_halt
from discs.running.doubt import ENERGY_DRIFT_WARNING
from discs.running.frames import ROUNDING
from discs.running.initial_states import InitialStates
from discs.running.rounding import LOST_DIGITS_WARNING, lost_digits
from discs.running.step_error import SUSPECTED, Watch, estimated
from discs.running.time_loop import CHUNK
from discs.running.whole_steps import all_steps_before
from discs.stats import Stats

LEAST = {"consistent": 8}  # discs of a chain in a bundle, whose two ends do not overlap then
FEWEST = 3  # runs that pay side by side
MOST = 1024  # discs up to which it pays


def kind_of(problem: Problem) -> tuple[Any, ...] | None:
    """What chains in a bundle have in common; None for a problem that is not for bundles."""
    chain = problem.chain
    if problem.loads or not LEAST.get(chain.ends, 0) <= chain.n <= MOST or problem.ill_posed:
        return None
    if isinstance(chain, SteeredChain):
        return (chain.n, chain.ends, "own", problem.duration) if chain.degree == 1 else None
    if chain.link_law is not LinearCurvature or chain.rolling_law.parameters is None:
        return None
    return chain.n, chain.ends, chain.rolling, problem.duration


class Found(NamedTuple):
    """Runs side by side. done : (B,), those without error or warning; the others are undefined. rows : by name, (B, F, ...).

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
    starts = InitialStates(problems)
    padded = np.minimum(np.arange(-(-count // LANES) * LANES), count - 1).reshape(-1, LANES)
    q, bounds, names = starts.q, starts.bounds, starts.rows
    n, rows, frames = q.shape[2], q.shape[1], times.size

    def laned(values: Float) -> Float:
        """(B, rows, n) as (bundles, rows, n LANES)."""
        return np.ascontiguousarray(values[padded].transpose(0, 2, 3, 1)).reshape(len(padded), values.shape[1], -1)

    hi, momenta, work = laned(q), laned(starts.momenta), np.zeros((len(padded), 2), int)
    size, clean, watch = n * LANES, np.zeros(len(padded), bool), Watch(last, rows, n)
    if not checked:
        watch.looks = watch.looks[:0]
    defects = np.zeros((len(padded), watch.looks.size, 2, rows * LANES))
    recorded, rates = np.empty((len(padded), rows, frames, size)), np.empty((len(padded), rows - 2, frames, size))
    energy_slip, lo = np.empty((len(padded), 2 * LANES, frames)), np.zeros_like(hi[0])
    for m, bundle in enumerate(bundles(starts.parameters, starts.chains[padded], bounds[padded])):
        stops = steps, rests, recorded[m], rates[m], energy_slip[m]
        clean[m] = advance(integrator, bundle, Phases(hi[m], lo.copy(), momenta[m]), h, watch, defects[m], stops, work[m])
    errors = np.zeros(count)
    if checked:
        looked = np.moveaxis(defects.reshape(*defects.shape[:3], rows, LANES), -1, 1).reshape(-1, *defects.shape[1:3], rows)
        errors[:] = [estimated(seen, last)[0] for seen in looked[:count]]

    def by_chain(values: Float) -> Float:
        """(bundles, F, n LANES) as (B, F, n)."""
        each: Float = values.reshape(len(padded), frames, n, LANES).transpose(0, 3, 1, 2).reshape(-1, frames, n)[:count]
        return each

    found = {name: by_chain(recorded[:, row]) for row, name in enumerate(names)}
    found |= {name: by_chain(rates[:, row]) for row, name in enumerate(starts.rates)}
    energies = energy_slip.reshape(len(padded), 2, LANES, frames).swapaxes(1, 2).reshape(-1, 2, frames)[:count]
    found |= {"energy": energies[:, 0], "rolling_residual": energies[:, 1]}
    fit = np.repeat(clean, LANES)[:count] & (errors <= SUSPECTED[0]) & (lost_digits(h, starts.stiffest) <= LOST_DIGITS_WARNING)
    if checked:
        drift = np.abs(found["energy"] - starts.energy[:, None]).max(axis=1)
        fit &= drift <= ENERGY_DRIFT_WARNING * bounds / BLOW_UP
    gradients, solves = np.repeat(work, LANES, axis=0)[:count].T
    return Found(fit, found, errors, solves, gradients, last, clock.perf_counter() - begun)


def advance(
    integrator: FixedStep, bundle: Any, state: Any, h: float, watch: Watch, defects: Float, stops: tuple[Any, ...], work: Float
) -> bool:
    """Take all steps of a bundle, and its frames; returns whether all steps converged and none failed.

    watch : the steps to be looked at. defects : of each look, (m, 2, rows LANES), filled in. stops : steps before frames, rests and
    arrays of frames, as for compiled steps. work : (2,), gradients and solves, are added.
    """
    size, frames, last = state.hi.shape[1], stops[0].size, int(stops[0][-1])
    places = np.empty((1, len(state.hi), size))
    done, framed, passed, doubted = 0, 0, 0, False
    while done < last or framed < frames:
        heed_halt()
        several = 1 if doubted else min(CHUNK // size or 1, last - done)
        if doubted:  # compare the step with two of half its size
            finer, one = (type(state)(*[part.copy() for part in state]) for _ in range(2))
            integrator.steps(bundle, finer, done * h, 0.5 * h, 2, np.inf)
            integrator.steps(bundle, one, done * h, h, 1, np.inf)
            compared = [np.abs(value).reshape(len(value), -1, LANES).max(axis=1).ravel() for value in (finer.hi - one.hi, finer.hi)]
            longer = (defects[passed, 0] > watch.limit * defects[passed, 1]).reshape(-1, LANES).any(axis=0)
            defects[passed] = np.where(np.tile(longer, len(state.hi)), compared, defects[passed])  # of the chains that are doubted
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
