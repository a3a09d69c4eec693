r"""Lyapunov exponents: the mean rates at which small changes of a motion grow.

Vectors w_1, w_2, ... of changes are carried along by the tangents of the steps. After every few steps they are made orthogonal
again, W = Q R, and the logarithms of the diagonal of R are summed up: over the time they took, they tend to the exponents, the
largest first.

No motion is followed for ever, so each exponent has an error bar, a sum of two:

* The time is cut into blocks; the standard error of their means tells of chance. It is too small if the motion remembers longer
  than a block.
* The vectors turn to their directions slowly: to those of a regular motion, whose changes grow like t, with means like log(t)/t.
  A transient that adds c to the logarithm of growth shifts the mean over the time T by c/T. If it is over in the first third, the
  means of the thirds differ by 3 c/T; if it goes on like log t, from T/10 to T, by 1.3 times that shift. So the largest difference
  between thirds is the second part. A second run from other vectors would not show this: both have the same transient.

The flow in (q, pi) keeps the volume, so all exponents add up to zero without dampers. As the motion is reversible too, a motion
that comes near its own reverse has exponents in pairs +-lambda.
"""

from dataclasses import dataclass

import numpy as np

from discs import checks
from discs.analysis.tangent import Flow, units
from discs.arrays import Float
from discs.problem import Problem
from discs.running.suggest import suggest_dt
from discs.running.whole_steps import check_steps

BLOCKS = 10
SKIPPED = 0.1  # of the time, in which the vectors turn to their directions


@dataclass(frozen=True, eq=False)
class Exponents:
    """Lyapunov exponents of a motion, largest first.

    Attributes
    ----------
    exponent, error : (count,), per time, and its error: the standard error of the mean over blocks of time, and the largest
        difference between thirds of the run, added up.
    t : (K,), ends of the intervals between orthogonalisations. growth : (K, count), logarithms of the growth in them.
    dt : the step.
    """

    exponent: Float
    error: Float
    t: Float
    growth: Float
    dt: float

    @property
    def finite(self) -> Float:
        """The means up to each time, (K, count): what the exponents would have been."""
        found: Float = np.cumsum(self.growth, axis=0) / self.t[:, None]
        return found

    def horizon(self, error: float = 1e-16, tolerance: float = 1e-3) -> float:
        """The time at which an error of the start has grown to the tolerance; later, a run means nothing. May be infinite.

        Both are relative to the units of `discs.analysis.tangent.units`, momenta included. The growth is that of a random error;
        after the end of the run it goes on with the exponent. `discs.analysis.horizon` takes the worst error, within the run.
        """
        for name, value in (("error", error), ("tolerance", tolerance)):
            checks.number(name, value, positive=True)
        total = np.cumsum(self.growth[:, 0])
        reached = np.flatnonzero(total >= np.log(tolerance / error))
        if reached.size:
            return float(self.t[reached[0]])
        return float(np.log(tolerance / error) / self.exponent[0]) if self.exponent[0] > self.error[0] else np.inf


def lyapunov(
    problem: Problem, count: int = 1, dt: float | None = None, method: str = "gauss4", every: int = 5, seed: int = 0
) -> Exponents:
    """The largest Lyapunov exponents of the motion of a problem over its duration.

    Parameters
    ----------
    problem : a longer duration makes errors smaller.
    count : how many exponents.
    dt : the step; None for `suggest_dt`. method : "midpoint", "gauss4", "gauss6" or "gauss8".
    every : steps between orthogonalisations; growth in them must be less than numbers have digits.
    seed : of the first vectors, which are random.

    Raises
    ------
    ValueError : for more exponents than unknowns, or a duration of fewer than 20 intervals.
    SimulationError : if a step does not converge.
    """
    if not isinstance(problem, Problem):
        raise ValueError(f"lyapunov takes a Problem, as `compare.lump(scene, n)` makes; got {checks.shown(problem)}")
    count, every, seed = checks.whole("count", count, 1), checks.whole("every", every, 1), checks.whole("seed", seed, 0)
    flow = Flow(problem, method)
    size = flow.start.size
    if count > size:
        raise ValueError(f"count must be at most {size}, the number of coordinates and momenta; got {count}")
    h = suggest_dt(problem, method) if dt is None else checks.number("dt", dt, positive=True)
    check_steps(problem.duration, h)
    checks.fits(f"dt = {h:g}", count * problem.duration / (every * h))
    intervals = int(np.ceil(problem.duration / (every * h) - 1e-9))
    if intervals < 2 * BLOCKS:
        raise ValueError(
            f"duration must be at least {2 * BLOCKS} intervals of {every} steps, {2 * BLOCKS * every * h:g}, for an error bar; got "
            f"{problem.duration:g}: take a longer duration, a smaller dt, or fewer steps with every="
        )
    h = problem.duration / (intervals * every)
    y, scale = flow.start, units(flow)
    vectors = np.linalg.qr(np.random.default_rng(seed).normal(size=(size, count)))[0]
    growth = np.empty((intervals, count))
    for i in range(intervals):
        changes = vectors * scale[:, None]
        for j in range(every):
            y, tangent = flow.step(y, (i * every + j) * h, h)
            changes = tangent.forward(changes)
        vectors, r = np.linalg.qr(changes / scale[:, None])
        growth[i] = np.log(np.maximum(np.abs(np.diag(r)), 1e-300))
    t: Float = every * h * np.arange(1.0, intervals + 1)
    kept = growth[int(SKIPPED * intervals) :]
    means = np.array([block.mean(axis=0) for block in np.array_split(kept, BLOCKS)]) / (every * h)
    thirds = [third.mean(axis=0) for third in np.array_split(kept, 3)]
    error: Float = means.std(axis=0, ddof=1) / np.sqrt(BLOCKS) + np.ptp(thirds, axis=0) / (every * h)
    return Exponents(kept.mean(axis=0) / (every * h), error, t, growth, h)
