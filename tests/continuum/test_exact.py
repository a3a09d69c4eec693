"""The field, and n discs, against exact solutions; unequal, non-unit parameters."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Chebyshev

from compare import lump
from continuum import Rod, breathing_ring, exact, rolling_rod, solve, untwisting_rod
from continuum.dispersion import frequency, growth
from continuum.figures import dispersion, fluxes, measured_growth
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


def moved(run, motion):
    """Largest difference of a run from an exact motion, over fields, frames and discs."""
    return max(np.abs(getattr(run, name) - getattr(motion, name)).max() for name in motion._fields)


def at_rest(scene, mode, amplitude, n=None):
    """The scene that starts as a standing wave of the field, or of n discs, does."""

    def initial(s):
        motion = exact.standing_wave(scene.rod, s, 0.0, mode, amplitude, scene.closed, n)
        return tuple(field[0] for field in motion)

    return replace(scene, initial=initial)


@pytest.mark.parametrize("ends", ["springs", "consistent"])
def test_straight_rod_rolls_on(rolling, ends):
    """All discs at one rate, on a closed and on a free rod: to rounding at any step."""
    scene = rolling_rod(rolling, duration=3.0, omega=1.3, amplitude=0.0, **ROD)
    free = untwisting_rod(rolling, duration=3.0, twist=0.0, **ROD)
    for problem in (lump(scene, 12), lump(replace(free, initial=scene.initial), 12, ends)):
        run = simulate(problem, dt=0.1, frames=5, progress=False)
        assert moved(run, exact.rolling_line(scene.rod, run.s, run.t, 1.3)) < 1e-12


@pytest.mark.filterwarnings("ignore:.*discs are too few for the initial fields")
@pytest.mark.parametrize("mode", [1, 2, 5])
@pytest.mark.parametrize("closed", [False, True])
def test_small_waves_of_the_chain_are_the_exact_twin(rolling, closed, mode):
    """theta = 1e-7 g(s) cos(Omega t), up to the amplitude's square and to the time step's error, on 14 discs."""
    scene = rolling_rod(rolling, omega=0.0, **ROD) if closed else untwisting_rod(rolling, **ROD)
    run = simulate(lump(at_rest(replace(scene, duration=5.0), mode, 1e-7, 14), 14), FINE, 0.002, frames=6, progress=False)
    assert moved(run, exact.standing_wave(scene.rod, run.s, run.t, mode, 1e-7, closed, 14)) < 1e-12
    assert np.ptp(run.theta[:, 0]) > 1e-7


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_small_waves_converge_to_those_of_the_field(rolling, mode):
    """Free ends, plain springs: of second order as long as the wave is small."""
    errors = []
    for n in (17, 33, 65):
        scene = at_rest(untwisting_rod(rolling, duration=2.0, **ROD), mode, 1e-7)
        run = simulate(lump(scene, n), FINE, 0.01, frames=5, progress=False)
        errors.append(np.abs(run.theta - exact.standing_wave(scene.rod, run.s, run.t, mode, 1e-7).theta).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.1), orders


def test_solve_finds_the_standing_wave_of_free_ends(rolling):
    scene = at_rest(untwisting_rod(rolling, duration=3.0, **ROD), 2, 1e-3)
    field = solve(scene, 1e-6, frames=4, progress=False)
    truth = exact.standing_wave(scene.rod, field.s, field.t, 2, 1e-3)
    for name in ("y", "theta"):  # to the tolerance and to the square of slopes, (3e-3)^2
        np.testing.assert_allclose(getattr(field, name), getattr(truth, name), atol=1e-5)


@pytest.mark.parametrize("mode", [1, 2, 3, 6])
def test_standing_wave_satisfies_its_equation_and_ends(mode):
    """M theta_tt = beta theta_ss - K R^2 theta_ssss, and both of its ends' conditions, by Chebyshev series."""
    rod, bend, short = untwisting_rod(**ROD).rod, 0.5 * 0.49, 1e-4

    def series(t, name):
        def values(s):
            return getattr(exact.standing_wave(rod, s, t, mode, 1.0), name)[0]

        return Chebyshev.interpolate(values, 50, [0.0, 3.7])

    theta, s, ends = series(0.0, "theta"), np.linspace(0.1, 3.6, 40), np.array([0.0, 3.7])
    right = 0.9 * theta.deriv(2)(s) - bend * theta.deriv(4)(s)
    np.testing.assert_allclose(rod.inertia * series(short, "omega")(s) / short, right, atol=1e-5 * np.abs(right).max())
    size = np.abs(theta.deriv(3)(s)).max()
    np.testing.assert_allclose(theta.deriv(2)(ends), 0, atol=1e-7 * size)
    np.testing.assert_allclose(0.9 * theta.deriv(1)(ends), bend * theta.deriv(3)(ends), atol=1e-6 * size)
    assert theta(0.0) == pytest.approx(1.0)
    roots = theta.roots()
    assert ((np.abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < 3.7)).sum() == mode


def test_standing_waves_have_their_limits():
    """Without bending cos(pi m s/l); without torsion the beam's cos(z) cosh(z) = 1; nearly without bending, nothing overflows."""
    s, t = np.linspace(0, 3.7, 9), [0.0, 0.7]
    limp = untwisting_rod(**ROD | {"bending_stiffness": 0.0}).rod
    nearly = untwisting_rod(**ROD | {"bending_stiffness": 1e-9}).rod
    plain = exact.standing_wave(limp, s, t, 3, 0.4)
    np.testing.assert_allclose(plain.theta[0], 0.4 * np.cos(3 * np.pi * s / 3.7), atol=1e-15)
    np.testing.assert_allclose(exact.standing_wave(nearly, s, t, 3, 0.4).theta, plain.theta, atol=1e-4)
    beam = untwisting_rod(**ROD | {"torsion_stiffness": 0.0}).rod
    rate = 4.730040744862704**2 / 3.7**2 * np.sqrt(0.5 * 0.49 / beam.inertia)
    assert exact.standing_wave(beam, 0.0, 0.7, 2, 1.0).theta[0, 0] == pytest.approx(np.cos(0.7 * rate), abs=1e-12)


@pytest.mark.parametrize(
    ("rod", "arguments", "message"),
    [
        ({}, {"mode": 0}, "mode must be a whole number of at least 1; got 0"),
        ({}, {"mode": 8, "n": 8}, "mode must be at most 7 for 8 discs; got 8"),
        ({}, {"mode": 5, "n": 8, "closed": True}, "mode must be at most 4 for 8 discs; got 5"),
        ({"torsion_stiffness": 0.0}, {"mode": 1}, "mode 1 with free ends needs a positive torsion_stiffness"),
        ({}, {"mode": 2, "n": 2}, "n .* must be a whole number of at least 3"),
    ],
)
def test_standing_waves_that_are_not_there(rod, arguments, message):
    with pytest.raises(ValueError, match=message):
        exact.standing_wave(untwisting_rod(**ROD | rod).rod, 0.0, 0.0, amplitude=1.0, **arguments)


@pytest.mark.parametrize("mode", [1, 3])
def test_growing_wave_of_the_chain_is_the_exact_twin(mode):
    """Field law: all four fields, to first order in the amplitude, while the wave grows; that of the field at order 2 from it."""
    rod, t = Rod(**ROD), np.array([0.0, 1.0, 2.0])
    errors = []
    for n in (32, 64, 128):

        def initial(s, n=n):
            return tuple(field[0] for field in exact.growing_wave(rod, s, 0.0, 1.3, mode, 1e-8, n))

        scene = replace(rolling_rod(duration=2.0, **ROD), initial=initial)
        run = simulate(lump(scene, n), FINE, 0.01, frames=t, progress=False)
        twin, field = (exact.growing_wave(rod, run.s, run.t, 1.3, mode, 1e-8, m) for m in (n, None))
        assert moved(run, twin) < 2e-12  # the square of 1e-7, and the step's error
        errors.append(np.abs(twin.theta - field.theta).max())
    assert np.ptp(run.theta[-1]) > 3 * np.ptp(run.theta[0])
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.2), orders


@pytest.mark.parametrize("change", [{"omega": 0.0}, {"rod": Rod(**ROD | {"torsion_stiffness": 0.0}), "mode": 6}])
def test_waves_that_do_not_grow(change):
    given = {"rod": Rod(**ROD), "omega": 1.3, "mode": 1} | change
    with pytest.raises(ValueError, match=r"wave \d does not grow at omega = "):
        exact.growing_wave(s=0.0, t=0.0, amplitude=1.0, **given)


def test_growth_measured_for_the_picture():
    """All waves of one simulation grow as the relation of n discs says, and under the unit law not at all."""
    rod, q = Rod(**ROD), 2 * np.pi * np.arange(1, 9) / 3.7
    np.testing.assert_allclose(measured_growth(rod, 1.3, "field", 24, 8), growth(rod, q, 1.3, k=3.7 / 24), atol=1e-3)
    np.testing.assert_allclose(measured_growth(rod, 1.3, "unit", 24, 8), 0, atol=1e-3)


def test_pictures(tmp_path):
    ax = dispersion(Rod(**ROD), n=16, modes=3)
    np.testing.assert_allclose(ax.lines[0].get_ydata()[-1], growth(Rod(**ROD), 7 * np.pi / 3.7, 1.0))
    figure = fluxes(untwisting_rod(duration=0.5, **ROD), n=17, frames=5)
    for drawn in (ax.figure, figure):
        drawn.savefig(tmp_path / "picture.png")
        assert (tmp_path / "picture.png").stat().st_size > 10_000
