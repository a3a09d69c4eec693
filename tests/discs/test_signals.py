"""Loads and signals that are refused, and what signals are."""

from dataclasses import replace

import numpy as np
import pytest

from discs import Midpoint, simulate
from discs.kernels import protocol as do
from discs.loads import Custom, Damping, Force, Linear, Motor, Potential, Rest, Slope, Spring, Torque, signals
from tests.conftest import uneven
from tests.discs.test_loads import KINDS

DRAWN = np.random.default_rng(0)


def noise(t):
    """Another number each time, so no function of t."""
    return DRAWN.random()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda p: Damping(rolling=-0.1), "rolling of Damping must be finite and at least 0; got -0.1"),
        (lambda p: Damping(torsion=np.ones(7)), r"torsion of Damping must be a number or an array of shape \(6,\)"),
        (lambda p: Damping(bending=-0.1), "bending of Damping must be finite and at least 0"),
        (lambda p: Rest(curvature=np.ones(3)), r"curvature of Rest must be a number or an array of shape \(5,\)"),
        (lambda p: Rest(mounting_angle=0.1), "Rest: mounting_angle is for discs with headings of their own"),
        (lambda p: Torque(1.0, about="turn"), "Torque: about='turn' is for discs with headings"),
        (lambda p: Torque(1.0, about="pitch"), "about of Torque must be one of 'roll', 'turn'"),
        (lambda p: Torque(1.0, at=3.2), "at of Torque must be on the rod, from 0 to 3.1; got 3.2"),
        (lambda p: Torque(lambda s: s, at=1.0), "pattern of Torque with at= is one number"),
        (lambda p: Torque(lambda s: s[:2]), r"pattern of Torque must be a number or an array of shape \(7,\)"),
        (lambda p: Force(y=np.nan), "y of Force must be finite"),
        (lambda p: Force(y=1.0, signal=3.0), "signal of Force must be a function of t"),
        (lambda p: Force(y=1.0, signal=lambda t: np.nan), "Force: the signal .* must give finite numbers; got nan at t = 0"),
        (lambda p: Torque(1.0, signal=lambda t: np.ones(2)), "Torque: the signal .* must give a finite number; got .* at t = 0"),
        (lambda p: Torque(1.0, signal=lambda t: 1 / (1 - t) if t < 1 else np.inf), "got inf at t = 1"),
        (lambda p: Torque(1.0, signal=lambda t: "much"), "Torque: the signal .* must give a finite number; got 'much' at t = 0"),
        (lambda p: Spring(0.0, 0.0, -1.5), "stiffness of Spring must be finite and at least 0; got -1.5"),
        (lambda p: Spring(0.0, 0.0, -1.5, at=1.0), "stiffness of Spring must be finite and at least 0; got -1.5"),
        (lambda p: Slope(np.inf), "gx of Slope must be a finite number"),
        (lambda p: Custom(lambda t, q, v: q[0]), r"Custom: the force must be finite numbers of shape \(3, 7\); got shape \(7,\)"),
        (lambda p: Custom(lambda t, q, v: np.nan * q), "Custom: the force must be finite numbers"),
        (
            lambda p: Linear(np.zeros((3, 7)), viscosity=np.ones((1, 7))),
            r"viscosity must be finite, at least 0 and of shape \(1, 8\)",
        ),
        (lambda p: Linear(np.zeros((3, 7)), viscosity=-np.ones((1, 8))), "viscosity must be finite, at least 0"),
        (lambda p: Torque(1.0, signal=lambda t: 1 / t), "Torque: the signal .* raised ZeroDivisionError: .* at t = 0"),
        (lambda p: Torque(lambda s: 1 / 0), "pattern of Torque raised ZeroDivisionError: .* 7 places s, from 0 to 3.1"),
        (lambda p: Torque(lambda s: np.where(s > 3, np.inf, s)), "pattern of Torque must be finite; got inf at s = 3.1"),
        (lambda p: Custom(lambda t, q, v: {}["wind"]), "force of Custom raised KeyError: 'wind' at t = 0"),
        (lambda p: Potential(lambda x, y: x, lambda x, y: 1 / 0), "gradient of Potential raised ZeroDivisionError"),
        (lambda p: Potential(lambda x, y: x, lambda x, y: x), r"gradient of Potential must return dV/dx and dV/dy; got an array"),
        (
            lambda p: Potential(lambda x, y: x, lambda x, y: (x, y[:2])),
            r"gradient of Potential must be finite numbers of shape \(7,\)",
        ),
        (
            lambda p: Torque(1.0, noise),
            "Torque: the signal .* must be a function of t; at t = 0 it gave .* and then",
        ),
        (lambda p: Motor(lambda t: 0.5 + t * noise(t), 0.0), "Motor: the signal .* must be a function of t; at t = 1 it gave"),
        (
            lambda p: Custom(lambda t, q, v: noise(t) + 0 * q),
            "Custom: the force must be a function of t, q and v",
        ),
        (lambda p: Custom(3), "force and power of Custom must be functions"),
        (lambda p: Potential(lambda x, y: x, None), "gradient of Potential must be a function"),
    ],
)
def test_what_a_load_cannot_be_is_refused_in_words(make, words):
    problem = uneven(7, KINDS[0])
    with pytest.raises(ValueError, match=words):
        replace(problem, loads=(make(problem),))


@pytest.mark.parametrize("engine", ["compiled", "plain"])
@pytest.mark.parametrize("method", ["midpoint", "DOP853"])
def test_a_signal_that_fails_on_the_way_is_named(method, engine, kernels_as_python):
    problem = replace(uneven(7, KINDS[0]), loads=(Torque(1.0, lambda t: np.nan if 0.5 < t < 0.9 else 1.0),))
    with pytest.raises(ValueError, match=r"Torque: the signal .* must give finite numbers; got nan at t = 0\.[56]"):
        simulate(problem, method, 0.05, 2, progress=False, engine=engine)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: signals.ramp(1.0, 1.0), "t0 of ramp must be less than t1"),
        (lambda: signals.pulse(0.0, -1.0), "width of pulse must be positive"),
        (lambda: signals.sine("a", 1.0), "amplitude of sine must be a finite number"),
        (lambda: signals.table([0, 2, 1], [1, 2, 3]), "t of table must be increasing times"),
        (lambda: signals.table([0, 1, 2], [1, 2]), "values of table must be a number or an array of shape"),
    ],
)
def test_what_a_signal_cannot_be_is_refused_in_words(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_signals_are_what_they_are_called():
    t = np.array([-1.0, 0.0, 0.5, 1.0, 2.0])
    np.testing.assert_allclose(signals.sine(2.0, 3.0, 0.1)(t), 2 * np.sin(3 * t + 0.1))
    np.testing.assert_array_equal(signals.ramp(0, 2)(t), [0, 0, 0.25, 0.5, 1])
    np.testing.assert_array_equal(signals.pulse(0, 1)(t), [0, 1, 1, 0, 0])
    np.testing.assert_array_equal(signals.smooth(0, 1)(t), [0, 0, 0.5, 1, 1])
    np.testing.assert_array_equal(signals.table([0, 1], [1, 3])(t), [1, 1, 2, 3, 3])
    slope = np.diff(signals.smooth(0, 1)(np.linspace(0, 1, 1001)))
    assert (slope >= 0).all()
    assert repr(signals.sine(2.0, 3.0)) == "sine(amplitude=2.0, rate=3.0, phase=0.0)"


def test_functions_of_ones_own_that_fail_on_the_way_are_named():
    problem = uneven(7, KINDS[0])

    def late(value):
        return lambda t, q, v: value if t < 0.5 else 1 / 0

    for load, words in (
        (Custom(late(np.zeros((3, 7)))), r"force of Custom raised ZeroDivisionError: .* at t = 0\.5"),
        (Custom(lambda t, q, v: 0 * q, late(0.0)), r"power of Custom raised ZeroDivisionError: .* at t = 0\.5"),
        (Custom(lambda t, q, v: 0 * q, lambda t, q, v: v), r"power of Custom at t = 0\.025 must be a finite number"),
        (Potential(lambda x, y: "low", lambda x, y: (x, y)), "V of Potential must be 7 numbers; got 'low'"),
    ):
        with pytest.raises(ValueError, match=words):
            simulate(replace(problem, loads=(load,)), "midpoint", 0.05, 2, progress=False)


def test_compiled_steps_notice_a_time_that_is_not_in_the_table(kernels_as_python):
    """A method that does not say where it evaluates forces gives NaN at once, not another value of the signal."""
    problem = replace(uneven(7, KINDS[0]), loads=(Torque(1.0, signals.sine(1.0, 1.0)),))
    system = problem.system
    for node, finite in ((0.5, True), (0.5001, False), (0.0, False)):
        method = Midpoint()
        numbers = type("Off", (type(method.parameters),), {"nodes": np.array([node])})
        do.room.register(numbers, do.room.dispatch(type(method.parameters)))
        do.step.register(numbers, do.step.dispatch(type(method.parameters)))
        do.jumps.register(numbers, do.jumps.dispatch(type(method.parameters)))
        vars(method)["parameters"] = numbers(*method.parameters)
        found, _ = method.march(system, system.parameters, problem.start(), 0.0, 0.1, 1, np.inf)
        assert np.isfinite(found.pi).all() == finite
