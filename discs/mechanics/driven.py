r"""Textbook systems with drives, whose constraints are affine, A(q) v = b(t, q): `Textbook`s with closed forms.

The reaction of a drive does work, so energy is not conserved: energy - energy[0] = work + reaction_work. Each function raises
ValueError for a parameter outside its range, and for one that must not be 0.

* J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems, AMS 1972;
* K. Weltner, Stable circular orbits of freely moving balls on rotating discs, Am. J. Phys. 47 (1979) 984-986.
"""

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.mechanics import MechanicalSystem
from discs.mechanics.known import Textbook, finite, nonzero, positive


def ball_on_turntable(
    mass: float, radius: float, inertia: float, *, table_rate: float, place: ArrayLike, velocity: ArrayLike, spin: float = 0.0
) -> Textbook:
    r"""A ball that rolls on a table, which turns about the origin at the rate Omega = `table_rate`.

    (x, y) is the ball's centre. Its angular velocity w (in the frame at rest) has no angles as integrals, but the moment of
    momentum of a sphere is I w, so I w. = moment holds as if it had; a, b, c are quasi-coordinates with (a., b., c.) = w. The ball
    touches the table where the table's velocity is Omega (-y, x):

        x. - R w_y = -Omega y,   y. + R w_x = Omega x.

    With m r.. = lambda, I w_x. = R lambda_y, I w_y. = -R lambda_x the time derivative of the first reads x.. (1 + m R^2/I) =
    -Omega y., and so on:

        r.. = k Omega J r.,   k = I/(I + m R^2),   J (x, y) = (-y, x).

    The centre moves on a circle at the rate k Omega, 2/7 of the table's for a homogeneous ball (I = 2/5 m R^2), whatever the start;
    the circle has the radius |r.|/(k Omega) and its centre at r + J r./(k Omega). lambda = m k Omega J r..

    Parameters
    ----------
    inertia : I about the ball's centre.
    place, velocity : r and r. at the start, (2,); w_x and w_y follow from rolling.
    spin : w_z, constant.
    """
    positive(mass=mass, radius=radius, inertia=inertia)
    finite(spin=spin)
    rate = nonzero("table_rate", table_rate, "the ball then rolls on a straight line")
    r, u = checks.vector("place", place, 2), checks.vector("velocity", velocity, 2)
    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "a", "b", "c"),
        np.diag([mass, mass, inertia, inertia, inertia]),
        lambda q: 0.0,
        lambda q: [[1, 0, 0, -radius, 0], [0, 1, radius, 0, 0]],
        ("ball", "ball"),
        drive=lambda t, q: [-rate * q[1], rate * q[0]],
    )
    slow = inertia / (inertia + mass * radius**2) * rate
    arm = np.array([u[1], -u[0]]) / slow  # r - centre

    def exact(t: float) -> tuple[Float, Float, Float]:
        c, s = np.cos(slow * t), np.sin(slow * t)
        now = np.array([c * u[0] - s * u[1], s * u[0] + c * u[1]])
        here = r - arm + np.array([now[1], -now[0]]) / slow
        way = (r - arm) * t - (now - u) / slow**2  # integral of r
        a = np.array([rate * way[0] - (here - r)[1], (here - r)[0] + rate * way[1]]) / radius
        w = np.array([rate * here[0] - now[1], now[0] + rate * here[1]]) / radius
        return np.array([*here, *a, spin * t]), np.array([*now, *w, spin]), mass * slow * np.array([-now[1], now[0]])

    q, v, _ = exact(0.0)
    return Textbook(system, q, v, exact, {"speed": lambda q, v: float(np.hypot(v[0], v[1]))})


def bead_on_wire(mass: float, *, turn_rate: float, r: float, speed: float, heading: float = 0.0) -> Textbook:
    r"""A bead on a straight wire that a motor turns at the rate Omega = `turn_rate` about the origin; polar coordinates (r, phi).

    The constraint phi. = Omega is rheonomic. With T = m/2 (r.^2 + r^2 phi.^2)

        r.. = Omega^2 r:   r = r_0 cosh Omega t + (speed/Omega) sinh Omega t,

    and lambda, the motor's torque, is d/dt (m r^2 Omega) = 2 m r r. Omega. It does the work Omega [m r^2 Omega].

    `turn_rate` must not be 0.
    """
    positive(mass=mass)
    finite(r=r, speed=speed, heading=heading)
    rate = nonzero("turn_rate", turn_rate, "the bead then moves evenly")
    system = MechanicalSystem.from_lagrangian(
        ("r", "phi"),
        lambda q: [[mass, 0], [0, mass * q[0] ** 2]],
        lambda q: 0.0,
        lambda q: [[0, 1]],
        ("motor",),
        drive=lambda t, q: rate,
    )

    def exact(t: float) -> tuple[Float, Float, Float]:
        c, s = np.cosh(rate * t), np.sinh(rate * t)
        now, change = r * c + speed / rate * s, r * rate * s + speed * c
        return np.array([now, heading + rate * t]), np.array([change, rate]), np.array([2 * mass * now * change * rate])

    q, v, _ = exact(0.0)
    return Textbook(system, q, v, exact)
