"""Gradients by the discrete adjoint: against differences of runs, and of what they are made of."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from discs import simulate
from discs.analysis import gradient, linearise
from discs.analysis.duals import Dual
from discs.integrators import Gauss4, Midpoint
from discs.loads import Custom, Damping, Force, Linear, Motor, Rest, Slope, Spring, Torque, signals
from discs.loads.binding import OnRod
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


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.* is too long for this motion")
@models([Model(ends, law) for law in ("steered", "true") for ends in ("springs", "ring")])
def test_gradients_through_secants_are_those_of_differences(model):
    """Midpoint steps where V is not quadratic."""
    problem = replace(uneven(6, model), loads=LOADS[:3], duration=0.5)
    names = "theta", "omega", "density", "radius", "bending_stiffness", "stretch_stiffness"
    method = Midpoint(tolerance=1e-14)
    found = gradient(problem, cost, names, method, 0.05, TIMES, progress=False)
    for name in names:
        assert found[name][-1] == pytest.approx(by_differences(problem, name, -1, method), rel=2e-8, abs=2e-9), name


def midpoint(chain, q, pi, steps, h):
    """Steps of the midpoint rule for plain springs and the field law, in dense matrices and complex numbers."""
    n, k = chain["n"], chain["k"]
    z = (np.eye(n, k=1) - np.eye(n, k=-1)) / (2 * k)
    z[0, :3], z[-1, -3:] = np.array([-3, 4, -1]) / (2 * k), np.array([1, -4, 3]) / (2 * k)
    bend, link = np.diff(np.eye(n), 2, axis=0) / k**2, np.diff(np.eye(n), axis=0)
    stiff = [bend.T @ (chain["bending_stiffness"] * k * bend.T).T] * 2 + [link.T @ (chain["torsion_stiffness"] / k * link.T).T]

    def basis(q):
        e = chain["radius"] * np.array([-(z @ q[1]), z @ q[0]])
        root = np.sqrt(chain["w"] * (chain["spin_inertia"] + chain["density"] * (e**2).sum(axis=0)))
        return np.array([*e, 1 + 0 * root]) / root

    if pi is None:
        pi = chain["omega"] / basis(q)[2]
    for _ in range(steps):
        middle = q
        for _ in range(12):
            c = basis(middle)
            springs = sum(np.outer(a, a) * s for a, s in zip(c, stiff, strict=True))
            pull = sum(a * (s @ row) for a, s, row in zip(c, stiff, q, strict=True))
            p = np.linalg.solve(np.eye(n) + h**2 / 4 * springs, pi - h / 2 * pull)
            middle = q + h / 2 * c * p
        q, pi = q + h * c * p, 2 * p - pi
    return q


@pytest.mark.parametrize(("engine", "steps"), [("plain", 200), longer("compiled", 1000)])
def test_gradients_over_many_steps_are_exact(engine, steps):
    """Against the complex step through an independent code: y of the first disc by parameters and by its angle at the start."""
    h = 0.01
    problem = replace(uneven(6, Model("springs", "field")), duration=steps * h)
    own, start = problem.chain, problem.initial
    chain = {name: np.array(getattr(own, name), complex) for name in CHAIN}
    chain |= {"n": own.n, "k": own.k, "w": own.w, "omega": np.array(start.omega)}
    q, h_ = np.array([start.x, start.y, start.theta], complex), 1e-30j
    names = ("radius", "density", "spin_inertia", "bending_stiffness", "torsion_stiffness", "theta", "y")
    method = Midpoint(tolerance=1e-14)
    found = gradient(problem, lambda run: run.y[-1, 0], names, method, h, progress=False, engine=engine)
    for name in names:
        there, moved = {**chain, **({name: chain[name].copy()} if name in CHAIN else {})}, q.copy()
        (there[name] if name in CHAIN else moved[("x", "y", "theta").index(name)])[1] += h_
        slope = midpoint(there, moved, None, steps, h)[1, 0].imag / h_.imag
        assert found[name][1] == pytest.approx(slope, rel=1e-8), name


def own_headings(chain, q, p, steps, h):
    """Steps of Gauss's method of order 4 for own headings and plain links, in complex numbers; q (M, 4, n), p (M, 2, n)."""
    k, a, b = chain["k"], np.array([[0.25, 0.25 - np.sqrt(3) / 6], [0.25 + np.sqrt(3) / 6, 0.25]]), 0.5
    spin = np.sqrt(chain["w"] * (chain["spin_inertia"] + chain["density"] * chain["radius"] ** 2))
    turn = np.sqrt(chain["w"] * chain["heading_inertia"])
    p = np.stack([spin, turn], axis=1) * p

    def rate(q, p):
        d, m = np.diff(q, axis=2) / k, 0.5 * (q[:, 3, 1:] + q[:, 3, :-1])
        cos, sin = np.cos(m), np.sin(m)
        along, across = cos * d[:, 0] + sin * d[:, 1], cos * d[:, 1] - sin * d[:, 0]
        n, s = chain["stretch_stiffness"] * (along - 1), chain["shear_stiffness"] * across
        moments = chain["torsion_stiffness"] * d[:, 2], chain["bending_stiffness"] * d[:, 3]
        pull, force = np.stack([cos * n - sin * s, sin * n + cos * s, *moments], axis=1), np.zeros_like(q)
        force[..., :-1] += pull
        force[..., 1:] -= pull
        couple = 0.5 * k * (n * across - s * along)
        force[:, 3, :-1] -= couple
        force[:, 3, 1:] -= couple
        e = chain["radius"] * np.array([-np.sin(q[:, 3]), np.cos(q[:, 3])])
        c = np.stack([*e, 1 + 0 * e[0]], axis=1) / spin[:, None]
        of_p = np.stack([(c * force[:, :3]).sum(axis=1), force[:, 3] / turn], axis=1)
        return np.concatenate([c * p[:, :1], p[:, 1:] / turn[:, None]], axis=1), of_p

    stages = [rate(q, p)] * 2
    for _ in range(steps):
        for _ in range(12):
            at = [[z + h * sum(w * f[i] for w, f in zip(row, stages, strict=True)) for i, z in enumerate((q, p))] for row in a]
            stages = [rate(*place) for place in at]
        q, p = (z + h * b * (stages[0][i] + stages[1][i]) for i, z in enumerate((q, p)))
    return q


@pytest.mark.parametrize(("engine", "steps"), [pytest.param("plain", 20, marks=pytest.mark.slow), longer("compiled", 1000)])
def test_gradients_of_own_headings_are_exact(engine, steps):
    """Against the complex step through an independent code, for each kind of parameter and of initial value."""
    h, (names, fields) = 0.005, ((*CHAIN, *OWN[2:]), ("x", "y", "theta", "phi", "omega", "phi_rate"))
    problem = replace(uneven(5, Model("springs", "steered")), duration=steps * h)
    own, start, every = problem.chain, problem.initial, (*names, *fields)
    small = 1e-30j * np.eye(len(every))[:, :, None]  # a change of entry 1 of each
    size = {name: np.size(getattr(own, name)) for name in names} | dict.fromkeys(fields, 5)
    moved = {name: small[:, i] * (np.arange(size[name]) == 1) for i, name in enumerate(every)}
    chain = {name: np.asarray(getattr(own, name)) + moved[name] for name in names} | {"k": own.k, "w": own.w}
    values = [np.asarray(getattr(start, name)) * np.ones(5) + moved[name] for name in fields]
    q = own_headings(chain, np.stack(values[:4], axis=1), np.stack(values[4:], axis=1), steps, h)
    found = gradient(problem, lambda run: run.y[-1, 0], every, Gauss4(tolerance=1e-15), h, progress=False, engine=engine)
    slopes = dict(zip(every, q[:, 1, 0].imag / 1e-30, strict=True))
    largest = max(abs(slope) for slope in slopes.values())
    for name, slope in slopes.items():
        assert found[name][1] == pytest.approx(slope, rel=1e-8, abs=1e-10 * largest), name


@pytest.mark.slow
@pytest.mark.parametrize("method", [Midpoint(tolerance=1e-14), Gauss4(tolerance=1e-14)], ids=["midpoint", "gauss4"])
@models([Model("springs", "field"), Model("consistent", "unit"), Model("ring", "field")], [Model("ring", "field")])
def test_compiled_gradients_are_the_plain_ones(model, method, kernels_as_python):
    problem = replace(uneven(6, model), loads=LOADS, duration=0.5)
    names = ("theta", "omega", *CHAIN, "loads[2].pattern")
    plain, compiled = (
        gradient(problem, cost, names, method, 0.05, TIMES, progress=False, engine=engine) for engine in ("plain", "compiled")
    )
    for name in names:
        np.testing.assert_allclose(compiled[name], plain[name], rtol=1e-9, atol=1e-11)


def test_gradients_by_loads_and_signals_are_those_of_differences():
    places = uneven(6, Model("springs", "field")).chain.s
    loads = (
        Torque(np.linspace(0.1, 0.6, 6), signals.sine(1.0, 2.0, 0.3)),
        Force(0.2, -0.3, signals.table([0.0, 0.2, 0.6], [1.0, 0.5, 2.0]), at=places[2]),
        Slope(0.2, -0.4),
        Spring(1.0, np.linspace(0.0, 0.5, 6), 0.8),
        Damping(rolling=np.linspace(0.2, 0.4, 6), torsion=np.linspace(0.3, 0.1, 5)),
        Rest(twist=np.linspace(0.3, -0.1, 5)),
        Linear(stiffness=np.full((3, 6), 0.1)),
    )
    problem = replace(uneven(6, Model("springs", "field")), loads=loads, duration=0.5)
    entries = {
        "loads[0].pattern": 2,
        "loads[0].signal.amplitude": None,
        "loads[0].signal.rate": None,
        "loads[1].y": None,
        "loads[1].signal.values": 1,
        "loads[2].gy": None,
        "loads[3].y": 4,
        "loads[3].stiffness": None,
        "loads[4].rolling": 3,
        "loads[4].torsion": 1,
        "loads[5].twist": 2,
        "loads[6].stiffness": (1, 2),
    }
    found = gradient(problem, cost, entries, Midpoint(tolerance=1e-14), 0.05, TIMES, progress=False)
    for name, place in entries.items():
        i, *path = name.removeprefix("loads[").replace("]", "").split(".")

        def end(by, i=int(i), path=path, place=place):
            owner = loads[i] if len(path) == 1 else loads[i].signal
            value = np.array(getattr(owner, path[-1]), float)
            value[() if place is None else place] += by
            new = replace(owner, **{path[-1]: value if value.ndim else float(value)})
            load = new if len(path) == 1 else replace(loads[i], signal=new)
            given = replace(problem, loads=(*loads[:i], load, *loads[i + 1 :]))
            return cost(simulate(given, Midpoint(tolerance=1e-14), 0.05, TIMES, progress=False, engine="plain"))

        by = (end(1e-5) - end(-1e-5)) / 2e-5
        assert found[name][() if place is None else place] == pytest.approx(by, rel=3e-8, abs=3e-9), name


@dataclass(frozen=True)
class Cubic(OnRod):
    """A load of one's own, not linear: a torque -strength theta^3."""

    strength: float = 0.5

    def on(self, chain):
        return Custom(lambda t, q, v: np.concatenate([0 * q[:2], -self.strength * q[2:3] ** 3, 0 * q[3:]])).on(chain)


@pytest.mark.slow
@pytest.mark.parametrize("model", [Model("consistent", "field"), Model("springs", "steered")], ids=["slaved", "own"])
def test_gradients_by_loads_that_are_not_linear_are_those_of_differences(model):
    """Rest curvatures of two loads add up, so each one's force depends on the other."""
    wave = signals.sine(1.0, 2.0, 0.3)
    loads = Rest(curvature=0.3), Rest(curvature=0.2, signal=wave), Damping(bending=0.1), Cubic()
    problem, method = replace(uneven(6, model), loads=loads, duration=0.3), Gauss4(tolerance=1e-14)
    names = {"loads[0].curvature": 0.3, "loads[1].curvature": 0.2, "loads[2].bending": 0.1, "loads[3].strength": 0.5}
    found = gradient(problem, cost, (*names, "loads[1].signal.rate"), method, 0.05, [0.1, 0.3], progress=False, engine="plain")

    def end(i, load):
        given = replace(problem, loads=(*loads[:i], load, *loads[i + 1 :]))
        return cost(simulate(given, method, 0.05, [0.1, 0.3], progress=False, engine="plain"))

    for i, (name, value) in enumerate(names.items()):
        up, down = (end(i, replace(loads[i], **{name.split(".")[1]: value + by})) for by in (1e-5, -1e-5))
        assert found[name] == pytest.approx((up - down) / 2e-5, rel=1e-7, abs=1e-8), name
    up, down = (end(1, replace(loads[1], signal=replace(wave, rate=2.0 + by))) for by in (1e-5, -1e-5))
    assert found["loads[1].signal.rate"] == pytest.approx((up - down) / 2e-5, rel=1e-7, abs=1e-8)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (
            "loads[7].pattern",
            "a parameter of a load is 'loads.i..name' .* with i below 3, the number of loads; got 'loads.7..pattern'",
        ),
        ("loads[0].size", "'loads.0..size': Torque has the parameters pattern, signal, at, about"),
        ("loads[0].pattern", "'loads.0..pattern' is a function: give its values, as an array"),
        ("loads[0].about", "'loads.0..about' is no number and no array: 'roll'"),
        ("loads[1].signal.rate", "'loads.1..signal.rate': NoneType has the parameters none"),
        ("loads[2].power", "'loads.2..power' is no number and no array: None"),
        ("loads[2].per_length", "'loads.2..per_length' is no number and no array: False"),
    ],
)
def test_parameters_of_loads_that_are_refused(name, words):
    custom = Custom(lambda t, q, v: 0 * q)
    problem = replace(uneven(5, Model("springs", "field")), loads=(Torque(np.sin), Rest(twist=0.1), custom))
    with pytest.raises(ValueError, match=words):
        gradient(problem, cost, name, dt=0.1, progress=False)


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
    np.testing.assert_allclose(given["theta"], by_duals["theta"], rtol=1e-11)


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
        ({"method": "rk4"}, "gradient takes 'midpoint' or a collocation method, as 'gauss4'; got 'rk4'"),
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


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.* is too long for this motion")
@pytest.mark.parametrize(
    ("law", "name", "value", "method"),
    [
        ("true", "curvature", 0.3, Midpoint(tolerance=1e-14)),
        ("true", "curvature", 0.0, Gauss4(tolerance=1e-14)),
        ("steered", "stretch", 0.1, Gauss4(tolerance=1e-14)),
        ("steered", "mounting_angle", 0.2, Midpoint(tolerance=1e-14)),
    ],
)
def test_gradients_by_rest_strains_of_springs_are_those_of_differences(law, name, value, method):
    """They are no force besides that of the springs, but a part of it."""
    problem = replace(uneven(5, Model("springs", law)), duration=0.3)

    def with_rest(by):
        return replace(problem, loads=(Rest(**{name: value + by}),))

    runs = [simulate(with_rest(by), method, 0.05, [0.13, 0.3], progress=False, engine="plain") for by in (1e-6, -1e-6)]
    found = gradient(with_rest(0.0), cost, f"loads[0].{name}", method, 0.05, [0.13, 0.3], progress=False)
    assert found[f"loads[0].{name}"] == pytest.approx((cost(runs[0]) - cost(runs[1])) / 2e-6, rel=2e-8, abs=2e-9)


def test_what_has_no_adjoint_is_refused():
    problem = uneven(5, Model("springs", "field"))
    motor = Motor(float(problem.initial.omega[2]), problem.chain.s[2])
    with pytest.raises(ValueError, match="gradient takes no motors"):
        gradient(replace(problem, loads=(motor,)), cost, "theta", dt=0.1, progress=False)
    with pytest.raises(ValueError, match="gradient takes a Problem"):
        gradient("rod", cost, "theta")
