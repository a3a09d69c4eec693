"""Loads: known answers, and the balance of energy over many steps."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from compare import lump
from continuum import steered_rod
from discs import Chain, Midpoint, Problem, State, simulate
from discs.loads import Damping, Linear, Potential, Rest, Slope, Torque, signals
from tests.conftest import Model, longer, uneven
from tests.discs.test_kinds_of_loads import every
from tests.discs.test_loads import KINDS


def one_row(loads, n: int = 5, duration: float = 2.0, **parameters) -> Problem:
    """Discs without springs, abreast and rolling along y."""
    values = {"density": 1.3, "spin_inertia": 0.6, "torsion_stiffness": 0.0, "bending_stiffness": 0.0, "radius": 0.7} | parameters
    chain = Chain(n=n, length=2.0, rolling="unit", **values)
    return Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), duration, loads)


INERTIA = 0.6 + 1.3 * 0.7**2


def test_discs_roll_down_a_slope_as_one_does():
    """y'' = rho R^2 g/(alpha + rho R^2); the energy, that of height included, is constant."""
    run = simulate(one_row((Slope(0.4, -0.9),)), "midpoint", 0.02, 5, progress=False, engine="plain")
    fall = -0.9 * 1.3 * 0.7**2 / INERTIA
    np.testing.assert_allclose(run.y, 0.5 * fall * run.t[:, None] ** 2 * np.ones(5), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(run.energy, run.energy[0], atol=1e-13)
    assert run.problem.conserves
    assert not run.work.any()
    assert not run.dissipated.any()


def test_a_torque_does_the_work_of_its_angle():
    run = simulate(one_row((Torque(0.5, signals.sine(1.0, 3.0)),)), "gauss8", 0.1, 9, progress=False, engine="plain")
    theta = 0.5 / INERTIA / 3 * (run.t - np.sin(3 * run.t) / 3)
    np.testing.assert_allclose(run.theta, theta[:, None] * np.ones(5), rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(
        run.work, 2.0 * 0.5 * INERTIA * (0.5 / INERTIA / 3 * (1 - np.cos(3 * run.t))) ** 2, rtol=1e-8, atol=1e-13
    )


def test_viscosity_damps_torsion_waves_like_an_oscillator():
    """R = 0, free ends: M theta'' = -(beta theta + eta theta') t with t = 4 sin^2(q k/2)/k^2. Strong too: no step limit."""
    for eta, dt, close in ((0.1, 0.001, 1e-5), (50.0, 0.01, 1e-4)):
        n, length = 9, 2.0
        chain = Chain(
            n=n,
            length=length,
            density=1.0,
            spin_inertia=0.6,
            torsion_stiffness=0.9,
            bending_stiffness=0.5,
            radius=0.0,
            rolling="unit",
        )
        start = np.cos(np.pi * chain.s / length)
        problem = Problem(chain, State(chain.s, 0 * chain.s, start), 1.0, (Damping(torsion=eta),))
        t = 4 * np.sin(np.pi * chain.k / length / 2) ** 2 / chain.k**2
        first, second = np.roots([0.6, eta * t, 0.9 * t])
        run = simulate(problem, "midpoint", dt, 5, progress=False, engine="plain")
        swing = (second * np.exp(first * run.t) - first * np.exp(second * run.t)) / (second - first)
        np.testing.assert_allclose(run.theta, np.outer(swing.real, start), atol=close)


@pytest.mark.parametrize("steered", [False, True])
def test_a_rod_at_its_rest_shape_stays_there_without_energy(steered):
    problem = uneven(7, Model("springs", "steered" if steered else "field"))
    chain, n = problem.chain, problem.chain.n
    twist = np.linspace(0.2, -0.4, n - 1)
    theta = np.concatenate([[0.0], np.cumsum(chain.k * twist)])
    state = State(chain.s, 0 * chain.s, theta, phi=0 * theta if steered else None)
    run = simulate(replace(problem, initial=state, loads=(Rest(twist=twist),)), "midpoint", 0.05, 3, progress=False, engine="plain")
    np.testing.assert_allclose(run.theta, theta * np.ones((3, 1)), atol=1e-13)
    np.testing.assert_allclose(run.energy, 0, atol=1e-14)


def test_the_energy_of_rest_shapes_is_that_of_the_strain_from_rest():
    """Of several together, static and driven, on a ring with whole turns of the heading too."""
    problem = uneven(7, Model("ring", "steered"))
    chain, q = problem.chain, problem.start().hi
    loads = (Rest(0.3, 0.5), Rest(-0.2, 0.7, signal=signals.ramp(-1.0, 1.0)), Rest(0.1, -0.4, signal=signals.ramp(-3.0, 1.0)))
    d = np.roll(q, -1, axis=1) - q
    d[3, -1] += 2 * np.pi
    off = d[2:] / chain.k - np.array([[0.3 - 0.2 * 0.5 + 0.1 * 0.75], [0.5 + 0.7 * 0.5 - 0.4 * 0.75]])
    change = sum(
        0.5 * chain.k * np.sum(np.asarray(stiff) * (after**2 - before**2))
        for stiff, after, before in zip((chain.torsion_stiffness, chain.bending_stiffness), off, d[2:] / chain.k, strict=True)
    )
    assert replace(problem, loads=loads).energy() == pytest.approx(problem.energy() + change, rel=1e-13)


def test_rest_stretch_and_shear_are_those_of_the_energy():
    """V against its formula, the force against differences of it, and energy over midpoint steps."""
    problem = uneven(6, Model("ring", "steered"))
    stretch, shear, psi = 0.1, np.linspace(-0.1, 0.2, 6), 0.7
    chain = problem.chain

    def energy(q):
        total = problem.system.potential(problem.system.shape(q))
        d = np.roll(q, -1, axis=1) - q
        d[3, -1] += 2 * np.pi
        line = (d[0] + 1j * d[1]) / chain.k * np.exp(-1j * (q[3] + 0.5 * d[3]))
        off = line - np.exp(-1j * psi) - stretch - 1j * shear
        for part, stiff in (((line - 1).real, -chain.stretch_stiffness), ((line - 1).imag, -chain.shear_stiffness)):
            total += 0.5 * chain.k * np.sum(stiff * part**2)
        return total + 0.5 * chain.k * np.sum(chain.stretch_stiffness * off.real**2 + chain.shear_stiffness * off.imag**2)

    own = replace(problem, loads=(Rest(stretch=stretch, shear=shear), Rest(mounting_angle=psi)))
    system, q, rng = own.system, own.start().hi, np.random.default_rng(2)
    assert system.potential(system.shape(q)) == pytest.approx(energy(q), rel=1e-13)
    move = rng.normal(size=q.shape)
    slope = (energy(q + 1e-5 * move) - energy(q - 1e-5 * move)) / 2e-5
    assert np.vdot(system.gradient(system.shape(q)), move) == pytest.approx(slope, rel=1e-8)
    run = simulate(own, Midpoint(tolerance=1e-14), 0.01, 4, progress=False)
    assert abs(run.energy - run.energy[0]).max() < 1e-11 * run.energy[0]
    assert (run.stats["engine"], own.conserves) == ("plain", True)


def test_a_snake_with_wheels_along_its_line_rolls_along_it():
    psi = np.pi / 2
    problem = lump(steered_rod(mounting_angle=psi, twist=0.0, radius=0.7), 6)
    problem = replace(problem, initial=replace(problem.initial, omega=1.3 * np.ones(6)))
    run = simulate(problem, "midpoint", 0.05, 3, progress=False)
    np.testing.assert_allclose(run.x, problem.chain.s - 0.7 * 1.3 * run.t[:, None], atol=1e-12)
    np.testing.assert_allclose(run.y, 0, atol=1e-12)
    np.testing.assert_allclose(run.phi, psi, atol=1e-12)


@pytest.mark.slow
def test_a_driven_rest_shape_does_the_work_of_its_links():
    """-int S (a - e) e' dt over the motion, by quadrature of fine frames."""
    problem = replace(uneven(7, KINDS[0]), loads=(Rest(twist=0.7, signal=signals.sine(1.0, 5.0)),))
    run = simulate(problem, "gauss6", 0.02, 1001, progress=False, engine="plain")
    chain, rest = problem.chain, 0.7 * np.sin(5 * run.t)
    moment = np.asarray(chain.torsion_stiffness) * (np.diff(run.theta) / chain.k - rest[:, None])
    power = -chain.k * moment.sum(axis=1) * 0.7 * 5 * np.cos(5 * run.t)
    np.testing.assert_allclose(run.work, cumulative_simpson(power, x=run.t, initial=0), atol=1e-6)
    assert abs(run.work).max() > 0.1


def test_an_actuator_works_for_its_dampers():
    """R = 0, rest twist a sin(p s) sin(rate t): theta = Im(A e^{i rate t}) cos(p s) in the steady state, p = pi/length.

    With t = 4 sin^2(p k/2)/k^2 the actuator turns discs by -beta a sqrt(t), and
    (beta t + i rate (c + eta t) - alpha rate^2) A = -beta a sqrt(t). In a period it does the work that the dampers take,
    pi rate |A|^2 (c + eta t) length/2.
    """
    c, eta, a, rate, n = 0.3, 0.2, 0.4, 1.7, 9
    chain = one_row((), n, torsion_stiffness=0.9, radius=0.0).chain
    p = np.pi / chain.length
    t = 4 * np.sin(p * chain.k / 2) ** 2 / chain.k**2
    wave = np.cos(p * chain.s)
    size = -0.9 * a * np.sqrt(t) / (0.9 * t + 1j * rate * (c + eta * t) - 0.6 * rate**2)
    loads = Rest(twist=lambda s: a * np.sin(p * s), signal=signals.sine(1.0, rate)), Damping(rolling=c, torsion=eta)
    start = State(chain.s, 0 * wave, size.imag * wave, rate * size.real * wave)
    run = simulate(Problem(chain, start, 2 * np.pi / rate, loads), "gauss8", 0.05, 5, progress=False, engine="plain")
    np.testing.assert_allclose(run.theta, np.outer((size * np.exp(1j * rate * run.t)).imag, wave), atol=1e-10)
    taken = np.pi * rate * abs(size) ** 2 * (c + eta * t) * chain.length / 2
    assert [run.work[-1], run.dissipated[-1]] == pytest.approx([taken, taken], rel=1e-8)


def test_a_potential_of_ones_own_is_part_of_the_energy():
    well = Potential(lambda x, y: 0.2 * y**2 + 0.1 * x**4, lambda x, y: (0.4 * x**3, 0.4 * y))
    problem = replace(uneven(5, KINDS[0]), loads=(well,))
    run = simulate(problem, "rk4", 0.002, 5, progress=False)
    assert abs(run.energy - problem.energy()).max() < 1e-9
    assert run.stats["engine"] == "plain"
    same = replace(problem, loads=(Potential(lambda x, y: 0.2 * y**2, lambda x, y: (0 * x, 0.4 * y)),))
    spring = replace(problem, loads=(along_y(0.4, problem),))
    one, other = (simulate(p, "midpoint", 0.02, 2, progress=False, engine="plain") for p in (same, spring))
    np.testing.assert_allclose(one.y, other.y, atol=1e-11)


def along_y(stiffness: float, problem: Problem):
    return Linear(stiffness=np.outer([0, stiffness, 0], problem.chain.w))


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["compiled", longer("plain")])
def test_the_balance_stays_exact_over_many_steps(engine, kernels_as_python):
    problem = uneven(4, Model("consistent", "field"))
    problem = replace(problem, loads=every(problem))
    run = simulate(replace(problem, duration=16.0), Midpoint(tolerance=1e-15, sweeps=30), 0.02, 21, progress=False, engine=engine)
    largest = max(abs(part).max() for part in (run.energy, run.work, run.dissipated))
    assert abs(run.energy - run.energy[0] - run.work + run.dissipated).max() < 1e-13 * largest
