"""Tangents of steps, their transposes, and Lyapunov exponents."""

from dataclasses import replace

import numpy as np
import pytest

from discs import Chain, Problem, SimulationError, State, simulate
from discs.__main__ import main
from discs.analysis import lyapunov, modes
from discs.analysis.linear import Linearised
from discs.analysis.parameters import Parameters
from discs.analysis.secants import Secant
from discs.analysis.sparse_tangent import tangent
from discs.analysis.stages import Equations
from discs.analysis.steps import Steps, Taken
from discs.analysis.swept import Swept, sweeps
from discs.analysis.tangent import METHODS, Flow
from discs.chains.twist import untwisting_chain
from discs.differences import slope
from discs.integrators import find
from discs.integrators.tableaux import tableau
from discs.loads import Damping, Motor, Rest, Slope, Torque, signals
from discs.skew import Phase
from tests.conftest import Model, models, uneven

pytestmark = pytest.mark.slow  # steps with sparse factors

LOADS = Slope(0.2, -0.4), Damping(rolling=0.3, torsion=0.1), Torque(0.3, signals.sine(1.0, 2.0)), Rest(curvature=0.4)
CHAINS = [Model("consistent", "field"), Model("ring", "unit"), Model("springs", "true"), Model("ring", "steered")]


def loaded(model):
    problem = uneven(6, model)
    omega = float(np.broadcast_to(problem.initial.omega, 6)[2])
    loads = (
        Damping(rolling=0.2, torsion=0.3, bending=0.1),
        Torque(0.5, signals.sine(1.0, 2.0, 0.3)),
        Rest(curvature=0.3),
        Motor(lambda t: omega + 0.2 * np.sin(t), at=problem.chain.s[2]),
    )
    return replace(problem, loads=loads)


@pytest.mark.parametrize("method", ["midpoint", "gauss4", "gauss8"])
@models(CHAINS)
def test_tangent_is_the_derivative_of_the_step(model, method):
    problem = loaded(model)
    flow, h, t = Flow(problem, method), 0.05, 0.3
    _, tangent = flow.step(flow.start, t, h)
    w, v = np.random.default_rng(2).normal(size=(2, flow.start.size))
    right = slope(lambda size: flow.step(flow.start + size * v, t, h)[0], 0.3)
    np.testing.assert_allclose(tangent.forward(v), right, rtol=0, atol=1e-8 * np.abs(right).max())
    assert w @ tangent.forward(v) == pytest.approx(tangent.back(w) @ v, rel=1e-12)


@pytest.mark.parametrize("h", [0.0, 0.05, 0.9])
@pytest.mark.parametrize(("law", "degree"), [("steered", 1), ("steered", 2), ("true", 1)])
@pytest.mark.parametrize("ends", ["springs", "ring"])
def test_matrix_with_a_secant_is_the_derivative_of_its_rates(ends, law, degree, h):
    """For steps of any size, in which links turn by small and by large angles."""
    problem, rng = uneven(6 if ends == "ring" else 7, Model(ends, law)), np.random.default_rng(4)
    rest = Rest(curvature=0.3, stretch=0.1, shear=0.2) if law == "steered" else Rest(curvature=0.3)
    loads = Slope(0.2, -0.4), Damping(rolling=0.3), Torque(0.3, signals.sine(1.0, 2.0)), rest
    problem = replace(problem, chain=replace(problem.chain, degree=degree) if degree == 2 else problem.chain, loads=loads)
    z = problem.start()

    def at(y):
        q, pi = y[: z.hi.size].reshape(z.hi.shape), y[z.hi.size :].reshape(z.pi.shape)
        return Secant(problem, Phase(q, np.zeros_like(q), pi), 0.3, h)

    y = np.concatenate([z.hi.ravel(), z.pi.ravel()])
    y += 0.02 * rng.normal(size=y.size)
    v, lin = rng.normal(size=y.size), at(y)
    right = slope(lambda size: at(y + size * v).rate, 0.3)
    np.testing.assert_allclose(lin.matrix @ v, right, rtol=0, atol=1e-10 * np.abs(right).max())
    plain = Linearised(problem, lin.z, 0.3)
    same = abs(lin.matrix - plain.matrix).max() < 1e-10 * abs(plain.matrix).max()
    assert same == (h == 0)


def test_exponents_with_a_secant_are_near_those_of_gauss_steps():
    problem = replace(uneven(4, Model("springs", "steered")), duration=0.5)
    secant, gauss = (lyapunov(problem, count=2, dt=0.025, method=method, every=1) for method in ("midpoint", "gauss4"))
    np.testing.assert_allclose(secant.growth, gauss.growth, atol=0.03 * np.abs(gauss.growth).max())


@pytest.mark.parametrize("stages", [1, 2, 4])
@models([Model("springs", "field"), Model("consistent", "unit"), Model("ring", "field")])
def test_sweeps_solve_the_systems_of_sparse_matrices(model, stages, kernels_as_python):
    sweeps_are_sparse_matrices(uneven(9, model), stages)


@pytest.mark.parametrize("stages", [2, 3])
@pytest.mark.parametrize("degree", [1, 2])
@models([Model("springs", "steered"), Model("ring", "steered")])
def test_sweeps_of_own_headings_solve_the_systems_of_sparse_matrices(model, degree, stages, kernels_as_python):
    """Their second derivatives change with the state."""
    problem = uneven(9 if model.ends == "springs" else 8, model)
    loads = LOADS if degree == 1 else (Slope(0.2, -0.4), Damping(rolling=0.3), *LOADS[2:])
    sweeps_are_sparse_matrices(replace(problem, chain=replace(problem.chain, degree=degree)), stages, loads)


def sweeps_are_sparse_matrices(problem, stages, loads=LOADS):
    """Those of steps and of their transposes, through two steps with something added between; with loads for several stages."""
    rng, rule, h, n = np.random.default_rng(3), tableau(stages), 0.05, problem.chain.n
    if stages > 1:
        problem = replace(problem, loads=loads)
    start = problem.start()
    rows, columns = len(start.hi), np.atleast_2d(start.pi).shape[0]
    q, size = start.hi + 1e-2 * rng.normal(size=(2, stages, rows, n)), (rows + columns) * n
    taken = Taken(start, q, rng.normal(size=(2, stages, columns, n)), 0)
    swept = swept_of(problem, rule)
    first, second = (by_matrices(swept, taken, k, 0.3, h) for k in (0, 1))
    w, v, kick = rng.normal(size=(3, size))
    value = w.copy()
    done, sums, passed = swept.back(taken, 0.3, h, 2, value, {0: kick}, True)
    middle = second.back(w) + kick
    assert done == 2
    np.testing.assert_allclose(value, first.back(middle), atol=1e-11)
    names = ("density", "spin_inertia", "radius", *["heading_inertia"] * (rows == 4), "bending_stiffness")
    there, plain = Parameters(swept.equations, names), Parameters(Equations(problem), names)
    there.add(sums, passed)
    for k, step, after in ((0, first, middle), (1, second, w)):
        at = Equations(problem).at(q[k], taken.pi[k], 0.3 + h * (k + rule.nodes))
        m = step.rates_back(after, step.stages_back(after))
        plain.add_stages(at, m)
        part = slice(k * stages, (k + 1) * stages)
        nu = m[:, rows * n :].reshape(stages, -1, n)
        np.testing.assert_allclose(passed.w[part], at.c * nu[:, np.arange(rows) // 3], atol=1e-11)
        np.testing.assert_allclose(passed.velocity[part], at.velocity, atol=1e-13)
    for name, found in plain.found().items():
        np.testing.assert_allclose(there.found()[name], found, atol=1e-11, err_msg=name)
    one = Swept(swept, taken._replace(q=q[:1], pi=taken.pi[:1]), 0.3, h)
    both = np.stack([v, w], axis=1)
    np.testing.assert_allclose(one.forward(both), first.forward(both), atol=1e-11)
    np.testing.assert_allclose(one.back(both), first.back(both), atol=1e-11)


def test_sweeps_that_do_not_converge_leave_it_to_sparse_matrices(kernels_as_python):
    """A rough state: the directions of rolling change from disc to disc faster than a sweep can follow."""
    problem, rng, rule = uneven(9, Model("springs", "field")), np.random.default_rng(3), tableau(1)
    q, swept = problem.start().hi + 0.3 * rng.normal(size=(1, 1, 3, 9)), swept_of(problem, rule)
    taken = Taken(problem.start(), q, 20 * rng.normal(size=(1, 1, 1, 9)), 0)
    sparse, w = by_matrices(swept, taken, 0, 0.0, 1.0), rng.normal(size=36)
    assert not swept.forward(taken, 0.0, 1.0, w[None].copy())
    assert swept.back(taken, 0.0, 1.0, 1, w.copy(), {}, False)[0] == 0
    one = Swept(swept, taken, 0.0, 1.0)
    np.testing.assert_array_equal(one.forward(w), sparse.forward(w))
    np.testing.assert_array_equal(one.back(w), sparse.back(w))


def swept_of(problem, rule):
    """Sweeps through steps of the Gauss method with this tableau."""
    return sweeps(Steps(problem, find("midpoint" if rule.b.size == 1 else f"gauss{2 * rule.b.size}"), True))


def by_matrices(swept, taken, k, t, h):
    """The tangent of step k of those that were taken from the time t."""
    rule = swept.steps.rule
    return tangent(rule, h, swept.equations.each(taken.q[k], taken.pi[k], t + h * (k + rule.nodes)))


@pytest.mark.parametrize("method", METHODS)
def test_steps_are_those_of_the_integrators(method):
    problem = replace(
        uneven(7, Model("springs", "field")), duration=0.5, loads=(Damping(rolling=0.3), Torque(0.2, signals.ramp(0.0, 0.5)))
    )
    flow, y = Flow(problem, method), Flow(problem, method).start
    for i in range(10):
        y, _ = flow.step(y, 0.05 * i, 0.05)
    run = simulate(problem, method, 0.05, 2, progress=False, engine="plain")
    np.testing.assert_allclose(y[:21].reshape(3, 7), [run.x[-1], run.y[-1], run.theta[-1]], atol=1e-11)


def test_steps_too_long_are_refused():
    flow = Flow(uneven(6, Model("ring", "unit")))
    with pytest.raises(SimulationError, match=r"did not converge.*smaller dt"):
        flow.step(flow.start, 0.0, 50.0)


def test_midpoint_steps_do_not_keep_the_volume():
    """The flow keeps it. Gauss methods do to their order: the determinant of a step differs from 1 by O(h^3) and O(h^5)."""
    problem = uneven(6, Model("springs", "field"))
    for method, order in (("midpoint", 3), ("gauss4", 5)):
        flow, off = Flow(problem, method), []
        for h in (0.04, 0.02, 0.01):
            _, tangent = flow.step(flow.start, 0.0, h)
            off.append(abs(np.linalg.det(tangent.forward(np.eye(flow.start.size))) - 1))
        assert off[0] > 1e-12
        assert abs(np.log2(off[1] / off[2]) - order) < 0.6, off


def rolling_ring(omega, loads=()):
    chain = Chain(
        n=5,
        length=4.0,
        density=1.3,
        spin_inertia=0.9,
        torsion_stiffness=0.8,
        bending_stiffness=0.7,
        radius=0.8,
        ends="ring",
        shift=(4.0, 0.0),
    )
    return Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s, omega), 20.0, loads)


def test_exponents_of_a_steady_motion_are_the_rates_of_its_modes():
    problem = rolling_ring(0.6)
    fastest = np.sort(modes(problem, count=16).rate.real)[-2:]
    found = lyapunov(problem, count=2, dt=0.15, method="midpoint")
    late = found.growth[-15:].mean(axis=0) / (5 * found.dt)  # the vectors have turned to their directions
    np.testing.assert_allclose(late, fastest, rtol=0.03)
    assert 1 < found.horizon(1e-10, 1e-4) * fastest[0] / np.log(1e6) < 1.4


def test_sum_of_exponents_is_the_rate_of_the_volume():
    """That of the steps: a midpoint step multiplies a mode by (1 + h sigma/2)/(1 - h sigma/2)."""
    problem = rolling_ring(0.0, (Damping(rolling=0.6),))
    found = lyapunov(problem, count=20, dt=0.2, method="midpoint")
    rates = 0.5 * found.dt * modes(problem, count=9).rate
    assert found.exponent.sum() == pytest.approx(np.log(np.abs((1 + rates) / (1 - rates))).sum() / found.dt, rel=1e-6)
    assert found.exponent[0] < 0.02
    assert found.horizon() == np.inf


def test_spectrum_of_a_chain_is_symmetric():
    """Without dampers the exponents add up to zero, and come in pairs to their errors."""
    problem = untwisting_chain(4, "unit", duration=60.0)
    problem = replace(problem, initial=replace(problem.initial, omega=np.array([1.0, 0.5, 1.2, 0.7])))
    found = lyapunov(problem, count=16, dt=0.2, method="midpoint")
    assert abs(found.exponent.sum()) < 1e-3
    off = found.exponent + found.exponent[::-1]
    assert (np.abs(off) < found.error + found.error[::-1]).all()
    assert (found.error < 0.3).all()
    assert found.finite.shape == found.growth.shape == (60, 16)


@pytest.mark.parametrize("omega", [0.0, 0.6])
def test_error_bars_cover_the_exponents_of_a_regular_motion(omega):
    """By the unit law a straight ring is stable: all exponents are zero, while changes grow like t and vectors turn slowly."""
    problem = rolling_ring(omega)
    problem = replace(problem, chain=replace(problem.chain, rolling="unit"), duration=120.0)
    found = lyapunov(problem, count=20, dt=0.2, method="midpoint")
    off = np.abs(found.exponent) / found.error
    assert (off < 1).mean() >= 0.9  # 18 of 20; a part of the bar is a standard error
    assert (off < 1.5).all()
    assert found.exponent[0] > 0.01  # the transient, which the bar must contain
    assert (found.error < 0.15).all()


def test_error_bars_cover_the_rates_of_an_unstable_motion():
    problem = replace(rolling_ring(0.6), duration=40.0)
    fastest = np.sort(modes(problem, count=16).rate.real)[-2:]
    found = lyapunov(problem, count=2, dt=0.15, method="midpoint")
    assert (np.abs(found.exponent - fastest) < found.error).all()
    assert (found.error < 0.3 * fastest).all()


def test_bad_input():
    problem = untwisting_chain(5)
    with pytest.raises(ValueError, match=r"count must be at most 20.*got 21"):
        lyapunov(problem, count=21)
    with pytest.raises(ValueError, match=r"duration must be at least 20 intervals of 5 steps, 50, for an error bar; got 4\.5"):
        lyapunov(problem, dt=0.5)
    with pytest.raises(ValueError, match="lyapunov takes a Problem"):
        lyapunov(problem.chain)
    with pytest.raises(ValueError, match=r"method \(with tangents\) must be one of .*got 'rk4'"):
        lyapunov(problem, method="rk4")
    found = lyapunov(replace(problem, duration=2.0), dt=0.02)
    with pytest.raises(ValueError, match="tolerance must be"):
        found.horizon(tolerance=-1.0)


def test_exponents_on_the_command_line(capsys):
    assert main(["lyapunov", "--n", "4", "--t", "10", "--dt", "0.1", "--count", "2", "--rolling", "unit"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert len(out) == 3
    assert "+-" in out[0]
    assert main(["lyapunov", "--n", "4", "--t", "1", "--dt", "0.1"]) == 2
    assert "take a longer duration" in capsys.readouterr().err
