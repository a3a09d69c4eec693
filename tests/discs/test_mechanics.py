"""The saddle point against the reduced and the skew-gradient form, on random states of uneven chains; what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from scipy.sparse.csgraph import connected_components

from discs import Gauss8, Problem, State, SteeredChain, simulate
from discs.mechanics import MechanicalSystem
from discs.mechanics.lagrange import frames, lagrange_dalembert
from tests.conftest import ALL, SLAVED, STEERED, Model, models, uneven
from tests.discs.test_system import contact_from_the_definition, directional, potential_from_the_definition

N = 9


def anywhere(model: Model, seed: int) -> Problem:
    """A random state near the uneven chain's start, with random rates."""
    rng = np.random.default_rng(seed)
    problem = uneven(N, model, seed)
    start = problem.initial
    x, y, theta = (np.asarray(z) + 0.05 * rng.standard_normal(N) for z in (start.x, start.y, start.theta))
    omega, turning = rng.standard_normal((2, N))
    phi = None if start.phi is None else start.phi + 0.3 * rng.standard_normal(N)
    return Problem(problem.chain, State(x, y, theta, omega, phi, turning), 1.0)


def skew_gradient(problem: Problem) -> np.ndarray:
    """Accelerations from pi. = -C^T grad V: with pi = root u, root. = w rho e.e./root, u. = (pi. - root. u)/root."""
    system, z = problem.system, problem.start()
    shape = system.shape(z.hi)
    c = system.basis(shape)
    v = system.forward(c, z.pi)
    e, turned = system.contact(shape), system.contact_rate(shape, v)
    root = system.momentum(shape, np.ones((2, N))).reshape(-1, N)
    root_rate = np.zeros_like(root)
    root_rate[0] = system.weights[0] * (e * turned).sum(axis=0) / root[0]
    u = (-system.back(c, system.gradient(shape)).reshape(-1, N) - root_rate * v[2:]) / root
    return np.concatenate([e * u[0] + turned * v[2], u]).ravel()


def disagreement(problem: Problem, system: MechanicalSystem) -> float:
    """Largest relative difference of accelerations and ground forces between `system` and the other two forms."""
    q, v = frames(problem)
    found, other, third = system.accelerations(q, v), lagrange_dalembert(problem).reduced(q, v), skew_gradient(problem)
    ground = problem.system.contact_force(problem.system.shape(q.reshape(-1, N)), v.reshape(-1, N)).ravel()
    size, force = np.abs(third).max(), np.abs(ground).max()
    return max(
        np.abs(found.acceleration - third).max() / size,
        np.abs(found.acceleration - other.acceleration).max() / size,
        np.abs(found.multipliers - ground).max() / force,
        np.abs(found.multipliers - other.multipliers).max() / force,
    )


@pytest.mark.parametrize("seed", [1, 2, 3])
@models(ALL)
def test_three_forms_are_one(model, seed):
    problem = anywhere(model, seed)
    assert disagreement(problem, lagrange_dalembert(problem)) < 1e-12  # some tens of roundings of 27 to 54 unknowns


@models(ALL)
def test_wrong_signs_are_noticed(model):
    problem = anywhere(model, 1)
    right = lagrange_dalembert(problem)
    wrong = (
        replace(right, constraint_rate=lambda q, v: -right.constraint_rate(q, v)),
        replace(right, force=lambda q, v: -right.force(q, v)),
        replace(right, constraint=lambda q: abs(right.constraint(q))),
    )
    assert min(disagreement(problem, system) for system in wrong) > 1e-2


@models(ALL)
def test_parts_against_the_definitions(model):
    """A, A. and f from the chain's definitions, by differences."""
    problem = anywhere(model, 2)
    system, (q, v) = lagrange_dalembert(problem), frames(problem)

    def a(q):
        e = contact_from_the_definition(problem, q.reshape(-1, N))
        return np.hstack([np.eye(2 * N), -np.vstack([np.diag(e[0]), np.diag(e[1])]), np.zeros((2 * N, len(q) - 3 * N))])

    np.testing.assert_allclose(system.constraint(q).toarray(), a(q), atol=1e-14)
    turned = directional(a, q, v)
    np.testing.assert_allclose(system.constraint_rate(q, v).toarray(), turned, atol=1e-7 * np.abs(turned).max())
    force = system.force(q, v)
    for unit, component in zip(np.eye(len(q)), force, strict=True):
        slope = directional(lambda q: potential_from_the_definition(problem, q.reshape(-1, N)), q, unit, 1e-5)
        assert -slope == pytest.approx(component, abs=1e-7 * np.abs(force).max())
    assert system.energy(q, v) == pytest.approx(problem.energy(), rel=1e-13)


@models(ALL)
def test_consistent_velocity_is_the_m_orthogonal_projection(model):
    problem = anywhere(model, 3)
    system, (q, admissible) = lagrange_dalembert(problem), frames(problem)
    v = np.random.default_rng(4).standard_normal(len(q))
    u = system.consistent_velocity(q, v)
    assert np.abs(system.residual(q, u)).max() < 1e-13
    kernel = la.null_space(system.constraint(q).toarray())
    np.testing.assert_allclose(kernel.T @ (system.mass(q) @ (u - v)), 0, atol=1e-14)
    np.testing.assert_allclose(system.consistent_velocity(q, admissible), admissible, atol=1e-13)
    # by hand: a disc keeps its momentum about the contact, (m e.r. + I theta.)/(m |e|^2 + I)
    e = contact_from_the_definition(problem, q.reshape(-1, N))
    mass, spin, w = problem.system.weights[0], problem.system.weights[2], v.reshape(-1, N)
    roll = (mass * (e * w[:2]).sum(axis=0) + spin * w[2]) / (mass * (e * e).sum(axis=0) + spin)
    np.testing.assert_allclose(u.reshape(-1, N)[:3], [*(e * roll), roll], atol=1e-13)


@models([Model("consistent", "unit"), Model("ring", "field"), Model("springs", "true"), Model("springs", "steered")])
def test_integrated_it_is_the_run(model):
    """DOP853 on the saddle point against a Gauss run: all coordinates and the ground's forces; the constraint stays by itself."""
    problem = uneven(5, model)
    system, times = lagrange_dalembert(problem), np.linspace(0, 1, 5)
    path = system.integrate(*frames(problem), times, rtol=1e-10)
    want = ("velocity", "contact_force")
    run = simulate(problem, Gauss8(tolerance=1e-15, sweeps=12), 0.01, times, want, progress=False)
    q, v = frames(problem, run)
    np.testing.assert_allclose(path.q, q, atol=1e-8)
    np.testing.assert_allclose(path.v, v, atol=1e-8)
    force = run.contact_force.reshape(5, -1)
    np.testing.assert_allclose(path.multipliers, force, atol=1e-7 * np.abs(force).max())
    np.testing.assert_allclose(path.energy, path.energy[0], rtol=1e-8)
    assert path.residual.max() < 1e-8


def test_the_sparse_saddle_point_falls_apart_into_discs():
    """The factors have no fill between discs, so that a solution takes O(n)."""
    for model, parts in ((SLAVED[2], N), (SLAVED[7], N), (STEERED[0], 2 * N)):  # with a heading's own equation
        problem = uneven(N, model)
        matrix = lagrange_dalembert(problem).saddle_point(frames(problem)[0])
        assert connected_components(matrix, directed=False)[0] == parts
        assert abs(matrix - matrix.T).max() == 0


def row(system: MechanicalSystem, name: str) -> np.ndarray:
    return np.eye(len(system.names))[system.names.index(name)]


def test_a_motor_and_a_brake():
    """Disc 4 rolls at a given rate, disc 2 does not: accelerations zero there, the others feel it through the springs only."""
    problem = uneven(N, STEERED[0])
    free = lagrange_dalembert(problem)
    rows = [row(free, "theta of disc 4"), row(free, "theta of disc 2")]
    system, (q, v) = free.also(rows, ["the motor of disc 4", "the brake of disc 2"], [1.7, 0.0]), frames(problem)
    v = system.consistent_velocity(q, v)
    assert v[system.names.index("theta of disc 4")] == pytest.approx(1.7, rel=1e-13)
    np.testing.assert_allclose(system.residual(q, v), 0, atol=1e-13)
    path = system.integrate(q, v, [0, 0.2, 0.4], rtol=1e-9)
    theta = path.q[:, 2 * N : 3 * N]
    np.testing.assert_allclose(theta[:, 4] - theta[0, 4], 1.7 * path.t, atol=1e-9)
    np.testing.assert_allclose(theta[:, 2], theta[0, 2], atol=1e-9)
    # the motor does all the work: dE/dt = torque times rate
    near = system.integrate(path.q[1], system.consistent_velocity(path.q[1], path.v[1]), [0, 1e-4, 2e-4])
    power = (near.energy[2] - near.energy[0]) / 2e-4
    assert power == pytest.approx(near.multipliers[1, 2 * N] * 1.7, rel=1e-6)
    np.testing.assert_allclose(system.reduced(q, v).acceleration, system.accelerations(q, v).acceleration, atol=1e-10)


def test_discs_without_spin_inertia_have_accelerations():
    problem = uneven(N, STEERED[0])
    parameters = {name: getattr(problem.chain, name) for name in problem.chain.__dataclass_fields__}
    light = Problem(SteeredChain(**parameters | {"spin_inertia": 0.0}), problem.initial, 1.0)
    assert disagreement(light, lagrange_dalembert(light)) < 1e-12


def test_redundant_and_contradicting_constraints_name_their_disc():
    problem = uneven(N, SLAVED[0])
    free, (q, v) = lagrange_dalembert(problem), frames(problem)
    held = free.also([row(free, "x of disc 3"), row(free, "y of disc 3")], ["disc 3"] * 2)
    with pytest.raises(ValueError, match=r"constraints of disc 3 are redundant: 4 rows of rank 3.*remove 1"):
        held.consistent_velocity(q, v)
    pulled = free.also([row(free, "x of disc 3"), row(free, "y of disc 3")], ["disc 3", "the winch"], [0.3, 0.9])
    with pytest.raises(ValueError, match="constraints of disc 3, the winch contradict each other: no motion obeys all 4"):
        pulled.consistent_velocity(q, v)
    twice = free.also([np.zeros(3 * N)], ["nobody"])
    with pytest.raises(ValueError, match="constraints of nobody are redundant: 1 rows of rank 0"):
        twice.accelerations(q, v)
    # constraints that are nearly parallel are not taken for redundant
    tilted = row(free, "x of disc 3") + 1e-6 * row(free, "theta of disc 5")
    near = free.also([row(free, "x of disc 3"), tilted], ["disc 3", "disc 5"])
    u = near.consistent_velocity(q, v)
    assert np.abs(near.residual(q, u)).max() < 1e-12


def test_missing_inertia_is_named():
    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "z"), np.diag([1.0, 2.0, 0.0]), lambda q: q[0] ** 2, lambda q: [[1, 2, 0]], ["rod"]
    )
    with pytest.raises(ValueError, match="no inertia against z"):
        system.accelerations([0, 0, 0], [2, -1, 0])


def test_formulas_are_differentiated_to_rounding():
    """A double pendulum's M(q) without constraints but one: f = dL/dq - M. v by hand."""
    system = MechanicalSystem.from_lagrangian(
        ("a", "b"),
        lambda q: np.array([[2.0, np.cos(q[0] - q[1])], [np.cos(q[0] - q[1]), 1.3]]),
        lambda q: -3 * np.cos(q[0]) - np.cos(q[1]),
        lambda q: [[np.exp(q[0]), 1 + q[1] ** 2]],
        ["rod"],
    )
    q, v = np.array([0.4, -0.9]), np.array([1.1, 0.7])
    sine = np.sin(q[0] - q[1])
    force = [-sine * v[1] ** 2 - 3 * np.sin(q[0]), sine * v[0] ** 2 - np.sin(q[1])]
    np.testing.assert_allclose(system.force(q, v), force, rtol=1e-14)
    np.testing.assert_allclose(system.constraint_rate(q, v), [[np.exp(q[0]) * v[0], 2 * q[1] * v[1]]], rtol=1e-15)


def test_bad_input_is_refused():
    problem = uneven(N, SLAVED[0])
    system, (q, v) = lagrange_dalembert(problem), frames(problem)
    with pytest.raises(ValueError, match=r"v must be 27 finite numbers; got shape \(3,\)"):
        system.accelerations(q, [1, 2, 3])
    with pytest.raises(ValueError, match=r"that of disc 4 is off by 0.5: take consistent_velocity"):
        system.integrate(q, v + 0.5 * row(system, "y of disc 4"), [0, 1])
    with pytest.raises(ValueError, match="times must be at least two, all increasing"):
        system.integrate(q, v, [0, 0])
    with pytest.raises(ValueError, match=r"rows must have shape \(2, 27\), one row per owner; got \(1, 27\)"):
        system.also([row(system, "x of disc 0")], ["disc 0", "disc 1"])
    with pytest.raises(ValueError, match=r"A must be of shape \(1, 2\) and M of shape \(2, 2\).*got \(1, 3\) and \(2, 2\)"):
        MechanicalSystem.from_lagrangian(("x", "y"), np.eye(2), lambda q: 0.0, lambda q: [[1, 0, 0]], ["rod"])
    run = simulate(problem, frames=2, progress=False)
    with pytest.raises(ValueError, match=r'velocities are needed; simulate with want=\("velocity",\)'):
        frames(problem, run)
