"""Radau IIA methods: coefficients, damping of what a step does not resolve, motors. Orders: `test_integrators.py`."""

from dataclasses import replace

import numpy as np
import pytest

from discs import Chain, Problem, State, simulate
from discs.integrators.tableaux import radau
from discs.loads import Damping, Motor, signals

STAGES = {"radau3": 2, "radau5": 3}


@pytest.fixture(params=STAGES)
def method(request):
    return request.param


def row(n=3, radius=0.8, stiffness=0.9, theta=0.0, omega=0.0, loads=(), duration=1.0):
    """A straight row of discs along x."""
    chain = Chain(
        n=n, length=1.5, density=1.3, spin_inertia=0.6, torsion_stiffness=stiffness, bending_stiffness=0.5, radius=radius
    )  # fmt: skip
    start = State(chain.s, radius * theta + 0 * chain.s, theta + 0 * chain.s, omega + 0 * chain.s)
    return Problem(chain, start, duration, loads)


def run(problem, method, dt, frames=1):
    return simulate(problem, method, dt, frames, progress=False, engine="plain")


def test_coefficients(method):
    """Collocation whose last stage is the end; weights exact to degree 2 s - 2; the eigenvectors that solve the stages."""
    s, rule = STAGES[method], radau(STAGES[method])
    for m in range(s):
        np.testing.assert_allclose(rule.a @ rule.nodes**m, rule.nodes ** (m + 1) / (m + 1), atol=1e-14)
    for m in range(2 * s - 1):
        assert rule.b @ rule.nodes**m == pytest.approx(1 / (m + 1), abs=1e-14)
    assert rule.nodes[-1] == 1
    np.testing.assert_array_equal(rule.b, rule.a[-1])
    np.testing.assert_allclose(rule.last @ rule.a, rule.b, atol=1e-15)
    rebuilt = sum((np.outer(o, i) * v).real for v, i, o in zip(rule.pairs, rule.pairs_in, rule.pairs_out, strict=True))
    rebuilt = rebuilt + sum(np.outer(o, i) * v for v, i, o in zip(rule.real, rule.real_in, rule.real_out, strict=True))
    np.testing.assert_allclose(rebuilt, rule.a, atol=1e-14)


@pytest.mark.parametrize("y", [0.3, 2.0, 50.0])
@pytest.mark.filterwarnings("ignore:.* is conserved, but", "ignore:.* is too long")
def test_energy_of_an_oscillation_falls_as_the_stability_function_says(method, y):
    """R = 0, the middle at rest: theta oscillates at a rate; a step with h times it = y multiplies the energy by |R(i y)|^2."""
    problem = row(radius=0.0, theta=np.array([-0.5, 0.0, 0.5]))
    rate = np.sqrt(2 * 0.9 / (0.6 * 0.75**2))
    problem = replace(problem, duration=y / rate)
    found = run(problem, method, y / rate, frames=2)
    over = 1 + y**2 / 9 if method == "radau3" else 1 + 0.06 * y**2 + y**4 / 400
    lost = y**4 / 36 if method == "radau3" else y**6 / 3600
    assert found.energy[-1] / found.energy[0] == pytest.approx(over / (over + lost), rel=1e-9)


@pytest.mark.filterwarnings("ignore:.*the change of energy is work less", "ignore:.* is too long")  # the decay is not resolved
def test_a_stiff_damper_stops_discs_in_one_step(method):
    """omega = omega_0 e^{-a t}, a h = 700: a midpoint step keeps its size."""
    inertia = 0.6 + 1.3 * 0.8**2
    problem = row(omega=1.5, loads=(Damping(rolling=700 * inertia / 0.1),))
    stopped, ringing = (run(problem, name, 0.1, frames=np.array([0.1, 1.0])) for name in (method, "midpoint"))
    assert np.abs(stopped.omega[0]).max() < 1.5 * 4 / 700
    assert np.abs(stopped.omega[1]).max() < 1e-15
    assert np.abs(ringing.omega).min() > 1.4
    assert stopped.theta[1] == pytest.approx(1.5 * 0.1 / 700, rel=1e-6)


@pytest.mark.filterwarnings("ignore:.*the change of energy is work less")
def test_viscosity_leaves_slow_motion_exact():
    """Stiff viscosity of torsion equalises the rates; after that all discs roll at the mean, slowed by resistance."""
    inertia, c = 0.6 + 1.3 * 0.8**2, 0.4
    problem = row(n=5, omega=np.array([0.0, 1.0, 3.0, 1.0, 0.5]), stiffness=0.0, loads=(Damping(rolling=c, torsion=1e4),))
    problem = replace(problem, chain=replace(problem.chain, bending_stiffness=0.0, rolling="unit"))
    mean = (0.0 + 2 * (1.0 + 3.0 + 1.0) + 0.5) / 8
    found = run(problem, "radau5", 0.1)
    assert found.omega[-1] == pytest.approx(mean * np.exp(-c / inertia), rel=1e-7)


def test_motors_have_their_rate_at_the_ends_of_steps(method):
    """The last stage is the end of the step."""
    rate = signals.sine(0.5, 3.0)
    found = run(row(loads=(Motor(rate, at=0.0),)), method, 0.1, frames=11)
    np.testing.assert_allclose(found.omega[:, 0], rate(found.t), atol=1e-15)
    off = found.energy - found.energy[0] - found.work
    assert np.abs(off).max() < (1e-3 if method == "radau3" else 1e-6)


def test_lost_energy_is_told_with_its_cause():
    problem = row(radius=0.0, theta=np.array([-0.5, 0.0, 0.5]), duration=10.0)
    with pytest.warns(
        UserWarning, match="energy is conserved, but .* radau3 damps what its steps do not resolve: take a smaller dt"
    ):
        run(problem, "radau3", 1.0)
