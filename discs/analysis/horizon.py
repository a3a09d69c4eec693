r"""The horizon: the time at which an error of the start has grown to a tolerance. Later, a run means nothing.

A small error of the start obeys the linearised equations along the motion. Let D(t) be their solution, the tangent of the flow, and
W errors of positions and angles, orthonormal in the mean square over the discs: the first `WAVES` waves along the chain of each
coordinate, in units of the chain's length and of a radian, with momenta unchanged. An error of size 1 among them has at most the
size

    G(t) = max |D_q(t) W a| over |a| = 1,

the largest singular value of D_q W, where D_q has the rows of positions and angles. The horizon of an error is the first t with
error G(t) >= tolerance. With the tolerance 1, the error has grown to the length of the chain, or to a radian.

`Exponents.horizon` answers the same question from the growth of one random error, momenta included, and after the end of the run
from the exponent. It is for long, chaotic motions. G is that of the worst error, so it is earlier; it is for short or regular ones.

Long waves are taken, and not each disc by itself, as errors of steps are smooth too, and as G then has a limit for N -> infinity.
Growth need not be exponential: about a regular motion G grows like t, since an error changes the frequencies.
"""

from dataclasses import dataclass

import numpy as np

from discs import checks
from discs.analysis.tangent import Flow
from discs.arrays import Float
from discs.problem import Problem
from discs.running.suggest import suggest_dt
from discs.running.whole_steps import check_steps

WAVES = 4  # of each coordinate, the constant among them
MOST = 1e150  # growth; squares of larger numbers overflow


@dataclass(frozen=True, eq=False)
class Growth:
    """How much errors of the start have grown along a motion.

    Attributes
    ----------
    t : (K,), times, the first is 0. growth : (K,), G(t). dt : the step.
    """

    t: Float
    growth: Float
    dt: float

    def horizon(self, error: float, tolerance: float = 1.0) -> float:
        """The first time at which an error of the start has grown to the tolerance; infinite if there is none until the last time.

        Both are of positions, over the length of the chain, and of angles, rad.
        """
        for name, value in (("error", error), ("tolerance", tolerance)):
            checks.number(name, value, positive=True)
        reached = np.flatnonzero(self.growth * error >= tolerance)
        return float(self.t[reached[0]]) if reached.size else np.inf


def growth(problem: Problem, dt: float | None = None, method: str = "gauss4", most: float = MOST) -> Growth:
    """How much errors of the start grow along the motion of a problem over its duration.

    Parameters
    ----------
    problem : the chain, its loads, the start, and how long.
    dt : the step; None for `suggest_dt`. method : "midpoint", "gauss4", "gauss6" or "gauss8".
    most : the growth at which the computation ends.

    Raises
    ------
    ValueError : if this is no problem of a chain, or for a step or method that is none.
    SimulationError : if a step does not converge.
    """
    if not isinstance(problem, Problem):
        raise ValueError(f"growth is that of a Problem, as `compare.lump(scene, n)` makes; got {checks.shown(problem)}")
    flow, most = Flow(problem, method), checks.number("most", most, positive=True)
    h = suggest_dt(problem, method) if dt is None else checks.number("dt", dt, positive=True)
    check_steps(problem.duration, h)
    steps = max(1, int(np.ceil(problem.duration / h - 1e-9)))
    h = problem.duration / steps
    unit, y, found = np.repeat(problem.system.scale, problem.chain.n), flow.start, [1.0]
    waves = _waves(problem)
    errors = np.zeros((y.size, waves.shape[1]))
    errors[: unit.size] = waves * unit[:, None]
    for i in range(steps):
        if found[-1] >= min(most, MOST):
            break
        y, tangent = flow.step(y, i * h, h)
        errors = tangent.forward(errors)
        found.append(float(np.linalg.norm(errors[: unit.size] / unit[:, None], 2)))
    t: Float = h * np.arange(float(len(found)))
    return Growth(t, np.array(found), h)


def horizon(problem: Problem, error: float, dt: float | None = None, method: str = "gauss4", tolerance: float = 1.0) -> float:
    """The time at which an error of the start has grown to the tolerance; infinite if it is later than the duration.

    Parameters
    ----------
    problem, dt, method : as for `growth`, which raises the errors.
    error, tolerance : of positions, over the length of the chain, and of angles, rad.
    """
    most = checks.number("tolerance", tolerance, positive=True) / checks.number("error", error, positive=True)
    return growth(problem, dt, method, most).horizon(error, tolerance)


def _waves(problem: Problem) -> Float:
    """The first waves of each coordinate, (rows n, rows waves), orthonormal: cosines, on a ring sines too. Of fewer discs than
    waves, all shapes.
    """
    n, ring = problem.chain.n, problem.chain.ends == "ring"
    j, at = np.arange(WAVES), (np.arange(n) if ring else np.arange(n) + 0.5)[:, None] / n
    waves = np.cos(2 * np.pi * ((j + 1) // 2) * at - np.pi / 2 * (1 - j % 2) * (j > 0)) if ring else np.cos(np.pi * j * at)
    return np.kron(np.eye(len(problem.system.rows)), np.linalg.qr(waves)[0])
