"""Exact solutions."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from continuum.rod import Rod
from discs import checks
from discs.chain import ROLLING


class Ring(NamedTuple):
    """A breathing ring at times t (F,): radius a (length), roll angle theta and its rate omega, all (F,)."""

    radius: NDArray
    theta: NDArray
    omega: NDArray


def _collapse(a0: float, inward: float, nu: float) -> float:
    """First time at which a_0 cos(nu t) - inward sin(nu t)/nu is zero."""
    if nu > 0:
        return float(np.arctan2(a0 * nu, inward) / nu)
    return a0 / inward if inward > 0 else np.inf


def ring(rod: Rod, t: ArrayLike, omega: float, rolling: str = "field", n: int | None = None) -> Ring:
    r"""The circle of circumference `rod.length` whose discs all roll at the rate `omega` at t = 0.

    With a_0 = length/2 pi, headings |r'| = g a/a_0 and curvature |r''| = b a, where g = 1 and b = 1/a_0^2 for the field,
    and for n discs of spacing k g = (a_0/k) sin(2 pi/n), b = (4/k^2) sin^2(pi/n), M(a) = alpha + rho R^2 (g a/a_0)^2:

    field law: a. = -R omega g a/a_0, hence a = a_0 exp(-R g theta/a_0) and M omega^2/2 + K b^2 a^2/2 = const, that is
        M omega. = (R g/a_0)(rho R^2 g^2 omega^2 / a_0^2 + K b^2) a^2;
        one ordinary differential equation, integrated to 1e-13.
    unit law: a. = -R omega and (alpha + rho R^2) a.. = -K R^2 b^2 a, harmonic. It ends in a point, where a = 0.

    Parameters
    ----------
    t : times, increasing from t >= 0.
    n : number of discs, None for the field.

    Raises
    ------
    ValueError : for an unknown law, or times after the unit law's ring has become a point.
    """
    checks.choice("rolling", rolling, ROLLING)
    t = np.atleast_1d(np.asarray(t, dtype=float))
    if not t.size or not np.isfinite(t).all() or t[0] < 0 or (np.diff(t) <= 0).any():
        raise ValueError(f"t must be increasing times from 0 on; got {t}")
    omega = checks.number("omega", omega)
    if n is not None:
        n = checks.whole("n (discs of a ring)", n, 5)
    a0 = rod.length / (2 * np.pi)
    k = rod.length if n is None else rod.length / n
    g = 1.0 if n is None else a0 / k * np.sin(2 * np.pi / n)
    b = 1 / a0**2 if n is None else (2 / k * np.sin(np.pi / n)) ** 2
    r, stiffness = rod.radius, rod.bending_stiffness * b**2
    if rolling == "unit":
        pull = r * stiffness / rod.inertia
        nu = np.sqrt(r * pull)
        end = _collapse(a0, r * omega, nu)
        if t[-1] >= end:
            raise ValueError(f"the ring is a point at t = {end:g}; ask for earlier times")
        # sin(nu t)/nu, which is t for a rod that does not bend
        sine = t * np.sinc(nu * t / np.pi)
        a = a0 * np.cos(nu * t) - r * omega * sine
        # (a_0 - a)/R, written so that R may be 0
        theta = a0 * pull * t**2 / 2 * np.sinc(nu * t / (2 * np.pi)) ** 2 + omega * sine
        return Ring(a, theta, a0 * pull * sine + omega * np.cos(nu * t))

    def rate(_: float, z: NDArray) -> list[float]:
        stretch = np.exp(-2 * r * g * z[0] / a0)
        inertia = rod.spin_inertia + rod.density * r**2 * g**2 * stretch
        force = r * g * a0 * stretch * (rod.density * r**2 * g**2 * z[1] ** 2 / a0**2 + stiffness)
        return [z[1], force / inertia]

    span = 0.0, max(float(t[-1]), 1e-300)
    solution = solve_ivp(rate, span, [0.0, omega], t_eval=t, method="DOP853", rtol=1e-13, atol=1e-14)
    theta, rate_of_roll = solution.y
    return Ring(a0 * np.exp(-r * g * theta / a0), theta, rate_of_roll)
