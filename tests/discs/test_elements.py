"""Discs of order four: own headings as quadratic elements, `discs.chains.elements`."""

from dataclasses import replace

import numpy as np
import pytest

from continuum import steered_rod, untwisting_rod
from continuum.mesh import semidiscretise
from discs import Gauss4, Midpoint, Problem, State, SteeredChain, load, simulate
from discs.chains.twist import untwisting_chain
from discs.loads import Damping, Force, Motor, Rest, Torque, signals
from tests.conftest import Model, uneven

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(2)
EXACT = Midpoint(tolerance=1e-14, sweeps=60)


def elements(ends: str = "springs", **changes) -> Problem:
    """A bent, twisted, rolling chain of uneven discs, nine with free ends and eight on a ring."""
    problem = uneven(8 if ends == "ring" else 9, Model(ends, "steered"))
    return replace(problem, chain=replace(problem.chain, degree=2), **changes)


both = pytest.mark.parametrize("ends", ["springs", "ring"])


def by_polynomials(chain: SteeredChain, q: np.ndarray) -> float:
    """V, from the parabolas through the discs of each element and Gauss's sums over the elements."""
    ring = chain.ends == "ring"
    q = np.column_stack([q, q[:, 0] + [*chain.shift, 0.0, 2 * np.pi * chain.turns]]) if ring else q
    stiff = [getattr(chain, f"{name}_stiffness") for name in ("stretch", "shear", "torsion", "bending")]
    total = 0.0
    for e in range((q.shape[1] - 1) // 2):
        parabolas = [np.polynomial.Polynomial.fit([-1, 0, 1], row[2 * e : 2 * e + 3], 2, [-1, 1]) for row in q]
        for g in range(2):
            x1, y1, theta1, phi1 = (line.deriv()(POINTS[g]) / chain.k for line in parabolas)
            phi = parabolas[3](POINTS[g])
            strains = np.cos(phi) * x1 + np.sin(phi) * y1 - 1, np.cos(phi) * y1 - np.sin(phi) * x1, theta1, phi1
            total += sum(WEIGHTS[g] * chain.k / 2 * a[2 * e + g] * b**2 for a, b in zip(stiff, strains, strict=True))
    return total


@both
def test_potential_and_shares_are_those_of_parabolas_between_discs(ends):
    problem = elements(ends)
    chain, system, q = problem.chain, problem.system, problem.start().hi
    assert system.potential(system.shape(q)) == pytest.approx(by_polynomials(chain, q), rel=1e-13)
    cubic = np.polynomial.Polynomial([0.3, -1.2, 0.7, 0.4])
    if ends == "springs":  # Simpson's sum
        assert chain.w @ cubic(chain.s) == pytest.approx(cubic.integ()(chain.length), rel=1e-13)
    assert chain.w.sum() == pytest.approx(chain.length)
    edges = chain.k * 2 * np.arange(4)[:, None]
    np.testing.assert_allclose(chain.middles, (edges + chain.k * (1 + POINTS)).ravel(), rtol=1e-14)


@both
def test_mean_force_times_step_is_the_change_of_the_potential(ends):
    problem = elements(ends)
    system, q = problem.system, problem.start().hi
    shape, step = system.shape(q), 0.4 * np.random.default_rng(3).standard_normal(q.shape)
    gained = system.potential(system.shape(q + step)) - system.potential(shape)
    assert np.vdot(system.mean_force(system.secant(shape, step)), step) == pytest.approx(gained, rel=1e-12)
    np.testing.assert_allclose(system.moved(shape, step).d, system.shape(q + step).d, rtol=0, atol=1e-13)
    small = 1e-6 * np.eye(q.size).reshape(q.size, *q.shape)
    slopes = [by_polynomials(problem.chain, q + d) - by_polynomials(problem.chain, q - d) for d in small]
    np.testing.assert_allclose(system.gradient(shape), np.reshape(slopes, q.shape) / 2e-6, rtol=0, atol=1e-7)


@both
def test_matrix_of_implicit_steps_is_the_second_derivative_where_nothing_is_strained(ends):
    """Viscosity too. A wrong matrix would change the number of sweeps only."""
    problem = elements(ends)
    chain, n = problem.chain, problem.chain.n
    if ends == "ring":  # a straight periodic rod
        chain = replace(chain, shift=(chain.length, 0.0), turns=0)
    state = State(chain.s, 0 * chain.s, 0 * chain.s, 0.0, 0 * chain.s)
    eta = 0.4 * np.asarray(chain.torsion_stiffness)
    problem = Problem(chain, state, 1.0, (Damping(torsion=eta, bending=0.4 * np.asarray(chain.bending_stiffness)),))
    system, q = problem.system, problem.start().hi
    shape, still = system.shape(q), 0 * q
    c, (load,) = system.basis(shape), problem.bound

    def derivative(force):
        steps = 1e-5 * np.eye(2 * n).reshape(2 * n, 2, n)
        return np.array([(force(system.forward(c, p)) - force(system.forward(c, -p))).ravel() for p in steps]) / 2e-5

    stiff = derivative(lambda move: system.back(c, system.gradient(system.moved(shape, move))))
    damped = derivative(lambda v: -system.back(c, load.force(0.0, q, v)))
    for g, d in ((0.3, 0.0), (0.3, 0.7)):
        rows = [system.solve(system.secant(shape, still), c, g, p.reshape(2, n), d).ravel() for p in np.eye(2 * n)]
        np.testing.assert_allclose(np.linalg.inv(rows), np.eye(2 * n) + g * stiff + d * damped, rtol=0, atol=1e-6)


@both
@pytest.mark.parametrize("engine", ["compiled", "plain"])
def test_energy_and_work_balance_to_rounding(ends, engine, kernels_as_python):
    loads = (
        Damping(rolling=0.1, turning=0.2, torsion=0.3, bending=lambda s: 0.1 + 0.1 * s),
        Torque(0.3, signals.sine(1.0, 2.0)),
        Force(0.1, 0.2, at=1.0),
        Rest(twist=0.2, curvature=lambda s: 0.3 * s),
        Rest(twist=0.3, curvature=0.2, signal=signals.sine(0.5, 3.0)),
    )
    free = simulate(elements(ends), EXACT, 0.02, frames=3, progress=False, engine=engine)
    assert np.abs(free.energy / free.energy[0] - 1).max() < 1e-13
    kept = loads if engine == "plain" else (Damping(rolling=0.1, turning=0.2), *loads[1:])  # viscosity has no compiled form
    loaded = simulate(elements(ends, loads=kept), EXACT, 0.02, frames=3, progress=False, engine=engine)
    assert loaded.dissipated[-1] > 0.01
    assert np.abs(loaded.energy - loaded.energy[0] - loaded.work + loaded.dissipated).max() < 1e-12
    assert free.stats["engine"] == loaded.stats["engine"] == engine


def test_viscosity_and_rest_shapes_act_at_strain_points():
    """The power of viscosity is the sum over Gauss's points of eta omega'^2; a chain bent as at rest has no energy."""
    problem = elements(loads=(Damping(torsion=0.3, bending=0.2),))
    v = np.random.default_rng(4).standard_normal((4, 9))
    expected = 0.0
    for row, eta in ((2, 0.3), (3, 0.2)):
        for e in range(4):
            slope = np.polynomial.Polynomial.fit([-1, 0, 1], v[row, 2 * e : 2 * e + 3], 2, [-1, 1]).deriv()(POINTS)
            expected += eta * (slope**2).sum() / problem.chain.k
    (bound,) = problem.bound
    assert bound.power(0.0, problem.start().hi, v) == (0.0, pytest.approx(expected, rel=1e-13))
    assert -np.vdot(bound.force(0.0, problem.start().hi, v), v) == pytest.approx(expected, rel=1e-13)
    chain = elements("ring").chain  # closed by its turn
    turn = 2 * np.pi * chain.s / chain.length
    a = chain.length / (2 * np.pi)
    state = replace(elements("ring").initial, x=a * np.cos(turn), y=a * np.sin(turn), theta=0 * turn, phi=turn + np.pi / 2)
    loose = replace(chain, stretch_stiffness=0.0, shear_stiffness=0.0)
    still = Problem(loose, replace(state, omega=0.0, phi_rate=0.0), 1.0, (Rest(curvature=1 / a),))
    assert still.energy() == pytest.approx(0.0, abs=1e-13)
    assert np.abs(still.system.gradient(still.system.shape(still.start().hi)) - still.bound[0].constant).max() < 1e-13


@both
@pytest.mark.filterwarnings("ignore:.*energy is conserved, but")  # one sweep of Gauss methods is not yet a step
def test_twins_agree(ends, kernels_as_python):
    """Elements of several tiles of links, and one; converged, and after one sweep, where the matrix it solves with matters."""
    for n in (6, 132) if ends == "ring" else (3, 5, 131):
        problem = uneven(n, Model(ends, "steered"))
        problem = replace(problem, chain=replace(problem.chain, degree=2))
        for method in (EXACT, Midpoint(tolerance=0, sweeps=1), Gauss4(tolerance=1e-13), Gauss4(tolerance=0, sweeps=1)):
            a, b = (simulate(problem, method, 2e-3, [0.0, 4e-3], ("contact_force",), False, e) for e in ("compiled", "plain"))
            for name in ("x", "y", "theta", "phi", "omega", "phi_rate", "energy", "contact_force"):
                expected = getattr(b, name)
                close = 1e-12 * max(1.0, np.abs(expected).max())
                np.testing.assert_allclose(getattr(a, name), expected, rtol=0, atol=close, err_msg=f"n = {n}, {method}")
            assert abs(a.stats["solves"] - b.stats["solves"]) <= 0.1 * b.stats["solves"], (n, method)
            assert (a.stats["engine"], b.stats["engine"]) == ("compiled", "plain")


def test_a_motor_holds_the_middle_disc_of_an_element():
    problem = elements()
    omega = np.array(problem.initial.omega)
    omega[3] = 0.0
    problem = replace(problem, initial=replace(problem.initial, omega=omega), loads=(Motor(0.0, at=problem.chain.s[3]),))
    run = simulate(problem, EXACT, 0.02, frames=3, progress=False, engine="plain")
    assert np.abs(run.omega[:, 3]).max() < 1e-13
    assert np.abs(run.energy - run.energy[0]).max() < 1e-12


def test_runs_are_saved_with_their_degree(tmp_path):
    run = simulate(
        elements(duration=0.1), "midpoint", 0.05, frames=2, progress=False, engine="plain", checkpoint=tmp_path / "run.nc"
    )
    again = load(tmp_path / "run.nc")
    assert again.problem.chain.degree == 2
    assert again.y.tobytes() == run.y.tobytes()
    assert untwisting_chain(9, "own", degree=2).chain.degree == 2


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: untwisting_chain(8, "own", degree=2), r"n \(discs, ends='springs', degree=2\) must be odd, .*; got 8: take 9"),
        (lambda: replace(elements("ring").chain, n=9), "must be even, as each element of a ring adds two; got 9: take 10"),
        (lambda: untwisting_chain(9, "own", degree=3), r"degree must be 1 .* or 2 \(three to an element\); got 3"),
        (lambda: untwisting_chain(9, "own", degree=1.5), "degree must be a whole number; got 1.5"),
        (lambda: untwisting_chain(9, "field", degree=2), "degree=2 needs discs with headings of their own"),
        (lambda: semidiscretise(untwisting_rod(), 9, "springs", 2), "degree=2 needs discs with headings of their own"),
        (lambda: semidiscretise(steered_rod(), 8, "springs", 2), "take 9"),
    ],
)
def test_what_makes_no_elements_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
