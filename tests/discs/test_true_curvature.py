"""The compiled form of the true curvature: exact secants of steps of any size, and the plain form."""

from dataclasses import replace

import numpy as np
import pytest

from discs import simulate
from discs.chains.links import true
from discs.kernels import protocol as do
from discs.kernels.slaved import close_ends
from discs.loads import Damping, Rest
from tests.conftest import TRUE, Model, models, uneven


def steps(model, bent, turn):
    """A chain; links before a step and in its middle, as compiled code has them, with random bends and turns up to these angles."""
    problem, rng = uneven(9, model), np.random.default_rng(4)
    chain, system = problem.chain, replace(problem, loads=(Rest(curvature=0.3),)).system
    links, given = chain.n - (not system.closed), system.parameters
    before, d = np.zeros((2, 3, chain.n + 1))
    size = chain.k * rng.uniform(0.6, 1.5, (2, links))
    angle = np.cumsum(rng.uniform(-bent, bent, links))
    after = angle + rng.uniform(-turn, turn, links)
    start = np.array([size[0] * np.cos(angle), size[0] * np.sin(angle), rng.normal(size=links)])
    end = np.array([size[1] * np.cos(after), size[1] * np.sin(after), rng.normal(size=links)])
    before[:, 1 : links + 1], d[:, 1 : links + 1] = start, 0.5 * (start + end)
    for each in (before, d):
        close_ends(given.ends, each)
    return system, given, before, d, start, end


@models(TRUE)
@pytest.mark.parametrize(("bent", "turn"), [(0.09, 0.09), (0.3, 0.2), (1.0, 1.0), (3.1, 3.1)])
def test_the_compiled_tension_of_a_step_is_that_of_its_change_of_energy(model, bent, turn):
    """tension . (change of the links) = change of V, unless a bend passes half a turn; and it is the plain form's."""
    system, given, before, d, start, end = steps(model, bent, turn)
    law, g, links = system._springs, np.full_like(d, np.nan), start.shape[1]
    do.tension(given.links, given.ends, before, d, g)
    found = g[:, 1 : links + 1]
    assert do.elastic(given.links, before) == pytest.approx(law.potential(start), rel=1e-13)
    if bent + 2 * turn < np.pi:
        gain = law.potential(end) - law.potential(start)
        assert np.vdot(found, end - start) == pytest.approx(gain, rel=1e-10, abs=1e-11 * law.potential(end))
    plain = law.tension(law.secant(start, end - start))
    np.testing.assert_allclose(found, plain, rtol=1e-10, atol=1e-12 * abs(plain).max())
    assert (g[:, [0, -1]] == (0 if not system.closed else g[:, -1:])).all()  # ghost links have none


@models(TRUE)
def test_the_compiled_matrix_is_that_of_the_springs(model):
    """I + g C^T B^T (stiffness) B C, entry by entry against the plain form's bands."""
    system, given, before, d, start, end = steps(model, 0.5, 0.3)
    n, c = system.n, np.random.default_rng(5).normal(size=(3, system.n))
    m = do.workspace(given).matrix
    do.assemble(given.links, given.ends, before, d, c, 1.0, 0.2, m)
    found = np.zeros((n, n))
    for i in range(n):
        for apart, values in enumerate((m.a, m.u, m.w)):
            if system.closed or i + apart < n:
                found[i, (i + apart) % n] = found[(i + apart) % n, i] = values[i]
    bands = 0.2 * system.stiffness(system._springs.secant(start, end - start), c)
    order, expected = np.arange(n) if system.order is None else system.order, np.eye(n)
    for apart in range(len(bands)):
        for j in range(apart, n):
            a, b = order[j - apart], order[j]
            expected[a, b] += bands[-1 - apart, j]
            expected[b, a] = expected[a, b]
    np.testing.assert_allclose(found, expected, atol=1e-12 * abs(expected).max())


def test_small_angles_by_their_series():
    for size in (1e-12, 0.03, 0.0999, 0.1001, 2.0, 3.1):
        for angle in (size, -size):
            assert true.opening(2 * np.sin(angle), 2 * np.cos(angle)) == pytest.approx(angle / (2 * np.sin(angle)), rel=4e-16)
    folded = np.array([[1.0, -1.0, 1.0], [0.0, 0.0, 1.0]])
    assert abs(true.turned(folded, 0)) == np.pi


@models(TRUE)
def test_a_rest_curvature_is_compiled_too(model):
    problem = uneven(8, model)
    rest = np.linspace(-0.4, 0.6, problem.chain.bend_shares.size)
    problem, times = replace(problem, loads=(Rest(curvature=rest), Damping(rolling=0.2))), np.array([0.0, 0.05])
    a, b = (simulate(problem, "midpoint", 0.004, times, engine=engine, progress=False) for engine in ("compiled", "plain"))
    assert (a.stats["engine"], b.stats["engine"]) == ("compiled", "plain")
    for row in ("x", "y", "theta", "omega", "energy", "dissipated"):
        np.testing.assert_allclose(getattr(a, row), getattr(b, row), atol=1e-12, err_msg=row)
    assert abs(a.energy - a.energy[0] + a.dissipated).max() < 1e-11


def test_viscosity_of_bending_is_plain():
    problem = replace(uneven(7, Model("springs", "true")), loads=(Damping(bending=0.1),))
    run = simulate(problem, "midpoint", 0.05, 1, engine="compiled", progress=False)
    assert run.stats["plain_because"] == "Damping has no compiled form here"
