"""Initial steps, and the number of whole steps before a time."""

import numpy as np
import pytest

from discs import suggest_dt
from discs.chains.twist import PAPER, untwisting_chain
from discs.running.whole_steps import steps_before


def test_an_implicit_step_is_half_the_time_of_a_torsion_wave_from_disc_to_disc():
    problem = untwisting_chain(101, duration=100.0)
    inertia = PAPER["spin_inertia"] + PAPER["density"] * PAPER["radius"] ** 2
    assert suggest_dt(problem) == pytest.approx(0.5 * PAPER["length"] / 100 * np.sqrt(inertia / PAPER["torsion_stiffness"]))
    assert suggest_dt(untwisting_chain(101, duration=0.5)) == 0.005


@pytest.mark.parametrize("h", [0.1, 0.3, 0.7, 1e-3, 1 / 3])
def test_no_step_is_lost_by_rounding(h):
    """h i, and the sum of i times h, are i steps, up to 1e12 of them."""
    for i in [*range(1, 2000), 10**6 + 1, 3 * 10**9 + 7, 10**12 + 9]:
        assert steps_before(i * h, h) == (i, 0.0)
        assert steps_before(np.nextafter(i * h, 0.0), h) == (i, 0.0)
        if i < 2000:
            assert steps_before((i - 5e-10) * h, h) == (i, 0.0)
            assert steps_before((i + 5e-10) * h, h) == (i, 0.0)
