"""Torques, forces, slopes, springs, damping and rest shapes: against multipliers, closed forms and the balance of energy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from compare import lump
from continuum import steered_rod, untwisting_rod
from continuum.balance import balances
from discs import Chain, Midpoint, Problem, State, SteeredChain, simulate
from discs.command_line import summary
from discs.integrators import METHODS
from discs.kernels import protocol as do
from discs.loads import Custom, Damping, Force, Linear, Motor, Potential, Rest, Slope, Spring, Torque, signals
from tests.conftest import Model, models, uneven
from tests.discs.test_loads import KINDS, by_discs, by_multipliers

CLOSE = {"midpoint": 2e-3, "suzuki4": 2e-5, "kahanli6": 1e-6, "gauss6": 1e-6, "rk4": 1e-5, "DOP853": 1e-6}


def every(problem: Problem) -> tuple:
    """Loads of every kind, uneven along the chain."""
    k, steered = problem.chain.k, isinstance(problem.chain, SteeredChain)
    own = {"turning": 0.2, "bending": lambda s: 0.03 + 0.02 * s} if steered else {}
    loads = (
        Torque(lambda s: 0.3 - 0.1 * s, signals.sine(1.1, 2.7, 0.4)),
        Torque(-0.2, at=2.2 * k),
        Force(x=0.1, y=lambda s: 0.2 * s, signal=signals.smooth(0.1, 0.8)),
        Force(y=0.3, signal=lambda t: t * t, at=3.0),
        Slope(0.3, -0.2),
        Spring(lambda s: s, 0.1, 0.4),
        Damping(rolling=lambda s: 0.1 * (1 + s), torsion=np.linspace(0.02, 0.3, problem.chain.middles.size), **own),
        Rest(twist=0.4),
        Rest(twist=lambda s: 0.2 * s, signal=signals.sine(0.8, 1.5), **({"curvature": 0.3} if steered else {})),
    )
    return (*loads, Torque(0.1, signals.ramp(0.0, 2.0), about="turn"), Rest(curvature=-0.2)) if steered else loads


def as_users(load, problem: Problem):
    """The same load, written again from its formula as a force f(t, q, v) (rows, n)."""
    chain, n = problem.chain, problem.chain.n
    ring = chain.ends == "ring"
    pairs = [(i, (i + 1) % n) for i in range(n - (not ring))]
    middles = [(i + 0.5) * chain.k for i, _ in pairs]

    def value(pattern, i, s):
        return pattern(np.array([s]))[0] if callable(pattern) else np.ravel(pattern)[i * (np.size(pattern) > 1)]

    def force(t, q, v):
        f = np.zeros_like(q)
        signal = getattr(load, "signal", None)
        now = 1.0 if signal is None else float(signal(t))
        for i in range(n):
            w, s = chain.w[i], chain.s[i]
            at = getattr(load, "at", None)
            if at is not None:
                away = abs(chain.s - at)
                w = float(i == int(np.argmin(np.minimum(away, chain.length - away) if ring else away)))
            if isinstance(load, Torque):
                f[2 if load.about == "roll" else 3, i] = now * w * value(load.pattern, i, s)
            if isinstance(load, Force):
                f[0, i], f[1, i] = (now * w * value(part, i, s) for part in (load.x, load.y))
            if isinstance(load, Slope):
                f[0, i], f[1, i] = (w * np.asarray(chain.density)[i] * g for g in (load.gx, load.gy))
            if isinstance(load, Spring):
                f[:2, i] = [w * load.stiffness * (value(to, i, s) - q[row, i]) for row, to in enumerate((load.x, load.y))]
            if isinstance(load, Damping):
                f[2, i] -= w * value(load.rolling, i, s) * v[2, i]
                if len(q) > 3:
                    f[3, i] -= w * value(load.turning, i, s) * v[3, i]
        for j, (i, k) in enumerate(pairs):
            if isinstance(load, Damping):
                for row, pattern in ((2, load.torsion), (3, load.bending))[: len(q) - 2]:
                    moment = value(pattern, j, middles[j]) * (v[row, k] - v[row, i]) / chain.k
                    f[row, i], f[row, k] = f[row, i] + moment, f[row, k] - moment
            if isinstance(load, Rest):
                of = ((2, load.twist, chain.torsion_stiffness), (3, load.curvature, chain.bending_stiffness))
                for row, pattern, stiffness in of[: len(q) - 2]:
                    moment = -now * np.asarray(stiffness)[j] * value(pattern, j, middles[j])
                    f[row, i], f[row, k] = f[row, i] + moment, f[row, k] - moment
        return f

    return Custom(force).on(chain)


@models(KINDS)
def test_loads_of_every_kind_move_discs_as_the_saddle_point_says(model, kernels_as_python):
    problem = uneven(7, model)
    loads = every(problem)
    expected, multipliers = by_multipliers(replace(problem, loads=tuple(as_users(load, problem) for load in loads)))
    for name, close in CLOSE.items():
        for engine in ("compiled", "plain") if name in ("midpoint", "gauss6") else ("compiled",):
            found, contact_force = by_discs(replace(problem, loads=loads), name, engine)
            np.testing.assert_allclose(found, expected, rtol=0, atol=close, err_msg=f"{name}, {engine}")
    np.testing.assert_allclose(contact_force, multipliers, rtol=0, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("model", "method"), [(KINDS[0], "gauss6"), (KINDS[4], "midpoint")])  # each takes 20 s to compile
def test_loads_compile(model, method):
    problem = uneven(7, model)
    problem = replace(problem, loads=every(problem))
    one, other = (simulate(problem, method, 0.02, [0.33, 1.0], progress=False, engine=e) for e in ("compiled", "plain"))
    assert one.stats["engine"] == "compiled"
    for name in (*problem.system.rows, "work", "dissipated", "energy"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0, atol=1e-12)


@models(KINDS)
@pytest.mark.parametrize("engine", ["compiled", "plain"])
def test_energy_is_work_less_dissipation(model, engine, kernels_as_python):
    """To rounding for midpoint and Gauss steps where H is quadratic, otherwise to the tolerance of sweeps; at every frame."""
    problem = uneven(7, model)
    problem = replace(problem, loads=every(problem))
    for method, close in (
        ("midpoint", 2e-13),
        ("suzuki4", 2e-13),
        ("gauss4", 1e-4),
        ("gauss6", 1e-7),
        ("rk4", 1e-6),
        ("DOP853", 3e-6),
    ):
        if method.startswith("gauss") and problem.system.quadratic:
            close = 2e-13
        integrator = METHODS[method](tolerance=1e-15) if method == "midpoint" else METHODS[method]()
        run = simulate(
            problem, integrator, 0.02 if method != "rk4" else 0.005, np.linspace(0.013, 1, 5), progress=False, engine=engine
        )
        off = run.energy - problem.energy() - run.work + run.dissipated
        assert abs(off).max() < close * abs(run.energy).max(), method
        assert (np.diff(run.dissipated) > 0).all()
        assert abs(run.work).max() > 0.05 * abs(run.energy).max()
        assert "energy - work + dissipated" in repr(run)
    assert run.stats["engine"] == engine


@models([KINDS[0], KINDS[2]])
@pytest.mark.parametrize("method", ["leapfrog", "mclachlan-perlmutter"])
def test_explicit_schemes_take_loads_that_are_part_of_the_energy(model, method, kernels_as_python):
    """Against gauss6, at order 2; the modified energy with polarised potentials of loads is exact."""
    problem = replace(uneven(6, model), loads=(Slope(0.5, -0.8), Spring(lambda s: s, 0.3, 1.5), Rest(twist=0.6)))
    exact = simulate(problem, "gauss6", 0.02, 2, progress=False, engine="plain")
    want = ("modified_energy",) if method == "leapfrog" else ()
    for engine in ("compiled", "plain"):
        off = []
        for dt in (0.01, 0.005):
            run = simulate(problem, method, dt, 5, want, progress=False, engine=engine)
            off.append(max(abs(getattr(run, row)[-1] - getattr(exact, row)[-1]).max() for row in problem.system.rows))
        assert off[0] / off[1] == pytest.approx(4, abs=0.6)
        assert run.stats["engine"] == engine
        if want:
            assert abs(run.modified_energy - run.modified_energy[0]).max() < 1e-12 * abs(run.modified_energy[0])
    with pytest.raises(ValueError, match=f"'{method}' takes loads that are part of the energy only"):
        simulate(replace(problem, loads=(Damping(0.1),)), method, 0.005, progress=False)


def test_frames_do_not_change_work():
    problem = uneven(7, KINDS[0])
    problem = replace(problem, loads=every(problem))
    few, many = (simulate(problem, "midpoint", 0.03, f, progress=False, engine="plain") for f in ([0.31, 1.0], 57))
    assert few.work[-1] == many.work[-1]
    assert few.dissipated[-1] == many.dissipated[-1]


def test_summaries_and_pictures_speak_of_the_balance():
    problem = uneven(7, KINDS[0])
    problem = replace(problem, loads=every(problem))
    run = simulate(problem, "midpoint", 0.05, 5, progress=False, engine="plain")
    assert "taken by dampers" in summary(run)
    assert "balanced to" in summary(run)
    (ax,) = run.plot("energy")
    assert abs(ax.lines[0].get_ydata()).max() < 1e-12
    with pytest.raises(ValueError, match="balances are those of a rod without loads"):
        balances(untwisting_rod().rod, run, "field")


def test_a_force_may_divide_by_the_speed_of_discs_that_move():
    """Forces are tried at the initial state, not at rest."""
    problem = uneven(7, KINDS[0])
    friction = Custom(lambda t, q, v: np.array([0 * v[2], 0 * v[2], -0.01 * v[2] / abs(v[2])]))
    replace(problem, loads=(friction,))
    with np.errstate(invalid="ignore"), pytest.raises(ValueError, match="Custom: the force must be finite numbers"):
        replace(problem, initial=replace(problem.initial, omega=0.0), loads=(friction,))


def test_the_energy_of_another_state_needs_no_motor():
    problem = uneven(7, KINDS[0])
    driven = replace(problem, loads=(Motor(float(problem.initial.omega[2]), problem.chain.s[2]), Slope(0.1)))
    other = replace(problem.initial, omega=0.3)
    assert driven.energy(other) == replace(problem, initial=other, loads=(Slope(0.1),)).energy()


def one_row(loads, n: int = 5, duration: float = 2.0, **parameters) -> Problem:
    """Discs without springs, abreast and rolling along y."""
    values = {"density": 1.3, "spin_inertia": 0.6, "torsion_stiffness": 0.0, "bending_stiffness": 0.0, "radius": 0.7} | parameters
    chain = Chain(n=n, length=2.0, rolling="unit", **values)
    return Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), duration, loads)


INERTIA = 0.6 + 1.3 * 0.7**2


def test_discs_roll_down_a_slope_as_one_does():
    """y'' = rho R^2 g/(alpha + rho R^2); the energy, that of height included, is constant."""
    run = simulate(one_row((Slope(0.4, -0.9),)), "midpoint", 0.02, 5, progress=False, engine="plain")
    fall = -0.9 * 1.3 * 0.7**2 / INERTIA
    np.testing.assert_allclose(run.y, 0.5 * fall * run.t[:, None] ** 2 * np.ones(5), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(run.energy, run.energy[0], atol=1e-13)
    assert run.problem.conserves
    assert not run.work.any()
    assert not run.dissipated.any()


def test_a_torque_does_the_work_of_its_angle():
    run = simulate(one_row((Torque(0.5, signals.sine(1.0, 3.0)),)), "gauss8", 0.1, 9, progress=False, engine="plain")
    theta = 0.5 / INERTIA / 3 * (run.t - np.sin(3 * run.t) / 3)
    np.testing.assert_allclose(run.theta, theta[:, None] * np.ones(5), rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(
        run.work, 2.0 * 0.5 * INERTIA * (0.5 / INERTIA / 3 * (1 - np.cos(3 * run.t))) ** 2, rtol=1e-8, atol=1e-13
    )


def test_viscosity_damps_torsion_waves_like_an_oscillator():
    """R = 0, free ends: M theta'' = -(beta theta + eta theta') t with t = 4 sin^2(q k/2)/k^2. Strong too: no step limit."""
    for eta, dt, close in ((0.1, 0.001, 1e-5), (50.0, 0.01, 1e-4)):
        n, length = 9, 2.0
        chain = Chain(
            n=n,
            length=length,
            density=1.0,
            spin_inertia=0.6,
            torsion_stiffness=0.9,
            bending_stiffness=0.5,
            radius=0.0,
            rolling="unit",
        )
        start = np.cos(np.pi * chain.s / length)
        problem = Problem(chain, State(chain.s, 0 * chain.s, start), 1.0, (Damping(torsion=eta),))
        t = 4 * np.sin(np.pi * chain.k / length / 2) ** 2 / chain.k**2
        first, second = np.roots([0.6, eta * t, 0.9 * t])
        run = simulate(problem, "midpoint", dt, 5, progress=False, engine="plain")
        swing = (second * np.exp(first * run.t) - first * np.exp(second * run.t)) / (second - first)
        np.testing.assert_allclose(run.theta, np.outer(swing.real, start), atol=close)


@pytest.mark.filterwarnings("ignore:.* is too long for this motion")  # which is rounding only
@pytest.mark.parametrize("steered", [False, True])
def test_a_rod_at_its_rest_shape_stays_there_without_energy(steered):
    problem = uneven(7, Model("springs", "steered" if steered else "field"))
    chain, n = problem.chain, problem.chain.n
    twist = np.linspace(0.2, -0.4, n - 1)
    theta = np.concatenate([[0.0], np.cumsum(chain.k * twist)])
    state = State(chain.s, 0 * chain.s, theta, phi=0 * theta if steered else None)
    run = simulate(replace(problem, initial=state, loads=(Rest(twist=twist),)), "midpoint", 0.05, 3, progress=False, engine="plain")
    np.testing.assert_allclose(run.theta, theta * np.ones((3, 1)), atol=1e-13)
    np.testing.assert_allclose(run.energy, 0, atol=1e-14)


def test_the_energy_of_rest_shapes_is_that_of_the_strain_from_rest():
    """Of several together, static and driven, on a ring with whole turns of the heading too."""
    problem = uneven(7, Model("ring", "steered"))
    chain, q = problem.chain, problem.start().hi
    loads = (Rest(0.3, 0.5), Rest(-0.2, 0.7, signal=signals.ramp(-1.0, 1.0)), Rest(0.1, -0.4, signal=signals.ramp(-3.0, 1.0)))
    d = np.roll(q, -1, axis=1) - q
    d[3, -1] += 2 * np.pi
    off = d[2:] / chain.k - np.array([[0.3 - 0.2 * 0.5 + 0.1 * 0.75], [0.5 + 0.7 * 0.5 - 0.4 * 0.75]])
    change = sum(
        0.5 * chain.k * np.sum(np.asarray(stiff) * (after**2 - before**2))
        for stiff, after, before in zip((chain.torsion_stiffness, chain.bending_stiffness), off, d[2:] / chain.k, strict=True)
    )
    assert replace(problem, loads=loads).energy() == pytest.approx(problem.energy() + change, rel=1e-13)


def test_rest_stretch_and_shear_are_those_of_the_energy():
    """V against its formula, the force against differences of it, and energy over midpoint steps."""
    problem = uneven(6, Model("ring", "steered"))
    stretch, shear, psi = 0.1, np.linspace(-0.1, 0.2, 6), 0.7
    chain = problem.chain

    def energy(q):
        total = problem.system.potential(problem.system.shape(q))
        d = np.roll(q, -1, axis=1) - q
        d[3, -1] += 2 * np.pi
        line = (d[0] + 1j * d[1]) / chain.k * np.exp(-1j * (q[3] + 0.5 * d[3]))
        off = line - np.exp(-1j * psi) - stretch - 1j * shear
        for part, stiff in (((line - 1).real, -chain.stretch_stiffness), ((line - 1).imag, -chain.shear_stiffness)):
            total += 0.5 * chain.k * np.sum(stiff * part**2)
        return total + 0.5 * chain.k * np.sum(chain.stretch_stiffness * off.real**2 + chain.shear_stiffness * off.imag**2)

    own = replace(problem, loads=(Rest(stretch=stretch, shear=shear), Rest(mounting_angle=psi)))
    system, q, rng = own.system, own.start().hi, np.random.default_rng(2)
    assert system.potential(system.shape(q)) == pytest.approx(energy(q), rel=1e-13)
    move = rng.normal(size=q.shape)
    slope = (energy(q + 1e-5 * move) - energy(q - 1e-5 * move)) / 2e-5
    assert np.vdot(system.gradient(system.shape(q)), move) == pytest.approx(slope, rel=1e-8)
    run = simulate(own, Midpoint(tolerance=1e-14), 0.01, 4, progress=False)
    assert abs(run.energy - run.energy[0]).max() < 1e-11 * run.energy[0]
    assert (run.stats["engine"], own.conserves) == ("plain", True)


def test_a_snake_with_wheels_along_its_line_rolls_along_it():
    psi = np.pi / 2
    problem = lump(steered_rod(mounting_angle=psi, twist=0.0, radius=0.7), 6)
    problem = replace(problem, initial=replace(problem.initial, omega=1.3 * np.ones(6)))
    run = simulate(problem, "midpoint", 0.05, 3, progress=False)
    np.testing.assert_allclose(run.x, problem.chain.s - 0.7 * 1.3 * run.t[:, None], atol=1e-12)
    np.testing.assert_allclose(run.y, 0, atol=1e-12)
    np.testing.assert_allclose(run.phi, psi, atol=1e-12)


def test_a_driven_rest_shape_does_the_work_of_its_links():
    """-int S (a - e) e' dt over the motion, by quadrature of fine frames; also the work of a cycle of an actuator."""
    problem = replace(uneven(7, KINDS[0]), loads=(Rest(twist=0.7, signal=signals.sine(1.0, 5.0)),))
    run = simulate(problem, "gauss6", 0.02, 1001, progress=False, engine="plain")
    chain, rest = problem.chain, 0.7 * np.sin(5 * run.t)
    moment = np.asarray(chain.torsion_stiffness) * (np.diff(run.theta) / chain.k - rest[:, None])
    power = -chain.k * moment.sum(axis=1) * 0.7 * 5 * np.cos(5 * run.t)
    np.testing.assert_allclose(run.work, cumulative_simpson(power, x=run.t, initial=0), atol=1e-6)
    assert abs(run.work).max() > 0.1


def test_a_potential_of_ones_own_is_part_of_the_energy():
    well = Potential(lambda x, y: 0.2 * y**2 + 0.1 * x**4, lambda x, y: (0.4 * x**3, 0.4 * y))
    problem = replace(uneven(5, KINDS[0]), loads=(well,))
    run = simulate(problem, "rk4", 0.002, 5, progress=False)
    assert abs(run.energy - problem.energy()).max() < 1e-9
    assert run.stats["engine"] == "plain"
    same = replace(problem, loads=(Potential(lambda x, y: 0.2 * y**2, lambda x, y: (0 * x, 0.4 * y)),))
    spring = replace(problem, loads=(along_y(0.4, problem),))
    one, other = (simulate(p, "midpoint", 0.02, 2, progress=False, engine="plain") for p in (same, spring))
    np.testing.assert_allclose(one.y, other.y, atol=1e-11)


def along_y(stiffness: float, problem: Problem):
    return Linear(stiffness=np.outer([0, stiffness, 0], problem.chain.w))


@pytest.mark.parametrize("engine", ["compiled", "plain"])
def test_the_balance_stays_exact_over_many_steps(engine, kernels_as_python):
    problem = uneven(4, Model("consistent", "field"))
    problem = replace(problem, loads=every(problem))
    run = simulate(replace(problem, duration=40.0), Midpoint(tolerance=1e-15, sweeps=30), 0.02, 21, progress=False, engine=engine)
    largest = max(abs(part).max() for part in (run.energy, run.work, run.dissipated))
    assert abs(run.energy - run.energy[0] - run.work + run.dissipated).max() < 1e-13 * largest


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda p: Damping(rolling=-0.1), "rolling of Damping must be finite and at least 0; got -0.1"),
        (lambda p: Damping(torsion=np.ones(7)), r"torsion of Damping must be a number or an array of shape \(6,\)"),
        (lambda p: Damping(bending=0.1), "Damping: bending is for discs with headings of their own"),
        (lambda p: Rest(curvature=0.1), "Rest: curvature is for discs with headings of their own"),
        (lambda p: Rest(mounting_angle=0.1), "Rest: mounting_angle is for discs with headings of their own"),
        (lambda p: Torque(1.0, about="turn"), "Torque: about='turn' is for discs with headings"),
        (lambda p: Torque(1.0, about="pitch"), "about of Torque must be one of 'roll', 'turn'"),
        (lambda p: Torque(1.0, at=3.2), "at of Torque must be on the rod, from 0 to 3.1; got 3.2"),
        (lambda p: Torque(lambda s: s, at=1.0), "pattern of Torque with at= is one number"),
        (lambda p: Torque(lambda s: s[:2]), r"pattern of Torque must be a number or an array of shape \(7,\)"),
        (lambda p: Force(y=np.nan), "y of Force must be finite"),
        (lambda p: Force(y=1.0, signal=3.0), "signal of Force must be a function of t"),
        (lambda p: Force(y=1.0, signal=lambda t: np.nan), "Force: the signal .* must give finite numbers; got nan at t = 0"),
        (lambda p: Torque(1.0, signal=lambda t: np.ones(2)), "Torque: the signal .* must give a finite number; got .* at t = 0"),
        (lambda p: Torque(1.0, signal=lambda t: 1 / (1 - t) if t < 1 else np.inf), "got inf at t = 1"),
        (lambda p: Torque(1.0, signal=lambda t: "much"), "Torque: the signal .* must give a finite number; got 'much' at t = 0"),
        (lambda p: Spring(0.0, 0.0, -1.0), "stiffness of Spring must be at least 0"),
        (lambda p: Slope(np.inf), "gx of Slope must be a finite number"),
        (lambda p: Custom(lambda t, q, v: q[0]), r"Custom: the force must be finite numbers of shape \(3, 7\); got shape \(7,\)"),
        (lambda p: Custom(lambda t, q, v: np.nan * q), "Custom: the force must be finite numbers"),
        (
            lambda p: Linear(np.zeros((3, 7)), viscosity=np.ones((1, 7))),
            r"viscosity must be finite, at least 0 and of shape \(1, 8\)",
        ),
        (lambda p: Linear(np.zeros((3, 7)), viscosity=-np.ones((1, 8))), "viscosity must be finite, at least 0"),
        (lambda p: Custom(3), "force and power of Custom must be functions"),
        (lambda p: Potential(lambda x, y: x, None), "gradient of Potential must be a function"),
    ],
)
def test_what_a_load_cannot_be_is_refused_in_words(make, words):
    problem = uneven(7, KINDS[0])
    with pytest.raises(ValueError, match=words):
        replace(problem, loads=(make(problem),))


@pytest.mark.parametrize("engine", ["compiled", "plain"])
@pytest.mark.parametrize("method", ["midpoint", "DOP853"])
def test_a_signal_that_fails_on_the_way_is_named(method, engine, kernels_as_python):
    problem = replace(uneven(7, KINDS[0]), loads=(Torque(1.0, lambda t: np.nan if 0.5 < t < 0.9 else 1.0),))
    with pytest.raises(ValueError, match=r"Torque: the signal .* must give finite numbers; got nan at t = 0\.[56]"):
        simulate(problem, method, 0.05, 2, progress=False, engine=engine)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: signals.ramp(1.0, 1.0), "t0 of ramp must be less than t1"),
        (lambda: signals.pulse(0.0, -1.0), "width of pulse must be positive"),
        (lambda: signals.sine("a", 1.0), "amplitude of sine must be a finite number"),
        (lambda: signals.table([0, 2, 1], [1, 2, 3]), "t of table must be increasing times"),
        (lambda: signals.table([0, 1, 2], [1, 2]), "values of table must be a number or an array of shape"),
    ],
)
def test_what_a_signal_cannot_be_is_refused_in_words(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_signals_are_what_they_are_called():
    t = np.array([-1.0, 0.0, 0.5, 1.0, 2.0])
    np.testing.assert_allclose(signals.sine(2.0, 3.0, 0.1)(t), 2 * np.sin(3 * t + 0.1))
    np.testing.assert_array_equal(signals.ramp(0, 2)(t), [0, 0, 0.25, 0.5, 1])
    np.testing.assert_array_equal(signals.pulse(0, 1)(t), [0, 1, 1, 0, 0])
    np.testing.assert_array_equal(signals.smooth(0, 1)(t), [0, 0, 0.5, 1, 1])
    np.testing.assert_array_equal(signals.table([0, 1], [1, 3])(t), [1, 1, 2, 3, 3])
    slope = np.diff(signals.smooth(0, 1)(np.linspace(0, 1, 1001)))
    assert (slope >= 0).all()
    assert repr(signals.sine(2.0, 3.0)) == "sine(amplitude=2.0, rate=3.0, phase=0.0)"


def test_compiled_steps_notice_a_time_that_is_not_in_the_table(kernels_as_python):
    """A method that does not say where it evaluates forces gives NaN at once, not another value of the signal."""
    problem = replace(uneven(7, KINDS[0]), loads=(Torque(1.0, signals.sine(1.0, 1.0)),))
    system = problem.system
    for node, finite in ((0.5, True), (0.5001, False), (0.0, False)):
        method = Midpoint()
        numbers = type("Off", (type(method.parameters),), {"nodes": np.array([node])})
        do.room.register(numbers, do.room.dispatch(type(method.parameters)))
        do.step.register(numbers, do.step.dispatch(type(method.parameters)))
        do.jumps.register(numbers, do.jumps.dispatch(type(method.parameters)))
        vars(method)["parameters"] = numbers(*method.parameters)
        found, _ = method.march(system, system.parameters, problem.start(), 0.0, 0.1, 1, np.inf)
        assert np.isfinite(found.pi).all() == finite
