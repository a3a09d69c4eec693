"""Integration in time: dependent constraints, units, stiffness, warnings and errors."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from discs.mechanics import MechanicalSystem, textbook
from discs.mechanics.lagrange import frames, lagrange_dalembert
from tests.conftest import SLAVED, STEERED, longer, uneven
from tests.discs.test_textbook import CLOSED, contact, driven

FREE = {"constraint": lambda q: np.zeros((0, 2)), "owners": ()}


# Constraints that become dependent


def crank_slider(rod=1.0, rows=None):
    """Crank 1 and a rod of length `rod` at angles a, b on a slider at x: cos a + rod cos b = x, sin a + rod sin b = 0."""

    def constraint(q):
        return [[np.sin(q[0]), rod * np.sin(q[1]), 1], [np.cos(q[0]), rod * np.cos(q[1]), 0]]

    system = MechanicalSystem.from_lagrangian(
        ("crank", "rod", "slider"), np.diag([1, 0.1, 0.5]), lambda q: 0.0, rows or constraint, ("loop", "loop")
    )
    b = -np.arcsin(np.sin(1) / rod)
    q = np.array([1.0, b, np.cos(1) + rod * np.cos(b)])
    return system, q, system.consistent_velocity(q, (1, -1, -2 * np.sin(1)))


def crank(t, rod=1.0):
    """The crank's angle from the energy. A rod of length 1 goes round; a longer one turns back."""

    def inertia(a):
        b = -a if rod == 1 else -np.arcsin(np.sin(a) / rod)
        turn = -1.0 if rod == 1 else -np.cos(a) / (rod * np.cos(b))
        return 1 + 0.1 * turn**2 + 0.5 * (np.sin(a) + rod * np.sin(b) * turn) ** 2

    _, _, v = crank_slider(rod)
    energy = inertia(1.0) * v[0] ** 2

    def time(a):
        middle = [np.pi / 2] if a > np.pi / 2 else None
        return quad(lambda z: np.sqrt(inertia(z) / energy), 1.0, a, epsabs=1e-11, epsrel=1e-11, limit=500, points=middle)[0]

    return brentq(lambda a: time(a) - t, 1.0, 1 + 5 * t, xtol=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "rtol", "bound"),
    [
        ("auto", 1e-11, 1e-10),
        ("auto", 1e-8, 1e-7),
        ("auto", 1e-6, 1e-5),
        ("auto", 1e-3, 1e-3),
        ("RK45", 1e-8, 1e-6),
        ("Radau", 1e-6, 1e-5),
        ("BDF", 1e-6, 1e-4),
        ("LSODA", 1e-8, 1e-5),
    ],
)
def test_a_crank_and_a_rod_go_through_where_ways_part(method, rtol, bound):
    system, q, v = crank_slider()
    path = system.integrate(q, v, [0.0, 2.0, 5.0], rtol, method=method, progress=False)
    np.testing.assert_allclose(path.q[1:, 0], [crank(2.0), crank(5.0)], atol=bound)
    assert path.q[1, 0] == pytest.approx(3.10286, abs=max(bound, 1e-5))
    np.testing.assert_allclose(path.q[:, 1], -path.q[:, 0], atol=bound)
    assert path.stats["evaluations"] < 2000
    if rtol < 1e-4:
        np.testing.assert_allclose(path.stats["rank_drops"][0], 0.6123, atol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("longer", [1e-2, 1e-4, 1e-6])
def test_a_rod_that_is_longer_turns_back(longer):
    """A motion that misses the branch point is not branched."""
    system, q, v = crank_slider(1 + longer)
    path = system.integrate(q, v, [0.0, 2.0], 1e-8, progress=False)
    assert path.q[-1, 0] == pytest.approx(crank(2.0, 1 + longer), abs=1e-5)
    assert path.stats["rank_drops"] == []


def test_a_parallelogram_goes_through_flat():
    """Cranks of length 1 turn evenly, the coupler of length 2 keeps its direction."""

    def constraint(q):
        s, c = np.sin(q), np.cos(q)
        return [[-s[0], -2 * s[1], s[2]], [c[0], 2 * c[1], -c[2]]]

    system = MechanicalSystem.from_lagrangian(
        ("left", "coupler", "right"), np.diag([1, 0.5, 0.8]), lambda q: 0.0, constraint, ("bars",) * 2
    )
    q = np.array([1.0, 0.0, 1.0])
    path = system.integrate(q, system.consistent_velocity(q, [1, 0, 1]), [0.0, 2.0, 6.0], progress=False)
    np.testing.assert_allclose(path.q, [[1, 0, 1], [3, 0, 3], [7, 0, 7]], atol=1e-9)


@pytest.mark.slow
def test_a_way_that_is_not_smooth_ends_in_words():
    """A cusp, y^2 = x^3, reached from (1, 1) at speed 1 after the length of the arc, ((1 + 9/4)^1.5 - 1) 8/27 = 1.43971."""
    system = MechanicalSystem.from_lagrangian(
        ("x", "y"), np.eye(2), lambda q: 0.0, lambda q: [[-3 * q[0] ** 2, 2 * q[1]]], "the wire"
    )
    q, v = np.ones(2), -np.array([2, 3]) / np.sqrt(13)
    with pytest.raises(RuntimeError, match=r"beyond t = 1\.4396.*the constraints of the wire become dependent there"):
        system.integrate(q, v, [0.0, 3.0], progress=False)


# Units


def rescaled(system, q, v, coordinates, time, mass):
    """The system with q in other units: q = coordinates * q', t = time * t', energies with mass * length^2/time^2 = `mass`."""
    c = np.asarray(coordinates, dtype=float)

    def scaled(q):
        return c * q

    rows = 1.0
    return (
        MechanicalSystem(
            system.names,
            system.owners,
            lambda q: mass * system.mass(scaled(q)) * c * c[:, None],
            lambda q: mass * system.potential(scaled(q)) * time**2,
            lambda q, v: mass * system.force(scaled(q), scaled(v) / time) * c * time**2,
            lambda q: rows * system.constraint(scaled(q)) * c,
            lambda q, v: rows * system.constraint_rate(scaled(q), scaled(v) / time) * c * time,
            system.drive,
        ),
        q / c,
        v / c * time,
    )


BOOKS = {**CLOSED, "contact": contact(), "driven": driven(0.6)}


@pytest.mark.slow
@pytest.mark.parametrize("power", [longer(-6), 6])
@pytest.mark.parametrize("name", [name if i % 3 == 0 else longer(name) for i, name in enumerate(BOOKS)])
def test_units_of_length_mass_and_time_do_not_matter(name, power):
    book, length, time = BOOKS[name], 10.0**power, 10.0 ** (-power / 2)
    angles = [n in ("theta", "phi") for n in book.system.names]
    system, q, v = rescaled(book.system, book.q, book.v, np.where(angles, 1.0, length), time, 10.0 ** (-power))
    times = np.array([0.0, 1.5, 3.0])
    found = system.integrate(q, v, times / time, progress=False)
    plain = book.integrate(times, progress=False)
    np.testing.assert_allclose(found.q * np.where(angles, 1.0, length), plain.q, atol=1e-9)
    assert found.stats["steps"] == pytest.approx(plain.stats["steps"], rel=0.1, abs=2)
    assert system.reduced(q, v).acceleration == pytest.approx(
        system.accelerations(q, v).acceleration, rel=1e-9, abs=1e-9 * np.abs(v).max()
    )


@pytest.mark.parametrize("model", [SLAVED[0], STEERED[0]], ids=str)
@pytest.mark.parametrize("power", [-6, 6])
def test_units_of_chains_do_not_matter(model, power):
    problem = uneven(3, model)
    chain, (q, v) = lagrange_dalembert(problem, dense=True), frames(problem)
    length, time = 10.0**power, 10.0 ** (power / 3)
    units = np.array([length if n[0] in "xy" else 1.0 for n in chain.names])
    system, q_other, v_other = rescaled(chain, q, v, units, time, 10.0 ** (-2 * power))
    plain = chain.integrate(q, v, [0.0, 0.3], 1e-8, progress=False)
    found = system.integrate(q_other, v_other, [0.0, 0.3 / time], 1e-8, progress=False)
    np.testing.assert_allclose(found.q * units, plain.q, atol=1e-6)


@pytest.mark.slow
def test_a_skate_of_a_micrometre_in_si_units():
    """Mass 1.3e-15 kg, length 1e-6 m: by formulas, against the same in micrometres."""

    def skate(length, mass):
        system = MechanicalSystem.from_lagrangian(
            ("x", "y", "phi"),
            np.diag([1.3 * mass, 1.3 * mass, 0.4 * mass * length**2]),
            lambda q: -2.1 * mass * length * q[0],
            lambda q: [[-np.sin(q[2]), np.cos(q[2]), 0]],
            ("blade",),
        )
        return system.integrate([0, 0, 0], [0, 0, 1.7], [0.0, 2.0, 4.0], progress=False).q / [length, length, 1]

    np.testing.assert_allclose(skate(1e-6, 1e-15), skate(1.0, 1.0), atol=1e-9)


# Methods, tolerances, what is said


def pendulum():
    """Length 1, in x and y."""
    return MechanicalSystem.from_lagrangian(("x", "y"), np.eye(2), lambda q: 9.81 * q[1], lambda q: [[q[0], q[1]]], ("rod",))


@pytest.mark.slow
def test_the_rod_of_a_pendulum_keeps_its_length():
    path = pendulum().integrate([1, 0], [0, 0], np.linspace(0, 20, 5), 1e-4, progress=False)
    np.testing.assert_allclose(np.hypot(*path.q.T), 1, atol=1e-5)
    assert np.abs(path.energy).max() < 0.02


@pytest.mark.slow
def test_lost_energy_is_said():
    with pytest.warns(UserWarning, match=r"RK23: energy is conserved, but at t = .* and not 0: the motion may not be trusted"):
        pendulum().integrate([1, 0], [0, 0], np.linspace(0, 40, 5), 1e-2, method="RK23", progress=False)


@pytest.mark.slow
def test_stiff_problems_get_an_implicit_method():
    """A weight on a rod of stiffness 1e12 beside a slow oscillator, which sets the accuracy."""

    def potential(q):
        return 0.5e12 * q[0] ** 2 + 0.5 * q[1] ** 2 + q[0] * q[1]

    system = MechanicalSystem.from_lagrangian(("fast", "slow"), np.eye(2), potential, **FREE)
    path = system.integrate([-1e-12, 1], [0, 0], [0.0, 2.0], 1e-5, progress=False)
    assert path.stats["method"] == "Radau"
    assert path.q[-1, 1] == pytest.approx(np.cos(2.0), abs=1e-3)
    assert path.stats["evaluations"] < 10_000


@pytest.mark.slow
def test_named_methods_agree_and_unknown_ones_are_refused():
    book = textbook.rolling_disc(1.3, 0.6, 0.4, 0.7, roll_rate=1.1, turn_rate=-0.8, slope=2.1)
    for method in ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA"):
        path = book.integrate([0.0, 1.0], 1e-6, method=method, progress=False)
        assert path.stats["method"] == method
        np.testing.assert_allclose(path.q[-1], book.exact(1.0)[0], atol=1e-4)
    with pytest.raises(ValueError, match="method must be one of 'auto', 'DOP853'"):
        book.integrate([0.0, 1.0], method="Euler")
    with pytest.raises(ValueError, match="rtol must be at least"):
        book.integrate([0.0, 1.0], 1e-300)


@pytest.mark.slow
@pytest.mark.parametrize("name", CLOSED)
@pytest.mark.parametrize("times", [(1.0, 2.0, 3.0, 4.0), (4.0,), (-1.0, 0.0, 2.0), (-2.0, -1.0), (0.0,)])
def test_textbooks_start_at_zero_whatever_times_are_asked_for(name, times):
    path = CLOSED[name].integrate(times, progress=False)
    np.testing.assert_array_equal(path.t, times)
    for f, t in enumerate(times):
        for found, exact in zip((path.q[f], path.v[f], path.multipliers[f]), CLOSED[name].exact(t), strict=True):
            np.testing.assert_allclose(found, exact, atol=1e-9)
    with pytest.raises(ValueError, match="times must be at least one, increasing"):
        CLOSED[name].integrate([1.0, 0.5])


def test_systems_without_constraints():
    system = MechanicalSystem.from_lagrangian(("x", "y"), np.eye(2), lambda q: q @ q / 2, **FREE)
    path = system.integrate([1, 0], [0, 1], [0.0, 1.0], progress=False)
    np.testing.assert_allclose(path.q[-1], [np.cos(1), np.sin(1)], atol=1e-10)
    assert path.multipliers.shape == (2, 0)
    np.testing.assert_allclose(system.reduced([1, 0], [0, 1]).acceleration, [-1, 0], atol=1e-14)


@pytest.mark.slow
def test_a_potential_that_is_infinite_names_place_or_time():
    kepler = MechanicalSystem.from_lagrangian(("x", "y"), np.eye(2), lambda q: -1 / np.linalg.norm(q), **FREE)
    with pytest.raises(ValueError, match=r"V must be finite at the start; V\(q\) = -inf"):
        kepler.integrate([0, 0], [1, 0], [0.0, 1.0])
    # a fall from rest at 1 takes pi/sqrt(8)
    with pytest.raises(RuntimeError, match=r"cannot be continued beyond t = 1\.11072.*V = -"):
        kepler.integrate([1, 0], [0, 0], [0.0, 1.0, 2.0], 1e-8, progress=False)


@pytest.mark.slow
def test_mass_is_checked_on_the_way():
    def mass(q):
        return np.diag([1.0, 1.0 - q[0]])

    system = MechanicalSystem.from_lagrangian(("x", "y"), mass, lambda q: 0.0, **FREE)
    with pytest.raises(
        ValueError, match="M must be positive on velocities that the constraints allow; inertia is negative against y"
    ):
        system.accelerations([2, 0], [1, 0])
    with pytest.raises(RuntimeError, match=r"beyond t = (0\.9999|1).* M must be positive"):
        system.integrate([0, 0], [1, 0], [0.0, 2.0], 1e-6, progress=False)
    skew = MechanicalSystem.from_lagrangian(("x", "y"), lambda q: np.array([[2, q[0]], [0, 2]]), lambda q: 0.0, **FREE)
    with pytest.raises(ValueError, match=r"M must be symmetric; its entry \(x, y\) is 0.5 and \(y, x\) is 0"):
        skew.consistent_velocity([0.5, 0], [1, 0])
    negative = MechanicalSystem.from_lagrangian(("x", "y"), np.diag([1, -1]), lambda q: 0.0, lambda q: [[0, 1]], "rail")
    negative.accelerations([0, 0], [1, 0])  # the constraint forbids y


def test_redundant_rows_are_explained_in_both_forms():
    system = MechanicalSystem.from_lagrangian(("x", "y"), np.eye(2), lambda q: 0.0, lambda q: [[0, 1], [0, 2]], ("a", "b"))
    for form in (system.accelerations, system.reduced):
        with pytest.raises(ValueError, match="constraints of a, b are redundant: 2 rows of rank 1"):
            form([0, 0], [1, 0])
