"""The ground's force along runs: its order in time, its power, and the friction it needs."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from compare import lump
from continuum import untwisting_rod
from discs import Gauss8, Problem, State, SteeredChain, simulate
from discs.integrators import METHODS, find
from discs.mechanics.friction import first_slip, friction_needed
from tests.conftest import SLAVED, STEERED, Model, models, uneven
from tests.discs.test_integrators import FIXED, STEPS, tight
from tests.discs.test_system import contact_from_the_definition

SOME = [Model("consistent", "field"), Model("ring", "unit"), Model("springs", "steered")]
KINDS = [*SOME, Model("springs", "true")]


def force(problem, method, steps):
    run = simulate(problem, method, problem.duration / steps, 1, ("contact_force",), progress=False)
    return run.contact_force[-1]


@cache
def accurate(model):
    return force(uneven(6, model), Gauss8(tolerance=1e-15, sweeps=12), 150)


@models(SOME)
@pytest.mark.parametrize("name", [name for name in FIXED if METHODS[name].order in (2, 4)])
def test_order_of_the_ground_force(name, model):
    """That of the method: the force is computed from the state at the frame, not by differences over a step."""
    problem, steps = uneven(6, model), np.array(STEPS[name])
    errors = np.array([np.abs(force(problem, tight(name), n) - accurate(model)).max() for n in steps])
    orders = np.log(errors[:-1] / errors[1:]) / np.diff(np.log(steps))
    assert orders == pytest.approx(find(name).order, abs=0.06 * find(name).order + 0.1), errors


@models(KINDS)
@pytest.mark.parametrize("name", METHODS)
def test_the_ground_does_no_work(name, model):
    """lambda.r. - (e.lambda) theta. = 0 of each disc at each frame, with e from its definition."""
    problem = uneven(6, model)
    run = simulate(problem, name, 0.004, np.linspace(0, 0.03, 4), ("contact_force", "velocity"), progress=False)
    assert run.contact_force.shape == (4, 2, 6)
    for f in range(4):
        q = np.stack([getattr(run, row)[f] for row in problem.system.rows])
        e, ground = contact_from_the_definition(problem, q), run.contact_force[f]
        power = (ground * [run.x_rate[f], run.y_rate[f]]).sum(axis=0) - (e * ground).sum(axis=0) * run.omega[f]
        size = np.abs(ground).max() * np.abs(run.omega[f]).max()
        assert np.abs(power).max() < 1e-13 * size
        other = e[::-1] * [[1], [-1]]  # a control: a ground that pushes across e works on the torque
        assert np.abs((other * ground).sum(axis=0) * run.omega[f]).max() > 1e-3 * size


def free_discs(duration=2.0):
    """Two discs without springs between them: each runs in a circle, |lambda| = m R |omega Omega|."""
    loose = dict.fromkeys(("stretch_stiffness", "shear_stiffness", "torsion_stiffness", "bending_stiffness"), 0.0)
    chain = SteeredChain(n=2, length=3.0, density=[1.3, 0.9], spin_inertia=0.6, heading_inertia=0.3, radius=[0.7, 0.5], **loose)
    zero = np.zeros(2)
    return Problem(chain, State(chain.s, zero, zero, [1.1, -0.4], zero + 0.3, [0.8, 1.9]), duration)


def test_friction_of_discs_in_circles():
    problem = free_discs()
    run = simulate(problem, dt=0.1, frames=5, want=("contact_force",), progress=False)
    weight = 9.81 * np.asarray(problem.chain.density) * problem.chain.w
    needed = friction_needed(run, weight).discs
    expected = np.array([0.7 * 1.1 * 0.8, 0.5 * 0.4 * 1.9]) / 9.81
    np.testing.assert_allclose(needed, np.broadcast_to(expected, (5, 2)), rtol=1e-13)
    assert first_slip(run, weight, expected[0] * 1.001, ends=True) is None
    slip = first_slip(run, weight, expected[0] * 0.999, ends=True)
    assert (slip.disc, slip.time, slip.needed) == (0, 0.0, pytest.approx(expected[0]))
    # disc 1 needs less, but stands on ice
    assert first_slip(run, weight, [1.0, 0.01], ends=True).disc == 1


@models([SLAVED[0], STEERED[1]])
def test_first_slip(model):
    """At the time found the disc needs mu, up to the square of the frames' spacing, and before it no disc needs more."""
    problem = uneven(7, model)
    weight = 9.81 * np.asarray(problem.chain.density) * problem.chain.w

    def needed(times):
        return friction_needed(simulate(problem, "gauss4", 0.01, times, ("contact_force",), progress=False), weight).discs[:, 1:-1]

    mu = 0.9 * needed(np.linspace(0, 1, 401)).max()
    wrong = []
    for frames in (41, 81, 161):
        run = simulate(problem, "gauss4", 0.01, frames, ("contact_force",), progress=False)
        slip = first_slip(run, weight, mu)
        assert 0 < slip.time < 1
        assert slip.needed > mu
        assert (friction_needed(run, weight).inner[run.t < slip.time] <= mu).all()
        wrong.append(abs(needed([slip.time])[0, slip.disc - 1] - mu))
    assert max(wrong) < 2e-3 * mu
    assert wrong[2] < 3e-4 * mu


def test_between_two_frames_the_earliest_disc_counts():
    """|lambda| = 1.75 t with weight 2, and t with weight 1, on mu = 0.3: disc 0 slips at t = 0.34, disc 1 at 0.3."""
    run = simulate(free_discs(), dt=0.1, frames=[0.0, 2.0], want=("contact_force",), progress=False)
    force = np.zeros((2, 2, 2))
    force[:, 0, 0], force[:, 1, 1] = [0.0, -3.5], [0.0, 2.0]
    slip = first_slip(replace(run, contact_force=force), [2.0, 1.0], 0.3, ends=True)
    assert (slip.disc, slip.time, slip.needed) == (1, pytest.approx(0.3), 2.0)
    assert first_slip(replace(run, contact_force=force), [1.5, 1.0], 0.3, ends=True).disc == 0


def test_bad_input_is_refused():
    problem = free_discs()
    run = simulate(problem, frames=2, progress=False)
    with pytest.raises(ValueError, match=r'ground forces are needed; simulate with want=\("contact_force",\)'):
        friction_needed(run, 1.0)
    run = simulate(problem, frames=2, want=("contact_force",), progress=False)
    with pytest.raises(ValueError, match=r"weight must be finite and greater than 0; got 0.0 at place 1"):
        friction_needed(run, [1.0, 0.0])
    with pytest.raises(ValueError, match=r"mu must be finite and greater than 0; got -0.3 at place 0"):
        first_slip(run, 1.0, -0.3, ends=True)


def test_inside_the_coefficient_converges_and_at_the_ends_force_and_couple_are_told():
    """The paper's rod: 0.22 inside whatever N, while end discs need 109 and 507."""
    inside, at_ends = [], []
    for n in (65, 129):
        problem = lump(untwisting_rod(), n, "consistent")
        run = simulate(problem, "midpoint", 0.02, 201, ("contact_force",), progress=False)
        weight = 9.81 * problem.chain.density * problem.chain.w
        with pytest.warns(UserWarning, match=rf"force .* by about 2.* may be wrong: {n} discs are too few there; "):
            found = friction_needed(run, weight)
        inside.append(found.inner.max())
        at_ends.append(found.discs.max())
        assert found.end_force.shape == found.end_couple.shape == (201, 2, 2)
        assert found.end_force_error.shape == found.end_couple_error.shape == (201, 2)
        words = f"force up to {np.hypot(*found.end_force.T).max():.3g} ± {found.end_force_error.max():.1g} and a couple"
        assert words in str(found)
        assert "which grows with their number" in str(found)
    assert inside == pytest.approx([0.22, 0.22], abs=0.01)
    assert at_ends[1] > 4 * at_ends[0] > 400
    within = first_slip(run, weight, 0.2)
    assert 16 <= within.disc <= 112
    with pytest.warns(UserWarning, match="is near a free end, where the coefficient depends on the number of discs"):
        assert first_slip(run, weight, 0.2, ends=True).time < within.time
    with pytest.raises(ValueError, match="none of 2 discs is an eighth of the length away from the free ends; take ends=True"):
        first_slip(simulate(free_discs(), frames=2, want=("contact_force",), progress=False), 1.0, 0.3)
