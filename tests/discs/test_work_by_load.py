"""What each load does, one by one: their sums, and each against the same load alone."""

from dataclasses import replace

import numpy as np
import pytest

from discs import load, simulate
from discs.loads import Custom, Damping, Motor, Rest, Slope, Torque, signals
from tests.conftest import models, uneven
from tests.discs.test_kinds_of_loads import every
from tests.discs.test_loads import KINDS

WANT = ("work_by_load",)


@models(KINDS)
@pytest.mark.parametrize("method", ["midpoint", "suzuki4", "gauss4", "radau3", "rk4", "DOP853"])
def test_parts_add_up(model, method):
    problem = uneven(6, model)
    motor = Motor(float(np.broadcast_to(problem.initial.omega, 6)[2]), problem.chain.s[2])
    loads = (*every(problem), Custom(lambda t, q, v: 0.1 * np.sin(q)), *([motor] if method not in ("rk4", "DOP853") else []))
    problem = replace(problem, loads=loads, duration=0.2)
    run = simulate(problem, method, 0.004 if method == "rk4" else 0.05, [0.07, 0.1, 0.2], WANT, progress=False)
    assert run.work_by_load.shape == run.dissipated_by_load.shape == (3, len(loads))
    size = np.abs(run.balance_by_load).max()
    np.testing.assert_allclose(run.work_by_load.sum(axis=1), run.work, atol=1e-13 * size)
    np.testing.assert_allclose(run.dissipated_by_load.sum(axis=1), run.dissipated, atol=1e-13 * size)
    works = [type(given).__name__ for given, done in zip(loads, run.work_by_load[-1], strict=True) if done]
    assert set(works) == {"Torque", "Force", "Custom", "Rest"} | ({"Motor"} if motor in loads else set())
    takes = [type(given).__name__ for given, taken in zip(loads, run.dissipated_by_load[-1], strict=True) if taken]
    assert takes == ["Damping", "Damping"]
    assert run.stats["plain_because"] == "the work of each load is booked by the plain engine only"
    other = simulate(problem, method, run.stats["dt"], [0.07, 0.1, 0.2], progress=False, engine="plain")
    np.testing.assert_array_equal(run.theta, other.theta)
    np.testing.assert_array_equal(run.balance, other.balance)


def along(run, power):
    """The integral of a power of (t, omega, theta), (F,), over the frames of a run, by Simpson's rule."""
    weights = np.array([1, *[4, 2] * (run.t.size // 2 - 1), 4, 1]) * run.t[1] / 3
    return weights @ [power(*frame) for frame in zip(run.t, run.omega, run.theta, strict=True)]


@pytest.mark.parametrize("model", [KINDS[0], KINDS[3]])
def test_each_part_is_the_integral_of_its_power(model):
    """Torques, dampers, and a rest twist that a signal drives beside a constant one: -S (theta' - tau) d(tau)/dt over the links."""
    problem = uneven(6, model, equal=True)
    chain = problem.chain
    rate, push = signals.sine(1.0, 2.0), signals.sine(0.7, 3.0)
    loads = (
        Torque(0.3, push),
        Damping(rolling=0.2),
        Rest(twist=0.5, signal=rate),
        Rest(twist=0.2),
        Slope(0.2),
        Torque(-0.2, at=0.0),
        Damping(torsion=0.1),
    )
    run = simulate(replace(problem, loads=loads), "gauss6", 0.01, 201, WANT, progress=False)
    work, taken = run.work_by_load[-1], run.dissipated_by_load[-1]
    stiffness = np.ravel(chain.torsion_stiffness)[0]

    def actuated(t, omega, theta):
        return -0.5 * 2.0 * np.cos(2 * t) * stiffness * np.sum(np.diff(theta) - chain.k * (0.2 + 0.5 * rate(t)))

    assert work[0] == pytest.approx(along(run, lambda t, omega, theta: 0.3 * push(t) * chain.w @ omega), rel=1e-6)
    assert work[2] == pytest.approx(along(run, actuated), rel=1e-6)
    assert work[5] == pytest.approx(-0.2 * (run.theta[-1, 0] - run.theta[0, 0]), rel=1e-9)
    assert taken[1] == pytest.approx(along(run, lambda t, omega, theta: 0.2 * chain.w @ omega**2), rel=1e-6)
    assert taken[6] == pytest.approx(along(run, lambda t, omega, theta: 0.1 * np.sum(np.diff(omega) ** 2) / chain.k), rel=1e-6)
    assert not work[[1, 3, 4, 6]].any()


def test_runs_without_it_say_how(tmp_path):
    problem = replace(uneven(6, KINDS[0]), loads=(Damping(0.1), Slope(0.1)))
    run = simulate(problem, "midpoint", 0.1, 3, progress=False, engine="plain")
    with pytest.raises(ValueError, match=r'take simulate\(..., want=\("work_by_load",\)\)'):
        _ = run.work_by_load
    calm = simulate(replace(problem, loads=(Slope(0.1),)), "midpoint", 0.1, 3, WANT, progress=False, engine="plain")
    assert not calm.work_by_load.any()
    kept = simulate(problem, "midpoint", 0.1, 3, WANT, progress=False, checkpoint=tmp_path / "run.nc")
    np.testing.assert_array_equal(load(tmp_path / "run.nc").dissipated_by_load, kept.dissipated_by_load)
    assert kept.to_xarray()["balance_by_load"].dims == ("time", "part", "load")
