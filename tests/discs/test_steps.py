"""The numbers of steps that a search for a tolerance tries."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import steered_rod, untwisting_rod
from discs import Gauss6, Gauss8, Midpoint, SimulationError
from discs.running.once import run_fixed
from discs.running.steps import FEWEST, GROWTH, MOST, after_failure, first_steps, next_steps, second_steps
from discs.running.tolerance import to_tolerance


@pytest.mark.parametrize("scene", [untwisting_rod, steered_rod])
def test_the_first_number_has_no_unit(scene):
    """Time in other units (a factor of two, and four of stiffness) changes nothing, and twice the time takes twice the steps."""
    stiff = {"torsion_stiffness": 4.8, "bending_stiffness": 4.0, "radius": 0.7}
    soft = {name: value / (1.0 if name == "radius" else 4.0) for name, value in stiff.items()}
    own = {"stretch_stiffness": 10.0, "shear_stiffness": 10.0, "heading_inertia": 0.25} if scene is steered_rod else {}
    fast, slow = (lump(scene(**given, **own, duration=t), 17) for given, t in ((stiff, 3.0), (soft, 6.0)))
    for method, tol in ((Midpoint(), 1e-3), (Gauss6(), 1e-6), (Gauss8(), 1e-7)):
        assert FEWEST < first_steps(fast, method, tol, 3.0) == first_steps(slow, method, tol, 6.0)
        assert abs(first_steps(slow, method, tol, 6.0) - 2 * first_steps(slow, method, tol, 3.0)) <= 1
        assert first_steps(slow, method, tol, 1e6) == MOST
        assert first_steps(slow, method, tol, 1e-6) == FEWEST


def test_a_chain_without_torsion_begins_with_few_steps():
    problem = lump(untwisting_rod(), 9)
    free = replace(problem, chain=replace(problem.chain, torsion_stiffness=0.0))
    assert first_steps(free, Gauss6(), 1e-6, 4.5) == FEWEST


@pytest.mark.parametrize("first", [12, 13, 23, 24, 25, 100, 399])
def test_two_runs_have_no_alternating_mode_in_common(first):
    assert (second_steps(first) - first) % 2 == 1
    assert second_steps(first) >= 1.3 * first


def test_the_next_number_aims_at_the_tolerance():
    """An error 16 times too large, at order 4, needs twice the steps and a margin; a finest run that may be enough is checked."""
    assert 200 < next_steps(100, 134, 16.0, 4.0, True) < 220
    assert next_steps(100, 134, 1.1, 4.0, True) == GROWTH[0] * 134
    assert next_steps(100, 134, 1e9, 2.0, True) == GROWTH[1] * 134
    assert 100 < next_steps(100, 300, 2.0, 2.0, False) < 200


@pytest.mark.slow
def test_a_run_that_fails_early_shows_how_many_steps_it_takes():
    """Field law, 1024 discs: sweeps diverge with 12 to 24 steps, and the second attempt goes on to the end."""
    problem, failed, made = lump(untwisting_rod(), 1024), [], []

    def run(problem, integrator, dt, times):
        try:
            made.append(run_fixed(problem, integrator, dt, times))
        except SimulationError as error:
            failed.append(error.time)
            raise
        return made[-1]

    found = to_tolerance(problem, Gauss6(), 1e-4, np.array([4.5]), run)
    assert len(failed) == 1
    assert failed[0] < 4.0
    assert not any(each.stats["unconverged"] for each in made)
    assert found.stats["attempts"] == 1 + len(made)
    assert after_failure(12, 4.0, 4.5) == after_failure(12, None, 4.5) == 24
