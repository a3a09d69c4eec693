"""Forces and drives that are refused, or found wrong on the way."""

from dataclasses import replace

import numpy as np
import pytest

from discs.mechanics import textbook
from tests.discs.test_driven import BOOKS, one, pushed_sleigh


def test_the_force_of_l_stays_and_can_be_replaced():
    system, _, _ = pushed_sleigh()
    q, v = np.array([0.1, 0.2, 0.3]), np.array([0.4, 0.5, 0.6])
    plain = textbook.chaplygin_sleigh(1.3, 0.4, 0.35, speed=0.9, turn_rate=1.7).system
    np.testing.assert_array_equal(system.force(q, v), plain.force(q, v))
    braked = replace(plain, force=lambda q, v: plain.force(q, v) - 0.2 * v)
    applied = replace(plain, applied=lambda t, q, v: -0.2 * v)
    np.testing.assert_allclose(braked.accelerations(q, v).acceleration, applied.accelerations(q, v, t=1.0).acceleration, atol=1e-15)


# Refusals


def bad_later(value):
    return lambda t, q, v: value if t > 1 else 0.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"force": lambda t, q, v: [1, 2]}, r"f\(t, q, v\) must be of shape \(1,\); got \(2,\), at t = 0"),
        ({"force": lambda t, q, v: np.nan}, r"f\(t, q, v\) must be finite; at t = 0 it is \[nan\]"),
        ({"force": lambda t, q, v: "x"}, r"f\(t, q, v\) must be real numbers in double precision; got <U1, at t = 0"),
        ({"force": lambda t, q, v: 1j}, r"f\(t, q, v\) must be real numbers in double precision; got complex128, at t = 0"),
        ({"force": lambda q, v: 0.0}, r"f must be a function of t, q, v, f\(t, q, v\); too many positional arguments"),
        ({"force": [1.0]}, r"f must be a function of t, q, v; got \[1.0\]"),
        ({"drive": lambda t, q: [0, 1]}, r"b\(t, q\) must be of shape \(1,\); got \(2,\), at t = 0"),
        ({"drive": lambda t, q: [np.inf]}, r"b\(t, q\) must be finite; at t = 0 it is \[inf\]"),
        ({"drive": lambda t: 0.0}, r"b must be a function of t, q, b\(t, q\); too many positional arguments"),
    ],
)
def test_what_is_no_force_or_drive_is_refused(given, message):
    with pytest.raises(ValueError, match=message):
        one(**given).integrate([0], [0], [0, 2.0], progress=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"force": bad_later(np.nan)}, r"beyond t = (1|0\.99999\d*): f\(t, q, v\) must be finite; at t = 1.* it is \[nan\]"),
        ({"force": bad_later([1, 2])}, r"beyond t = (1|0\.99999\d*): f\(t, q, v\) must be of shape \(1,\); got \(2,\), at t = 1"),
        ({"drive": lambda t, q: np.nan if t > 1 else 0.0}, r"beyond t = (1|0\.99999\d*): b"),
        ({"drive": lambda t, q: 1.0 if t > 1 else 0.0}, r"beyond t = (1|0\.99999\d*): the drive b\(t, q\) of drive jumps there"),
    ],
)
def test_what_goes_wrong_later_is_named_with_its_time(given, message):
    with pytest.raises(RuntimeError, match=message):
        one(**given).integrate([0], [0], [0, 2.0], progress=False)


def test_a_jump_that_an_implicit_method_passes_is_said():
    system = one(drive=lambda t, q: 1.0 if t > 1 else 0.0)
    with pytest.warns(UserWarning, match="Radau: at t = 2 the velocity violates the constraint of drive by over 1 %"):
        system.integrate([0], [0], [0, 2.0], 1e-6, method="Radau", progress=False)


def test_what_depends_on_time_needs_it():
    system, book = BOOKS["bead on a wire"].system, BOOKS["bead on a wire"]
    for call in (system.accelerations, system.reduced, system.consistent_velocity, system.residual):
        with pytest.raises(ValueError, match="depend on time: give t"):
            call(book.q, book.v)
    with pytest.raises(ValueError, match=r"that of motor is off by 1: take consistent_velocity\(q, v, t\)"):
        system.integrate(book.q, [*book.v[:1], book.v[1] + 1], [0, 1.0])
    with pytest.raises(ValueError, match="max_step must be a positive finite number"):
        system.integrate(book.q, book.v, [0, 1.0], max_step=0)
    with pytest.raises(ValueError, match=r"force must be a function of q, v, force\(q, v\); missing a required argument"):
        replace(system, force=lambda t, q, v: 0 * q)


def test_a_balance_that_does_not_close_is_said():
    """RK23 at a loose tolerance loses energy that no force takes."""
    system = one(lambda t, q, v: 1e-3 * np.cos(t), stiffness=1.0)
    with pytest.warns(UserWarning, match="RK23: energy - energy.0. is the work of forces and drives, but at t = "):
        system.integrate([1], [0], np.linspace(0, 200, 5), 1e-2, method="RK23", progress=False)
