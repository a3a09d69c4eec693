"""Linkages against classical thresholds, dispersion relations and an exact serpentine motion."""

import numpy as np
import pytest
from scipy.optimize import brentq

from discs import Linkage, LinkageProblem, LinkageState, State, simulate
from discs.analysis import modes
from tests.discs.test_linkage import bent, column

BECK = 20.0509536  # EI/length^2, the clamped column under a follower force (M. Beck 1952)


def test_a_skate_makes_a_dead_load_flutter():
    """The rates of Ziegler's column under a follower force: M = [[3, 1], [1, 1]], K = [[2 - P, P - 1], [-1, 1]]."""
    straight = bent(0.0, 0.0)
    for load in (1.3, 2.1, 3.0):
        matrix = np.linalg.solve([[3.0, 1.0], [1.0, 1.0]], -np.array([[2.0 - load, load - 1.0], [-1.0, 1.0]]))
        exact = np.sqrt(np.linalg.eigvals(matrix).astype(complex))
        found = modes(LinkageProblem(column(load), straight, 10.0), 4).rate
        for rate in exact:
            assert np.abs(found - rate).min() < 1e-7

    def apart(load):  # the discriminant of the rates squared: it changes sign where they meet
        rate = modes(LinkageProblem(column(load), straight, 10.0), 4).rate
        return ((rate[0] ** 2 - rate[2] ** 2) ** 2).real

    assert np.isclose(brentq(apart, 2.0, 2.2, xtol=1e-10), 3.5 - np.sqrt(2), atol=1e-8)
    unstable = modes(LinkageProblem(column(2.1), straight, 60.0), 4)
    assert np.isclose(unstable.growth, 0.0596, atol=5e-5)
    run = simulate(LinkageProblem(column(2.1), unstable.displaced(0, 1e-5), 60.0), dt=0.05, frames=2)
    expected = 1e-5 * (unstable.shape[0, 3] * np.exp(unstable.rate[0] * 60.0)).real
    assert np.abs(run.phi[-1] - expected).max() < 0.02 * np.abs(1e-5 * unstable.shape[0, 3]).max() * np.exp(60 * unstable.growth)


def test_columns_of_bars_tend_to_becks():
    def critical(bars):
        k = 1 / bars
        mass, bending = np.full(bars + 1, 1.3 * k), np.full(bars, 1.0)
        mass[0], mass[-1], bending[0] = 0.0, 0.65 * k, 2.0  # half a cell at the clamp, and half the mass at the tip
        nodes = np.arange(bars + 1)

        def grows(load):
            linkage = Linkage(
                n=bars + 1, link_length=k, mass=mass, heading_inertia=0.0, bending_stiffness=bending, wheel=nodes == bars,
                second_share=1.0, force_x=load * (nodes == 0), held=((0, "y"), (0, "phi")),
            )  # fmt: skip
            return modes(LinkageProblem(linkage, LinkageState(k * nodes, 0, 0), 1.0), 4).growth > 1e-3

        low, high = 15.0, 25.0
        while high - low > 1e-5:
            low, high = (low, mean) if grows(mean := 0.5 * (low + high)) else (mean, high)
        return high

    off = [BECK - critical(bars) for bars in (6, 12, 24)]
    order = np.log2(np.divide(off[:-1], off[1:]))
    assert 0 < off[-1] < 0.2
    assert np.all((order > 1.85) & (order < 2.05)), order


def snake(n, k, speed, shear, turn=0.3, bending=0.7):
    linkage = Linkage(
        n=n, link_length=k, mass=0.9 * k, heading_inertia=turn * k, bending_stiffness=bending, mounting_angle=np.pi / 2,
        stretch_compliance=1 / 30, shear_compliance=1 / shear, closed=True, shift=(n * k, 0),
    )  # fmt: skip
    return LinkageProblem(linkage, LinkageState(k * np.arange(n), 0, np.pi / 2, 0, speed), 5.0)


@pytest.mark.parametrize("shear", [2.5, 40.0])
def test_a_straight_snake_obeys_the_dispersion_of_its_discs(shear):
    """J w^3 - (K t + G c^2) w + G v sin(qk)/k = 0, and waves of stretch, which the wheels leave free."""
    n, k, speed = 9, 0.4, 1.6
    half = np.pi * np.arange(n) / n
    rates = []
    for t, c, sine in zip(4 / k**2 * np.sin(half) ** 2, np.cos(half), np.sin(2 * half) / k, strict=True):
        rates += [1j * w for w in np.roots([0.3, 0.0, -(0.7 * t + shear * c**2), shear * speed * sine])]
        rates += [sign * 1j * np.sqrt(30 / 0.9 * t) for sign in (-1, 1)]
    found = modes(snake(n, k, speed, shear), 2 * n)
    for rate in found.rate:
        assert np.abs(np.array(rates) - rate).min() < 1e-10
    assert np.isclose(found.growth, np.max(np.real(rates)), atol=1e-10)
    assert found.growth > 0.1


@pytest.mark.parametrize("shear", [0.5, 8.0])
def test_a_straight_snake_is_stable_up_to_a_speed_whatever_its_shear_stiffness(shear):
    """sqrt(K/J), with links that are short beside sqrt(K/G); the ring is long enough to hold the first wave that grows."""
    n, k = 36, 0.25 * np.sqrt(0.7 / shear)
    limit = np.sqrt(0.7 / 0.3)
    assert modes(snake(n, k, 0.98 * limit, shear), 2 * n).growth < 1e-6
    assert modes(snake(n, k, 1.1 * limit, shear), 2 * n).growth > 1e-2


def test_elastic_hinges_off_the_disc_flutter():
    """A trailer needs exact links: with stiff but elastic hinges at a distance k it grows at v/2k, however stiff they are."""
    n, k, speed = 6, 0.5, 1.3
    for stiffness in (1000.0, 4000.0):
        linkage = Linkage(
            n=n, link_length=k, mass=1.0, heading_inertia=0.2, bending_stiffness=0.0, mounting_angle=-np.pi / 2, second_share=1.0,
            stretch_compliance=1 / stiffness, shear_compliance=1 / stiffness,
        )  # fmt: skip
        towed = LinkageState(-k * np.arange(n), 0, np.pi / 2, 0, speed)
        growth = modes(LinkageProblem(linkage, towed, 5.0), 12).growth
        assert np.isclose(growth, speed / (2 * k), rtol=0.02)
    rigid = Linkage(
        n=n, link_length=k, mass=1.0, heading_inertia=0.2, bending_stiffness=0.0, mounting_angle=-np.pi / 2, second_share=1.0
    )
    assert modes(LinkageProblem(rigid, towed, 5.0), 3).growth < 1e-6


def test_a_trailer_on_a_circle_returns_to_it():
    """In axes that turn with the head: beta' = Omega - (u/k) sin beta at the hinge, with u(beta) of the energy; displacements."""
    radius, k, turn = 1.3, 0.5, 0.6
    behind = np.sqrt(radius**2 - k**2)
    speed, angle = radius * turn, np.array([0.3, 0.3 - np.arctan2(k, behind)])
    x, y = np.array([radius, behind]) * [np.cos(angle), np.sin(angle)]
    mass, inertia = [0.8, 1.4], [0.2, 0.3]
    linkage = Linkage(
        n=2, link_length=k, mass=mass, heading_inertia=inertia, bending_stiffness=0, mounting_angle=np.pi / 2, second_share=1.0
    )
    problem = LinkageProblem(linkage, LinkageState(x, y, angle, 0, -turn * y, turn * x, turn), 5.0)
    found = modes(problem, 3).rate
    sin, cos = k / radius, behind / radius
    moved = mass[0] + mass[1] * cos**2 + inertia[1] * sin**2 / k**2  # the energy is moved u^2/2 and that of the head's turning
    exact = [1j * turn, -1j * turn, speed * cos / k * (sin**2 * (inertia[1] / k**2 - mass[1]) / moved - 1)]
    assert np.allclose(np.sort_complex(found), np.sort_complex(exact), atol=1e-7)


def test_small_motions_are_about_steady_motions():
    flutter = LinkageProblem(column(2.1), bent(0.1, 0.2), 10.0)
    with pytest.raises(ValueError, match="small motions are about an equilibrium or a steady motion; in the state given"):
        modes(flutter)
    with pytest.raises(ValueError, match="at must be a LinkageState, as the problem is one of a linkage; got"):
        modes(flutter, at=State([0, 1, 2], 0, 0))
    with pytest.raises(ValueError, match="in which the linkage moves as a rigid body"):
        modes(LinkageProblem(column(2.1), LinkageState([0, 1, 2], 0, 0, 0, 0, [0, 0, 1], [0, 0, 1]), 1.0))


def serpentine(n, angle, duration):
    """A snake on r' = (cos b, sin b), b' = a cos q s, driven by its rest curvature against rolling drag; see docs/snakes.md."""
    length, a, bending, speed, drag, rho, turn = 4.0, 1.0, 1.0, 0.5, 0.5, 1.0, 0.01
    k, q = length / (n - 1), 2 * np.pi / length
    s, middle = k * np.arange(n), k * (np.arange(n - 1) + 0.5)
    share = np.full(n, k)
    share[[0, -1]] /= 2
    b = 2 * drag * rho * speed / (bending * a**2 * q**2)

    def rest(t):
        phase = q * (middle + speed * t)
        return a * np.cos(phase) - b * (1 - np.cos(q * middle)) * a * q * np.sin(phase)

    linkage = Linkage(
        n=n, link_length=k, mass=rho * share, heading_inertia=turn * share, bending_stiffness=bending, mounting_angle=angle,
        stretch_compliance=1e-5, shear_compliance=1e-5, rolling_drag=drag * rho * share, rest_curvature=rest,
    )  # fmt: skip
    along = a / q * np.sin(q * s)
    mean, start = 0.5 * (along[1:] + along[:-1]), curve(s[n // 2], a, q)
    r = np.cumsum([[0, 0], *(k * np.stack([np.cos(mean), np.sin(mean)], axis=1))], axis=0)  # relaxed links
    r += start - r[n // 2]
    rates = speed * np.cos(along), speed * np.sin(along), speed * a * np.cos(q * s)
    problem = LinkageProblem(linkage, LinkageState(r[:, 0], r[:, 1], along + angle, 0, *rates), duration)
    return problem, np.array([curve(place + speed * duration, a, q) for place in s])


def curve(s, a, q):
    """The place s along the curve, by Gauss's quadrature."""
    x, w = np.polynomial.legendre.leggauss(40)
    angle = a / q * np.sin(q * s * (x + 1) / 2)
    return 0.5 * s * np.array([w @ np.cos(angle), w @ np.sin(angle)])


@pytest.mark.parametrize("angle", [np.pi / 2, -np.pi / 2])
def test_an_exact_serpentine(angle):
    off = []
    for n in (9, 17, 33):
        problem, exact = serpentine(n, angle, 2.0)
        run = simulate(problem, dt=0.02, frames=3)
        off.append(np.hypot(run.x[-1, 0] - exact[0, 0], run.y[-1, 0] - exact[0, 1]))
        balance = run.energy - run.work + run.dissipated
        assert np.ptp(balance) < 1e-12
        assert run.dissipated[-1] > 0.3
    order = np.log2(np.divide(off[:-1], off[1:]))
    assert off[-1] < 5e-3
    assert np.all(np.abs(order - 2) < 0.1), (off, order)
    assert np.allclose(run.omega, -np.sign(angle) * 0.5, atol=0.02)
