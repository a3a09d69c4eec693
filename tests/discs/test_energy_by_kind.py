"""The energy by kind: its sum is the energy, and each kind is the energy of a chain with only that stiffness."""

from dataclasses import replace

import numpy as np
import pytest

from continuum import solve, untwisting_rod
from discs import Problem, simulate
from discs.loads import Rest, Slope, Spring, Torque, signals
from tests.conftest import STEERED, Model, models, uneven

KINDS = [Model("springs", "field"), Model("consistent", "unit"), Model("springs", "true"), Model("ring", "field"), *STEERED]
NAMES = {
    "field": ["translation", "rolling", "bending", "torsion"],
    "unit": ["translation", "rolling", "bending", "torsion"],
    "true": ["translation", "rolling", "bending", "torsion", "stretch"],
    "steered": ["translation", "rolling", "turning", "stretch", "shear", "torsion", "bending"],
}


def moved(problem):
    """A short run with steps as short as a motion of seven uneven discs needs."""
    return simulate(replace(problem, duration=0.03), "midpoint", 0.005, 4, engine="plain", progress=False)


STIFFNESS = {kind: f"{kind}_stiffness" for kind in ("bending", "torsion", "stretch", "shear")}


@models(KINDS)
@pytest.mark.parametrize("loaded", [False, True])
def test_kinds_add_up(model, loaded):
    problem = uneven(7, model)
    if loaded:
        rests = Rest(twist=0.4), Rest(twist=0.3, signal=signals.sine(0.8, 1.5))
        problem = replace(problem, loads=(Slope(0.3, -0.2), Spring(0.5, 0.1, 0.4), Torque(0.2, signals.sine(1.0, 2.0)), *rests))
    run = moved(problem)
    kinds = run.energy_by_kind
    assert list(kinds) == NAMES[model.law] + ["loads"] * loaded
    np.testing.assert_allclose(sum(kinds.values()), run.energy, rtol=1e-13)
    assert min(np.abs(part).min() for part in kinds.values()) > 1e-4 * np.abs(run.energy).max()  # no kind is idle


@models(KINDS)
def test_springs_one_by_one(model):
    """Without the other springs and without motion, the energy of a state is that of one kind."""
    problem = uneven(7, model)
    run = moved(problem)
    chain, still = problem.chain, replace(problem.initial, omega=0.0)
    if model.law == "steered":
        still = replace(still, phi_rate=0.0)
    present = {kind: name for kind, name in STIFFNESS.items() if kind in NAMES[model.law]}
    for kind in present:
        others = {name: 0.0 for other, name in present.items() if other != kind}
        alone = Problem(replace(chain, **others), still, 1.0).energy()
        assert run.energy_by_kind[kind][0] == pytest.approx(alone, rel=1e-12)


def test_motion_of_each_kind():
    """m v^2/2 with v = R |r'| omega of the field law, alpha w omega^2/2, J w Omega^2/2."""
    run = moved(uneven(7, STEERED[0]))
    c, kinds = run.problem.chain, run.energy_by_kind
    np.testing.assert_allclose(kinds["translation"], 0.5 * (c.w * c.density * (c.radius * run.omega) ** 2).sum(axis=1), rtol=1e-13)
    np.testing.assert_allclose(kinds["rolling"], 0.5 * (c.w * c.spin_inertia * run.omega**2).sum(axis=1), rtol=1e-13)
    np.testing.assert_allclose(kinds["turning"], 0.5 * (c.w * c.heading_inertia * run.phi_rate**2).sum(axis=1), rtol=1e-13)


def test_frames_without_what_is_needed():
    run = moved(uneven(5, STEERED[0]))
    with pytest.raises(ValueError, match="this run lacks phi_rate, the rates of its headings"):
        _ = replace(run, phi_rate=None).energy_by_kind
    with pytest.raises(ValueError, match="energy_by_kind is of runs of discs, which know their problem: take simulate"):
        _ = replace(run, problem=None).energy_by_kind
    field = solve(untwisting_rod(), 1e-1, "richardson", frames=2, progress=False)
    with pytest.raises(ValueError, match="of a field take solve"):
        _ = field.energy_by_kind
