"""Static states against closed forms, and against runs that come to rest."""

from dataclasses import replace

import numpy as np
import pytest

from discs import Problem, State, simulate
from discs.analysis import equilibrium, linearise, modes
from discs.chains.twist import untwisting_chain
from discs.loads import Damping, Motor, Potential, Rest, Slope, Spring, Torque, signals

pytestmark = pytest.mark.slow  # chains come to rest

LAWS = ["field", "unit", "own"]


def straight(n=17, law="field", **parameters):
    return untwisting_chain(n, law, twist=0.0, **parameters)


def unbalanced(problem, state):
    """The largest of C^T (grad V - f)."""
    still = linearise(replace(problem, initial=state, loads=problem.loads))
    return np.abs(still.rate).max()


@pytest.mark.parametrize("law", LAWS)
def test_a_released_twist_comes_to_rest(law):
    """The paper's twisted rod: with less energy, balanced, and stable."""
    problem = untwisting_chain(17, law)
    state = equilibrium(problem)
    assert Problem(problem.chain, state, 1.0).energy() < 0.9 * problem.energy()
    assert unbalanced(problem, state) < 1e-9
    assert modes(problem, count=4, at=state).growth < 1e-6


def test_a_twisted_rod_held_at_both_ends_keeps_its_twist():
    problem = replace(untwisting_chain(17, "unit", radius=0.0), loads=(Motor(0.0, at=0.0), Motor(0.0, at=4.0)))
    state = equilibrium(problem)
    a = np.pi / 2
    np.testing.assert_allclose(state.theta, a * (2 * problem.chain.s / 4.0 - 1), atol=1e-10)
    assert not np.any(state.omega)


@pytest.mark.parametrize("law", LAWS)
def test_a_small_torque_on_a_clamped_rod_turns_it_as_the_discs_of_a_beam(law):
    """Linear in the torque: the same as the solution of the linearised equations at the straight rod."""
    size = 1e-6
    problem = replace(straight(17, law), loads=(Motor(0.0, at=0.0), Torque(size, at=4.0)))
    state = equilibrium(problem)
    lin = linearise(replace(problem, loads=(Motor(0.0, at=0.0),)))
    moved, own = lin.parts[0].shape[0], lin.parts[1]
    matrix = (lin.matrix[moved:, :moved] @ own).toarray()
    last = np.zeros(matrix.shape[0])
    last[16 - 1] = size * lin.basis[2, 16]
    right = own @ np.linalg.solve(-matrix, last)
    q = np.array([getattr(state, name) for name in lin.system.rows]) - lin.z.hi
    np.testing.assert_allclose(q.ravel(), right, atol=1e-4 * np.abs(right).max())


def test_a_rod_that_is_pulled_is_where_a_damped_run_ends():
    """A gentle pull: the path matters only at second order, and both paths end in the same shape to that order."""
    problem = replace(straight(9, "unit"), loads=(Spring(0.0, 0.06, 2.0, at=0.0), Torque(0.01, at=4.0), Damping(rolling=1.5)))
    state = equilibrium(problem)
    run = simulate(replace(problem, duration=150.0), "midpoint", 0.3, 2, progress=False, engine="plain")
    for name in ("y", "theta"):
        np.testing.assert_allclose(getattr(run, name)[-1], getattr(state, name), atol=1e-4)
    assert unbalanced(problem, state) < 1e-9


def test_a_curved_rod_rests_under_stress():
    """Discs that roll sideways only cannot bend the rod to its rest shape: its springs stay strained, and the ground holds it."""
    problem = replace(straight(9, "own"), loads=(Rest(curvature=0.5), Spring(0.0, 0.0, 1.0, at=0.0)))
    state = equilibrium(problem)
    bend = np.diff(state.phi) / problem.chain.k
    assert ((bend > 0.05) & (bend < 0.5)).all()
    assert unbalanced(problem, state) < 1e-8
    assert modes(problem, count=6, at=state).growth < 1e-6


def test_in_a_valley():
    problem = replace(straight(9, "unit"), loads=(Potential(lambda x, y: 0.5 * (y - 0.7) ** 2, lambda x, y: (0 * x, y - 0.7)),))
    state = equilibrium(problem)
    np.testing.assert_allclose(state.y, 0.7, atol=1e-8)


def test_many_discs():
    problem = replace(straight(513, "unit"), loads=(Motor(0.0, at=0.0), Torque(0.1, at=4.0)))
    state = equilibrium(problem)
    few = equilibrium(replace(straight(129, "unit"), loads=problem.loads))
    assert state.theta[-1] == pytest.approx(few.theta[-1], rel=1e-3)


def test_bad_input():
    problem = straight(9)
    with pytest.raises(ValueError, match=r"no equilibrium.*hold it, by a Spring"):
        equilibrium(replace(problem, loads=(Slope(0.0, -1.0),)))
    with pytest.raises(ValueError, match="Torque: its signal changes"):
        equilibrium(replace(problem, loads=(Torque(0.1, signals.sine(1.0, 1.0)),)))
    rolling = replace(problem.initial, omega=0.3)
    with pytest.raises(ValueError, match="the motor of disc 0 turns"):
        equilibrium(replace(problem, initial=rolling, loads=(Motor(0.3, at=0.0),)))
    with pytest.raises(ValueError, match="those of a Problem"):
        equilibrium(problem.chain)
    with pytest.raises(ValueError, match="at must be a State"):
        equilibrium(problem, at=1)
    assert isinstance(equilibrium(problem), State)
