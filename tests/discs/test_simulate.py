"""`simulate`: frames, suggested steps, refused input, and failing runs."""

import cProfile
import pickle
import warnings
from dataclasses import replace

import numpy as np
import pytest

from continuum import breathing_ring, untwisting_rod
from continuum.mesh import semidiscretise
from discs import Chain, Midpoint, Problem, SimulationError, State, SteeredChain, Suzuki4, simulate, suggest_dt
from discs.chains.twist import untwisting_chain
from discs.integrators import METHODS
from discs.running.whole_steps import steps_before
from tests.conftest import Model, longer, models, uneven

PARAMETERS = {
    "n": 8,
    "length": 3.0,
    "density": 1.2,
    "spin_inertia": 0.5,
    "torsion_stiffness": 0.8,
    "bending_stiffness": 0.6,
    "radius": 0.7,
}


STEERED = PARAMETERS | {"heading_inertia": 0.3, "stretch_stiffness": 5.0, "shear_stiffness": 4.0}
FIXED = [name for name, cls in METHODS.items() if not cls.adaptive]


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.slow
def test_asking_for_frames_does_not_change_the_trajectory(name):
    problem = uneven(7, Model("springs", "unit"))
    few, many = (simulate(problem, name, 0.0037, frames=f, progress=False) for f in (2, 57))
    assert many.t.size == 57
    assert many.t[-1] == few.t[-1] == problem.duration
    for row in ("x", "y", "theta", "omega", "energy"):
        np.testing.assert_array_equal(getattr(few, row)[-1], getattr(many, row)[-1])
    again = simulate(problem, name, 0.0037, frames=many.t[[5, 56]], progress=False)
    np.testing.assert_array_equal(again.theta[0], many.theta[5])


@pytest.mark.parametrize("dt", [0.02, 0.2])
def test_frames_on_the_way_are_those_asked_for(dt):
    """Compiled steps record frames as they go; with `want` each frame is asked for. With the long step some do not converge."""
    problem = uneven(7, Model("springs", "unit"))
    method = Midpoint(sweeps=4, tolerance=1e-11)
    times = np.array([0.0, 0.5 * dt, 0.51 * dt, 2 * dt, 3.3 * dt])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        one, other = (simulate(problem, method, dt, times, want=want, progress=False) for want in ((), "velocity"))
    assert (one.stats["unconverged"] > 0) == (dt > 0.1)
    for name in ("steps", "gradients", "unconverged", "step_error"):
        assert one.stats[name] == other.stats[name]
    for name in ("x", "y", "theta", "omega", "energy", "rolling_residual"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_call_does_little_besides_its_steps():
    """Time is noisy, so functions called are counted, NumPy's and built in ones among them."""
    problem = untwisting_chain(32, duration=0.01)
    for _ in range(3):  # until what is looked up once has been
        simulate(problem, dt=0.01, frames=1, progress=False, engine="compiled")
    profile = cProfile.Profile()
    profile.runcall(simulate, problem, dt=0.01, frames=1, progress=False, engine="compiled")
    assert sum(entry.callcount for entry in profile.getstats()) <= 90


def test_frames_between_steps_are_as_accurate_as_steps():
    problem = uneven(7, Model("springs", "field"))
    times = np.array([0.333, 0.777])
    fine = simulate(problem, "rk4", 0.0005, frames=times, progress=False)
    for name in METHODS:
        run = simulate(problem, name, 0.005, frames=times, progress=False)
        np.testing.assert_allclose(run.x, fine.x, atol=1e-5)
    midpoint = simulate(problem, "midpoint", 0.05, frames=times, progress=False)
    assert midpoint.energy == pytest.approx(problem.energy(), rel=1e-12)


def test_wanted_quantities():
    run = simulate(uneven(7, Model("consistent", "field")), dt=0.05, want=("velocity", "slope"), frames=3, progress=False)
    radius = uneven(7, Model("consistent", "field")).chain.radius
    np.testing.assert_allclose(run.x_rate, -radius * run.slope_y * run.omega, atol=1e-14)
    np.testing.assert_allclose(run.y_rate, radius * run.slope_x * run.omega, atol=1e-14)
    assert simulate(uneven(7, Model("springs", "field")), dt=0.05, progress=False).x_rate is None


@pytest.mark.parametrize("name", METHODS)
def test_suggested_step(name):
    problem = semidiscretise(untwisting_rod(duration=2.0), 33, "springs")
    run = simulate(problem, name, frames=1, progress=False)
    fine = simulate(problem, "suzuki4", 0.01, frames=1, progress=False)
    assert run.stats["dt_suggested"]
    assert run.stats["dt"] == suggest_dt(problem, name)
    assert np.abs(run.x - fine.x).max() < 1e-3


def test_explicit_step_limit_is_where_it_is_said_to_be():
    """suggest_dt takes 0.7 of the limit; 1.6 times that is above it, and blows up."""
    for n in (33, 65):
        problem = semidiscretise(untwisting_rod(), n, "springs")
        for name in ("leapfrog", "rk4"):
            with pytest.raises(SimulationError, match="stability limit"):
                simulate(problem, name, 1.6 * suggest_dt(problem, name), progress=False)


def test_blow_up_names_step_time_disc_and_cause():
    problem = semidiscretise(untwisting_rod(), 33, "springs")
    with pytest.raises(
        SimulationError, match=r"blew up.*dt = 0.02 is above the stability limit of 'rk4'.*step \d+.*disc \d+"
    ) as caught:
        simulate(problem, "rk4", 0.02, progress=False)
    assert caught.value.time == pytest.approx(0.02 * caught.value.step)
    assert 0 <= caught.value.disc < 33


def collapsing(n):
    """The ring of the unit law, and the time when it ends: it breathes like sin, see `continuum.exact`."""
    scene = breathing_ring("unit", duration=4.0, omega=0.4)
    a0, rod = scene.rod.length / (2 * np.pi), scene.rod
    nu = rod.radius / a0**2 * np.sqrt(rod.bending_stiffness / rod.inertia)
    return semidiscretise(scene, n, "consistent"), np.arctan(a0 * nu / (rod.radius * 0.4)) / nu


@pytest.mark.parametrize("dt", [0.01, 0.3])
def test_collapsing_ring_stops_with_time_and_disc(dt):
    problem, end = collapsing(24)
    with pytest.raises(SimulationError, match="lost its heading") as caught:
        simulate(problem, "midpoint", dt, progress=False)
    assert caught.value.time == pytest.approx(end, abs=dt + 0.02)  # 24 discs are late by 0.01


@pytest.mark.parametrize("engine", ["ready", "plain"])
@pytest.mark.parametrize("method", FIXED)
def test_every_method_stops_at_the_collapse(method, engine):
    problem, end = collapsing(32)
    dt = min(0.015, suggest_dt(problem, method))  # the step to the end does not converge, by `gauss6`, `gauss8`, `suzuki4`
    with pytest.raises(SimulationError, match="lost its heading") as caught:
        simulate(problem, method, dt, 1, progress=False, engine=engine)
    assert caught.value.time == pytest.approx(end, abs=dt + 0.006)  # 32 discs are late by 0.0055
    # a frame between the collapse and the next step is reached by a shorter one
    between = (caught.value.step - 0.02) * dt
    with pytest.raises(SimulationError, match="lost its heading") as caught:
        simulate(replace(problem, duration=between), method, dt, 1, progress=False, engine=engine)
    assert caught.value.time == pytest.approx(between)


@pytest.mark.parametrize("engine", [longer("compiled"), "plain"])
@pytest.mark.parametrize("method", ["midpoint", "gauss6", "rk4"])
def test_a_heading_is_lost_at_a_slope_of_a_thousandth(method, engine):
    """Three discs at rest, without springs, the outer two nearly in one place: only the threshold decides."""
    chain = Chain(**PARAMETERS | {"n": 3, "rolling": "unit", "torsion_stiffness": 0.0, "bending_stiffness": 0.0})

    def resting(slope):
        y = slope * chain.k * np.arange(3)
        return Problem(chain, State([0.0, chain.k, 0.0], y, np.zeros(3)), 1.0)

    simulate(resting(1.1e-3), method, 0.1, 1, progress=False, engine=engine)
    with pytest.raises(SimulationError, match="lost its heading"):
        simulate(resting(0.9e-3), method, 0.1, 1, progress=False, engine=engine)


def test_rest_stays_at_rest():
    chain = Chain(**PARAMETERS)
    run = simulate(Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), 5.0), progress=False)
    assert np.abs(run.y).max() < 1e-14


def test_fewer_sweeps_are_counted():
    with pytest.warns(UserWarning, match=r"midpoint: 20 of 20 steps did not converge: the run may not be trusted"):
        run = simulate(uneven(9, Model("springs", "field")), Midpoint(sweeps=2, tolerance=1e-15), 0.05, frames=1, progress=False)
    assert run.stats["steps"] == 20
    assert run.stats["solves"] == 40
    assert run.stats["unconverged"] == 20


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["compiled", "plain"])
def test_a_step_of_several_substeps_counts_once(engine, kernels_as_python):
    with pytest.warns(UserWarning, match=r"suzuki4: 4 of 4 steps did not converge"):
        run = simulate(
            uneven(5, Model("springs", "field")),
            Suzuki4(Midpoint(sweeps=2, tolerance=1e-15)),
            0.25,
            frames=1,
            progress=False,
            engine=engine,
        )
    assert run.stats["unconverged"] == 4


def test_two_steered_discs():
    """The smallest chain: a link's torsion and beam between two wheels keeps its energy and its centre by symmetry."""
    chain = SteeredChain(**STEERED | {"n": 2})
    run = simulate(Problem(chain, State([0, 3], [0, 0], [-1, 1], phi=[0, 0]), 6.0), dt=0.02, progress=False)
    assert run.energy == pytest.approx(run.energy[0], rel=1e-12)
    np.testing.assert_allclose(run.x.sum(axis=1), 3.0, atol=1e-12)
    np.testing.assert_allclose(run.y.sum(axis=1), 0.0, atol=1e-12)
    assert np.ptp(run.y) > 0.1


def test_the_last_part_of_a_step_is_watched_too():
    """A step longer than the way to the one frame: that is reached by a shorter step, which blows up."""
    problem = semidiscretise(untwisting_rod(), 17, "springs")
    for name in ("rk4", "leapfrog"):
        with pytest.raises(SimulationError, match="blew up"):
            simulate(problem, name, 4.5, frames=[4.4], progress=False)
    with pytest.warns(UserWarning, match="dt = 4.5 is too long for this motion"):
        run = simulate(problem, "midpoint", 4.5, frames=[4.4], progress=False)
    assert run.stats["steps"] == 0
    assert run.stats["solves"] > 0


def test_errors_travel_between_processes():
    error = SimulationError("the run blew up", 3, 0.5, 7)
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.step, again.time, again.disc) == (str(error), 3, 0.5, 7)


@models([Model("consistent", "unit"), Model("ring", "field"), Model("springs", "true"), Model("springs", "steered")])
@pytest.mark.parametrize("name", METHODS)
def test_ground_force_along_a_run(name, model):
    """lambda = rho w r.. + dV/dr, r.. by differences of the recorded velocity: second order in the frames' spacing."""
    problem = uneven(7, model)
    times = np.array([0.5 - 1e-3, 0.5, 0.5 + 1e-3])
    long = METHODS[name].order > 2 and METHODS[name].stability_limit == np.inf  # steps that err as little
    run = simulate(problem, name, 0.02 if long else 0.0025, frames=times, want=("contact_force", "velocity"), progress=False)
    system = problem.system
    q = np.stack([getattr(run, row)[1] for row in system.rows])
    mass, gradient = system.weights[0], system.gradient(system.shape(q))
    rate = np.stack([run.x_rate, run.y_rate], axis=1)
    expected = mass * (rate[2] - rate[0]) / 2e-3 + gradient[:2]
    np.testing.assert_allclose(run.contact_force[1], expected, atol=2e-4 * np.abs(expected).max())


def test_lost_energy_is_said():
    """The two-step scheme's parasitic mode takes over; a run that keeps its energy says nothing."""
    problem = semidiscretise(untwisting_rod(duration=60.0), 33, "springs")
    with pytest.warns(UserWarning, match=r"leapfrog: energy is conserved, but at t = .* the run may not be trusted"):
        simulate(problem, "leapfrog", progress=False)
    simulate(problem, "midpoint", dt=0.1, progress=False)


def test_whole_steps_are_counted_where_rounding_would_lose_one():
    assert steps_before(0.3, 0.1) == (3, 0.0)  # 0.3/0.1 = 2.9999999999999996
    assert steps_before(1e7, 0.1) == (100_000_000, 0.0)
    steps, rest = steps_before(0.1 * 3_000_001, 0.1)
    assert (steps, rest) == (3_000_001, 0.0)
    assert steps_before(0.25, 0.1) == (2, pytest.approx(0.05))
    assert steps_before(0.2 * (1 + 1e-11), 0.1) == (2, 0.0)  # rest below 1e-9 of a step
