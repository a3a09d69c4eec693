"""Potentials and forces of one's own in fields: the limit of discs with the same loads."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import solve, steered_rod, untwisting_rod
from discs import simulate
from discs.loads import Custom, Damping, Motor, Potential


def wind(t, q, v):
    """Per length, on x and the roll; on turning where there are headings."""
    f = np.zeros_like(q)
    f[0] = 0.1 * np.sin(2 * t) - 0.2 * v[0] * np.sqrt(v[0] ** 2 + 0.01)
    f[2] = 0.1 * q[1]
    f[3:] = 0.05 * q[0] * np.cos(t)
    return f


def power(t, q, v):
    return (wind(t, q, v) * v).sum(axis=0)


HILLS = Potential(
    lambda x, y: 0.2 * np.cos(2 * x) * np.sin(y), lambda x, y: (-0.4 * np.sin(2 * x) * np.sin(y), 0.2 * np.cos(2 * x) * np.cos(y))
)
LOADS = HILLS, Custom(wind, per_length=True), Damping(rolling=0.1)
STEERED = steered_rod(stretch_stiffness=10, shear_stiffness=10, heading_inertia=0.25, duration=1.0)


@pytest.mark.slow
def test_discs_with_own_headings_tend_to_the_elements():
    scene = replace(STEERED, loads=LOADS)
    field = solve(scene, 1e-6, frames=2, progress=False)
    assert abs(field.energy - field.energy[0] - field.work + field.dissipated).max() < 1e-9
    assert field.dissipated[-1] > 1e-3
    off = []
    for n in (33, 65):
        run = simulate(lump(scene, n), "gauss6", 0.02, 2, progress=False, engine="plain")
        apart = [
            abs(getattr(run, name)[-1] - np.interp(run.s, field.s, getattr(field, name)[-1])).max()
            for name in ("x", "y", "theta", "phi")
        ]
        off.append([*apart, abs(run.work[-1] - field.work[-1])])
    np.testing.assert_allclose(np.divide(*off), 4, atol=0.3)
    assert abs(run.work[-1]) > 1e-3


def test_discs_with_slaved_headings_are_extrapolated():
    scene = replace(untwisting_rod(duration=0.5), loads=LOADS)
    field = solve(scene, 1e-4, frames=2, method="richardson", progress=False)
    run = simulate(lump(scene, 129, ends="consistent"), "gauss6", 0.05, 2, progress=False, engine="plain")
    for name in ("x", "y", "theta"):
        assert abs(getattr(run, name)[-1, 0] - getattr(field, name)[-1, 0]) < 2e-4
    assert abs(field.energy - field.energy[0] - field.work + field.dissipated).max() < 1e-6


def test_a_motor_inside_a_rod_with_slaved_headings_takes_extrapolated_discs():
    scene = replace(untwisting_rod(duration=0.5), loads=(Motor(0.0, at=1.0),))
    field = solve(scene, 1e-3, frames=2, method="richardson", progress=False)
    run = simulate(lump(scene, 129, ends="consistent"), "gauss6", 0.05, 2, progress=False, engine="plain")
    for name in ("x", "y", "theta"):
        apart = abs(getattr(run, name)[-1] - np.interp(run.s, field.s, getattr(field, name)[-1]))
        assert apart.max() < 5e-4, name
    assert abs(run.reaction[-1, 0]) > 0.1
    assert field.reaction[-1] == pytest.approx(run.reaction[-1], rel=0.05)


def test_the_force_of_the_ground_is_refused():
    with pytest.raises(ValueError, match="contact_force of a field with Potential is not known; leave it out"):
        solve(replace(STEERED, loads=(HILLS,)), 1e-3, want=("contact_force",), progress=False)


def test_a_disc_takes_its_share_of_a_force_per_length():
    problem = lump(untwisting_rod(), 9)
    load = Custom(wind, per_length=True).on(problem.chain)
    q, v = np.ones((3, 9)), np.full((3, 9), 0.3)
    np.testing.assert_allclose(load.force(0.2, q, v), problem.chain.w * wind(0.2, q, v))
    whole = Custom(wind, power, per_length=True).on(problem.chain)
    assert whole.power(0.2, q, v)[0] == pytest.approx(load.power(0.2, q, v)[0])
