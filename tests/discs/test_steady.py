"""Steady motions: a ring that turns in its place, a rod at its final rate, and states that are not steady."""

from dataclasses import replace

import numpy as np
import pytest

from discs import Problem, State, SteeredChain, simulate
from discs.analysis import modes, steady
from discs.chains.twist import untwisting_chain
from discs.loads import Custom, Damping, Potential, Rest, Slope, Torque, signals
from tests.discs.test_modes import BEAMS, ROD, ring

pytestmark = pytest.mark.slow  # linearised equations of many chains


def snake(n=12, speed=0.3, turns=1):
    """A closed ring of discs that roll along it, axles across: it turns in its place."""
    chain = SteeredChain(n=n, ends="ring", turns=turns, **ROD, **BEAMS)
    at = 2 * np.pi * np.arange(n) / n
    a = chain.k / (2 * np.sin(np.pi / n))
    state = State(a * np.cos(at), a * np.sin(at), 0 * at, speed / ROD["radius"], phi=at, phi_rate=speed / a)
    rest = Rest(mounting_angle=-np.pi / 2, curvature=2 * np.pi / (n * chain.k))
    return Problem(chain, state, 4.0, (rest,))


def test_a_turning_ring_is_a_steady_motion():
    problem = snake()
    state = steady(problem)
    a = np.hypot(problem.initial.x[0], problem.initial.y[0])
    assert state.turning == pytest.approx(0.3 / a)
    found = modes(problem, count=10)
    assert found.rate.size == 10
    assert "turn" in found.symmetries
    assert f"Omega = {0.3 / a:.4g}" in found.table()
    size, mode = 1e-6, 3
    run, still = (
        simulate(replace(problem, initial=initial, duration=1.0), "gauss6", 0.01, 2, progress=False, engine="plain")
        for initial in (found.displaced(mode, size), problem.initial)
    )
    moved = size * found.shape[mode] * np.exp(found.rate[mode])
    c, s = np.cos(state.turning), np.sin(state.turning)
    np.testing.assert_allclose(run.x[-1] - still.x[-1], (c * moved[0] - s * moved[1]).real, atol=1e-4 * size)
    np.testing.assert_allclose(run.phi[-1] - still.phi[-1], moved[3].real, atol=1e-4 * size)


def test_a_damped_rod_rolls_down_a_slope_at_the_final_rate():
    problem = ring(17, "unit", loads=(Slope(0.0, -0.5), Damping(rolling=0.4)))
    rate = -0.5 * 1.3 * 0.8 / 0.4
    found = modes(problem, count=4, at=replace(problem.initial, omega=rate))
    assert found.growth < 0
    assert found.rate[0].real == pytest.approx(-0.4 / (1.3 * 0.64 + 0.9))  # the whole rod
    with pytest.raises(ValueError, match=r"the roll of disc .* accelerates by .* rad per time squared: take `equilibrium"):
        modes(problem)


def test_states_that_are_not_steady_are_refused():
    twisted = untwisting_chain(9)
    with pytest.raises(ValueError, match="the roll of disc 0 accelerates"):
        modes(twisted)
    straight = untwisting_chain(9, twist=0.0)
    turning = replace(straight, initial=replace(straight.initial, omega=np.linspace(0.1, 1.0, 9)))
    with pytest.raises(ValueError, match=r"after .* of time the roll of disc . accelerates"):
        modes(turning)
    bent = replace(straight.initial, y=straight.chain.s**2, omega=np.linspace(0.1, 1.0, 9))
    with pytest.raises(ValueError, match="in which the chain moves as a rigid body; in the state given disc"):
        modes(straight, at=bent)
    with pytest.raises(ValueError, match=r"Torque: its signal changes, from 0 to .* leave the signal out"):
        modes(replace(straight, loads=(Torque(0.1, signals.ramp(0.0, 1.0)),)))
    with pytest.raises(ValueError, match="a load depends on t"):
        modes(replace(straight, loads=(Custom(lambda t, q, v: 0 * q + t),)))
    rolling = replace(straight, initial=replace(straight.initial, omega=0.5))
    with pytest.raises(ValueError, match=r"after 2 of time the roll of disc 0 accelerates"):
        modes(replace(rolling, loads=(Potential(lambda x, y: y**2, lambda x, y: (0 * x, 2 * y)),)))
    stiffer = Custom(lambda t, q, v: np.array([0 * q[0], 0 * q[0], -q[1] * (q[2] - q[1])]))  # no torque on the way, but stiffer
    with pytest.raises(ValueError, match="no steady one"):
        modes(replace(rolling, loads=(stiffer,)))
    for wrong in (0, 2.5, "three"):
        with pytest.raises(ValueError, match="count"):
            modes(straight, count=wrong)
    with pytest.raises(ValueError, match=r"mode must be below 8"):
        modes(straight).displaced(8)
