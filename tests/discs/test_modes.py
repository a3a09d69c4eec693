"""Modes against dispersion relations, the field's spectrum, growth in runs, and closed forms."""

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from continuum import Rod, SteeredRod
from continuum.dispersion import frequency, response, steered_frequencies
from discs import Chain, Problem, State, SteeredChain, simulate
from discs.__main__ import main
from discs.analysis import modes
from discs.chains.twist import untwisting_chain
from discs.loads import Damping, Motor, Spring
from tests.conftest import longer

pytestmark = pytest.mark.slow  # many chains, large ones among them

ROD = {"length": 4.0, "density": 1.3, "spin_inertia": 0.9, "torsion_stiffness": 0.8, "bending_stiffness": 0.7, "radius": 0.8}
BEAMS = {"heading_inertia": 0.25, "stretch_stiffness": 10.0, "shear_stiffness": 9.0}


def ring(n, law, omega=0.0, loads=()):
    """A straight periodic rod, rolling sideways at a rate omega."""
    common = {"n": n, "ends": "ring", "shift": (4.0, 0.0)} | ROD
    chain = SteeredChain(**common, **BEAMS) if law == "own" else Chain(**common, rolling=law)
    s = chain.s
    return Problem(chain, State(s, 0 * s, 0 * s, omega, phi=0 * s if law == "own" else None), 4.0, loads)


def waves(n, law, omega):
    """All rates of the ring but zero, from the dispersion relations of n discs (docs/model.md)."""
    q, k = 2 * np.pi * np.arange(1, n // 2 + 1) / 4.0, 4.0 / n
    if law == "own":
        rod = SteeredRod(**ROD, **BEAMS)
        both = steered_frequencies(rod, q, k)
        found = np.concatenate([np.repeat(1j * both.ravel(), 2), 1j * steered_frequencies(rod, 0.0, k)[1:]])
        return np.concatenate([found, -found])
    if law == "unit" or not omega:
        found = np.repeat(1j * frequency(Rod(**ROD), q, k), 2)
        return np.concatenate([found, -found])
    m, alpha, beta, bend, r2 = 1.3 * 0.64 + 0.9, 0.9, 0.8, 0.7, 0.64
    found = []
    for t, c in zip((2 / k * np.sin(q * k / 2)) ** 2, np.sin(q * k) / k, strict=True):
        squares = np.roots([m, beta * t + bend * r2 * t * t - alpha * r2 * (omega * c) ** 2, -beta * r2 * t * (omega * c) ** 2])
        found += 2 * [*np.sqrt(squares.astype(complex)), *-np.sqrt(squares.astype(complex))]
    return np.array(found)


@pytest.mark.parametrize("n", [17, 129])
@pytest.mark.parametrize("omega", [0.0, 0.6])
@pytest.mark.parametrize("law", ["field", "unit", "own"])
def test_rings_have_the_rates_of_the_dispersion_relations(law, omega, n):
    found, right = modes(ring(n, law, omega), count=20), waves(n, law, omega)
    slowest = np.sort(np.abs(right))[:20]
    np.testing.assert_allclose(np.abs(found.rate), slowest, rtol=1e-8)  # none is missing, doubles counted
    left = list(right)
    for rate in found.rate:
        assert abs(left.pop(int(np.argmin(np.abs(np.array(left) - rate)))) - rate) < 1e-8 * abs(rate)
    unknowns = n * (6 if law == "own" else 4)
    assert found.zero == unknowns - right.size
    assert found.symmetries[:3] == ("x", "y", "roll")


def test_all_modes_of_a_small_ring():
    found, right = modes(ring(9, "unit"), count=16), waves(9, "unit", 0.0)
    np.testing.assert_allclose(np.abs(found.rate), np.sort(np.abs(right)), rtol=1e-8)
    with pytest.raises(ValueError, match=r"count must be at most 16, as the other 20 modes of the 36 are zero; got 17"):
        modes(ring(9, "unit"), count=17)


def free_frequency(mode):
    """Of the straight rod at rest: bending moments and beta theta' - K R d^3 y/ds^3 are zero at the ends, with y = R theta + const.

    y = sum of cos, sin (p s) and cosh, sinh (g s) with (beta/R^2) p^2 + K p^4 = M Omega^2/R^2 and (beta/R^2) g^2 - K g^4 = ... .
    """
    p = {name: ROD[name] for name in ROD}
    half, r2 = p["length"] / 2, p["radius"] ** 2
    tension, bend, inertia = p["torsion_stiffness"] / r2, p["bending_stiffness"], p["spin_inertia"] / r2 + p["density"]

    def off(w):
        root = np.sqrt(tension**2 + 4 * bend * inertia * w * w)
        a, b = np.sqrt((root - tension) / (2 * bend)), np.sqrt((root + tension) / (2 * bend))
        if mode % 2:  # even: c cos(a s) + d cosh(b s), with y'' = 0 and T y' = K y''' at s = half
            m = [[-a * a * np.cos(a * half), b * b * np.cosh(b * half)]]
            m.append([-a * (tension + bend * a * a) * np.sin(a * half), b * (tension - bend * b * b) * np.sinh(b * half)])
        else:
            m = [[-a * a * np.sin(a * half), b * b * np.sinh(b * half)]]
            m.append([a * (tension + bend * a * a) * np.cos(a * half), b * (tension - bend * b * b) * np.cosh(b * half)])
        return float(np.linalg.det(np.array(m) / np.cosh(b * half)))

    grid = np.linspace(1e-3, 40.0, 4000)
    values = [off(w) for w in grid]
    roots = [brentq(off, a, b, xtol=1e-13) for a, b, u, v in zip(grid, grid[1:], values, values[1:], strict=False) if u * v < 0]
    return roots[(mode - (mode % 2)) // 2 if mode % 2 else mode // 2]


@pytest.mark.parametrize("ends", [longer("springs"), "consistent"])
def test_free_rods_tend_to_the_field_at_order_2(ends):
    right = np.array([free_frequency(mode) for mode in range(3)])
    errors = []
    for n in (33, 65, 129):
        chain = Chain(n=n, ends=ends, **ROD)
        found = modes(Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), 1.0), count=6)
        errors.append(np.abs(np.abs(found.rate[::2]) - right) / right)
        assert found.zero == 2 * n + 2
        assert found.symmetries == ("x", "y", "roll", "turn")
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert (np.abs(orders - 2) < 0.12).all(), orders


def own_frequencies(count):
    """Of the straight rod with own headings at rest: u = (theta, T = beta theta' + R n, phi, m = K phi'), n = G (R theta' - phi).

    M theta'' = T', J phi'' = m' + n in time and s; T and m are zero at the ends (docs/model.md).
    """
    m, (beta, bend, radius) = 1.3 * 0.64 + 0.9, (0.8, 0.7, 0.8)
    g, inertia = BEAMS["shear_stiffness"], BEAMS["heading_inertia"]
    both = beta + g * radius**2

    def off(w):
        n = np.array([0.0, g * radius / both, g * radius**2 * g / both - g, 0.0])
        a = np.array(
            [[0, 1 / both, radius * g / both, 0], [-m * w * w, 0, 0, 0], [0, 0, 0, 1 / bend], [0, 0, -inertia * w * w, 0] - n]
        )
        return float(np.linalg.det(expm(4.0 * a)[1::2, ::2]))

    grid = np.linspace(0.05, 3.0, 400)
    values = [off(w) for w in grid]
    return [brentq(off, a, b, xtol=1e-13) for a, b, u, v in zip(grid, grid[1:], values, values[1:], strict=False) if u * v < 0][
        :count
    ]


@pytest.mark.parametrize(("degree", "order"), [(1, 2), (2, 4)])
def test_free_rods_with_own_headings_tend_to_the_field(degree, order):
    right, errors = np.array(own_frequencies(4)), []
    for n in (17, 33, 65):
        chain = SteeredChain(n=n, degree=degree, **ROD, **BEAMS)
        found = modes(Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s, phi=0 * chain.s), 1.0), count=8)
        errors.append(np.abs(np.abs(found.rate[::2]) - right) / right)
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert (np.abs(orders[-1] - order) < 0.25).all(), orders


@pytest.mark.parametrize(("degree", "order"), [longer(1, 2), (2, 4)])
def test_elements_have_their_order(degree, order):
    """The differences of n, 2 n and 4 n discs fall like n^-order."""
    rates = [np.abs(modes(replace(p, initial=at_rest(p)), count=6).rate[::2]) for p in own_rods((17, 33, 65, 129), degree)]
    steps = np.abs(np.diff(rates, axis=0))
    measured = np.log2(steps[:-1] / steps[1:])
    assert (np.abs(measured[-1] - order) < 0.2).all(), measured


def own_rods(sizes, degree):
    return [untwisting_chain(n, "own", degree=degree, twist=0.0) for n in sizes]


def at_rest(problem):
    return replace(problem.initial, omega=0.0)


def test_damped_ring_and_its_response():
    """(M sigma^2 + (c + eta t) sigma + beta t + K R^2 t^2) = 0; the same as the poles of `continuum.dispersion.response`."""
    found = modes(ring(33, "field", loads=(Damping(rolling=0.3, torsion=0.2),)), count=12)
    rod, k = Rod(**ROD), 4.0 / 33
    for rate in found.rate:
        q = 2 * np.pi / 4.0 * np.arange(17)
        t = (2 / k * np.sin(q * k / 2)) ** 2
        off = rod.inertia * rate**2 + (0.3 + 0.2 * t) * rate + 0.8 * t + 0.7 * 0.64 * t * t
        assert np.abs(off).min() < 1e-9
    assert found.growth < 0
    assert np.abs(response(rod, np.array([1.0]), 2.0, 0.3, 0.2, k)).max() > 0


def test_growth_in_a_run_is_the_rate():
    """Displaced along its fastest-growing mode, a rolling rod departs at that rate; the frame of the mode moves along."""
    problem = ring(17, "field", 0.6)
    found = modes(problem, count=12)
    mode = int(np.argmax(found.rate.real))
    size, time_ = 1e-6, 1.0
    run = simulate(
        replace(problem, initial=found.displaced(mode, size), duration=time_), "gauss6", 0.01, 2, progress=False, engine="plain"
    )
    still = simulate(replace(problem, duration=time_), "gauss6", 0.01, 2, progress=False, engine="plain")
    for row, name in enumerate(("x", "y", "theta")):
        expected = (size * found.shape[mode, row] * np.exp(found.rate[mode] * time_)).real
        np.testing.assert_allclose(getattr(run, name)[-1] - getattr(still, name)[-1], expected, atol=3e-5 * size)


def test_a_motor_takes_an_unknown():
    """A rod held at one disc: only modes that vanish there."""
    problem = untwisting_chain(9, "unit", twist=0.0)
    found = modes(replace(problem, loads=(Motor(0.0, at=0.0),)), count=4)
    assert found.shape.shape == (4, 3, 9)
    assert np.abs(found.shape[:, 2, 0]).max() < 1e-9
    assert np.abs(found.rate[0]) < np.abs(modes(problem, count=2).rate[0])  # clamped-free below free-free


def test_places_off_by_less_than_rounding():
    """Tiny numbers in place of zeros change nothing."""
    problem = ring(9, "unit", 0.1, (Motor(0.1, at=0.0),))
    tiny = 1e-30 * np.random.default_rng(7).normal(size=(2, 9))
    off = replace(problem.initial, y=tiny[0], theta=tiny[1])
    np.testing.assert_allclose(np.abs(modes(problem, 6, off).rate), np.abs(modes(problem, 6).rate), rtol=1e-9)


def test_2048_discs_in_a_second():
    """0.36 s of the processor alone for 20 modes; error of the rates: that of rounding, 1e-8."""
    chain = Chain(n=2048, ends="consistent", **ROD)
    problem = Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), 1.0)
    start = time.process_time()
    found = modes(problem, count=20)
    assert time.process_time() - start < 2.0
    assert found.zero == 2 * 2048 + 2
    right = [free_frequency(mode) for mode in range(3)]
    np.testing.assert_allclose(np.abs(found.rate[:6:2]), right, rtol=2e-5)


def test_springs_to_the_ground_take_the_symmetries_away():
    problem = untwisting_chain(9, "unit", twist=0.0)
    s = problem.chain.s
    found = modes(replace(problem, loads=(Spring(s, 0.0, 0.5),)), count=4)
    assert "y" not in found.symmetries
    assert found.rate[0].imag != 0
    assert found.zero < modes(problem).zero


def test_modes_on_the_command_line(capsys):
    assert main(["modes", "--n", "17", "--count", "4", "--rolling", "unit"]) == 0
    out = capsys.readouterr().out
    assert "17 discs at rest; 36 zero modes" in out
    assert len(out.splitlines()) == 6
    assert main(["modes", "--n", "17", "--count", "90"]) == 2
    assert "count must be at most 32" in capsys.readouterr().err
