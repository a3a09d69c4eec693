"""Loads where they are easily wrong: dampers against substeps back in time, seams of rings, ends of rods."""

from dataclasses import replace

import numpy as np
import pytest

from continuum import Scene, SteeredRod, solve
from discs import Chain, KahanLi6, Midpoint, Problem, State, simulate
from discs.chains.twist import untwisting_chain
from discs.loads import Damping, Linear, Motor, Slope, Spring, Torque, signals
from discs.running.doubt import doubted
from tests.conftest import Model, uneven

STRAIGHT = {"length": 4.0, "density": 1.0, "spin_inertia": 1.0, "torsion_stiffness": 0.8, "bending_stiffness": 0.7, "radius": 1.0}


def test_substeps_back_in_time_amplify_fast_dampers(kernels_as_python):
    """One disc's roll decays at the rate c/(alpha + rho R^2); the composition is wrong where a midpoint substep back has a pole."""
    problem = replace(uneven(5, Model("springs", "field")), loads=(Damping(rolling=30.0),), duration=0.5)
    fast = 2 / (0.25 * -min(KahanLi6.fractions))
    with pytest.warns(UserWarning, match=f"kahanli6: its substeps back in time amplify .* near {fast:.3g} per unit"):
        simulate(problem, "kahanli6", 0.25, frames=2, progress=False, engine="plain")
    slow = replace(problem, loads=(Damping(rolling=0.1),))
    run = simulate(slow, "kahanli6", 0.05, frames=2, progress=False, engine="plain")  # without a warning
    assert run.dissipated[-1] > 0


def test_stiff_springs_keep_the_balance_far_from_the_origin():
    """The potential is summed from the places of springs: half the stiffness times x^2 is 1e9 here, and the energy about 3."""
    problem = uneven(5, Model("springs", "field"))
    start = replace(problem.initial, x=np.asarray(problem.initial.x) + 1.0)
    loads = Spring(start.x, start.y, 1e8), Spring(np.asarray(start.x) + 1e-3, start.y, 1e5), Slope(0.3, 0.1)
    problem = replace(problem, initial=start, loads=(*loads, Damping(rolling=0.1), Torque(0.2, signals.sine(1.0, 2.0))))
    run = simulate(problem, Midpoint(tolerance=1e-15), 0.05, 5, progress=False, engine="plain")
    off = run.energy - problem.energy() - run.work + run.dissipated
    assert abs(off).max() < 1e-12 * abs(run.energy).max()


def test_weak_springs_far_from_the_origin_keep_their_digits():
    """0.15 d^2 for each length, d = 0.1, although 0.15 x^2 is 1e11 here."""
    problem = uneven(5, Model("springs", "field"))
    start = replace(problem.initial, x=np.asarray(problem.initial.x) + 1e6)
    problem = replace(problem, initial=start, loads=(Spring(start.x, start.y, 0.1), Spring(start.x, start.y, 0.2)))
    load, q = problem.system.load, problem.start().hi
    change = load.potential(0.0, np.add(q, [[0.1], [0.0], [0.0]])) - load.potential(0.0, q)
    assert change == pytest.approx(0.15 * 0.1**2 * 3.1, rel=1e-6)


def test_dampers_that_give_energy_are_told():
    problem = replace(uneven(5, Model("springs", "field")), loads=(Damping(rolling=1.0),), duration=0.5)
    run = simulate(problem, "midpoint", 0.05, frames=6, progress=False, engine="plain")
    assert not doubted(problem, run)
    balance = run.balance.copy()
    balance[3:, 1] -= 0.5 * balance[-1, 1]
    energy = run.energy + (run.balance - balance)[:, 1]  # the balance stays exact
    said = doubted(problem, replace(run, balance=balance, energy=energy))
    assert "dampers only take energy, but between two frames they gave" in said
    assert said.endswith('take a smaller dt, or "radau5"')  # Gauss methods ring as the midpoint rule does
    damping = replace(run, balance=balance, energy=energy, stats=run.stats | {"method": "radau3"})
    assert doubted(problem, damping).endswith("take a smaller dt")


def test_frames_between_steps_do_not_make_dampers_give_energy():
    """A Radau step ends a fast decay, and is right; the short steps to frames in it have errors of their own."""
    problem = replace(uneven(5, Model("springs", "field")), loads=(Damping(rolling=[0, 0, 20.0, 0, 0]),))
    run = simulate(problem, "radau5", 0.25, 41, progress=False, engine="plain")  # without a warning
    exact = simulate(problem, "gauss6", 0.01, 41, progress=False, engine="plain")
    assert abs(run.theta - exact.theta).max() < 2e-4
    assert np.diff(run.dissipated).min() < -5e-5
    assert "dampers only take energy" in doubted(problem, replace(run, stats=run.stats | {"method": "midpoint"}))


@pytest.mark.parametrize("at", [0.0, 0.05, 3.6, 3.8, 3.95, 4.0])
def test_a_spring_at_the_seam_of_a_periodic_rod_holds_the_disc_that_is_there(at):
    s = np.arange(16) / 4
    chain = Chain(**STRAIGHT, n=16, ends="ring", shift=(4.0, 0.0))
    spring = Spring(x=round(4 * at) / 4, y=0.0, stiffness=5.0, at=at)
    problem = Problem(chain, State(s, 0 * s, 0 * s), 1.0, (spring,))
    assert problem.energy() == 0
    assert np.abs(problem.system.load.force(0.0, problem.start().hi, np.zeros((3, 16)))).max() == 0


def test_two_motors_at_a_seam_are_one_place():
    rod = SteeredRod(**STRAIGHT, stretch_stiffness=5.0, shear_stiffness=5.0, heading_inertia=0.3)
    rate = signals.smooth(0.0, 1.0)
    motors = (Motor(rate, at=0.0), Motor(rate, at=4.0))
    scene = Scene(
        rod=rod,
        duration=1.0,
        initial=lambda s: (s, 0 * s, 0 * s, 0 * s, 0 * s, 0 * s),
        closed=True,
        rolling="unit",
        shift=(4.0, 0.0),
        loads=motors,
    )
    with pytest.raises(ValueError, match="two motors about the same axis"):
        solve(scene, tol=1e-2, progress=False)


def test_patterns_are_not_read_beyond_the_end():
    problem = untwisting_chain(38, duration=0.1, length=0.3)
    assert problem.chain.s[-1] > 0.3  # by rounding
    problem = replace(problem, loads=(Torque(lambda s: np.sqrt(0.3 - s)),))
    assert np.isfinite(problem.system.load.force(0.0, problem.start().hi, 0 * problem.start().hi)).all()


def test_viscosity_alone_does_not_say_how_many_rows_there_are():
    with pytest.raises(ValueError, match=r"must be \(rows, discs\) if viscosity is given"):
        Linear(viscosity=np.ones((1, 6)))
