"""What the free rod takes for a line of length one per length, and what it refuses; restarts."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from continuum import Rod
from continuum.free import free_rod

ROD = Rod(length=2, density=1.3, spin_inertia=0.6, torsion_stiffness=0.9, bending_stiffness=0.5, radius=0.0)
A = 1 / np.pi  # of the ring


def straight(s):
    return np.array([s, 0 * s])


def oblique(s):
    return np.array([s * np.cos(0.3), s * np.sin(0.3)])


def rest(s):
    return np.array([0 * s, 0 * s])


def circle(s):
    return A * np.array([np.cos(s / A), np.sin(s / A)])


def half(s):
    return 2 * A * np.array([np.cos(s / A / 2), np.sin(s / A / 2)])


def ringing(s):
    out, along = 0.4 * np.cos(2 * s / A), -0.2 * np.sin(2 * s / A)
    cos, sin = np.cos(s / A), np.sin(s / A)
    return np.array([out * cos - along * sin, out * sin + along * cos])


def whip(s):
    return np.array([0 * s, 1.2 * np.exp(-(((s - 1) / 0.3) ** 2))])


def directed(phi):
    """The line of direction phi(s)."""
    s = np.linspace(0, 2, 4001)
    line = CubicSpline(s, np.array([np.cos(phi(s)), np.sin(phi(s))]).T).antiderivative()
    return lambda s: line(s).T


def bent(s):
    """Straight at its ends."""
    return directed(lambda s: 0.8 * (np.pi * s / 2 - np.sin(np.pi * s) / 2))(s)


def kinked(at, angle):
    return lambda s: straight(np.minimum(s, at)) + np.maximum(s - at, 0) * np.array([[np.cos(angle)], [np.sin(angle)]])


def noisy(size):
    return lambda s: straight(s) + size * np.random.default_rng(3).normal(size=(2, s.size))


def start(r0, v0=rest, closed=False, arrays=False, n=None, **options):
    n = n or 81 - closed
    s = 2 / (n - 1 + closed) * np.arange(n)
    if arrays:
        r0, v0 = r0(s), v0(s)
    settings = {"duration": 0.02, "dt": 0.01, "frames": 1, "progress": False, "estimate": False} | options
    return free_rod(ROD, r0, v0, 0.0, 0.0, n=n, closed=closed, **settings)


@pytest.mark.parametrize("arrays", [False, True])
@pytest.mark.parametrize(
    ("r0", "closed", "function", "array"),
    [
        (straight, True, "closed around a ring.*got .0, 0. and .2, 0., 2 apart", "got 93.* at s = 1.98.*, between nodes 79 and 0"),
        (half, True, "closed around a ring.* 1.27 apart", "got 59.* at s = 1.98.*, between nodes 79 and 0"),
        (lambda s: straight(s + 3 * (s > 1)), False, "got 9361 at s = 1, between nodes 40", "got 142.* nodes 40 and 41"),
        (lambda s: 1000 * circle(s), True, "got 1000 at s = ", "got 1000 at s = "),
        (lambda s: 1.001 * straight(s), False, "got 1.001 at s = ", "got 1.001 at s = "),
        (lambda s: 0.999 * oblique(s), False, "got 0.999 at s = ", "got 0.999 at s = "),
        (lambda s: 0.999 * circle(s), True, "got 0.999 at s = ", "got 0.999 at s = "),
        (lambda s: 1.001 * bent(s), False, "got 1.001 at s = ", "got 1.001.* at s = "),
        (noisy(1e-3), False, "there it is stretched, has a kink, a jump or noise", "stretched, has a kink, a jump or noise"),
        (noisy(1e-5), False, "there it is stretched, has a kink, a jump or noise", "stretched, has a kink, a jump or noise"),
        (kinked(1.0, 0.3), False, "smooth.* got one of 0.3 rad at s = 1, node 40", "smooth.* got one of 0.3 rad at s = 1, node 40"),
        (kinked(1.01, 0.3), False, r"got .* between nodes 40 and 41", "got .* between nodes 40 and 41"),
        (kinked(1.0, -0.003), False, "smooth.* got one of 0.003 rad at s = 1, node 40", None),
        (lambda s: np.array([s, 0.02 * s**2]), False, r"got 1.003195 at s = 2", "got 1.003.* at s = "),
    ],
)  # fmt: skip
def test_stretched_lines_are_refused(r0, closed, function, array, arrays):
    """Whatever the fault's size: the tolerance does not grow with it. A kink of 0.003 rad is within what nodes alone can tell."""
    message = array if arrays else function
    if message is None:
        return
    with pytest.raises(ValueError, match="r0 must .*" + message):
        start(r0, closed=closed, arrays=arrays)


def test_nodes_that_are_too_few_to_tell_are_refused():
    """An arc of two radians on five nodes: splines of any degree leave |r'| open by 7e-4."""
    with pytest.raises(ValueError, match=r"got 0.9993.* between nodes 0 and 1: .* or n is too small for it"):
        start(directed(lambda s: s), arrays=True, n=5)


@pytest.mark.parametrize("arrays", [False, True])
@pytest.mark.parametrize(
    ("r0", "v0", "closed", "message"),
    [
        (straight, lambda s: 1e-3 * straight(s), False, "must not stretch the rod, r0'.v0' = 0; got 0.001 at s = "),
        (oblique, straight, False, "must not stretch the rod, r0'.v0' = 0; got 0.955 at s = "),
        (circle, lambda s: ringing(s) + 0.01 * circle(s), True, "must not stretch the rod.*; got 0.01 at s = .*is up to 1.4"),
        (circle, lambda s: 0 * circle(s) + s, True, "v0 must (be closed around a ring|not stretch the rod)"),
    ],
)
def test_velocities_that_stretch_are_refused(r0, v0, closed, message, arrays):
    with pytest.raises(ValueError, match=message):
        start(r0, v0, closed, arrays)


def unit(s):
    return np.cos(s) ** 2 + np.sin(s) ** 2


@pytest.mark.parametrize("arrays", [False, True])
@pytest.mark.parametrize("n", [3, 9, 81, 801])
@pytest.mark.parametrize(
    ("r0", "v0"),
    [
        (straight, lambda s: np.array([unit(s), 0 * s])),
        (oblique, lambda s: 1e3 * np.array([unit(s), 0.3 * unit(s)])),
        (oblique, lambda s: 3 * np.array([-s * np.sin(0.3), s * np.cos(0.3)]) + 0.1),
        (lambda s: oblique(s) + 1e4, lambda s: 3 * np.array([-s * np.sin(0.3), s * np.cos(0.3)])),
    ],
)
def test_rigid_motions_are_taken_with_their_rounding(r0, v0, n, arrays):
    run = start(r0, v0, arrays=arrays, n=n)
    assert run.energy[-1] == pytest.approx(start(r0, v0, arrays=arrays, n=n, duration=0.01).energy[-1], rel=1e-9)


@pytest.mark.parametrize(
    ("r0", "v0", "closed", "n"), [(circle, ringing, True, 12), (bent, rest, False, 33), (straight, whip, False, 9)]
)
def test_nodes_of_a_line_do_as_the_line_does(r0, v0, closed, n):
    """Arrays for both or for one of them."""
    run = start(r0, v0, closed, n=n)
    s = 2 / (n - 1 + closed) * np.arange(n)
    for given in ((r0(s), v0(s)), (r0(s), v0), (r0, v0(s))):
        again = free_rod(ROD, *given, 0.0, 0.0, 0.02, n, 0.01, closed, frames=1, progress=False, estimate=False)
        np.testing.assert_array_equal(again.x, run.x)
        np.testing.assert_array_equal(again.y_rate, run.y_rate)


def test_links_of_length_k_are_taken():
    """A chain built of its links: its nodes lie on no line of |r'| = 1 but for k^2."""
    phi = 0.5 * np.sin(np.pi * (np.arange(40) + 0.5) / 40) ** 4
    links = 0.05 * np.array([np.cos(phi), np.sin(phi)])
    r0 = np.concatenate([np.zeros((2, 1)), links.cumsum(axis=1)], axis=1)
    run = free_rod(ROD, r0, np.zeros((2, 41)), 0.0, 0.0, 0.02, 41, 0.01, frames=1, progress=False, estimate=False)
    np.testing.assert_allclose(np.hypot(np.diff(run.x[0]), np.diff(run.y[0])), 0.05, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("r0", "v0", "closed", "n", "dt"),
    [
        (straight, whip, False, 41, 0.01),
        (
            lambda s: oblique(s) + 50.0,
            lambda s: 7.0 + np.array([-np.sin(0.3) * whip(s)[1], np.cos(0.3) * whip(s)[1]]),
            False,
            16,
            0.02,
        ),
        (circle, ringing, True, 40, 0.01),
        (circle, ringing, True, 9, 0.02),
        (bent, rest, False, 34, 0.01),
        (bent, lambda s: np.array([-bent(s)[1], bent(s)[0]]), False, 21, 0.01),
    ],
)
def test_a_frame_goes_on_as_its_run(r0, v0, closed, n, dt):
    """After few steps and after many; with the lengths that the links had at the start, which are chords."""

    def spin(s):
        return 0.4 * np.cos(np.pi * s / 2)

    steps = np.array([7, 27, 200, 220, 400, 420])
    options = {"closed": closed, "progress": False, "estimate": False}
    run = free_rod(ROD, r0, v0, 0.2, spin, 420 * dt, n, dt, frames=steps * dt, **options)
    for f in (0, 2, 4):
        r, v = np.array([run.x[f], run.y[f]]), np.array([run.x_rate[f], run.y_rate[f]])
        again = free_rod(ROD, r, v, run.theta[f], run.omega[f], 20 * dt, n, dt, frames=1, **options)
        for name in ("x", "y", "x_rate", "y_rate", "theta", "tension"):
            a, b = getattr(again, name)[-1], getattr(run, name)[f + 1]
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)


def test_a_frame_that_is_stretched_is_refused():
    run = start(circle, ringing, True, n=40, duration=0.5)
    r, v = np.array([run.x[0], run.y[0]]), np.array([run.x_rate[0], run.y_rate[0]])
    with pytest.raises(ValueError, match=r"r0 must have .* got 1\.0.* at s = "):
        free_rod(ROD, 1.01 * r, v, 0.0, 0.0, 0.02, 40, 0.01, True, progress=False)
