"""The equations of motion against independent derivations, on uneven chains."""

import numpy as np
import pytest

from discs.problem import Problem
from tests.conftest import uneven


def quantities(problem: Problem):
    system, z = problem.system, problem.start()
    return system, z, system.links(z.hi, z.lo)


def directional(f, q, v, eps=1e-6):
    """Central difference of f at q along v."""
    return (f(q + eps * v) - f(q - eps * v)) / (2 * eps)


def potential_from_the_definition(problem: Problem, q):
    """V spring by spring, written out from its definition with ghosts in place of stencils."""
    chain = problem.chain
    k, n = chain.k, chain.n
    ring = chain.ends == "ring"
    r, theta = q[:2], q[2]
    total = 0.0
    for i, beta in enumerate(chain.torsion_stiffness):
        total += beta / (2 * k) * (theta[(i + 1) % n] - theta[i]) ** 2
    first = 0 if ring or chain.ends == "consistent" else 1
    for b, stiffness in enumerate(chain.bending_stiffness):
        i = b + first
        before, after = r[:, i - 1], r[:, (i + 1) % n]
        half = 1.0
        if not ring and i == 0:
            before, half = 4 * r[:, 0] - 6 * r[:, 1] + 4 * r[:, 2] - r[:, 3], 0.5
        if not ring and i == n - 1:
            after, half = 4 * r[:, -1] - 6 * r[:, -2] + 4 * r[:, -3] - r[:, -4], 0.5
        total += half * stiffness / (2 * k**3) * ((after - 2 * r[:, i] + before) ** 2).sum()
    return total


def test_potential_and_gradient(ends, rolling):
    problem = uneven(8, ends, rolling)
    system, z, d = quantities(problem)
    assert system.potential(d) == pytest.approx(potential_from_the_definition(problem, z.hi), rel=1e-12)
    gradient = system.gradient(d)
    for row in range(3):
        for i in range(8):
            v = np.zeros((3, 8))
            v[row, i] = 1
            slope = directional(lambda q: potential_from_the_definition(problem, q), z.hi, v, 1e-4)
            assert gradient[row, i] == pytest.approx(slope, abs=1e-8 * np.abs(gradient).max())


@pytest.mark.parametrize("sign", [1, -1])
def test_skew_gradient_form_is_lagrange_d_alembert(ends, rolling, sign):
    """theta.. from the saddle point of multipliers; with the paper's misprinted sign (plus e.lambda) it must differ."""
    problem = uneven(8, ends, rolling)
    system, z, d = quantities(problem)
    n, e, omega = 8, system.contact(d), np.asarray(problem.initial.omega)
    velocity = np.array([*(e * omega), omega])
    turned = directional(lambda q: system.contact(system.links(q)), z.hi, velocity)  # e.
    # M q.. - A^T lambda = -grad V,  A q.. = e. omega,  with rows (r. - e theta.) of A and signs of its transpose by hand
    mass, eye, zero = np.diag(system.weights.ravel()), np.eye(n), np.zeros((n, n))
    a = np.block([[eye, zero, -np.diag(e[0])], [zero, eye, -np.diag(e[1])]])
    forces = a.T.copy()
    forces[2 * n :] *= sign
    saddle = np.block([[mass, -forces], [a, np.zeros((2 * n, 2 * n))]])
    rhs = np.concatenate([-system.gradient(d).ravel(), (turned * omega).ravel()])
    multipliers = np.linalg.solve(saddle, rhs)[2 * n : 3 * n]
    # omega. = (sqrt(m) omega). / sqrt(m) - ..., from pi = sqrt(m) omega
    root = np.sqrt(system.inertia(e))
    root_rate = directional(lambda q: np.sqrt(system.inertia(system.contact(system.links(q)))), z.hi, velocity)
    reduced = (-(system.frame(d) * system.gradient(d)).sum(axis=0) - root_rate * omega) / root
    difference = np.abs(multipliers - reduced).max() / np.abs(reduced).max()
    if sign == 1:
        assert difference < 1e-8  # central differences with step 1e-6
    else:
        assert difference > 1e-2


def test_energy_is_constant_along_the_flow(ends, rolling):
    system, z, d = quantities(uneven(8, ends, rolling))
    c, gradient = system.frame(d), system.gradient(d)
    power = np.vdot(c * z.pi, gradient) - z.pi @ (c * gradient).sum(axis=0)
    assert abs(power) < 1e-13 * np.abs(gradient).sum()


@pytest.mark.parametrize("n", [5, 6, 9, 16])
def test_banded_solve_is_the_dense_one(ends, rolling, n):
    system, z, d = quantities(uneven(n, ends, rolling))
    c, h = system.frame(d), 0.3
    columns = [c * unit for unit in np.eye(n)]
    stiffness = np.array([[np.vdot(a, system.gradient(system.increments(b))) for b in columns] for a in columns])
    dense = np.linalg.solve(np.eye(n) + h * h / 4 * stiffness, z.pi)
    np.testing.assert_allclose(system.solve(c, h, z.pi), dense, rtol=1e-10)


def test_springs_without_stiffness_are_not_assembled():
    problem = uneven(9, "consistent", "field")
    chain = problem.chain
    parameters = {name: getattr(chain, name) for name in chain.__dataclass_fields__}
    loose = Problem(type(chain)(**parameters | {"bending_stiffness": 0.0}), problem.initial, 1.0)
    assert len(problem.system._bands[1]) == 4
    assert len(loose.system._bands[1]) == 2
