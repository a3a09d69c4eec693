"""Steady motions along a parameter, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from discs import Problem, State
from discs.analysis import modes, relative_equilibria
from discs.chains.twist import untwisting_chain
from discs.loads import Damping, Motor, Slope
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


def test_bad_input():
    with pytest.raises(ValueError, match="make must be a function"):
        relative_equilibria(3.0, [0.0])
    with pytest.raises(ValueError, match="make must return a Problem; got 'no'"):
        relative_equilibria(lambda _: "no", [0.0])
    with pytest.raises(ValueError, match=r"at the parameter 0\.3: "):
        relative_equilibria(lambda g: replace(untwisting_chain(5, twist=0.0), loads=(Slope(0.0, -g),)), [0.3])
    many = untwisting_chain(513, twist=0.0)
    with pytest.raises(ValueError, match="at most 1500 unknowns; this chain has 2052"):
        relative_equilibria(lambda _: many, [0.0])
    assert isinstance(many, Problem)
    assert isinstance(many.initial, State)
