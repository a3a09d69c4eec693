"""The field, and n discs, against exact solutions; unequal, non-unit parameters."""

import numpy as np
import pytest

from continuum import breathing_ring, exact, rolling_rod, solve, untwisting_rod
from continuum.dispersion import frequency, growth
from continuum.mesh import semidiscretise
from discs import Midpoint, Suzuki4, simulate

ROD = {"length": 3.7, "density": 1.3, "spin_inertia": 0.6, "torsion_stiffness": 0.9, "bending_stiffness": 0.5, "radius": 0.7}
FINE = Suzuki4(Midpoint(tolerance=1e-13))


def test_energy_of_the_paper_s_scene():
    """E(0) = pi^4/80, and beta pi^4 twist^2/(4 length) in general; the chain's falls short by O(k^2)."""
    for n in (129, 257):
        k = 4 / (n - 1)
        assert semidiscretise(untwisting_rod(), n, "consistent").energy() == pytest.approx(np.pi**4 / 80, rel=k**2)
    scene = untwisting_rod(twist=1.5, **ROD)
    expected = 0.9 * np.pi**4 * 1.5**2 / (4 * 3.7)
    assert semidiscretise(scene, 513, "consistent").energy() == pytest.approx(expected, rel=(3.7 / 512) ** 2)


def ring_errors(scene, law, n, twin):
    run = simulate(semidiscretise(scene, n, "consistent"), FINE, scene.duration / 40, frames=4, progress=False)
    truth = exact.ring(scene.rod, run.t, 0.4, law, n if twin else None)
    centre = run.x.mean(axis=1, keepdims=True), run.y.mean(axis=1, keepdims=True)
    radius = np.hypot(run.x - centre[0], run.y - centre[1])
    pairs = ((radius, truth.radius), (run.theta, truth.theta), (run.omega, truth.omega))
    return [np.abs(a - b[:, None]).max() for a, b in pairs]


def test_breathing_ring_converges_at_order_two(rolling):
    scene = breathing_ring(rolling, duration=0.8, omega=0.4, **ROD)
    errors = np.array([ring_errors(scene, rolling, n, twin=False) for n in (32, 64, 128)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.05), orders


@pytest.mark.parametrize("n", [5, 12, 33])
def test_breathing_ring_of_n_discs_is_its_exact_twin(rolling, n):
    scene = breathing_ring(rolling, duration=0.8, omega=0.4, **ROD)
    assert max(ring_errors(scene, rolling, n, twin=True)) < 1e-9  # the time step's error


def test_ring_solution_satisfies_its_laws(rolling):
    """Energy and rolling of the exact solution itself, by differences in time."""
    rod = breathing_ring(rolling, **ROD).rod
    t = np.linspace(0, 0.8, 401)
    ring = exact.ring(rod, t, 0.4, rolling)
    a0 = rod.length / (2 * np.pi)
    e = rod.radius * (ring.radius / a0 if rolling == "field" else 1.0)
    rate = np.gradient(ring.radius, t)[1:-1]
    np.testing.assert_allclose(rate, (-e * ring.omega)[1:-1], atol=1e-5)
    energy = (0.6 + 1.3 * e**2) * ring.omega**2 / 2 + 0.5 * ring.radius**2 / (2 * a0**4)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-11)


def test_ring_refuses_times_after_its_collapse():
    with pytest.raises(ValueError, match=r"the ring is a point at t = 0\.79"):
        exact.ring(breathing_ring("unit").rod, [0.0, 3.0], 0.4, "unit")
    for times in ([3.0, 0.0], [-1.0], []):
        with pytest.raises(ValueError, match="t must be increasing times from 0 on"):
            exact.ring(breathing_ring("unit").rod, times, 0.4)


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_rolling_rod_grows_as_its_dispersion_relation_says(mode):
    """Field law: within 1 % of the field's rate at n = 128, and much closer to that of n discs."""
    n, scene = 128, rolling_rod("field", duration=11.0, omega=1.3, mode=mode, amplitude=1e-9, **ROD)
    run = simulate(semidiscretise(scene, n, "consistent"), FINE, 0.03, frames=[8.0, 11.0], progress=False)
    amplitude = np.abs(np.fft.rfft(run.theta, axis=1)[:, mode])
    measured = np.log(amplitude[1] / amplitude[0]) / 3.0
    q = 2 * np.pi * mode / 3.7
    assert measured == pytest.approx(float(growth(scene.rod, q, 1.3)), rel=1e-2)
    assert measured == pytest.approx(float(growth(scene.rod, q, 1.3, k=3.7 / n)), rel=2e-3)


@pytest.mark.parametrize("mode", [1, 3])
def test_rolling_rod_does_not_grow_under_the_unit_law(mode):
    scene = rolling_rod("unit", duration=20.0, omega=1.3, mode=mode, amplitude=1e-8, **ROD)
    run = simulate(semidiscretise(scene, 64, "consistent"), FINE, 0.02, frames=201, progress=False)
    amplitude = np.abs(np.fft.rfft(run.theta, axis=1)[:, mode]) / 32
    # it swings at the frequency of the rod at rest, between plus and minus its first value
    swing = 1e-8 * np.abs(np.cos(frequency(scene.rod, 2 * np.pi * mode / 3.7, 3.7 / 64) * run.t))
    np.testing.assert_allclose(amplitude, swing, atol=2e-10)
    assert growth(scene.rod, 1.0, 1.3, "unit") == 0


def test_growth_is_a_root_and_has_its_limits():
    rod = rolling_rod(**ROD).rod
    q = np.array([0.3, 1.7, 12.0, 1e4])
    sigma = growth(rod, q, 1.3)
    middle = 0.9 * q**2 + 0.5 * 0.49 * q**4 - 0.6 * 0.49 * 1.69 * q**2
    residual = rod.inertia * sigma**4 + sigma**2 * middle - 0.9 * 0.49 * 1.69 * q**4
    assert np.abs(residual / (0.9 * 0.49 * 1.69 * q**4)).max() < 1e-9
    assert sigma[-1] == pytest.approx(1.3 * np.sqrt(0.9 / 0.5), rel=1e-6)
    limp = rolling_rod(**ROD | {"bending_stiffness": 0.0}).rod
    assert growth(limp, 200.0, 1.3) == pytest.approx(2 * growth(limp, 100.0, 1.3), rel=1e-3)  # ill posed


@pytest.mark.parametrize("mode", [1, 4])
def test_small_waves_of_the_rod_at_rest(mode, rolling):
    """Rolling at the rate 0: the perturbation of `rolling_rod` swings at the frequency of n discs."""
    n, scene = 32, rolling_rod(rolling, duration=5.0, omega=0.0, mode=mode, amplitude=1e-7, **ROD)
    run = simulate(semidiscretise(scene, n, "consistent"), FINE, 0.005, frames=11, progress=False)
    wave = frequency(scene.rod, 2 * np.pi * mode / 3.7, 3.7 / n)
    expected = np.cos(wave * run.t)[:, None] * run.theta[0]
    np.testing.assert_allclose(run.theta, expected, atol=1e-11)
    assert frequency(scene.rod, 2 * np.pi * mode / 3.7) > wave


def test_thin_discs_only_twist():
    """R -> 0: the rod does not move, and theta obeys the wave equation, cos(pi s/l) cos(pi t sqrt(beta/alpha)/l)."""
    scene = untwisting_rod(duration=3.0, **ROD | {"radius": 1e-9})
    field = solve(scene, 1e-6, frames=4, progress=False)
    assert np.abs(field.y).max() < 1e-8
    phase = np.cos(np.pi * field.t * np.sqrt(0.9 / 0.6) / 3.7)
    np.testing.assert_allclose(field.theta, -np.pi / 2 * phase[:, None] * np.cos(np.pi * field.s / 3.7), atol=1e-6)
