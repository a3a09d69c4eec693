"""Many discs: what double precision leaves, against the plain twin in extended precision."""

import numpy as np
import pytest

from compare import lump
from continuum import untwisting_rod
from discs import Midpoint, simulate
from discs.integrators import Work
from discs.skew import Phase

STEPS = 12


def extended(problem, h):
    """Positions after STEPS converged midpoint steps in `longdouble`, (3, n)."""
    z, method, work = Phase(*(part.astype(np.longdouble) for part in problem.start())), Midpoint(tolerance=1e-16), Work()
    for _ in range(STEPS):
        z = method.step(problem.system, z, 0.0, h, work)
    assert z.hi.dtype == np.longdouble
    assert work.unconverged == 0
    return z.hi + z.lo


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="longdouble is no longer than double here")
@pytest.mark.parametrize(("n", "h"), [(1025, 0.02), (4097, 0.02)])
def test_double_precision_is_enough(n, h):
    problem = lump(untwisting_rod(duration=STEPS * h), n)
    run = simulate(problem, "midpoint", h, frames=1, progress=False)
    q = np.array([run.x[-1], run.y[-1], run.theta[-1]])
    assert np.abs(q - extended(problem, h)).max() < 2e-11  # twelve steps converged to 1e-12 of the length
    assert abs(run.energy[-1] - problem.energy()) < 1e-13


def test_sweeps_grow_with_the_step_by_themselves():
    """2049 discs at h = 61 k: one sweep is off by 6e-2, and the tolerance alone decides that more are taken."""
    problem = lump(untwisting_rod(duration=2.4), 2049)
    h = 61 * problem.chain.k
    converged, loose = (simulate(problem, Midpoint(tolerance=t), h, frames=1, progress=False) for t in (1e-10, 1e-4))
    with pytest.warns(UserWarning, match="too long for this motion"):
        one = simulate(problem, Midpoint(sweeps=1, tolerance=0), h, frames=1, progress=False)
    assert 2 <= loose.stats["solves"] / loose.stats["steps"] < converged.stats["solves"] / converged.stats["steps"]
    assert np.abs(loose.y - converged.y).max() < 3e-3 < 5e-3 < np.abs(one.y - converged.y).max()


def test_steps_of_h_much_larger_than_k_keep_the_energy():
    problem = lump(untwisting_rod(), 16385)
    run = simulate(problem, Midpoint(tolerance=1e-9), 0.09, frames=1, progress=False)
    assert run.stats["unconverged"] == 0
    assert run.energy[-1] == pytest.approx(problem.energy(), abs=1e-9)
