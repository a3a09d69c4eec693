"""Momentum maps of field theories, and what constraints leave of their conservation laws."""

import pytest
import sympy as sy

from continuum.lagrangian import FieldTheory
from tests.continuum.test_lagrangian import (
    ELASTIC,
    FREE,
    GENERATORS,
    KINETIC,
    ROD,
    ROLLING,
    STRETCH,
    K,
    R,
    alpha,
    beta,
    half,
    one_form,
    p,
    rho,
    s,
    same,
    t,
    theta,
    x,
    y,
)


def test_energy():
    """(ConsLawEnergy) is minus J of d/dt: what is printed follows with d^2 x = ds ^ dt, section 2 has dt ^ ds."""
    flux = sum((p * f.diff(s) - K * f.diff(s, 3)) * f.diff(t) + K * f.diff(s, 2) * f.diff(t, s) for f in (x, y))
    printed = flux + beta * theta.diff(s) * theta.diff(t), KINETIC + ELASTIC + STRETCH
    assert all(same(a, -b) for a, b in zip(one_form(FREE, {t: 1}), printed, strict=True))


def test_linear_momentum():
    """Minus the printed form, as the energy."""
    v1, v2 = sy.symbols("v1 v2")
    dt = -sum(v * (p * f.diff(s) - K * f.diff(s, 3)) for v, f in ((v1, x), (v2, y)))
    printed = dt, -rho * (v1 * x.diff(t) + v2 * y.diff(t))
    assert all(same(a, -b) for a, b in zip(one_form(FREE, {x: v1, y: v2}), printed, strict=True))


def test_momentum_of_theta():
    printed = -beta * theta.diff(s), -alpha * theta.diff(t)
    assert all(same(a, -b) for a, b in zip(one_form(FREE, {theta: 1}), printed, strict=True))


def test_angular_momentum_and_the_sign_that_is_misprinted():
    """Printed K (x'' y' + y'' x') dt, right K (x'' y' - y'' x') dt; again minus J as a whole."""
    dt, ds = one_form(FREE, {x: y, y: -x})
    common = -x * (-p * y.diff(s) + K * y.diff(s, 3)) + y * (-p * x.diff(s) + K * x.diff(s, 3))
    right, printed = (common - K * (x.diff(s, 2) * y.diff(s) + sign * y.diff(s, 2) * x.diff(s)) for sign in (-1, 1))
    assert same(ds, -rho * (x * y.diff(t) - y * x.diff(t)))
    assert same(dt, -right)
    # with the field equations d of the right form is 0, and of the printed one it is not
    rates = {f.diff(t, 2): ((p * f.diff(s)).diff(s) - K * f.diff(s, 4)) / rho for f in (x, y)}
    assert same((-ds.diff(t) - right.diff(s)).subs(rates), 0)
    assert same((-ds.diff(t) - printed.diff(s)).subs(rates), 2 * K * (y.diff(s, 2) * x.diff(s)).diff(s))


@pytest.mark.parametrize("name", ["x^2 d/dt and more", "rotation"])
def test_momentum_is_the_printed_cartan_form_contracted(name):
    """(2ndcartan) term by term, as printed, contracted with the prolonged generator and pulled back."""
    xi = {t: 2 * t + s, s: s**2, x: x * y, y: s - t * x} if name != "rotation" else GENERATORS["rotation"]
    lagrangian = x * y.diff(t, s) ** 2 + y.diff(t) * x.diff(s, 2) * s + x.diff(t) ** 2 * x.diff(s) + x.diff(t, 2) * y.diff(s, 2)
    base = (t, s)
    along = [sy.sympify(xi.get(mu, 0)) for mu in base]

    def contracted(function, component, mu):
        """dt and ds of xi contracted with d(function) ^ d x_mu, component = xi(function)."""
        if mu == t:  # d x_0 = ds
            return sy.Matrix([-along[1] * function.diff(t), component - along[1] * function.diff(s)])
        return sy.Matrix([-component + along[0] * function.diff(t), along[0] * function.diff(s)])

    total, last = sy.zeros(2, 1), lagrangian
    for f in (x, y):
        up = {
            mu: sy.sympify(xi.get(f, 0)).diff(mu) - sum(f.diff(nu) * a.diff(mu) for nu, a in zip(base, along, strict=True))
            for mu in base
        }
        second = {(nu, mu): lagrangian.diff(f.diff(nu, mu)) * (1 if nu == mu else half) for nu in base for mu in base}
        for nu in base:
            first = lagrangian.diff(f.diff(nu)) - sum(second[nu, mu].diff(mu) for mu in base)
            total += first * contracted(f, sy.sympify(xi.get(f, 0)), nu)
            last -= first * f.diff(nu)
            for mu in base:
                total += second[nu, mu] * contracted(f.diff(nu), up[nu], mu)
                last -= second[nu, mu] * f.diff(nu, mu)
    total += last * sy.Matrix([-along[1], along[0]])
    assert all(same(a, b) for a, b in zip(one_form(FieldTheory(lagrangian, (x, y)), xi), total, strict=True))


@pytest.mark.parametrize("xi", [{t: 1}, {x: y, y: -x}, {t: 2 * t, s: s, x: x**2, theta: s * y}, {t: s, s: t * s}], ids=str)
def test_noether_s_identity_holds_off_shell(xi):
    """D_mu j^mu + Q^a E_a = pr xi(L) + L D_mu xi^mu for any fields, symmetry or not."""
    theory = FieldTheory(KINETIC - ELASTIC + x.diff(t, s) ** 2 * theta * s, (x, y, theta))
    density, flux = theory.momentum(xi)
    moves = [sy.sympify(xi.get(f, 0)) - f.diff(t) * xi.get(t, 0) - f.diff(s) * xi.get(s, 0) for f in theory.fields]
    left = density.diff(t) + flux.diff(s) + sum(q * e for q, e in zip(moves, theory.euler_lagrange(), strict=True))
    assert same(left, theory.noether(xi).invariance)


# Conservation laws under constraints


@pytest.mark.parametrize("name", GENERATORS)
def test_the_free_rod_conserves_everything_the_rolling_rod_energy(name):
    """All are symmetries; only d/dt is annihilated by the constraint forces, the paper's proposition."""
    assert FREE.noether(GENERATORS[name]).conserved
    noether = ROD.noether(GENERATORS[name])
    assert noether.invariance == 0
    assert noether.conserved == (name == "time")


def test_what_the_constraint_forces_do():
    """xi contracted with Phi^1, Phi^2, by hand: the sources of the momentum equation."""
    assert ROD.noether({x: 1}).work == (1, 0)
    assert ROD.noether({theta: 1}).work == (R * y.diff(s), -R * x.diff(s))
    assert ROD.noether({x: y, y: -x}).work == (y, -x)
    assert same(ROD.noether({s: 1}).work[0], -x.diff(s) - R * theta.diff(s) * y.diff(s))


def test_momentum_equation_of_the_rolling_rod():
    """D_mu j^mu = -lambda_alpha A^alpha_a Q^a along solutions, the nonholonomic momentum equation."""
    solved = sy.solve(ROD.equations(), [f.diff(t, 2) for f in ROD.fields], dict=True)[0]
    for name in ("x", "theta", "rotation"):
        density, flux = ROD.momentum(GENERATORS[name])
        source = -sum(m * w for m, w in zip(ROD.multipliers, ROD.noether(GENERATORS[name]).work, strict=True))
        assert same((density.diff(t) + flux.diff(s)).subs(solved), source)


def test_one_constraint_leaves_the_other_momentum():
    theory = FieldTheory(KINETIC - ELASTIC, (x, y, theta), ROLLING[0])
    assert theory.noether({y: 1}).conserved
    assert not theory.noether({x: 1}).conserved


def test_energy_under_other_constraints():
    """Conserved for the unit law and any law homogeneous in the rates; not on a turntable, whose motor does work."""
    slope = sy.sqrt(x.diff(s) ** 2 + y.diff(s) ** 2)
    unit = (x.diff(t) + R * theta.diff(t) * y.diff(s) / slope, y.diff(t) - R * theta.diff(t) * x.diff(s) / slope)
    assert FieldTheory(KINETIC - ELASTIC, (x, y, theta), unit).noether({t: 1}).conserved
    cone = (x.diff(t) ** 2 + y.diff(t) ** 2 - R**2 * theta.diff(t) ** 2,)
    assert FieldTheory(KINETIC - ELASTIC, (x, y, theta), cone).noether({t: 1}).conserved
    turning = sy.Symbol("Omega")
    table = (ROLLING[0] + turning * y, ROLLING[1] - turning * x)
    noether = FieldTheory(KINETIC - ELASTIC, (x, y, theta), table).noether({t: 1})
    assert noether.work == (turning * y, -turning * x)
    assert not noether.conserved
