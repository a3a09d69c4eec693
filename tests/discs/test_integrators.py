"""Each integrator: measured order, energy, reversal, constraint."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from discs import RK4, Chain, Leapfrog, Midpoint, Problem, State, Suzuki4, simulate
from discs.integrators import METHODS, Work, find
from tests.conftest import ALL, SLAVED, STEERED, Model, models, uneven
from tests.discs.test_system import contact_from_the_definition

TIGHT = {
    "midpoint": Midpoint(tolerance=1e-14),
    "suzuki4": Suzuki4(Midpoint(tolerance=1e-14)),
    "rk4": RK4(),
    "leapfrog": Leapfrog(),
}
# steps per unit of time, in the asymptotic range of each method and above round-off
STEPS = {"midpoint": (40, 80, 160), "suzuki4": (40, 80, 160), "rk4": (80, 160, 320), "leapfrog": (160, 320, 640)}


def final(problem, method, steps):
    run = simulate(problem, method, problem.duration / steps, frames=1, progress=False)
    return np.concatenate([run.x[-1], run.y[-1], run.theta[-1], run.omega[-1]])


@cache
def accurate(model):
    return final(uneven(6, model), TIGHT["rk4"], 2000)


@models([m for m in ALL if m.ends in ("consistent", "ring")] + STEERED[:1])
@pytest.mark.parametrize("name", METHODS)
def test_measured_order_is_the_declared_one(name, model):
    problem = uneven(6, model)
    errors = [np.abs(final(problem, TIGHT[name], steps) - accurate(model)).max() for steps in STEPS[name]]
    orders = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert orders == pytest.approx(find(name).order, abs=0.25), errors


@models(ALL)
@pytest.mark.parametrize("name", ["midpoint", "suzuki4"])
def test_energy_is_exact(name, model):
    run = simulate(uneven(9, model), TIGHT[name], 0.05, progress=False)
    np.testing.assert_allclose(run.energy, run.energy[0], rtol=1e-12)


@models(SLAVED)
@pytest.mark.parametrize("name", ["midpoint", "suzuki4"])
def test_energy_is_exact_even_with_one_sweep(name, model):
    loose = Midpoint(sweeps=1, tolerance=0)
    method = loose if name == "midpoint" else Suzuki4(loose)
    run = simulate(uneven(9, model), method, 0.05, progress=False)
    np.testing.assert_allclose(run.energy, run.energy[0], rtol=1e-12)


@models(ALL)
def test_energy_test_can_fail(model):
    run = simulate(uneven(9, model), "rk4", 0.02, progress=False)
    assert np.ptp(run.energy) > 1e-9 * run.energy[0]


@models(ALL)
@pytest.mark.parametrize("h", [0.02, 0.2])
@pytest.mark.parametrize("name", ["midpoint", "suzuki4"])
def test_reversal(name, h, model):
    """A step back from the end of a step returns to its start."""
    problem = uneven(9, model)
    z = problem.start()
    back = z
    for step in (h, -h):
        back = TIGHT[name].step(problem.system, back, step, Work())
    np.testing.assert_allclose(back.hi, z.hi, atol=1e-12)
    np.testing.assert_allclose(back.pi, z.pi, atol=1e-11)
    once = Midpoint(sweeps=1, tolerance=0)
    unconverged = once.step(problem.system, once.step(problem.system, z, h, Work()), -h, Work())
    assert np.abs(unconverged.hi - z.hi).max() > 1e-9  # a control: one sweep is not reversible


@models(ALL)
@pytest.mark.parametrize("name", METHODS)
def test_rolling_residual_is_round_off_in_every_frame(name, model):
    run = simulate(uneven(9, model), name, 0.004, frames=57, progress=False)
    assert run.rolling_residual.max() < 1e-13


@models(ALL)
def test_midpoint_steps_roll_without_sliding(model):
    """From the frames alone: r_{n+1} - r_n = e(midpoint) (theta_{n+1} - theta_n) over every step."""
    problem = uneven(9, model)
    run = simulate(problem, TIGHT["midpoint"], 0.05, frames=21, progress=False)
    q = np.stack([getattr(run, row) for row in problem.system.rows], axis=1)
    for a, b in pairwise(q):
        e = contact_from_the_definition(problem, (a + b) / 2)
        np.testing.assert_allclose((b - a)[:2], e * (b - a)[2], atol=1e-13)


@models(SLAVED)
def test_leapfrog_keeps_its_modified_energy(model):
    run = simulate(uneven(9, model), "leapfrog", 0.004, want=("modified_energy",), progress=False)
    np.testing.assert_allclose(run.modified_energy, run.modified_energy[0], rtol=1e-11)
    assert np.ptp(run.energy) > 1e-8 * run.energy[0]  # which the energy is not


def test_leapfrog_is_the_paper_s_scheme():
    """The residuals of the paper's discrete equations, term by term, with the multipliers eliminated by hand."""
    n = 9
    problem = uneven(n, Model("paper", "field"), equal=True)
    chain, system = problem.chain, problem.system
    h, k = 0.004, chain.k
    alpha, beta, rho, bend, radius = (
        float(np.asarray(getattr(chain, p))[0])
        for p in ("spin_inertia", "torsion_stiffness", "density", "bending_stiffness", "radius")
    )
    memory = TIGHT["leapfrog"].begin(system, problem.start(), h, Work())
    memory = TIGHT["leapfrog"].advance(system, memory, h, Work())
    (x0, y0, t0), (x, y, t), (x2, y2, t2) = memory.hi - memory.last, memory.hi, memory.hi + memory.next
    inner = slice(2, -2)  # where the printed stencils reach

    def fourth(f):
        return f[4:] - 4 * f[3:-1] + 6 * f[2:-2] - 4 * f[1:-3] + f[:-4]

    def slope(f):
        return ((f[2:] - f[:-2]) / (2 * k))[1:-1]

    lam = (rho * (x2 - 2 * x + x0)[inner] + h**2 * bend / k**4 * fourth(x)) / h**2
    mu = (rho * (y2 - 2 * y + y0)[inner] + h**2 * bend / k**4 * fourth(y)) / h**2
    left = alpha * (t2 - 2 * t + t0)[inner]
    second = (t[2:] - 2 * t[1:-1] + t[:-2])[1:-1]
    right = radius * h**2 * (lam * slope(y) - mu * slope(x)) + beta * h**2 / k**2 * second
    np.testing.assert_allclose(left, right, atol=1e-15)
    np.testing.assert_allclose((x2 - x0)[inner], -radius * (t2 - t0)[inner] * slope(y), atol=1e-15)
    np.testing.assert_allclose((y2 - y0)[inner], radius * (t2 - t0)[inner] * slope(x), atol=1e-15)


def test_suzuki_fractions():
    s = np.array(Suzuki4.fractions)
    assert s.sum() == pytest.approx(1, abs=1e-15)
    assert (s**3).sum() == pytest.approx(0, abs=1e-15)
    np.testing.assert_array_equal(s, s[::-1])


def moved(state: State, angle: float, shift: tuple[float, float], roll: float) -> State:
    c, s = np.cos(angle), np.sin(angle)
    x, y = np.asarray(state.x), np.asarray(state.y)
    phi = None if state.phi is None else np.asarray(state.phi) + angle
    turned = c * x - s * y + shift[0], s * x + c * y + shift[1]
    return State(*turned, np.asarray(state.theta) + roll, state.omega, phi, state.phi_rate)


@models(ALL)
@pytest.mark.parametrize("name", METHODS)
def test_equivariance(name, model):
    """Moving the plane and turning all discs alike moves the motion alike."""
    problem = uneven(9, model)
    other = Problem(problem.chain, moved(problem.initial, 0.7, (1.3, -2.0), 0.4), problem.duration)
    a, b = (simulate(p, TIGHT[name], 0.02, frames=1, progress=False) for p in (problem, other))
    phi = None if a.phi is None else a.phi[-1]
    expected = moved(State(a.x[-1], a.y[-1], a.theta[-1], a.omega[-1], phi), 0.7, (1.3, -2.0), 0.4)
    for row in (*problem.system.rows, "omega"):
        np.testing.assert_allclose(getattr(b, row)[-1], np.asarray(getattr(expected, row)), atol=1e-10)


@pytest.mark.parametrize("name", METHODS)
def test_positions_carry_their_low_digits(name):
    """A straight chain far from the origin rolls sideways in steps of about ten units in the last place of y."""
    chain = Chain(n=5, length=2.0, density=1.0, spin_inertia=0.5, torsion_stiffness=1.0, bending_stiffness=1.0, radius=0.7)
    far = np.full(5, 1e6)
    problem = Problem(chain, State(chain.s, far, 0 * far, 1.7e-3), 1e-3)
    run = simulate(problem, name, 1e-6, frames=1, progress=False)
    # uncompensated, every step would round the same way: 1000 times up to 6e-11
    np.testing.assert_allclose(run.y[-1] - 1e6, 0.7 * 1.7e-3 * 1e-3, atol=np.spacing(1e6))
