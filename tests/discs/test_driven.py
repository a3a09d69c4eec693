"""Forces f(t, q, v) and drives b(t, q): motions against closed forms and second derivations, the balance of energy, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from discs.mechanics import MechanicalSystem, driven, textbook
from discs.mechanics.momentum import symmetry_momenta
from tests.conftest import longer

pytestmark = pytest.mark.slow  # each motion is integrated to 1e-10, and again by another method

BALL = {"mass": 1.3, "radius": 0.7, "table_rate": 1.7, "place": (0.4, -0.3), "velocity": (0.2, 0.5), "spin": 0.6}
HOMOGENEOUS = 0.4 * 1.3 * 0.7**2
BOOKS = {
    "ball on a turntable": driven.ball_on_turntable(inertia=HOMOGENEOUS, **BALL),
    "shell on a turntable": driven.ball_on_turntable(inertia=2 / 3 * 1.3 * 0.7**2, **BALL),
    "bead on a wire": driven.bead_on_wire(1.3, turn_rate=-0.8, r=0.4, speed=-0.5, heading=0.3),
}
TIMES = np.linspace(0, 4, 9)


def balance(path):
    return np.abs(path.energy - path.energy[0] - path.work - path.reaction_work).max()


def one(force=None, drive=None, mass=1.0, stiffness=0.0):
    """A particle on a line, or on a drive."""
    rows, owner, b = ([[1]], "drive", drive) if drive else (np.zeros((0, 1)), (), 0.0)
    return MechanicalSystem.from_lagrangian(
        "x", [[mass]], lambda q: 0.5 * stiffness * q[0] ** 2, lambda q: rows, owner, b, force=force
    )


# Known answers


@pytest.mark.parametrize("name", BOOKS)
def test_closed_forms(name):
    book = BOOKS[name]
    path = book.integrate(np.linspace(-2, 4, 13), progress=False)
    exact = [np.array(part) for part in zip(*(book.exact(t) for t in path.t), strict=True)]
    for found, expected in zip((path.q, path.v, path.multipliers), exact, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9)
    assert path.residual.max() < 1e-12
    assert balance(path) < 1e-9 < np.ptp(path.energy)
    assert np.abs(path.work).max() == 0  # a drive alone: all work is that of its reaction


@pytest.mark.parametrize("name", BOOKS)
def test_closed_forms_are_motions(name):
    """Of the closed form alone: v = dq/dt, A v = b, and M v. = f + A^T lambda by differences."""
    book, t, eps = BOOKS[name], 1.3, 1e-4
    (before, v_before, _), (q, v, reaction), (after, v_after, _) = (book.exact(t + d) for d in (-eps, 0, eps))
    np.testing.assert_allclose((after - before) / (2 * eps), v, atol=1e-7)
    np.testing.assert_allclose(book.system.constraint(q) @ v, book.system.drive(t, q), atol=1e-14)
    left = book.system.mass(q) @ (v_after - v_before) / (2 * eps)
    np.testing.assert_allclose(left, book.system.force(q, v) + book.system.constraint(q).T @ reaction, atol=1e-6)


def test_a_ball_on_a_turntable_moves_on_circles_at_two_sevenths_of_its_rate():
    """Centre and radius from the initial data: r + J v/(k Omega), |v|/(k Omega)."""
    rate = 2 / 7 * 1.7
    times = np.linspace(0, 2 * np.pi / rate, 25)
    path = BOOKS["ball on a turntable"].integrate(times, progress=False)
    np.testing.assert_allclose(path.q[-1, :2], path.q[0, :2], atol=1e-9)
    away = path.q[:, :2] - (np.array([0.4, -0.3]) + np.array([-0.5, 0.2]) / rate)
    np.testing.assert_allclose(np.hypot(*away.T), np.hypot(0.2, 0.5) / rate, atol=1e-9)
    np.testing.assert_allclose(np.unwrap(np.arctan2(*away.T[::-1])) - np.arctan2(*away[0, ::-1]), rate * times, atol=1e-9)


def angular(q, v):
    """The angular velocity in the frame at rest, of R = R_z(q_2) R_x(q_3) R_z(q_4)."""
    phi, theta = q[2], q[3]
    return (
        v[3] * np.cos(phi) + v[4] * np.sin(phi) * np.sin(theta),
        v[3] * np.sin(phi) - v[4] * np.cos(phi) * np.sin(theta),
        v[2] + v[4] * np.cos(theta),
    )


@pytest.mark.long
def test_the_same_ball_by_its_three_angles():
    """Euler's angles instead of quasi-coordinates: M and A depend on q."""
    inertia, book = HOMOGENEOUS, BOOKS["ball on a turntable"]

    def mass(q):
        c = np.cos(q[3])
        z = 0 * c
        return [
            [1.3 + z, z, z, z, z],
            [z, 1.3 + z, z, z, z],
            [z, z, inertia + z, z, inertia * c],
            [z, z, z, inertia + z, z],
            [z, z, inertia * c, z, inertia + z],
        ]

    def rows(q):
        s, c, lean = np.sin(q[2]), np.cos(q[2]), np.sin(q[3])
        return [[1, 0, 0, -0.7 * s, 0.7 * c * lean], [0, 1, 0, 0.7 * c, 0.7 * s * lean]]

    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "phi", "theta", "psi"), mass, lambda q: 0.0, rows, ("ball", "ball"), lambda t, q: [-1.7 * q[1], 1.7 * q[0]]
    )
    q = np.array([0.4, -0.3, 0.2, 1.5, 0.0])
    turn = np.array([[angular(q, v)[i] for v in np.eye(5)[2:]] for i in range(3)])
    v = np.array([0.2, 0.5, *np.linalg.solve(turn, book.v[2:])])
    path = system.integrate(q, v, [0.0, 0.5, 1.0], progress=False)
    same = book.integrate([0.0, 0.5, 1.0], progress=False)
    np.testing.assert_allclose(path.q[:, :2], same.q[:, :2], atol=1e-10)
    np.testing.assert_allclose(path.multipliers, same.multipliers, atol=1e-9)
    np.testing.assert_allclose([angular(*z) for z in zip(path.q, path.v, strict=True)], same.v[:, 2:], atol=1e-10)


def test_a_table_that_speeds_up():
    """r. = u + k Omega(t) J r with a constant u, from the two equations of the ball: a linear equation of order 1."""

    def rate(t):
        return 0.4 + 0.5 * np.sin(1.1 * t) ** 2

    system = replace(BOOKS["ball on a turntable"].system, drive=lambda t, q: [-rate(t) * q[1], rate(t) * q[0]])
    q = np.array([0.4, -0.3, 0, 0, 0])
    v = system.consistent_velocity(q, [0.2, 0.5, 0, 0, 0.6], 0.0)
    path = system.integrate(q, v, TIMES, progress=False)
    k, u = 2 / 7, v[:2] - 2 / 7 * 0.4 * np.array([0.3, 0.4])
    known = solve_ivp(
        lambda t, r: u + k * rate(t) * np.array([-r[1], r[0]]), (0, 4), q[:2], "DOP853", TIMES, rtol=1e-12, atol=1e-12
    )
    np.testing.assert_allclose(path.q[:, :2], known.y.T, atol=1e-9)
    assert balance(path) < 1e-9


def pushed_sleigh():
    """A sleigh with a motor along its blade, a steering moment, and both damped."""
    book = textbook.chaplygin_sleigh(1.3, 0.4, 0.35, speed=0.9, turn_rate=1.7, heading=-0.6)

    def drives(t, u, turn):
        return 0.7 * np.sin(2 * t) - 0.3 * u, 0.5 * np.cos(t) - 0.2 * turn

    def force(t, q, v):
        c, s = np.cos(q[2]), np.sin(q[2])
        along, moment = drives(t, c * v[0] + s * v[1], v[2])
        return [along * c, along * s, moment]

    return replace(book.system, applied=force), book, drives


@pytest.mark.parametrize("method", ["auto", longer("RK45"), longer("Radau"), longer("LSODA")])
def test_a_pushed_and_damped_sleigh(method):
    """m (u. - a w^2) = F, (I + m a^2) w. + m a u w = moment, and the path (x, y, phi), integrated separately."""
    system, book, drives = pushed_sleigh()

    def reduced(t, z):
        _, _, phi, u, w = z
        along, moment = drives(t, u, w)
        return [u * np.cos(phi), u * np.sin(phi), w, 0.35 * w**2 + along / 1.3, (moment - 1.3 * 0.35 * u * w) / j]

    j = 0.4 + 1.3 * 0.35**2
    known = solve_ivp(reduced, (0, 4), [0, 0, -0.6, 0.9, 1.7], "DOP853", TIMES, rtol=1e-12, atol=1e-12).y
    rtol, bound = (1e-11, 1e-9) if method == "auto" else (1e-7, 3e-5)
    path = system.integrate(book.q, book.v, TIMES, rtol, method=method, progress=False)
    np.testing.assert_allclose(path.q, known[:3].T, atol=bound)
    np.testing.assert_allclose(path.v[:, 2], known[4], atol=bound)
    assert balance(path) < bound
    assert np.abs(path.work).max() > 0.3
    assert np.abs(path.reaction_work).max() < 1e-2 * bound + 1e-12  # the blade does no work
    assert path.stats["method"] == ("DOP853" if method == "auto" else method)


@pytest.mark.long
def test_the_work_is_the_integral_of_the_power():
    system, book, _ = pushed_sleigh()
    path = system.integrate(book.q, book.v, np.linspace(0, 4, 401), progress=False)
    power = [v @ system.applied(t, q, v) for t, q, v in zip(path.t, path.q, path.v, strict=True)]
    thirds = np.array([1, *[4, 2] * 199, 4, 1]) * 0.01 / 3  # Simpson's rule
    assert path.work[-1] == pytest.approx(thirds @ power, abs=1e-8)


@pytest.mark.long
def test_a_bead_in_the_plane_on_a_wire_that_swings():
    """The wire's direction is a coordinate, psi. = W(t); -sin psi x. + cos psi y. = W (x cos psi + y sin psi) holds the bead on it.

    In polar coordinates r.. = W^2 r. The torque on the wire, and the balance, from the bead's motion.
    """

    def rate(t):
        return 0.6 + 0.9 * np.sin(1.3 * t)

    def drive(t, q):
        return [rate(t), rate(t) * (q[0] * np.cos(q[2]) + q[1] * np.sin(q[2]))]

    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "psi"),
        np.diag([1.3, 1.3, 0.4]),
        lambda q: 0.0,
        lambda q: [[0, 0, 1], [-np.sin(q[2]), np.cos(q[2]), 0]],
        ("motor", "wire"),
        drive,
    )
    q = np.array([0.8, 0.0, 0.0])
    v = system.consistent_velocity(q, [-0.3, 0, 0], t=0.0)
    np.testing.assert_allclose(v, [-0.3, 0.48, 0.6], atol=1e-15)
    path = system.integrate(q, v, TIMES, progress=False)
    known = solve_ivp(lambda t, z: [z[1], rate(t) ** 2 * z[0]], (0, 4), [0.8, -0.3], "DOP853", TIMES, rtol=1e-12, atol=1e-13).y
    psi = 0.6 * TIMES + 0.9 / 1.3 * (1 - np.cos(1.3 * TIMES))
    np.testing.assert_allclose(path.q, np.array([known[0] * np.cos(psi), known[0] * np.sin(psi), psi]).T, atol=1e-9)
    push = 1.3 * (2 * known[1] * rate(TIMES) + known[0] * 0.9 * 1.3 * np.cos(1.3 * TIMES))  # across the wire
    np.testing.assert_allclose(path.multipliers[:, 1], push, atol=1e-8)
    assert balance(path) < 1e-9


@pytest.mark.long
def test_a_position_that_is_driven_does_not_drift():
    """x. = cos t: x = sin t to rounding, also at a loose tolerance; the rod of a pendulum besides is kept too."""
    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "z"),
        np.eye(3),
        lambda q: 9.81 * q[1],
        lambda q: [[q[0], q[1], 0], [0, 0, 1]],
        ("rod", "motor"),
        lambda t, q: [0, np.cos(t)],
    )
    path = system.integrate([1, 0, 0], [0, 0, 1], np.linspace(0, 20, 5), 1e-5, progress=False)
    np.testing.assert_allclose(path.q[:, 2], np.sin(path.t), atol=1e-13)
    np.testing.assert_allclose(np.hypot(*path.q.T[:2]), 1, atol=1e-5)


def test_a_constant_drive_is_in_the_balance():
    """The pendulum's pivot turns: theta. + ... a motor at the rate 1.7 on a spring k theta^2/2 does the work k (1.7 t)^2/2."""
    system = MechanicalSystem.from_lagrangian("theta", [[0.3]], lambda q: q[0] ** 2, lambda q: [[1]], "motor", drive=1.7)
    path = system.integrate([0], [1.7], [0, 1.0, 2.0], progress=False)
    np.testing.assert_allclose(path.reaction_work, (1.7 * path.t) ** 2, atol=1e-9)


def test_forces_and_drives_agree_with_the_reduced_form():
    rng = np.random.default_rng(3)
    system, _, _ = pushed_sleigh()
    system = system.also([[0, 0, 1]], ["helm"], drive=lambda t, q: np.sin(t) + q[0])
    q, t = rng.standard_normal(3), 0.7
    v = system.consistent_velocity(q, rng.standard_normal(3), t)
    assert np.abs(system.residual(q, v, t)).max() < 1e-14
    saddle, reduced = system.accelerations(q, v, t=t), system.reduced(q, v, t)
    np.testing.assert_allclose(saddle.acceleration, reduced.acceleration, rtol=1e-12)
    np.testing.assert_allclose(saddle.multipliers, reduced.multipliers, rtol=1e-11)
    assert saddle.acceleration[2] == pytest.approx(np.cos(t) + v[0], abs=1e-14)


def rail():
    """y. = sin x + t: the action of L + mu (y. - sin x - t), Euler-Lagrange x.. = -mu cos x and y. + mu = const."""
    return MechanicalSystem.from_lagrangian(
        ("x", "y"), np.eye(2), lambda q: 0.0, lambda q: [[0, 1]], "rail", lambda t, q: np.sin(q[0]) + t
    )


def test_a_charge_pushes_where_the_drive_changes():
    found = rail().accelerations([0.3, 2.0], [0.8, np.sin(0.3) + 0.7], [0.4], 0.7)
    np.testing.assert_allclose(found.acceleration, [-0.4 * np.cos(0.3), 0.8 * np.cos(0.3) + 1], atol=1e-12)


@pytest.mark.long
def test_a_vakonomic_drive():
    system = rail()
    path = system.integrate([0.3, 0], [0.8, np.sin(0.3)], TIMES, mu=[0.4], progress=False)
    whole = np.sin(0.3) + 0.4

    def motion(t, z):
        return [z[1], -(whole - np.sin(z[0]) - t) * np.cos(z[0])]

    known = solve_ivp(motion, (0, 4), [0.3, 0.8], "DOP853", TIMES, rtol=1e-12, atol=1e-12).y
    np.testing.assert_allclose(path.q[:, 0], known[0], atol=1e-9)
    np.testing.assert_allclose(path.v[:, 1], np.sin(known[0]) + TIMES, atol=1e-9)
    np.testing.assert_allclose(path.mu[:, 0] + path.v[:, 1], whole, atol=1e-9)
    assert balance(path) < 1e-9


def test_momenta_count_applied_forces():
    book = textbook.rolling_disc(1.3, 0.6, 0.4, 0.7, roll_rate=1.1, turn_rate=0.8)
    system = replace(book.system, applied=lambda t, q, v: [0.3 * np.sin(t), 0, -0.2 * v[2], 0.1])
    path = system.integrate(book.q, book.v, np.linspace(0, 4, 201), progress=False)
    assert abs(symmetry_momenta(system, path.t, path.q, path.v).residual()).max() < 1e-6
