"""Exact solutions of the field and of n discs: breathing rings, the straight rod rolling, standing and growing waves."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike

from continuum.dispersion import frequency, growth, symbols
from continuum.rod import Rod
from discs import checks
from discs.arrays import Float
from discs.chains.rolling import ROLLING, stretching


class Ring(NamedTuple):
    """A breathing ring at times t (F,): radius a (length), roll angle theta and its rate omega, each (F,)."""

    radius: Float
    theta: Float
    omega: Float


class _Collapse:
    """The event a = 0 of a ring, at which SciPy's solver stops."""

    terminal = True

    def __call__(self, _: float, state: Float) -> float:
        return float(state[0])


def _collapse(a0: float, inward: float, nu: float) -> float:
    """The first time at which a_0 cos(nu t) - inward sin(nu t)/nu is zero."""
    if nu > 0:
        return float(np.arctan2(a0 * nu, inward) / nu)
    return a0 / inward if inward > 0 else np.inf


def ring(rod: Rod, t: ArrayLike, omega: float, rolling: str = "field", n: int | None = None) -> Ring:
    """The circle of circumference `rod.length` whose discs all roll at the rate `omega` at t = 0.

    Let a_0 = length/2 pi. The slope is z = |r'| = g a/a_0 and the curvature |r''| = b a. For the field g = 1 and b = 1/a_0^2; for n
    discs of spacing k, g = (a_0/k) sin(2 pi/n) and b = (4/k^2) sin^2(pi/n). A law of rolling h(z) moves the ring by a. = -R omega
    |h| and keeps M omega^2/2 + K b^2 a^2/2 with M = alpha + rho R^2 |h|^2. Hence

        M omega. = R |h| (rho R^2 |h| |h|' omega^2 g/a_0 + K b^2 a),   |h|' = d|h|/dz,

    which is integrated to 1e-13. For the unit law |h| = 1, so (alpha + rho R^2) a.. = -K R^2 b^2 a is harmonic and solved in closed
    form. When a = 0 the ring has collapsed to a point, and the solution ends.

    Parameters
    ----------
    t : times, increasing, from t >= 0.
    n : number of discs; None for the field.

    Raises
    ------
    ValueError : for an unknown law, or times after the collapse.
    """
    law = ROLLING[checks.choice("rolling", rolling, ROLLING)]
    t = np.atleast_1d(np.asarray(t, dtype=float))
    if not t.size or not np.isfinite(t).all() or t[0] < 0 or (np.diff(t) <= 0).any():
        raise ValueError(f"t must be increasing times from 0 on; got {t}")
    omega = checks.number("omega", omega)
    if n is not None:
        n = checks.whole("n (discs of a ring)", n, 5)
    a0, p = rod.length / (2 * np.pi), rod.uniform("ring")
    k = rod.length if n is None else rod.length / n
    g = 1.0 if n is None else a0 / k * np.sin(2 * np.pi / n)
    b = 1 / a0**2 if n is None else (2 / k * np.sin(np.pi / n)) ** 2
    r, stiffness = p.radius, p.bending_stiffness * b**2
    if rolling == "unit":  # closed form
        pull = r * stiffness / p.inertia
        nu = np.sqrt(r * pull)
        end = _collapse(a0, r * omega, nu)
        if t[-1] >= end:
            raise ValueError(f"the ring is a point at t = {end:g}; ask for earlier times")
        # sin(nu t)/nu, which is t for nu = 0
        sine = t * np.sinc(nu * t / np.pi)
        a = a0 * np.cos(nu * t) - r * omega * sine
        # (a_0 - a)/R, written so that R may be 0
        theta = a0 * pull * t**2 / 2 * np.sinc(nu * t / (2 * np.pi)) ** 2 + omega * sine
        return Ring(a, theta, a0 * pull * sine + omega * np.cos(nu * t))

    def rate(_: float, state: Float) -> list[float]:
        a, _, omega = state
        z, along = np.array([g * a / a0, 0.0]), np.array([1.0, 0.0])
        h, slope = float(law.size(z[0])), float(law.rate(z, along)[0])
        inertia = p.spin_inertia + p.density * r**2 * h**2
        return [-r * h * omega, omega, r * h * (p.density * r**2 * h * slope * omega**2 * g / a0 + stiffness * a) / inertia]

    span = 0.0, max(float(t[-1]), 1e-300)
    found = scipy.integrate.solve_ivp(
        rate, span, [a0, 0.0, omega], t_eval=t, method="DOP853", rtol=1e-13, atol=1e-14, events=_Collapse()
    )
    if found.t_events[0].size:
        raise ValueError(f"the ring is a point at t = {found.t_events[0][0]:g}; ask for earlier times")
    return Ring(*found.y)


class Motion(NamedTuple):
    """The fields of a rod at times t (F,) and places s (N,): x, y (length), theta and its rate omega, each (F, N)."""

    x: Float
    y: Float
    theta: Float
    omega: Float


def rolling_line(rod: Rod, s: ArrayLike, t: ArrayLike, omega: float) -> Motion:
    """The straight rod rolling sideways at a constant rate: r = (s, R omega t), theta = omega t; for discs and for every law.

    Nothing bends or twists, so (NHFE) gives omega. = 0 and lambda = mu = 0.
    """
    s, t, omega = *_axes(s, t), checks.number("omega", omega)
    theta = omega * t + 0 * s
    return Motion(s + 0 * t, rod.uniform("rolling_line").radius * theta, theta, np.full_like(theta, omega))


def standing_wave(
    rod: Rod, s: ArrayLike, t: ArrayLike, mode: int, amplitude: float, closed: bool = False, n: int | None = None
) -> Motion:
    """A standing wave of the straight rod at rest: theta = amplitude g(s) cos(Omega t), r = (s, R theta).

    It is exact at any amplitude if R = 0, as the rod then only twists. Otherwise it is exact to first order in the amplitude, under
    every law, because to first order e = (-R y', R), which gives x = s and y. = R theta. (NHFE) becomes a beam under tension,

        M theta.. = beta theta'' - K R^2 theta'''',   M = alpha + rho R^2.

    Closed rod: g = cos(q s), q = 2 pi mode/length, M Omega^2 = beta q^2 + K R^2 q^4 (`dispersion.frequency`).

    Free ends: theta'' = 0 and beta theta' = K R^2 theta'''. With z = s - length/2, g is the sum of a wave and of a part that decays
    from the ends,

        even: g = cos(q z)/(q^2 cos(q l/2)) + cosh(p z)/(p^2 cosh(p l/2)),   odd: the same with sin and sinh,

    where M Omega^2 = beta q^2 + K R^2 q^4 = K R^2 p^4 - beta p^2, so p^2 = q^2 + beta/(K R^2), and q is the mode-th root of

        even: p^3 tan(q l/2) + q^3 tanh(p l/2) = 0,   odd: q^3 tan(q l/2) = p^3 tanh(p l/2).

    g is scaled to 1 at s = 0. If K R = 0 there is no decaying part and g = cos(pi mode s/l).

    For n discs (plain springs, or a ring) Q = (4/k^2) sin^2(q k/2), P = (4/k^2) sinh^2(p k/2) replace q^2, p^2, and sin(q k)/k,
    sinh(p k)/k replace the single q, p in q^3 = q^4/q. The conditions at an end disc are zero bending, and that the shear forces of
    the links on its two sides, one of them beyond the end, sum to 0.

    Parameters
    ----------
    s : places, (N,); i k for discs.
    t : times, (F,).
    mode : 1, 2, ...: number of waves around a closed rod, number of zeros of theta on a free one.
    n : number of discs; None for the field.

    Raises
    ------
    ValueError : for a mode that is not a whole number of at least 1, or that n discs do not have.
    """
    s, t = _axes(s, t)
    mode = checks.whole("mode", mode, 1)
    k = None if n is None else rod.length / (checks.whole("n (discs)", n, 5 if closed else 3) - (not closed))
    most = mode if n is None else (n // 2 if closed else n - 1)
    if mode > most:
        raise ValueError(f"mode must be at most {most} for {n} discs; got {mode}")
    q, shape = _shape(rod, 2 * mode if closed else mode, closed, k)
    omega = float(frequency(rod, q, k))
    theta, radius = checks.number("amplitude", amplitude) * shape(s), rod.uniform("standing_wave").radius
    return Motion(s + 0 * t, radius * theta * np.cos(omega * t), theta * np.cos(omega * t), -omega * theta * np.sin(omega * t))


def growing_wave(
    rod: Rod, s: ArrayLike, t: ArrayLike, omega: float, mode: int, amplitude: float, n: int | None = None, rolling: str = "field"
) -> Motion:
    """The growing wave of the straight rod that rolls sideways at the rate omega, to first order in the amplitude.

    Perturb `rolling_line` by (xi, eta, vartheta) e^{sigma t}. Rolling requires sigma xi = -R omega eta' and
    sigma eta = R (sigma vartheta + gamma omega xi'). With sigma and gamma of `dispersion.growth`, q = 2 pi mode/length and g = R
    omega q,

        vartheta = a cos(q s),   eta = b cos(q s),   xi = (g/sigma) b sin(q s),   b = R sigma^2/(sigma^2 - gamma g^2) a.

    (For the field law, gamma = 1, sigma < g, because the dispersion relation is positive at sigma = g.) For n discs on a ring
    sin(q k)/k replaces q in g.

    Parameters
    ----------
    s, t : places (N,) and times (F,).
    omega : rate of roll, not zero; without rolling no wave grows.
    mode : number of waves around the closed rod, 1, 2, ...
    n : number of discs; None for the field.
    rolling : a law with gamma >= 0; for other laws the growing waves may also travel.

    Raises
    ------
    ValueError : for a rod on which this wave does not grow, and for a law with gamma < 0.
    """
    gamma = stretching(ROLLING[checks.choice("rolling", rolling, ROLLING)])
    if gamma < 0:
        raise ValueError(f"growing_wave is for laws with gamma >= 0; rolling={rolling!r} has {gamma:g}")
    s, t, omega = *_axes(s, t), checks.number("omega", omega)
    q = 2 * np.pi * checks.whole("mode", mode, 1) / rod.length
    k = None if n is None else rod.length / checks.whole("n (discs of a ring)", n, 5)
    radius = rod.uniform("growing_wave").radius
    sigma, g = float(growth(rod, q, omega, rolling, k)), radius * omega * float(symbols(q, k).first)
    if not sigma:
        raise ValueError(f"wave {mode} does not grow at omega = {omega:g}; see standing_wave")
    a = checks.number("amplitude", amplitude) * np.exp(sigma * t)
    b, wave = radius * sigma**2 / (sigma**2 - gamma * g**2) * a, np.cos(q * s)
    line = rolling_line(rod, s[0], t[:, 0], omega)
    return Motion(line.x + g / sigma * b * np.sin(q * s), line.y + b * wave, line.theta + a * wave, line.omega + sigma * a * wave)


def _axes(s: ArrayLike, t: ArrayLike) -> tuple[Float, Float]:
    """Places (1, N) and times (F, 1)."""
    return np.atleast_1d(np.asarray(s, dtype=float))[None, :], np.atleast_1d(np.asarray(t, dtype=float))[:, None]


def _shape(rod: Rod, mode: int, closed: bool, k: float | None) -> tuple[float, Callable[[Float], Float]]:
    """Wave number q and shape g of a standing wave; see `standing_wave`."""
    uniform = rod.uniform("standing_wave")
    length, torsion, bend = rod.length, uniform.torsion_stiffness, uniform.bending_stiffness * uniform.radius**2
    if closed or not bend:
        q = np.pi * mode / length
        return q, lambda s: np.cos(q * s)
    if mode == 1 and not torsion:
        raise ValueError("mode 1 with free ends needs a positive torsion_stiffness: without it the whole rod turns; got 0")
    half, odd = length / 2, mode % 2 == 1

    def ratios(q: float) -> tuple[float, float, float]:
        """p, q^2/p^2 and q/p; with n discs their counterparts."""
        second, first = symbols(q, k)
        square = second + torsion / bend
        p = np.sqrt(square) if k is None else 2 / k * np.arcsinh(np.sqrt(square) * k / 2)
        return float(p), float(second / square), float(first / (p if k is None else np.sinh(p * k) / k))

    def end(q: float) -> float:
        """The condition on q, multiplied by cos(q l/2) to remove the poles of tan."""
        p, second, first = ratios(q)
        sin, cos, tanh = np.sin(q * half), np.cos(q * half), np.tanh(p * half)
        return float(second**2 * sin - first * cos * tanh if odd else first * sin + second**2 * cos * tanh)

    q = float(scipy.optimize.brentq(end, max(mode - 1, 1e-6) * np.pi / length, mode * np.pi / length, xtol=1e-15, rtol=1e-14))
    p, second, _ = ratios(q)

    def g(s: Float) -> Float:
        z, sign = s - half, -1.0 if odd else 1.0
        wave = np.sin(q * z) / np.sin(q * half) if odd else np.cos(q * z) / np.cos(q * half)
        # cosh(p z)/cosh(p l/2), or sinh, without overflow for large p
        decaying = np.exp(p * (z - half)) + sign * np.exp(-p * (z + half))
        shape: Float = sign * (wave + second * decaying / (1 + sign * np.exp(-p * length))) / (1 + second)
        return shape

    return q, g
