"""Derivatives of common formulas against closed forms; formulas that are refused."""

import math

import numpy as np
import pytest
import sympy

from discs.mechanics import MechanicalSystem
from discs.mechanics.derivatives import Formula
from discs.mechanics.vakonomic import rolling_disc

Q, V = np.array([1.2, 0.5, -0.3, 0.9]), np.array([0.3, 0.2, -0.7, 1.0])
SYMBOLS = sympy.symbols("a:4")
KEPLER = -1 / sympy.sqrt(SYMBOLS[0] ** 2 + SYMBOLS[1] ** 2)


def jax_norm(q):
    import jax.numpy as jnp

    return -1 / jnp.linalg.norm(jnp.asarray(q)[:2])


def jax_root(q):
    import jax.numpy as jnp

    return -1 / jnp.sqrt(q[0] ** 2 + q[1] ** 2)


POTENTIALS = {
    "analytic": lambda q: -1 / np.sqrt(q[0] ** 2 + q[1] ** 2),
    "norm": lambda q: -1 / np.linalg.norm(q[:2]),
    "hypot": lambda q: -1 / np.hypot(q[0], q[1]),
    "vdot": lambda q: -1 / np.sqrt(np.vdot(q[:2], q[:2])),
    "abs": lambda q: -1 / np.sqrt(np.abs(q[0]) ** 2 + np.abs(q[1]) ** 2),
    "math": lambda q: -1 / math.sqrt(q[0] ** 2 + q[1] ** 2),
    "float64": lambda q: -1 / np.sqrt(np.float64(q[0]) ** 2 + float(q[1]) ** 2),
    "branch": lambda q: -1 / np.linalg.norm(q[:2]) if q[0] > 0 else 1e300,
    "lambdify": lambda q: sympy.lambdify(SYMBOLS, KEPLER)(*q),
    "sympy": lambda q: KEPLER.subs(dict(zip(SYMBOLS, q, strict=True))),
    "jax": jax_root,
    "jax norm": jax_norm,
}
BUFFER = np.zeros((2, 4))


def filled(q, a=None):
    a = np.zeros((2, 4)) if a is None else a
    a[0, 0] = a[1, 1] = 1
    a[0, 2], a[1, 2] = 0.7 * np.sin(q[3]), -0.7 * np.cos(q[3])
    return a


@pytest.mark.parametrize("name", POTENTIALS)
@pytest.mark.slow
def test_forces_of_potentials_as_people_write_them(name):
    if name.startswith("jax"):
        pytest.importorskip("jax")
    system = MechanicalSystem.from_lagrangian(tuple("abcd"), np.eye(4), POTENTIALS[name], lambda q: np.zeros((0, 4)), ())
    for q in (Q, Q + 0.1, Q * [1, -1, 1, 1]):
        expected = np.array([*-q[:2], 0, 0]) / np.hypot(*q[:2]) ** 3
        np.testing.assert_allclose(system.force(q, V), expected, atol=1e-11)
    assert system.formulas[0].error < 1e-11


def test_the_force_of_the_norm():
    system = MechanicalSystem.from_lagrangian(
        ("x", "y"), np.eye(2), lambda q: -1 / np.linalg.norm(q[:2]), lambda q: np.zeros((0, 2)), ()
    )
    np.testing.assert_allclose(system.force(np.array([1.2, 0.5]), np.zeros(2)), [-0.546, -0.228], atol=5e-4)


@pytest.mark.parametrize("buffer", [None, BUFFER], ids=["new", "the same each time"])
def test_a_constraint_that_is_filled_in(buffer):
    """The disc of `vakonomic.rolling_disc`, whose A. is by hand; and after 3 units of time."""
    known = rolling_disc(mass=1.3, spin_inertia=0.4, heading_inertia=0.25, radius=0.7)
    system = MechanicalSystem.from_lagrangian(
        known.names, known.mass(Q), lambda q: 0.0, lambda q: filled(q, buffer), ("disc", "disc")
    )
    np.testing.assert_allclose(system.constraint_rate(Q, V), known.constraint_rate(Q, V), atol=1e-11)
    start = np.array([0.0, 0.0, 0.0, 0.4])
    v = known.consistent_velocity(start, [0, 0, 1.1, 0.8])
    found, expected = (s.integrate(start, v, [0.0, 3.0], progress=False) for s in (system, known))
    np.testing.assert_allclose(found.q, expected.q, atol=1e-10)
    assert found.stats["derivatives"]["A"]["how"] == "real differences"
    assert found.stats["derivatives"]["A"]["error"] < 1e-11


def test_a_mass_that_is_not_analytic():
    """M = |q|^2 by abs against q^2."""
    parts = {"potential": lambda q: 0.0, "constraint": lambda q: np.zeros((0, 2)), "owners": ()}
    plain = MechanicalSystem.from_lagrangian(("a", "b"), lambda q: np.diag([1 + q[1] ** 2, 1.0]), **parts)
    other = MechanicalSystem.from_lagrangian(("a", "b"), lambda q: np.diag([1 + abs(q[1]) ** 2, 1.0]), **parts)
    q, v = np.array([0.3, -0.8]), np.array([1.1, 0.4])
    np.testing.assert_allclose(plain.force(q, v), [-2 * q[1] * v[1] * v[0], q[1] * v[0] ** 2], rtol=1e-14)
    np.testing.assert_allclose(other.force(q, v), plain.force(q, v), rtol=1e-10)


def test_a_branch_on_the_way_is_noticed():
    """The complex step is right at first and wrong behind the branch."""
    formula = Formula("V", lambda q: q[0] ** 2 if q[0] < 1.5 else 3 * np.abs(q[0]) - 2.25, (), 1)
    for q, slope in ((1.2, 2.4), (1.6, 3.0), (1.3, 2.6)):
        np.testing.assert_allclose(formula.slopes(np.array([q])), [slope], rtol=1e-10)
    assert formula.how == "real differences"


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_units_of_length_do_not_matter(scale):
    """The origin is included."""
    formula = Formula("V", lambda q: np.sin(np.abs(q[0] / scale) + 1) * np.linalg.norm([q[1] / scale, 1.0]), (), 2)
    for x, y in ((0.3, -0.4), (0.3, 0.0), (1.3, 2.4)):
        slopes = np.cos(x + 1) * np.hypot(y, 1), np.sin(x + 1) * y / np.hypot(y, 1)
        np.testing.assert_allclose(formula.slopes(scale * np.array([x, y])) * scale, slopes, atol=1e-10)


def test_a_narrow_bump_is_seen():
    """Ten widths away a long difference would pass over it or miss it."""

    def bump(q):
        return np.exp(-(((q[0] - 1.2) / 0.003) ** 2)) * np.abs(q[1])

    formula = Formula("V", bump, (), 2)
    formula.slopes(np.array([1.0, 0.5]))
    d = -2 * 0.001 / 0.003**2
    np.testing.assert_allclose(formula.slopes(np.array([1.201, 0.5])), np.exp(-1 / 9) * np.array([0.5 * d, 1]), rtol=1e-6)


def test_formulas_of_single_precision_are_refused():
    for single in (lambda q: np.float32(q[0]) ** 2, lambda q: float(np.float32(q[0]) ** 2)):
        with pytest.raises(ValueError, match="precision"):
            Formula("V", single, (), 1).slopes(np.array([0.7]))


def test_jax_is_computed_in_double_precision():
    pytest.importorskip("jax")
    system = MechanicalSystem.from_lagrangian(("x", "y"), np.eye(2), jax_root, lambda q: np.zeros((0, 2)), ())
    path = system.integrate([1, 0], [0, 1], [0.0, 1.0], progress=False)
    np.testing.assert_allclose(path.q[-1], [np.cos(1), np.sin(1)], atol=1e-10)  # Kepler's circle


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"constraint": lambda q, v: [[0, 1]]}, "A must be a function of q alone, A(q); missing a required argument: 'v'"),
        ({"potential": lambda: 0.0}, "V must be a function of q alone"),
        ({"potential": 3.0}, "V must be a function of q; got 3.0"),
        ({"mass": [[1, 0.4], [0, 1]]}, r"M must be symmetric; its entry (x, y) is 0.4 and (y, x) is 0"),
        ({"mass": np.eye(3)}, "A must be of shape (1, 2) and M of shape (2, 2)"),
        ({"names": "xy"}, "for 1 names and 1 owners"),
    ],
)
def test_what_is_not_a_formula_is_refused(given, message):
    parts = {"names": ("x", "y"), "mass": np.eye(2), "potential": lambda q: 0.0, "constraint": lambda q: [[0, 1]], "owners": "rail"}
    assert MechanicalSystem.from_lagrangian(**parts).owners == ("rail",)
    with pytest.raises(ValueError, match=message.translate({ord(c): f"\\{c}" for c in "()[]."})):
        MechanicalSystem.from_lagrangian(**parts | given)


def test_shapes_that_are_wrong_later_only():
    system = MechanicalSystem.from_lagrangian(
        ("x", "y"), np.eye(2), lambda q: 0.0, lambda q: [[0, 1]] if q[0] < 1 else [[0, 1, 2]], "rail"
    )
    system.accelerations([0, 0], [1, 0])
    with pytest.raises(ValueError, match=r"A\(q\) must be of shape \(1, 2\); got \(1, 3\)"):
        system.accelerations([2, 0], [1, 0])
