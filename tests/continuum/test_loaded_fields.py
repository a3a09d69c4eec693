"""Loads of a scene in the field's solver: closed forms, linear waves, the balance of energy, signals, both engines, messages."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline

from continuum import Rod, Scene, breathing_ring, solve, untwisting_rod
from continuum.balance import balances
from continuum.dispersion import response
from continuum.spectral import Runner
from discs import load
from discs.loads import Damping, Force, Rest, Slope, Spring, Torque, signals

UNEVEN = {"density": 1.3, "spin_inertia": 0.6, "torsion_stiffness": 0.9, "bending_stiffness": 0.5, "radius": 0.8, "length": 3.0}
ROD = Rod(**UNEVEN)
M = ROD.inertia
SMOOTH = signals.smooth(0.0, 1.0)
EVERYTHING = (
    Torque(0.3, signals.sine(1.0, 2.0), at=0.0),
    Torque(lambda s: 0.2 * (s > 1.3), signals.pulse(0.4, 0.05)),
    Force(x=lambda s: 0.1 * s, y=0.2, signal=SMOOTH),
    Damping(rolling=0.1, torsion=lambda s: 0.02 * (1 + s), bending=lambda s: 0.05 * s),
    Slope(gx=0.1, gy=-0.2),
    Spring(lambda s: s, 0.1, 0.3),
    Spring(0.0, 0.0, 0.4, at=3.0),
    Rest(twist=lambda s: 0.2 * s, curvature=0.2, signal=SMOOTH),
    Rest(twist=0.1, curvature=lambda s: 0.2 * np.sin(np.pi * s / 3) ** 4),  # the straight rod fits it at the ends
)


def straight(duration, *loads, theta=lambda s: 0 * s, omega=0.0, rolling="field", rod=ROD, closed=False):
    """A straight rod along x, rolled by theta: y = R theta."""

    def initial(s):
        roll = theta(s)
        return s, rod.radius * roll, roll, omega(s) if callable(omega) else omega + 0 * s

    shift = (rod.length, 0.0) if closed else (0.0, 0.0)
    return Scene(rod=rod, initial=initial, duration=duration, rolling=rolling, closed=closed, shift=shift, loads=loads)


def field(scene, tol=1e-9, frames=9):
    return solve(scene, tol, frames=frames, progress=False)


@pytest.fixture(params=["field", "unit"])
def rolling(request):
    return request.param


def test_a_rod_rolls_down_a_slope(rolling):
    """Without twist, M omega. = rho R g_y - c omega; the slope along the rod does nothing. The energy has the slope's potential."""
    g, c = 0.4, 0.3
    run = field(straight(2.0, Slope(gx=0.7, gy=g), omega=0.2, rolling=rolling))
    theta = 0.2 * run.t + ROD.density * ROD.radius * g / M * run.t**2 / 2
    assert np.abs(run.theta - theta[:, None]).max() < 1e-9
    assert np.abs(run.y - ROD.radius * theta[:, None]).max() < 1e-9
    start = ROD.length * M * 0.2**2 / 2 - ROD.density * 0.7 * ROD.length**2 / 2
    assert run.energy == pytest.approx(start, rel=1e-9)
    assert not run.work.any()
    damped = field(straight(2.0, Slope(gy=g), Damping(rolling=lambda s: c + 0 * s), rolling=rolling))
    speed = ROD.density * ROD.radius * g / c * (1 - np.exp(-c * damped.t / M))
    assert np.abs(damped.omega - speed[:, None]).max() < 1e-8


@pytest.mark.parametrize("c", [0.5, 30.0, 1e4])
def test_a_damper_stops_the_roll_exponentially(c):
    """However stiff, at few steps: theta = omega_0 M/c (1 - e^{-ct/M}), and all of the energy is dissipated."""
    run = field(straight(2.0, Damping(rolling=c), omega=1.5), 1e-8)
    assert np.abs(run.theta - 1.5 * M / c * (1 - np.exp(-c * run.t / M))[:, None]).max() < 1e-8
    lost = ROD.length * M * 1.5**2 / 2 * (1 - np.exp(-2 * c * run.t / M))
    assert np.abs(run.dissipated - lost).max() < 1e-6 * lost[-1]
    assert run.stats["steps"] < 300


def test_a_twist_relaxes_to_its_rest_by_viscosity():
    """R = 0: with tau_0 = a q sin(q s) theta is -A cos(q s), alpha A.. + (c + eta q^2) A. + beta q^2 (A - a) = 0."""
    rod, a, eta, c = Rod(**UNEVEN | {"radius": 0.0}), 0.7, 1.3, 0.2
    q = np.pi / rod.length
    run = field(straight(6.0, Rest(twist=lambda s: a * q * np.sin(q * s)), Damping(rolling=c, torsion=eta), rod=rod))
    p, o = (c + eta * q**2) / rod.spin_inertia / 2, rod.torsion_stiffness * q**2 / rod.spin_inertia
    low, high = np.roots([1, 2 * p, o])
    amplitude = a * (1 - (high * np.exp(low * run.t) - low * np.exp(high * run.t)) / (high - low))
    assert np.abs(run.theta + np.outer(amplitude, np.cos(q * run.s))).max() < 1e-9
    assert abs(amplitude[-1] - a) < 0.2 * a
    assert run.energy[0] == pytest.approx(rod.torsion_stiffness * (a * q) ** 2 * rod.length / 4, rel=1e-12)


def waves(rate, c, eta):
    """The wave numbers of e^{k s + i rate t}, two roots k and their opposites."""
    stiff = ROD.bending_stiffness * ROD.radius**2
    squares = np.roots([stiff, -(ROD.torsion_stiffness + 1j * rate * eta), 1j * rate * c - M * rate**2])
    k = np.sqrt(squares.astype(complex))
    return np.concatenate([k, -k])


@pytest.mark.slow
def test_a_driven_end_responds_as_linear_waves():
    """A small torque tau e^{i rate t} at s = 0, resistance and viscosity, in the steady state: amplitude and phase to 1e-6.

    With y = R theta: theta'' = 0 at both ends and (beta + i rate eta) theta' - K R^2 theta''' = -tau at s = 0, 0 at s = length.
    """
    rate, c, eta, tau = 1.7, 0.3, 0.2, 4e-4
    k = waves(rate, c, eta)
    ends = np.exp(np.outer([0.0, ROD.length], k))
    force = (ROD.torsion_stiffness + 1j * rate * eta) * k - ROD.bending_stiffness * ROD.radius**2 * k**3
    matrix = np.concatenate([k**2 * ends, force * ends])
    parts = np.linalg.solve(matrix, [0, 0, -tau, 0])

    def steady(s, t=0.0):
        return (np.exp(np.outer(s, k)) @ parts) * np.exp(1j * rate * t)

    loads = Torque(tau, signals.sine(1.0, rate, np.pi / 2), at=0.0), Damping(rolling=c, torsion=eta)
    period = 2 * np.pi / rate
    run = field(
        straight(period, *loads, theta=lambda s: steady(s).real, omega=lambda s: (1j * rate * steady(s)).real), 1e-10, frames=9
    )
    turns = np.exp(1j * rate * run.t[:-1])
    found = 2 * np.mean(run.theta[:-1] * turns.conj()[:, None], axis=0)
    assert np.abs(found / steady(run.s) - 1).max() < 1e-6
    assert run.work[-1] == pytest.approx(run.dissipated[-1], rel=1e-5)  # in a period


@pytest.mark.slow
def test_a_torque_along_the_rod_responds_as_the_dispersion_relation_says():
    rate, c, eta, tau, q = 1.7, 0.3, 0.2, 3e-4, 2 * np.pi / ROD.length
    amplitude = tau * response(ROD, q, rate, c, eta)
    loads = Torque(lambda s: tau * np.cos(q * s), lambda t: np.cos(rate * t)), Damping(rolling=c, torsion=eta)
    scene = straight(
        2 * np.pi / rate,
        *loads,
        theta=lambda s: amplitude.real * np.cos(q * s),
        omega=lambda s: (1j * rate * amplitude).real * np.cos(q * s),
        closed=True,
    )
    run = field(scene, 1e-10)
    found = 4 * np.mean(run.theta[:-1] * np.exp(-1j * rate * run.t[:-1])[:, None] * np.cos(q * run.s))
    assert abs(found / amplitude - 1) < 1e-6


@pytest.mark.parametrize(
    ("signal", "area"),
    [
        (signals.pulse(1.234, 1e-6), 1e-6),
        (lambda t: np.exp(-(((t - 1.234) / 0.003) ** 2)), 0.003 * np.sqrt(np.pi)),
        (lambda t: 1.0 * (t > 1.234), 5.0 - 1.234),
        (signals.table([0.0, 1.0, 1.01, 1.02], [0.0, 0.0, 3.0, 0.0]), 0.03),
    ],
    ids=["pulse", "narrow", "jump", "table"],
)
def test_steps_do_not_jump_over_a_signal(signal, area):
    """A uniform torque: omega = tau/M times the integral of the signal, which a step of any usual length would not see."""
    run = field(straight(5.0, Torque(0.5, signal), rolling="unit"), 1e-6)
    assert run.omega[-1] == pytest.approx(0.5 * area / M, rel=1e-6)
    assert run.stats["steps"] < 80


@pytest.mark.slow
def test_a_free_end_has_its_rest_curvature_and_a_known_stretch(rolling):
    """At both ends: |r'| = exp(-R kappa_0 dtheta) by the field law, 1 - R kappa_0 dtheta by the unit law, from a rod on an arc."""
    kappa = 0.4

    def initial(s):
        return np.sin(kappa * s) / kappa, (1 - np.cos(kappa * s)) / kappa, -0.9 * np.cos(np.pi * s / ROD.length), 0 * s

    run = field(Scene(rod=ROD, initial=initial, duration=1.5, rolling=rolling, loads=(Rest(curvature=kappa),)), 1e-8, 3)
    line = CubicSpline(run.s, run.x[-1] + 1j * run.y[-1])
    turned = ROD.radius * kappa * (run.theta[-1] - run.theta[0])[[0, -1]]
    z, bend = line(run.s[[0, -1]], 1), line(run.s[[0, -1]], 2)
    assert np.abs(z) == pytest.approx(np.exp(-turned) if rolling == "field" else 1 - turned, abs=2e-6)
    assert (z.conj() * bend).imag / np.abs(z) ** 2 == pytest.approx(kappa, abs=1e-3)
    assert np.abs(turned).min() > 0.2
    assert np.abs(run.energy - run.energy[0]).max() < 1e-10


@pytest.mark.parametrize("eta", [0.1, 20.0])
@pytest.mark.slow
def test_viscosity_damps_bending_waves_like_an_oscillator(eta):
    """y = R theta: M theta.. = -(beta q^2 + K R^2 q^4) theta - eta R^2 q^4 theta.; strong too, at few steps."""
    q, small = 2 * np.pi / ROD.length, 1e-5
    run = field(straight(2.0, Damping(bending=eta), theta=lambda s: small * np.cos(q * s), closed=True), 1e-10)
    stiff = ROD.torsion_stiffness * q**2 + ROD.bending_stiffness * ROD.radius**2 * q**4
    low, high = np.roots([M, eta * ROD.radius**2 * q**4, stiff]).astype(complex)
    swing = (high * np.exp(low * run.t) - low * np.exp(high * run.t)) / (high - low)
    assert np.abs(run.theta / small - np.outer(swing.real, np.cos(q * run.s))).max() < 1e-4
    assert run.stats["steps"] < 200


@pytest.mark.slow
def test_viscosity_keeps_the_curvature_and_the_slope_of_free_ends(rolling):
    """And a ring that turns and breathes dissipates by breathing only: kappa = a^2/a_0^3, int eta kappa.^2 = l eta kappa.^2."""
    run = field(replace(untwisting_rod(rolling, **UNEVEN, duration=1.5), loads=(Damping(bending=0.3),)), 1e-8, 3)
    line = CubicSpline(run.s, run.x[-1] + 1j * run.y[-1])
    z, bend = line(run.s[[0, -1]], 1), line(run.s[[0, -1]], 2)
    assert np.abs(z) == pytest.approx(1.0, abs=1e-6)
    assert np.abs((z.conj() * bend).imag).max() < 1e-3 * np.abs(bend).max()
    assert run.dissipated[-1] > 1e-3 * run.energy[0]
    ring = field(replace(breathing_ring(rolling, duration=0.4), loads=(Damping(bending=0.2),)), 1e-8, 101)
    a = np.hypot(ring.x[:, 0], ring.y[:, 0])
    rate = np.gradient(a**2 / a[0] ** 3, ring.t, edge_order=2)
    lost = 2 * np.pi * a[0] * 0.2 * cumulative_simpson(rate**2, x=ring.t, initial=0)
    assert np.abs(ring.dissipated - lost).max() < 1e-3 * lost[-1]


@pytest.mark.slow
def test_a_rod_on_the_arc_of_its_rest_curvature_stays_there(rolling):
    """Closed too, a ring of its own radius; both without energy."""
    a = ROD.length / (2 * np.pi)

    def ring(s):
        return a * np.cos(s / a), a * np.sin(s / a), 0 * s, 0 * s

    scene = Scene(rod=ROD, initial=ring, duration=1.0, rolling=rolling, closed=True, loads=(Rest(curvature=1 / a),))
    for given in (scene, replace(scene, closed=False)):
        run = field(given, 1e-8)
        assert np.abs(run.x - run.x[0]).max() < 1e-8
        assert np.abs(run.theta).max() < 1e-8
        assert np.abs(run.energy).max() < 1e-8  # of 3.3: second derivatives of the initial fields lose digits


@pytest.mark.parametrize("compiled", [True, False])
def test_energy_is_balanced(rolling, compiled):
    """All loads at once, at the ends of steps to the tolerance of sweeps; and the two engines agree."""
    scene = replace(untwisting_rod(rolling, **UNEVEN, duration=1.0), loads=EVERYTHING)
    run = Runner(scene, np.array([0.0, 0.4, 0.45, 1.0]), 4, compiled).run(19, 1e-4)
    energy = np.concatenate(
        [run.rod.energies(z, t) for z, t in zip(run.states, np.array([[0.0], [0.4], [0.45], [1.0]]), strict=True)]
    )
    off = energy - energy[0] - run.balance[:, 0] + run.balance[:, 1]
    assert np.abs(off).max() < 1e-8
    assert np.abs(run.balance[-1]).min() > 1e-3
    assert energy[0] == pytest.approx(run.rod.start_energy, rel=1e-12)
    other = Runner(scene, np.array([1.0]), 4, not compiled).run(19, 1e-4)
    for name, value in other.fields.items():
        np.testing.assert_allclose(run.fields[name][-1], value[-1], atol=1e-6)


def test_the_energy_at_the_start_has_that_of_the_loads():
    """By a sum over many places: slope, springs and rest twist of a bent and twisted rod."""
    run = Runner(replace(untwisting_rod(**UNEVEN, duration=1.0), loads=EVERYTHING), np.array([0.0]), 4).run(19, 1e-4)
    s = np.linspace(0, 3, 200_001)
    slope = np.pi**2 / 6 * np.sin(np.pi * s / 3)  # theta' of theta = -pi/2 cos(pi s/3)
    density = 0.25 * (0.2 * np.sin(np.pi * s / 3) ** 4) ** 2 + 0.45 * (slope - 0.1) ** 2 - 1.3 * 0.1 * s + 0.15 * 0.1**2
    assert run.rod.start_energy == pytest.approx(np.trapezoid(density, s) + 0.2 * 9, rel=1e-9)


@pytest.mark.slow  # kernels of chains
def test_chains_of_discs_agree_with_all_loads(rolling):
    """An independent discretisation, second-order differences extrapolated, within the sum of both estimates."""
    loads = (Torque(0.3, SMOOTH, at=0.0), *EVERYTHING[2:])
    scene = replace(untwisting_rod(rolling, **UNEVEN, duration=1.5), loads=loads)
    a, b = (solve(scene, 1e-4, method, frames=4, progress=False) for method in ("spectral", "richardson"))
    for name in ("x", "y", "theta"):
        here, there = (getattr(run, name)[:, :: (run.s.size - 1) // 32] for run in (a, b))
        gap = np.abs(here - there).max()
        assert gap <= a.error_estimate[name] + b.error_estimate[name], (name, gap)
    for name in ("work", "dissipated", "energy"):
        assert np.abs(getattr(a, name) - getattr(b, name)).max() < 1e-4


def test_a_scene_without_loads_computes_none():
    scene = untwisting_rod(duration=0.5)
    rod = Runner(scene, np.array([0.5]), 4).run(15, 1e-3).rod
    assert rod.loads is None
    assert not any(part.size for part in rod.parameters.load)
    free, idle = solve(scene, 1e-4, progress=False), solve(replace(scene, loads=(Torque(0.0),)), 1e-4, progress=False)
    np.testing.assert_allclose(idle.theta, free.theta, atol=1e-9)
    assert free.balance is None
    assert not idle.work.any()


def test_loaded_fields_are_saved_and_have_no_balances(tmp_path):
    """The conservation laws are those of a rod without loads; a file keeps work and dissipation."""
    scene = replace(untwisting_rod(duration=0.5), loads=(Torque(0.1, SMOOTH), Damping(rolling=0.2)))
    run = solve(scene, 1e-3, progress=False)
    with pytest.raises(ValueError, match="balances are those of a rod without loads"):
        balances(scene.rod, run, scene.rolling)
    run.save(tmp_path / "loaded.nc")
    np.testing.assert_array_equal(load(tmp_path / "loaded.nc").dissipated, run.dissipated)


@pytest.mark.slow
def test_a_ring_with_a_torque_stays_round(rolling):
    """A uniform torque and resistance on a ring: the work is that of the torque, and no wave grows."""
    scene = replace(breathing_ring(rolling, duration=0.3, radius=0.7), loads=(Torque(0.5), Damping(rolling=0.2)))
    run = field(scene, 1e-8)
    assert np.ptp(run.theta, axis=1).max() < 1e-9
    assert run.work == pytest.approx(0.5 * scene.rod.length * run.theta[:, 0], abs=1e-8)
