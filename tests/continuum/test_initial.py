"""Initial fields: pieces on which they are smooth, energy by quadrature, features; what is refused."""

import re
import time
import warnings

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from compare import lump
from continuum import Rod, Scene, SteeredRod, breathing_ring, rolling_rod, steered_rod, untwisting_rod
from continuum.initial import resolve
from continuum.scenes import PAPER

ROD = Rod(**PAPER)
ROOT = np.sqrt(np.pi / 2)


def zero(s):
    return 0 * s


def bump(width, place=2.13):
    return lambda s: np.exp(-(((s - place) / width) ** 2))


def scene(theta=zero, omega=zero, y=zero, x=lambda s: s, rod=ROD, **options):
    return Scene(rod=rod, duration=1.0, initial=lambda s: (x(s), y(s), theta(s), omega(s)), **options)


@pytest.mark.parametrize("width", [0.1, 0.03, 0.004, 1e-3, 2e-4])
@pytest.mark.parametrize("place", [2.13, 0.771828])
def test_bump_is_found_wherever_it_is(width, place):
    """Energy beta/2 int theta'^2 = beta sqrt(pi/2)/(2 width): 16.71 where widely spaced nodes say 0."""
    found = resolve(scene(bump(width, place)))
    assert found.energy == pytest.approx(0.4 * ROOT / width, rel=1e-9)
    s, w = found.quadrature(8)
    assert w @ bump(width, place)(s) == pytest.approx(width * np.sqrt(np.pi), rel=1e-10)
    if width < 0.1:
        [(where, wide)] = found.features
        assert where == pytest.approx(place, abs=width / 10)
        assert wide == pytest.approx(width, rel=0.2)


def test_narrowest_bumps_at_random_places():
    """What the docstring promises: a Gaussian of width length/40000."""
    width = ROD.length / 40000
    for place in np.random.default_rng(5).uniform(0.01, 3.99, 20):
        assert resolve(scene(omega=bump(width, place))).energy == pytest.approx(width * ROOT, rel=1e-8)


@pytest.mark.parametrize(
    "smooth",
    [
        untwisting_rod(),
        untwisting_rod("unit", twist=3.0, density=1.3, radius=0.7),
        untwisting_rod("unit", curvature="true", stretch_stiffness=2.0),
        breathing_ring(),
        breathing_ring("unit", radius=0.7),
        rolling_rod(amplitude=1e-2),
        rolling_rod(amplitude=1e-10, omega=0.0),
        steered_rod(),
    ],
    ids=lambda s: f"{s.name}-{s.rolling}",
)
def test_ordinary_scenes_cost_little_and_have_the_discs_energy(smooth):
    """Few pieces, a few milliseconds; discs that are refined twice have the same energy, error k^4 left."""
    started = time.process_time()
    found = resolve(smooth)
    assert time.process_time() - started < 0.05  # 3 ms, and what a busy machine adds
    assert len(found.pieces) <= 9
    assert resolve(smooth) is found
    a, b = (lump(smooth, n if smooth.closed else n + 1).energy() for n in (128, 256))
    assert b + (b - a) / 3 == pytest.approx(found.energy, rel=1e-5)


def test_energy_of_every_law_by_hand():
    """Line and roll with z = r' = 1 + i a s, theta' = b, omega = c: integrals of polynomials, unequal parameters."""
    unequal = {
        "length": 2.0,
        "density": 1.3,
        "spin_inertia": 0.6,
        "torsion_stiffness": 0.9,
        "bending_stiffness": 0.8,
        "radius": 0.7,
    }
    a, b, c, d = 0.3, 0.4, 0.5, 0.6
    fields = {"x": lambda s: s, "y": lambda s: a * s**2 / 2, "theta": lambda s: b * s, "omega": lambda s: c + zero(s)}
    mean = 2 + a**2 * 8 / 3  # int |z|^2
    twist = 0.45 * b**2 * 2
    field = resolve(scene(rod=Rod(**unequal), **fields)).energy
    assert field == pytest.approx(0.5 * c**2 * (0.6 * 2 + 1.3 * 0.49 * mean) + twist + 0.4 * a**2 * 2, rel=1e-12)
    unit = resolve(scene(rod=Rod(**unequal), rolling="unit", **fields)).energy
    assert unit == pytest.approx(0.5 * c**2 * (0.6 + 1.3 * 0.49) * 2 + twist + 0.4 * a**2 * 2, rel=1e-12)
    s = np.linspace(0, 2, 200001)
    z = np.hypot(1, a * s)
    turning, stretch = (np.trapezoid(f, s) for f in (a**2 / z**4, (z - 1) ** 2))
    true = resolve(scene(rod=Rod(**unequal, curvature="true", stretch_stiffness=2.0), rolling="unit", **fields)).energy
    assert true == pytest.approx(0.5 * c**2 * (0.6 + 1.3 * 0.49) * 2 + twist + 0.4 * turning + stretch, rel=1e-8)
    rod = SteeredRod(**unequal, stretch_stiffness=2.0, shear_stiffness=3.0, heading_inertia=0.25)
    own = Scene(
        rod=rod,
        duration=1.0,
        rolling="unit",
        initial=lambda s: (s, 0 * s, b * s, c + 0 * s, d + a * s, 0.2 * s),
    )
    strain = np.trapezoid(1.0 * (np.cos(d + a * s) - 1) ** 2 + 1.5 * np.sin(d + a * s) ** 2, s)
    spin = 0.5 * (c**2 * (0.6 + 1.3 * 0.49) * 2 + 0.25 * 0.04 * 8 / 3)
    assert resolve(own).energy == pytest.approx(spin + twist + 0.4 * a**2 * 2 + strain, rel=1e-8)


def test_corner_of_the_roll_is_an_edge_of_pieces():
    for place in (2.13, 2.0):
        found = resolve(scene(lambda s, p=place: 0.5 * np.abs(s - p)))
        assert found.kinks == pytest.approx([place], abs=1e-9)
        assert len(found.pieces) == 3
        assert found.energy == pytest.approx(0.4 * 0.25 * 4, rel=1e-9)
    knots = np.linspace(0, 4, 21)
    table = resolve(scene(lambda s: np.interp(s, knots, np.sin(3 * knots))))
    assert table.energy == pytest.approx(0.4 * (np.diff(np.sin(3 * knots)) ** 2).sum() / 0.2, rel=1e-8)
    assert table.kinks == pytest.approx(knots[1:-1], abs=1e-8)


def test_rounding_of_the_scene_is_no_noise():
    """Values with digits that the formula lost, and a spline through 1025 places, whose third derivative jumps."""
    lost = resolve(scene(y=lambda s: (1 + 1e-6 * np.cos(s)) - 1, omega=lambda s: np.cos(7 * s) ** 2 + np.sin(7 * s) ** 2 - 1))
    assert len(lost.pieces) <= 3
    assert len(resolve(scene(lambda s: np.cos(s) + 1e-10 * np.modf(np.sin(s * 1e7) * 1e5)[0])).pieces) <= 9
    knots = np.linspace(0, 4, 1025)
    spline = resolve(scene(CubicSpline(knots, -np.pi / 2 * np.cos(np.pi / 4 * knots))))
    assert spline.energy == pytest.approx(np.pi**4 / 80, rel=1e-9)
    assert not spline.features


def closed(x=lambda s: s, y=zero, theta=zero, shift=(4.0, 0.0), rod=ROD):
    return scene(theta, y=y, x=x, rod=rod, closed=True, shift=shift)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (scene(lambda s: 1.0 * (s > 2.13)), r"initial theta jumps by 1 at s = 2.13: .*spread it over a width of 0.04 or more"),
        (scene(lambda s: 1.0 * (s > 2)), "initial theta jumps by 1 at s = 2:"),
        (scene(omega=lambda s: -3.0 * (s > 0.7)), "initial omega jumps by -3 at s = 0.7:"),
        (scene(lambda s: 1.0 * (s == 4)), "initial theta jumps by 1 at s = 4:"),
        (scene(lambda s: 1.0 * (s == 0)), "initial theta jumps by -1 at s = 0:"),
        (scene(y=lambda s: 0.1 * np.abs(s - 2.13)), r"initial y has a corner at s = 2.13: r' jumps by \(0, 0.2\), .*round it"),
        (scene(y=lambda s: 0.1 * np.abs(s - 1)), r"initial y has a corner at s = 1: r' jumps by \(0, 0.2\)"),
        (scene(lambda s: np.sqrt(np.abs(s - 2.13))), "initial theta has no finite slope at s = 2.13"),
        (scene(lambda s: np.sqrt(s)), "does not settle near s = 0"),
        (scene(y=lambda s: 0.1 * s**1.5), "does not settle near s = 0"),
        (scene(lambda s: np.tanh((s - 2.13) / 1e-8)), "does not settle near s = 2.13.*take data that vary over length/500 = 0.008"),
        (scene(lambda s: np.modf(np.sin(s * 1e7) * 1e5)[0]), r"initial theta is not resolved by 4096 pieces.*smooth it over"),
        (scene(lambda s: np.cumsum(s) / s.size), "initial theta must be a function of the place"),
        (scene(lambda s: np.random.default_rng().standard_normal(s.size)), "initial theta must be a function of the place"),
        (scene(x=lambda s: (s - 2) ** 2, rolling="unit"), "rolling='unit' needs a heading: r' = 0 between s = 0 and 4"),
        (
            closed(shift=(0.0, 0.0)),
            r"initial x must be periodic on a closed scene: at s = length it is 4, and .* is 0; take .* shift",
        ),
        (closed(theta=lambda s: 0.1 * s), "initial theta must be periodic on a closed scene: at s = length it is 0.4"),
        (closed(y=lambda s: s * (4 - s) / 10), r"initial y has a corner at s = 4 \(the seam\): r' jumps by \(0, 0.8\)"),
    ],
)
def test_what_is_refused(given, message):
    with pytest.raises(ValueError, match=message):
        resolve(given)


def test_turns_of_own_headings_must_fit():
    rod = steered_rod().rod
    a = rod.length / (2 * np.pi)

    def circle(s):
        return a * np.cos(s / a), a * np.sin(s / a), 0 * s, 0 * s + 0.3, s / a + np.pi / 2, 0 * s

    ring = {"rod": rod, "initial": circle, "duration": 1.0, "rolling": "unit", "closed": True}
    assert resolve(Scene(**ring, turns=1)).features == ()
    with pytest.raises(ValueError, match=r"initial phi must be periodic on a closed scene.*\(or other turns\)"):
        resolve(Scene(**ring))


def test_own_headings_may_have_corners():
    rod = steered_rod().rod
    found = resolve(
        Scene(
            rod=rod,
            duration=1.0,
            rolling="unit",
            initial=lambda s: (s, 0.1 * np.abs(s - 1), 0 * s, 0 * s, 0.1 * np.abs(s - 3), 0 * s),
        )
    )
    assert found.kinks == pytest.approx([1, 3], abs=1e-9)


def heard(given, n, ends="springs"):
    """What `lump` warns of."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        lump(given, n, ends)
    return " ".join(str(warning.message) for warning in told)


@pytest.mark.parametrize(
    ("given", "few", "enough"),
    [
        (scene(bump(0.03)), 65, 193),
        (scene(bump(0.03), lambda s: 1 + 0 * s), 65, 193),  # the roll of all of it hides the bump's energy in the whole
        (scene(omega=bump(0.03)), 33, 193),
        (scene(omega=lambda s: 1 + 0.1 * bump(0.03)(s)), 33, 193),
        (rolling_rod(mode=12, amplitude=1e-2), 24, 97),
    ],
)
def test_discs_that_are_too_few_to_see_the_data(given, few, enough):
    """Whether a disc stands on the bump or not: what is missing of the springs' energy is the energy of what is missed."""
    assert re.search(rf"{few} discs are too few for the initial fields, .* take n = \d+ or more", heard(given, few))
    assert not heard(given, enough)


def test_discs_of_smooth_scenes_are_enough():
    for smooth in (untwisting_rod(), untwisting_rod("unit", curvature="true"), steered_rod(), breathing_ring(), rolling_rod()):
        for n in (7, 9, 33):
            assert not heard(smooth, n)
    assert not heard(untwisting_rod(), 9, "paper")
    assert not heard(untwisting_rod(), 9, "consistent")
    found = resolve(untwisting_rod())
    lost = 1 - lump(untwisting_rod(), 9).energy() / found.energy
    assert lost == pytest.approx(1 - np.sinc(1 / 16) ** 2, rel=1e-9)  # of sin^2(pi k/2 l)/(pi k/2 l)^2, said as 1.3 %


def test_discs_of_a_jump_have_no_limit():
    assert "the discs have no limit as a field: initial theta jumps by 1 at s = 2.13" in heard(
        scene(lambda s: 1.0 * (s > 2.13)), 33
    )
