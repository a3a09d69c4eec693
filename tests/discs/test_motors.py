"""Motors and held discs: against multipliers, closed forms and the balance of energy."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from discs import Chain, Gauss4, Gauss6, Midpoint, Problem, Radau3, Radau5, State, Suzuki4, simulate
from discs.integrators import METHODS
from discs.kernels import compiled
from discs.loads import Damping, Motor, Slope, Torque, signals
from discs.mechanics.lagrange import frames as coordinates
from discs.mechanics.lagrange import lagrange_dalembert
from tests.conftest import longer, models, uneven
from tests.discs.test_loads import KINDS

pytestmark = pytest.mark.slow  # every chain with its saddle point

RATE = 1.3


def driven(model, n: int = 6) -> Problem:
    """An uneven chain with loads, one disc driven and an end held; with own headings a third one turns."""
    problem = uneven(n, model)
    omega = np.array(problem.initial.omega)
    omega[2], omega[-1] = 0.4, 0.0
    motors = [Motor(lambda t: 0.4 + 0.5 * np.sin(RATE * t), 2 * problem.chain.k), Motor(0.0, problem.chain.s[-1])]
    phi_rate = problem.initial.phi_rate
    if model.law == "steered":
        phi_rate = np.array(phi_rate) * np.ones(n)
        phi_rate[1] = 0.2
        motors.append(Motor(lambda t: 0.2 - 0.3 * t, problem.chain.k, about="turn"))
    loads = (*motors, Slope(0.3, -0.2), Damping(rolling=0.2, torsion=0.1), Torque(0.3, signals.sine(1.0, 2.0)))
    return replace(problem, initial=replace(problem.initial, omega=omega, phi_rate=phi_rate), loads=loads)


def by_multipliers(problem: Problem):
    """End and multipliers, those of the driven angles last: another formulation, another method."""
    n, system = problem.chain.n, lagrange_dalembert(replace(problem, loads=()), dense=True)
    axles, others = problem.system.load.axles, replace(problem, loads=problem.loads[-3:]).system.load
    rows = np.zeros((len(axles), len(system.names)))
    for row, axle in zip(rows, axles, strict=True):
        row[axle.row * n + axle.disc] = 1
    system = replace(system, applied=lambda t, q, v: others.force(t, q.reshape(-1, n), v.reshape(-1, n)).ravel())
    names = tuple(f"motor {i}" for i in range(len(axles)))
    system = system.also(rows, names, lambda t, q: np.array([float(axle.rate(t)) for axle in axles]))
    found = system.integrate(*coordinates(problem), [0.0, 1.0], rtol=1e-9)
    return found.q[-1].reshape(-1, n), found.multipliers[-1][: 2 * n].reshape(2, n), found.multipliers[-1][2 * n :]


@models([KINDS[0], KINDS[1], KINDS[4]], [KINDS[0]])
def test_motors_move_discs_as_the_saddle_point_says(model, kernels_as_python):
    problem = driven(model)
    q, ground, torque = by_multipliers(problem)
    for method, dt, close, near in (("midpoint", 0.01, 1e-3, 0.05), ("gauss6", 0.05, 3e-6, 2e-3)):
        run = simulate(problem, method, dt, 2, ("contact_force",), progress=False)
        np.testing.assert_allclose([getattr(run, row)[-1] for row in problem.system.rows], q, atol=close, err_msg=method)
        np.testing.assert_allclose(run.reaction[-1], torque, atol=near, err_msg=method)
        np.testing.assert_allclose(run.contact_force[-1], ground, atol=near, err_msg=method)
        off = run.energy - problem.energy() - run.work + run.dissipated
        assert abs(off).max() < (1e-11 if method == "midpoint" or problem.system.quadratic else 1e-6) * abs(run.energy).max()
        assert run.stats["engine"] == "compiled"
        assert run.reaction.shape == (2, len(problem.system.load.axles))


def agree(problem: Problem, method, dt: float = 0.02, close: float = 1e-13):
    """Both engines, at frames at and between steps, every motor among the loads of both."""
    one, other = (simulate(problem, method, dt, [0.13, 1.0], progress=False, engine=e) for e in ("compiled", "plain"))
    assert [run.stats["engine"] for run in (one, other)] == ["compiled", "plain"]
    for name in (*problem.system.rows, "omega", "energy", "work", "dissipated", "reaction"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0, atol=close, err_msg=f"{method}, {name}")
    assert np.abs(one.work).max() > 1e-2


LONGER = (KINDS[1], 1), (KINDS[2], 1), (KINDS[3], 1), (KINDS[4], 1), (KINDS[4], 2)


@pytest.mark.parametrize(("model", "degree"), [(KINDS[0], 1), (KINDS[3], 2), *(longer(*each) for each in LONGER)])
def test_motors_run_compiled(model, degree, kernels_as_python):
    """Converged, and after two sweeps, where all parts of a sweep matter."""
    problem = driven(model, 6 if model.ends == "ring" else 7)
    if degree == 2:
        loads = tuple(replace(load, torsion=0.0) if isinstance(load, Damping) else load for load in problem.loads)
        problem = replace(problem, chain=replace(problem.chain, degree=2), loads=loads)
    few = {"sweeps": 2, "tolerance": 0}
    for method in (Midpoint(), Midpoint(**few), Suzuki4(), Gauss6(), Gauss4(**few), Radau3(), Radau5(**few)):
        agree(problem, method)


@pytest.mark.parametrize(("model", "method"), [(KINDS[0], "gauss6"), (KINDS[4], "midpoint")])
def test_motors_take_the_kernels_of_runs_without_loads(model, method):
    """Numba compiles nothing for them; chunks of steps have tables of their own."""
    problem = driven(model)
    simulate(replace(problem, loads=()), method, 0.05, 2, progress=False)
    said: list[bool] = []
    with compiled.compiling(lambda: said.append(True), 0.0):
        agree(problem, METHODS[method]())
    assert not said


def test_the_row_of_a_motor_is_replaced_to_the_last_bits(kernels_as_python):
    """Its angle is the midpoint sum of its rate; a held disc does not turn at all."""
    problem = driven(KINDS[0])
    t = 0.05 * (np.arange(20) + 0.5)
    turned = 0.05 * np.sum(0.4 + 0.5 * np.sin(RATE * t))
    for engine in ("compiled", "plain"):
        run = simulate(problem, "midpoint", 0.05, 2, progress=False, engine=engine)
        assert run.theta[-1, 2] - problem.initial.theta[2] == pytest.approx(turned, rel=1e-14)
        assert run.theta[-1, -1] == problem.initial.theta[-1]


def test_the_balance_of_a_motor_is_exact_after_any_number_of_sweeps(kernels_as_python):
    problem = driven(KINDS[1])
    for engine in ("compiled", "plain"):
        run = simulate(problem, Midpoint(sweeps=1, tolerance=0), 0.1, 4, progress=False, engine=engine)
        assert abs(run.energy - problem.energy() - run.work + run.dissipated).max() < 1e-14 * abs(run.energy).max()


def test_a_motor_speeds_a_disc_up():
    """Without springs a driven disc accelerates alone: its torque is inertia times acceleration, its work the kinetic energy."""
    chain = Chain(
        n=5, length=2.0, density=1.3, spin_inertia=0.6, torsion_stiffness=0.0, bending_stiffness=0.0, radius=0.7, rolling="unit"
    )
    problem = Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), 2.0, (Motor(lambda t: 0.6 * t, 1.0),))
    run = simulate(problem, Midpoint(tolerance=1e-15), 0.01, 5, progress=False)
    inertia = (0.6 + 1.3 * 0.7**2) * chain.w[2]
    moved = run.omega[:, 2]
    np.testing.assert_allclose(moved, 0.6 * run.t, atol=1e-12)
    np.testing.assert_allclose(run.work, 0.5 * inertia * moved**2, rtol=1e-6, atol=1e-12)


@models([KINDS[0], KINDS[1], KINDS[3]])
def test_a_motor_rolls_a_rod_steadily_against_its_resistance(model, kernels_as_python):
    """beta theta' = c rate (s - length) carries what resists beyond s: the whole rod rolls at the rate of its first disc.

    The straight line stays straight, as all discs roll alike. The torque is c rate length, its work what the dampers take.
    """
    problem = uneven(7, model, equal=True)
    chain, c, rate = problem.chain, 0.4, 0.7
    roll = c * rate / 0.9 * (0.5 * chain.s**2 - chain.length * chain.s)
    own = {"phi": 0 * roll} if model.law == "steered" else {}
    steady = replace(problem, initial=State(chain.s, 0 * roll, roll, rate, **own), loads=(Motor(rate, 0.0), Damping(rolling=c)))
    for method in ("midpoint", "suzuki4", "gauss6", "radau5"):
        for engine in ("compiled", "plain"):
            run = simulate(steady, method, 0.05, 3, progress=False, engine=engine)
            np.testing.assert_allclose(run.theta, roll + rate * run.t[:, None], atol=1e-11)
            np.testing.assert_allclose(run.y, 0.7 * rate * run.t[:, None] * np.ones(7), atol=1e-11)
            np.testing.assert_allclose(run.reaction, c * rate * chain.length, rtol=1e-9)
            np.testing.assert_allclose([run.work, run.dissipated], [c * rate**2 * chain.length * run.t] * 2, atol=1e-11)


def test_a_held_end_reacts_with_the_moment_of_the_rod():
    """A rod at rest, twisted evenly and held at both ends, stays; the torques are beta times the twist."""
    problem = uneven(7, KINDS[0], equal=True)
    chain = problem.chain
    state = State(chain.s, 0 * chain.s, 0.3 * chain.s)
    run = simulate(
        replace(problem, initial=state, loads=(Motor(0, 0.0), Motor(0, chain.length))), "midpoint", 0.05, 3, progress=False
    )
    np.testing.assert_allclose(run.reaction, 0.9 * 0.3 * np.array([[-1, 1]] * 3), rtol=1e-9)
    np.testing.assert_allclose(run.work, 0, atol=1e-14)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: (Motor(0.5, 0.0),), "Motor: its rate at t = 0 must be the initial omega of its disc 0, 0.5.*; got 0.4"),
        (lambda p: (Motor(0.5, 9.0),), "at of Motor must be on the rod"),
        (lambda p: (Motor(0.5, 0.0, about="turn"),), "Motor: about='turn' is for discs with headings"),
        (lambda p: (Motor(0.5, 0.0), Motor(0.5, 0.1)), "Motor: disc 0 has two motors"),
        (lambda p: (Motor(lambda t: 0.5 / (1 - t) if t < 1 else np.inf, 0.0),), "Motor: the signal .* got inf at t = 1"),
        (lambda p: (Motor("fast", 0.0),), "rate of Motor must be a finite number"),
    ],
)
def test_motors_that_cannot_be_are_refused(change, words):
    problem = uneven(7, KINDS[0])
    omega = np.array(problem.initial.omega)
    if "got 0.4" in words:
        omega[0], words = 0.7, words.replace("0.5.*; got 0.4", "0.7; got 0.5")
    with pytest.raises(ValueError, match=words):
        replace(problem, initial=replace(problem.initial, omega=omega), loads=change(problem))


@pytest.mark.parametrize("method", ["rk4", "DOP853"])
def test_methods_that_take_no_motors_say_so(method):
    problem = uneven(7, KINDS[0])
    with pytest.raises(ValueError, match=f"'{method}' does not take motors; take an implicit method"):
        simulate(replace(problem, loads=(Motor(0.5, 0.0),)), method, 0.01, progress=False)


@pytest.mark.parametrize("method", ["suzuki4", "kahanli6"])
def test_steps_back_in_time_take_motors_and_stiff_dampers(method):
    """The matrix of such a step is not positive definite; against Gauss steps, which go forward only. Dampers are warned of."""
    problem = driven(KINDS[0])
    stiff = replace(problem, loads=(Damping(rolling=1e3),))
    for loaded, near in ((problem, 1e-4), (stiff, 1e-5)):
        with pytest.warns(UserWarning, match="substeps back in time amplify") if loaded is stiff else nullcontext():
            run = simulate(loaded, method, 0.02, 2, engine="plain", progress=False)
        other = simulate(loaded, "gauss6", 0.02, 2, engine="plain", progress=False)
        assert np.isfinite(run.theta).all()
        for name in ("x", "y", "theta"):
            gap = np.abs(getattr(run, name) - getattr(other, name)).max()
            assert gap < near, (name, gap)
