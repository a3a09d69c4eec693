"""The ground's force, velocities, slopes and energy of a field: exact motions, balances, chains of discs; unequal parameters."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import Rod, Scene, breathing_ring, exact, motion, solve, steered_rod, untwisting_rod
from continuum.ground import weights
from continuum.motion import Runner
from continuum.wants import ARRAYS, smooth_tests
from discs import load, simulate
from discs.loads import Damping, Force, Motor, Rest, Slope, Spring, Torque, signals

ROD = {"length": 3.7, "density": 1.3, "spin_inertia": 0.6, "torsion_stiffness": 0.9, "bending_stiffness": 0.5, "radius": 0.7}
ALL = tuple(ARRAYS)


def field(scene, tol=1e-6, want=ALL, **options):
    return solve(scene, tol, want=want, progress=False, **options)


def within(found, truth, name, factor=1.0, rounding=1e-8):
    """The error of an array is within the estimate."""
    error = np.abs(getattr(found, name) - truth).max()
    assert error <= factor * found.error_estimate[name] + rounding, (name, error, found.error_estimate[name])


@pytest.mark.parametrize("rolling", ["field", "unit"])
def test_breathing_ring(rolling):
    """r = a u, so lambda = (rho a.. + K a/a_0^4) u, and a closed rod has no ends."""
    scene = breathing_ring(rolling, omega=-0.4, duration=0.5, **ROD)
    found = field(scene, frames=5)
    a0, rod = 3.7 / (2 * np.pi), scene.rod
    step = 1e-4
    near = [exact.ring(rod, found.t[1:-1] + d, -0.4, rolling) for d in (-step, 0.0, step)]
    a, rate = near[1].radius, (near[2].radius - near[0].radius) / (2 * step)
    faster = (near[0].radius - 2 * a + near[2].radius) / step**2
    u = np.array([np.cos(found.s / a0), np.sin(found.s / a0)])
    force = (1.3 * faster + 0.5 * a / a0**4)[:, None, None] * u
    inner = found[1:-1]
    within(inner, force, "contact_force", rounding=1e-6)
    within(inner, rate[:, None] * u[0], "x_rate", rounding=1e-7)
    within(inner, a[:, None] / a0 * u[0], "slope_y", rounding=1e-7)
    density = 0.5 * (1.3 * rate**2 + 0.6 * near[1].omega ** 2 + 0.5 * (a / a0**2) ** 2)
    within(inner, density[:, None] + 0 * found.s, "energy_density", rounding=1e-7)
    assert found.end_force is None
    assert found.end_couple is None


def stretched(s):
    """A straight line at rest along (0.6, 0.8), |r'| = 1 + 0.3 s - 0.01 s^3."""
    along = s + 0.15 * s**2 - 0.0025 * s**4
    return 0.6 * along, 0.8 * along, 0 * s, 0 * s


@pytest.mark.parametrize("rolling", ["field", "unit"])
def test_a_stretched_line_stays_at_rest(rolling):
    """r'' along the line does no work on (e psi, psi): the ground holds it, by K r'''' inside, by force and couple at the ends."""
    scene = Scene(rod=Rod(**ROD), initial=stretched, duration=0.3, rolling=rolling)
    found = field(scene, frames=3)
    along = np.array([0.6, 0.8])
    within(found, -0.06 * 0.5 * along[:, None] + 0 * found.s, "contact_force", rounding=1e-5)
    within(found, 0.5 * np.array([0.0, 0.06 * 3.7])[:, None] * along, "end_force", rounding=1e-7)
    within(found, 0.5 * np.array([-0.3, 0.3 - 0.03 * 3.7**2])[:, None] * along, "end_couple", rounding=1e-8)
    within(found, 0 * found.s, "energy_flux")


def turning(s):
    """A straight line that turns: r. = (V + s W) J r'."""
    return s, 0 * s, 0 * s, (0.5 + 0.8 * s) / ROD["radius"]


@pytest.mark.parametrize("rolling", ["field", "unit"])
def test_a_straight_line_turns(rolling):
    """Without torsion it stays straight and turns at the rate W: lambda = -rho W (V + s W) r', and nothing at the ends."""
    scene = Scene(rod=Rod(**ROD | {"torsion_stiffness": 0.0}), initial=turning, duration=0.9, rolling=rolling)
    found = field(scene, frames=4)
    angle = 0.8 * found.t[:, None]
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    within(found, -1.3 * 0.8 * (0.5 + 0.8 * found.s) * along, "contact_force", rounding=1e-6)
    within(found, 0.0, "end_force", rounding=1e-7)
    within(found, 0.0, "end_couple", rounding=1e-8)
    within(found, -(0.5 + 0.8 * found.s) * np.sin(angle), "x_rate")


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def lopsided(s):
    """A straight line, twisted more at one end."""
    return s, 0 * s, 1.8 * np.cos(np.pi * s / 3.7) + 0.4 * np.cos(2 * np.pi * s / 3.7), 0.2 + 0 * s


@pytest.mark.parametrize("rolling", ["field", "unit"])
@pytest.mark.slow
def test_the_ground_alone_changes_momentum(rolling):
    """Momentum and angular momentum change by the force inside and by force and couple at the ends; energy by nothing."""
    middle, step = 1.9, 2e-4
    scene = Scene(rod=Rod(**ROD), initial=lopsided, duration=2.0, rolling=rolling)
    found = field(scene, 1e-8, frames=middle + step * np.arange(-2, 3))
    shares = weights(found.s, False)

    def rate(values):
        return np.tensordot([1 / 12, -2 / 3, 0, 2 / 3, -1 / 12], values, 1) / step

    force = found.contact_force[2].T
    r, v = np.stack([found.x, found.y], axis=-1), np.stack([found.x_rate, found.y_rate], axis=-1)
    z = np.array([found.slope_x[2, [0, -1]], found.slope_y[2, [0, -1]]]).T
    ends, couple = found.end_force[2], found.end_couple[2]
    assert np.abs(ends).max() > 0.1
    assert np.abs(couple).max() > 0.1
    np.testing.assert_allclose(shares @ force + ends.sum(axis=0), rate(1.3 * np.einsum("s,fsi->fi", shares, v)), atol=2e-4)
    turn = shares @ cross(r[2], force) + (cross(r[2, [0, -1]], ends) + cross(z, couple)).sum()
    assert turn == pytest.approx(rate(1.3 * cross(r, v) @ shares), abs=5e-4)
    np.testing.assert_allclose(found.energy_density @ shares, found.energy, atol=1e-6)
    np.testing.assert_allclose(found.energy_flux[:, [0, -1]], 0.0, atol=found.error_estimate["energy_flux"])


RAMP = signals.smooth(0.0, 1.0)
LOADS = (
    Slope(0.3, -0.2),
    Damping(rolling=0.2, torsion=0.1, bending=0.05),
    Spring(0.0, 0.0, 0.4),
    Force(lambda s: 0.3 * s, 0.1, RAMP),
    Force(0.4, 0.5, RAMP, at=3.7),
    Torque(0.3, RAMP, at=0.0),
    Rest(twist=lambda s: 0.1 * s, curvature=0.4, signal=RAMP),
)


def parts(found, length):
    """The last frame's force inside and what acts at the ends, against the test functions, (2, 5)."""
    eta, eta1, _ = smooth_tests(found.s, length, False)
    force = eta * weights(found.s, False) @ found.contact_force[-1].T
    return (force + eta[:, [0, -1]] @ found.end_force[-1] + eta1[:, [0, -1]] @ found.end_couple[-1]).T


@pytest.mark.parametrize("own", [False, True])
def test_a_motor_at_an_end_acts_on_the_ground(own):
    """Its torque is among those that the force at the end balances."""
    scene = steered_rod(duration=1.0, twist=0.0, **ROD) if own else untwisting_rod("unit", duration=1.0, twist=0.0, **ROD)
    scene = replace(scene, loads=(Motor(lambda t: 1.5 * RAMP(t), at=0.0), Damping(torsion=0.1)))
    found = field(scene, 1e-4, frames=[1.0])
    assert np.abs(found.reaction).max() > 0.1
    np.testing.assert_allclose(parts(found, 3.7), found.contact_moments[0], atol=2e-3)


VARYING = {"density": lambda s: 1 + 0.2 * s, "torsion_stiffness": lambda s: 0.8 + 0.1 * s, "radius": lambda s: 1 - 0.05 * s}
VARIES = untwisting_rod("field", duration=1.0, bending_stiffness=lambda s: 0.7 + 0.1 * np.sin(s), **VARYING)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["field", "unit", "own", "loads", "varying"])
def test_forces_on_discs_tend_to_the_moments(law):
    """Sums over discs, which know nothing of ends: at order two to int lambda eta + force . eta + couple . eta' of the field."""
    scene = Scene(rod=Rod(**ROD), initial=lopsided, duration=1.0, rolling="unit" if law == "unit" else "field")
    scene = steered_rod(duration=1.0, **ROD) if law == "own" else scene
    scene = replace(scene, loads=LOADS) if law == "loads" else VARIES if law == "varying" else scene
    found = field(scene, 1e-4 if law == "loads" else 1e-6, frames=[1.0])
    method = "midpoint" if law == "loads" else "suzuki4"
    ends = {} if law == "own" else {"ends": "consistent"}
    sums = []
    for n in (33, 65, 129):
        problem = lump(scene, n, **ends)
        run = simulate(problem, method, dt=1 / (4 * n), frames=[1.0], want="contact_force", progress=False)
        eta = smooth_tests(problem.chain.s, scene.rod.length, scene.closed)[0]
        sums.append(run.contact_force[0] @ eta.T)
        inside = slice(n // 4, -(n // 4))
        every = found.contact_force[0][:, :: (found.s.size - 1) // (n - 1)]
        assert np.abs(run.contact_force[0] / problem.chain.w - every)[:, inside].max() < 100 / n**2
    np.testing.assert_allclose(parts(found, scene.rod.length), found.contact_moments[0], atol=2e-3)
    errors = [np.abs(each - found.contact_moments[0]).max() for each in sums]
    assert errors[0] > 1e-3
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.3)
    assert np.abs((4 * sums[2] - sums[1]) / 3 - found.contact_moments[0]).max() < errors[2] / 4
    if law == "own":
        assert not found.end_couple.any()


def uneven(s):
    """A stretched line that rolls unevenly, with |r'| = 1.2 and 1.53 at the ends."""
    return 1.2 * s + 0.1 * s**2 - 0.01 * s**3, 0 * s, 1.2 * np.cos(np.pi * s / 3.7) + 0.3 * np.cos(2 * np.pi * s / 3.7), 0.2 + 0 * s


@pytest.mark.parametrize("rolling", ["field", "unit"])
@pytest.mark.parametrize("initial", [lopsided, uneven])
def test_couple_and_force_at_ends_follow_from_derivatives_and_from_identities(rolling, initial, monkeypatch):
    """Twins: third derivatives of the polynomials, and sums along the motion, with |r'| = 1 and others at the ends."""
    scene = Scene(rod=Rod(**ROD), initial=initial, duration=1.5, rolling=rolling)
    found = {}
    for name, holds in (("sums", motion.hold), ("derivatives", lambda scene: False)):
        monkeypatch.setattr(motion, "hold", holds)
        found[name] = Runner(scene, np.linspace(0.0, 1.5, 6), 6, want=("contact_force",)).run(51, 1e-8).fields
    for name, bound in (("end_couple", 1e-5), ("end_force", 2e-3)):
        assert np.abs(found["sums"][name][-1]).max() > 50 * bound
        np.testing.assert_allclose(found["sums"][name], found["derivatives"][name], atol=bound)
    np.testing.assert_array_equal(found["sums"]["contact_force"], found["derivatives"]["contact_force"])


def test_bad_input():
    scene = untwisting_rod(duration=0.1)
    with pytest.raises(ValueError, match=r"want must be one of 'velocity', .*'energy_flux'; got 'force'"):
        field(scene, want="force")
    with pytest.raises(ValueError, match=r"want must be names of quantities; got 3"):
        field(scene, want=3)
    for method in ("richardson", "leapfrog"):
        with pytest.raises(ValueError, match=rf"method='{method}' gives velocity, slope; got 'contact_force': take"):
            field(scene, method=method)
    inside = replace(scene, loads=(Torque(0.1, at=1.0),))
    with pytest.raises(ValueError, match=r"load at the point s = 1 the ground has a force at that point, too"):
        field(inside, want="contact_force")
    with pytest.raises(ValueError, match=r"tol must be one of .*'end_couple'"):
        field(scene, {"friction": 1.0}, want="contact_force")


def test_saved(tmp_path):
    found = field(untwisting_rod(duration=0.2), 1e-3, frames=3)
    found.save(tmp_path / "field.nc")
    again = load(tmp_path / "field.nc")
    for name in (name for names in ARRAYS.values() for name in names):
        np.testing.assert_array_equal(getattr(again, name), getattr(found, name))
    assert again.error_estimate == found.error_estimate
    assert found[1:].end_force.shape == (2, 2, 2)


@pytest.mark.slow
def test_velocities_and_slopes_of_meshes_and_of_the_papers_scheme():
    scene, want = untwisting_rod("unit", duration=1.0, **ROD), ("velocity", "slope")
    truth = field(scene, 1e-8, want, frames=3)
    found = field(scene, 1e-3, want, method="richardson", frames=3)
    every = (truth.s.size - 1) // (found.s.size - 1)
    for name in ("x_rate", "y_rate", "slope_x", "slope_y"):
        error = np.abs(getattr(found, name) - getattr(truth, name)[:, ::every]).max()
        assert error < found.error_estimate[name] < 5 * error
    coarse = field(scene, want=want, method="leapfrog", frames=3)
    assert np.abs(coarse.y_rate[:, [0, -1]] - truth.y_rate[:, [0, -1]]).max() < 0.1
    assert coarse.contact_force is None
