"""Loads on fields of rods with headings of their own: chains of discs, closed forms, the balance of energy, messages."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import SteeredRod, solve, steered_rod
from discs import simulate
from discs.loads import Custom, Damping, Force, Motor, Rest, Slope, Spring, Torque, signals
from tests.conftest import longer

UNEVEN = {"density": 1.3, "spin_inertia": 0.6, "torsion_stiffness": 0.9, "bending_stiffness": 0.8, "radius": 0.7, "length": 3.2}
SMOOTH = signals.smooth(0.0, 1.0)
NAMES = ("x", "y", "theta", "phi")


def bent(*loads, duration=1.5, **options):
    return replace(steered_rod(9.0, 7.0, 0.3, **UNEVEN | options, duration=duration), loads=loads)


def ring(*loads):
    a0 = 3.2 / (2 * np.pi)

    def initial(s):
        angle = s / a0
        return a0 * np.cos(angle), a0 * np.sin(angle), 0 * s, 0.3 + 0 * s, angle + np.pi / 2, 0 * s

    return replace(bent(*loads), initial=initial, closed=True, turns=1)


def wavy(*loads):
    """A closed wavy line along x, where the springs of its seam pull across it."""

    def initial(s):
        a = 2 * np.pi * s / 3.2
        return s, 0.3 * np.sin(a), 0 * s, 0.2 + 0 * s, np.arctan(0.6 * np.pi / 3.2 * np.cos(a)), 0 * s

    return replace(bent(*loads), initial=initial, closed=True, shift=(3.2, 0.0))


def field(scene, tol=1e-7, frames=3):
    return solve(scene, tol, frames=frames, progress=False)


CASES = {
    "along": bent(
        Torque(lambda s: 0.3 * np.cos(s), signals.sine(1.0, 2.0)),
        Torque(0.2, SMOOTH, about="turn"),
        Force(x=0.2, y=lambda s: 0.1 * s, signal=SMOOTH),
        Slope(0.2, -0.3),
        Spring(lambda s: s, 0.1, 0.5),
        Damping(rolling=0.2, turning=0.3, torsion=0.1, bending=lambda s: 0.2 + 0.1 * s),
    ),
    "points": bent(
        Torque(0.4, SMOOTH, at=0.0),
        Torque(0.3, SMOOTH, at=3.2, about="turn"),
        Force(0.2, 0.1, SMOOTH, at=0.8),
        Spring(1.6, 0.0, 0.5, at=1.6),
        Torque(0.5, SMOOTH, at=2.4),
    ),
    "rest": bent(
        Rest(twist=lambda s: 0.2 * s, curvature=0.3, signal=SMOOTH),
        Rest(stretch=lambda s: 0.1 * np.sin(np.pi * s / 3.2) ** 4, shear=lambda s: 0.2 * np.sin(np.pi * s / 3.2) ** 4),
        Rest(curvature=lambda s: 0.3 * np.sin(np.pi * s / 3.2) ** 4, twist=lambda s: 0.4 * np.sin(np.pi * s / 3.2) ** 4),
    ),
    "motors": bent(
        Motor(lambda t: 0.5 * float(SMOOTH(t)), at=0.0),
        Motor(lambda t: 0.3 * float(SMOOTH(t)), at=3.2, about="turn"),
        Motor(0.0, at=2.0),
        twist=0.0,
    ),
    "wavy": wavy(Spring(lambda s: s, 0.1, 0.5), Spring(0.0, 0.0, 0.3, at=0.0), Slope(0.0, -0.2)),
    "ring": ring(Spring(0.2, 0.1, lambda s: 0.4 + 0.1 * np.cos(2 * np.pi * s / 3.2)), Torque(0.2, SMOOTH, at=0.8), Damping(0.1)),
}


@pytest.mark.slow  # kernels of chains
@pytest.mark.parametrize("case", [*map(longer, ("along", "points", "rest")), "motors", "wavy", "ring"])
def test_chains_converge_to_the_loaded_field(case):
    """Chains share only the equations: order 2, and extrapolated to a tenth of their error."""
    scene = CASES[case]
    truth, count = field(scene), 64 if scene.closed else 65
    every = slice(None, None, truth.s.size // 64)
    coarse, fine = (
        simulate(lump(scene, n), "gauss6", dt=0.03, frames=3, progress=False) for n in (count, 2 * count - (not scene.closed))
    )
    for name in NAMES:
        a, b, exact = getattr(coarse, name), getattr(fine, name), getattr(truth, name)[:, every]
        first, second = np.abs(a - exact).max(), np.abs(b[:, ::2] - exact).max()
        assert first / second == pytest.approx(4.0, abs=0.15), name
        assert np.abs(b[:, ::2] + (b[:, ::2] - a) / 3 - exact).max() < second / 10, name
    for name in ("work", "dissipated", "energy"):
        a, b, exact = (getattr(run, name) for run in (coarse, fine, truth))
        assert np.abs(b + (b - a) / 3 - exact).max() < 2e-4, name
    if truth.reaction is not None:
        assert np.abs(fine.reaction + (fine.reaction - coarse.reaction) / 3 - truth.reaction).max() < 1e-3
    off = truth.energy - truth.energy[0] - truth.work + truth.dissipated
    assert np.abs(off).max() < 1e-7


def plain(*loads, radius=0.8, duration=2.0, omega=0.0, phi_rate=0.0, theta=None, section=0.0):
    """A straight rod along x."""
    rod = SteeredRod(
        length=3.0, density=1.3, spin_inertia=0.6, torsion_stiffness=0.9, bending_stiffness=0.5, radius=radius,
        stretch_stiffness=section, shear_stiffness=section, heading_inertia=0.4,
    )  # fmt: skip

    def initial(s):
        roll = 0 * s if theta is None else theta(s)
        return s, 0 * s, roll, omega(s) if callable(omega) else omega + 0 * s, 0 * s, phi_rate + 0 * s

    return replace(steered_rod(), rod=rod, initial=initial, duration=duration, loads=loads)


def test_a_rod_rolls_down_a_slope():
    run = field(plain(Slope(0.7, 0.4), section=5.0), 1e-9)
    scene = plain()
    theta = 1.3 * 0.8 * 0.4 / scene.rod.inertia * run.t**2 / 2
    assert np.abs(run.theta - theta[:, None]).max() < 1e-9
    assert np.abs(run.y - 0.8 * theta[:, None]).max() < 1e-9
    assert run.energy == pytest.approx(-1.3 * 0.7 * 4.5, rel=1e-9)
    assert not run.work.any()


@pytest.mark.slow
@pytest.mark.parametrize("c", [0.5, 1e4])
def test_dampers_stop_roll_and_turn_exponentially(c):
    """However stiff; without stress the sections turn each by itself."""
    run = field(plain(Damping(rolling=c, turning=c), omega=1.5, phi_rate=0.7), 1e-6)
    inertia = plain().rod.inertia
    assert np.abs(run.theta - 1.5 * inertia / c * (1 - np.exp(-c * run.t / inertia))[:, None]).max() < 1e-6
    assert np.abs(run.phi - 0.7 * 0.4 / c * (1 - np.exp(-c * run.t / 0.4))[:, None]).max() < 1e-6
    kinetic = 3 * (inertia * 1.5**2 + 0.4 * 0.7**2) / 2
    left = inertia * (1.5 * np.exp(-2 * c / inertia)) ** 2 + 0.4 * (0.7 * np.exp(-2 * c / 0.4)) ** 2
    assert run.dissipated[-1] == pytest.approx(kinetic - 1.5 * left, rel=1e-6)
    assert np.abs(run.energy - run.energy[0] + run.dissipated).max() < 1e-6 * kinetic


@pytest.mark.parametrize("eta", [1.3, 1e3])
def test_twist_and_curvature_relax_to_rest_by_viscosity(eta):
    """R = A = G = 0: amplitudes a of cos(q s) obey I a.. + eta q^2 a. + S q^2 (a - a_0) = 0, for theta and phi alike."""
    a, q = 0.7, np.pi / 3
    shape = {"twist": lambda s: a * q * np.sin(q * s), "curvature": lambda s: 0.5 * a * q * np.sin(q * s)}
    run = field(plain(Rest(**shape), Damping(torsion=eta, bending=eta), radius=0.0, duration=4.0), 1e-6)
    for name, inertia, stiffness, size in (("theta", 0.6, 0.9, a), ("phi", 0.4, 0.5, 0.5 * a)):
        low, high = np.roots([1, eta * q**2 / inertia, stiffness * q**2 / inertia])
        amplitude = size * (1 - (high * np.exp(low * run.t) - low * np.exp(high * run.t)) / (high - low))
        assert np.abs(getattr(run, name) + np.outer(amplitude, np.cos(q * run.s))).max() < 1e-6


def test_a_driven_end_of_a_rod_that_only_twists():
    """R = 0, alpha theta.. = beta theta'': theta = cos(k (l - s))/cos(k l) sin(W t), and the motor's torque is -beta theta'."""
    rate = 2.0
    k = rate * np.sqrt(0.6 / 0.9)
    motor = Motor(lambda t: 0.3 * rate * np.cos(rate * t), at=0.0)

    def shape(s):
        return 0.3 * np.cos(k * (3 - s)) / np.cos(3 * k)

    run = field(plain(motor, radius=0.0, omega=lambda s: rate * shape(s)), 1e-8, frames=9)
    assert np.abs(run.theta - np.outer(np.sin(rate * run.t), shape(run.s))).max() < 1e-8
    torque = -0.9 * 0.3 * k * np.tan(3 * k) * np.sin(rate * run.t)
    assert np.abs(run.reaction[:, 0] - torque).max() < 1e-6
    work = -0.9 * 0.3**2 * k * np.tan(3 * k) * np.sin(rate * run.t) ** 2 / 2
    assert run.work == pytest.approx(work, abs=1e-7)
    assert run.energy - run.energy[0] == pytest.approx(run.work, abs=1e-9)


def test_mounted_axles_are_at_rest():
    scene = replace(steered_rod(mounting_angle=0.4, twist=0.0, duration=1.0), loads=(Rest(mounting_angle=0.4),))
    run = field(scene)
    assert np.abs(run.phi - 0.4).max() < 1e-9
    assert np.abs(run.x - run.s).max() < 1e-9
    assert run.energy == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("loads", "message"),
    [
        ((Custom(lambda t, q, v: q),), r"Custom: its force acts on each disc.*; give one per length, as .*per_length=True"),
        ((Motor(0.5, at=0.0),), r"Motor: its rate at t = 0 must be the initial omega at s = 0, 0; got 0\.5"),
        ((Motor(0.0, at=0.0), Motor(0.0, at=0.0)), r"Motor: s = 0 has two motors about the same axis"),
        ((Motor(signals.pulse(0.5, 0.1), at=0.0),), r"Motor: its rate jumps at t = 0\.5, which takes an infinite torque"),
        ((Motor(0.0, at=4.0),), r"at of a load must be on the rod, from 0 to 3; got 4"),
        ((Torque(1.0, about="side"),), r"about of Torque must be one of 'roll', 'turn'; got 'side'"),
        ((Damping(turning=-1.0),), r"turning of Damping must be .*at least 0"),
        ((Rest(shear=0.1, signal=SMOOTH),), r"Rest: stretch, shear and mounting angle take no signal"),
    ],
)
def test_loads_that_cannot_be_taken_are_refused(loads, message):
    with pytest.raises(ValueError, match=message):
        field(plain(*loads))


@pytest.mark.slow
@pytest.mark.long
def test_a_sudden_rest_shape_says_why_it_is_slow():
    """It violates the end condition at t = 0, and a front of phi' runs along the rod."""
    with pytest.raises(ValueError, match=r"errors fall slowly: .* start them smoothly, as by signals.smooth"):
        field(bent(Rest(curvature=0.3)), 1e-7)
