"""Runs to a tolerance by "DOP853", for few discs.

An explicit method pays where its steps, which stability limits, are few: where the fastest oscillation is not much faster than
the slowest, up to about a dozen discs. The error of its steps is controlled, that of the run is not: it is measured as with fixed
steps, by a run to a smaller tolerance of the steps.

1. Run with the tolerance of the steps START times that asked for, and with one that is PART of it. The longest step of the second
   run is shorter too, so that two runs of few steps do not agree because they have the same steps.
2. The error of the first run is SAFETY times their difference, over 1 - PART^SLOW: the error falls at least like the root of the
   tolerance of the steps, also where that is not proportional. It is relative to the smaller of the sizes of a quantity in the two
   runs: where nothing moves, a run that is not resolved is larger than the motion.
3. If it is within the tolerances, the first run is the result. Otherwise take the second one as the first, with a tolerance of the
   steps that is smaller by the excess, if that is smaller still.
4. After MOST runs, or if one fails, the search goes on with the implicit methods.

The absolute tolerance of the steps is relative to the smallest size that a quantity had so far.
"""

from collections.abc import Generator, Mapping

import numpy as np

from discs.arrays import Float
from discs.chains.chain import Chain
from discs.integrators import Integrator
from discs.integrators.ivp import DOP853
from discs.problem import Problem
from discs.running import estimates
from discs.running.failure import SimulationError
from discs.solution import Solution

START = 0.5  # first tolerance of the steps, of that of the run
PART = 0.1  # of the tolerance of the steps, for the run that measures the error
SLOW = 0.5  # least power of the tolerance of the steps with which errors fall
AIM = 1.3  # the next run aims at the tolerance over this
ABSOLUTE = 0.1  # absolute tolerance of the steps, of the relative one
FEWEST = 5  # steps of the first run, at least
SHORTER = 0.75  # the longest step of a run over that of the run before
FINEST = 1e-13  # least relative tolerance of the steps
MOST = 6  # runs
STIFF = 24.0  # most stiffness for tolerances of 1e-3; it goes like tol^-GAIN, as implicit methods then take more steps, too
GAIN = 0.17
LOOSEST = 3e-4  # largest tolerance with own headings: for larger ones "gauss6" needs no more than its two first runs


def pays(problem: Problem, tol: float) -> bool:
    """Whether an explicit method is likely to be faster than implicit ones."""
    if not isinstance(problem.chain, Chain) and tol > LOOSEST:
        return False
    return bool(stiffness(problem) <= STIFF * (1e-3 / tol) ** GAIN)


def stiffness(problem: Problem) -> float:
    """About the largest rate of oscillation over the smallest, of small motions of a straight chain.

    (alpha + rho R^2) Omega^2 = beta q^2 + K R^2 q^4 (model.md), with q^2 = 4/k^2 for the fastest and q = pi/length for the slowest.
    With own headings shear takes the place of bending: beta q^2 + A R^2 q^2; and J Omega^2 = K q^2 + G.
    """
    chain = problem.chain
    inertia = np.asarray(chain.spin_inertia) + np.asarray(chain.density) * np.asarray(chain.radius) ** 2
    radius, torsion, bending = (float(np.max(v)) for v in (chain.radius, chain.torsion_stiffness, chain.bending_stiffness))
    fast, slow = 4 / chain.k**2, (np.pi / chain.length) ** 2
    if isinstance(chain, Chain):
        most = (torsion * fast + bending * radius**2 * fast**2) / float(np.min(inertia))
    else:
        stretch, shear = float(np.max(chain.stretch_stiffness)), float(np.max(chain.shear_stiffness))
        rolling = (torsion + max(stretch, shear) * radius**2) * fast / float(np.min(inertia))
        most = max(rolling, (bending * fast + shear) / float(np.min(chain.heading_inertia)))
    least = torsion * slow / float(np.max(inertia))
    return float(np.sqrt(most / least)) if least > 0 else np.inf


def search_explicit(
    problem: Problem, bound: Mapping[str, float], times: Float
) -> Generator[tuple[Problem, Integrator, float, Float], Solution, tuple[Solution | None, dict[str, float], int]]:
    """The run within the tolerances `bound`, or None; estimates of all its errors; and the number of runs."""
    end, size = float(times[-1]), dict.fromkeys(bound, 1.0)
    rtol, longest = START * min(bound.values()), end / FEWEST
    runs: list[tuple[float, Solution]] = []
    for count in range(1, MOST + 1):
        if rtol < FINEST:
            break
        try:
            found = yield problem, DOP853(rtol, ABSOLUTE * rtol * min(1.0, *size.values())), longest, times
        except SimulationError:
            break
        runs = sorted([*runs[-1:], (rtol, found)], key=lambda run: -run[0])
        size = estimates.sizes(found, bound)
        longest *= SHORTER
        if len(runs) == 2:
            (loose, run), (tight, finer) = runs
            several = estimates.sizes(run, bound), estimates.sizes(finer, bound)
            size = {name: min(sizes[name] for sizes in several) for name in bound}
            worst = estimates.worst(_errors(run, finer, tight / loose, bound), bound, size)
            if worst <= 1:
                return run, _errors(run, finer, tight / loose, None), count
            needed = loose / (AIM * worst)
            rtol = PART * tight if needed > tight else max(needed, PART**2 * tight)
        else:
            rtol *= PART
    return None, {}, count


def _errors(run: Solution, finer: Solution, part: float, bound: Mapping[str, float] | None) -> dict[str, float]:
    """Estimated errors of a run, from one whose tolerance of the steps is a part of it."""
    found = estimates.differences(run, finer, bound)
    found = {name: estimates.SAFETY * off / (1 - part**SLOW) for name, off in found.items()}
    return estimates.with_energy(found, run) if bound is None else found
