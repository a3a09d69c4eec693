r"""Driven oscillators of the nonholonomic literature: `Textbook`s with invariants instead of a closed form.

K. Modin, O. Verdier, What makes nonholonomic integrators work?, Numer. Math. 145 (2020) 405-435, explain why methods must also be
tested on systems that are not reversible. The oscillators here are of the kind they study.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.mechanics import MechanicalSystem
from discs.mechanics.known import Textbook, finite, positive


def contact_oscillator(
    mass: float,
    stiffness: float,
    driver_mass: float,
    driver_stiffness: float,
    width: float,
    *,
    q: ArrayLike,
    speed: float,
    drift: float,
) -> Textbook:
    r"""The contact oscillator: x. + (y/b) z. = 0, V = (K (x^2 + z^2) + k y^2)/2; b = `width`, k = `driver_stiffness`.

    The constraint force has no component along y, so y oscillates freely and drives the others: (x, z) moves with speed sigma along
    (-sin chi, cos chi), tan chi = y/b, where m sigma. = K (x sin chi - z cos chi). The point (x, z, sigma sqrt(m/K)) stays on a
    sphere, and both energies are conserved. `speed` is sigma and `drift` is y. at the start, q = (x, y, z).

    If y is at rest at a time t_0, the motion before t_0 mirrors the motion after it. The system is reversible, like all usual test
    problems; `driven_oscillator` is not.

    Source: R. McLachlan, M. Perlmutter, J. Nonlinear Sci. 16 (2006) 283-328; Modin and Verdier (2020).
    """
    positive(mass=mass, stiffness=stiffness, driver_mass=driver_mass, driver_stiffness=driver_stiffness, width=width)
    finite(speed=speed, drift=drift)
    return _driven(
        ("x", "y", "z"),
        (mass, stiffness, driver_mass),
        lambda y: 0.5 * driver_stiffness * y**2,
        lambda y: y / width,
        q,
        speed,
        drift,
    )


def driven_oscillator(
    mass: float, stiffness: float, driver_mass: float, wave: float, skew: float, *, q: ArrayLike, speed: float, drift: float
) -> Textbook:
    r"""A continuously variable transmission that is not reversible: x. + sin(y) z. = 0, U(y) = wave (cos y + skew sin(2y)/2).

    As `contact_oscillator`, but the driver is a pendulum that rotates. It has no turning point, so its motion is reversible only if
    U is even about some point, which needs skew = 0. For any other skew the system is still integrable (driver and oscillator each
    conserve an energy) but not reversible, and methods whose long-time behaviour relies on reversibility fail on it.

    Source: of the kind that Modin and Verdier (2020) construct by perturbing the pendulum-driven transmission; parameters are ours.
    Raises ValueError unless the driver rotates.
    """
    positive(mass=mass, stiffness=stiffness, driver_mass=driver_mass, wave=wave)
    finite(skew=skew, speed=speed, drift=drift)

    def hill(y: Float) -> Float:
        return wave * (np.cos(y) + 0.5 * skew * np.sin(2 * y))

    start = checks.vector("q", q, 3)
    top = float(np.max(hill(np.linspace(0, 2 * np.pi, 1001))))
    if 0.5 * driver_mass * drift**2 + float(hill(start[1])) <= top:
        least = np.sqrt(2 * (top - float(hill(start[1]))) / driver_mass)
        raise ValueError(f"drift must be above {least:.6g} in size for the driver to rotate; got {drift!r}")
    return _driven(("x", "y", "z"), (mass, stiffness, driver_mass), hill, np.sin, q, speed, drift)


def _driven(
    names: tuple[str, ...],
    parameters: tuple[float, float, float],
    hill: Callable[[Float], Float],
    gear: Callable[[Float], Any],
    q: ArrayLike,
    speed: float,
    drift: float,
) -> Textbook:
    """An oscillator in (x, z) with x. + gear(y) z. = 0; y moves independently in the potential `hill`."""
    mass, stiffness, driver = parameters
    start = checks.vector("q", q, 3)
    system = MechanicalSystem.from_lagrangian(
        names,
        np.diag([mass, driver, mass]),
        lambda q: 0.5 * stiffness * (q[0] ** 2 + q[2] ** 2) + hill(q[1]),
        lambda q: [[1, 0, gear(q[1])]],
        ("oscillator",),
    )
    chi = np.arctan(gear(start[1]))
    invariants: dict[str, Callable[[Float, Float], float]] = {
        "driver": lambda q, v: float(0.5 * driver * v[1] ** 2 + hill(q[1])),
        "oscillator": lambda q, v: 0.5 * float(mass * (v[0] ** 2 + v[2] ** 2) + stiffness * (q[0] ** 2 + q[2] ** 2)),
    }
    return Textbook(system, start, np.array([-speed * np.sin(chi), drift, speed * np.cos(chi)]), None, invariants)
