"""Gradients by the discrete adjoint: against differences of runs, and of what they are made of."""

from dataclasses import replace

import numpy as np
import pytest

from discs import simulate
from discs.analysis import gradient, linearise
from discs.analysis.duals import Dual
from discs.integrators import Gauss4, Midpoint
from discs.loads import Damping, Motor, Slope, Spring, Torque, signals
from tests.conftest import ALL, Model, longer, models, uneven

LOADS = Slope(0.2, -0.4), Damping(rolling=0.3, torsion=0.1), Torque(0.3, signals.sine(1.0, 2.0)), Spring(1.0, 0.5, 0.8, at=1.0)
TIMES = [0.0, 0.33, 0.5]  # one between two steps
STATE = "x", "y", "theta", "omega"
CHAIN = "density", "spin_inertia", "radius", "torsion_stiffness", "bending_stiffness"
OWN = "phi", "phi_rate", "heading_inertia", "stretch_stiffness", "shear_stiffness"


def cost(run):
    return run.y[-1, 0] ** 2 + np.sin(run.theta[:, 2]).sum() + 0.3 * (run.omega[1:] * run.x[1:]).mean()


def changed(problem, name, i, by):
    owner = "chain" if hasattr(problem.chain, name) else "initial"
    values = np.array(getattr(getattr(problem, owner), name))
    values[i] += by
    return replace(problem, **{owner: replace(getattr(problem, owner), **{name: values})})


def by_differences(problem, name, i, method, step=1e-6):
    runs = [simulate(changed(problem, name, i, by), method, 0.05, TIMES, progress=False, engine="plain") for by in (step, -step)]
    return (cost(runs[0]) - cost(runs[1])) / (2 * step)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.* is too long for this motion")
@pytest.mark.parametrize("loads", [longer(()), LOADS], ids=["free", "loaded"])
@models(
    [Model("springs", "field"), Model("consistent", "unit"), Model("ring", "field"), Model("springs", "true"), *ALL[-2:]],
    [Model("springs", "field"), ALL[-2]],
)
def test_gradients_are_those_of_differences(model, loads):
    problem = replace(uneven(6, model), loads=loads, duration=0.5)
    method = Midpoint(tolerance=1e-14) if problem.system.quadratic else Gauss4(tolerance=1e-14)
    names = STATE + CHAIN + (OWN if model.law == "steered" else ("stretch_stiffness",) if model.law == "true" else ())
    found = gradient(problem, cost, names, method, 0.05, TIMES, progress=False)
    for name in names:
        for i in (0, -1):
            assert found[name][i] == pytest.approx(by_differences(problem, name, i, method), rel=2e-8, abs=2e-8), (name, i)


def test_the_derivative_by_one_number_for_all_discs_is_the_sum():
    problem = replace(uneven(6, Model("springs", "field")), duration=0.3)
    found = gradient(problem, lambda run: run.theta[-1, 0], "radius", dt=0.05, progress=False)["radius"].sum()

    def end(by):
        chain = replace(problem.chain, radius=problem.chain.radius + by)
        return simulate(replace(problem, chain=chain), "midpoint", 0.05, 1, progress=False, engine="plain").theta[-1, 0]

    assert found == pytest.approx((end(1e-6) - end(-1e-6)) / 2e-6, rel=1e-7)


def test_a_gradient_of_one_s_own_is_taken():
    problem = replace(uneven(6, Model("springs", "field")), duration=0.3)
    times = [0.1, 0.3]
    by_duals = gradient(problem, lambda run: (run.x**2).sum(), "theta", dt=0.05, frames=times, progress=False)
    given = gradient(problem, None, "theta", dt=0.05, frames=times, cost_gradient=lambda run: {"x": 2 * run.x}, progress=False)
    np.testing.assert_allclose(given["theta"], by_duals["theta"], rtol=1e-13)


@models([*ALL[::3], *ALL[-2:]])
def test_strains_make_the_gradient_of_the_potential(model):
    problem = uneven(6, model)
    lin = linearise(problem)
    force = lin.strains.matrix.T @ (lin.strains.stiffness * lin.strains.strain)
    np.testing.assert_allclose(force, lin.system.gradient(lin.shape).ravel(), atol=1e-12 * abs(force).max())


@pytest.mark.parametrize(
    "function",
    [
        lambda x: (x[1:, 0] ** 3 / (1 + x[:-1, 2])).sum(),
        lambda x: np.hypot(x[0], 2.0).mean() + np.abs(x[1] - 0.5).sum() - abs(np.diff(x, axis=1)).sum(),
        lambda x: np.exp(-x.T @ x)[0, 1] + np.sum(np.maximum(x, 0.4)) + np.arctan2(x[0], x[1])[2],
        lambda x: np.sqrt(np.dot(x[0], x[1])) + (x.reshape(-1)[5] - x.ravel()[0]) * np.mean(x),
    ],
)
def test_dual_numbers_carry_derivatives(function):
    from scipy.sparse import eye_array

    x = np.random.default_rng(1).uniform(0.1, 1.0, (3, 4))
    found = function(Dual(x, eye_array(12, format="csr")))
    assert float(found.value) == pytest.approx(function(x))
    for i, slope in enumerate(found.slope.toarray().ravel()):
        step = np.zeros(12)
        step[i] = 1e-6
        apart = function(x + step.reshape(3, 4)) - function(x - step.reshape(3, 4))
        assert slope == pytest.approx(apart / 2e-6, abs=1e-8)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"wrt": "mass"}, "wrt must be names among x, y, theta, .*; got 'mass'"),
        ({"wrt": "phi"}, "wrt must be names among"),
        ({"wrt": ()}, "wrt must be names among"),
        ({"method": "rk4"}, "gradient takes 'midpoint' where the potential is quadratic, or .* 'gauss4'; got 'rk4'"),
        ({"cost": lambda run: run.x[-1]}, r"the cost must be one number made of the frames; got an array of shape \(5,\)"),
        ({"cost": lambda run: 1.0}, "the cost must be one number made of the frames; got 1.0"),
        ({"cost": lambda run: run.energy[-1]}, "a cost may use t, x, y, theta, omega of the run; it said: .*energy"),
        ({"cost": lambda run: float(run.x[-1, 0])}, "the cost cannot be differentiated: .* leave out float"),
        ({"cost": lambda run: np.sort(run.x).sum()}, "the cost cannot be differentiated: np.sort is not followed"),
        ({"dt": 2.0}, "dt must be at most the duration 1; got 2"),
        ({"cost_gradient": lambda run: {"z": 1}}, "cost_gradient must return arrays by names among x, y, theta, omega"),
    ],
)
def test_bad_input(change, words):
    given = {"cost": lambda run: run.x[-1, 0], "wrt": "theta", "dt": 0.05} | change
    with pytest.raises(ValueError, match=words):
        gradient(uneven(5, Model("springs", "field")), **given, progress=False)


def test_steps_that_do_not_converge_are_said():
    problem = replace(uneven(6, Model("springs", "field")), duration=0.3)
    with pytest.warns(UserWarning, match="did not converge"):
        gradient(problem, lambda run: run.y[-1, 0], "theta", Midpoint(sweeps=2, tolerance=1e-14), 0.1, progress=False)


def test_what_has_no_adjoint_is_refused():
    problem = uneven(5, Model("springs", "field"))
    motor = Motor(float(problem.initial.omega[2]), problem.chain.s[2])
    with pytest.raises(ValueError, match="gradient takes no motors"):
        gradient(replace(problem, loads=(motor,)), cost, "theta", dt=0.1, progress=False)
    with pytest.raises(ValueError, match="got 'midpoint', whose steps take a secant"):
        gradient(uneven(5, Model("springs", "steered")), cost, "theta", dt=0.1, progress=False)
    with pytest.raises(ValueError, match="gradient takes a Problem"):
        gradient("rod", cost, "theta")
