"""Rest curvature and bending viscosity of discs whose headings follow the line: exact facts of the ends, closed forms, balances."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from discs import Chain, Midpoint, Problem, State, Suzuki4, simulate
from discs.loads import Custom, Damping, Rest, signals
from tests.conftest import SLAVED, TRUE, Model, models, uneven

UNEVEN = {"length": 3.0, "density": 1.3, "spin_inertia": 0.6, "torsion_stiffness": 0.9, "bending_stiffness": 0.5, "radius": 0.8}


def bent(n: int, rolling: str, curvature: float, duration: float = 1.5, *loads) -> Problem:
    """A twisted rod on an arc of its rest curvature, so that the conditions at its free ends hold at the start."""
    chain = Chain(n=n, rolling=rolling, ends="consistent", **UNEVEN)
    turn = curvature * chain.s
    state = State(np.sin(turn) / curvature, (1 - np.cos(turn)) / curvature, -0.9 * np.cos(np.pi * chain.s / 3.0))
    return Problem(chain, state, duration, (Rest(curvature=curvature), *loads))


def test_a_free_end_has_its_rest_curvature_and_a_known_stretch(rolling):
    """|r'| = exp(-R kappa_0 dtheta) by the field law, 1 - R kappa_0 dtheta by the unit law; order 2 in the spacing."""
    off = []
    for n in (65, 129):
        run = simulate(bent(n, rolling, 0.4), Suzuki4(Midpoint(tolerance=1e-11)), 0.025, 2, ("slope",), False)
        z, r = run.slope_x[-1] + 1j * run.slope_y[-1], run.x[-1] + 1j * run.y[-1]
        bend = (2 * r[0] - 5 * r[1] + 4 * r[2] - r[3]) / run.problem.chain.k**2
        turned = 0.8 * 0.4 * (run.theta[-1, 0] - run.theta[0, 0])
        expected = np.exp(-turned) if rolling == "field" else 1 - turned
        off.append([abs(z[0]) - expected, (z[0].conjugate() * bend).imag / abs(z[0]) ** 2 - 0.4])
        assert abs(expected - 1) > 0.15
        assert np.ptp(run.energy) < 1e-12 * run.energy[0]
    assert np.abs(off[1]).max() < 2e-3
    assert (np.abs(off[0]) > 3 * np.abs(off[1])).all()


@models(SLAVED + TRUE)
def test_a_bent_rod_that_turns_dissipates_nothing(model):
    """Turning about any point, and shifted; bending it does. (A viscosity on r''. would take its part of a turn.)"""
    problem = replace(uneven(7, model), loads=(Damping(bending=0.3),))
    q, rng = problem.start().hi, np.random.default_rng(3)
    bending = problem.system.load.power(0.0, q, rng.normal(size=q.shape))[1]
    turning = np.array([0.4 - q[1], q[0] - 0.9, q[0]])
    assert problem.system.load.power(0.0, q, turning)[1] < 1e-28 * bending
    assert bending > 0.1


def test_a_straight_closed_rod_is_bent_by_its_rest_curvature_alike_everywhere(rolling):
    """K kappa_0^2 / 2 for each length, at the seam too, and no force across the rod."""
    chain = Chain(n=12, rolling=rolling, ends="ring", shift=(3.0, 0.0), **UNEVEN)
    problem = Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), 1.0, (Rest(curvature=0.7),))
    assert problem.energy() == pytest.approx(0.5 * 0.5 * 0.7**2 * 3.0)
    force = problem.system.load.force(0.0, problem.start().hi, np.zeros((3, 12)))
    np.testing.assert_allclose(force[1], 0.0, atol=1e-12)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:suzuki4. its substeps back in time amplify")  # short waves, which are not excited
@pytest.mark.long
def test_viscosity_damps_bending_waves_like_an_oscillator():
    """A straight periodic rod, y = R theta: M theta.. = -(beta t + K R^2 t^2) theta - eta R^2 t^2 theta., t = 4 sin^2(q k/2)/k^2.

    Strong viscosity does not limit the step.
    """
    for eta, dt in ((0.05, 0.002), (20.0, 0.01)):
        chain = Chain(n=12, rolling="unit", ends="ring", shift=(3.0, 0.0), **UNEVEN)
        start = np.cos(2 * np.pi * chain.s / 3.0)
        problem = Problem(chain, State(chain.s, 0.8e-6 * start, 1e-6 * start), 0.5, (Damping(bending=eta),))
        t = 4 * np.sin(np.pi * chain.k / 3.0) ** 2 / chain.k**2
        first, second = np.roots([0.6 + 1.3 * 0.64, eta * 0.64 * t**2, 0.9 * t + 0.5 * 0.64 * t**2]).astype(complex)
        run = simulate(problem, Suzuki4(Midpoint(tolerance=1e-15)), dt, 5, progress=False, engine="plain")
        swing = (second * np.exp(first * run.t) - first * np.exp(second * run.t)) / (second - first)
        np.testing.assert_allclose(1e6 * run.theta, np.outer(swing.real, start), atol=1e-5)
        assert abs(swing[-1].real) < 0.985


def curvature_energy(problem: Problem, q, rest) -> float:
    """Energy of torsion and of K/2 |r'' - rest J r'|^2 on a ring, from its formula."""
    chain, r = problem.chain, q[0] + 1j * q[1]
    ahead, behind = np.roll(r, -1), np.roll(r, 1)
    off = (ahead - 2 * r + behind) / chain.k**2 - 1j * rest * (ahead - behind) / (2 * chain.k)
    twist = (np.roll(q[2], -1) - q[2]) / chain.k
    return 0.5 * chain.k * float(np.sum(chain.bending_stiffness * np.abs(off) ** 2 + chain.torsion_stiffness * twist**2))


@pytest.mark.slow
def test_rest_curvatures_add_up_and_drivers_do_the_work_of_the_bends():
    """Energy from its formula, also beside a load in NumPy; and -int m . J r' kappa_0. over the motion, by quadrature of frames."""
    problem = uneven(7, Model("ring", "field"))
    loads = (Rest(curvature=0.5), Rest(curvature=lambda s: 0.3 * s, signal=signals.sine(1.0, 4.0)), Custom(lambda t, q, v: 0 * q))
    problem = replace(problem, loads=loads)
    run = simulate(problem, "gauss6", 0.05, 401, ("velocity",), progress=False)
    rest = 0.5 + 0.3 * problem.chain.s * np.sin(4 * run.t)[:, None]
    q = np.stack([run.x, run.y, run.theta], axis=1)
    kinetic = [problem.system.kinetic(v) for v in np.stack([run.x_rate, run.y_rate, run.omega], axis=1)]
    energy = [curvature_energy(problem, place, kappa) for place, kappa in zip(q, rest, strict=True)]
    np.testing.assert_allclose(run.energy, np.add(kinetic, energy), rtol=1e-12)
    step = 1e-5  # of the rest curvature
    change = [
        curvature_energy(problem, place, kappa + step * now) - curvature_energy(problem, place, kappa - step * now)
        for place, kappa, now in zip(q, rest, 0.3 * problem.chain.s * 4 * np.cos(4 * run.t)[:, None], strict=True)
    ]
    np.testing.assert_allclose(run.work, cumulative_simpson(np.array(change) / (2 * step), x=run.t, initial=0), atol=1e-6)
    assert abs(run.work).max() > 0.1
    assert abs(run.energy - run.energy[0] - run.work).max() < 1e-12


@models(TRUE)
def test_the_true_curvature_takes_a_constant_rest_value(model):
    """Its force is minus the gradient of K/2 (kappa - kappa_0)^2, kappa by angles of links; midpoint steps keep the energy."""
    problem = uneven(7, model)
    chain, ring = problem.chain, model.ends == "ring"
    rest = np.linspace(-0.4, 0.6, chain.bend_shares.size)
    loaded = replace(problem, loads=(Rest(curvature=rest),))
    q, move = problem.start().hi, np.random.default_rng(2).normal(size=(3, 7))

    def gain(q):
        """Energy by the rest value: K w (kappa_0^2/2 - kappa_0 kappa)."""
        link = np.diff(q[0] + 1j * q[1], append=q[0, :1] + 1j * q[1, :1] if ring else [])
        turn = np.angle(link / np.roll(link, 1)) if ring else np.angle(link[1:] / link[:-1])
        return float(chain.bending_stiffness * chain.bend_shares @ (rest**2 / 2 - rest * turn / chain.k))

    assert loaded.energy() == pytest.approx(problem.energy() + gain(q), rel=1e-13)
    pull = loaded.system.gradient(loaded.system.shape(q)) - problem.system.gradient(problem.system.shape(q))
    assert np.vdot(pull, move) == pytest.approx((gain(q + 1e-6 * move) - gain(q - 1e-6 * move)) / 2e-6, rel=1e-7)
    run = simulate(loaded, Midpoint(tolerance=1e-14), 0.01, 4, progress=False)
    assert abs(run.energy - run.energy[0]).max() < 1e-11 * abs(run.energy[0])
    with pytest.raises(ValueError, match="curvature takes no signal on a chain with curvature='true'"):
        replace(problem, loads=(Rest(curvature=0.3, signal=signals.ramp(0, 1)),))


def test_viscosity_of_the_true_curvature_is_that_of_the_turn():
    """What it dissipates, against differences of the angles of links in time."""
    problem = replace(uneven(7, Model("springs", "true")), loads=(Damping(bending=lambda s: 0.1 + 0.2 * s),))
    chain, q, v = problem.chain, problem.start().hi, np.random.default_rng(4).normal(size=(3, 7))
    turns = [np.diff(np.angle(np.diff(p[0] + 1j * p[1]))) / chain.k for p in (q - 1e-6 * v, q + 1e-6 * v)]
    lost = chain.k * np.sum((0.1 + 0.2 * chain.s[1:-1]) * ((turns[1] - turns[0]) / 2e-6) ** 2)
    assert problem.system.load.power(0.0, q, v) == (0.0, pytest.approx(lost, rel=1e-8))
    run = simulate(problem, Midpoint(tolerance=1e-14), 0.01, 4, progress=False)
    assert abs(run.energy - run.energy[0] + run.dissipated).max() < 1e-11 * run.energy[0]
    assert run.dissipated[-1] > 1e-3 * run.energy[0]
