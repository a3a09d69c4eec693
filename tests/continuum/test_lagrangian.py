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


def test_a_rod_whose_parameters_vary():
    """They stand inside the derivatives; s -> s + const is no symmetry: its balance has dL/ds as a source (`continuum.balance`)."""
    at = {symbol: sy.Function(symbol.name)(s) for symbol in PARAMETERS}
    rho_s, alpha_s, beta_s, k_s, r_s = (at[symbol] for symbol in PARAMETERS)
    theory = FieldTheory((KINETIC - ELASTIC).subs(at), (x, y, theta), tuple(c.subs(at) for c in ROLLING))
    lam, mu = theory.multipliers
    equations = theory.equations()
    assert same(equations[0], -(rho_s * x.diff(t, 2) + (k_s * x.diff(s, 2)).diff(s, 2) + lam))
    assert same(equations[1], -(rho_s * y.diff(t, 2) + (k_s * y.diff(s, 2)).diff(s, 2) + mu))
    torque = (beta_s * theta.diff(s)).diff(s) - alpha_s * theta.diff(t, 2)
    assert same(equations[2], torque - r_s * (lam * y.diff(s) - mu * x.diff(s)))
    moving = rho_s.diff(s) * (x.diff(t) ** 2 + y.diff(t) ** 2) + alpha_s.diff(s) * theta.diff(t) ** 2
    bent = k_s.diff(s) * (x.diff(s, 2) ** 2 + y.diff(s, 2) ** 2) + beta_s.diff(s) * theta.diff(s) ** 2
    assert same(theory.noether({s: 1}).invariance, (moving - bent) / 2)
    assert same(theory.noether({t: 1}).invariance, 0)
    assert all(same(work, 0) for work in theory.noether({t: 1}).work)


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


@pytest.mark.slow
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
