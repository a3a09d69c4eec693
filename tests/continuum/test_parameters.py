"""Parameters of rods that are functions of s: what they may be, named ones, files; what is for uniform rods only."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import Rod, SteeredRod, free_rod, rolling_rod, solve, steered_rod, untwisting_rod
from continuum import exact as motions
from continuum.__main__ import main
from continuum.dispersion import frequency, growth, steered_frequencies
from continuum.parameters import polynomial, table
from continuum.scenes import PAPER
from discs import load, simulate
from tests.continuum.test_varying import LENGTH, OWN, VARYING


@pytest.mark.parametrize(
    ("name", "function", "message"),
    [
        ("density", lambda s: 1 - s, r"density must be finite and above 0; got 0 at s = 1$"),
        ("radius", lambda s: 0.5 - s, r"radius must be finite and at least 0; got -0.00390625 at s = 0.503906"),
        ("bending_stiffness", lambda s: 1 / (s - 2), r"bending_stiffness must be finite and at least 0; got -0.5 at s = 0"),
        ("torsion_stiffness", lambda s: np.where(s == 4, np.nan, 1.0), r"torsion_stiffness .* got nan at s = 4"),
        ("spin_inertia", lambda s: np.ones(3), r"spin_inertia must be .*\(m,\) numbers; got shape \(3,\) for s of shape \(1025,\)"),
        ("density", lambda s: [1, 2], r"density must be .* got shape \(2,\)"),
        ("density", lambda s: 1.0 if s < 2 else 2.0, r"density must be a number or a function of places.*raised ValueError"),
        ("density", lambda: 1.0, "density must be a number or a function of places.*raised TypeError"),
        ("density", lambda s: s + 1j, "density must be .*complex numbers"),
        ("density", lambda s: None, "density must be .*got None"),
        ("density", "1 + s", r"density must be a positive finite number; got '1 \+ s'"),
        ("density", np.ones(5), r"density of a rod must be a number or a function of s; got an array of shape \(5,\).*table"),
        ("radius", [1.0, 0.5], r"radius of a rod must be a number or a function of s; got \[1.0, 0.5\].*table"),
        ("length", lambda s: 4.0, "length must be a positive finite number"),
    ],
)
def test_functions_that_are_no_parameters(name, function, message):
    with pytest.raises(ValueError, match=message):
        Rod(**PAPER | {name: function})


def test_further_refusals():
    with pytest.raises(ValueError, match=r"spin_inertia must be positive where radius = 0; got 0 for both at s = 0"):
        Rod(**PAPER | {"spin_inertia": 0.0, "radius": lambda s: s})
    with pytest.raises(ValueError, match=r"heading_inertia must be finite and above 0; got 0 at s = 0"):
        steered_rod(heading_inertia=lambda s: s)
    with pytest.raises(ValueError, match="stretch_stiffness goes with curvature='true'"):
        Rod(**PAPER, stretch_stiffness=lambda s: 1 + s)

    def worse(s):  # right where a rod is checked
        return np.where(np.isclose(s * 256, np.round(s * 256)), 1.0, -1.0)

    with pytest.raises(ValueError, match=r"density must be finite and above 0; got -1 at s = "):
        solve(untwisting_rod(density=worse), 1e-3, progress=False)
    with pytest.raises(ValueError, match="density must be a function of the place: its values change"):
        solve(untwisting_rod(density=lambda s: 1 + np.random.default_rng(s.size).random(s.size)), 1e-3, progress=False)


ROD = Rod(length=LENGTH, **VARYING)


@pytest.mark.parametrize(
    "use",
    [
        lambda: ROD.inertia,
        lambda: frequency(ROD, 1.0),
        lambda: growth(ROD, 1.0, 1.0),
        lambda: steered_frequencies(SteeredRod(length=LENGTH, **VARYING, **OWN), 1.0),
        lambda: motions.ring(ROD, 0.1, 0.4),
        lambda: motions.rolling_line(ROD, 1.0, 1.0, 1.0),
        lambda: motions.standing_wave(ROD, 1.0, 1.0, 1, 1e-3),
        lambda: motions.growing_wave(ROD, 1.0, 1.0, 1.0, 1, 1e-3),
        lambda: free_rod(ROD, lambda s: (s, 0 * s), lambda s: (0 * s, 0 * s), 0.0, 0.0, 1.0, 9, 0.1),
    ],
)
def test_what_is_for_uniform_rods_says_so(use):
    with pytest.raises(ValueError, match="for rods whose parameters are numbers; along this one vary density, spin_inertia"):
        use()


# Named functions, files


def test_named_functions():
    assert polynomial([1, 0.5, 2]) == polynomial((1.0, 0.5, 2.0))
    assert polynomial([1, 0.5])(np.array([0.0, 2.0])).tolist() == [1.0, 2.0]
    given = table([0, 1, 3], [2.0, 0.0, 1.0])
    assert given == table([0.0, 1.0, 3.0], (2, 0, 1))
    assert repr(given) == "table(3 values, 0 to 2, s = 0 to 3)"
    s = np.linspace(-1, 4, 1001)
    assert given(s).min() == 0  # no overshoot
    assert given(np.array([-1.0, 0.0, 1.0, 3.0, 9.0])).tolist() == [2, 2, 0, 1, 1]
    assert Rod(**PAPER | {"density": polynomial([1, 0.5])}) == Rod(**PAPER | {"density": polynomial([1, 0.5])})
    assert Rod(**PAPER | {"density": polynomial([1, 0.5])}) != Rod(**PAPER | {"density": polynomial([1, 0.6])})
    assert "polynomial(coefficients=(1.0, 0.5))" in repr(Rod(**PAPER | {"density": polynomial([1, 0.5])}))
    for bad, message in (([], "coefficients of polynomial"), (["a"], "coefficients of polynomial"), ([[1.0]], "coefficients")):
        with pytest.raises(ValueError, match=message):
            polynomial(bad)
    for s, values, message in (([0], [1], "two or more increasing"), ([1, 0], [1, 1], "increasing"), ([0, 1], [1, 2, 3], "values")):
        with pytest.raises(ValueError, match=message):
            table(s, values)


def test_numpy_polynomials_and_other_objects_are_functions():
    """Polynomial has no hash, a spline is no function in Python's sense."""
    given = untwisting_rod(duration=0.2, density=np.polynomial.Polynomial([1, 0.5]))
    named = untwisting_rod(duration=0.2, density=polynomial([1, 0.5]))
    a, b = (solve(s, 1e-4, frames=1, progress=False) for s in (given, named))
    np.testing.assert_allclose(a.theta, b.theta, atol=1e-12)


def test_runs_of_rods_that_vary_are_saved(tmp_path, capsys):
    given = untwisting_rod(duration=0.2, bending_stiffness=polynomial([0.7, 0.1]))
    field = solve(given, 1e-3, frames=2, progress=False)
    run = simulate(lump(given, 9), "midpoint", dt=0.01, progress=False, engine="plain")
    field.save(tmp_path / "field.nc")
    run.save(tmp_path / "run.nc")
    values = load(tmp_path / "field.nc").stats["scene"]["bending_stiffness"]
    np.testing.assert_allclose(values, np.linspace(0.7, 1.1, 33))
    again = load(tmp_path / "run.nc").problem
    np.testing.assert_array_equal(again.chain.bending_stiffness, lump(given, 9).chain.bending_stiffness)
    assert main(["info", str(tmp_path / "field.nc")]) == 0
    told = capsys.readouterr().out
    assert "bending_stiffness: varies along the rod, 0.7 to 1.1" in told
    assert "shift = [0.0, 0.0]" in told or "shift = (0.0, 0.0)" in told
    tapered = solve(untwisting_rod(duration=0.2, radius=polynomial([1, -0.1])), 1e-3, frames=2, progress=False)
    tapered.view(tmp_path / "view.html")  # it asks for the common radius, and there is none
    assert replace(rolling_rod(), rod=replace(rolling_rod().rod, radius=polynomial([1.0]))).fields(np.zeros(1))["y"] == 1e-6
