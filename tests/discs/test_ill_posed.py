"""A rolling rod without bending stiffness is ill posed under the field law; `simulate` warns of it, and of nothing else."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import rolling_rod, untwisting_rod
from continuum.dispersion import growth
from discs import simulate


def test_a_limp_rolling_rod_is_warned_of():
    problem = lump(rolling_rod(omega=-1.5, bending_stiffness=0.0, radius=0.7, duration=0.01), 20)  # R omega/k = 0.7 * 1.5/0.2
    with pytest.warns(UserWarning, match=r"bending_stiffness is 0 .* ill posed.* up to 5.25 per unit of time.* rolling='unit'"):
        simulate(problem, dt=0.01, progress=False)
    twisted = lump(untwisting_rod(bending_stiffness=0.0, duration=0.01), 9)  # at rest, and about to roll
    with pytest.warns(UserWarning, match="ill posed, short waves grow at rates proportional to the number of discs, and"):
        simulate(twisted, "leapfrog", progress=False)


def test_a_limp_part_of_a_rod_is_warned_of():
    """K = 0 beyond s = 2: the motions of 65, 129, 257, 513 discs differ by .01, .26, .30 in theta."""
    part = lump(untwisting_rod(bending_stiffness=lambda s: np.maximum(2 - s, 0), duration=0.01), 17)
    with pytest.warns(UserWarning, match=r"bending_stiffness is 0, from s = 2 on, under rolling='field'.*no limit"):
        simulate(part, dt=0.01, progress=False)


def test_the_rate_that_is_told_bounds_the_growth():
    rod = rolling_rod(bending_stiffness=0.0, radius=0.7, density=1.3, spin_inertia=0.6, torsion_stiffness=0.9).rod
    k, omega = 0.1, 1.5
    q = np.linspace(0.01, np.pi / k, 400)
    fastest = growth(rod, q, omega, k=k).max()
    assert 0.3 * 0.7 * omega / k < fastest <= 0.7 * omega / k


@pytest.mark.parametrize(
    "scene",
    [
        rolling_rod(duration=0.01),
        rolling_rod(bending_stiffness=0.0, rolling="unit", duration=0.01),
        replace(untwisting_rod(bending_stiffness=0.0, twist=0.0), duration=0.01),
        untwisting_rod(bending_stiffness=lambda s: 0.2 * (4 - s), duration=0.01),
    ],
    ids=["stiff", "unit law", "at rest", "tapered"],
)
def test_others_are_not(scene):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate(lump(scene, 20), dt=0.01, progress=False)
