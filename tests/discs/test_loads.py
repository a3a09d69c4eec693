"""Loads in the contract: a constant force and a linear damper, on both engines, against other formulations."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import untwisting_rod
from discs import Chain, Midpoint, Problem, SimulationError, State, simulate
from discs.integrators import METHODS, Work
from discs.loads import Damping, Linear, Load, Slope, total
from discs.mechanics.lagrange import frames as coordinates
from discs.mechanics.lagrange import lagrange_dalembert
from tests.conftest import Model, models, uneven

KINDS = [
    Model("springs", "field"),
    Model("consistent", "unit"),
    Model("ring", "field"),
    Model("springs", "steered"),
    Model("ring", "steered"),
]
TAKING = {"midpoint": 2e-3, "suzuki4": 2e-5, "gauss6": 1e-6, "rk4": 1e-5, "DOP853": 1e-6}  # largest error at dt = 0.02, rk4's 0.002


def loaded(model: Model, n: int = 7) -> Problem:
    """An uneven chain, pushed and braked unevenly, held softly in place."""
    problem = uneven(n, model)
    rng = np.random.default_rng(5)
    shape = len(problem.system.rows), n
    push = Linear(rng.uniform(-0.4, 0.4, shape) * problem.chain.w)
    brake = Linear(damping=rng.uniform(0.0, 0.8, shape) * problem.chain.w, stiffness=rng.uniform(0.0, 0.3, shape) * problem.chain.w)
    return replace(problem, loads=(push, brake))


def by_multipliers(problem: Problem):
    """The end by Lagrange-d'Alembert with multipliers and the same forces, by DOP853: another formulation, another method."""
    n, free = problem.chain.n, lagrange_dalembert(replace(problem, loads=()), dense=True)

    def push(t, q, v):
        return sum(load.force(t, q.reshape(-1, n), v.reshape(-1, n)) for load in problem.loads).ravel()

    expected = replace(free, applied=push).integrate(*coordinates(problem), [0.0, 1.0], rtol=1e-9)
    return expected.q[-1].reshape(-1, n), expected.multipliers[-1].reshape(2, n)


def by_discs(problem: Problem, name: str, engine: str):
    method = METHODS[name](rtol=1e-8, atol=1e-9) if name == "DOP853" else METHODS[name]()
    run = simulate(problem, method, 0.002 if name == "rk4" else 0.02, 2, ("contact_force",), False, engine)
    assert run.stats["engine"] == engine
    return [getattr(run, row)[-1] for row in problem.system.rows], run.contact_force[-1]


@pytest.mark.slow
@models(KINDS, [KINDS[1], KINDS[3]])
def test_loads_move_discs_as_the_saddle_point_says(model, kernels_as_python):
    problem = loaded(model)
    expected, multipliers = by_multipliers(problem)
    for name, close in TAKING.items():
        for engine in ("compiled", "plain"):
            found, contact_force = by_discs(problem, name, engine)
            np.testing.assert_allclose(found, expected, rtol=0, atol=close, err_msg=f"{name}, {engine}")
    np.testing.assert_allclose(contact_force, multipliers, rtol=0, atol=1e-5)


def rolling(damping: float, n: int = 3) -> Problem:
    """Discs without springs that roll straight on, braked alike."""
    chain = Chain(
        n=n, length=2.0, density=1.3, spin_inertia=0.6, torsion_stiffness=0.0, bending_stiffness=0.0, radius=0.7, rolling="unit"
    )
    brake = Linear(damping=np.outer([0.0, 0.0, damping], chain.w))
    return Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s, 2.0), 3.0, (brake,))


@pytest.mark.parametrize("engine", ["compiled", "plain"])
def test_a_brake_on_the_axles_lets_rolling_die_down_like_an_exponential(engine, kernels_as_python):
    rate = 0.9 / (0.6 + 1.3 * 0.7**2)
    run = simulate(rolling(0.9), "gauss6", 0.1, 4, progress=False, engine=engine)
    np.testing.assert_allclose(run.omega, 2.0 * np.exp(-rate * run.t)[:, None] * np.ones(3), rtol=1e-8)
    np.testing.assert_allclose(run.y, 0.7 * 2.0 * (1 - np.exp(-rate * run.t))[:, None] / rate * np.ones(3), rtol=1e-8, atol=1e-12)


@pytest.mark.filterwarnings("ignore:.* is too long for this motion")
@pytest.mark.parametrize("engine", ["compiled", "plain"])
def test_a_strong_brake_does_not_limit_the_step(engine, kernels_as_python):
    """h times the rate of decay is 1e4: the midpoint rule multiplies by (1 - h a/2)/(1 + h a/2), and no sweep is lacking."""
    problem = rolling(1e5)
    run = simulate(problem, Midpoint(tolerance=1e-10), 0.3, 2, progress=False, engine=engine)
    x = 0.15 * 1e5 / (0.6 + 1.3 * 0.7**2)
    np.testing.assert_allclose(run.omega[-1], 2.0 * ((1 - x) / (1 + x)) ** 10, rtol=1e-9)
    assert run.stats["unconverged"] == 0


@models(KINDS[:3])
def test_a_midpoint_step_balances_energy_and_work_to_rounding(model):
    """H_1 - H_0 = h v_m . f_m with v_m and f_m in the middle of the step, where V is quadratic."""
    problem = loaded(model)
    system, z, h = problem.system, problem.start(), 0.05
    end = Midpoint(tolerance=1e-15).step(system, z, 0.0, h, Work())
    v = ((end.hi - z.hi) + (end.lo - z.lo)) / h
    work = h * np.vdot(v, system.load.force(0.5 * h, 0.5 * (z.hi + end.hi), v))
    before, after = (0.5 * np.vdot(s.pi, s.pi) + system.potential(system.shape(s.hi, s.lo)) for s in (z, end))
    assert abs(after - before - work) < 1e-13 * before
    assert abs(work) > 1e-3 * before


def held(push: float, spring: float, model: Model = KINDS[0], n: int = 7) -> Problem:
    """An uneven chain, pushed along y and held by springs to a place."""
    problem = uneven(n, model)
    shape = len(problem.system.rows), n
    constant = np.zeros(shape)
    constant[1] = push
    return replace(problem, loads=(Linear(constant), Linear(stiffness=np.full(shape, spring))))


@models([KINDS[0], KINDS[4]])
def test_potentials_of_loads_are_part_of_the_energy(model, kernels_as_python):
    """Midpoint steps keep a quadratic energy to rounding, and it is not that of the springs alone."""
    problem = held(0.3, 0.2, model)
    for engine in ("compiled", "plain"):
        run = simulate(problem, Midpoint(tolerance=1e-14), 0.02, 3, progress=False, engine=engine)
        alone = [e - problem.system.load.potential(0.0, q) for e, q in zip(run.energy, positions(run), strict=True)]
        assert abs(run.energy - problem.energy()).max() < (1e-12 if problem.system.quadratic else 1e-11)
        assert abs(alone[-1] - alone[0]) > 1e-3


def positions(run):
    return np.stack([getattr(run, row) for row in run.problem.system.rows], axis=1)


class Well(Load):
    """A user's conservative load: U = -cos(4 y)/4, whose bound the run is not told."""

    conservative = True

    def __init__(self, shape):
        self.damping = self.stiffness = np.zeros(shape)

    def potential(self, t, q):
        return -0.25 * np.cos(4 * q[1]).sum()

    def force(self, t, q, v):
        f = np.zeros_like(q)
        f[1] = -np.sin(4 * q[1])
        return f


def test_the_energy_of_a_load_of_ones_own_is_watched():
    problem = replace(uneven(5, KINDS[0]), loads=(Well((3, 5)),))
    run = simulate(problem, "rk4", 0.002, 11, progress=False)
    assert abs(run.energy - problem.energy()).max() < 1e-9
    assert problem.conserves
    assert problem.blown_up == np.inf
    false = Well((3, 5))
    false.potential = lambda t, q: 0.0
    with pytest.warns(UserWarning, match="rk4: energy is conserved, but at t = .* it is"):
        simulate(replace(problem, loads=(false,)), "rk4", 0.002, 11, progress=False)


def test_the_bound_of_kinetic_energy_knows_the_loads():
    problem = uneven(7, KINDS[0])
    free, pushed, braked = held(0.3, 0.2), held(0.3, 0.0), loaded(KINDS[0])
    least = -0.5 * 7 * 0.3**2 / 0.2  # at y = 0.3/0.2
    assert free.system.load.least == pytest.approx(least)
    assert free.blown_up == pytest.approx(10 * (free.energy() - least), rel=1e-12)
    assert held(0.0, 0.2).blown_up == pytest.approx(10 * held(0.0, 0.2).energy(), rel=1e-12)
    assert pushed.blown_up == np.inf
    assert braked.blown_up == pytest.approx(10 * (braked.energy() - braked.system.load.least), rel=1e-12)  # it only loses
    slowed = replace(problem, loads=(Damping(rolling=0.1), *held(0.3, 0.2).loads))
    assert slowed.blown_up == pytest.approx(free.blown_up, rel=1e-12)
    with pytest.raises(SimulationError, match="the run blew up"):
        simulate(replace(slowed, duration=9.0), "rk4", 0.5, progress=False, engine="plain")
    assert [p.conserves for p in (problem, free, pushed, braked)] == [True, True, True, False]
    both = total((Well((3, 7)), *held(0.3, 0.2).loads))
    q = problem.start().hi
    assert both.potential(0.0, q) == pytest.approx(sum(load.potential(0.0, q) for load in both.loads))
    assert (both.conservative, both.least) == (True, -np.inf)


@pytest.mark.parametrize("damping", [0.0, 0.4])
def test_the_error_of_the_energy_is_what_it_changed_by_only_where_it_is_conserved(damping):
    problem = uneven(5, KINDS[0])
    problem = replace(problem, loads=(Linear(damping=np.full((3, 5), damping), stiffness=np.full((3, 5), 0.1)),))
    run = simulate(problem, "rk4", tol=1e-4, frames=3, engine="plain", progress=False)
    changed = abs(run.energy - problem.energy()).max()
    assert (run.error_estimate["energy"] == pytest.approx(changed)) == (damping == 0)
    assert run.error_estimate["energy"] < 1e-3 < (changed if damping else 1)


class Wind(Load):
    """A user's load, in NumPy: quadratic drag and a push that starts at t = 0.3."""

    def __init__(self, shape):
        self.damping = self.stiffness = np.zeros(shape)

    def force(self, t, q, v):
        return -0.2 * np.abs(v) * v + (0.1 if t > 0.3 else 0.0)


@pytest.mark.slow
def test_a_load_without_a_compiled_form_runs_on_the_plain_engine():
    problem = uneven(5, Model("springs", "unit"))
    run = simulate(replace(problem, loads=(Wind((3, 5)),)), "rk4", 0.001, 2, progress=False)
    calm = simulate(problem, "rk4", 0.001, 2, progress=False, engine="plain")
    assert run.stats["engine"] == "plain"
    assert abs(run.omega - calm.omega).max() > 1e-3
    both = replace(problem, loads=(Wind((3, 5)), Linear(np.full((3, 5), 0.05))))
    assert simulate(both, "rk4", 0.001, 2, progress=False).stats["engine"] == "plain"


@pytest.mark.slow
def test_without_a_bound_infinite_energy_stops_a_run():
    """Steps that do not converge, on a steep slope: the kinetic energy overflows."""
    problem = lump(replace(untwisting_rod(), loads=(Slope(60.0, -20.0),)), 33)
    with pytest.raises(SimulationError, match="the run blew up, values are not finite"):
        simulate(problem, "gauss4", 0.045, progress=False)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Linear(damping=-np.ones((3, 7))), "damping must be finite and at least 0"),
        (lambda: Linear(np.full((3, 7), np.nan)), "constant must be finite"),
        (lambda: Linear(np.ones((3, 7)), damping=np.ones((4, 7))), r"must have one shape, \(rows, discs\); got \(3, 7\), \(4, 7\)"),
        (lambda: replace(uneven(7, KINDS[0]), loads=(Linear(np.ones((4, 7))),)), r"Linear: .* must have shape \(3, 7\)"),
        (lambda: replace(uneven(7, KINDS[0]), loads=Linear(np.ones((3, 7)))), "loads must be a tuple of loads"),
        (lambda: simulate(loaded(KINDS[0]), "leapfrog", 0.001), "'leapfrog' takes loads that are part of the energy only"),
        (lambda: lagrange_dalembert(loaded(KINDS[0])), "takes a problem without loads; got some: take replace"),
        (
            lambda: simulate(loaded(KINDS[0]), dt=0.1, frames=1, engine="plain").save("never.nc"),
            r"a run with the load Linear.* cannot be written to a file: files hold Torque",
        ),
    ],
)
def test_bad_loads_are_refused_in_words(make, words):
    with pytest.raises(ValueError, match=words):
        make()
