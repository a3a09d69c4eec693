r"""Systems of the nonholonomic literature with known solutions.

Each function returns a `discs.mechanics.known.Textbook`: a system, an admissible start and, where there is a closed form, the
motion with its multipliers. All derivations use one fact: motion with speed sigma along a direction of angle phi, r. = sigma
(cos phi, sin phi), has r.. = sigma. (cos phi, sin phi) + sigma phi. (-sin phi, cos phi). The constraint force supplies the second
term and the forces along the direction the first.

* J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems, AMS 1972: knife edge, disc, sleigh;
* A. M. Bloch, Nonholonomic Mechanics and Control, 2nd ed., Springer 2015, chapter 1: the same, and the particle.

Each raises ValueError for a parameter outside its range, and for one that must not be 0.

Oscillators that drive each other are in `discs.mechanics.oscillators`.
"""

from collections.abc import Callable

import numpy as np
from scipy.integrate import quad

from discs import checks
from discs.arrays import Float
from discs.mechanics import MechanicalSystem
from discs.mechanics.bodies import Bodies, blade
from discs.mechanics.known import Textbook, finite, nonzero, positive


def _slope_drift(b: float, c: float, phi: float, start: float) -> tuple[float, float]:
    """Integrals of (b + c sin phi) cos phi and (b + c sin phi) sin phi from `start` to phi."""
    along = b * (np.sin(phi) - np.sin(start)) - 0.25 * c * (np.cos(2 * phi) - np.cos(2 * start))
    across = -b * (np.cos(phi) - np.cos(start)) + c * (0.5 * (phi - start) - 0.25 * (np.sin(2 * phi) - np.sin(2 * start)))
    return along, across


def rolling_disc(
    mass: float,
    spin_inertia: float,
    heading_inertia: float,
    radius: float,
    *,
    roll_rate: float,
    turn_rate: float,
    heading: float = 0.0,
    slope: float = 0.0,
) -> Textbook:
    r"""The vertical rolling disc, on a plane or an incline: x. = -R theta. sin phi, y. = R theta. cos phi.

    Coordinates (x, y, theta, phi), phi the direction of the axle; gravity pulls with mass times `slope` (g sin of the incline's
    angle) along x. The heading turns uniformly, phi = phi_0 + Omega t, since the disc's weight has no moment about the vertical,
    and

        (alpha + m R^2) theta.. = -m R slope sin phi:   theta. = b + c cos phi,   c = m R slope/((alpha + m R^2) Omega).

    The contact point moves with speed R theta. along phi + pi/2: on a plane along a circle of radius R omega/Omega, on an incline
    along cycloids whose mean drift, R c/2, is sideways and not downhill. The ground's force is lambda =
    m R (theta.. (-sin phi, cos phi) - Omega theta. (cos phi, sin phi)) - (m slope, 0).

    Source: Neimark and Fufaev, chapter 3; Bloch, section 1.4. `turn_rate` must not be 0.
    """
    positive(mass=mass, spin_inertia=spin_inertia, heading_inertia=heading_inertia, radius=radius)
    finite(roll_rate=roll_rate, heading=heading, slope=slope)
    turn = nonzero("turn_rate", turn_rate, "the disc then rolls on a straight line")
    m, a, r, pull = mass, spin_inertia, radius, mass * slope

    def constraint(q: Float) -> list[list[complex]]:
        return [[1, 0, r * np.sin(q[3]), 0], [0, 1, -r * np.cos(q[3]), 0]]

    def symmetry(q: Float) -> Float:
        if slope:  # along the contour lines, in theta, and in phi
            return np.eye(4)[:, 1:]
        return np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [-q[1], q[0], 0, 1]]).T

    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "theta", "phi"),
        np.diag([m, m, a, heading_inertia]),
        lambda q: -pull * q[0],
        constraint,
        ("disc", "disc"),
        symmetry=symmetry,
        bodies=Bodies(lambda q: q, r),
    )
    c = r * pull / ((a + m * r**2) * turn)
    b = roll_rate - c * np.cos(heading)

    def exact(t: float) -> tuple[Float, Float, Float]:
        phi = heading + turn * t
        cos, sin = np.cos(phi), np.sin(phi)
        rate, change = b + c * cos, -c * turn * sin
        # the direction of motion is phi + pi/2, whose sine is cos phi
        x, y = np.array(_slope_drift(b, c, phi + np.pi / 2, heading + np.pi / 2)) * r / turn
        theta = b * t + c / turn * (sin - np.sin(heading))
        force = m * r * (change * np.array([-sin, cos]) - turn * rate * np.array([cos, sin])) - [pull, 0]
        return np.array([x, y, theta, phi]), np.array([-r * rate * sin, r * rate * cos, rate, turn]), force

    q, v, _ = exact(0.0)
    return Textbook(system, q, v, exact, {"turning": lambda q, v: float(v[3])})


def knife_edge(mass: float, inertia: float, *, slope: float, speed: float, turn_rate: float, heading: float = 0.0) -> Textbook:
    r"""A knife edge (a skate) on an incline: x. sin phi = y. cos phi.

    Coordinates (x, y, phi), gravity along x with mass times `slope`. The blade turns uniformly, its speed u obeys u. = slope cos
    phi, so u = b + c sin phi, c = slope/Omega; lambda = m u Omega + m slope sin phi across the blade, (-sin phi, cos phi). From
    rest at phi = 0

        x = slope/(2 Omega^2) sin^2 Omega t,   y = slope/(2 Omega^2) (Omega t - sin(2 Omega t)/2):

    a cycloid: the blade returns to its height after every half turn.

    Source: Neimark and Fufaev, chapter 3; Bloch, section 1.6. `turn_rate` must not be 0.
    """
    positive(mass=mass, inertia=inertia)
    finite(slope=slope, speed=speed, heading=heading)
    turn = nonzero("turn_rate", turn_rate, "the blade then runs straight")
    pull = mass * slope
    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "phi"),
        np.diag([mass, mass, inertia]),
        lambda q: -pull * q[0],
        lambda q: [[-np.sin(q[2]), np.cos(q[2]), 0]],
        ("blade",),
        symmetry=lambda q: np.eye(3)[:, 1:],  # along the contour lines, and in phi
        bodies=blade,
    )
    c = slope / turn
    b = speed - c * np.sin(heading)

    def exact(t: float) -> tuple[Float, Float, Float]:
        phi = heading + turn * t
        u = b + c * np.sin(phi)
        x, y = np.array(_slope_drift(b, c, phi, heading)) / turn
        force = np.array([mass * u * turn + pull * np.sin(phi)])
        return np.array([x, y, phi]), np.array([u * np.cos(phi), u * np.sin(phi), turn]), force

    q, v, _ = exact(0.0)
    return Textbook(system, q, v, exact, {"turning": lambda q, v: float(v[2])})


def chaplygin_sleigh(
    mass: float, inertia: float, offset: float, *, speed: float, turn_rate: float, heading: float = 0.0
) -> Textbook:
    r"""The Chaplygin sleigh: a knife edge at (x, y), the centre of mass a distance a = `offset` ahead of it.

    In the coordinates (x, y, phi) of the edge M depends on phi: T = m/2 |(x., y.) + a phi. (-sin phi, cos phi)|^2 + I/2 phi.^2.
    With the speed u of the edge and J = I + m a^2

        u. = a phi.^2,   J phi.. = -m a u phi.,   so  u^2 + J phi.^2/m = U^2  and, with tau = kappa (t - t_0), kappa = a m U/J,

        u = U tanh tau,   phi. = +-U sqrt(m/J) sech tau,   phi = phi_0 +- sqrt(J/m)/a (gd tau - gd tau_0):

    the motion tends to a straight line with the centre of mass ahead. lambda = m u phi. I/J; x and y by quadrature of u (cos phi,
    sin phi).

    Source: Neimark and Fufaev, chapter 3; Bloch, section 1.7. `offset` and `turn_rate` must not be 0.
    """
    positive(mass=mass, inertia=inertia)
    finite(speed=speed, heading=heading)
    a = nonzero("offset", offset, "a knife edge without slope")
    turn = nonzero("turn_rate", turn_rate, "the sleigh then runs straight")

    def metric(q: Float) -> Float:
        s, c = -mass * a * np.sin(q[2]), mass * a * np.cos(q[2])
        return np.array([[mass, 0 * s, s], [0 * s, mass, c], [s, c, inertia + mass * a**2]])

    def symmetry(q: Float) -> Float:
        return np.array([[1.0, 0.0, -q[1]], [0.0, 1.0, q[0]], [0.0, 0.0, 1.0]])

    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "phi"),
        metric,
        lambda q: 0.0,
        lambda q: [[-np.sin(q[2]), np.cos(q[2]), 0]],
        ("blade",),
        symmetry=symmetry,
        bodies=blade,
    )
    j = inertia + mass * a**2
    top = np.sqrt(speed**2 + j * turn**2 / mass)
    kappa, first = a * mass * top / j, np.arcsinh(speed / (np.sqrt(j / mass) * abs(turn)))

    def gd(tau: float) -> float:
        return float(2 * np.arctan(np.tanh(tau / 2)))

    def state(t: float) -> tuple[float, float, float]:
        tau = kappa * t + first
        rate = np.sign(turn) * top * np.sqrt(mass / j) / np.cosh(tau)
        return heading + np.sign(turn) * np.sqrt(j / mass) / a * (gd(tau) - gd(first)), top * np.tanh(tau), rate

    def exact(t: float) -> tuple[Float, Float, Float]:
        def way(direction: Callable[[float], float]) -> float:
            """Integral of tanh tau times the direction from the start; the tolerance is that of a number near 1."""

            def along(tau: float) -> float:
                return float(np.tanh(tau) * direction(state((tau - first) / kappa)[0]))

            return float(top / kappa * quad(along, first, first + kappa * t, epsabs=1e-13, epsrel=1e-13, limit=200)[0])

        phi, u, rate = state(t)
        q, v = np.array([way(np.cos), way(np.sin), phi]), np.array([u * np.cos(phi), u * np.sin(phi), rate])
        return q, v, np.array([mass * u * rate * inertia / j])

    q, v, _ = exact(0.0)
    return Textbook(system, q, v, exact)


def nonholonomic_particle(mass: float, width: float, *, y: float, velocity: tuple[float, float]) -> Textbook:
    r"""Rosenberg's particle, z. = (y/b) x., free in space; b = `width`, velocity = (x., y.) at the start.

    y moves uniformly. Along (1, y/b)/sqrt(1 + y^2/b^2) no force acts, so x. = C/sqrt(1 + y^2/b^2), and

        x = (C b/y.) [asinh(y/b)],   z = (C b/y.) [sqrt(1 + y^2/b^2)],   lambda = m C (y./b) (1 + y^2/b^2)^{-3/2}.

    Source: R. M. Rosenberg, Analytical Dynamics of Discrete Systems, 1977; Bloch, chapter 5. y. must not be 0.
    """
    positive(mass=mass, width=width)
    finite(y=y)
    velocity = tuple(checks.vector("velocity", velocity, 2).tolist())
    run = nonzero("velocity[1]", velocity[1], "the particle then moves on a straight line")
    b = width
    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "z"),
        mass * np.eye(3),
        lambda q: 0.0,
        lambda q: [[-q[1] / b, 0, 1]],
        ("particle",),
        symmetry=lambda q: np.eye(3),
    )

    def root(y: float) -> float:
        return float(np.sqrt(1 + (y / b) ** 2))

    c = velocity[0] * root(y)

    def exact(t: float) -> tuple[Float, Float, Float]:
        now = y + run * t
        x = c * b / run * (np.arcsinh(now / b) - np.arcsinh(y / b))
        z, rate = c * b / run * (root(now) - root(y)), c / root(now)
        return np.array([x, now, z]), np.array([rate, run, now / b * rate]), np.array([mass * c * run / b / root(now) ** 3])

    q, v, _ = exact(0.0)
    return Textbook(system, q, v, exact, {"along": lambda q, v: float(v[0] * root(q[1]))})


def appell_hamel(mass: float, ratio: float, gravity: float, *, velocity: tuple[float, float, float]) -> Textbook:
    r"""Appell and Hamel's weight: x.^2 + y.^2 = rho^2 z.^2, not linear in the velocities, V = m g z; rho = `ratio`.

    In the machine a thread over pulleys is wound on a wheel that rolls below the weight. With Chetaev's reaction, 2 lambda (x., y.,
    -rho^2 z.), the direction (x., y.)/s., s. = sqrt(x.^2 + y.^2), is constant, and s. = +-rho z. gives

        m s.. = 2 lambda s.,   m z.. = -m g - 2 lambda rho^2 z.:   z.. = -g/(1 + rho^2),   lambda = m s../(2 s.).

    The closed form ends when the weight is at rest: there the constraint is singular, and any direction can follow.

    Source: P. Appell, Rend. Circ. Mat. Palermo 32 (1911) 48-50; G. Hamel, Theoretische Mechanik, Springer 1949. Neimark and Fufaev
    show that the limit of small wheels, from which the constraint comes, also allows other motions. `velocity` obeys the
    constraint.
    """
    positive(mass=mass, ratio=ratio, gravity=gravity)
    x, y, z = checks.vector("velocity", velocity, 3)
    if not np.isclose(np.hypot(x, y), ratio * abs(z), rtol=1e-9, atol=0) or not z:
        raise ValueError(f"velocity must obey x.^2 + y.^2 = {ratio:g}^2 z.^2 and not be 0; got {velocity}")
    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "z"),
        mass * np.eye(3),
        lambda q: mass * gravity * q[2],
        owners=("wheel",),
        phi=lambda q, v: v[0] ** 2 + v[1] ** 2 - (ratio * v[2]) ** 2,
    )
    fall = -gravity / (1 + ratio**2)

    def exact(t: float) -> tuple[Float, Float, Float]:
        v = np.array([x, y, z]) * (1 + fall * t / z)
        return np.array([x, y, z]) * (t + 0.5 * fall * t**2 / z), v, np.array([0.5 * mass * fall / v[2]])

    q, v, _ = exact(0.0)
    return Textbook(system, q, v, exact)
