"""Rods whose parameters are functions of s: fields against eigenfunctions, exact facts and another method, discs against
multipliers and the field; what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp, solve_ivp

from compare import convergence, lump
from continuum import Rod, Scene, SteeredRod, breathing_ring, free_rod, rolling_rod, solve, steered_rod, untwisting_rod
from continuum import exact as motions
from continuum.__main__ import main
from continuum.dispersion import frequency, growth, steered_frequencies
from continuum.elements import Elements
from continuum.galerkin import SpectralRod
from continuum.initial import resolve
from continuum.parameters import polynomial, table
from continuum.scenes import PAPER
from continuum.spectral import Runner
from discs import load, simulate
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


# Discs


def by_multipliers(problem, kind):
    """The end of a motion of discs from the equations with multipliers, for springs: matrices written down disc by disc.

    Parameters are those of the functions: rho, alpha, R at s_i, beta at s_{i+1/2}, K at s_i of the bends, whatever the chain has.
    """
    chain, rod, n = problem.chain, Rod(length=LENGTH, **(AROUND if "ring" in kind else VARYING)), problem.chain.n
    ring, k = "ring" in kind, chain.k
    s = k * np.arange(n)
    share = np.full(n, k) if ring else k * np.array([0.5, *np.ones(n - 2), 0.5])
    torsion, bending, slope = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    for i in range(n if ring else n - 1):
        row = np.zeros(n)
        row[i], row[(i + 1) % n] = -1, 1
        torsion += rod.torsion_stiffness(k * (i + 0.5)) / k * np.outer(row, row)
    for i in range(n):
        slope[i, (i + 1) % n], slope[i, i - 1] = 0.5 / k, -0.5 / k
        if ring or 0 < i < n - 1:
            row = np.zeros(n)
            row[i - 1], row[i], row[(i + 1) % n] = 1, -2, 1
            bending += rod.bending_stiffness(s[i]) / k**3 * np.outer(row, row)
    if not ring:
        slope[0], slope[-1] = 0, 0
        slope[0, :3], slope[-1, -3:] = np.array([-3, 4, -1]) / (2 * k), np.array([1, -4, 3]) / (2 * k)
    mass = np.concatenate([rod.density(s) * share, rod.density(s) * share, rod.spin_inertia(s) * share])

    def forms(x, y, x_rate, y_rate):
        """A and A. in A v = 0: r. = R theta. J h(r')."""
        z, z_rate = slope @ (x + 1j * y), slope @ (x_rate + 1j * y_rate)
        e, e_rate = 1j * rod.radius(s) * z, 1j * rod.radius(s) * z_rate
        if "unit" in kind:
            turning = (z.conj() * z_rate).imag / np.abs(z) ** 2
            e, e_rate = e / np.abs(z), 1j * turning * e / np.abs(z)
        one, none = np.eye(n), np.zeros((n, n))
        a = np.block([[one, none, -np.diag(e.real)], [none, one, -np.diag(e.imag)]])
        return a, np.hstack([np.zeros((2 * n, 2 * n)), np.vstack([-np.diag(e_rate.real), -np.diag(e_rate.imag)])])

    def rate(_, state):
        q, v = state.reshape(2, 3, n)
        force = -np.concatenate([bending @ q[0], bending @ q[1], torsion @ q[2]])
        a, a_rate = forms(q[0], q[1], v[0], v[1])
        saddle = np.block([[np.diag(mass), -a.T], [a, np.zeros((2 * n, 2 * n))]])
        return np.concatenate([v.ravel(), np.linalg.solve(saddle, [*force, *(-a_rate @ v.ravel())])[: 3 * n]])

    given = problem.initial
    a, _ = forms(given.x, given.y, 0 * s, 0 * s)
    omega = np.broadcast_to(given.omega, n)
    v = np.concatenate([-a[:, 2 * n :] @ omega, omega])
    q = np.concatenate([given.x, given.y, given.theta])
    found = solve_ivp(rate, (0, problem.duration), np.concatenate([q, v]), "DOP853", rtol=1e-11, atol=1e-12)
    return found.y[: 3 * n, -1].reshape(3, n)


@pytest.mark.parametrize("kind", KINDS[:4])
def test_discs_move_as_the_multipliers_say(kind, kernels_as_python):
    problem = lump(scene(kind), 9)
    expected = by_multipliers(problem, kind)
    run = simulate(problem, "gauss6", problem.duration / 100, frames=[problem.duration], progress=False)
    np.testing.assert_allclose([run.x[-1], run.y[-1], run.theta[-1]], expected, rtol=0, atol=1e-8)


def test_parameters_are_taken_at_discs_links_and_bends():
    s, middles = np.arange(5.0), np.arange(4.0) + 0.5
    chain = lump(scene("field rod"), 5).chain
    for name, places in (("density", s), ("spin_inertia", s), ("radius", s), ("torsion_stiffness", middles)):
        np.testing.assert_array_equal(getattr(chain, name), VARYING[name](places))
    for ends, places in (("springs", s[1:-1]), ("paper", s[1:-1]), ("consistent", s)):
        np.testing.assert_array_equal(
            lump(scene("field rod"), 5, ends).chain.bending_stiffness, VARYING["bending_stiffness"](places)
        )
    true = untwisting_rod("unit", curvature="true", stretch_stiffness=lambda s: 2 + s, **VARYING)
    chain = lump(true, 5, "consistent").chain
    np.testing.assert_array_equal(chain.bending_stiffness, VARYING["bending_stiffness"](s[1:-1]))
    np.testing.assert_array_equal(chain.stretch_stiffness, 2 + middles)
    chain = lump(scene("steered"), 5).chain
    for name in ("bending_stiffness", "torsion_stiffness", "stretch_stiffness", "shear_stiffness"):
        np.testing.assert_array_equal(getattr(chain, name), (VARYING | OWN)[name](middles))
    np.testing.assert_array_equal(chain.heading_inertia, OWN["heading_inertia"](s))
    ring = lump(scene("field ring"), 8).chain
    np.testing.assert_array_equal(ring.bending_stiffness, AROUND["bending_stiffness"](0.5 * np.arange(8)))
    np.testing.assert_array_equal(ring.torsion_stiffness, AROUND["torsion_stiffness"](0.5 * np.arange(8) + 0.25))


@pytest.mark.parametrize(("kind", "ends"), [("field rod", "consistent"), ("unit ring", "springs")])
def test_midpoint_keeps_the_energy_to_rounding(kind, ends):
    problem = lump(scene(kind, 2.0 if "rod" in kind else 1.0), 17, ends)
    run = simulate(problem, "midpoint", dt=0.005, frames=11, progress=False, engine="plain")
    assert np.abs(run.energy / run.energy[0] - 1).max() < 1e-12


@pytest.mark.slow  # kernels of chains
@pytest.mark.parametrize(
    ("kind", "ends", "least", "most"),
    [
        ("field rod", "consistent", 1.9, 2.15),
        ("unit rod", "consistent", 1.9, 2.15),
        ("field ring", "springs", 1.95, 2.05),
        ("unit ring", "springs", 1.95, 2.05),
        ("steered", "springs", 1.85, 2.15),
    ],
)
def test_discs_tend_to_the_field(kind, ends, least, most):
    """Order 2 with consistent ends, on rings and with own headings; from 257 to 513 discs 1.98 to 2.00."""
    given = scene(kind, 1.0 if "ring" in kind else 2.0)
    found = convergence(given, (65, 129), ends, solve(given, 1e-6, frames=1, progress=False), progress=False)
    worst = found.error.max(axis=1)
    order = np.log(worst[0] / worst[1]) / np.log(found.k[0] / found.k[1])
    assert least < order < most, (found.error, order)


@pytest.mark.slow  # kernels of chains
@pytest.mark.parametrize("rolling", ["field", "unit"])
def test_loads_on_a_rod_that_varies(rolling):
    """Slope, rest twist and viscosity take rho and beta where they are: fields by two methods agree, and energy is balanced."""
    loads = (
        Slope(0.1, -0.2),
        Rest(twist=lambda s: 0.2 * s),
        Rest(twist=0.3, signal=signals.smooth(0.0, 1.0)),
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


# Bad input, and what is for uniform rods only


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
