"""Events, and runs step by step."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from scipy.integrate import quad

from discs import Chain, Problem, State, first_slip, load, simulate, steps
from discs.events import FrictionExceeded, Line, Moment, Touch
from discs.loads import Damping, Torque
from tests.conftest import Model, uneven
from tests.discs.test_view import pair

N, LENGTH, RHO, ALPHA, K, RADIUS, OMEGA = 12, 3.1, 1.3, 0.6, 0.8, 0.7, 0.4
SPACING = LENGTH / N
START = LENGTH / (2 * np.pi)  # radius of the ring


def ring(duration=0.4):
    """A ring of discs that all roll inwards at the same rate, field law."""
    chain = Chain(
        n=N,
        length=LENGTH,
        density=RHO,
        spin_inertia=ALPHA,
        torsion_stiffness=0.9,
        bending_stiffness=K,
        radius=RADIUS,
        ends="ring",
    )
    angle = 2 * np.pi * np.arange(N) / N
    return Problem(chain, State(START * np.cos(angle), START * np.sin(angle), 0 * angle, OMEGA), duration)


def time_to(radius: float) -> float:
    """When the ring has shrunk to a radius a, by the balance of energy: 1/2 (alpha + rho R^2 u^2 a^2) omega^2 + 1/2 K c^2 a^2 is
    constant, and a. = -R u a omega, with u = sin(2 pi/N)/k and c = (4/k^2) sin^2(pi/N)."""
    u, c = np.sin(2 * np.pi / N) / SPACING, 4 / SPACING**2 * np.sin(np.pi / N) ** 2

    def inertia(a):
        return ALPHA + RHO * (RADIUS * u * a) ** 2

    twice = inertia(START) * OMEGA**2 + K * c**2 * START**2
    return quad(lambda a: np.sqrt(inertia(a) / (twice - K * (c * a) ** 2)) / (RADIUS * u * a), radius, START, epsabs=1e-14)[0]


@pytest.mark.parametrize(("method", "dt"), [("midpoint", 0.05), ("suzuki4", 0.025), ("gauss6", 0.14), ("leapfrog", 0.01)])
def test_the_time_of_an_event_has_the_methods_order(method, dt):
    exact, errors = time_to(0.7 * START), []
    line = Line((0.7 * START, 0.0), (1.0, 0.0), disc=0)  # disc 0 moves along the x axis
    for h in (dt, dt / 2, dt / 4):
        run = simulate(ring(), method, h, frames=2, events=line, engine="plain", progress=False)
        (happened,) = run.events
        assert happened.state.x[0] == pytest.approx(0.7 * START, abs=1e-13)
        errors.append(abs(happened.t - exact))
    order = {"midpoint": 2, "suzuki4": 4, "gauss6": 6, "leapfrog": 2}[method]
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    assert slopes == pytest.approx(order, abs=0.35), errors


def test_a_terminal_event_ends_the_run_there(tmp_path):
    line = Line((0.7 * START, 0.0), (1.0, 0.0), disc=0, terminal=True)
    problem = ring()
    run = simulate(problem, dt=0.02, frames=21, events=[lambda now: now.t - 0.133, line], engine="plain", progress=False)
    whole = simulate(problem, dt=0.02, frames=21, engine="plain", progress=False)
    assert [each.event for each in run.events] == [0, 1]
    assert run.events[0].t == pytest.approx(0.133, abs=1e-14)
    end = run.t.size - 1
    np.testing.assert_array_equal(run.t[:end], whole.t[:end])
    np.testing.assert_array_equal(run.theta[:end], whole.theta[:end])  # events change nothing
    assert run.t[-1] == run.events[-1].t < whole.t[end]
    assert run.x[-1, 0] == pytest.approx(0.7 * START, abs=1e-13)
    run.save(tmp_path / "run.nc")
    kept = load(tmp_path / "run.nc").stats["events"]
    assert [time for _, time in kept] == [each.t for each in run.events]


def test_only_the_direction_asked_for_counts():
    problem = uneven(5, Model("springs", "unit"))

    def swing(now):
        return np.cos(9 * now.t)

    def falls(now):
        return swing(now)

    falls.direction = -1
    run = simulate(problem, dt=0.05, events=[swing, falls], engine="plain", progress=False)
    zeros = (np.arange(3) + 0.5) * np.pi / 9
    assert [each.t for each in run.events if each.event == 0] == pytest.approx(list(zeros), abs=1e-13)
    assert [each.t for each in run.events if each.event == 1] == pytest.approx(list(zeros[::2]), abs=1e-13)


def test_to_a_tolerance():
    line = Line((0.7 * START, 0.0), (1.0, 0.0), disc=0)
    run = simulate(ring(), tol=1e-6, events=line, engine="plain", progress=False)
    assert run.stats["method"] == "gauss6"
    assert run.error_estimate is not None
    assert run.events[0].t == pytest.approx(time_to(0.7 * START), rel=1e-5)


def test_friction_is_exceeded_when_frames_say_so():
    problem = uneven(9, Model("springs", "field"))
    weight = 9.81 * np.asarray(problem.chain.density) * problem.chain.k
    fine = simulate(problem, dt=0.02, frames=2001, want=("contact_force",), engine="plain", progress=False)
    needed = (np.hypot(fine.contact_force[:, 0], fine.contact_force[:, 1]) / weight).max(axis=1)
    mu = 0.5 * (needed[0] + needed.max())
    slip = first_slip(fine, weight, mu)
    run = simulate(problem, dt=0.02, events=FrictionExceeded(mu, weight), engine="plain", progress=False)
    assert run.events[0].t == pytest.approx(slip.time, abs=1e-5)


def test_two_discs_touch():
    """Of two discs with own headings, that of the event: their diameters are as far apart as a finer look at both says."""
    run = pair()
    touch = Touch(0, 1, gap=0.85)
    found = simulate(run.problem, dt=0.05, frames=11, events=touch, engine="plain", progress=False).events
    assert found
    for each in found:
        along = np.linspace(-0.7, 0.7, 1401)[:, None]
        ends = [
            np.array([each.state.x[i], each.state.y[i]]) + along * np.array([-np.sin(each.state.phi[i]), np.cos(each.state.phi[i])])
            for i in (0, 1)
        ]
        apart = np.hypot(*np.moveaxis(ends[0][:, None] - ends[1][None], -1, 0)).min()
        assert apart == pytest.approx(0.85, abs=1e-5)


def test_steps_are_those_of_the_run():
    problem = uneven(6, Model("springs", "steered"))
    run = simulate(problem, "suzuki4", 0.3, frames=[0, 0.3, 0.6, 0.9, 1.0], want=("contact_force",), engine="plain", progress=False)
    moments = list(steps(problem, "suzuki4", 0.3, engine="plain"))
    assert [now.t for now in moments] == pytest.approx(list(run.t), abs=1e-15)
    for f, now in enumerate(moments):
        for name in ("x", "y", "theta", "omega", "phi", "phi_rate", "energy", "contact_force"):
            np.testing.assert_array_equal(getattr(now, name), getattr(run, name)[f])
    again = simulate(Problem(problem.chain, moments[2].state, 0.4), "suzuki4", 0.3, engine="plain", frames=2, progress=False)
    np.testing.assert_allclose(again.theta[-1], run.theta[-1], rtol=1e-13)
    assert [now.t for now in islice(steps(problem, dt=0.25, engine="plain"), 2)] == [0, 0.25]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda p: simulate(p, dt=0.1, events="line"), "events must be functions of a Moment"),
        (lambda p: simulate(p, dt=0.1, events=lambda now: "far"), r"events\[0\] must be a finite number; got 'far', at t = 0"),
        (lambda p: simulate(p, dt=0.1, events=lambda now: now.z), r"events\[0\] raised AttributeError.*, at t = 0"),
        (lambda p: simulate(p, "DOP853", 0.1, events=Line((0, 0), (1, 0))), "'DOP853' chooses its own"),
        (lambda p: next(steps(p, "RK45", 0.1)), "needs a method with fixed steps"),
        (lambda p: next(steps(p.chain)), "steps takes a Problem"),
        (lambda p: next(steps(p, dt=3.0)), "dt must be at most the duration, 1; got 3"),
        (lambda p: Line((0, 0), (0, 0)), "normal must be a vector other than zero"),
        (lambda p: Touch(1, 1, 0.1), "one and other must differ; got 1 twice"),
        (lambda p: Touch(0, 1, 0.0), "gap must be a positive finite number; got 0.0"),
        (lambda p: simulate(p, dt=0.1, events=Touch(0, 1, 0.1)), "Touch is for discs of equal radius"),
        (lambda p: FrictionExceeded(0, 1.0), "mu must be a positive finite number; got 0"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(ValueError, match=message):
        call(uneven(5, Model("springs", "field")))


def test_a_moment_says_what_it_is():
    now = next(steps(uneven(5, Model("springs", "field")), dt=0.1, engine="plain"))
    assert isinstance(now, Moment)
    assert repr(now) == "Moment(t = 0, 5 discs)"
    assert now.phi is None


def test_moments_know_work_and_dissipation():
    """Each moment has the sums up to its own time, also when it is asked later; those of a run with the same steps."""
    problem = replace(uneven(6, Model("springs", "field")), loads=(Damping(rolling=0.3), Torque(0.2, at=0.0)))
    run = simulate(problem, dt=0.1, frames=11, engine="plain", progress=False)
    moments = list(steps(problem, dt=0.1, engine="plain"))
    np.testing.assert_allclose([now.work for now in moments], run.work, atol=1e-13)
    np.testing.assert_allclose([now.dissipated for now in moments], run.dissipated, atol=1e-13)
    assert run.dissipated[-1] > 0.01
    assert [now.work for now in islice(steps(replace(problem, loads=()), dt=0.1, engine="plain"), 2)] == [0.0, 0.0]


def test_steps_refuse_loads_that_a_method_does_not_take():
    problem = replace(uneven(6, Model("springs", "field")), loads=(Damping(rolling=0.3),))
    with pytest.raises(ValueError, match="'leapfrog' takes loads that are part of the energy only"):
        next(steps(problem, "leapfrog", dt=0.001))
