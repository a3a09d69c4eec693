"""Linear waves of the straight rod, as a field and as n discs; the page `model` of the documentation has the derivation."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from continuum.rod import Rod, SteeredRod
from discs import checks
from discs.arrays import Complex, Float
from discs.chains.rolling import ROLLING, stretching


class Symbols(NamedTuple):
    """The Fourier symbols that replace q^2 in second differences (stiffness) and q in headings."""

    second: Float
    first: Float


def symbols(q: ArrayLike, k: float | None = None) -> Symbols:
    """q^2 and q; for discs of spacing k their counterparts t = 4/k^2 sin^2(qk/2) and c = sin(qk)/k."""
    q = np.asarray(q, dtype=float)
    return Symbols(q**2, q) if k is None else Symbols((2 / k * np.sin(q * k / 2)) ** 2, np.sin(q * k) / k)


def frequency(rod: Rod, q: ArrayLike, k: float | None = None) -> Float:
    """Frequency Omega of small waves of the straight rod at rest: (alpha + rho R^2) Omega^2 = beta q^2 + K R^2 q^4.

    Parameters
    ----------
    q : wave numbers, 1/length.
    k : spacing of discs; None for the field.
    """
    (t, _), p = symbols(q, k), rod.uniform("frequency")
    return np.sqrt((p.torsion_stiffness * t + p.bending_stiffness * p.radius**2 * t**2) / p.inertia)


def response(rod: Rod, q: ArrayLike, rate: float, rolling: float = 0.0, torsion: float = 0.0, k: float | None = None) -> Complex:
    """Complex amplitude of theta over that of a small torque per length, cos(q s) e^{i rate t}, on the straight rod at rest.

    With rolling resistance c and torsional viscosity eta it is A in

        (beta q^2 + K R^2 q^4 + i rate (c + eta q^2) - M rate^2) A = 1.

    Parameters
    ----------
    q, k : as for `frequency`.
    rolling, torsion : c and eta, as in `discs.loads.Damping`.
    """
    t, _ = symbols(q, k)
    kept, lost = rod.inertia * (frequency(rod, q, k) ** 2 - rate**2), rate * (rolling + torsion * t)
    return np.asarray(1 / (kept + 1j * lost), dtype=complex)


def growth(rod: Rod, q: ArrayLike, omega: float, rolling: str = "field", k: float | None = None) -> Float:
    """Largest growth rate sigma of a perturbation of wave number q of the straight rod rolling sideways at rate omega.

    With M = alpha + rho R^2 and gamma = `stretching(law)`, which is 1 for the field law and 0 for the unit law, it is the largest
    real part of a root of

        M sigma^4 + sigma^2 [beta q^2 + K R^2 q^4 - gamma alpha R^2 omega^2 q^2] - gamma beta R^2 omega^2 q^4 = 0.

    Derivation: to first order in r = (s + xi, R omega t + eta), any law has h(r') = (1 + gamma xi', eta'). Rolling then requires
    sigma xi = -R omega eta' and sigma eta = R (sigma vartheta + gamma omega xi'), and the equation of motion is
    M sigma^2 vartheta + rho gamma R^2 omega sigma xi' = beta vartheta'' - K R d^4 eta/ds^4.

    Field law: sigma -> omega sqrt(beta/K) as q -> infinity; it is unbounded in q if K = 0. Unit law: sigma = 0.
    """
    gamma = stretching(ROLLING[checks.choice("rolling", rolling, ROLLING)])
    (t, c), p = symbols(q, k), rod.uniform("growth")
    r2, push = p.radius**2, gamma * (omega * c) ** 2
    b = p.torsion_stiffness * t + p.bending_stiffness * r2 * t**2 - p.spin_inertia * r2 * push
    last = p.torsion_stiffness * r2 * push * t
    root = np.emath.sqrt(b**2 + 4 * p.inertia * last)
    # the larger root of M u^2 + b u - last, in the form without cancellation for each sign of b
    with np.errstate(divide="ignore", invalid="ignore"):
        square = np.where(b > 0, 2 * last / (root + b), (root - b) / (2 * p.inertia))
    growing: Float = np.emath.sqrt(np.where(last == 0, np.maximum(-b, 0) / p.inertia, square)).real
    return growing


def steered_frequencies(rod: SteeredRod, q: ArrayLike, k: float | None = None) -> Float:
    """Frequencies of small waves of the straight steered rod (sections with headings of their own), at rest or rolling.

    With small phi, y = R theta + const and the sideways force G (y' - phi),

        (M Omega^2 - (beta + G R^2) q^2)(J Omega^2 - K q^2 - G) = G^2 R^2 q^2.

    Both Omega^2 are positive, so no wave grows. Rolling at a rate omega adds only x. = -R omega phi, which has no effect on the
    other equations to first order. For discs of spacing k, t = 4/k^2 sin^2(qk/2) replaces q^2, and c = cos(qk/2) is the symbol of
    the mean of two headings: (M Omega^2 - (beta + G R^2) t)(J Omega^2 - K t - G c^2) = G^2 R^2 t c^2.

    Returns
    -------
    (2, ...) : the slower and the faster branch, for q of any shape.
    """
    (t, _), p = symbols(q, k), rod.uniform("steered_frequencies")
    c2 = np.ones_like(t) if k is None else np.cos(np.asarray(q) * k / 2) ** 2
    g, r2 = p.shear_stiffness, p.radius**2
    roll = (p.torsion_stiffness + g * r2) * t / p.inertia
    turn = (p.bending_stiffness * t + g * c2) / p.heading_inertia
    coupling = g**2 * r2 * t * c2 / (p.inertia * p.heading_inertia)
    fast = 0.5 * (roll + turn) + np.sqrt(0.25 * (roll - turn) ** 2 + coupling)
    # the product of the roots without the cancellation: (beta + G R^2) t (K t + G c^2) - G^2 R^2 t c^2
    product = t * (p.torsion_stiffness * (p.bending_stiffness * t + g * c2) + g * r2 * p.bending_stiffness * t)
    slow = product / (p.inertia * p.heading_inertia * fast)
    return np.sqrt(np.stack([slow, fast]))
