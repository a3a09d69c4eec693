"""Symmetry of the motion and of the ground's forces, and momenta along runs."""

import numpy as np
import pytest

from discs import Gauss8, Problem, State, SteeredChain, simulate
from discs.integrators import METHODS, Leapfrog, Work
from discs.integrators.leapfrog import TwoStep
from discs.mechanics import MechanicalSystem
from discs.mechanics.lagrange import frames, lagrange_dalembert
from discs.mechanics.momentum import admissible_symmetries, nonholonomic_momenta, symmetry_momenta
from discs.mechanics.vakonomic import agreeing_multipliers
from tests.conftest import ALL, SLAVED, STEERED, Model, models, uneven
from tests.discs.test_integrators import ADAPTIVE, moved, tight
from tests.discs.test_textbook import CLOSED, TIMES

# long steps, to be well above rounding
pytestmark = pytest.mark.filterwarnings("ignore:.* is too long for this motion")

KINDS = [Model("consistent", "field"), Model("ring", "unit"), Model("springs", "true"), Model("springs", "steered")]
FORCE = ("contact_force", "velocity")


# Symmetry. Equivariance and reversal of the integrators with fixed steps are in test_integrators.


@models(KINDS)
@pytest.mark.parametrize("name", ["midpoint", "gauss4", "leapfrog", "mclachlan-perlmutter"])
def test_ground_forces_turn_with_the_plane(name, model):
    if name == "leapfrog" and model.law == "true":
        pytest.skip("explicit steps in plain form take long")
    problem = uneven(7, model)
    other = Problem(problem.chain, moved(problem.initial, 0.7, (1.3, -2.0), 0.4), problem.duration)
    a, b = (simulate(p, tight(name), 0.01, [0, 0.1, 0.2], FORCE, progress=False).contact_force for p in (problem, other))
    c, s = np.cos(0.7), np.sin(0.7)
    np.testing.assert_allclose(b, np.einsum("ij,fjn->fin", [[c, -s], [s, c]], a), atol=1e-9 * np.abs(a).max())
    assert np.abs(b - a).max() > 0.1 * np.abs(a).max()  # a control: they do turn


@models(KINDS)
def test_ground_forces_are_the_same_on_the_way_back(model):
    problem = uneven(7, model)
    times = np.linspace(0, 1, 5)
    there = simulate(problem, tight("midpoint"), 0.05, times, FORCE, progress=False)
    q = [getattr(there, row)[-1] for row in ("x", "y", "theta")]
    own = [] if there.phi is None else [there.phi[-1], -there.phi_rate[-1]]
    back = simulate(
        Problem(problem.chain, State(*q, -there.omega[-1], *own), 1.0), tight("midpoint"), 0.05, times, FORCE, progress=False
    )
    size = np.abs(there.contact_force).max()
    np.testing.assert_allclose(back.contact_force[::-1], there.contact_force, atol=1e-8 * size)


@models(KINDS)
@pytest.mark.parametrize("name", ADAPTIVE)
def test_adaptive_methods_are_equivariant_within_their_tolerance(name, model):
    problem = uneven(6, model)
    other = Problem(problem.chain, moved(problem.initial, 0.7, (1.3, -2.0), 0.4), problem.duration)
    a, b = (simulate(p, METHODS[name](1e-9, 1e-9), frames=[0.0, 0.3], progress=False) for p in (problem, other))
    phi = None if a.phi is None else a.phi[-1]
    expected = moved(State(a.x[-1], a.y[-1], a.theta[-1], a.omega[-1], phi), 0.7, (1.3, -2.0), 0.4)
    for row in (*problem.system.rows, "omega"):
        np.testing.assert_allclose(getattr(b, row)[-1], np.asarray(getattr(expected, row)), atol=2e-7)


@models([SLAVED[2], SLAVED[7], STEERED[0]])
def test_leapfrog_is_its_own_reverse(model):
    """With its two half moves exchanged and reversed, it returns through the same positions."""
    problem, work = uneven(7, model), Work()
    method, system, h = Leapfrog(), problem.system, 0.004
    memory = method.begin(system, problem.start(), h, work)
    path = [memory.hi + memory.lo]
    for _ in range(50):
        memory = method.advance(system, memory, 0.0, h, work)
        path.append(memory.hi + memory.lo)
    memory = TwoStep(memory.hi, memory.lo, -memory.next, -memory.last)
    for place in path[-2::-1]:
        memory = method.advance(system, memory, 0.0, h, work)
        np.testing.assert_allclose(memory.hi + memory.lo, place, atol=1e-11)


# Momentum


@models(ALL)
def test_symmetries_leave_the_lagrangian(model):
    """V, M and the constraint's form: e turns with the plane, so dA/dq along xi_Q is the turn of A."""
    problem = uneven(7, model)
    system, (q, v) = lagrange_dalembert(problem), frames(problem)
    for x in system.symmetry(q).T:
        assert abs(system.force(q, v) @ x) < 1e-11 * np.abs(system.force(q, v)).max() * np.abs(x).max() * len(q)
    x = system.symmetry(q)
    change = system.symmetry(q + v) - x  # dX.v: kinetic energy does not change if M v . dX.v = 0
    np.testing.assert_allclose(change.T @ system.momentum(q, v), 0, atol=1e-13)


def orders(problem, measure, method, steps):
    """Slopes of the largest residual against the step; frames are dense, so that the spline's error is negligible."""
    system, times = lagrange_dalembert(problem), np.linspace(0, problem.duration, 81)
    sizes = []
    for n in steps:
        run = simulate(problem, method, problem.duration / n, times, ("velocity",), progress=False)
        sizes.append(np.abs(measure(system, times, *frames(problem, run)).residual()).max())
    return np.log(np.array(sizes[:-1]) / sizes[1:]) / np.diff(np.log(steps)), sizes


@models(KINDS)
def test_balance_of_momentum_and_spin(model):
    """Momentum, moment of momentum and spin change by the ground's forces, at the method's order."""
    measured, sizes = orders(uneven(5, model), symmetry_momenta, tight("midpoint"), (20, 40, 80))
    assert measured == pytest.approx(2, abs=0.1), sizes
    assert sizes[0] < 0.05


def two_wheels(duration=0.8):
    """Two steered discs on a beam that does not resist torsion: each spins by itself."""
    beam = {"stretch_stiffness": 9.0, "shear_stiffness": 7.0, "torsion_stiffness": 0.0, "bending_stiffness": 0.2}
    chain = SteeredChain(
        n=2, length=1.2, density=[1.3, 0.9], spin_inertia=[0.6, 0.4], heading_inertia=[0.3, 0.2], radius=[0.7, 0.5], **beam
    )
    return Problem(chain, State([0, 1.3], [0, 0.2], [0, 0.4], [0.5, 0.8], [-0.6, 0.7], [0.1, 0.4]), duration)


def test_two_wheels_roll_about_the_point_where_their_axles_meet():
    problem = two_wheels()
    system, (q, _) = lagrange_dalembert(problem), frames(problem)
    (xi,) = admissible_symmetries(system, q)  # shifts x, y, turn about the origin, spins
    xi = xi / xi[2]
    x, y, _, phi = q.reshape(4, 2)
    axles = np.array([np.cos(phi), np.sin(phi)])
    along = np.linalg.solve(np.column_stack([axles[:, 0], -axles[:, 1]]), [x[1] - x[0], y[1] - y[0]])
    centre = np.array([x[0], y[0]]) + along[0] * axles[:, 0]
    np.testing.assert_allclose(xi[:2], [centre[1], -centre[0]], rtol=1e-12)
    # a wheel at -along of its axle from the centre advances by -along per unit of turn, over R of roll
    np.testing.assert_allclose(xi[3:], -along / [0.7, 0.5], rtol=1e-12)


@pytest.mark.parametrize(("method", "steps"), [("midpoint", (20, 40, 80)), ("gauss4", (10, 20, 40)), ("suzuki4", (10, 20, 40))])
def test_the_momentum_equation_holds_at_the_order_of_the_method(method, steps):
    measured, sizes = orders(two_wheels(), nonholonomic_momenta, tight(method), steps)
    assert measured == pytest.approx(METHODS[method].order, abs=0.06 * METHODS[method].order + 0.1), sizes


def test_the_momentum_is_not_kept_and_a_wrong_equation_is_noticed():
    problem = two_wheels()
    system, times = lagrange_dalembert(problem), np.linspace(0, 0.8, 81)
    run = simulate(problem, Gauss8(), 0.02, times, ("velocity",), progress=False)
    found = nonholonomic_momenta(system, times, *frames(problem, run))
    assert np.abs(found.residual()).max() < 1e-7  # of the spline
    assert np.ptp(found.value) > 0.05
    turned = type(found)(found.t, found.value, -found.rate, found.section)
    assert np.abs(turned.residual()).max() > 0.05


@pytest.mark.slow
def test_sleigh_against_its_closed_form():
    """<p, xi_Q> = along m u + turn J phi. for xi_Q = along (cos phi, sin phi, 0) + turn (0, 0, 1); p has no part across."""
    book = CLOSED["sleigh"]
    path = book.integrate(TIMES)
    found = nonholonomic_momenta(book.system, path.t, path.q, path.v)
    assert found.value.shape == (len(TIMES), 2)
    for f, t in enumerate(TIMES):
        q, v, _ = book.exact(t)
        blade = np.array([np.cos(q[2]), np.sin(q[2]), 0])
        directions = book.system.symmetry(q) @ found.section[f].T
        j = 0.4 + 1.3 * 0.35**2
        np.testing.assert_allclose(directions[2] * j * v[2] + blade @ directions * 1.3 * (v @ blade), found.value[f], atol=1e-9)
        np.testing.assert_allclose(book.system.constraint(q) @ directions, 0, atol=1e-10)
    dense = np.linspace(0, 4, 401)
    path = book.integrate(dense)
    assert np.abs(nonholonomic_momenta(book.system, dense, path.q, path.v).residual()).max() < 1e-7
    assert np.abs(symmetry_momenta(book.system, dense, path.q, path.v).residual()).max() < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(("name", "size"), [("disc", 2), ("disc on an incline", 1), ("knife edge", 1), ("particle", 2)])
def test_what_the_constraints_leave(name, size):
    book = CLOSED[name]
    assert len(admissible_symmetries(book.system, book.q)) == size
    dense = np.linspace(0, 4, 201)
    path = book.integrate(dense)
    found = nonholonomic_momenta(book.system, dense, path.q, path.v)
    assert np.abs(found.residual()).max() < 1e-6


def test_chains_leave_one_direction_if_straight_and_none_if_bent():
    bent = uneven(7, SLAVED[0])
    system, (q, v) = lagrange_dalembert(bent), frames(bent)
    assert system.symmetry(q).shape == (21, 4)
    assert admissible_symmetries(system, q).shape == (0, 4)
    times = np.linspace(0, 1, 4)
    assert nonholonomic_momenta(system, times, np.tile(q, (4, 1)), np.tile(v, (4, 1))).value.shape == (4, 0)
    chain = uneven(7, SLAVED[0], equal=True).chain
    straight = Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), 1.0)
    (xi,) = admissible_symmetries(lagrange_dalembert(straight), frames(straight)[0])
    np.testing.assert_allclose(xi / xi[3], [0, 0.7, 0, 1], atol=1e-12)  # all roll sideways


def test_pieces_and_rings():
    parameters = {name: getattr(uneven(7, STEERED[0]).chain, name) for name in SteeredChain.__dataclass_fields__}
    cut = np.asarray(parameters["torsion_stiffness"]).copy()
    cut[[1, 4]] = 0
    problem = Problem(SteeredChain(**parameters | {"torsion_stiffness": cut}), uneven(7, STEERED[0]).initial, 1.0)
    spins = lagrange_dalembert(problem).symmetry(frames(problem)[0])[14:21, 3:]
    np.testing.assert_array_equal(spins.T, [[1, 1, 0, 0, 0, 0, 0], [0, 0, 1, 1, 1, 0, 0], [0, 0, 0, 0, 0, 1, 1]])
    ring = uneven(7, SLAVED[6])
    shifted = {name: getattr(ring.chain, name) for name in ring.chain.__dataclass_fields__} | {"shift": (3.1, 0.0)}
    problem = Problem(type(ring.chain)(**shifted), ring.initial, 1.0)
    assert lagrange_dalembert(problem).symmetry(frames(problem)[0]).shape == (21, 3)  # turning it is none


@pytest.mark.parametrize("length", [1e-6, 1e6])
def test_units_do_not_matter_for_what_the_constraints_leave(length):
    """Two wheels, lengths in other units: one direction, to roll about the same point; a row's unit is not its rank."""
    problem = two_wheels()
    system, (q, v) = lagrange_dalembert(problem, dense=True), frames(problem)
    units = np.array([length if name[0] in "xy" else 1.0 for name in system.names])
    other = MechanicalSystem(
        system.names,
        system.owners,
        lambda q: system.mass(q) * units * units[:, None],
        lambda q: system.potential(q * units),
        lambda q, v: system.force(q * units, v * units) * units,
        lambda q: system.constraint(q * units) * units,
        lambda q, v: system.constraint_rate(q * units, v * units) * units,
        system.drive,
        lambda q: system.symmetry(q * units) / units[:, None],
    )
    (xi,), (expected,) = admissible_symmetries(other, q / units), admissible_symmetries(system, q)
    np.testing.assert_allclose(xi * np.sign(xi @ expected), expected, atol=1e-6)
    assert agreeing_multipliers(other, q / units, v / units).shape == agreeing_multipliers(system, q, v).shape


@pytest.mark.slow
def test_bad_input_is_refused():
    book = CLOSED["sleigh"]
    path = book.integrate(TIMES)
    with pytest.raises(ValueError, match=r"at least 4 times, and q, v of shape \(times, 3\); got \(9,\), \(3, 3\)"):
        nonholonomic_momenta(book.system, TIMES, path.q[:3], path.v)
    bare = MechanicalSystem.from_lagrangian(("x", "y"), np.eye(2), lambda q: 0.0, lambda q: [[1, q[0]]], ["rod"])
    with pytest.raises(ValueError, match="momenta need a symmetry; give the system one"):
        symmetry_momenta(bare, TIMES, np.zeros((9, 2)), np.zeros((9, 2)))
    # wheels whose axles become one line can roll about any point of it, or together along
    parallel = np.tile(frames(two_wheels())[0], (9, 1))
    parallel[4, [0, 1, 2, 3, 6, 7]] = [0, 1, 0, 0, 0, 0]
    with pytest.raises(ValueError, match=r"must not change: 1 at the start, 2 at t = 2; split the motion there"):
        nonholonomic_momenta(lagrange_dalembert(two_wheels()), TIMES, parallel, np.zeros_like(parallel))
