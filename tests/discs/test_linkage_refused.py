"""Linkages, states and runs that are refused: the message names the node or link."""

import numpy as np
import pytest

from discs import (
    Linkage,
    LinkageProblem,
    LinkageState,
    simulate,
)

ALONG = np.pi / 2  # wheels that roll along the line


GIVEN = {"n": 3, "link_length": 1.0, "mass": 1.0, "heading_inertia": 0.1, "bending_stiffness": 1.0, "mounting_angle": ALONG}


LINE = LinkageState([0, 1, 2], 0, ALONG)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"n": 1}, "a link joins two nodes"),
        ({"stretch_compliance": [0, -1]}, "stretch_compliance of links must be finite and at least 0; got -1.0 at place 1"),
        ({"mass": [1, 2, np.nan]}, "mass of nodes must be finite and at least 0; got nan at place 2"),
        ({"radius": 0.0}, "radius of nodes must be finite and greater than 0"),
        ({"second_share": [0.5, 1.5]}, "second_share of links must be at most 1; got 1.5 at place 1"),
        ({"wheel": 1}, "wheel must be True, False, or one of them for each of the 3 nodes"),
        ({"torsion_stiffness": 1.0, "wheel": [True, True, False]}, "torsion_stiffness of link 1 needs wheels .*; node 2 has none"),
        ({"held": ((0, "x"),)}, "node 0 has a wheel, where one of .'roll', 'phi'. can be held; got 'x'"),
        ({"held": ((3, "phi"),)}, "held names node 3; the nodes are 0 to 2"),
        ({"held": ("phi",)}, "held must be pairs"),
        ({"turns": 1}, "shift and turns are those of a closed chain"),
        ({"rest_curvature": lambda t: 1 / t}, "rest_curvature raised ZeroDivisionError"),
        ({"rest_curvature": lambda t: np.ones(3)}, "rest_curvature of links must be a number or an array of shape .2,."),
    ],
)  # fmt: skip
def test_parameters_are_checked(change, said):
    with pytest.raises(ValueError, match=said):
        Linkage(**GIVEN | change)


@pytest.mark.parametrize(
    ("change", "begin", "said"),
    [
        ({}, LinkageState([0, 1], 0, ALONG), "must have the linkage's 3 nodes; got 2"),
        ({}, LinkageState([0, 1, 2.1], 0, ALONG), "initial place: the rigid link 1 between nodes 1 and 2 is off by 0.1"),
        (
            {},
            LinkageState([0, 1, 2], 0, ALONG, 0, [0, 0, 1], 0, 0),
            "initial velocity: the rigid link 1 between nodes 1 and 2 is off by 1",
        ),
        ({}, LinkageState([0, 1, 2], 0, ALONG, 0, 0, [0, 0.3, 0], 0), "node 1 slips across its wheel, by 0.3"),
        ({"held": ((2, "phi"),)}, LinkageState([0, 1, 2], 0, ALONG, 0, 0, 0, 0.5), "phi of node 2 moves although it is held"),
        (
            {"wheel": False, "held": ((0, "x"), (1, "x"))},
            LINE,
            "constraints of link 0 between nodes 0 and 1 are redundant: 1 rows of rank 0",
        ),
        (
            {"mass": [1, 1, 0], "wheel": [True, True, False], "stretch_compliance": 0.1, "shear_compliance": 0.1},
            LINE,
            "there is no inertia against x of node 2",
        ),
        ({"heading_inertia": [0.1, 0.1, 0], "shear_compliance": 0.1}, LINE, "there is no inertia against phi of node 2"),
    ],
)
def test_states_are_checked(change, begin, said):
    with pytest.raises(ValueError, match=said):
        LinkageProblem(Linkage(**GIVEN | change), begin, 1.0)


def test_rigid_loops_are_refused():
    """Straight around: the links give the length of the whole twice."""
    ring = Linkage(**GIVEN, closed=True, shift=(3.0, 0.0))
    with pytest.raises(ValueError, match=r"link 2 between nodes 2 and 0 are redundant: 6 rows of rank 5"):
        LinkageProblem(ring, LINE, 1.0)
    bent = 2 * np.pi * np.arange(3) / 3  # a triangle is no loop too many: its links can turn
    r = 1 / np.sqrt(3)
    triangle = LinkageState(r * np.cos(bent), r * np.sin(bent), bent + np.pi / 2)
    LinkageProblem(Linkage(**GIVEN | {"mounting_angle": 0.0}, wheel=False, closed=True, turns=1), triangle, 1.0)


def test_runs_are_checked():
    problem = LinkageProblem(Linkage(**GIVEN), LINE, 1.0)
    for given, said in (
        ({"method": "gauss4", "dt": 0.1}, "a linkage runs by 'midpoint'"),
        ({"dt": 2.0}, "dt must be at most the duration"),
        ({"dt": 0.1, "tol": 1e-3}, "give dt or tol, not both"),
        ({"dt": 0.1, "checkpoint": "run.nc"}, "without checkpoint and events"),
        ({"dt": 0.1, "want": "slope"}, "want .of a linkage. must be one of 'velocity'"),
    ):
        with pytest.raises(ValueError, match=said):
            simulate(problem, **given)
    with pytest.raises(ValueError, match="a LinkageProblem takes a Linkage, a LinkageState and a duration"):
        LinkageProblem(1, LINE, 1.0)
