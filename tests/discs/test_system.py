"""The equations of motion against independent derivations, on uneven chains of every kind."""

import numpy as np
import pytest

from discs import Chain, Problem
from tests.conftest import ALL, SLAVED, models, uneven

N = 8


def quantities(problem: Problem):
    system, z = problem.system, problem.start()
    return system, z, system.shape(z.hi, z.lo)


def directional(f, q, v, eps=1e-6):
    """Central difference of f at q along v."""
    return (f(q + eps * v) - f(q - eps * v)) / (2 * eps)


def strains(problem: Problem, q):
    """(stiffness, strain) of every spring, written out from the definitions with ghosts in place of stencils."""
    chain, k, n = problem.chain, problem.chain.k, problem.chain.n
    ring = chain.ends == "ring"
    turn = 2 * np.pi * getattr(chain, "turns", 0)
    r, theta = q[:2], q[2]
    found = [(beta * k, (theta[(i + 1) % n] - theta[i]) / k) for i, beta in enumerate(chain.torsion_stiffness)]
    if not isinstance(chain, Chain):
        for i, (stretch, shear, bend) in enumerate(
            zip(chain.stretch_stiffness, chain.shear_stiffness, chain.bending_stiffness, strict=True)
        ):
            last = q[3, (i + 1) % n] + (turn if i == n - 1 else 0.0)
            mean = (q[3, i] + last) / 2
            dx, dy = (r[:, (i + 1) % n] - r[:, i]) / k
            found.append((stretch * k, np.cos(mean) * dx + np.sin(mean) * dy - 1))
            found.append((shear * k, np.cos(mean) * dy - np.sin(mean) * dx))
            found.append((bend * k, (last - q[3, i]) / k))
        return found
    first = 0 if len(chain.bending_stiffness) == n else 1
    for b, stiffness in enumerate(chain.bending_stiffness):
        i = b + first
        before, after = r[:, i - 1], r[:, (i + 1) % n]
        if chain.curvature == "true":
            a, c = complex(*(r[:, i] - before)), complex(*(after - r[:, i]))
            found.append((stiffness * k, np.angle(c / a) / k))
            continue
        share = k
        if not ring and i == 0:
            before, share = 4 * r[:, 0] - 6 * r[:, 1] + 4 * r[:, 2] - r[:, 3], k / 2
        if not ring and i == n - 1:
            after, share = 4 * r[:, -1] - 6 * r[:, -2] + 4 * r[:, -3] - r[:, -4], k / 2
        found += [(stiffness * share, component) for component in (after - 2 * r[:, i] + before) / k**2]
    if chain.curvature == "true":
        for i, stretch in enumerate(chain.stretch_stiffness):
            found.append((stretch * k, np.hypot(*(r[:, (i + 1) % n] - r[:, i])) / k - 1))
    return found


def potential_from_the_definition(problem: Problem, q):
    return 0.5 * sum(stiffness * strain**2 for stiffness, strain in strains(problem, q))


@models(ALL)
def test_potential_and_gradient(model):
    problem = uneven(N, model)
    system, z, shape = quantities(problem)
    assert system.potential(shape) == pytest.approx(potential_from_the_definition(problem, z.hi), rel=1e-12)
    gradient = system.gradient(shape)
    for row in range(len(system.rows)):
        for i in range(N):
            v = np.zeros_like(z.hi)
            v[row, i] = 1
            slope = directional(lambda q: potential_from_the_definition(problem, q), z.hi, v, 1e-5)
            assert gradient[row, i] == pytest.approx(slope, abs=1e-7 * np.abs(gradient).max())


@models(ALL)
def test_mean_force_does_the_work_of_a_step(model):
    """D . (q_1 - q_0) = V(q_1) - V(q_0) for large steps, and D is the same backwards."""
    system, z, shape = quantities(uneven(N, model))
    dq = 0.2 * np.random.default_rng(3).standard_normal(z.hi.shape)
    after = system.moved(shape, dq)
    forth = system.mean_force(system.secant(shape, dq))
    difference = system.potential(after) - system.potential(shape)
    assert np.vdot(forth, dq) == pytest.approx(difference, rel=1e-12)
    np.testing.assert_allclose(system.mean_force(system.secant(after, -dq)), forth, atol=1e-11 * np.abs(forth).max())
    # a control: the force at the middle does the work only if V is quadratic
    middle = np.vdot(system.gradient(system.moved(shape, dq / 2)), dq)
    assert (abs(middle / difference - 1) < 1e-10) == system.quadratic


@pytest.mark.parametrize("sign", [1, -1])
@models(ALL)
def test_skew_gradient_form_is_lagrange_d_alembert(model, sign):
    """Accelerations from the saddle point of multipliers; with the paper's misprinted sign (plus e.lambda) they must differ."""
    problem = uneven(N, model)
    system, z, shape = quantities(problem)
    n, rows, omega = N, len(system.rows), np.asarray(problem.initial.omega)
    e = contact_from_the_definition(problem, z.hi)
    velocity = np.array([*(e * omega), omega, np.asarray(problem.initial.phi_rate)][:rows])
    turned = directional(lambda q: contact_from_the_definition(problem, q), z.hi, velocity)  # e.
    # M q.. - A^T lambda = -grad V,  A q.. = e. omega,  with rows (r. - e theta.) of A and signs of its transpose by hand
    a = np.zeros((2 * n, rows * n))
    a[:, : 2 * n] = np.eye(2 * n)
    a[:, 2 * n : 3 * n] = -np.vstack([np.diag(e[0]), np.diag(e[1])])
    forces = a.T.copy()
    forces[2 * n : 3 * n] *= sign
    saddle = np.block([[np.diag(system.weights.ravel()), -forces], [a, np.zeros((2 * n, 2 * n))]])
    rhs = np.concatenate([-system.gradient(shape).ravel(), (turned * omega).ravel()])
    unknowns = np.linalg.solve(saddle, rhs)
    acceleration, multipliers = unknowns[2 * n : rows * n], unknowns[rows * n :].reshape(2, n)
    ground = system.contact_force(shape, velocity)
    slip = np.abs(multipliers - ground).max() / np.abs(ground).max()
    # pi = root rate, root^2 the inertia: rate. = (pi. - root. rate)/root
    rates = velocity[2:]

    def roots(q):
        return system.momentum(system.shape(q), np.ones((2, n))).reshape(-1, n)

    force = -system.back(system.basis(shape), system.gradient(shape)).reshape(-1, n)
    reduced = (force - directional(roots, z.hi, velocity) * rates) / roots(z.hi)
    difference = np.abs(acceleration - reduced.ravel()).max() / np.abs(reduced).max()
    if sign == 1:
        assert difference < 1e-8  # central differences with step 1e-6
        assert slip < 1e-8
        # the ground does no work: its force on r and its torque -e.lambda on theta, on the actual motion
        power = (ground * velocity[:2]).sum(axis=0) - (e * ground).sum(axis=0) * omega
        assert np.abs(power).max() < 1e-12
    else:
        assert slip > 1e-2
        assert difference > 1e-2


def contact_from_the_definition(problem: Problem, q):
    """e = R J r' (field), R J r'/|r'| (unit, true), R (-sin phi, cos phi), with ghosts in place of stencils; (2, n)."""
    chain, k = problem.chain, problem.chain.k
    radius = np.asarray(chain.radius)
    if not isinstance(chain, Chain):
        return radius * np.array([-np.sin(q[3]), np.cos(q[3])])
    r = q[:2]
    if chain.ends == "ring":
        slope = (np.roll(r, -1, axis=1) - np.roll(r, 1, axis=1)) / (2 * k)
    else:
        inner = (r[:, 2:] - r[:, :-2]) / (2 * k)
        if chain.ends == "consistent":
            first = r[:, 1] - (4 * r[:, 0] - 6 * r[:, 1] + 4 * r[:, 2] - r[:, 3])
            last = (4 * r[:, -1] - 6 * r[:, -2] + 4 * r[:, -3] - r[:, -4]) - r[:, -2]
        else:
            first, last = -3 * r[:, 0] + 4 * r[:, 1] - r[:, 2], 3 * r[:, -1] - 4 * r[:, -2] + r[:, -3]
        slope = np.column_stack([first / (2 * k), inner, last / (2 * k)])
    if chain.rolling == "unit":
        slope = slope / np.hypot(*slope)
    return radius * np.array([-slope[1], slope[0]])


@models(ALL)
def test_contact_direction(model):
    problem = uneven(N, model)
    system, z, shape = quantities(problem)
    np.testing.assert_allclose(system.contact(shape), contact_from_the_definition(problem, z.hi), atol=1e-14)


@models(ALL)
def test_energy_is_constant_along_the_flow(model):
    """dH/dt by differences of |pi|^2/2 + V along (q., pi.), V from its definition."""
    problem = uneven(N, model)
    system, z, shape = quantities(problem)
    c = system.basis(shape)
    q_rate, pi_rate = system.forward(c, z.pi), -system.back(c, system.gradient(shape))
    power = directional(lambda q: potential_from_the_definition(problem, q), z.hi, q_rate) + np.vdot(z.pi, pi_rate)
    assert abs(power) < 1e-8 * np.abs(z.pi * pi_rate).sum()


@models(ALL)
def test_columns_of_c_are_orthonormal_and_admissible(model):
    system, z, shape = quantities(uneven(N, model))
    c = system.basis(shape)
    p = np.random.default_rng(5).standard_normal(z.pi.shape)
    v = system.forward(c, p)
    np.testing.assert_allclose(system.back(c, system.weights * v), p, rtol=1e-13)
    np.testing.assert_allclose(v[:2], system.contact(shape) * v[2], atol=1e-14)


@pytest.mark.parametrize("n", [5, 6, 9, 16])
@models(ALL)
def test_banded_solve_is_the_dense_one(model, n):
    """(I + h^2/4 C^T B^T (stiffness) B C) p = pi, with the strains' Jacobian B by differences."""
    problem = uneven(n, model)
    system, z, shape = quantities(problem)
    c, h = system.basis(shape), 0.3
    stiffness = np.array([s for s, _ in strains(problem, z.hi)])

    def strain(q):
        return np.array([s for _, s in strains(problem, q)])

    units = np.eye(z.pi.size).reshape(-1, *z.pi.shape)
    b = np.array([directional(strain, z.hi, system.forward(c, unit), 1e-5) for unit in units]).T
    matrix = np.eye(z.pi.size) + h * h / 4 * b.T @ (stiffness[:, None] * b)
    secant = system.secant(shape, np.zeros_like(z.hi))
    dense = np.linalg.solve(matrix, z.pi.ravel())
    np.testing.assert_allclose(system.solve(secant, c, 0.25 * h * h, z.pi).ravel(), dense, atol=1e-7 * np.abs(dense).max())


def test_springs_without_stiffness_are_not_assembled():
    problem = uneven(9, SLAVED[2])
    chain = problem.chain
    parameters = {name: getattr(chain, name) for name in chain.__dataclass_fields__}
    loose = Problem(type(chain)(**parameters | {"bending_stiffness": 0.0}), problem.initial, 1.0)
    for p, bands in ((problem, 4), (loose, 2)):
        system, _, shape = quantities(p)
        assert len(system.stiffness(shape, system.basis(shape))) == bands
