"""The linearised equations of every chain and load, against derivatives of the rates themselves."""

from dataclasses import replace

import numpy as np
import pytest

from discs.analysis.linear import Linearised, linearise
from discs.chains import stencils
from discs.differences import jacobian
from discs.loads import Custom, Damping, Motor, Potential, Rest, Slope, Spring, Torque, signals
from discs.skew import Phase
from tests.conftest import ALL, Model, models, uneven

pytestmark = pytest.mark.slow  # every chain with every load


def everything(model, problem):
    """Loads of every kind that the chain takes, each by itself."""
    signal = signals.sine(1.0, 2.0, 0.3)
    found = [
        Slope(0.3, -0.4),
        Spring(0.2, 0.1, 0.7),
        Damping(rolling=0.2, torsion=0.3, bending=0.25, turning=0.1 * (model.law == "steered")),
        Rest(twist=0.4, curvature=0.5),
        Torque(1.0, signal),
        Potential(lambda x, y: x**2 * y, lambda x, y: (2 * x * y, x**2)),
        Custom(lambda t, q, v: np.sin(q) * v + q[::-1] ** 2),
        Motor(float(np.broadcast_to(problem.initial.omega, problem.chain.n)[2]), at=problem.chain.s[2]),
    ]
    if model.law == "steered":
        found.append(Rest(mounting_angle=0.3, stretch=0.1))
    if model.law != "true":
        found.append(Rest(curvature=0.3, signal=signal))
    return found


def rates(lin: Linearised, y):
    """The rates at another state, whose motors turn at the same rates; none of the linearised equations is used."""
    system, rows, n = lin.system, len(lin.basis), lin.system.n
    q = y[: rows * n].reshape(rows, n)
    c = system.basis(system.shape(q))
    pi = (lin.z.pi.reshape(-1, n) * lin.basis[2:] / c[2:]).ravel()
    pi[lin.free] = y[rows * n :]
    pi = pi.reshape(lin.z.pi.shape)
    v = system.forward(c, pi)
    push = system.gradient(system.shape(q))
    if system.load is not None:
        push = push - system.load.applied(lin.t, q, v)
    return lin.join(v, -system.back(c, push))


@models(ALL)
def test_matrix_is_the_derivative_of_the_rates(model):
    problem = uneven(8, model)
    loads = everything(model, problem)
    for some in [(), *((load,) for load in loads), tuple(loads)]:
        lin = linearise(replace(problem, loads=some), t=0.2)
        y = lin.join(lin.z.hi, lin.z.pi)
        right = jacobian(lambda there, lin=lin: rates(lin, there), y).toarray()
        # the differences have errors of order 4 in the step over the spacing
        np.testing.assert_allclose(lin.matrix.toarray(), right, rtol=0, atol=1e-9 * np.abs(right).max(), err_msg=str(some))
        np.testing.assert_allclose(lin.rate, rates(lin, y), rtol=0, atol=1e-13 * np.abs(lin.rate).max())


def test_matrix_is_the_complex_step():
    """Formulas of the field law keep complex numbers: no error of differences."""
    for ends in stencils.ENDS:
        lin = linearise(uneven(9, Model(ends, "field")))
        y = lin.join(lin.z.hi, lin.z.pi)
        right = np.array([rates(lin, y + 1e-30j * direction).imag / 1e-30 for direction in np.eye(y.size)]).T
        np.testing.assert_allclose(lin.matrix.toarray(), right, rtol=0, atol=1e-14 * np.abs(right).max())


@models([Model("ring", "unit"), Model("consistent", "field"), Model("springs", "steered"), Model("springs", "true")])
def test_operator_and_its_transpose_are_the_matrix(model):
    problem = uneven(8, model)
    lin = linearise(replace(problem, loads=tuple(everything(model, problem))))
    both = np.random.default_rng(3).normal(size=(2, lin.rate.size, 3))
    for one, other in both.transpose(2, 0, 1):
        np.testing.assert_allclose(lin.operator @ one, lin.matrix @ one, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(lin.operator.T @ one, lin.matrix.T @ one, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(other @ (lin.operator @ one), one @ (lin.operator.T @ other), rtol=1e-11)


def test_matrices_of_elements():
    """Discs of order four: parabolas through three discs."""
    from discs.chains.twist import untwisting_chain

    problem = untwisting_chain(9, "own", degree=2)
    rng = np.random.default_rng(4)
    bent = {name: getattr(problem.initial, name) + 0.1 * rng.normal(size=9) for name in ("x", "y", "theta", "omega", "phi")}
    lin = linearise(replace(problem, loads=(Damping(torsion=0.2, bending=0.1),)), at=replace(problem.initial, **bent))
    right = jacobian(lambda there: rates(lin, there), lin.join(lin.z.hi, lin.z.pi)).toarray()
    np.testing.assert_allclose(lin.matrix.toarray(), right, rtol=0, atol=1e-9 * np.abs(right).max())


@pytest.mark.parametrize("n", [5, 9, 12])
def test_stencils_as_matrices(n, ends):
    values = np.random.default_rng(n).normal(size=(2, n))
    for stencil in (
        lambda r: stencils.links(r, ends),
        lambda r: stencils.slopes(stencils.links(r, ends), 0.3, ends),
        lambda r: stencils.bends(stencils.links(r, ends), ends),
    ):
        found = stencils.matrix(stencil, n, ends)
        np.testing.assert_allclose((found @ values.T).T, stencil(values), atol=1e-13)
        assert found.nnz <= 4 * n + 8


def test_volume_is_kept():
    """dq dpi is invariant: the trace of the linearised equations is zero for every chain, and minus the damping with dampers."""
    for model in ALL:
        problem = uneven(9, model)
        matrix = linearise(problem).matrix
        assert abs(matrix.trace()) < 1e-13 * np.abs(matrix.data).max()
        lossy = linearise(replace(problem, loads=(Damping(rolling=0.2),)))
        c, w = lossy.basis, problem.chain.w
        assert lossy.matrix.trace() == pytest.approx(-(0.2 * w * c[2] ** 2).sum(), abs=1e-13 * np.abs(matrix.data).max())


@pytest.mark.parametrize(
    ("given", "at", "words"),
    [("a chain", None, "those of a Problem.*got 'a chain'"), (None, 3.0, r"at must be a State.*got 3\.0")],
)
def test_bad_input(given, at, words):
    problem = uneven(5, Model("springs", "field")) if given is None else given
    with pytest.raises(ValueError, match=words):
        linearise(problem, at)


def test_state_of_another_chain():
    problem, other = (uneven(n, Model("springs", "field")) for n in (5, 6))
    with pytest.raises(ValueError, match="must have the chain's 5 discs; got 6"):
        linearise(problem, other.initial)


def test_changes_of_motors_follow():
    """The momentum of a driven disc is sqrt(m) omega, with m of the changed state."""
    problem = uneven(7, Model("springs", "field"))
    omega = np.broadcast_to(problem.initial.omega, 7)
    lin = linearise(replace(problem, loads=(Motor(float(omega[3]), at=problem.chain.s[3]),)))
    small = 1e-6 * np.random.default_rng(5).normal(size=lin.rate.size)
    dq, dpi = lin.split(small)
    c = lin.system.basis(lin.system.shape(lin.z.hi + dq))
    assert dpi[3] == pytest.approx(omega[3] * (1 / c[2, 3] - 1 / lin.basis[2, 3]), rel=1e-4)
    assert isinstance(lin.z, Phase)
    assert lin.join(dq, dpi) == pytest.approx(small)
