"""Cell theories on a lattice, with numbers: against the discs' own scheme, exact solutions, and the gradient of the action sum."""

import numpy as np
import pytest
import sympy as sy
from numpy.testing import assert_allclose

from continuum.cells import CellTheory, Constraint, Part, h, i, in_space, k, n, velocity
from continuum.lattice import Lattice
from discs import simulate
from tests.conftest import Model, uneven
from tests.continuum.test_cells import (
    BENDING,
    FIELDS,
    KINETIC,
    ROD,
    ROLLING,
    TORSION,
    K,
    R,
    T,
    X,
    alpha,
    beta,
    half,
    rho,
    s,
    same,
    second,
    t,
    theta,
    u,
    x,
    y,
)

# The discs' own scheme


def numbers(problem, dt):
    chain = problem.chain
    names = {rho: "density", alpha: "spin_inertia", beta: "torsion_stiffness", K: "bending_stiffness", R: "radius"}
    return {symbol: float(np.asarray(getattr(chain, name))[0]) for symbol, name in names.items()} | {h: dt, k: chain.k}


def chain_theory(ends):
    """The rod with the ends of `discs`: headings there from one side; half shares for "springs"."""
    kinetic = [KINETIC] if ends == "paper" else [Part(KINETIC, slice(1, -1)), Part(KINETIC / 2, 0), Part(KINETIC / 2, -1)]
    rolling = list(ROLLING)
    for end, inwards in ((0, 1), (-1, -1)):
        xs, ys = (inwards * (-3 * f[n, i] + 4 * f[n, i + inwards] - f[n, i + 2 * inwards]) / (2 * k) for f in (x, y))
        rolling += [
            Constraint(velocity(x) + R * velocity(theta) * ys, end),
            Constraint(velocity(y) - R * velocity(theta) * xs, end),
        ]
    return CellTheory([*kinetic, TORSION, BENDING], FIELDS, rolling)


@pytest.mark.parametrize("ends", ["ring", "paper", "springs"])
def test_runs_as_the_leapfrog_of_discs(ends):
    """The same scheme written twice: levels agree to rounding, which grows like the number of steps squared."""
    dt, steps = 0.004, 60
    problem = uneven(9, Model(ends, "field"), equal=True)
    run = simulate(problem, "leapfrog", dt, frames=dt * np.arange(steps + 2), progress=False)
    levels = np.stack([run.x, run.y, run.theta], axis=1)
    theory = ROD if ends == "ring" else chain_theory(ends)
    lattice = Lattice(theory, 9, numbers(problem, dt), closed=ends == "ring")
    assert lattice.linear
    assert lattice.n_multipliers == 18
    path = lattice.run(levels[0], levels[1], steps)
    assert np.ptp(levels, axis=0).max() > 0.05  # it moves
    assert_allclose(path.values, levels, rtol=0, atol=1e-15 * steps**2)


def test_ground_forces_are_the_multipliers():
    """-lambda k is the force of the ground on a disc: the central differences' mass times acceleration less the springs'."""
    dt = 0.004
    problem = uneven(9, Model("ring", "field"), equal=True)
    run = simulate(problem, "leapfrog", dt, frames=dt * np.arange(3), progress=False)
    levels = np.stack([run.x, run.y, run.theta], axis=1)
    _, multipliers = Lattice(ROD, 9, numbers(problem, dt), closed=True).step(levels[0], levels[1])
    system = problem.system
    push = system.weights * (levels[2] - 2 * levels[1] + levels[0]) / dt**2 + system.gradient(system.shape(levels[1]))
    assert_allclose(-multipliers.reshape(2, 9) * problem.chain.k, push[:2], rtol=0, atol=1e-9)


def test_step_solves_the_discrete_d_alembert_equations():
    """Ends given by cells: residuals after a step are rounding, which second differences over h^2 make larger."""
    problem = uneven(9, Model("paper", "field"), equal=True)
    lattice = Lattice(chain_theory("paper"), 9, numbers(problem, 0.004))
    q = problem.start().hi
    later = q + 0.004 * np.random.default_rng(3).normal(size=q.shape)
    after, multipliers = lattice.step(q, later)
    equations, constraints = lattice.residual(q, later, after, multipliers)
    assert max(abs(equations).max(), abs(constraints).max()) < 1e-9 * abs(multipliers).max()
    assert lattice.residual(q, later, after)[0].shape == (3, 9)


# Other Lagrangians


STRING = half * rho * ((u[n + 1, i] - u[n, i]) / h) ** 2, -half * T * ((u[n, i + 1] - u[n, i]) / k) ** 2


def test_the_wave_equation_s_five_points():
    expected = -rho * (u[n + 1, i] - 2 * u[n, i] + u[n - 1, i]) / h**2 + T * second(u) / k**2
    assert same(CellTheory(sum(STRING), u).equations()[0], expected)


@pytest.mark.parametrize("ends", ["ring", "pinned", "free"])
def test_standing_waves_of_a_string_have_order_two(ends):
    """Exact cos(w t) times a mode; pinned by a constraint u. = 0 at each end, free with half a share of mass there."""
    length, density, tension, time = 1.7, 1.3, 0.8, 0.9
    q = 2 * np.pi / length
    speed = np.sqrt(tension / density)
    errors = []
    for cells in (20, 40, 80):
        nodes = cells if ends == "ring" else cells + 1
        place = length / cells * np.arange(nodes)
        shape = np.sin(q * place) if ends != "free" else np.cos(q * place)
        steps = cells  # h in proportion to k, half the limit
        kinetic, elastic = STRING
        parts = [Part(kinetic, slice(1, -1)), Part(kinetic / 2, 0), Part(kinetic / 2, -1), elastic] if ends == "free" else STRING
        pins = [Constraint(velocity(u), 0), Constraint(velocity(u), -1)] if ends == "pinned" else ()
        values = {rho: density, T: tension, h: time / steps, k: length / cells}
        lattice = Lattice(CellTheory(list(parts), u, pins), nodes, values, closed=ends == "ring")
        level = [[np.cos(q * speed * m * time / steps) * shape] for m in range(2)]
        path = lattice.run(*level, steps - 1)
        errors.append(abs(path.values[-1, 0] - np.cos(q * speed * time) * shape).max())
        if ends == "pinned":  # what the pins pull with is T u', times 1/k as a density
            rates = q * tension * np.cos(q * speed * time * np.arange(1, steps) / steps)
            assert_allclose(path.multipliers[:, 0] * length / cells, rates, rtol=0, atol=40 / cells**2 * q * tension)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.05), (errors, orders)


def test_a_string_at_the_limit_is_exact():
    """h = k sqrt(rho/T): five points carry d'Alembert's solution exactly."""
    nodes, shape = 24, lambda place: np.exp(np.sin(2 * np.pi * place / 24))
    values = {rho: 1.3, T: 0.8, h: 0.1 * np.sqrt(1.3 / 0.8), k: 0.1}
    lattice = Lattice(CellTheory(sum(STRING), u), nodes, values, closed=True)
    place = np.arange(nodes)
    path = lattice.run([shape(place)], [shape(place - 1)], 40)
    assert_allclose(path.values[-1, 0], shape(place - 41), rtol=0, atol=1e-12)


def test_sine_gordon_kink_by_newton_has_order_two():
    """u.. - u'' + sin u = 0, the potential at the mean of two levels; u grows by 2 pi on a turn of the lattice."""
    mean = (u[n, i] + u[n + 1, i]) / 2
    density = half * ((u[n + 1, i] - u[n, i]) / h) ** 2 - half * ((u[n, i + 1] - u[n, i]) / k) ** 2 - (1 - sy.cos(mean))
    length, speed, errors = 40.0, 0.4, []
    gamma = 1 / np.sqrt(1 - speed**2)

    def kink(place, time):
        return 4 * np.arctan(np.exp(gamma * (place - 18 - speed * time)))

    for nodes in (100, 200, 400):
        step = 0.5 * length / nodes
        lattice = Lattice(CellTheory(density, u), nodes, {h: step, k: length / nodes}, closed=True, shift=[2 * np.pi])
        assert not lattice.linear
        place, steps = length / nodes * np.arange(nodes), round(4 / step)
        path = lattice.run([kink(place, 0)], [kink(place, step)], steps - 1)
        errors.append(abs(path.values[-1, 0] - kink(place, 4.0)).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.1), (errors, orders)


def test_a_constraint_nonlinear_in_the_velocities():
    """Appell's: a point of constant speed v in gravity g, by Chetaev's force; sin(heading) = -tanh(g t/v), exact."""
    g, v = sy.symbols("g v")
    fall = half * ((x[n + 1, i] - x[n, i]) ** 2 + (y[n + 1, i] - y[n, i]) ** 2) / h**2 - g * y[n, i]
    theory = CellTheory(fall, (x, y), velocity(x) ** 2 + velocity(y) ** 2 - v**2)
    errors = []
    for steps in (20, 40, 80):
        dt = 1.0 / steps
        lattice = Lattice(theory, 1, {g: 0.9, v: 1.4, h: dt})
        assert not lattice.linear
        time = dt * np.arange(steps + 1)
        ratio = 0.9 / 1.4
        across = 1.4 / ratio * (2 * np.arctan(np.tanh(ratio * time / 2)))
        down = -1.4 / ratio * np.log(np.cosh(ratio * time))
        exact = np.stack([across, down], axis=1)[..., None]
        path = lattice.run(exact[0], exact[1], steps - 1)
        errors.append(abs(path.values - exact).max())
        moved = (path.values[2:] - path.values[:-2]) / (2 * dt)
        assert_allclose((moved**2).sum(axis=1), 1.4**2, rtol=1e-11)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.1), (errors, orders)


@pytest.mark.parametrize("closed", [False, True])
def test_residual_is_the_gradient_of_the_action_sum(closed):
    """(variations), by differences of the action sum; unequal along s, and free ends where cells are missing."""
    mean = (u[n + 1, i - 1] + u[n, i + 1]) / 2
    density = (1 + i / 10) * (u[n + 1, i] - u[n, i]) ** 2 + sy.sin(mean) * x[n, i] ** 2 + (x[n + 1, i + 1] - x[n, i]) ** 4
    theory = CellTheory([Part(density), Part(x[n + 1, i] ** 3 * u[n, i + 1], 0), Part(1)], (u, x))
    lattice = Lattice(theory, 6, {}, closed=closed)
    path = np.random.default_rng(7).normal(size=(3, 2, 6))
    equations, constraints = lattice.residual(*path)
    assert constraints.size == 0
    for place in np.ndindex(2, 6):
        shift = np.zeros_like(path)
        shift[1][place] = 1e-5
        change = (lattice.action(path + shift) - lattice.action(path - shift)) / 2e-5
        assert equations[place] == pytest.approx(change, abs=1e-7)


# Bad input


def test_bad_theories():
    free = sum(STRING)
    for arguments, message in (
        ((free + u[n + 2, i], u), r"L_d must depend on values at the levels n, n \+ 1 only; got u\[n \+ 2, i\]"),
        ((free + x[n, i], u), r"L_d must depend on values of u only; got x\[n, i\]"),
        ((free + u[n, 2 * i], u), r"must be at whole steps from \[n, i\], such as x\[n \+ 1, i - 1\]; got u\[n, 2\*i\]"),
        ((free + u[n], u), r"must be at whole steps from \[n, i\]"),
        ((free, (u, x)), r"L_d must contain values of each field at levels n and n \+ 1"),
        ((free, u, u[n, i]), "a constraint must contain velocities"),
        ((free, u, velocity(u) + u[n + 1, i]), r"phi_half must depend on values at the levels n only; got u\[n \+ 1, i\]"),
        ((free, u, Constraint(velocity(u), None, u[n + 2, i])), r"phi_d must depend on values at the levels n - 1, n, n \+ 1 only"),
        ((free, u, velocity(u), "backward"), "difference must be one of 'forward', 'central'; got 'backward'"),
    ):
        with pytest.raises(ValueError, match=message):
            CellTheory(*arguments)
    with pytest.raises(ValueError, match=r"cells must be None, a slice or a whole number; got 1\.5"):
        Part(free, 1.5)
    with pytest.raises(ValueError, match=r"derivatives must be d/dt, d/ds or d\^2/ds\^2 of fields; got"):
        in_space(X.diff(s, 3), (t, s))


def test_bad_lattices():
    theory, values = CellTheory(sum(STRING), u), {rho: 1.3, T: 0.8, h: 0.1, k: 0.2}
    lattice = Lattice(theory, 5, values)
    for make, message in (
        (lambda: Lattice(theory, 5, {rho: 1.3, h: 0.1}), "values must have a number for every symbol; missing: T, k"),
        (lambda: Lattice(theory, 5, values | {rho: "heavy"}), "rho must be a finite number; got 'heavy'"),
        (lambda: Lattice(theory, 0, values), "nodes must be a whole number of at least 1"),
        (
            lambda: Lattice(CellTheory([sum(STRING), u[n, i + 7] * u[n, i]], u), 5, values),
            "nodes must be a whole number of at least 8",
        ),
        (lambda: Lattice(theory, 5, values, shift=[1.0]), "shift belongs to a closed lattice"),
        (lambda: Lattice(CellTheory([sum(STRING), Part(STRING[1], -1)], u), 5, values), "cells must lie on the lattice of 5 nodes"),
        (lambda: Lattice(CellTheory([sum(STRING), Part(STRING[0], 7)], u), 5, values), "among the 5 nodes of the lattice; got 7"),
        (lambda: lattice.step(np.zeros(5), np.zeros((1, 5))), r"before must be finite and of shape \(1, 5\), fields and nodes"),
        (lambda: lattice.run(np.zeros((1, 5)), np.zeros((1, 4)), 3), r"second must be finite and of shape \(1, 5\)"),
        (lambda: lattice.run(np.zeros((1, 5)), np.zeros((1, 5)), 0), "steps must be a whole number of at least 1"),
        (lambda: lattice.residual(*np.zeros((3, 1, 5)), [1.0]), r"multipliers must be a number or an array of shape \(0,\)"),
    ):
        with pytest.raises(ValueError, match=message):
            make()


def test_failing_steps():
    values = {rho: 1.3, T: 0.8, h: 0.1, k: 0.2}
    loose = Lattice(CellTheory(sum(STRING), u), 5, values)  # its last node has no cell, and no mass
    with pytest.raises(RuntimeError, match="the discrete field equations do not determine the next level"):
        loose.step(np.zeros((1, 5)), np.ones((1, 5)))
    pull = half * (u[n + 1, i] - u[n, i]) ** 2 - 30 * sy.exp(u[n, i] * u[n + 1, i])
    with pytest.raises(RuntimeError, match="Newton's method does not converge in 3 sweeps"):
        Lattice(CellTheory(pull, u), 1, {}).step([[0.2]], [[0.9]], sweeps=3)
