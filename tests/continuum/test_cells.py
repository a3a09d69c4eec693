"""Discrete field equations against the paper's section 4 term by term, the discs' own scheme, and exact solutions.

Where the paper misprints, a test states the printed formula and the right one.
"""

import sympy as sy

from continuum.cells import CellTheory, h, i, in_space, in_time, k, n, points, velocity

half = sy.Rational(1, 2)
t, s = sy.symbols("t s")
X, Y, THETA = (sy.Function(name)(t, s) for name in ("x", "y", "theta"))
FIELDS = x, y, theta = sy.symbols("x y theta", cls=sy.IndexedBase)
rho, alpha, beta, K, R, T = sy.symbols("rho alpha beta K R T")
u = sy.IndexedBase("u")


def same(left, right):
    return sy.expand(left - right) == 0


def second(f):
    """Delta^2."""
    return f[n, i + 1] - 2 * f[n, i] + f[n, i - 1]


def fourth(f):
    """Delta^4."""
    return f[n, i + 2] - 4 * f[n, i + 1] + 6 * f[n, i] - 4 * f[n, i - 1] + f[n, i - 2]


def slope(f):
    return (f[n, i + 1] - f[n, i - 1]) / (2 * k)


KINETIC = (rho * ((x[n + 1, i] - x[n, i]) ** 2 + (y[n + 1, i] - y[n, i]) ** 2) + alpha * (theta[n + 1, i] - theta[n, i]) ** 2) / (
    2 * h**2
)
TORSION = -beta / (2 * k**2) * (theta[n, i + 1] - theta[n, i]) ** 2
BENDING = -K / (2 * k**4) * (second(x) ** 2 + second(y) ** 2)
ROLLING = (velocity(x) + R * velocity(theta) * slope(y), velocity(y) - R * velocity(theta) * slope(x))
ROD = CellTheory(KINETIC + TORSION + BENDING, FIELDS, ROLLING)  # (discretelagrangian)

# The paper's formulas


def test_the_lagrangian_and_constraints_follow_from_the_continuous_ones():
    """(discretelagrangian), C_1/2, (discconstr1), (discconstr2) and F_d by the differences (FDeta), (FDtheta)."""
    kinetic = half * rho * (X.diff(t) ** 2 + Y.diff(t) ** 2) + half * alpha * THETA.diff(t) ** 2
    elastic = half * beta * THETA.diff(s) ** 2 + half * K * (X.diff(s, 2) ** 2 + Y.diff(s, 2) ** 2)
    lagrangian = in_time(in_space(kinetic - elastic, (t, s), forward=[THETA]), FIELDS, "forward")
    assert same(lagrangian, KINETIC + TORSION + BENDING)
    rolling = X.diff(t) + R * THETA.diff(t) * Y.diff(s), Y.diff(t) - R * THETA.diff(t) * X.diff(s)
    assert all(same(in_space(phi, (t, s)), printed) for phi, printed in zip(rolling, ROLLING, strict=True))
    turned = theta[n + 1, i] - theta[n - 1, i]
    printed = (
        x[n + 1, i] - x[n - 1, i] + R / (2 * k) * turned * (y[n, i + 1] - y[n, i - 1]),
        y[n + 1, i] - y[n - 1, i] - R / (2 * k) * turned * (x[n, i + 1] - x[n, i - 1]),
    )
    assert all(same(2 * h * phi, q) for phi, q in zip(ROD.discrete_constraints, printed, strict=True))
    assert ROD.forces == ((1, 0, R * slope(y)), (0, 1, -R * slope(x)))


def test_the_explicit_scheme_term_by_term():
    """Section 4.3, with the density it leaves out (1 there), and multipliers of the other sign than in (discNH)."""
    lam, mu = ROD.multipliers
    flipped = [e.subs({lam: -lam, mu: -mu}, simultaneous=True) * h**2 for e in ROD.equations()]

    def moved(f):
        return f[n + 1, i] - 2 * f[n, i] + f[n - 1, i]

    assert same(flipped[0], -(rho * moved(x) - h**2 * lam + h**2 * K / k**4 * fourth(x)))
    assert same(flipped[1], -(rho * moved(y) - h**2 * mu + h**2 * K / k**4 * fourth(y)))
    right = R * h**2 * (lam * slope(y) - mu * slope(x)) + beta * h**2 / k**2 * second(theta)
    assert same(flipped[2], right - alpha * moved(theta))
    printed = moved(x) - h**2 * lam + h**2 * K / k**4 * fourth(x)
    assert same(flipped[0] + printed, (1 - rho) * moved(x))  # what the printed equation lacks


def test_the_misprinted_second_difference():
    """Section 4.3 prints x'' ~ (x_{n,i-1} - 2 x_{n,i} + x_{n+1,i})/k^2: of x = s^2/2 at rest it has no limit; x_{n,i+1} has."""
    printed, right = (x[n, i - 1] - 2 * x[n, i] + last for last in (x[n + 1, i], x[n, i + 1]))
    parabola = {x[n + level, i + j]: (s + j * k) ** 2 / 2 for level in (0, 1) for j in (-1, 0, 1)}
    assert sy.limit(right.subs(parabola) / k**2, k, 0) == 1
    assert sy.limit((printed.subs(parabola) / k**2).subs(s, 1), k, 0) == -sy.oo


def test_cells_reach_what_the_paper_says():
    """L_d takes four of the six points of (6cell); phi_d takes level n-1, which the 6-cell has not."""
    assert {(p.level, p.offset) for p in points(KINETIC + TORSION + BENDING).values()} == {(0, -1), (0, 0), (0, 1), (1, 0)}
    assert {p.level for phi in ROD.discrete_constraints for p in points(phi).values()} == {-1, 0, 1}


def test_six_points():
    """A Lagrangian of all six points gives D_1 + ... + D_6 of (discEL)."""
    names = sy.symbols("f1:7")
    values = [u[n + level, i + j] for level in (0, 1) for j in (-1, 0, 1)]
    density = sy.Function("L")(*names)
    cell = dict(zip(names, values, strict=True))
    whole = sy.prod(f ** (j + 2) for j, f in enumerate(names, 1)) + names[0] * names[5] ** 2
    shifts = [(0, 1), (0, 0), (0, -1), (-1, 1), (-1, 0), (-1, -1)]  # cells of D_1 ... D_6
    expected = 0
    for name, (a, b) in zip(names, shifts, strict=True):
        at = {f: u[v.indices[0] + a, v.indices[1] + b] for f, v in cell.items()}
        expected += density.diff(name).subs(density, whole).doit().subs(at, simultaneous=True)
    assert same(CellTheory(whole.subs(cell), (u,)).euler_lagrange()[0], expected)


def test_the_paper_s_example_of_a_constraint():
    """phi = A_ab y^a_0 y^b_1 + B_b (y^b_1)^2: its printed C_d, C_1/2 and Phi."""
    a, b = sy.Matrix(2, 2, sy.symbols("A_11 A_12 A_21 A_22")), sy.symbols("B_1 B_2")
    pairs = [(row, column) for row in range(2) for column in range(2)]
    fields, bases = (X, Y), (x, y)
    phi = sum(a[pair] * fields[pair[0]].diff(t) * fields[pair[1]].diff(s) for pair in pairs)
    phi += sum(b[j] * fields[j].diff(s) ** 2 for j in range(2))
    semi = in_space(phi, (t, s))
    squares = sum(b[j] * slope(bases[j]) ** 2 for j in range(2))
    assert same(semi, sum(a[p] * velocity(bases[p[0]]) * slope(bases[p[1]]) for p in pairs) + squares)
    theory = CellTheory(sum((f[n + 1, i] - f[n, i]) ** 2 for f in bases), bases, semi, difference="forward")
    moved = [(f[n + 1, i] - f[n, i]) / h for f in bases]
    assert same(theory.discrete_constraints[0], sum(a[p] * moved[p[0]] * slope(bases[p[1]]) for p in pairs) + squares)
    assert all(same(theory.forces[0][f], sum(a[f, j] * slope(bases[j]) for j in range(2))) for f in range(2))
