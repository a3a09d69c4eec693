"""Discs on ground with viscous slip: equations, energy, and what they tend to."""

import numpy as np
import pytest

from compare import lump
from continuum import untwisting_rod
from discs import Problem, simulate
from discs.loads import Slope
from discs.mechanics.sliding import Ground, slide
from tests.conftest import Model, models, uneven

KINDS = [Model("springs", "field"), Model("consistent", "unit"), Model("ring", "unit")]


@models(KINDS)
def test_jacobian(model):
    """Against differences of the rates, at rates with slip."""
    problem = uneven(6, model)
    ground, rng = Ground(problem, 0.1), np.random.default_rng(3)
    start = problem.initial
    y = np.concatenate([start.x, start.y, start.theta, rng.standard_normal(18), [0.0]])
    step = 1e-6 * np.eye(y.size)
    known = np.array([(ground.rates(0.0, y + e) - ground.rates(0.0, y - e)) / 2e-6 for e in step]).T
    found = ground.jacobian(0.0, y).toarray()
    np.testing.assert_allclose(found[:-1], known[:-1], atol=1e-7 * abs(known).max())


@pytest.mark.slow
@models(KINDS)
def test_they_tend_to_rolling_discs_at_first_order(model):
    problem = uneven(6, model)
    rolling = simulate(problem, "gauss8", 0.02, [0.2], ("contact_force",), progress=False, engine="plain")
    off = []
    for epsilon in (1e-4, 1e-5):
        run = slide(problem, epsilon, [0.2], rtol=1e-8)
        near = run.contact_force - rolling.contact_force
        off.append([abs(run.x - rolling.x).max(), abs(run.theta - rolling.theta).max(), abs(near).max()])
        assert run.rolling_residual.max() == pytest.approx(
            (epsilon * np.hypot(*rolling.contact_force[-1]) / problem.chain.w).max(), rel=0.05
        )
    np.testing.assert_allclose(np.divide(*off), 10.0, rtol=0.1)


def test_sliding_takes_the_energy_that_is_lost():
    run = slide(uneven(7, KINDS[0]), 0.03, 5)
    np.testing.assert_allclose(run.energy + run.dissipated, run.energy[0], rtol=1e-7)
    assert run.dissipated[-1] > 1e-3 * run.energy[0]
    assert run.work.max() == 0


def test_without_ground_the_line_stays():
    """epsilon -> infinity: theta moves as a torsion wave alone, and no force acts on the line."""
    run = slide(lump(untwisting_rod(duration=1.0), 9), 1e9, 2)
    assert abs(run.y).max() < 1e-8
    assert abs(run.theta[-1] - run.theta[0]).max() > 0.1


def test_bad_input():
    problem = uneven(5, KINDS[0])
    for wrong in (uneven(5, Model("springs", "steered")), uneven(5, Model("springs", "true")), loaded(problem)):
        with pytest.raises(ValueError, match=r"slide takes discs .*, with linear curvature and without loads; got .*: take "):
            slide(wrong, 0.1)
    with pytest.raises(ValueError, match="epsilon must be a positive finite number; got 0"):
        slide(problem, 0.0)


def loaded(problem: Problem) -> Problem:
    return Problem(problem.chain, problem.initial, problem.duration, loads=(Slope(0.1, 0.2),))
