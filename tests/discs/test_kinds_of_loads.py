"""Torques, forces, slopes, springs, damping and rest shapes: against multipliers, closed forms and the balance of energy."""

from dataclasses import replace

import numpy as np
import pytest

from continuum import untwisting_rod
from continuum.balance import balances
from discs import Gauss4, Midpoint, Problem, Radau3, SteeredChain, simulate
from discs.command_line import summary
from discs.integrators import METHODS
from discs.loads import Custom, Damping, Force, Motor, Rest, Slope, Spring, Torque, signals
from tests.conftest import models, uneven
from tests.discs.test_loads import KINDS, by_discs, by_multipliers

pytestmark = pytest.mark.slow  # every load with every chain

CLOSE = {"midpoint": 2e-3, "suzuki4": 2e-5, "kahanli6": 1e-6, "gauss6": 1e-6, "rk4": 1e-5, "DOP853": 1e-6}


def every(problem: Problem) -> tuple:
    """Loads of every kind, uneven along the chain."""
    k, steered = problem.chain.k, isinstance(problem.chain, SteeredChain)
    own = {"turning": 0.2} if steered else {}
    loads = (
        Torque(lambda s: 0.3 - 0.1 * s, signals.sine(1.1, 2.7, 0.4)),
        Torque(-0.2, at=2.2 * k),
        Force(x=0.1, y=lambda s: 0.2 * s, signal=signals.smooth(0.1, 0.8)),
        Force(y=0.3, signal=lambda t: t * t, at=3.0),
        Slope(0.3, -0.2),
        Spring(lambda s: s, 0.1, 0.4),
        Damping(rolling=lambda s: 0.1 * (1 + s), torsion=np.linspace(0.02, 0.3, problem.chain.middles.size), **own),
        Damping(bending=lambda s: 0.03 + 0.02 * s),
        Rest(twist=0.4),
        Rest(twist=lambda s: 0.2 * s, curvature=0.6, signal=signals.sine(0.8, 1.5)),
        Rest(curvature=lambda s: -0.2 - 0.1 * s),
    )
    return (*loads, Torque(0.1, signals.ramp(0.0, 2.0), about="turn")) if steered else loads


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
                for row, pattern, stiffness in of[: len(q) - 2]:  # own headings; `of_bends` has the others
                    moment = -now * np.asarray(stiffness)[j] * value(pattern, j, middles[j])
                    f[row, i], f[row, k] = f[row, i] + moment, f[row, k] - moment
        return f

    return Custom(force).on(chain)


def of_bends(loads, problem: Problem):
    """Rest curvature and viscosity of bending of slaved headings, by the matrices of r' and r'' at the bends; r = x + i y."""
    chain, ring = problem.chain, problem.chain.ends == "ring"
    stiffness = np.asarray(chain.bending_stiffness)
    inner = slice(None) if stiffness.size == chain.n else slice(1, -1)
    s, w = chain.s[inner], chain.bend_shares
    rests = [(load.signal, load.curvature) for load in loads if isinstance(load, Rest)]
    eta = sum(load.bending(s) for load in loads if isinstance(load, Damping) and callable(load.bending))

    def derivatives(r):
        first, last = (r[-1], r[0]) if ring else (3 * r[0] - 3 * r[1] + r[2], 3 * r[-1] - 3 * r[-2] + r[-3])
        if chain.ends == "consistent":
            first, last = 4 * r[0] - 6 * r[1] + 4 * r[2] - r[3], 4 * r[-1] - 6 * r[-2] + 4 * r[-3] - r[-4]
        longer = np.concatenate([[first], r, [last]])
        slope, bend = (longer[2:] - longer[:-2]) / (2 * chain.k), (longer[2:] - 2 * r + longer[:-2]) / chain.k**2
        if chain.ends == "consistent":
            for end, sign, line in ((0, 1, r), (-1, -1, r[::-1])):
                slope[end] = sign * (8 * line[0] - 39 * line[1] + 48 * line[2] - 17 * line[3]) / (6 * chain.k)
        return slope[inner], bend[inner]

    first, second = derivatives(np.eye(chain.n))

    def force(t, q, v):
        kappa = sum((1.0 if f is None else f(t)) * (rest(s) if callable(rest) else rest) for f, rest in rests)
        slope, bend = derivatives(q[0] + 1j * q[1])
        moment = w * stiffness * (bend - 1j * kappa * slope)
        turning = second * slope[:, None] - first * bend[:, None]  # times i, the gradient of Im(conj(slope) bend)
        rate = (1j * turning).conj() @ (v[0] + 1j * v[1])
        pull = (w * stiffness * bend - moment) @ second - 1j * (kappa * moment) @ first - 1j * (w * eta * rate.real) @ turning
        return np.array([pull.real, pull.imag, 0 * pull.real])

    return Custom(force).on(chain)


@models(KINDS, [KINDS[1], KINDS[3]])
def test_loads_of_every_kind_move_discs_as_the_saddle_point_says(model, kernels_as_python):
    problem = uneven(7, model)
    loads = every(problem)
    again = [as_users(load, problem) for load in loads]
    if not isinstance(problem.chain, SteeredChain):
        again.append(of_bends(loads, problem))
    expected, multipliers = by_multipliers(replace(problem, loads=tuple(again)))
    implicit = "midpoint", "gauss6"
    for name in CLOSE if model in (KINDS[0], KINDS[-1]) else implicit:
        for engine in ("compiled", "plain") if name in implicit else ("compiled",):
            found, contact_force = by_discs(replace(problem, loads=loads), name, engine)
            np.testing.assert_allclose(found, expected, rtol=0, atol=CLOSE[name], err_msg=f"{name}, {engine}")
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


@models(KINDS, [KINDS[1], KINDS[3]])
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


def test_work_is_that_at_the_last_stages(kernels_as_python):
    """Also of steps with few sweeps; midpoint steps balance the energy with any number of them."""
    problem = uneven(7, KINDS[0])
    loads = every(problem)
    problem = replace(problem, loads=loads)
    for method in (Midpoint(sweeps=2, tolerance=0), Gauss4(sweeps=2, tolerance=0), Radau3(sweeps=2, tolerance=0)):
        one, other = (simulate(problem, method, 0.1, 4, progress=False, engine=e) for e in ("compiled", "plain"))
        for name in ("work", "dissipated", "energy"):
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0, atol=1e-13, err_msg=method.name)
    problem = replace(problem, loads=tuple(replace(x, bending=0.0) if isinstance(x, Damping) else x for x in loads))
    run = simulate(problem, Midpoint(sweeps=2, tolerance=0), 0.1, 4, progress=False)
    assert abs(run.energy - run.energy[0] - run.work + run.dissipated).max() < 1e-13 * abs(run.energy).max()


def test_explicit_steps_take_signals_at_their_stages(kernels_as_python):
    problem = replace(uneven(7, KINDS[0]), loads=(Torque(2.0, signals.sine(1.0, 6.0)),))
    exact = simulate(problem, "gauss6", 0.01, [0.0, 0.2], progress=False, engine="plain")
    for engine in ("compiled", "plain"):
        run = simulate(problem, "rk4", 0.005, [0.0, 0.2], progress=False, engine=engine)
        np.testing.assert_allclose(run.theta, exact.theta, rtol=0, atol=1e-7)


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
