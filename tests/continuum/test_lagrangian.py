"""Field equations and momentum maps against the paper's printed formulas, derivations by hand, SymPy's Euler-Lagrange equations.

Where the paper misprints, a test states the printed formula and the right one, and what is wrong with the first.
"""

import subprocess
import sys

import numpy as np
import pytest
import sympy as sy
from sympy.calculus.euler import euler_equations

from continuum import Rod
from continuum.dispersion import frequency, growth
from continuum.lagrangian import FieldTheory

half = sy.Rational(1, 2)
t, s = sy.symbols("t s", real=True)
x, y, theta, p = (sy.Function(name)(t, s) for name in ("x", "y", "theta", "p"))
rho, alpha, beta, K, R = PARAMETERS = sy.symbols("rho alpha beta K R", positive=True)
KINETIC = half * rho * (x.diff(t) ** 2 + y.diff(t) ** 2) + half * alpha * theta.diff(t) ** 2
ELASTIC = half * beta * theta.diff(s) ** 2 + half * K * (x.diff(s, 2) ** 2 + y.diff(s, 2) ** 2)
STRETCH = half * p * (x.diff(s) ** 2 + y.diff(s) ** 2 - 1)
FREE = FieldTheory(KINETIC - ELASTIC - STRETCH, (x, y, theta, p))  # (roddensity)
ROLLING = (x.diff(t) + R * theta.diff(t) * y.diff(s), y.diff(t) - R * theta.diff(t) * x.diff(s))  # (constraints)
ROD = FieldTheory(KINETIC - ELASTIC, (x, y, theta), ROLLING)
GENERATORS = {"time": {t: 1}, "arclength": {s: 1}, "x": {x: 1}, "theta": {theta: 1}, "rotation": {x: y, y: -x}}


def same(left, right):
    difference = sy.expand(left - right)
    return difference == 0 or sy.simplify(difference) == 0


def one_form(theory, xi):
    """The coefficients of dt and ds of J_xi, with d^2 x = dt ^ ds: d^1 x_0 = ds, d^1 x_1 = -dt."""
    density, flux = theory.momentum(xi)
    return -flux, density


# Field equations


def test_free_rod():
    """(freeFE), and inextensibility from varying p."""
    printed = (
        rho * x.diff(t, 2) + K * x.diff(s, 4) - (p * x.diff(s)).diff(s),
        rho * y.diff(t, 2) + K * y.diff(s, 4) - (p * y.diff(s)).diff(s),
        alpha * theta.diff(t, 2) - beta * theta.diff(s, 2),
        half * (x.diff(s) ** 2 + y.diff(s) ** 2 - 1),
    )
    assert all(same(e, -q) for e, q in zip(FREE.equations(), printed, strict=True))


def test_nonholonomic_rod_and_the_sign_that_is_misprinted():
    """(NHFE) prints the multipliers with the other sign than (eq:nh), and R (lambda y' + mu x') for R (lambda y' - mu x').

    With the printed plus the constraint forces do work: their power lambda x. + mu y. + (...) theta. is not 0.
    """
    lam, mu = ROD.multipliers
    flipped = [e.subs({lam: -lam, mu: -mu}) for e in ROD.equations()]  # NHFE's lambda, mu are minus those of (eq:nh)
    assert same(flipped[0], -(rho * x.diff(t, 2) + K * x.diff(s, 4) - lam))
    assert same(flipped[1], -(rho * y.diff(t, 2) + K * y.diff(s, 4) - mu))
    left = alpha * theta.diff(t, 2) - beta * theta.diff(s, 2)
    right, printed = (R * (lam * y.diff(s) + sign * mu * x.diff(s)) for sign in (-1, 1))
    assert same(flipped[2], right - left)
    assert same(flipped[2] - (printed - left), -2 * R * mu * x.diff(s))
    on_the_constraints = {x.diff(t): -R * theta.diff(t) * y.diff(s), y.diff(t): R * theta.diff(t) * x.diff(s)}
    power = [(lam * x.diff(t) + mu * y.diff(t) + r * theta.diff(t)).subs(on_the_constraints) for r in (right, printed)]
    assert same(power[0], 0)
    assert same(power[1], 2 * R * mu * x.diff(s) * theta.diff(t))


def test_euler_lagrange_against_sympy():
    """A nonlinear Lagrangian with every second derivative, the mixed one too."""
    lagrangian = x * y.diff(t, s) ** 2 * s + sy.sin(x.diff(t)) * y.diff(t, 2) + x.diff(s, 2) ** 3 * y + t * x.diff(t, s) * y.diff(s)
    expected = euler_equations(lagrangian, (x, y), (t, s))
    theory = FieldTheory(lagrangian, (x, y))
    assert all(same(e, q.lhs) for e, q in zip(theory.equations(), expected, strict=True))


def test_rotary_inertia_of_a_beam():
    """Rayleigh's beam, rho y.. - I y..'' + K y'''' = 0: the mixed derivative counts once."""
    (equation,) = FieldTheory(
        half * rho * y.diff(t) ** 2 + half * alpha * y.diff(t, s) ** 2 - half * K * y.diff(s, 2) ** 2, y
    ).equations()
    assert same(equation, -rho * y.diff(t, 2) + alpha * y.diff(t, 2, s, 2) - K * y.diff(s, 4))


def test_vakonomic_rod_differs():
    """By hand from L + lambda (x. + R theta. y') + mu (y. - R theta. x'): rates of the multipliers in place of forces."""
    lam, mu = ROD.multipliers
    by_hand = (
        -rho * x.diff(t, 2) - K * x.diff(s, 4) - lam.diff(t) + R * (mu * theta.diff(t)).diff(s),
        -rho * y.diff(t, 2) - K * y.diff(s, 4) - mu.diff(t) - R * (lam * theta.diff(t)).diff(s),
        -alpha * theta.diff(t, 2) + beta * theta.diff(s, 2) - R * (lam * y.diff(s) - mu * x.diff(s)).diff(t),
    )
    vakonomic = ROD.equations(vakonomic=True)
    assert all(same(e, q) for e, q in zip(vakonomic, by_hand, strict=True))
    assert not any(same(e, q) for e, q in zip(vakonomic, ROD.equations(), strict=True))


def test_vakonomic_and_nonholonomic_agree_for_a_holonomic_constraint():
    """phi = d/dt f(y): the nonholonomic multiplier is the rate of the vakonomic one."""
    theory = FieldTheory(KINETIC - ELASTIC, (x, y, theta), ((x * sy.cos(theta) + y**2).diff(t),))
    (lam,) = theory.multipliers
    forces = [e.subs(lam, lam.diff(t)) for e in theory.equations()]
    assert all(same(e, q) for e, q in zip(forces, theory.equations(vakonomic=True), strict=True))


def test_a_disc_rolling_down_an_incline():
    """Mechanics, t alone: heading phi = Omega t and theta.. = -m g R sin(phi)/(I + m R^2); the vakonomic motion is another one."""
    m, inertia, g, turning, R = sy.Rational(13, 10), sy.Rational(3, 5), sy.Rational(9, 2), sy.Rational(7, 4), sy.Rational(4, 5)
    x, y, theta, phi = fields = tuple(sy.Function(name)(t) for name in ("x", "y", "theta", "phi"))
    squares = half * m * (x.diff(t) ** 2 + y.diff(t) ** 2) + half * inertia * theta.diff(t) ** 2 + half * phi.diff(t) ** 2
    roll = (x.diff(t) + R * theta.diff(t) * sy.sin(phi), y.diff(t) - R * theta.diff(t) * sy.cos(phi))
    disc = FieldTheory(squares + m * g * x, fields, roll)
    rate = m * g * R * sy.cos(turning * t) / ((inertia + m * R**2) * turning)
    rates = [-R * rate * sy.sin(turning * t), R * rate * sy.cos(turning * t), rate]
    motion = {f: sy.integrate(v, t) for f, v in zip(fields, rates, strict=False)} | {phi: turning * t}
    equations = [e.subs(motion).doit() for e in disc.equations()]
    reaction = sy.solve(equations[:2], disc.multipliers, dict=True)[0]
    assert all(same(e.subs(reaction), 0) for e in equations)
    assert all(same(c.subs(motion).doit(), 0) for c in disc.constraints)
    # vakonomic: the equations of x and y give the multipliers up to constants, which cannot satisfy that of phi at all times
    vakonomic = [e.subs(motion).doit() for e in disc.equations(vakonomic=True)]
    constants = sy.symbols("c1 c2")
    found = [
        sy.integrate(sy.solve(e, lam.diff(t))[0], t) + c for e, lam, c in zip(vakonomic, disc.multipliers, constants, strict=False)
    ]
    left = vakonomic[3].subs(dict(zip(disc.multipliers, found, strict=True))).doit()
    rows = [
        [left.diff(c).subs(t, time) for c in constants] + [left.subs(dict.fromkeys(constants, 0) | {t: time})]
        for time in (0.3, 0.8, 1.9)
    ]
    assert abs(np.linalg.det(np.array(rows, dtype=float))) > 0.1


@pytest.mark.parametrize("rolling", ["field", "unit"])
def test_waves_of_the_rolling_rod(rolling):
    """The field equations linearised about r = (s, R w t), theta = w t have the growth and frequency of `continuum.dispersion`."""
    slope = sy.sqrt(x.diff(s) ** 2 + y.diff(s) ** 2) if rolling == "unit" else 1
    theory = FieldTheory(
        KINETIC - ELASTIC,
        (x, y, theta),
        (x.diff(t) + R * theta.diff(t) * y.diff(s) / slope, y.diff(t) - R * theta.diff(t) * x.diff(s) / slope),
    )
    eps, w, sigma, q = sy.symbols("epsilon omega sigma q")
    amplitudes = sy.symbols("a:5")
    wave = [eps * a * sy.exp(sigma * t + sy.I * q * s) for a in amplitudes]
    motion = dict(zip((*theory.fields, *theory.multipliers), wave, strict=True))
    motion |= {x: s + motion[x], y: R * w * t + motion[y], theta: w * t + motion[theta]}
    equations = [e.subs(motion).doit().diff(eps) for e in (*theory.equations(), *theory.constraints)]
    linear = [e.subs({eps: 0, t: 0, s: 0}) for e in equations]  # the same at every t and s, but for the wave
    matrix = sy.Matrix([[e.diff(a) for a in amplitudes] for e in linear])
    numbers = dict(zip(PARAMETERS, (1.3, 0.6, 0.9, 0.5, 0.7), strict=True))
    rod = Rod(length=3.7, density=1.3, spin_inertia=0.6, torsion_stiffness=0.9, bending_stiffness=0.5, radius=0.7)
    for number, rate in ((1.7, 1.3), (4.0, 0.8), (2.2, 0.0)):
        polynomial = sy.Poly(sy.expand(matrix.det().subs(numbers | {q: number, w: rate})), sigma)
        roots = np.array(polynomial.nroots(maxsteps=200), dtype=complex)
        assert roots.real.max() == pytest.approx(float(growth(rod, number, rate, rolling)), abs=1e-8)
        if rolling == "unit" or rate == 0:
            assert np.abs(roots.imag).max() == pytest.approx(float(frequency(rod, number)), rel=1e-10)


# Momentum maps


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


def test_what_is_no_symmetry():
    assert not FREE.noether({x: x}).conserved
    stiff = FieldTheory(KINETIC - ELASTIC * sy.Function("g")(t), (x, y, theta))
    assert stiff.noether({t: 1}).invariance != 0
    wave = FieldTheory(half * theta.diff(t) ** 2 - half * theta.diff(s) ** 2, theta)
    assert wave.noether({t: t, s: s}).conserved  # scaling
    assert wave.noether({t: s, s: t}).conserved  # boost
    assert not wave.noether({t: t}).conserved


def test_continuum_does_not_import_sympy():
    """It takes longer to import than all the rest; only these modules need it."""
    code = "import sys, continuum; sys.exit('sympy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_bad_input():
    z = sy.Function("z")(t)
    for arguments, message in (
        ((x.diff(t), (x, z)), r"fields must depend on the same coordinates in the same order; got \(x\(t, s\), z\(t\)\)"),
        ((x.diff(t), (x, t)), r"fields must be functions of coordinates, such as Function\('x'\)\(t, s\); got t"),
        ((x.diff(t), ()), "fields must depend"),
        ((x.diff(t, 3), x), "the Lagrangian must have derivatives of order 2 at most; got"),
        ((x.diff(t), x, x.diff(s, t)), "a constraint must have derivatives of order 1 at most; got"),
        (("x +", x), r"the Lagrangian must be a SymPy expression; got 'x \+'"),
        ((KINETIC, (x, y), x.diff(s) ** 2 + y.diff(s) ** 2 - 1), "independent in the fields' time derivatives"),
        ((KINETIC, (x, y), (x.diff(t), 2 * x.diff(t) + s)), "independent in the fields' time derivatives"),
    ):
        with pytest.raises(ValueError, match=message):
            FieldTheory(*arguments)
    with pytest.raises(ValueError, match=r"a generator's keys must be among t, s, x\(t, s\), y\(t, s\), theta\(t, s\); got p"):
        ROD.momentum({p: 1})
    with pytest.raises(ValueError, match="a generator must depend on coordinates and fields only"):
        ROD.noether({x: y.diff(s)})
    knot = FieldTheory(KINETIC, (x,), x.diff(t) ** 5 + sy.exp(x.diff(t)) - x.diff(s))
    with pytest.raises(ValueError, match="constraints must be solvable for the fields' time derivatives"):
        knot.noether({t: 1})
