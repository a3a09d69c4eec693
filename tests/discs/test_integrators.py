"""Each integrator: measured order, energy, reversal, constraint."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from discs import Chain, Gauss8, Leapfrog, McLachlanPerlmutter, Midpoint, Problem, SimulationError, State, simulate
from discs.integrators import METHODS, Integrator, Work, find
from discs.integrators.collocated import Collocated
from discs.integrators.composition import Composition
from discs.integrators.tableaux import tableau
from tests.conftest import ALL, SLAVED, STEERED, Model, models, models_and_engines, uneven
from tests.discs.test_system import contact_from_the_definition

# long steps, to be well above rounding
pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:.* is too long for this motion", "ignore:radau3. energy is conserved"),
]

FIXED = [name for name, cls in METHODS.items() if not cls.adaptive]
ADAPTIVE = [name for name, cls in METHODS.items() if cls.adaptive]
COMPOSED = ["midpoint", "suzuki4", "kahanli6"]
GAUSS = ["gauss4", "gauss6", "gauss8"]


def tight(name: str) -> Integrator:
    """The method with sweeps converged to rounding."""
    cls = METHODS[name]
    if issubclass(cls, Composition):
        return cls(Midpoint(tolerance=1e-14))
    return cls(tolerance=1e-14) if issubclass(cls, (Midpoint, Collocated, McLachlanPerlmutter)) else cls()


# steps per unit of time, in the asymptotic range of each method and above round-off
STEPS = {
    "midpoint": (40, 80, 160),
    "suzuki4": (40, 80, 160),
    "kahanli6": (45, 68, 100),
    "gauss4": (40, 80, 160),
    "gauss6": (45, 68, 100),
    "gauss8": (10, 15, 22),
    "radau3": (80, 160, 320),
    "radau5": (40, 60, 90),
    "rk4": (80, 160, 320),
    "leapfrog": (160, 320, 640),
    "mclachlan-perlmutter": (160, 320, 640),
}
SOME = [m for m in ALL if m.ends in ("consistent", "ring")] + STEERED[:1]
PLAIN = [Model("springs", "field"), Model("consistent", "unit"), Model("ring", "true"), Model("springs", "steered")]
QUICK = [m for m in SOME if m.law != "true"]


def final(problem, method, steps, engine="compiled"):
    run = simulate(problem, method, problem.duration / steps, frames=1, progress=False, engine=engine)
    return np.concatenate([run.x[-1], run.y[-1], run.theta[-1], run.omega[-1]])


@cache
def accurate(model):
    engine = "plain" if model.law == "true" else "compiled"  # the short suite compiles no Gauss methods for the true curvature
    return final(uneven(6, model), Gauss8(tolerance=1e-15, sweeps=12), 150, engine)


@pytest.mark.parametrize("name", METHODS)
def test_every_method_says_what_it_is(name):
    method = find(name)
    assert method.name == name
    assert method.order in range(1, 9)
    assert method.stability_limit > 0
    assert len(method.preserves) > 10
    assert len(method.reference) > 20


@models(SOME, QUICK)
@pytest.mark.parametrize("name", ["rk4"])
def test_the_reference_of_the_orders(name, model):
    np.testing.assert_allclose(final(uneven(6, model), name, 2000), accurate(model), atol=2e-11)


@models_and_engines(SOME, plain=SOME[::4], short=QUICK)
@pytest.mark.parametrize("name", FIXED)
def test_measured_order_is_the_declared_one(name, model, engine):
    if name == "gauss8" and model == Model("ring", "unit"):
        pytest.skip("this motion is so quick that order 8 shows only below rounding")
    problem = uneven(6, model)
    errors = np.array([np.abs(final(problem, tight(name), n, engine) - accurate(model)).max() for n in STEPS[name]])
    orders = np.log(errors[:-1] / errors[1:]) / np.diff(np.log(STEPS[name]))
    assert orders == pytest.approx(find(name).order, abs=0.06 * find(name).order + 0.1), errors


@models(SOME, QUICK)
@pytest.mark.parametrize("name", ADAPTIVE)
def test_scipy_methods_follow_their_tolerance(name, model):
    problem = uneven(6, model)
    errors = [np.abs(final(problem, METHODS[name](rtol, rtol), 1) - accurate(model)).max() for rtol in (1e-4, 1e-7, 1e-10)]
    assert errors[0] > 10 * errors[1] > 100 * errors[2], errors
    assert errors[2] < 3e-8


@models_and_engines(ALL, short=PLAIN)
@pytest.mark.parametrize("name", COMPOSED + GAUSS)
def test_energy_is_exact(name, model, engine):
    if name in GAUSS and model.law in ("true", "steered"):
        pytest.skip("Gauss methods keep quadratic energies")
    run = simulate(uneven(9, model), tight(name), 0.05, frames=21, progress=False, engine=engine)
    np.testing.assert_allclose(run.energy, run.energy[0], rtol=1e-12)


@models_and_engines(SLAVED, short=PLAIN)
@pytest.mark.parametrize("name", COMPOSED)
def test_energy_is_exact_even_with_one_sweep(name, model, engine):
    loose = Midpoint(sweeps=1, tolerance=0)
    method = loose if name == "midpoint" else METHODS[name](loose)
    run = simulate(uneven(9, model), method, 0.05, frames=21, progress=False, engine=engine)
    np.testing.assert_allclose(run.energy, run.energy[0], rtol=1e-12)
    assert run.stats["unconverged"] == 0  # all the sweeps that were asked for


@models_and_engines(ALL, short=PLAIN)
@pytest.mark.parametrize("name", ["rk4"])
def test_energy_test_can_fail(name, model, engine):
    run = simulate(uneven(9, model), name, 0.02, progress=False, engine=engine)
    assert np.ptp(run.energy) > 1e-9 * run.energy[0]


@models_and_engines(ALL, plain=ALL[::3], short=PLAIN)
@pytest.mark.parametrize("name", [*COMPOSED, *GAUSS, "mclachlan-perlmutter"])
def test_reversal(name, model, engine):
    """The motion back from the end, rates reversed, leads to the start."""
    problem = uneven(9, model)
    initial = problem.initial
    dt = 0.005 if name == "mclachlan-perlmutter" else 0.1
    want = ("velocity",)

    def there_and_back(method):
        there = simulate(problem, method, dt, 1, want, progress=False, engine=engine)
        q = there.x[-1], there.y[-1], there.theta[-1]
        turned = (
            State(*q, -there.omega[-1]) if there.phi is None else State(*q, -there.omega[-1], there.phi[-1], -there.phi_rate[-1])
        )
        back = simulate(Problem(problem.chain, turned, problem.duration), method, dt, 1, want, progress=False, engine=engine)
        return max(np.abs(getattr(back, row)[-1] - getattr(initial, row)).max() for row in problem.system.rows)

    assert there_and_back(tight(name)) < 1e-10
    dt = 0.1
    assert there_and_back(Midpoint(sweeps=1, tolerance=0)) > 1e-9  # a control


@models_and_engines(ALL, short=PLAIN)
@pytest.mark.parametrize("name", FIXED)
def test_rolling_residual_is_round_off_in_every_frame(name, model, engine):
    dt = 0.05 if find(name).stability_limit == np.inf else 0.004
    run = simulate(uneven(9, model), name, dt, frames=14, progress=False, engine=engine)
    assert run.rolling_residual.max() < 1e-13


@models_and_engines(ALL, short=PLAIN)
def test_midpoint_steps_roll_without_sliding(model, engine):
    """From the frames alone: r_{n+1} - r_n = e(midpoint) (theta_{n+1} - theta_n) over every step."""
    problem = uneven(9, model)
    run = simulate(problem, tight("midpoint"), 0.05, frames=21, progress=False, engine=engine)
    q = np.stack([getattr(run, row) for row in problem.system.rows], axis=1)
    for a, b in pairwise(q):
        e = contact_from_the_definition(problem, (a + b) / 2)
        np.testing.assert_allclose((b - a)[:2], e * (b - a)[2], atol=1e-13)


@models_and_engines(ALL, short=PLAIN)
@pytest.mark.parametrize("name", ["mclachlan-perlmutter"])
def test_perlmutter_steps_are_the_published_equations(name, model, engine):
    """q_h - q_0 = h/2 v_0, q_1 - q_h = h/2 v_1, and M (v_1 - v_0) + h grad V(q_h) is a ground force at q_h: no power in
    rolling there."""
    problem, h = uneven(9, model), 0.01
    run = simulate(problem, tight(name), h, [0.0, h], ("velocity",), progress=False, engine=engine)
    system = problem.system
    q = np.stack([getattr(run, row) for row in system.rows], axis=1)
    v = np.stack([run.omega if row == "theta" else getattr(run, f"{row}_rate") for row in system.rows], axis=1)
    half = q[0] + h / 2 * v[0]
    np.testing.assert_allclose(half + h / 2 * v[1], q[1], atol=1e-14)
    force = system.weights * (v[1] - v[0]) + h * system.gradient(system.shape(half))
    e = contact_from_the_definition(problem, half)
    np.testing.assert_allclose((e * force[:2]).sum(axis=0) + force[2], 0.0, atol=1e-13)
    np.testing.assert_allclose(force[3:], 0.0, atol=1e-13)


@models_and_engines([model for model in SLAVED if model.law == "field"], plain=SLAVED)
def test_leapfrog_keeps_its_modified_energy(model, engine):
    run = simulate(uneven(9, model), "leapfrog", 0.004, 21, ("modified_energy",), progress=False, engine=engine)
    np.testing.assert_allclose(run.modified_energy, run.modified_energy[0], rtol=1e-11)
    assert np.ptp(run.energy) > 1e-8 * run.energy[0]  # which the energy is not


def test_leapfrog_is_the_paper_s_scheme():
    """The residuals of the paper's discrete equations, term by term, with the multipliers eliminated by hand."""
    n = 9
    problem = uneven(n, Model("paper", "field"), equal=True)
    chain, system = problem.chain, problem.system
    h, k = 0.004, chain.k
    alpha, beta, rho, bend, radius = (
        float(np.asarray(getattr(chain, p))[0])
        for p in ("spin_inertia", "torsion_stiffness", "density", "bending_stiffness", "radius")
    )
    memory = Leapfrog().begin(system, problem.start(), h, Work())
    memory = Leapfrog().advance(system, memory, 0.0, h, Work())
    (x0, y0, t0), (x, y, t), (x2, y2, t2) = memory.hi - memory.last, memory.hi, memory.hi + memory.next
    inner = slice(2, -2)  # where the printed stencils reach

    def fourth(f):
        return f[4:] - 4 * f[3:-1] + 6 * f[2:-2] - 4 * f[1:-3] + f[:-4]

    def slope(f):
        return ((f[2:] - f[:-2]) / (2 * k))[1:-1]

    lam = (rho * (x2 - 2 * x + x0)[inner] + h**2 * bend / k**4 * fourth(x)) / h**2
    mu = (rho * (y2 - 2 * y + y0)[inner] + h**2 * bend / k**4 * fourth(y)) / h**2
    left = alpha * (t2 - 2 * t + t0)[inner]
    second = (t[2:] - 2 * t[1:-1] + t[:-2])[1:-1]
    right = radius * h**2 * (lam * slope(y) - mu * slope(x)) + beta * h**2 / k**2 * second
    np.testing.assert_allclose(left, right, atol=1e-15)
    np.testing.assert_allclose((x2 - x0)[inner], -radius * (t2 - t0)[inner] * slope(y), atol=1e-15)
    np.testing.assert_allclose((y2 - y0)[inner], radius * (t2 - t0)[inner] * slope(x), atol=1e-15)


@pytest.mark.parametrize("name", ["leapfrog", "mclachlan-perlmutter", "rk4"])
def test_explicit_methods_are_stable_up_to_their_limit(name, kernels_as_python):
    """The shortest wave of a straight rod: (alpha + rho R^2) Omega^2 = beta t + K R^2 t^2, t = 4/k^2. Growth is stopped early."""
    rod = {"density": 1.3, "spin_inertia": 0.6, "torsion_stiffness": 0.9, "bending_stiffness": 0.8, "radius": 0.7}
    chain = Chain(n=8, length=3.1, ends="ring", rolling="unit", shift=(3.1, 0.0), **rod)
    t, theta = 4 / chain.k**2, 1e-9 * (-1.0) ** np.arange(8)
    fastest = np.sqrt((0.9 * t + 0.8 * (0.7 * t) ** 2) / (0.6 + 1.3 * 0.7**2))
    dt = METHODS[name].stability_limit / fastest
    problem, steps = Problem(chain, State(chain.s, 0.7 * theta, theta), 40 * dt), []
    for engine in ("compiled", "plain"):
        run = simulate(problem, name, 0.9 * dt, frames=2, progress=False, engine=engine)
        assert np.abs(run.theta).max() < 4e-9
        with pytest.raises(SimulationError, match="energy") as failed:
            simulate(problem, name, 1.05 * dt, frames=2, progress=False, engine=engine)
        steps.append(failed.value.step)
    assert steps[0] == steps[1] < 20


@pytest.mark.parametrize("name", ["suzuki4", "kahanli6"])
def test_fractions_of_compositions(name):
    fractions = np.array(METHODS[name].fractions)
    for power in range(1, METHODS[name].order, 2):
        assert (fractions**power).sum() == pytest.approx(float(power == 1), abs=1e-15)
    np.testing.assert_array_equal(fractions, fractions[::-1])


@pytest.mark.parametrize("stages", [2, 3, 4, 12])
def test_gauss_tableau(stages):
    """Collocation, the weights' exactness, M = 0 (energy), and the eigenvectors that solve the stages."""
    t = tableau(stages)
    c = t.a.sum(axis=1)
    for m in range(stages):
        np.testing.assert_allclose(t.a @ c**m, c ** (m + 1) / (m + 1), atol=1e-14)
    for m in range(2 * stages):
        assert t.b @ c**m == pytest.approx(1 / (m + 1), abs=1e-14)
    m = t.b[:, None] * t.a
    np.testing.assert_allclose(m + m.T, np.outer(t.b, t.b), atol=1e-15)
    rebuilt = sum((np.outer(o, i) * v).real for v, i, o in zip(t.pairs, t.pairs_in, t.pairs_out, strict=True))
    rebuilt = rebuilt + sum(np.outer(o, i) * v for v, i, o in zip(t.real, t.real_in, t.real_out, strict=True))
    np.testing.assert_allclose(rebuilt, t.a, atol=1e-14)


def moved(state: State, angle: float, shift: tuple[float, float], roll: float) -> State:
    c, s = np.cos(angle), np.sin(angle)
    x, y = np.asarray(state.x), np.asarray(state.y)
    phi = None if state.phi is None else np.asarray(state.phi) + angle
    turned = c * x - s * y + shift[0], s * x + c * y + shift[1]
    return State(*turned, np.asarray(state.theta) + roll, state.omega, phi, state.phi_rate)


@models_and_engines(ALL, plain=ALL[1::3])
@pytest.mark.parametrize("name", FIXED)
def test_equivariance(name, model, engine):
    """The motion is equivariant under motions of the plane and an equal roll of all discs."""
    problem = uneven(9, model)
    other = Problem(problem.chain, moved(problem.initial, 0.7, (1.3, -2.0), 0.4), problem.duration)
    dt = 0.05 if find(name).stability_limit == np.inf else 0.005
    a, b = (simulate(p, tight(name), dt, frames=1, progress=False, engine=engine) for p in (problem, other))
    phi = None if a.phi is None else a.phi[-1]
    expected = moved(State(a.x[-1], a.y[-1], a.theta[-1], a.omega[-1], phi), 0.7, (1.3, -2.0), 0.4)
    for row in (*problem.system.rows, "omega"):
        np.testing.assert_allclose(getattr(b, row)[-1], np.asarray(getattr(expected, row)), atol=1e-10)


@pytest.mark.parametrize("engine", ["compiled", "plain"])
@pytest.mark.parametrize("name", FIXED)
def test_positions_carry_their_low_digits(name, engine):
    """A straight chain far from the origin rolls sideways in steps of about ten units in the last place of y."""
    chain = Chain(n=5, length=2.0, density=1.0, spin_inertia=0.5, torsion_stiffness=1.0, bending_stiffness=1.0, radius=0.7)
    far = np.full(5, 1e6)
    problem = Problem(chain, State(chain.s, far, 0 * far, 1.7e-3), 1e-3)
    run = simulate(problem, name, 1e-6, frames=1, progress=False, engine=engine)
    # uncompensated, every step would round the same way: 1000 times up to 6e-11
    np.testing.assert_allclose(run.y[-1] - 1e6, 0.7 * 1.7e-3 * 1e-3, atol=np.spacing(1e6))
