"""Loads of a scene that its field cannot take: the words of each error."""

from dataclasses import replace

import numpy as np
import pytest

from continuum import solve, untwisting_rod
from discs.loads import Custom, Damping, Motor, Potential, Rest, Spring, Torque, signals
from tests.continuum.test_loaded_fields import straight


@pytest.mark.parametrize(
    ("loads", "message"),
    [
        ([Torque(1.0)], r"loads of a scene must be a tuple of loads on a rod, as \(Torque\(...\),\); got \["),
        ((Torque(np.ones(5)),), r"pattern of Torque must be a number or a function of s for a scene"),
        ((Torque(1.0, at=3.5),), r"at of a load must be on the rod, from 0 to 3; got 3.5"),
        ((Torque(1.0, at="end"),), r"at of a load must be a finite number; got 'end'"),
        ((Torque(lambda s: s, at=0.0),), r"pattern of Torque with at= is one number; got a function"),
        ((Torque("half"),), r"pattern of Torque must be a finite number; got 'half'"),
        ((Torque(1.0, 3),), r"signal of Torque must be a function of t.*got 3"),
        ((Torque(lambda s: 1 / (s - 1.0)),), r"pattern of Torque 0 is not finite and piecewise smooth at s = 1"),
        ((Torque(1.0, about="turn"),), r"about='turn' is for rods with headings of their own"),
        ((Damping(turning=1.0),), r"turning is for rods with headings of their own"),
        ((Damping(rolling=-1.0),), r"rolling of Damping must be .*at least 0"),
        ((Damping(bending=-1.0),), r"bending of Damping must be .*at least 0"),
        ((Rest(shear=1.0),), r"shear is for rods with headings of their own"),
        ((Spring(0, 0, -1.5),), r"stiffness of Spring must be .*at least 0; got -1\.5"),
        ((Spring(0, 0, -1.5, at=3.0),), r"stiffness of Spring must be .*at least 0; got -1\.5"),
        ((Torque(1.0, lambda t: np.nan),), r"Torque: the signal .* finite numbers; got nan at t = "),
        ((Torque(1.0, lambda t: np.random.default_rng().random()),), r"the signal of Torque must be a function of the time"),
        (
            (Torque(1.0, lambda t: np.sqrt(0.3 - t) if t < 0.3 else {}["late"]),),
            r"Torque: the signal .* raised KeyError: 'late' at t = 0\.5",
        ),
        ((Torque(lambda s: 1.0 if s > 1 else 0.0),), r"pattern of Torque 0 raised ValueError: .* an array of \d+ places s, from"),
        ((Torque(lambda s: np.where(s > 1, np.nan, s)),), r"pattern of Torque 0 must be finite; got nan at s = 1\.0"),
        (
            (Motor(0.0, at=1.0),),
            r"Motor: at s = 1 it makes a corner inside the rod.*; drive an end, or take a SteeredRod, or discs.*'richardson'",
        ),
        ((Motor(0.3, at=0.0),), r"Motor: its rate at t = 0 must be the initial omega at s = 0, 0; got 0\.3"),
        ((Motor(signals.pulse(0.5, 0.1), at=3.0),), r"Motor: its rate jumps at t = 0\.5"),
        ((Custom(lambda t, q, v: q),), r"Custom: its force acts on each disc.*; give one per length, as .*per_length=True"),
        (
            (Custom(lambda t, q, v: q, per_length=True),),
            r"Custom: the spectral solver has no form of it; take method='richardson'",
        ),
        ((Potential(lambda x, y: x, lambda x, y: (1, 0)),), r"Potential: the spectral solver has no form of it"),
    ],
)
def test_loads_that_cannot_be_taken_are_refused(loads, message):
    with pytest.raises(ValueError, match=message):
        solve(straight(1.0, *loads) if isinstance(loads, tuple) else replace(straight(1.0), loads=loads), 1e-3, progress=False)


def test_the_paper_s_scheme_takes_loads_with_a_potential():
    with pytest.raises(ValueError, match="'leapfrog' takes loads that are part of the energy only"):
        solve(replace(untwisting_rod(), loads=(Torque(1.0),)), method="leapfrog", progress=False)
