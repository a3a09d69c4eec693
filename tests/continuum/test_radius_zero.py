"""Discs of radius zero only twist."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import Rod, breathing_ring, exact, rolling_rod, solve, steered_rod, untwisting_rod
from discs import Problem, Suzuki4, simulate
from tests.continuum.test_exact import ROD, at_rest, moved, ring_errors

THIN = ROD | {"radius": 0.0}


def twisting(rolling, closed, n, engine):
    """A run of n discs of radius 0 from a standing wave of amplitude 1.4, and its scene."""
    scene = rolling_rod(rolling, omega=0.0, **THIN) if closed else untwisting_rod(rolling, **THIN)
    scene = at_rest(replace(scene, duration=3.0), 1, 1.4)
    return simulate(lump(scene, n), Suzuki4(), 0.02, frames=4, progress=False, engine=engine), scene


@pytest.mark.parametrize("engine", ["compiled", "plain"])
@pytest.mark.parametrize("closed", [False, True])
def test_discs_of_radius_zero_only_twist(rolling, closed, engine):
    """R = 0: the line stays to the last bit; theta is exact in modes at any amplitude, up to the time step's error."""
    run, scene = twisting(rolling, closed, 16, engine)
    assert moved(run, exact.standing_wave(scene.rod, run.s, run.t, 1, 1.4, closed, 16)) < 1e-5
    np.testing.assert_array_equal(run.x, np.tile(run.s, (4, 1)))
    np.testing.assert_array_equal(run.y, 0)


@pytest.mark.parametrize("closed", [False, True])
def test_discs_of_radius_zero_converge_to_the_wave_equation(rolling, closed):
    errors = []
    for n in (16, 32, 64):
        run, scene = twisting(rolling, closed, n, "compiled")
        errors.append(np.abs(run.theta - exact.standing_wave(scene.rod, run.s, run.t, 1, 1.4, closed).theta).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.1), orders


def test_field_of_radius_zero():
    field = solve(untwisting_rod(duration=3.0, **THIN), 1e-6, frames=4, progress=False)
    phase = np.cos(np.pi * field.t * np.sqrt(0.9 / 0.6) / 3.7)
    np.testing.assert_array_equal(field.y, 0)
    np.testing.assert_allclose(field.theta, -np.pi / 2 * phase[:, None] * np.cos(np.pi * field.s / 3.7), atol=1e-6)


@pytest.mark.parametrize("engine", ["compiled", "plain"])
def test_steered_discs_of_radius_zero_only_twist(engine):
    """The line stays; theta is a torsion wave."""
    scene = steered_rod(duration=3.0, **THIN)
    run = simulate(lump(scene, 17), Suzuki4(), 0.02, frames=4, progress=False, engine=engine)
    assert moved(run, exact.standing_wave(Rod(**THIN), run.s, run.t, 1, -np.pi / 2, n=17)) < 1e-5


def test_ring_of_radius_zero_stays(rolling):
    """Discs of radius 0 on a ring spin on in place: bent as it is, it cannot move."""
    scene = breathing_ring(rolling, duration=0.8, omega=0.4, **THIN)
    truth = exact.ring(scene.rod, [0.3, 0.8], 0.4, rolling)
    np.testing.assert_allclose(truth, [[3.7 / (2 * np.pi)] * 2, [0.12, 0.32], [0.4, 0.4]], rtol=1e-12)
    assert max(ring_errors(scene, rolling, 12, twin=True)) < 1e-12


def test_radius_zero_needs_spin_inertia():
    with pytest.raises(ValueError, match="spin_inertia must be positive where radius = 0"):
        untwisting_rod(**THIN | {"spin_inertia": 0.0})
    for scene in (untwisting_rod(**ROD), steered_rod(**ROD)):
        problem = lump(scene, 6)
        bad = replace(problem.chain, radius=[0.7, 0.7, 0.0, 0.7, 0.7, 0.7], spin_inertia=0.0)
        with pytest.raises(ValueError, match=r"spin_inertia must be positive where .*radius = 0, as at disc 2; got 0"):
            Problem(bad, problem.initial, 1.0)


def test_field_of_a_steered_rod_of_radius_zero():
    """Spectral elements: the line stays, theta is the torsion wave."""
    field = solve(steered_rod(duration=3.0, **THIN), 1e-6, frames=4, progress=False)
    truth = exact.standing_wave(Rod(**THIN), field.s, field.t, 1, -np.pi / 2)
    for name in ("x", "y", "theta"):
        np.testing.assert_allclose(getattr(field, name), getattr(truth, name), atol=1e-6)


@pytest.mark.parametrize("method", ["midpoint", "leapfrog", "rk4", "gauss4"])
def test_any_method_takes_radius_zero(method):
    """Order 2 or more on the torsion wave: no method divides by the radius."""
    run = simulate(lump(untwisting_rod(duration=1.0, **THIN), 9), method, 0.01, frames=2, progress=False, engine="plain")
    k = 3.7 / 8
    spin = Rod(**THIN)
    wave = exact.standing_wave(spin, run.s, run.t, 1, -np.pi / 2, n=9)
    tolerance = 1e-4 if method != "leapfrog" else 1e-3 * k
    np.testing.assert_allclose(run.theta, wave.theta, atol=tolerance)
    np.testing.assert_array_equal(run.y, 0)
