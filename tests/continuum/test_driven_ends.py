"""Motors at the ends of a rod with slaved headings, as a field: linear waves, chains of discs, end conditions."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import untwisting_rod
from continuum.spectral import Runner
from discs import simulate
from discs.loads import Damping, Motor, Torque
from tests.continuum.test_loaded_fields import ROD, SMOOTH, UNEVEN, field, straight, waves

pytestmark = pytest.mark.slow


@pytest.fixture(params=["field", "unit"])
def rolling(request):
    return request.param


def test_a_driven_end_moves_the_rod_as_linear_waves_do():
    """A motor with a small rate at s = 0: theta = A e^{i rate t} and theta'' = 0 there, free at the other end, to 1e-6.

    Its torque is that of the end: -((beta + i rate eta) theta' - K R^2 theta_sss).
    """
    rate, c, eta, size = 1.7, 0.3, 0.2, 1e-4
    k = waves(rate, c, eta)
    ends = np.exp(np.outer([0.0, ROD.length], k))
    force = (ROD.torsion_stiffness + 1j * rate * eta) * k - ROD.bending_stiffness * ROD.radius**2 * k**3
    matrix = np.stack([k**2 * ends[0], ends[0], k**2 * ends[1], force * ends[1]])
    parts = np.linalg.solve(matrix, [0, size, 0, 0])

    def steady(s):
        return np.exp(np.outer(s, k)) @ parts

    loads = Motor(lambda t: (1j * rate * size * np.exp(1j * rate * t)).real, at=0.0), Damping(rolling=c, torsion=eta)
    start = {"theta": lambda s: steady(s).real, "omega": lambda s: (1j * rate * steady(s)).real}
    run = field(straight(2 * np.pi / rate, *loads, **start), 1e-10, frames=9)
    turns = np.exp(1j * rate * run.t[:-1])
    found = 2 * np.mean(run.theta[:-1] * turns.conj()[:, None], axis=0)
    assert np.abs(found / steady(run.s) - 1).max() < 1e-6
    torque = 2 * np.mean(run.reaction[:-1, 0] * turns.conj())
    assert abs(torque / -(force @ parts) - 1) < 1e-4
    assert run.work[-1] == pytest.approx(run.dissipated[-1], rel=1e-4)  # in a period


def test_a_motor_rolls_the_rod_steadily_against_its_resistance(rolling):
    """theta = c rate (s^2/2 - length s)/beta + rate t on a straight line: the torque is c rate length."""
    c, rate = 0.4, 0.7

    def roll(s):
        return c * rate / ROD.torsion_stiffness * (0.5 * s**2 - ROD.length * s)

    scene = straight(1.0, Motor(rate, at=0.0), Damping(rolling=c), omega=rate, rolling=rolling)
    run = field(replace(scene, initial=lambda s: (s, 0 * s, roll(s), rate + 0 * s)))
    assert np.abs(run.theta - roll(run.s) - rate * run.t[:, None]).max() < 1e-8
    assert np.abs(run.y - ROD.radius * rate * run.t[:, None]).max() < 1e-8
    assert run.reaction == pytest.approx(c * rate * ROD.length, rel=1e-6)
    assert run.work == pytest.approx(c * rate**2 * ROD.length * run.t, abs=1e-7)


DRIVEN = Motor(lambda t: 0.8 * float(SMOOTH(t)), at=0.0), Motor(0.0, at=3.0), Damping(rolling=0.1, torsion=0.1), Torque(0.2, SMOOTH)


@pytest.mark.long
def test_chains_tend_to_the_field_with_a_driven_and_a_held_end(rolling):
    """Order 2, in the torques of both motors and in their work too."""
    scene = replace(untwisting_rod(rolling, **UNEVEN, twist=0.0, duration=1.5), loads=DRIVEN)
    run = field(scene, 1e-7, frames=4)
    coarse, fine = (simulate(lump(scene, n, "consistent"), "gauss6", 0.03, 4, progress=False, engine="plain") for n in (65, 129))
    for name in ("y", "theta", "reaction", "work"):
        a, b, exact = (getattr(one, name) for one in (coarse, fine, run))
        if name in ("y", "theta"):
            b, exact = b[:, ::2], exact[:, ::16]
        assert np.log2(np.abs(a - exact).max() / np.abs(b - exact).max()) == pytest.approx(2.0, abs=0.25), name
    assert np.abs(run.energy - run.energy[0] - run.work + run.dissipated).max() < 1e-6
    assert np.abs(run.theta[:, -1] - run.theta[0, -1]).max() < 1e-12
    assert run.omega[:, 0] == pytest.approx(0.8 * SMOOTH(run.t), abs=1e-7)  # on the polynomial of a step


@pytest.mark.parametrize("rolling", ["field", pytest.param("unit", marks=pytest.mark.long)])  # each has its kernel
def test_a_driven_end_is_not_bent_nor_stretched(rolling):
    """No curvature and |r'| = 1, as at a free end; the engines agree in rates, places and torques."""
    scene = replace(untwisting_rod(rolling, **UNEVEN, twist=0.0, duration=1.5), loads=DRIVEN)
    runs = [Runner(scene, np.array([0.7, 1.5]), 6, compiled).run(37, 1e-6) for compiled in (True, False)]
    for run in runs:
        assert np.abs(run.rod.slopes(run.states[-1])[..., [0, -1]]) == pytest.approx(1.0, abs=2e-5)
    np.testing.assert_allclose(runs[0].reaction, runs[1].reaction, atol=1e-6)
    for name, value in runs[0].fields.items():
        np.testing.assert_allclose(runs[1].fields[name], value, atol=1e-7)
