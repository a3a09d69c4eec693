r"""Checks with pymunk, a planar contact solver: whether dry friction makes a disc roll, and whether discs touch.

Needs the extra "contact" (pymunk 6.6 or newer; 6.6.2 and 7.3.1 are tested).

**Rolling.** A disc stands on the ground in its own vertical plane. A torsion spring of stiffness c drives it; the spring's other
end is held at the angle psi, so the torque is tau = c (psi - theta). With the ground's force f, m x.. = f and
I theta.. = tau - R f. Rolling, x. = R theta., gives

    theta.. = tau/(I + m R^2),   a = R tau/(I + m R^2),   f = m a,

and from rest theta = psi (1 - cos Omega t), Omega^2 = c/(I + m R^2). Dry friction supplies f while |f| <= mu N, N = m g. The torque
is largest at the start, so the disc slips there if mu < R c psi/((I + m R^2) g).

**Touching.** Seen from above, a disc is a rectangle: 2 R along its rolling direction, thickness b along its axle. Two neighbours at
distance d, with headings that differ by delta and are symmetric about the line between them, touch at their inner corners if

    2 R sin(|delta|/2) + b cos(delta/2) >= d;   fine chain, kappa = delta/d:  R |kappa| >= 1 - b/d;   thin discs:  R |kappa| >= 1.
"""

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float, Int
from discs.solution import Solution


@dataclass(frozen=True, eq=False)
class Rolled:
    """A disc driven by a torsion spring along the ground, at the F = steps + 1 times of a contact solver.

    Attributes
    ----------
    t : (F,), times.
    x, theta : (F,), position (length) and roll angle (rad); positive roll moves the disc to positive x.
    speed, omega : (F,), their rates.
    friction, normal : (F - 1,), the ground's force in each step, along x and upwards.
    slip : (F,), speed - R omega.
    """

    t: Float
    x: Float
    theta: Float
    speed: Float
    omega: Float
    friction: Float
    normal: Float
    slip: Float


def rolling_in_pymunk(
    *,
    mass: float,
    spin_inertia: float,
    radius: float,
    stiffness: float,
    twist: float,
    gravity: float,
    friction: float,
    dt: float,
    steps: int,
) -> Rolled:
    """A disc that starts at rest and is driven by a torsion spring; only dry friction makes it roll.

    Parameters
    ----------
    mass, spin_inertia, radius : m, I about the axle, R; > 0.
    stiffness : c, torque per angle; > 0.
    twist : psi, the angle by which the spring's other end is turned.
    gravity : g > 0.
    friction : coefficient of friction mu, >= 0.
    dt : time step of the solver, a first-order method.
    steps : number of steps.

    Raises
    ------
    ValueError : for a parameter outside its range.
    ImportError : without pymunk.
    """
    names = ("mass", "spin_inertia", "radius", "stiffness", "gravity", "dt")
    given = zip(names, (mass, spin_inertia, radius, stiffness, gravity, dt), strict=True)
    m, spin, radius, c, g, h = (checks.number(name, value, positive=True) for name, value in given)
    psi, mu = checks.number("twist", twist), float(checks.field("friction", friction, 1, least=0.0)[0])
    steps = checks.whole("steps", steps, 1)
    pymunk = _pymunk()
    space = pymunk.Space()
    space.gravity = (0, -g)
    space.collision_slop = 1e-3 * radius
    body = pymunk.Body(m, spin)
    body.position = (0, radius - 0.5 * space.collision_slop)  # in contact, by less than the overlap that the solver corrects
    disc = pymunk.Circle(body, radius)
    reach = radius * (abs(psi) + 1) * 10
    ground = pymunk.Segment(space.static_body, (-reach, 0), (reach, 0), 0)
    disc.friction, ground.friction = mu, 1.0  # pymunk multiplies the two
    # pymunk counts angles anticlockwise, which is rolling to negative x
    spring = pymunk.DampedRotarySpring(space.static_body, body, psi, c, 0.0)
    space.add(body, disc, ground, spring)

    states, forces = np.zeros((steps + 1, 4)), np.zeros((steps, 2))
    for step in range(steps):
        space.step(h)
        states[step + 1] = body.position.x, -body.angle, body.velocity.x, -body.angular_velocity
        body.each_arbiter(lambda arbiter, step=step: forces.__setitem__(step, np.array(arbiter.total_impulse) / h))
    x, theta, speed, omega = states.T
    return Rolled(h * np.arange(steps + 1.0), x, theta, speed, omega, forces[:, 0], forces[:, 1], speed - radius * omega)


def footprints_touch(run: Solution, radius: ArrayLike, thickness: float) -> Int:
    """Pairs of discs that touch, seen from above as rectangles 2 R by `thickness`.

    Parameters
    ----------
    run : a run with own headings, or one with want=("slope",).
    radius : R > 0, a number or one per disc (N,).
    thickness : b > 0, along the axle; length, as the radius.

    Returns
    -------
    (touches, 3), int: frame, disc, other disc (of the higher number); sorted by frame, then disc.

    Raises
    ------
    ValueError : for a run without headings or a size that is not positive.
    ImportError : without pymunk.
    """
    n = run.x.shape[1]
    radius = checks.field("radius", radius, n, least=0.0, strict=True)
    thickness = checks.number("thickness", thickness, positive=True)
    if run.phi is not None:
        headings = run.phi
    elif run.slope_x is not None and run.slope_y is not None:
        headings = np.arctan2(run.slope_y, run.slope_x)
    else:
        raise ValueError('run must have headings: simulate(..., want=("slope",))')
    pymunk = _pymunk()
    space, numbers = pymunk.Space(), {}
    for i in range(n):
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        shape = pymunk.Poly.create_box(body, (thickness, 2 * radius[i]))
        space.add(body, shape)
        numbers[shape] = i
    touches = []
    for f, places in enumerate(zip(run.x, run.y, headings, strict=True)):
        for shape, (x, y, phi) in zip(numbers, np.transpose(places).tolist(), strict=True):
            shape.body.position, shape.body.angle = (x, y), phi
            space.reindex_shapes_for_body(shape.body)
        for shape, i in numbers.items():
            others = (numbers[hit.shape] for hit in space.shape_query(shape))
            touches += [(f, i, j) for j in others if j > i]
    return np.array(sorted(touches), dtype=int).reshape(-1, 3)


def _pymunk() -> ModuleType:
    try:
        import pymunk
    except ImportError:
        raise ImportError('the contact checks need pymunk: pip install "rolling-discs[contact]"') from None
    return pymunk
