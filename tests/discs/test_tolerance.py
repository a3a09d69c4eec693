"""Runs to a tolerance: the true error is within it, and both choices are told."""

import numpy as np
import pytest

from compare import lump
from continuum import breathing_ring, steered_rod, untwisting_rod
from discs import Gauss6, Gauss8, SimulationError, checks, simulate
from tests.conftest import Model, models, uneven


def true_error(problem, run):
    exact = simulate(problem, Gauss8(tolerance=1e-14), problem.duration / 500, run.t, progress=False)
    rows = [(getattr(run, row), getattr(exact, row)) for row in problem.system.rows]
    return max(np.abs(a - b).max() / np.abs(b).max() for a, b in rows)


@pytest.mark.parametrize("tol", [3e-3, 1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize(
    "problem",
    [
        lump(untwisting_rod(), 65),
        lump(untwisting_rod(rolling="unit"), 200, "consistent"),
        lump(steered_rod(), 33),
        lump(breathing_ring(duration=2.0), 40),
    ],
    ids=["field", "unit", "steered", "ring"],
)
def test_the_true_error_is_within_the_tolerance(problem, tol):
    run = simulate(problem, "auto", tol=tol, frames=12, progress=False)
    assert true_error(problem, run) <= tol
    assert run.stats["method"] == ("midpoint" if tol >= 3e-4 else "gauss6")
    assert run.stats["attempts"] >= 2
    assert run.stats["dt"] > 0
    assert set(run.error_estimate) >= {*problem.system.rows, "omega", "energy"}
    assert run.t.size == 12


@models([Model("springs", "true"), Model("ring", "field")])
@pytest.mark.parametrize("method", ["midpoint", "suzuki4", "gauss4", "rk4", Gauss6(tolerance=1e-11)])
def test_a_method_of_one_s_own_choice(method, model):
    problem = uneven(7, model)
    run = simulate(problem, method, tol=1e-4, frames=3, progress=False)
    assert true_error(problem, run) <= 1e-4
    assert run.stats["method"] == getattr(method, "name", method)


@pytest.mark.parametrize(
    ("tol", "bound"),
    [(1e-3, {"x": 1e-3, "y": 1e-3}), ({"omega": 1e-4}, {"omega": 1e-4}), ({"x": 1, "omega": 2e-5}, {"x": 1.0, "omega": 2e-5})],
)
def test_tolerances_of_quantities(tol, bound):
    assert checks.tolerances(tol, ("x", "y", "omega"), ("x", "y"), 1e-12) == bound


@pytest.mark.parametrize(
    ("tol", "message"),
    [
        ({"spin": 1e-3}, "tol must be one of 'x', 'y', 'omega'; got 'spin'"),
        ({"omega": -1.0}, "tol of 'omega' must be a positive finite number; got -1.0"),
        ({}, "tol must name at least one of 'x', 'y', 'omega'; got {}"),
        (1e-300, "tol must be at least 1e-12, as positions are rounded; got 1e-300"),
        ({"omega": 1e-13}, "tol of 'omega' must be at least 1e-12"),
        ("small", "tol must be a positive finite number; got 'small'"),
    ],
)
def test_tolerances_that_are_none(tol, message):
    with pytest.raises(ValueError, match=message):
        checks.tolerances(tol, ("x", "y", "omega"), ("x", "y"), 1e-12)


def test_what_cannot_be_reached_is_said():
    with pytest.raises(ValueError, match="tol must be at least 1e-12"):
        simulate(uneven(5, Model("springs", "field")), tol=1e-300, progress=False)
    with pytest.raises(SimulationError, match="lost its heading"):
        simulate(lump(breathing_ring("unit", duration=4.0, omega=0.4), 24), "auto", frames=1, progress=False)


def test_long_runs_find_their_step():
    """The first step is a twentieth of the duration, here 150 times too long: runs fail, at ever other times, before one goes."""
    problem = lump(untwisting_rod(duration=60.0, radius=0.7, torsion_stiffness=0.8), 17)
    run = simulate(problem, "auto", tol=1e-3, frames=5, progress=False)
    truth = simulate(problem, "gauss8", dt=0.005, frames=5, progress=False)
    for name in ("x", "y", "theta"):
        exact = getattr(truth, name)
        assert np.abs(getattr(run, name) - exact).max() <= 1e-3 * np.abs(exact).max()
