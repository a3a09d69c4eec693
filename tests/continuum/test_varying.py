"""Rods whose parameters are functions of s: fields against eigenfunctions, exact facts and another method, discs against
multipliers and the field; what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from compare import lump
from continuum import Rod, Scene, breathing_ring, solve, steered_rod, untwisting_rod
from continuum.dispersion import frequency
from continuum.elements import Elements
from continuum.galerkin import SpectralRod
from continuum.initial import resolve
from continuum.parameters import polynomial
from continuum.scenes import PAPER
from continuum.spectral import Runner
from discs.loads import Damping, Rest, Slope, Torque, signals

LENGTH, Q = 4.0, np.pi / 2
VARYING = {  # each by a factor of 1.5 to 4.6
    "density": lambda s: 1 + 0.5 * np.sin(s),
    "spin_inertia": lambda s: 1 - 0.15 * s,
    "torsion_stiffness": lambda s: 0.8 + 0.16 * s,
    "bending_stiffness": lambda s: 0.7 + 0.45 * np.cos(s),
    "radius": lambda s: 1 - 0.1 * s,
}
AROUND = {  # periodic
    "density": lambda s: 1 + 0.5 * np.sin(Q * s),
    "spin_inertia": lambda s: 1 - 0.5 * np.cos(Q * s),
    "torsion_stiffness": lambda s: 0.8 + 0.4 * np.cos(Q * s),
    "bending_stiffness": lambda s: 0.7 + 0.35 * np.sin(2 * Q * s),
    "radius": lambda s: 1 + 0.4 * np.cos(Q * s),
}
OWN = {
    "stretch_stiffness": lambda s: 10 - s,
    "shear_stiffness": lambda s: 6 + s,
    "heading_inertia": lambda s: 0.2 + 0.05 * s,
}


def untwisting(s):
    """theta' is proportional to sin^5(pi s/4), which is compatible with the free ends."""
    c = np.cos(np.pi * s / 4)
    return s, 0 * s, -1.5 * (c - 2 * c**3 / 3 + c**5 / 5), 0 * s


def scene(kind, duration=1.0):
    """An untwisting rod or a ring under a law, or a rod with headings of its own, all parameters varying."""
    if kind == "steered":
        return steered_rod(duration=duration, **VARYING, **OWN)
    law, shape = kind.split()
    if shape == "ring":
        return breathing_ring(law, duration=0.5 * duration, omega=0.2, **AROUND)
    return replace(untwisting_rod(law, duration=duration, **VARYING), initial=untwisting)


KINDS = ["field rod", "unit rod", "field ring", "unit ring", "steered"]


# A number given as a function


@pytest.mark.parametrize("uniform", [untwisting_rod("unit"), breathing_ring(omega=0.2), steered_rod()], ids=lambda s: s.name)
def test_a_number_given_as_a_function_changes_nothing_but_rounding(uniform):
    uniform = replace(uniform, duration=0.5)
    names = [*PAPER, *(OWN if uniform.steered else {})]
    for name in names[1:]:
        number = getattr(uniform.rod, name)
        same = replace(uniform, rod=replace(uniform.rod, **{name: lambda s, number=number: number + 0 * s}))
        assert resolve(same).energy == pytest.approx(resolve(uniform).energy, rel=1e-12)
        for ends in ("springs",) if uniform.steered else ("springs", "consistent"):
            assert np.array_equal(*(getattr(lump(given, 9, ends).chain, name) for given in (same, uniform)))
    every = replace(uniform.rod, **{name: polynomial([getattr(uniform.rod, name)]) for name in names[1:]})
    a, b = (solve(s, 1e-6, frames=3, progress=False) for s in (replace(uniform, rod=every), uniform))
    for name in ("x", "y", "theta", "omega", "energy"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=0, atol=1e-8)


# The field


def small_wave(rod: Rod, guess: float):
    """Frequency and shape (s -> theta) of a small wave of the straight rod at rest with free ends, y = R theta.

    M Omega^2 theta + (beta theta')' = R m'' with the moment m = K (R theta)''; m = 0 and beta theta' = R m' at the ends.
    """

    def rates(s, y, p):
        theta, turn, moment, shear = y
        r, r1, r2, beta, beta1 = rod.radius(s), 0.2 * np.cos(s / 2), -0.1 * np.sin(s / 2), rod.torsion_stiffness(s), 0.16
        bent = (moment / rod.bending_stiffness(s) - r2 * theta - 2 * r1 * turn) / r
        push = p[0] ** 2 * rod.at(s).inertia * theta + beta1 * turn + beta * bent
        return np.array([turn, bent, shear, push / r])

    def ends(a, b, p):
        place = np.array([0.0, rod.length])
        beta, r = rod.torsion_stiffness(place), rod.radius(place)
        return np.array([a[2], b[2], beta[0] * a[1] - r[0] * a[3], beta[1] * b[1] - r[1] * b[3], a[0] - 1])

    s = np.linspace(0, rod.length, 201)
    start = np.cos(np.pi * s / rod.length), -np.pi / rod.length * np.sin(np.pi * s / rod.length), 0 * s, 0 * s
    found = solve_bvp(rates, ends, s, np.array(start), [guess], tol=1e-8, max_nodes=20_000)
    assert found.success
    return found.p[0], lambda s: found.sol(s)[0]


@pytest.mark.parametrize("rolling", ["field", "unit"])
def test_small_waves_are_eigenfunctions_of_the_linear_equations(rolling):
    """Frequency and shape from a boundary-value solver, in a quarter of a period and in half of one; the uniform rod is far off."""
    rod = Rod(length=LENGTH, **VARYING | {"radius": lambda s: 0.7 + 0.4 * np.sin(s / 2)})
    rate, shape = small_wave(rod, 0.9)
    assert abs(rate / frequency(Rod(**PAPER), np.pi / LENGTH) - 1) > 0.1
    size = 1e-3

    def initial(s):
        return s, size * rod.radius(s) * shape(s), size * shape(s), 0 * s

    run = solve(Scene(rod=rod, initial=initial, duration=np.pi / rate, rolling=rolling), 1e-8, frames=5, progress=False)
    for name, factor, turning in (
        ("theta", 1.0, np.cos(rate * run.t)),
        ("y", rod.radius(run.s), np.cos(rate * run.t)),
        ("omega", rate, -np.sin(rate * run.t)),
    ):
        expected = size * np.outer(turning, factor * shape(run.s))
        assert np.abs(getattr(run, name) - expected).max() < 2e-3 * size, name


@pytest.mark.parametrize("kind", ["field rod", "unit rod"])
def test_free_ends_do_not_stretch_and_energy_is_kept(kind):
    """Exact for any rho, alpha, beta, K, R: |r'| = 1 at a free end, as its curvature is zero; a large motion."""
    run = solve(scene(kind, 2.0), 1e-7, frames=5, progress=False)
    r, k = run.x + 1j * run.y, run.s[1]
    for ends in (r[:, :5], r[:, :-6:-1]):
        slope = ends @ np.array([-25, 48, -36, 16, -3]) / (12 * k)
        assert np.abs(np.abs(slope) - 1).max() < 1e-5
    assert np.abs(np.abs(np.gradient(r[-1], run.s)) - 1).max() > 0.05
    assert np.abs(run.energy / run.energy[0] - 1).max() < 1e-8
    assert run.energy[0] == pytest.approx(resolve(scene(kind)).energy, rel=1e-10)


def test_energy_of_the_initial_fields_has_the_parameters_in_its_integral():
    rod = Rod(length=LENGTH, **VARYING)

    def bent(s):
        return s, 0.1 * s**2, 0.3 * s**2, 1 + s

    s = np.linspace(0, LENGTH, 400_001)
    p, e = rod.at(s), 1 + 0.04 * s**2
    twice = (p.spin_inertia + p.density * p.radius**2 * e) * (1 + s) ** 2 + p.torsion_stiffness * 0.36 * s**2
    energy = np.trapezoid(0.5 * (twice + p.bending_stiffness * 0.04), s)
    given = Scene(rod=rod, initial=bent, duration=1.0)
    assert resolve(given).energy == pytest.approx(energy, rel=1e-9)
    system = SpectralRod(given, 37)
    assert system.energy(system.start) == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize("kind", ["unit rod", "field ring"])
def test_both_engines_agree(kind):
    a, b = (Runner(scene(kind), np.array([0.2]), 6, compiled).run(27, 1e-6) for compiled in (True, False))
    for name, values in a.fields.items():
        np.testing.assert_allclose(values, b.fields[name], atol=1e-9)
    assert max(np.abs(a.rod.slip(z)).max() for z in a.states) < 1e-4  # with R at the nodes


@pytest.mark.slow  # kernels of chains
@pytest.mark.parametrize("rolling", ["field", "unit"])
def test_loads_on_a_rod_that_varies(rolling):
    """Slope, rest shapes and viscosity take rho, beta and K where they are: fields by two methods agree, and energy is balanced."""
    loads = (
        Slope(0.1, -0.2),
        Rest(twist=lambda s: 0.2 * s),
        Rest(twist=0.3, curvature=lambda s: 0.2 + 0.1 * s, signal=signals.smooth(0.0, 1.0)),
        Damping(rolling=0.1, torsion=0.05),
        Torque(0.2, signals.smooth(0.0, 1.0), at=0.0),
    )
    given = replace(scene(f"{rolling} rod"), loads=loads)
    a, b = (solve(given, 1e-4, method, frames=4, progress=False) for method in ("spectral", "richardson"))
    for name in ("x", "y", "theta", "energy", "work", "dissipated"):
        every = [getattr(run, name)[..., :: (run.s.size - 1) // 32 if getattr(run, name).ndim > 1 else 1] for run in (a, b)]
        assert np.abs(every[0] - every[1]).max() < 3e-5, name
    off = np.abs(a.energy - a.energy[0] - a.work + a.dissipated)
    assert off[-1] < 1e-6  # an end of a step
    assert off.max() < 1e-5


def uneven(seed):
    """A random scene: each parameter the exponential of four random waves, up to 2.7 times its mean or a part of it."""
    rng = np.random.default_rng(seed)
    closed, law = bool(rng.integers(2)), str(rng.choice(["field", "unit"]))

    def around(mean):
        size, phase, depth = rng.normal(size=4) / np.arange(1, 5), rng.uniform(0, 2 * np.pi, 4), rng.uniform(0.3, 1.0)
        q = (2 if closed else 1) * np.pi / LENGTH * np.arange(1, 5)
        return lambda s: mean * np.exp(depth * np.cos(np.multiply.outer(s, q) + phase) @ size / np.abs(size).sum())

    parameters = {name: around(PAPER[name]) for name in VARYING}
    if closed:
        return breathing_ring(law, duration=0.4, omega=float(rng.uniform(-0.4, 0.3)), **parameters)
    return untwisting_rod(law, duration=1.5, twist=float(rng.uniform(0.1, 0.6)), **parameters)


@pytest.mark.slow  # kernels of chains
@pytest.mark.parametrize("seed", range(6))
def test_tolerances_are_kept_on_random_rods(seed):
    """By differences in s, another discretisation. Of 60 rods none was off by more than tol, with estimates of 0.3 to 4 errors."""
    given = uneven(seed)
    tol = 10.0 ** np.random.default_rng(seed).uniform(-4, -2)
    a, b = solve(given, tol, frames=3, progress=False), solve(given, tol / 20, "richardson", frames=3, progress=False)
    for name in ("x", "y", "theta"):
        here, there = (getattr(run, name)[:, :: run.s.size // 32] for run in (a, b))
        error = np.abs(here - there).max()
        assert error < tol, name
        assert error < 3 * a.error_estimate[name] + b.error_estimate[name], name


# What is narrow, has corners or jumps


def bump(width, place=2.13):
    return lambda s: np.exp(-(((s - place) / width) ** 2))


@pytest.mark.slow  # kernels of chains
def test_a_narrow_part_of_the_rod_is_seen():
    """Sixteen times the mass on a piece of length/100, between the places of 33 discs and of 27 functions."""
    given = untwisting_rod(duration=1.0, density=lambda s: 1 + 15 * bump(0.02)(s))
    [(place, width)] = resolve(given).features
    assert place == pytest.approx(2.13, abs=0.01)
    assert width < 0.03
    with pytest.warns(UserWarning, match=r"33 discs are too few for the density of the rod.*at s = 2.1"):
        lump(given, 33)
    a, b = (solve(given, 1e-4, method, frames=2, progress=False) for method in ("spectral", "richardson"))
    off = np.abs(a.theta[:, ::32] - b.theta[:, :: (b.s.size - 1) // 32]).max()
    assert off < 1e-4, off
    even = solve(untwisting_rod(duration=1.0), 1e-4, frames=2, progress=False)
    assert np.abs(a.theta[:, ::32] - even.theta[:, ::32]).max() > 2e-3  # it matters


@pytest.fixture
def few(monkeypatch):
    """The largest number of functions is 51."""
    monkeypatch.setattr("continuum.spectral.SIZES", (19, 27, 37, 51))
    monkeypatch.setattr("continuum.spectral.MORE", ())


def test_functions_that_miss_a_parameter_say_so(few):
    """The error of a motion is at least the part of a parameter that its functions miss, times how far it moves."""
    given = breathing_ring(duration=0.2, density=lambda s: 1 + 3 * bump(0.01)(s))
    found = Runner(given, np.array([0.0, 0.2]), 4).run(19, 1e-4)
    assert found.start["theta"] > 1e-3 * np.ptp(found.fields["theta"])
    with pytest.raises(ValueError, match="not reached on 51 functions"):
        solve(given, 1e-6, progress=False)


def test_corners_are_slow_and_jumps_refused(few):
    corner = untwisting_rod(duration=1.0, radius=lambda s: 1 + 0.3 * np.abs(s - 1.3))
    assert resolve(corner).kinks == pytest.approx([1.3], abs=1e-6)
    with pytest.raises(ValueError, match=r"not reached.*corner at s = 1.3, which functions resolve slowly"):
        solve(corner, 1e-5, progress=False)
    glued = untwisting_rod(duration=1.0, bending_stiffness=lambda s: 0.7 + (s > 2.3))
    with pytest.raises(ValueError, match=r"bending_stiffness jumps by 1 at s = 2.3: a parameter of a rod is continuous"):
        solve(glued, 1e-3, progress=False)
    with pytest.warns(UserWarning, match="more discs converge slowly: bending_stiffness jumps"):
        lump(glued, 9)
    with pytest.raises(ValueError, match=r"density must be periodic on a closed scene: at s = length it is 1\.4"):
        solve(breathing_ring(density=lambda s: 1 + 0.1 * s), 1e-3, progress=False)
    soft = untwisting_rod(bending_stiffness=lambda s: np.maximum(s - 2, 0) ** 3)
    with pytest.raises(ValueError, match=r"bending_stiffness must not fall below 0.0001 of its largest value.*richardson"):
        solve(soft, 1e-3, progress=False)


def test_elements_resolve_narrow_parameters():
    """The first number of elements resolves the parameters, not the initial fields alone."""
    given = steered_rod(duration=0.2, density=lambda s: 1 + 3 * bump(0.04)(s))
    assert Elements(given, 6).misfit["density"] > 0.1
    assert Elements(given, 32).misfit["density"] < 0.1
    assert solve(given, 1e-3, frames=1, progress=False).stats["elements"] > 6
    assert solve(steered_rod(duration=0.2), 1e-3, frames=1, progress=False).stats["elements"] < 6
