"""Steady motions along a parameter, against closed forms."""

import importlib
import time
from dataclasses import replace

import numpy as np
import pytest

from discs.analysis import modes, relative_equilibria
from discs.chains.twist import untwisting_chain
from discs.loads import Damping, Motor, Slope, Torque, signals
from tests.discs.test_modes import ring

pytestmark = pytest.mark.slow  # many steady motions

VALUES = [0.0, 0.2, 0.5]


@pytest.mark.parametrize("law", ["unit", "own"])
def test_a_damped_rod_on_steeper_and_steeper_slopes(law):
    branch = relative_equilibria(lambda g: ring(9, law, loads=(Slope(0.0, -g), Damping(rolling=0.8))), VALUES, count=6)
    rate = -np.array(VALUES) * 1.3 * 0.8 / 0.8
    for right, found in zip(rate, branch.modes, strict=True):
        np.testing.assert_allclose(found.problem.initial.omega, right, atol=1e-9)
        direct = modes(ring(9, law, right, found.problem.loads), count=6)
        # with own headings a motion of the family is found whose phi is not quite zero
        np.testing.assert_allclose(np.abs(found.rate), np.abs(direct.rate), rtol=1e-6 if law == "unit" else 1e-3)
    np.testing.assert_allclose(branch.drift[:, 1], rate * 0.8, atol=1e-9)
    assert (branch.growth < 0).all()


def test_by_the_field_law_a_rolling_rod_loses_its_stability():
    branch = relative_equilibria(lambda g: ring(9, "field", loads=(Slope(0.0, -g), Damping(rolling=0.8))), [0.0, 0.2], count=6)
    direct = modes(ring(9, "field", -0.2 * 1.3, branch.modes[1].problem.loads), count=6)
    assert branch.growth[0] < 0
    assert branch.growth[1] == pytest.approx(direct.growth, rel=1e-6)
    assert branch.growth[1] > 0.01


def test_a_driven_rod():
    """One disc is driven: the whole rod rolls at its rate."""
    still = untwisting_chain(7, "unit", twist=0.0)
    branch = relative_equilibria(
        lambda rate: replace(still, initial=replace(still.initial, omega=rate), loads=(Motor(rate, at=2.0), Damping(torsion=0.1))),
        [0.1, 0.3],
        count=4,
    )
    np.testing.assert_allclose(branch.modes[1].problem.initial.omega, 0.3, atol=1e-9)
    axes = branch.plot("rate").axes
    assert [ax.get_ylabel() for ax in axes] == ["growth rate", "frequency"]
    assert axes[0].get_xlabel() == "rate"


def test_bad_input(monkeypatch):
    with pytest.raises(ValueError, match="make must be a function"):
        relative_equilibria(3.0, [0.0])
    with pytest.raises(ValueError, match="make must return a Problem; got 'no'"):
        relative_equilibria(lambda _: "no", [0.0])
    with pytest.raises(ValueError, match=r"at the parameter 0\.3: Torque: its signal changes"):
        relative_equilibria(lambda g: ring(9, "unit", loads=(Torque(g, signals.ramp(0.0, 1.0)),)), [0.3])
    still = untwisting_chain(9, "unit", twist=0.0)
    monkeypatch.setattr(importlib.import_module("discs.analysis.branch"), "STEPS", 1)
    with pytest.raises(ValueError, match=r"at the parameter 0\.5: no steady motion was found; take smaller steps"):
        relative_equilibria(lambda g: replace(still, loads=(Motor(0.0, at=0.0), Torque(g, at=4.0))), [0.5])


@pytest.mark.parametrize("law", ["unit", "own"])
def test_512_discs(law):
    """Dense matrices would take minutes; three motions of 512 discs take about a second."""
    start = time.process_time()
    branch = relative_equilibria(lambda g: ring(512, law, loads=(Slope(0.0, -g), Damping(rolling=0.8))), VALUES, count=6)
    assert time.process_time() - start < 8.0
    for value, found in zip(VALUES, branch.modes, strict=True):
        np.testing.assert_allclose(found.problem.initial.omega, -value * 1.3, atol=1e-9)
    assert (branch.growth < 0).all()


def test_a_straight_periodic_rod_goes_on_along_its_line():
    """It cannot turn, as its images would move: only so is it steady, by the field law, at every rate."""
    branch = relative_equilibria(
        lambda g: ring(17, "field", loads=(Slope(0.0, -g), Damping(rolling=0.8))), [0.0, 0.2, 0.5], count=2
    )
    np.testing.assert_array_equal(branch.turning, 0.0)
    np.testing.assert_allclose(branch.modes[-1].problem.initial.omega, -0.5 * 1.3, atol=1e-9)


@pytest.mark.parametrize("n", [17, 33])
def test_a_rod_held_at_one_end_and_twisted(n):
    """Its shape changes with the torque: forces are balanced and nothing moves."""
    rod = untwisting_chain(n, "own", twist=0.0)
    branch = relative_equilibria(lambda g: replace(rod, loads=(Motor(0.0, at=0.0), Torque(g, at=4.0))), [0.0, 0.02, 0.04], count=2)
    for torque, found in zip((0.0, 0.02, 0.04), branch.modes, strict=True):
        lin = found.state.equations
        assert np.abs(lin.rate).max() < 1e-9
        assert torque <= np.ptp(found.problem.initial.theta) <= torque * 4.0 / 0.8  # at most as if the line stayed straight
