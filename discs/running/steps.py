"""The numbers of steps that a search for a tolerance tries; the search itself is in `discs.running.tolerance`.

The first number is a guess from the chain alone. A torsion wave passes the chain in the time l/c, c^2 = beta/(alpha + rho R^2).
Errors of smooth motions depend on how far such waves go in a step, so to the tolerance tol a run over the time T begins with

    m = A (T c/l) tol^(-1/p)

steps, at least FEWEST and at most MOST. The numbers A and p in SMOOTH are measured on the paper's twist, where they are just
enough. Most random problems of docs/trust.md need several times as many, so they lose nothing. For slaved discs p is near three for
every Gauss method, as short waves at the ends are not resolved.

The error of the first run is measured by a second one with steps shorter by CLOSE, or WIDE if the first has few: few steps agree by
chance more often. The two numbers differ by an odd number, as a mode that alternates from step to step could agree by chance, too.

A run of the field law whose sweeps diverge fails at a time that grows like its number of steps to the power 0.8 (512 to 4096
discs), which gives the number with which it goes on to the end.
"""

import numpy as np

from discs.integrators import Integrator
from discs.problem import Problem
from discs.running.suggest import suggest_dt

FEWEST, MOST = 12, 400  # first steps, at least and at most
LEAST_TOL = 1e-9  # tolerances below it begin with the same number of steps
SMOOTH = {  # A and p, by rows (3: slaved headings) and order
    3: {2: (2.0, 2.0), 6: (1.7, 3.3), 8: (1.15, 3.3)},
    4: {2: (2.0, 2.0), 6: (5.2, 6.0), 8: (3.1, 6.0)},
}
FEW = 24  # steps below which the second run is WIDE
CLOSE, WIDE = 1.34, 1.7  # steps of the second run, over those of the first one
CHECK = 1.5  # steps of a run that is to measure the error of the finest one, over its steps
GROWTH = 1.5, 4.0  # least and largest growth of the number of steps from run to run
NEAR = 1.1  # the finest run is likely to be within the tolerance if fewer than this many times its steps are needed
AIM = 1.3  # the next run aims at the tolerance over this
SLOWEST = 2.0  # least order by which the number of steps is chosen: a smaller one is that of waves that are not resolved yet
SLAVED = 3.0  # the order that the first runs of slaved discs usually show, at most
FAILED = 1.25, 2.0, 6.0  # power of the part of the time that a failed run lacks, least and largest growth after it


def first_steps(problem: Problem, integrator: Integrator, tol: float, end: float) -> int:
    """The number of steps of the first run."""
    if np.isfinite(integrator.stability_limit):
        return max(FEWEST, int(np.ceil(end / suggest_dt(problem, integrator))))
    chain = problem.chain
    inertia = np.asarray(chain.spin_inertia) + np.asarray(chain.density) * np.asarray(chain.radius) ** 2
    passed = end / chain.length * float(np.sqrt(np.max(chain.torsion_stiffness) / np.min(inertia)))
    size, order = SMOOTH[len(problem.system.rows)].get(integrator.order, (0.0, 1.0))
    return int(np.clip(np.ceil(size * passed * max(tol, LEAST_TOL) ** (-1 / order)), FEWEST, MOST))


def second_steps(first: int) -> int:
    """The number of steps of the second run: larger by an odd number."""
    steps = int(np.ceil((CLOSE if first >= FEW else WIDE) * first))
    return steps + 1 - (steps - first) % 2


def after_failure(steps: int, failed_at: float | None, end: float) -> int:
    """The number of steps after a run that failed at a time, or whose sweeps did not converge (None)."""
    power, least, most = FAILED
    growth = np.clip((end / failed_at) ** power, least, most) if failed_at else least
    return int(np.ceil(growth * steps))


def usual(order: int, rows: int) -> float:
    """The order that the first runs usually show, while some waves are not resolved."""
    return min(order, 2 + order / 3, SLAVED if rows == 3 else np.inf)


def next_steps(coarse: int, finest: int, worst: float, order: float, first: bool) -> float:
    """The number of steps after two runs of which neither is known to be within the tolerance.

    worst : the estimated error of the run with `coarse` steps, in units of the tolerance. order : its assumed order. first : no
        other runs were made. If a few more steps than `finest` are enough, the next run measures the error of the finest one.
    """
    least, most = GROWTH
    wanted = float(coarse * (AIM * worst) ** (1 / order))
    if not first and wanted <= finest / least:
        return wanted
    return CHECK * finest if wanted <= NEAR * finest else float(np.clip(wanted, least * finest, most * finest))
