"""Laws of rolling and of links: each against its own derivatives, its compiled form, and what every law has in common."""

from dataclasses import replace

import numpy as np
import pytest

from continuum import breathing_ring, exact
from continuum.balance import balances
from continuum.dispersion import growth, symbols
from continuum.mesh import semidiscretise
from continuum.scenes import rolling_rod, untwisting_rod
from discs import Midpoint, Suzuki4, simulate
from discs.chains import stencils
from discs.chains.chain import Chain
from discs.chains.links import CURVATURE
from discs.chains.rolling import ROLLING, RollingLaw, stretching
from discs.kernels import protocol as do
from discs.kernels.slaved_matrix import GHOST, PLAIN, RING
from tests.conftest import Model, uneven

RNG = np.random.default_rng(5)
FINE = Suzuki4(Midpoint(tolerance=1e-13))


class Blend(RollingLaw):
    """h = z (1 + 1/|z|)/2, halfway between the field law and the unit law; no compiled form."""

    name, formula, vanishing, parameters = "blend", "the mean of both", True, None

    def size(self, length):
        return 0.5 * (length + np.ones_like(length))

    def arm(self, radius, z):
        return 0.5 * radius * (1 + 1 / np.hypot(*z))

    def rate(self, z, dz):
        return 0.5 * (dz + ROLLING["unit"].rate(z, dz))

    def jet(self, z, z1, z2):
        return tuple(0.5 * (a + b) for a, b in zip((z, z1, z2), ROLLING["unit"].jet(z, z1, z2), strict=True))


@pytest.fixture
def blend(monkeypatch):
    """A third law of rolling, of a user's own."""
    monkeypatch.setitem(ROLLING, "blend", Blend())
    return "blend"


LAWS = [*ROLLING.values(), Blend()]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_a_rolling_law_agrees_with_its_derivatives(law):
    """arm, size, rate and jet tell of one function h, |h| = 1 where |z| = 1."""
    z, dz = RNG.normal(size=(2, 2, 7))

    def h(z):
        return law.arm(1.0, z) * z

    assert np.allclose(np.hypot(*h(z)), law.size(np.hypot(*z)), rtol=1e-14)
    angle = np.linspace(0, 6, 7)
    assert np.allclose(law.size(np.ones(3)), 1, rtol=1e-15)
    assert np.allclose(h(np.array([np.cos(angle), np.sin(angle)])), [np.cos(angle), np.sin(angle)], rtol=1e-14)
    eps = 1e-5
    assert np.allclose(law.rate(z, dz), (h(z + eps * dz) - h(z - eps * dz)) / (2 * eps), atol=1e-8)
    u, u1, u2 = RNG.normal(size=(3, 7)) + 1j * RNG.normal(size=(3, 7))

    def along(t):  # a curve with these derivatives at t = 0
        w = u + t * u1 + t * t / 2 * u2
        return law.arm(1.0, (w.real, w.imag)) * w

    found = law.jet(u, u1, u2)
    step = 1e-3  # central differences of order 4: truncation 1e-12 h'''''', rounding 1e-16/step^2
    first = (8 * (along(step) - along(-step)) - along(2 * step) + along(-2 * step)) / (12 * step)
    second = (16 * (along(step) + along(-step)) - along(2 * step) - along(-2 * step) - 30 * along(0.0)) / (12 * step**2)
    scale = 1 + np.abs(u1 / u) ** 6
    assert np.allclose(found[0], along(0.0), rtol=1e-14)
    assert (np.abs(found[1] - first) < 1e-8 * scale).all()
    assert (np.abs(found[2] - second) < 1e-8 * scale).all()


@pytest.mark.parametrize("law", [law for law in ROLLING.values() if law.parameters is not None], ids=lambda law: law.name)
def test_a_compiled_rolling_law_is_its_plain_twin(law):
    x, y, half, radius = 0.3, -1.7, 0.4, 0.7
    a, b, factor, square = do.contact(law.parameters, radius, half, x, y)
    arm = law.arm(radius, np.array([half * x, half * y]))
    assert np.allclose(np.array([a, b]) * factor, arm * half * np.array([x, y]), rtol=1e-14)
    assert np.isclose(square, (arm * half) ** 2 * (x * x + y * y), rtol=1e-14)
    z = RNG.normal(size=3) + 1j * RNG.normal(size=3)
    assert np.allclose(do.jet(law.parameters, *z), law.jet(*z), rtol=1e-13)
    assert do.vanishing(law.parameters) is law.vanishing


@pytest.mark.parametrize("ends", ["springs", "consistent", "ring"])
@pytest.mark.parametrize("name", CURVATURE)
def test_a_link_law_is_energy_exact_and_its_compiled_form_is_the_plain_one(name, ends):
    n, links = 7, 7 - (ends != "ring")
    parameters = dict.fromkeys(("density", "spin_inertia", "radius"), 1.0) | {"torsion_stiffness": 1.3, "bending_stiffness": 0.7}
    if CURVATURE[name].stretches:
        parameters["stretch_stiffness"] = 0.9
    chain = Chain(n=n, length=3.0, **parameters, curvature=name, ends=ends)
    law = chain.link_law(chain)
    d = np.array([[0.5], [0.1], [0.0]]) + 0.1 * RNG.normal(size=(3, links))
    change = 0.05 * RNG.normal(size=(3, links))
    secant = law.secant(d, change)
    gained = law.potential(d + change) - law.potential(d)
    assert abs((law.tension(secant) * change).sum() - gained) < 1e-12 * law.potential(d)
    if law.parameters is None:
        return
    kind = {"springs": PLAIN, "consistent": GHOST, "ring": RING}[ends]
    before, middle = stencils.extended(d, ends), stencils.extended(d + 0.5 * change, ends)
    assert np.isclose(do.elastic(law.parameters, before), law.potential(d), rtol=1e-12)
    pull = np.zeros((3, n + 1))
    do.tension(law.parameters, kind, before, middle, pull)
    own = pull[:, 1:] if ends == "ring" else pull[:, 1:-1]
    assert np.allclose(own, law.tension(secant), rtol=1e-11, atol=1e-12 * np.abs(pull).max())


@pytest.mark.slow  # kernels of every pair
@pytest.mark.parametrize("curvature", CURVATURE)
@pytest.mark.parametrize("rolling", ROLLING)
def test_every_pair_of_laws_keeps_the_energy_and_rolls_alike_on_both_engines(rolling, curvature):
    first = uneven(6, Model("springs", "field"))
    problem = replace(first, chain=replace(first.chain, rolling=rolling, curvature=curvature))
    compiled, plain = (simulate(problem, FINE, 0.05, frames=[0.5], engine=e, progress=False) for e in ("compiled", "plain"))
    laws = problem.chain.rolling_law, problem.chain.link_law(problem.chain)
    assert compiled.stats["engine"] == ("plain" if None in [law.parameters for law in laws] else "compiled")
    for name in ("x", "y", "theta", "omega"):
        assert np.allclose(getattr(compiled, name), getattr(plain, name), rtol=0, atol=1e-12)
    for run in (compiled, plain):
        assert abs(run.energy[-1] / problem.energy() - 1) < 1e-12
        assert run.rolling_residual.max() < 1e-14


def test_a_law_of_ones_own_runs_on_the_plain_engine(blend):
    problem = semidiscretise(untwisting_rod(blend, duration=0.5), 9, "springs")
    run = simulate(problem, dt=0.02, frames=[0.5], want=("contact_force", "slope"), progress=False)
    assert run.stats["engine"] == "plain"
    assert abs(run.energy[-1] / problem.energy() - 1) < 1e-12
    assert run.rolling_residual.max() < 1e-14
    others = [
        simulate(
            semidiscretise(untwisting_rod(law, duration=0.5), 9, "springs"), dt=0.02, frames=[0.5], engine="plain", progress=False
        )
        for law in ("field", "unit")
    ]
    apart = np.abs(others[0].x - others[1].x).max()
    assert np.abs(run.x - 0.5 * (others[0].x + others[1].x)).max() < 0.05 * apart  # halfway, to second order in the stretch


def test_waves_of_a_third_law_grow_as_its_dispersion_relation_says(blend):
    """gamma = 1/2: the growth rate of the third wave of 12 discs on a ring, against a run."""
    rod = rolling_rod().rod
    n, mode, duration = 12, 3, 1.0
    q, k = 2 * np.pi * mode / rod.length, rod.length / n
    assert stretching(ROLLING[blend]) == 0.5
    sigma = float(growth(rod, q, 1.0, blend, k))
    t, c = symbols(q, k)
    m, p = rod.inertia, 0.5 * (rod.radius * c) ** 2
    roots = np.roots(
        [
            m,
            0,
            rod.torsion_stiffness * t + rod.bending_stiffness * rod.radius**2 * t**2 - rod.spin_inertia * p,
            0,
            -rod.torsion_stiffness * p * t,
        ]
    )
    assert abs(sigma - roots.real.max()) < 1e-12

    def initial(s):
        return tuple(np.array(exact.growing_wave(rod, s, 0.0, 1.0, mode, 1e-7, n, blend))[:, 0])

    scene = replace(rolling_rod(blend, duration=duration), initial=initial)
    run = simulate(semidiscretise(scene, n, "ring"), FINE, 0.005, frames=2, progress=False)
    theta = np.abs(np.fft.rfft(run.theta, axis=1)[:, mode])
    assert abs(np.log(theta[1] / theta[0]) / duration - sigma) < 1e-5
    with pytest.raises(ValueError, match="wave 3 does not grow"):
        exact.growing_wave(rod, rod.length * np.arange(n) / n, 0.0, 1.0, mode, 1e-7, n, "unit")


def test_a_law_whose_travel_falls_with_stretch_grows_where_two_roots_meet(blend, monkeypatch):
    """gamma < 0 may make sigma^2 complex: the growth rate is still the largest real part of the four roots."""
    monkeypatch.setattr(Blend, "rate", lambda self, z, dz: 2 * ROLLING["unit"].rate(z, dz) - dz)
    rod = rolling_rod(spin_inertia=0.1).rod
    q = np.linspace(0.2, 6, 30)
    found, m = growth(rod, q, 3.0, blend), rod.inertia
    p = -((3.0 * q * rod.radius) ** 2)
    b = rod.torsion_stiffness * q**2 + rod.bending_stiffness * rod.radius**2 * q**4 - rod.spin_inertia * p
    wanted = [np.roots([m, 0, x, 0, -rod.torsion_stiffness * y * z**2]).real.max() for x, y, z in zip(b, p, q, strict=True)]
    assert max(wanted) > 0.1
    assert np.allclose(found, wanted, atol=1e-7)  # double roots are found to half the digits


@pytest.mark.parametrize("law", ["field", "unit", "blend"])
def test_the_breathing_ring_of_every_law_is_that_of_its_discs(blend, law):
    scene = breathing_ring(law, duration=0.5, radius=0.7, spin_inertia=1.3)
    n = 8
    run = simulate(semidiscretise(scene, n, "ring"), FINE, 0.005, frames=[0.25, 0.5], progress=False)
    known = exact.ring(scene.rod, run.t, 0.4, law, n)
    assert np.allclose(np.hypot(run.x, run.y), known.radius[:, None], rtol=0, atol=1e-8)
    assert np.allclose(run.theta, known.theta[:, None], rtol=0, atol=1e-8)


def test_a_ring_that_has_become_a_point_is_refused_under_every_law_that_can_vanish(blend):
    rod = breathing_ring().rod
    for law in ("unit", blend):
        with pytest.raises(ValueError, match=r"the ring is a point at t = \d"):
            exact.ring(rod, [20.0], 0.4, law)


@pytest.mark.slow
def test_balances_hold_for_a_third_law(blend):
    """Momentum changes by its flux and the ground's force, which has the law's derivative in it, so a wrong one is seen."""
    ring = breathing_ring(blend, duration=0.4)
    scene = replace(ring, initial=lambda s: (*ring.initial(s)[:3], 0.4 + 0.1 * np.cos(np.pi * s / 2)))
    run = simulate(semidiscretise(scene, 64, "ring"), FINE, 0.01, frames=81, progress=False)
    law = balances(scene.rod, run, blend, True)["momentum_x"]
    assert np.abs(law.residual).max() < 0.02 * np.abs(law.source).max()
