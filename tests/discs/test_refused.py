"""Chains, states, problems and calls that are refused, in words."""

import re

import numpy as np
import pytest

from continuum import untwisting_rod
from discs import Chain, Midpoint, Problem, State, SteeredChain, Suzuki4, simulate
from tests.conftest import Model, uneven
from tests.discs.test_simulate import PARAMETERS, STEERED

WANTED = "'velocity', 'slope', 'contact_force', 'work_by_load'"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n": 2}, "at least 3.*got 2"),
        ({"n": 3, "ends": "consistent"}, "at least 4.*got 3"),
        ({"n": 4, "ends": "ring"}, "at least 5.*got 4"),
        ({"n": 8.0}, "whole number.*got 8.0"),
        ({"length": 0.0}, "length must be a positive finite number; got 0.0"),
        ({"length": "long"}, "length must be a positive finite number; got 'long'"),
        ({"density": 0.0}, "density must be finite and greater than 0; got 0.0"),
        ({"density": np.ones(5)}, r"density must be a number or an array of shape \(8,\); got shape \(5,\)"),
        ({"radius": -1.0}, "radius must be finite and at least 0; got -1.0"),
        ({"spin_inertia": -0.1}, "spin_inertia must be finite and at least 0"),
        ({"torsion_stiffness": -0.1}, "torsion_stiffness must be finite and at least 0"),
        ({"bending_stiffness": [1, 1, 1, -2, 1, 1]}, "bending_stiffness must be .* got -2.0 at place 3"),
        ({"bending_stiffness": np.nan}, "bending_stiffness must be finite"),
        ({"rolling": "sliding"}, "rolling must be one of 'field', 'unit'; got 'sliding'"),
        ({"ends": "loose"}, "ends must be one of 'springs', 'consistent', 'paper', 'ring'; got 'loose'"),
        ({"shift": (1.0, 0.0)}, "shift is the advance of r along a ring"),
    ],
)
def test_bad_chains_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        Chain(**PARAMETERS | change)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "euler"}, "method must be one of 'midpoint', 'suzuki4', .*'RK45', .*; got 'euler'"),
        ({"dt": 0.0}, "dt must be a positive finite number; got 0.0"),
        ({"dt": -0.1}, "dt must be a positive"),
        ({"dt": 10.0}, "dt must be at most the duration, 1; got 10"),
        ({"dt": np.nan}, "dt must be a positive"),
        ({"frames": 0}, "frames must be a whole number of at least 1"),
        ({"frames": [0.5, 0.2]}, "increasing times within"),
        ({"frames": [0.5, 1.2]}, "increasing times within"),
        ({"engine": "fast"}, "engine must be one of 'auto', 'ready', 'compiled', 'plain'; got 'fast'"),
        ({"dt": 0.1, "tol": 1e-3}, "give dt or tol, not both"),
        ({"tol": -1.0}, "tol must be a positive finite number"),
        ({"method": "RK45", "tol": 1e-3}, r"RK45 has tolerances of its own: RK45\(rtol=..., atol=...\)"),
        ({"want": ("colour",)}, f"want must be one of {WANTED}; got 'colour'"),
        (
            {"want": "modified_energy"},
            f"want must be one of {WANTED}; got 'modified_energy'",
        ),
    ],
)
def test_bad_runs_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        simulate(uneven(7, Model("springs", "field")), progress=False, **arguments)


def test_bad_states_and_problems_are_refused():
    chain = Chain(**PARAMETERS)
    s = chain.s
    with pytest.raises(ValueError, match="initial y must be finite; got nan at place 2"):
        State(s, np.where(np.arange(8) == 2, np.nan, 0.0), 0 * s)
    with pytest.raises(ValueError, match="initial theta must be a number or an array of shape"):
        State(s, s, s[:3])
    with pytest.raises(ValueError, match="initial state must have the chain's 8 discs; got 5"):
        Problem(chain, State(s[:5], s[:5], s[:5]), 1.0)
    with pytest.raises(ValueError, match="duration must be a positive finite number; got -1"):
        Problem(chain, State(s, 0 * s, 0 * s), -1)
    with pytest.raises(ValueError, match=re.escape("rolling='unit' needs a heading: r' = 0 at disc 0")):
        Problem(Chain(**PARAMETERS | {"rolling": "unit"}), State(0 * s, 0 * s, 0 * s), 1.0)
    with pytest.raises(ValueError, match=re.escape("spin_inertia must be positive where r' = 0 or radius = 0, as at disc 0")):
        Problem(Chain(**PARAMETERS | {"spin_inertia": 0.0}), State(0 * s, 0 * s, 0 * s), 1.0)
    with pytest.raises(ValueError, match="sweeps must be a whole number of at least 1"):
        Midpoint(sweeps=0)
    with pytest.raises(ValueError, match="tolerance must be at least 0"):
        Midpoint(tolerance=-1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n": 1}, "at least 2.*a link joins two discs.*got 1"),
        ({"n": 4, "ends": "ring"}, "at least 5"),
        ({"ends": "consistent"}, r"ends \(own headings\) must be one of 'springs', 'ring'; got 'consistent'"),
        ({"heading_inertia": 0.0}, "heading_inertia must be finite and greater than 0; got 0.0"),
        ({"shear_stiffness": -1.0}, "shear_stiffness must be finite and at least 0"),
        ({"stretch_stiffness": np.ones(8)}, r"stretch_stiffness must be a number or an array of shape \(7,\)"),
        ({"turns": 1}, "turns of the heading are counted around a ring"),
        ({"turns": 0.5, "ends": "ring"}, "turns must be a whole number; got 0.5"),
    ],
)
def test_bad_steered_chains_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        SteeredChain(**STEERED | change)


def test_headings_are_given_where_they_belong():
    steered, slaved = SteeredChain(**STEERED), Chain(**PARAMETERS)
    s = slaved.s
    with pytest.raises(ValueError, match="SteeredChain needs initial headings phi"):
        Problem(steered, State(s, 0 * s, 0 * s), 1.0)
    with pytest.raises(ValueError, match="Chain takes its headings from the line: leave phi out"):
        Problem(slaved, State(s, 0 * s, 0 * s, phi=0 * s), 1.0)
    with pytest.raises(ValueError, match="stretch_stiffness goes with curvature='true'"):
        Chain(**PARAMETERS | {"stretch_stiffness": 1.0})
    with pytest.raises(ValueError, match="curvature='true' needs links with a direction: discs 2 and 3 are in one place"):
        Problem(Chain(**PARAMETERS | {"curvature": "true"}), State(s[[0, 1, 2, 2, 3, 4, 5, 6]], 0 * s, 0 * s), 1.0)
    with pytest.raises(ValueError, match="modified_energy needs a quadratic potential"):
        simulate(uneven(7, Model("springs", "steered")), "leapfrog", 0.01, want="modified_energy", progress=False)


def test_wrong_kinds_are_refused():
    with pytest.raises(ValueError, match=r"simulate takes a Problem.*got Scene"):
        simulate(untwisting_rod())
    with pytest.raises(ValueError, match="want must be names of quantities; got 5"):
        simulate(uneven(7, Model("springs", "field")), want=5)
    with pytest.raises(ValueError, match="increasing times within"):
        simulate(uneven(7, Model("springs", "field")), frames=["a"])
    with pytest.raises(ValueError, match="base must be a Midpoint; got 'midpoint'"):
        Suzuki4("midpoint")
