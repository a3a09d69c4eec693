"""Discs of a contact solver against those of a chain: friction makes a disc roll; discs do not touch if the line curves little."""

import sys

import numpy as np
import pytest

from discs import Chain, Problem, Solution, State, SteeredChain, simulate
from discs.mechanics.contact import footprints_touch, rolling_in_pymunk

M, SPIN, R, SPRING, TWIST, G = 1.3, 0.4, 0.7, 0.9, 1.4, 9.3
DISC = {"mass": M, "spin_inertia": SPIN, "radius": R, "stiffness": SPRING, "twist": TWIST, "gravity": G}
INERTIA = SPIN + M * R**2
TORQUE = SPRING * TWIST  # at the start


def chain_of_two(times):
    """Two discs twisted against each other let go. The spring's middle rests, and each hangs on half a spring, twice as stiff.

    Each stands for half of the length 2, so its inertia is that of `DISC`. The first starts at theta = -twist.
    """
    chain = SteeredChain(
        n=2,
        length=2.0,
        density=M,
        spin_inertia=SPIN,
        heading_inertia=0.3,
        stretch_stiffness=0.0,
        shear_stiffness=0.0,
        torsion_stiffness=SPRING,  # beta/k = SPRING/2
        bending_stiffness=0.0,
        radius=R,
    )
    initial = State([0.0, 2.0], [0.0, 0.0], [-TWIST, TWIST], phi=[0.0, 0.0])
    return simulate(
        Problem(chain, initial, times[-1]), "rk4", dt=0.02, frames=times, want=("contact_force",), engine="plain", progress=False
    )


def test_rolling_comes_from_friction_to_first_order():
    """theta = psi (1 - cos Omega t), Omega^2 = c/(I + m R^2), and x = R theta; the ground's force is that of a chain of two discs.

    The solver moves first and forces then: its step is a leapfrog that reads half a step late. Hence an error of h/2 times the
    rate, first order, and one of second order at t - h/2 and in a step's force beside the exact one in its middle.
    """
    duration, steps, rate = 4.0, np.array([100, 200, 400]), np.sqrt(SPRING / INERTIA)
    first, second = [], []
    for count in steps:
        h = duration / count
        run = rolling_in_pymunk(**DISC, friction=0.5, dt=h, steps=count)
        assert np.abs(run.slip).max() < 1e-12  # it rolls
        np.testing.assert_allclose(run.normal, M * G, rtol=1e-9)

        def error(t, run=run):
            theta = TWIST * (1 - np.cos(rate * t))
            return [np.abs(run.theta - theta).max(), np.abs(run.x - R * theta).max()]

        chain = chain_of_two(np.append(run.t[:-1] + h / 2, duration))
        np.testing.assert_allclose(chain.theta[:-1, 0], -TWIST * np.cos(rate * chain.t[:-1]), atol=1e-7)
        first.append(error(run.t))
        second.append([*error(run.t - h / 2), np.abs(run.friction - chain.contact_force[:-1, 1, 0]).max()])
    np.testing.assert_allclose(np.diff(np.log2(first), axis=0), -1, atol=0.01)
    np.testing.assert_allclose(np.diff(np.log2(second), axis=0), -2, atol=0.02)
    np.testing.assert_allclose(first[-1], [h / 2 * TWIST * rate, h / 2 * TWIST * rate * R], rtol=0.01)


def test_first_acceleration():
    """a = R tau/(I + m R^2), from rest; not tau/(m R), that of a disc without spin inertia."""
    run = rolling_in_pymunk(**DISC, friction=0.5, dt=0.01, steps=1)
    assert run.speed[1] / 0.01 == pytest.approx(R * TORQUE / INERTIA, rel=1e-9)
    assert run.friction[0] == pytest.approx(M * R * TORQUE / INERTIA, rel=1e-9)


def test_it_slips_below_the_friction_that_the_ground_force_needs():
    """The threshold by bisection is |lambda|/N, lambda the contact force of the chain at the start."""
    needed = np.abs(chain_of_two(np.array([0.0, 1.0])).contact_force[0, 1, 0]) / (M * G)
    rolls, slips = 1.0, 0.0
    while rolls - slips > 1e-6:
        middle = 0.5 * (rolls + slips)
        run = rolling_in_pymunk(**DISC, friction=middle, dt=0.02, steps=10)
        rolls, slips = (middle, slips) if np.abs(run.slip).max() < 1e-9 else (rolls, middle)
    # friction short by delta slips by delta g dt (1 + m R^2/I) in a step: 1e-9 of slip is seen from delta = 3e-9
    assert 0.5 * (rolls + slips) == pytest.approx(needed, abs=1e-6)
    # and then it slides: f = mu N, and spins faster than it rolls
    run = rolling_in_pymunk(**DISC, friction=0.6 * needed, dt=0.02, steps=10)
    np.testing.assert_allclose(run.friction, 0.6 * needed * M * G, rtol=1e-9)
    assert (run.slip[1:] < -0.01).all()


def still(x, y, phi):
    """A run of given places and headings, (F, N)."""
    return Solution(np.arange(len(x)), np.arange(x.shape[1]), x, y, 0 * x, 0 * x, np.zeros(len(x)), phi=phi)


def ring(n, a, turn=0.0):
    """One frame of discs on a circle, axles along it."""
    u = 2 * np.pi * np.arange(n)[None] / n + turn
    return still(a * np.cos(u), a * np.sin(u), u + np.pi / 2)


@pytest.mark.parametrize("thickness", [1e-4, 0.05, 0.2])
def test_on_a_circle_they_touch_at_the_radius_of_the_rule(thickness):
    n, a = 41, 1.7
    touching, free = 2 * a, 0.0
    while touching - free > 1e-9:
        middle = 0.5 * (touching + free)
        touching, free = (middle, free) if len(footprints_touch(ring(n, a, 0.3), middle, thickness)) else (touching, middle)
    half, d = np.pi / n, 2 * a * np.sin(np.pi / n)
    assert touching == pytest.approx((d - thickness * np.cos(half)) / (2 * np.sin(half)), abs=2e-9)
    # and R |kappa| = 1 - b/d of fine chains to second order in delta
    assert touching / a == pytest.approx(1 - thickness / d, abs=half**2)


def test_touches_are_named():
    run = ring(5, 1.0)
    away = run.x + 10 * (np.arange(5) == 1)
    both = still(np.concatenate([run.x, away]), np.repeat(run.y, 2, axis=0), np.repeat(run.phi, 2, axis=0))
    expected = [(0, 0, 1), (0, 0, 4), (0, 1, 2), (0, 2, 3), (0, 3, 4), (1, 0, 4), (1, 2, 3), (1, 3, 4)]
    touches = footprints_touch(both, 0.8, 0.3)
    assert [tuple(t) for t in touches] == expected
    small = footprints_touch(both, [0.8, 0.8, 0.1, 0.8, 0.8], 0.3)  # a small disc has room
    assert [tuple(t) for t in small] == [t for t in expected if 2 not in t[1:]]


def margins(run, radius, thickness):
    """(2 R sin(|delta|/2) + b cos(delta/2))/d of neighbours around a ring, (F, N)."""
    d = np.hypot(*(np.roll(v, -1, axis=1) - v for v in (run.x, run.y)))
    heading = run.slope_x + 1j * run.slope_y
    half = np.abs(np.angle(np.roll(heading, -1, axis=1) / heading)) / 2
    return (2 * radius * np.sin(half) + thickness * np.cos(half)) / d


def test_a_motion_brings_neighbours_together():
    """An oval that rolls inwards: its neighbours touch where and when the rule says, first at the ends of the long axis."""
    n, length, radius = 40, 6.0, 0.4
    thickness = 0.2 * length / n
    fine = np.linspace(0, 2 * np.pi, 4001)
    arc = np.append(0, np.cumsum(np.hypot(*np.diff([1.15 * np.cos(fine), 0.8 * np.sin(fine)], axis=1))))
    u = np.interp(arc[-1] * np.arange(n) / n, arc, fine)
    oval = State(1.15 * np.cos(u), 0.8 * np.sin(u), 0.0 * u, 0.9)
    chain = Chain(
        n=n,
        length=length,
        density=1.3,
        spin_inertia=0.6,
        torsion_stiffness=0.9,
        bending_stiffness=0.3,
        radius=radius,
        rolling="unit",
        ends="ring",
    )
    run = simulate(Problem(chain, oval, 0.5), dt=0.01, frames=51, want=("slope",), progress=False)
    touches = footprints_touch(run, radius, thickness)
    margin = margins(run, radius, thickness)
    neighbours = np.zeros(margin.shape, bool)
    near = touches[touches[:, 2] == touches[:, 1] + 1]
    neighbours[near[:, 0], near[:, 1]] = True
    around = touches[touches[:, 2] == touches[:, 1] + n - 1]
    neighbours[around[:, 0], n - 1] = True
    # neighbours on an oval are mirrored up to what its curvature changes between them, some per cent
    assert margin[neighbours].min() > 0.97
    assert margin[~neighbours].max() < 1.03
    first = touches[0, 0]
    assert 10 < first < 40
    assert first == np.argmax(margin.max(axis=1) >= 1)
    assert {0, n // 2 - 1} <= set(np.flatnonzero(neighbours[first]))


def test_the_papers_motion_leaves_room_for_thin_discs():
    """R |kappa| stays below 1/3: discs thinner than two thirds of their distance never touch, thicker ones do."""
    n = 33
    chain = Chain(
        n=n,
        length=4.0,
        density=1.0,
        spin_inertia=1.0,
        torsion_stiffness=0.8,
        bending_stiffness=0.7,
        radius=1.0,
        ends="consistent",
    )
    twist = State(chain.s, 0 * chain.s, -np.pi / 2 * np.cos(np.pi * chain.s / 4))
    run = simulate(Problem(chain, twist, 4.5), dt=0.02, frames=46, want=("slope",), progress=False)
    open_margin = margins(run, 1.0, 0.0)[:, :-1].max()
    assert 0.25 < open_margin < 1 / 3
    assert not len(footprints_touch(run, 1.0, 0.6 * chain.k))
    assert len(footprints_touch(run, 1.0, 0.9 * chain.k))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": 0.0}, "mass must be a positive finite number; got 0.0"),
        ({"friction": -0.1}, "friction must be finite and at least 0; got -0.1"),
        ({"steps": 0}, "steps must be a whole number of at least 1; got 0"),
        ({"dt": -1.0}, "dt must be a positive finite number; got -1.0"),
        ({"twist": np.inf}, "twist must be a finite number; got inf"),
    ],
)
def test_bad_disc(change, message):
    with pytest.raises(ValueError, match=message):
        rolling_in_pymunk(**DISC | {"friction": 0.5, "dt": 0.01, "steps": 1} | change)


def test_bad_footprints():
    run = ring(5, 1.0)
    bare = Solution(run.t, run.s, run.x, run.y, run.theta, run.omega, run.energy)
    with pytest.raises(ValueError, match=r'run must have headings: simulate\(..., want=\("slope",\)\)'):
        footprints_touch(bare, 0.3, 0.1)
    with pytest.raises(ValueError, match=r"radius must be finite and greater than 0; got 0\.0"):
        footprints_touch(run, 0.0, 0.1)
    with pytest.raises(ValueError, match="thickness must be a positive finite number; got 0"):
        footprints_touch(run, 0.3, 0)


def test_without_pymunk(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymunk", None)
    with pytest.raises(ImportError, match=r'the contact checks need pymunk: pip install "rolling-discs\[contact\]"'):
        footprints_touch(ring(5, 1.0), 0.3, 0.1)
