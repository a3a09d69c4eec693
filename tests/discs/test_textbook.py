"""Systems of the textbooks: all coordinates, velocities and multipliers against closed forms, or a second derivation."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from discs.mechanics import oscillators, textbook

DISC = {"mass": 1.3, "spin_inertia": 0.6, "heading_inertia": 0.4, "radius": 0.7}
CLOSED = {
    "disc": textbook.rolling_disc(**DISC, roll_rate=1.1, turn_rate=-0.8, heading=0.3),
    "disc on an incline": textbook.rolling_disc(**DISC, roll_rate=1.1, turn_rate=-0.8, heading=0.3, slope=2.1),
    "knife edge": textbook.knife_edge(1.3, 0.4, slope=2.1, speed=0.4, turn_rate=1.7, heading=-0.6),
    "sleigh": textbook.chaplygin_sleigh(1.3, 0.4, 0.35, speed=-0.9, turn_rate=1.7, heading=-0.6),
    "sleigh, mass behind": textbook.chaplygin_sleigh(1.3, 0.4, -0.35, speed=0.2, turn_rate=-1.7, heading=-0.6),
    "particle": textbook.nonholonomic_particle(1.3, 0.7, y=0.4, velocity=(0.9, -1.2)),
}
OSCILLATOR = {"mass": 1.3, "stiffness": 0.8, "driver_mass": 0.6}
START = {"q": (0.4, 0.5, -0.3), "speed": 0.8}
TIMES = np.linspace(0, 4, 9)


@pytest.mark.parametrize("name", CLOSED)
def test_closed_forms(name):
    """Relative tolerance of the integration is 1e-11 a step, over some hundred steps."""
    book = CLOSED[name]
    path = book.integrate(TIMES)
    exact = [np.array(part) for part in zip(*(book.exact(t) for t in TIMES), strict=True)]
    for found, expected in zip((path.q, path.v, path.multipliers), exact, strict=True):
        assert found.shape == expected.shape
        np.testing.assert_allclose(found, expected, atol=1e-9)
    np.testing.assert_allclose(path.energy, path.energy[0], atol=1e-9)
    assert path.residual.max() < 1e-9
    for invariant in book.invariants.values():
        values = [invariant(*z) for z in zip(path.q, path.v, strict=True)]
        np.testing.assert_allclose(values, values[0], atol=1e-9)


@pytest.mark.parametrize("name", CLOSED)
def test_closed_forms_are_motions(name):
    """Of the closed form alone: v = dq/dt, A v = 0, and M v. = f + A^T lambda by differences."""
    book, t, eps = CLOSED[name], 1.3, 1e-4
    (before, v_before, _), (q, v, force), (after, v_after, _) = (book.exact(t + d) for d in (-eps, 0, eps))
    np.testing.assert_allclose((after - before) / (2 * eps), v, atol=1e-7)
    np.testing.assert_allclose(book.system.constraint(q) @ v, 0, atol=1e-14)
    left = book.system.mass(q) @ (v_after - v_before) / (2 * eps)
    np.testing.assert_allclose(left, book.system.force(q, v) + book.system.constraint(q).T @ force, atol=1e-6)


def test_famous_answers():
    disc = CLOSED["disc"]
    turn = 2 * np.pi / 0.8
    np.testing.assert_allclose(disc.exact(turn)[0][:2], disc.q[:2], atol=1e-13)  # a circle, of radius R omega/Omega
    across = np.linalg.norm(disc.exact(turn / 2)[0][:2] - disc.q[:2])
    assert across == pytest.approx(2 * 0.7 * 1.1 / 0.8, rel=1e-13)
    cycloid = textbook.knife_edge(1.3, 0.4, slope=2.1, speed=0.0, turn_rate=1.7).exact
    for t in TIMES:
        x, y = 2.1 / (2 * 1.7**2) * np.array([np.sin(1.7 * t) ** 2, 1.7 * t - np.sin(3.4 * t) / 2])
        np.testing.assert_allclose(cycloid(t)[0][:2], [x, y], atol=1e-13)
    for offset in (0.35, -0.35):  # the centre of mass ends ahead, at the speed that the energy gives
        q, v, force = textbook.chaplygin_sleigh(1.3, 0.4, offset, speed=-0.9, turn_rate=1.7).exact(40.0)
        ahead = v[:2] @ [np.cos(q[2]), np.sin(q[2])] * np.sign(offset)
        assert ahead == pytest.approx(np.sqrt(0.81 + (0.4 + 1.3 * 0.35**2) * 1.7**2 / 1.3), rel=1e-12)
        assert abs(force[0]) < 1e-12


def contact():
    return oscillators.contact_oscillator(**OSCILLATOR, driver_stiffness=2.1, width=0.7, **START, drift=0.9)


def driven(skew):
    return oscillators.driven_oscillator(**OSCILLATOR, wave=0.5, skew=skew, **START, drift=1.9)


def harmonic(t):
    """The driver of `contact`: y, y., and gear, gear. of x. + gear z. = 0."""
    rate = np.sqrt(2.1 / 0.6)
    y, dy = 0.5 * np.cos(rate * t) + 0.9 / rate * np.sin(rate * t), -0.5 * rate * np.sin(rate * t) + 0.9 * np.cos(rate * t)
    return y, dy, y / 0.7, dy / 0.7


def pendulum(skew):
    """The driver of `driven`, from a run of its own."""

    def slope(t, z):
        return [z[1], 0.5 * (np.sin(z[0]) - skew * np.cos(2 * z[0])) / 0.6]

    found = solve_ivp(slope, (0, TIMES[-1]), [0.5, 1.9], "DOP853", rtol=1e-12, atol=1e-13, dense_output=True)

    def driver(t):
        y, dy = found.sol(t)
        return y, dy, np.sin(y), np.cos(y) * dy

    return driver


@pytest.mark.slow
@pytest.mark.parametrize(
    ("book", "driver"),
    [(contact(), harmonic), (driven(0.0), pendulum(0.0)), (driven(0.6), pendulum(0.6))],
    ids=["contact", "driven", "not reversible"],
)
def test_driven_oscillators_turn_on_a_sphere(book, driver):
    """(x, z, sigma) from its own linear equations, driven by y(t); lambda from the curvature of the path."""
    m, k = 1.3, 0.8

    def slope(t, z):
        chi = np.arctan(driver(t)[2])
        x, z, sigma = z
        return [-sigma * np.sin(chi), sigma * np.cos(chi), k / m * (x * np.sin(chi) - z * np.cos(chi))]

    found = solve_ivp(slope, (0, TIMES[-1]), [0.4, -0.3, 0.8], "DOP853", TIMES, rtol=1e-12, atol=1e-13)
    path = book.integrate(TIMES)
    for i, t in enumerate(TIMES):
        y, dy, gear, gear_rate = driver(t)
        x, z, sigma = found.y[:, i]
        chi, turning = np.arctan(gear), gear_rate / (1 + gear**2)
        np.testing.assert_allclose(path.q[i], [x, y, z], atol=2e-9)
        np.testing.assert_allclose(path.v[i], [-sigma * np.sin(chi), dy, sigma * np.cos(chi)], atol=2e-9)
        force = np.cos(chi) * (k * (x * np.cos(chi) + z * np.sin(chi)) - m * sigma * turning)
        np.testing.assert_allclose(path.multipliers[i], [force], atol=2e-9)
    assert set(book.invariants) == {"driver", "oscillator"}
    for invariant in book.invariants.values():
        values = [invariant(*z) for z in zip(path.q, path.v, strict=True)]
        np.testing.assert_allclose(values, values[0], rtol=1e-9)


def test_the_driver_s_time_by_quadrature():
    book = driven(0.6)
    path = book.integrate(TIMES)
    energy = book.invariants["driver"](book.q, book.v)

    def slowness(y):
        return 1 / np.sqrt(2 * (energy - 0.5 * (np.cos(y) + 0.3 * np.sin(2 * y))) / 0.6)

    for t, q in zip(TIMES, path.q, strict=True):
        assert quad(slowness, 0.5, q[1], epsabs=1e-12)[0] == pytest.approx(t, abs=1e-9)


@pytest.mark.parametrize(("skew", "even"), [(0.0, True), (0.6, False)])
def test_which_driver_is_reversible(skew, even):
    """A motion that goes round is the same before and after some moment only if U is even about some place."""
    book, depth = driven(skew), np.linspace(0, np.pi, 50)

    def hill(y):
        return book.system.potential(np.array([0.0, y, 0.0]))

    odd = [max(abs(hill(c + d) - hill(c - d)) for d in depth) for c in np.linspace(0, 2 * np.pi, 201)]
    assert (min(odd) < 1e-12) == even
    assert even or min(odd) > 0.1


def test_bad_parameters_are_refused():
    with pytest.raises(ValueError, match=r"turn_rate must not be 0 \(the disc then rolls on a straight line\); got 0"):
        textbook.rolling_disc(**DISC, roll_rate=1.0, turn_rate=0)
    with pytest.raises(ValueError, match=r"radius must be a positive finite number; got -0.7"):
        textbook.rolling_disc(**DISC | {"radius": -0.7}, roll_rate=1.0, turn_rate=1.0)
    with pytest.raises(ValueError, match="turn_rate must not be 0"):
        textbook.knife_edge(1.0, 1.0, slope=1.0, speed=1.0, turn_rate=0.0)
    with pytest.raises(ValueError, match="offset must not be 0"):
        textbook.chaplygin_sleigh(1.0, 1.0, 0.0, speed=1.0, turn_rate=1.0)
    with pytest.raises(ValueError, match=r"velocity\[1\] must not be 0"):
        textbook.nonholonomic_particle(1.0, 1.0, y=0.0, velocity=(1.0, 0.0))
    with pytest.raises(ValueError, match=r"drift must be above 0.*in size for the driver to rotate; got 0.1"):
        oscillators.driven_oscillator(**OSCILLATOR, wave=0.5, skew=0.6, **START, drift=0.1)
    with pytest.raises(ValueError, match="q must be 3 finite numbers"):
        oscillators.driven_oscillator(**OSCILLATOR, wave=0.5, skew=0.6, q=(1, 2), speed=1.0, drift=3.0)


def test_one_frame_is_enough_before_the_start_or_at_it():
    book = textbook.rolling_disc(1.3, 0.6, 0.4, 0.7, roll_rate=1.1, turn_rate=0.8)
    for times in ([0.0], [0.7], [-0.7, 0.0]):
        path = book.integrate(times, 1e-9, progress=False)
        np.testing.assert_allclose(path.q, [book.exact(t)[0] for t in times], atol=1e-7)
