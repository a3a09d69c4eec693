"""The ground's force under loads: d'Alembert's principle from frames, stiff dampers, loads at the ends; unequal parameters."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from continuum import Rod, Scene, rolling_rod, steered_rod
from discs.loads import Damping, Force, Motor, Rest, Slope, Spring, Torque
from discs.mechanics.ground import inner_places
from tests.continuum.test_ground import LOADS, RAMP, ROD, field, parts


def compatible(s):
    """A line that is stretched and bent, with |r'| = 1.2 and 1.53 at the ends, and a twist that fits them."""
    q = np.pi * s / 3.7
    theta = -1.3 * (np.cos(q) - 2 * np.cos(q) ** 3 / 3 + np.cos(q) ** 5 / 5)  # theta' ~ sin(q)^5
    return 1.2 * s + 0.1 * s**2 - 0.01 * s**3, 0.15 * np.sin(q) ** 4, theta, 0.25 + 0 * s


@pytest.mark.parametrize("rolling", ["field", "unit"])
@pytest.mark.slow
def test_loads_on_a_stretched_rod(rolling):
    """d'Alembert's principle for eta = 1, s, s^2, in x and y, and a rotation, from frames, with the energy's own variation.

    Loads and ground change momentum and its moments; |r'| is not 1 and drifts at the ends, as there is rest curvature.
    """
    middle, step, h, length = 0.8, 1e-3, 1e-3, 3.7
    scene = Scene(rod=Rod(**ROD), initial=compatible, duration=0.81, rolling=rolling, loads=LOADS)
    found = field(scene, 1e-6, frames=middle + step * np.arange(-2, 3))
    nodes, shares = (length / 2 * values for values in np.polynomial.legendre.leggauss(400))
    s, signal = nodes + length / 2, RAMP(middle)
    lines, rates = found.x + 1j * found.y, found.x_rate + 1j * found.y_rate
    faster = np.tensordot([1 / 12, -2 / 3, 0, 2 / 3, -1 / 12], rates, 1) / step
    r, v, faster, force = (
        make_interp_spline(found.s, a, 7) for a in (lines[2], rates[2], faster, [1, 1j] @ found.contact_force[2])
    )
    z, bend, dz, dbend, faster, force = r(s, 1), r(s, 2), v(s, 1), v(s, 2), faster(s), force(s)

    def potential(a, a1):  # of bending and, by the rate of curvature, of its viscosity
        kappa_rate = ((dz + a).conj() * bend + z.conj() * (dbend + a1)).imag
        return (0.5 * np.abs(bend + a1 - 0.4j * signal * (z + a)) ** 2 + 0.05 * kappa_rate**2) @ shares / 2

    pushed = 1.3 * (0.3 - 0.2j) - 0.4 * r(s) + signal * (0.3 * s + 0.1j)
    ends, couples = (values[2] @ [1, 1j] for values in (found.end_force, found.end_couple))
    places = np.array([0.0, length])

    def power(k, u):  # u s^k and its derivatives
        return lambda at, m: u * np.polynomial.Polynomial.basis(k).deriv(m)(at)

    for eta in [power(k, u) for k in range(3) for u in (1, 1j)] + [lambda at, m: 1j * r(at, m)]:
        on_rod = ((1.3 * faster - pushed) * eta(s, 0).conj()).real @ shares - (signal * (0.4 + 0.5j) * np.conj(eta(length, 0))).real
        on_rod += (potential(h * eta(s, 1), h * eta(s, 2)) - potential(-h * eta(s, 1), -h * eta(s, 2))) / (2 * h)
        by_ends = ends * eta(places, 0).conj() + couples * eta(places, 1).conj()
        assert (force * eta(s, 0).conj()).real @ shares + by_ends.real.sum() == pytest.approx(on_rod, abs=4e-3)  # the force's layer
    assert np.abs(couples).min() > 0.015
    assert np.abs(ends).min() > 0.1
    z = r(places, 1)
    assert np.abs(np.abs(z) - 1).min() > 0.1
    np.testing.assert_allclose((couples.conj() * 1j * z).real, 0.0, atol=1e-7)  # couple . e


SMOOTH_MOTOR = Motor(lambda t: 0.25 + 0.3 * float(RAMP(t)), at=0.0)


@pytest.mark.parametrize("loads", [LOADS, (Damping(bending=0.05), SMOOTH_MOTOR)], ids=["all", "motor"])
@pytest.mark.slow
def test_viscosity_of_bending_leaves_no_short_waves_in_the_force(loads):
    """Stiff dampers turn a rest of short waves into a force that grows with the number of functions; |r'| varies at the ends."""
    scene = Scene(rod=Rod(**ROD), initial=compatible, duration=0.8, rolling="field", loads=loads)
    truth, found = (field(scene, tol, "contact_force", frames=[0.33, 0.8]) for tol in (1e-8, 1e-6))
    assert found.error_estimate["contact_force"] < 0.1 < np.abs(found.contact_force).max()
    np.testing.assert_allclose(parts(found, 3.7), found.contact_moments[-1], atol=1e-3)
    for key in ("contact_force", "contact_force_inside", "end_force", "end_couple"):
        error = np.abs(getattr(found, key.removesuffix("_inside")) - getattr(truth, key.removesuffix("_inside")))
        error = (error[..., inner_places(found.s, 3.7)] if key.endswith("_inside") else error).max()
        assert error / 5 < found.error_estimate[key] < 5 * error, (key, error, found.error_estimate[key])


def test_loads_at_the_ends():
    """What pulls an end along the line is held by the ground; what pushes it across, or twists it, is not."""
    scene = rolling_rod("unit", amplitude=0.0, duration=0.4, omega=0.0, **ROD)
    scene = replace(scene, closed=False, shift=(0.0, 0.0), loads=(Force(-1.7, 0.0, at=0.0), Force(0.4, 0.0, at=3.7)))
    found = field(scene, frames=3)
    np.testing.assert_allclose(found.end_force, np.broadcast_to([[1.7, 0], [-0.4, 0]], (3, 2, 2)), atol=1e-9)
    np.testing.assert_allclose(found.contact_force, 0.0, atol=1e-7)


def bump(s):
    return np.sin(np.pi * s / 3.7) ** 4


def steered(s):
    """A line that is bent and stretched inside, with headings and a twist that fit the free ends."""
    return s + 0.1 * bump(s), 0.15 * bump(s), compatible(s)[2], 0.25 + 0 * s, 0.2 * bump(s), 0 * s


def wave(s):
    return 0.3 * np.cos(np.pi * s / 3.7)


TURNING_MOTOR = Motor(lambda t: 0.3 * float(RAMP(t)), at=0.0, about="turn")
OWN = {
    "none": (),
    "slope": Slope(0.3, -0.2),
    "spring": Spring(0.0, 0.0, 0.4),
    "force": Force(lambda s: 0.3 * s, 0.1, RAMP),
    "force at an end": Force(0.4, 0.5, RAMP, at=3.7),
    "torque": Torque(wave, RAMP),
    "torque at an end": Torque(0.3, RAMP, at=0.0),
    "torque that turns": Torque(wave, RAMP, about="turn"),
    "rolling resistance": Damping(rolling=0.2),
    "turning resistance": Damping(turning=0.2),
    "viscosity of torsion": Damping(torsion=0.1),
    "viscosity of bending": Damping(bending=0.05),
    "rest twist": Rest(twist=lambda s: 0.1 * s, signal=RAMP),
    "rest curvature": Rest(curvature=0.4, signal=RAMP),
    "rest stretch and shear": Rest(stretch=lambda s: 0.1 * bump(s), shear=lambda s: 0.05 * bump(s)),
    "motor": SMOOTH_MOTOR,
    "turning motor": TURNING_MOTOR,
}
SHORT = "force at an end", "viscosity of bending"


@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in SHORT else pytest.mark.long) for name in OWN])
@pytest.mark.slow
def test_loads_on_a_rod_with_own_headings(name):
    """<lambda, s^k> = int rho r.. s^k + n k s^(k-1) - F s^k up to k = 3, from frames and strains: 5e-7 to 6e-6 of length^k."""
    middle, step, length, stiffness = 0.8, 1e-3, 3.7, (8.0, 5.0)
    scene = replace(steered_rod(*stiffness, 0.3, duration=0.81, **ROD), initial=steered, loads=(OWN[name],) if OWN[name] else ())
    found = field(scene, frames=middle + step * np.arange(-2, 3))
    nodes, shares = (length / 2 * values for values in np.polynomial.legendre.leggauss(400))
    s = nodes + length / 2
    faster = np.tensordot([1 / 12, -2 / 3, 0, 2 / 3, -1 / 12], found.x_rate + 1j * found.y_rate, 1) / step
    line, force = found.x[2] + 1j * found.y[2], [1, 1j] @ found.contact_force[2]
    r, faster, phi, force = (make_interp_spline(found.s, a, 5) for a in (line, faster, found.phi[2], force))
    axes = np.exp(1j * phi(s))
    strain = axes.conj() * r(s, 1) - 1 - (name == "rest stretch and shear") * (0.1 + 0.05j) * bump(s)
    n = axes * (stiffness[0] * strain.real + 1j * stiffness[1] * strain.imag)
    pushes = {"slope": 1.3 * (0.3 - 0.2j), "spring": -0.4 * r(s), "force": RAMP(middle) * (0.3 * s + 0.1j)}
    end = RAMP(middle) * (0.4 + 0.5j) if name == "force at an end" else 0.0
    for k in range(4):
        on_rod = (1.3 * faster(s) - pushes.get(name, 0.0)) * s**k + n * k * s ** max(k - 1, 0)
        by_ground = force(s) * s**k @ shares + found.end_force[2] @ [1, 1j] @ [0.0**k, length**k]
        assert abs(by_ground - on_rod @ shares + end * length**k) < 2e-5 * length**k
    assert np.abs(found.end_force[2]).max() > 0.1
