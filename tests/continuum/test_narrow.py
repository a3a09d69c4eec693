"""Initial data much narrower than the rod: projected, never missed between nodes; coordinates in which they are wide."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from continuum import Rod, Scene, solve
from continuum.density import Density
from continuum.galerkin import SpectralRod
from continuum.initial import resolve
from continuum.scenes import PAPER

pytestmark = pytest.mark.slow


def scene(rolling="field", closed=False, duration=1.0, **fields):
    """A straight rod with other initial fields by name."""

    def initial(s):
        at_rest = {"x": s, "y": 0 * s, "theta": 0 * s, "omega": 0 * s}
        return tuple((at_rest | {name: f(s) for name, f in fields.items()}).values())

    shift = (4.0, 0.0) if closed else (0.0, 0.0)
    return Scene(rod=Rod(**PAPER), initial=initial, duration=duration, rolling=rolling, closed=closed, shift=shift)


def bump(width, place=2.13):
    return lambda s: np.exp(-(((s - place) / width) ** 2))


@pytest.mark.parametrize(("tol", "functions"), [(1e-3, 71), (1e-4, 135)])
def test_a_bump_between_the_nodes_is_not_missed(tol, functions):
    """The energy, and theta at t = 1 from a discretisation of another density, 243 functions, off by 6e-6."""
    field = solve(scene(theta=bump(0.03)), tol, frames=2, progress=False)
    theta = CubicSpline(field.s, field.theta[-1])
    limit = field.error_estimate["theta"]
    assert limit < tol
    assert abs(theta(2.13) - 1.000585) < limit
    assert abs(theta(0.0) + 0.009521) < limit
    np.testing.assert_allclose(field.energy, 0.4 * np.sqrt(np.pi / 2) / 0.03, rtol=1e-6)
    assert field.stats["functions"] <= functions


@pytest.mark.parametrize(
    ("rolling", "name", "data"),
    [
        ("field", "theta", bump(0.01)),
        ("unit", "theta", lambda s: np.tanh((s - 2.13) / 0.02)),
        ("field", "theta", lambda s: bump(0.04, 1.1)(s) - 0.5 * bump(0.06, 3.3)(s)),
        ("unit", "omega", bump(0.05)),
        ("field", "y", lambda s: 0.01 * bump(0.2)(s)),
    ],
    ids=["bump", "tanh", "two", "omega", "line"],
)
def test_narrow_data_are_solved(rolling, name, data):
    """Against a tolerance four times smaller, whose estimate says how far it is from the truth."""
    a, b = (solve(scene(rolling, duration=0.2, **{name: data}), tol, frames=2, progress=False) for tol in (2e-3, 5e-4))
    for field in ("x", "y", "theta"):
        error = np.abs(getattr(a, field)[-1] - getattr(b, field)[-1][:: (b.s.size - 1) // (a.s.size - 1)]).max()
        assert error <= a.error_estimate[field] + b.error_estimate[field]
        assert a.error_estimate[field] <= 2e-3


def test_closed_rods_too(rolling):
    field = solve(scene(rolling, closed=True, theta=bump(0.04), duration=0.3), 1e-3, frames=2, progress=False)
    np.testing.assert_allclose(field.energy, 0.4 * np.sqrt(np.pi / 2) / 0.04, rtol=1e-6)


def test_all_of_the_momentum_is_there():
    """A bump of omega narrower than the distance of nodes: its integral and, in functions that are wide, its effect."""
    width = 0.01
    for place in (1.0, 2.13, 3.9):
        rod = SpectralRod(scene(omega=bump(width, place)), 19)
        momentum = rod.start.pi @ (rod.functions.w * 2 * rod.basis(rod.start.hi).t)
        assert momentum == pytest.approx(2 * width * np.sqrt(np.pi), rel=1e-6)


def test_a_density_follows_the_data():
    """One centre for each narrow feature; none where all is narrow, nothing is, or the rod is closed."""
    bumps = Density.of(resolve(scene(theta=lambda s: bump(0.02, 1.0)(s) + bump(0.03, 3.0)(s))))
    places = [place for place, _, _ in bumps.centres]
    np.testing.assert_allclose(places, [1.0, 3.0], atol=0.02)
    s = np.linspace(0, 4, 401)
    height = bumps.centres[0][2]
    assert height > 7
    assert bumps.rate(s)[100] > 0.7 * (1 + height) * bumps.rate(s)[200]  # the ends crowd less, and the middle more, for the sine
    np.testing.assert_allclose(np.gradient(bumps.coordinate(s), s)[5:-5], bumps.rate(s)[5:-5], rtol=0.2)
    np.testing.assert_allclose(bumps.coordinate(bumps.place(np.linspace(-1, 1, 99))), np.linspace(-1, 1, 99), atol=1e-13)
    for plain in (
        scene(theta=lambda s: 0.1 * np.sin(s)),
        scene(theta=lambda s: np.cos(30 * np.pi * s / 4)),
        scene(closed=True, theta=bump(0.02)),
    ):
        assert Density.of(resolve(plain)).centres == ()


def test_the_derivatives_of_a_density_are_those_of_its_coordinate():
    density, s, h = Density(2.3, ((0.7, 0.2, 3.0), (1.6, 0.4, 1.2))), np.linspace(0.1, 2.2, 22), 1e-4
    for integral, derivative in ((density.coordinate, density.rate), (density.rate, density.change)):
        np.testing.assert_allclose((integral(s + h) - integral(s - h)) / (2 * h), derivative(s), atol=1e-4)
