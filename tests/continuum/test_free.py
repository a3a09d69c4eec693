"""The free rod against rigid motion, beams, rings and PyElastica; unequal, non-unit parameters."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from continuum import Rod
from continuum.free import free_rod
from discs import SimulationError

ROD = Rod(length=3.7, density=1.3, spin_inertia=0.6, torsion_stiffness=0.9, bending_stiffness=0.5, radius=0.7)
A = 3.7 / (2 * np.pi)  # of the ring


def straight(s):
    return np.array([s, 0 * s])


def whip(s):
    return np.array([0 * s, 1.2 * np.exp(-(((s - 1.7) / 0.7) ** 2))])


def circle(s):
    return A * np.array([np.cos(s / A), np.sin(s / A)])


def ringing(s, mode=2, rate=0.4):
    """Velocity rate cos(m s/a) outwards, with what the arc length then asks for along the ring."""
    out, along = rate * np.cos(mode * s / A), -rate * np.sin(mode * s / A) / mode
    cos, sin = np.cos(s / A), np.sin(s / A)
    return np.array([out * cos - along * sin, out * sin + along * cos])


def rms(values):
    return np.sqrt(np.mean(values**2))


def orders(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def moving(n, dt, closed=False, frames=2, duration=1.5, theta=0.0, omega=0.0):
    r0, v0 = (circle, ringing) if closed else (straight, whip)
    return free_rod(ROD, r0, v0, theta, omega, duration, n, dt, closed, frames, progress=False, estimate=False)


@pytest.mark.parametrize("closed", [False, True])
def test_what_the_step_keeps(closed):
    """Lengths of links, momentum and angular momentum to rounding; energy within O(h^2), back where it was on the way back."""
    swings = []
    for dt in (0.04, 0.02, 0.01):
        run = moving(34, dt, closed, frames=51)
        r, v = np.stack([run.x, run.y], axis=1), np.stack([run.x_rate, run.y_rate], axis=1)
        around = (0, 1) if closed else (0, 0)
        links = np.diff(np.pad(r, ((0, 0), (0, 0), around), mode="wrap"), axis=-1)
        length = np.hypot(links[:, 0], links[:, 1])
        np.testing.assert_allclose(length, length[:1] * np.ones((51, 1)), rtol=1e-13)
        assert np.ptp(r, axis=0).max() > 0.1  # it does move
        mass = 1.3 * (3.7 / (34 if closed else 33)) * np.ones(34)
        if not closed:
            mass[[0, -1]] /= 2
        for kept in ((mass * v).sum(axis=-1), (mass * (r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0])).sum(axis=-1)):
            np.testing.assert_allclose(kept, kept[:1] + 0 * kept, atol=1e-11)
        swings.append(np.ptp(run.energy) / run.energy[0])
    assert swings[0] < 5e-3
    assert orders(swings) == pytest.approx(2.0, abs=0.1), swings


@pytest.mark.slow
def test_energy_does_not_drift():
    """Over 1200 steps, several swings of the rod: no more in the second half than in the first, and no shift of the mean."""
    energy = moving(17, 0.02, duration=24.0, frames=401).energy
    first, second = energy[:200], energy[200:]
    assert np.ptp(second) < 1.5 * np.ptp(first) < 1e-3 * energy[0]
    assert abs(second.mean() - first.mean()) < 0.2 * np.ptp(first)


def test_step_is_reversible():
    run = moving(34, 0.02)
    here = [np.array([getattr(run, name)[-1] for name in names]) for names in (("x", "y"), ("x_rate", "y_rate"))]
    back = free_rod(ROD, here[0], -here[1], 0.0, 0.0, 1.5, 34, 0.02, frames=1, progress=False, estimate=False)
    np.testing.assert_allclose(np.stack([back.x[0], back.y[0]]), straight(run.s), atol=1e-9)
    np.testing.assert_allclose(np.stack([back.x_rate[0], back.y_rate[0]]), -np.stack([run.x_rate[0], run.y_rate[0]]), atol=1e-8)


@pytest.mark.parametrize("closed", [False, True])
def test_order_two_in_time(closed):
    """Places, velocities and tension on a fixed mesh, by changes between steps h, h/2, h/4, h/8."""
    runs = [moving(25, 0.01 / 2**i, closed, frames=1, duration=0.5) for i in range(4)]
    for name in ("x", "y", "x_rate", "tension"):
        changes = [rms(getattr(b, name) - getattr(a, name)) for a, b in pairwise(runs)]
        assert orders(changes) == pytest.approx(2.0, abs=0.1), (name, changes)


@pytest.mark.parametrize("closed", [False, True])
def test_order_two_in_space(closed):
    """Places and tension by changes between meshes k, k/2, k/4, k/8, all with one step."""
    runs = [moving(40 * 2**i + (not closed), 0.005, closed, frames=1, duration=0.5) for i in range(4)]
    places = [np.stack([run.x[0, ::every], run.y[0, ::every]]) for run, every in zip(runs, (1, 2, 4, 8), strict=True)]
    at = np.linspace(0.5, 3.2, 10)  # by a cubic through the middles of links, whose error is of order four
    tensions = [CubicSpline(run.s[: run.tension.shape[1]] + run.s[1] / 2, run.tension[0])(at) for run in runs]
    for found in (places, tensions):
        changes = [rms(b - a) for a, b in pairwise(found)]
        assert orders(changes) == pytest.approx(2.0, abs=0.1), changes


def test_straight_rod_turns_rigidly():
    """r = (s - l/2)(cos Omega t, sin Omega t); p = rho Omega^2 ((l/2)^2 - s^2)/2, of n nodes rho Omega^2 k^2/8 more."""
    errors = []
    for dt in (0.1, 0.05, 0.025):
        run = free_rod(
            ROD,
            lambda s: straight(s) - np.array([[1.85], [0.0]]),
            lambda s: np.array([0 * s, 1.1 * (s - 1.85)]),
            0.0,
            0.0,
            2.0,
            17,
            dt,
            frames=3,
            progress=False,
        )
        arm = run.s - 1.85
        errors.append(
            max(np.abs(run.x - np.outer(np.cos(1.1 * run.t), arm)).max(), np.abs(run.y - np.outer(np.sin(1.1 * run.t), arm)).max())
        )
        middle = (arm[1:] + arm[:-1]) / 2
        parabola = 1.3 * 1.1**2 * (1.85**2 - middle**2) / 2
        np.testing.assert_allclose(run.tension, np.tile(parabola + 1.3 * 1.1**2 * run.s[1] ** 2 / 8, (3, 1)), rtol=1e-10)
    assert orders(errors) == pytest.approx(2.0, abs=0.02), errors


@pytest.mark.parametrize("mode", [1, 2])
def test_small_bending_is_a_free_free_beam(mode):
    """Euler-Bernoulli: cos(q l) cosh(q l) = 1, rho Omega^2 = K q^4, y = a shape(s) sin(Omega t)/Omega."""
    low = (mode + 0.5) * np.pi
    z = brentq(lambda z: np.cos(z) - 1 / np.cosh(z), low - 0.5, low + 0.5)
    q = z / 3.7
    omega, bend = q**2 * np.sqrt(0.5 / 1.3), (np.cosh(z) - np.cos(z)) / (np.sinh(z) - np.sin(z))

    def shape(s):
        return np.cosh(q * s) + np.cos(q * s) - bend * (np.sinh(q * s) + np.sin(q * s))

    def velocity(s):
        return np.array([0 * s, 1e-5 * shape(s)])

    errors = []
    for n in (17, 33, 65):
        dt = 2 / omega / (n - 1)
        run = free_rod(ROD, straight, velocity, 0.0, 0.0, 2 / omega, n, dt, frames=5, progress=False, estimate=False)
        truth = 1e-5 * shape(run.s) * np.sin(omega * run.t)[:, None] / omega
        errors.append(np.abs(run.y - truth).max() / np.abs(truth).max())
    assert orders(errors) == pytest.approx(2.0, abs=0.1), errors


@pytest.mark.parametrize("mode", [2, 3])
def test_small_swing_of_the_inextensible_ring(mode):
    """Hoppe's frequencies, rho a^4 Omega^2 = K m^2 (m^2 - 1)^2/(m^2 + 1); at rest p = -K/a^2."""
    omega = np.sqrt(0.5 / 1.3 / A**4 * mode**2 * (mode**2 - 1) ** 2 / (mode**2 + 1))

    def velocity(s):
        return ringing(s, mode, 1e-5)

    errors = []
    for n in (24, 48, 96):
        dt = 2 / omega / n
        run = free_rod(ROD, circle, velocity, 0.0, 0.0, 2 / omega, n, dt, True, frames=5, progress=False, estimate=False)
        outwards = np.hypot(run.x, run.y) - np.hypot(*circle(run.s))
        truth = 1e-5 * np.cos(mode * run.s / A) * np.sin(omega * run.t)[:, None] / omega
        errors.append(np.abs(outwards - truth).max() / np.abs(truth).max())
    assert orders(errors) == pytest.approx(2.0, abs=0.1), errors
    np.testing.assert_allclose(run.tension, -0.5 / A**2, rtol=2e-3)  # k^2/a^2/2 and the swing's share


def test_centre_line_and_torsion_know_nothing_of_each_other():
    """(freeFE): to the last bit; theta alone swings as cos(pi s/l) cos(pi t sqrt(beta/alpha)/l)."""

    def theta(s):
        return 0.7 * np.cos(np.pi * s / 3.7)

    plain, twisted = moving(33, 0.02, frames=4), moving(33, 0.02, frames=4, theta=theta)
    still = free_rod(ROD, straight, np.zeros((2, 33)), theta, 0.0, 1.5, 33, 0.02, frames=4, progress=False)
    for name in ("x", "y", "x_rate", "y_rate", "tension"):
        np.testing.assert_array_equal(getattr(twisted, name), getattr(plain, name))
    np.testing.assert_array_equal(twisted.theta, still.theta)
    assert np.ptp(still.energy) < 1e-13
    errors = []
    for n in (17, 33, 65):
        run = free_rod(ROD, straight, np.zeros((2, n)), theta, 0.0, 3.0, n, 0.64 / (n - 1), frames=5, progress=False)
        truth = np.cos(np.pi * np.sqrt(0.9 / 0.6) / 3.7 * run.t)[:, None] * theta(run.s)
        errors.append(np.abs(run.theta - truth).max())
    assert orders(errors) == pytest.approx(2.0, abs=0.05), errors


@pytest.mark.slow
@pytest.mark.long
def test_against_a_thin_rod_of_pyelastica():
    """A three-dimensional Cosserat rod that shears and stretches: what it differs by falls like the square of its thickness."""
    elastica = pytest.importorskip("elastica")

    class Simulator(elastica.BaseSystemCollection):
        pass

    cells, gaps = 48, []
    free = moving(cells + 1, 0.005, frames=1)
    for radius in (0.08, 0.04, 0.02):
        area, second = np.pi * radius**2, np.pi * radius**4 / 4
        young = 0.5 / second
        rod = elastica.CosseratRod.straight_rod(
            cells, np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), 3.7, radius, 1.3 / area,
            youngs_modulus=young, shear_modulus=young / 2.6,
        )  # fmt: skip
        rod.velocity_collection[:2] = whip(free.s)
        turning = np.zeros((3, cells))
        turning[2] = np.diff(rod.velocity_collection[1]) / free.s[1]
        rod.omega_collection[:] = np.einsum("ijk,jk->ik", rod.director_collection, turning)
        simulator = Simulator()
        simulator.append(rod)
        simulator.finalize()
        steps = int(np.ceil(1.5 * cells / 3.7 * np.sqrt(young * area / 1.3) / 0.3))
        elastica.integrate(elastica.PositionVerlet(), simulator, 1.5, steps, progress_bar=False)
        gaps.append(np.abs(rod.position_collection[:2] - np.stack([free.x[0], free.y[0]])).max())
    assert gaps[-1] < 3e-3, gaps
    assert gaps[0] > 3 * gaps[1] > 6 * gaps[2], gaps


def test_initial_velocity_is_the_nearest_one_that_stretches_nothing():
    chain_velocity = ringing(3.7 / 24 * np.arange(24))
    run = moving(24, 0.02, closed=True)
    links, rates = (
        np.roll(np.stack(pair), -1, axis=1) - np.stack(pair) for pair in ((run.x[0], run.y[0]), (run.x_rate[0], run.y_rate[0]))
    )
    np.testing.assert_allclose((links * rates).sum(axis=0), 0, atol=1e-15)
    assert 0 < np.abs(np.stack([run.x_rate[0], run.y_rate[0]]) - chain_velocity).max() < 0.4 * (2 * 3.7 / 24 / A) ** 2


def test_frames_do_not_change_the_motion():
    few, many = moving(17, 0.04, frames=[1.5]), moving(17, 0.04, frames=np.linspace(0, 1.5, 23))
    np.testing.assert_array_equal(few.x[-1], many.x[-1])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rod": "a rod"}, "free_rod needs a Rod with curvature='linear'; got 'a rod'"),
        ({"rod": Rod(**vars(ROD) | {"spin_inertia": 0.0})}, "the free rod needs a positive spin_inertia"),
        ({"r0": lambda s: 1.02 * straight(s)}, r"r0 must have \|r0'\| = 1, s being its arc length; got 1.02 at s = "),
        ({"r0": np.zeros(9)}, r"r0 must give x and y, an array of shape \(2, 9\); got shape \(9,\)"),
        ({"v0": lambda s: 0.3 * straight(s)}, "v0 must not stretch the rod, r0'.v0' = 0; got 0.3 at s = "),
        ({"v0": np.full((2, 9), np.nan)}, "v0 must be finite; got nan"),
        ({"theta0": np.zeros(4)}, r"theta0 must be a number or an array of shape \(9,\); got shape \(4,\)"),
        ({"omega0": lambda s: 1 / s}, "omega0 must be finite"),
        ({"duration": 0.0}, "duration must be a positive"),
        ({"n": 2}, "n .* must be a whole number of at least 3"),
        ({"dt": 0.0}, "dt must be a positive"),
        ({"dt": 1.1}, "dt must be at most the duration, 1; got 1.1"),
        ({"dt": 1e300}, "dt must be at most the duration"),
        ({"dt": 1e-300}, "more than can be counted: take a larger dt"),
        ({"n": 10**7}, "n must be at most 1000000 nodes; got 10000000"),
        ({"r0": lambda s: np.zeros((2, 9))}, r"r0 must give x and y, an array of shape .* where s has shape \(104,\)"),
        ({"r0": lambda s: [s, 0.0]}, r"r0 must give x and y, .*; got shape \(9,\), \(\)"),
        ({"r0": lambda s: straight(s) + 1e12}, r"r0 is too far from the origin, 1e\+12: by rounding"),
        ({"r0": np.ma.masked_equal(straight(np.linspace(0, 3.7, 9)), 0)}, "r0 must be .* masked entries"),
        ({"r0": lambda s: straight(s) + 0j}, "r0 must be .*complex numbers"),
        ({"v0": [["0"] * 9] * 2}, "v0 must be a number or 9 numbers"),
        ({"v0": np.zeros((2, 9), bool)}, "v0 must be .*truth values"),
        ({"v0": lambda s: np.where(s == s[0], 0, np.nan) * np.ones((2, 1))}, "v0 must be finite; got nan at place 1"),
        ({"theta0": True}, "theta0 must be .*truth values"),
        ({"omega0": 1j}, "omega0 must be .*complex numbers"),
        ({"n": 10**30}, "n .* must be at most 2"),
        ({"n": True}, "n .* must be a whole number of at least 3; got True"),
        ({"n": 4, "closed": True}, "n .* must be a whole number of at least 5; got 4"),
        ({"dt": 10**400}, "dt must be a positive finite number"),
        ({"dt": "0.1"}, "dt must be a positive finite number; got '0.1'"),
        ({"frames": True}, "frames must be a whole number"),
        ({"omega0": 1e200}, "r0, v0, theta0 and omega0 are too large: their energy is not a finite number"),
        ({"estimate": 1}, "estimate must be True or False; got 1"),
        ({"closed": "yes"}, "closed must be True or False; got 'yes'"),
        ({"frames": [2.0]}, "frames must be increasing times within"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero")
def test_bad_input_is_refused(change, message):
    given = {"rod": ROD, "r0": straight, "v0": whip, "theta0": 0.0, "omega0": 0.0, "duration": 1.0, "n": 9, "dt": 0.1}
    with pytest.raises(ValueError, match=message):
        free_rod(**given | change, progress=False)


def test_a_step_that_cannot_be_solved_says_so():
    with pytest.raises(SimulationError, match="take a smaller dt than 5"):
        moving(17, 50.0, duration=50.0)


def test_a_time_within_rounding_of_the_end_is_a_frame():
    frames = np.arange(0, 0.35, 0.1)
    assert frames[-1] > 0.3
    np.testing.assert_array_equal(moving(9, 0.05, duration=0.3, frames=frames).t, np.minimum(frames, 0.3))
