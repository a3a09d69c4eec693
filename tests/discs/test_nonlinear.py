"""Constraints phi(q, v) = b, not linear in the velocities, by Chetaev's rule: closed forms, second derivations, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from discs.mechanics import MechanicalSystem, textbook
from discs.mechanics.momentum import nonholonomic_momenta

pytestmark = pytest.mark.slow  # each motion is integrated to 1e-10, and again by another method

TIMES = np.linspace(0, 2, 9)


def speed_held(force=None, drive=0.0, gravity=9.81):
    """A particle of mass 1.3 in the plane with v.v = 0.81 + drive."""
    return MechanicalSystem.from_lagrangian(
        ("x", "y"),
        1.3 * np.eye(2),
        lambda q: 1.3 * gravity * q[1],
        owners="governor",
        drive=drive,
        force=force,
        phi=lambda q, v: v @ v - 0.81,
    )


@pytest.mark.parametrize("fall", [-1, 1])
def test_appell_and_hamels_weight(fall):
    """Downwards for two seconds; upwards until shortly before it comes to rest."""
    book = textbook.appell_hamel(1.3, 0.75, 9.81, velocity=(0.6 * 4, -0.45 * 4, 4.0 * fall))
    times = TIMES if fall < 0 else TIMES * 0.3
    path = book.integrate(times, progress=False)
    for found, expected in zip((path.q, path.v, path.multipliers), zip(*map(book.exact, times), strict=True), strict=True):
        np.testing.assert_allclose(found, np.array(expected), atol=1e-8)
    assert path.residual.max() < 1e-12
    np.testing.assert_allclose(path.energy, path.energy[0], rtol=1e-10)  # homogeneous in v: the reaction does no work
    assert np.abs(path.reaction_work).max() < 1e-9
    z, v, eps = 1.3 * 9.81, (path.v[1] - path.v[0]), times[1]
    assert v[2] / eps == pytest.approx(-9.81 / (1 + 0.75**2), rel=1e-9)  # not -9.81, and not a fall of z alone
    assert z == pytest.approx(-book.system.force(book.q, book.v)[2])


def test_a_weight_at_rest_can_go_anywhere():
    """At 0.637 s the weight that rises is at rest: phi and d phi/dv are 0."""
    book = textbook.appell_hamel(1.3, 0.75, 9.81, velocity=(0.6 * 4, -0.45 * 4, 4.0))
    with pytest.raises(RuntimeError, match=r"beyond t = 0\.637.*of wheel vanish there, or are reversed"):
        book.integrate([0.0, 1.0], progress=False)
    with pytest.raises(ValueError, match="constraints of wheel are redundant"):
        book.system.accelerations([0, 0, 0], [0, 0, 0])


def test_a_weight_of_held_speed_turns_downwards():
    """u theta. = -g cos theta, so tan(theta/2 + pi/4) falls like e^{-g t/u}; lambda = m g sin theta/(2 u); the reaction works."""
    system, start = speed_held(), 0.7
    path = system.integrate([0, 0], 0.9 * np.array([np.cos(start), np.sin(start)]), TIMES / 4, progress=False)
    theta = 2 * np.arctan(np.tan(start / 2 + np.pi / 4) * np.exp(-9.81 / 0.9 * path.t)) - np.pi / 2
    np.testing.assert_allclose(path.v, 0.9 * np.array([np.cos(theta), np.sin(theta)]).T, atol=1e-9)
    np.testing.assert_allclose(path.multipliers[:, 0], 1.3 * 9.81 * np.sin(theta) / 1.8, atol=1e-8)
    np.testing.assert_allclose(path.reaction_work, 1.3 * 9.81 * path.q[:, 1], atol=1e-9)


@pytest.mark.parametrize("method", ["auto", "Radau"])
def test_a_speed_that_is_driven(method):
    """v.v = 0.81 + t^2 in a field that turns the velocity at the rate 2.1, q J v/m."""

    def turning(t, q, v):
        return 1.3 * 2.1 * np.array([-v[1], v[0]])

    system = speed_held(turning, lambda t, q: t**2, gravity=0.0)
    path = system.integrate([0, 0], [0.9, 0], TIMES, 1e-11 if method == "auto" else 1e-8, method=method, progress=False)
    bound = 1e-9 if method == "auto" else 1e-5
    speed = np.sqrt(0.81 + TIMES**2)
    np.testing.assert_allclose(path.v, (speed * [np.cos(2.1 * TIMES), np.sin(2.1 * TIMES)]).T, atol=bound)
    np.testing.assert_allclose(path.multipliers[:, 0], 1.3 * TIMES / (2 * speed**2), atol=bound)
    np.testing.assert_allclose(path.reaction_work, 0.65 * TIMES**2, atol=bound)
    assert np.abs(path.work).max() < bound
    assert path.stats["derivatives"]["phi"] == {"how": "complex step", "error": 0.0}  # rounding where phi is 0 is no error


def test_two_particles_with_parallel_velocities():
    """Speeds a, b along e(theta): m a. = f_1.e, n b. = f_2.e, (m a^2 + n b^2) theta. = a f_1.J e + b f_2.J e, without lambda.

    The pair of S. Benenti, SIGMA 3 (2007) 036, here in a spring of stiffness k between them and gravity.
    """
    m, n, k, g = 1.3, 0.6, 2.1, 0.9
    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "X", "Y"),
        np.diag([m, m, n, n]),
        lambda q: 0.5 * k * ((q[2] - q[0]) ** 2 + (q[3] - q[1]) ** 2) + g * (m * q[1] + n * q[3]),
        owners="pair",
        phi=lambda q, v: v[0] * v[3] - v[1] * v[2],
    )

    def reduced(t, z):
        theta, a, b = z[4:]
        e, across = np.array([np.cos(theta), np.sin(theta)]), np.array([-np.sin(theta), np.cos(theta)])
        pull = k * (z[2:4] - z[:2])
        one, two = pull - [0, m * g], -pull - [0, n * g]
        turn = (a * one + b * two) @ across / (m * a**2 + n * b**2)
        return [*(a * e), *(b * e), turn, one @ e / m, two @ e / n]

    q, e = [0.1, 0.2, 1.1, -0.3], np.array([np.cos(0.4), np.sin(0.4)])
    known = solve_ivp(reduced, (0, 2), [*q, 0.4, 1.2, 0.7], "DOP853", TIMES, rtol=1e-12, atol=1e-12).y.T
    path = system.integrate(q, [*(1.2 * e), *(0.7 * e)], TIMES, progress=False)
    np.testing.assert_allclose(path.q, known[:, :4], atol=1e-8)
    np.testing.assert_allclose(path.energy, path.energy[0], atol=1e-9)


@pytest.mark.long
def test_a_linear_constraint_written_otherwise():
    """phi = (A v)(1 + v.v) is 0 where A v is, with d phi/dv parallel to A; also the reduced form, and a helm besides."""
    book = textbook.chaplygin_sleigh(1.3, 0.4, 0.35, speed=0.9, turn_rate=1.7, heading=-0.6)
    linear = book.system
    odd = MechanicalSystem.from_lagrangian(
        linear.names,
        linear.mass,
        lambda q: 0.0,
        owners="blade",
        phi=lambda q, v: (np.cos(q[2]) * v[1] - np.sin(q[2]) * v[0]) * (1 + v @ v),
    )
    same, path = book.integrate(TIMES, progress=False), odd.integrate(book.q, book.v, TIMES, progress=False)
    np.testing.assert_allclose(path.q, same.q, atol=1e-9)
    saddle, reduced = odd.accelerations(book.q, book.v), odd.reduced(book.q, book.v)
    np.testing.assert_allclose(saddle.acceleration, reduced.acceleration, atol=1e-12)
    np.testing.assert_allclose(saddle.multipliers, reduced.multipliers, atol=1e-12)
    steered = [s.also([[0, 0, 1]], ["helm"], drive=lambda t, q: 1.7 * np.cos(t)) for s in (linear, odd)]
    one, other = (s.integrate(book.q, book.v, TIMES, progress=False) for s in steered)
    np.testing.assert_allclose(other.q, one.q, atol=1e-9)


def test_the_nearest_velocity():
    """On v.v = 0.81 it is 0.9 v/|v|; on a cone u - v is along the normal up to terms of second order."""
    np.testing.assert_allclose(speed_held().consistent_velocity([0, 0], [3, 4]), [0.54, 0.72], atol=1e-14)
    book = textbook.appell_hamel(1.3, 0.75, 9.81, velocity=(0.6, -0.45, 1.0))
    for off in (1e-1, 1e-2, 1e-3):
        v = book.v + off * np.array([0.7, -0.3, 0.8])
        u = book.system.consistent_velocity(book.q, v)
        assert np.abs(book.system.residual(book.q, u)).max() < 1e-14
        assert np.abs(np.cross(u - v, book.system.rows(book.q, u)[0])).max() < 2 * off**2
    with pytest.raises(ValueError, match=r"no velocity near v = .* was found that obeys the constraints at q = "):
        MechanicalSystem.from_lagrangian(
            "x", [[1]], lambda q: 0.0, owners="rule", phi=lambda q, v: v[0] ** 2 + 1
        ).consistent_velocity([0], [0.3])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"constraint": lambda q: [[1, 0]]}, r"as A\(q\) or as phi\(q, v\), not both"),
        ({"phi": lambda v: v[0]}, r"phi must be a function of q, v, phi\(q, v\); too many positional arguments"),
        ({"phi": lambda q, v: v}, r"phi\(q, v\) must be of shape \(1,\); got \(2,\), at q, v = "),
        ({"phi": lambda q, v: np.nan * v[0]}, r"phi\(q, v\) must be finite; at q, v = .* it is \[nan\]"),
        ({"phi": lambda q, v: v @ v - 2}, r"that of rule is off by 1: take consistent_velocity\(q, v\)"),
        ({"phi": None}, r"A must be of shape \(1, 2\).*got \(0, 2\)"),
    ],
)
def test_what_is_no_constraint_is_refused(given, message):
    parts = {"names": ("x", "y"), "mass": np.eye(2), "potential": lambda q: 0.0, "owners": "rule", "phi": lambda q, v: v[0]}
    with pytest.raises(ValueError, match=message):
        MechanicalSystem.from_lagrangian(**parts | given).integrate([0, 0], [1, 0], [0, 1.0], progress=False)


def test_what_needs_linear_constraints_says_so():
    system = speed_held()
    with pytest.raises(ValueError, match=r"constraints phi\(q, v\) are not linear in v, so there is no A\(q\)"):
        system.integrate([0, 0], [0.9, 0], [0, 1.0], mu=[0.1])
    with pytest.raises(ValueError, match=r"constraints phi\(q, v\) are not linear in v, so there is no A\(q\)"):
        system.saddle_point(np.zeros(2))
    free = replace(system, symmetry=lambda q: np.eye(2))
    with pytest.raises(ValueError, match=r"so there is no A\(q\)"):
        nonholonomic_momenta(free, TIMES, np.zeros((9, 2)), np.ones((9, 2)))
