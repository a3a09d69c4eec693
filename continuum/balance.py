"""Conservation laws (section 3.4 of the paper and its appendix): density, flux and source of each along a motion.

With the contact force n = p r' - K r''' (p = 0 for the rolling rod), the equations of both rods read

    rho r.. = n' + lambda,   alpha theta.. = beta theta'' - e . lambda.

The free rod has lambda = 0. The rolling rod has r. = e theta., and lambda is the force of the ground per length. Each symmetry of
the Lagrangian gives a balance d_t D + d_s F = S: multiply the equations by Q = (Q_r, Q_theta), the rate at which the symmetry moves
the fields, and add them. The source is the virtual work of the ground, S = lambda . (Q_r - e Q_theta):

| law               | Q            | density D                     | flux F                  | source S               |
| ----------------- | ------------ | ----------------------------- | ----------------------- | ---------------------- |
| energy            | (r., theta.) | T + V                         | -n.r. - K r''.r.'       | lambda.(r. - e theta.) |
|                   |              |                               | - beta theta' theta.    |   = 0                  |
| momentum_x, _y    | ((1, 0), 0)  | rho r.                        | -n                      | lambda                 |
| theta_momentum    | (0, 1)       | alpha theta.                  | -beta theta'            | -e.lambda              |
| angular_momentum  | (J r, 0)     | rho r x r.                    | -r x n - K r' x r''     | r x lambda             |
| material_momentum | (r', theta') | rho r.r' + alpha theta.theta' | K r'.r''' - p - T - V   | lambda.(r' - e theta') |

T = (rho |r.|^2 + alpha theta.^2)/2, V = (K |r''|^2 + beta theta'^2)/2, a x b = a_x b_y - a_y b_x. The derivation uses
r x n' = (r x n)' - r' x n with r' x n = -(K r' x r'')', and, with tension, p r'.r.' = 0. The paper's forms are J = D ds - F dt, up
to a common sign. Its angular momentum is printed with -K(x''y' + y''x'), where -K(x''y' - y''x') follows. The law of
material_momentum belongs to the symmetry s -> s + const. It is not in the paper, but holds for the free rod, which is homogeneous.

**Parameters that vary** along the rolling rod stand inside the derivatives, n = -(K r'')' and (beta theta')' in the equations and
r'.(K r'')' in the flux of material_momentum. s -> s + const is no symmetry then, and the source of material_momentum has minus the
derivative of the Lagrangian's density by s itself, (K' |r''|^2 + beta' theta'^2 - rho' |r.|^2 - alpha' theta.^2)/2, too.

**Noether's condition** (NHnoether): a symmetry gives a conservation law of the rolling rod if its generator, contracted with the
forms of the bundle (bundleF), is zero on the constraint, that is, if Q_r - e Q_theta = 0. For the symmetry in time this is the
rolling constraint itself. For the other symmetries it fails: their laws are balances with a source, the nonholonomic momentum
equation of the paper's conclusions.

Derivatives in s are those of splines of degree 7 through the nodes. lambda is that of a field with want="contact_force"
(`continuum.ground`); without it, it follows from x, y, theta and omega at one time, with omega. eliminated. d_t D and the Q of the
first row are computed by differences in time, so that the violation of the first row is measured, too.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from continuum.rod import Rod, SteeredRod
from discs import Solution, checks
from discs.arrays import Float, Spline
from discs.chains.rolling import ROLLING

DEGREE = 7
LAWS = ("energy", "momentum_x", "momentum_y", "theta_momentum", "angular_momentum", "material_momentum")


class Balance(NamedTuple):
    """One law along a motion, d_t density + d_s flux = source, with the violation of Noether's condition.

    density, flux, source : (F, N).
    violation : (F, N), |Q_r - e Q_theta|; zero for the free rod.
    residual : (F - 2, N), d_t density + d_s flux - source at all frames but the first and last, d_t by differences.
    unforced : (F - 2, N), the same without the source.
    """

    density: Float
    flux: Float
    source: Float
    violation: Float
    residual: Float
    unforced: Float


def balances(
    rod: Rod, run: Solution, rolling: str | None, closed: bool = False, shift: tuple[float, float] = (0.0, 0.0)
) -> dict[str, Balance]:
    """All laws along a motion of the rod.

    Parameters
    ----------
    rod : a rod with linear curvature; the free rod is uniform.
    run : the motion, from `solve`, `simulate` or `free_rod`, with at least 8 nodes and 3 frames. The frames must be close together:
        the error of d_t is of second order in their distance.
    rolling : the law of rolling, a name in `discs.chains.rolling` such as "field" or "unit"; None for the free rod.
    closed, shift : as in the scene.

    Returns
    -------
    The balances by name, see LAWS. The rolling rod has a thin layer at free ends, which splines do not resolve. Derivatives at the
    last nodes are inaccurate there, and the flux through an end is zero only up to O(k).

    Raises
    ------
    ValueError : for another bending law, a run with loads, too few frames or nodes, or a motion of the free rod without velocities
        and tension.
    """
    if isinstance(rod, SteeredRod) or not isinstance(rod, Rod) or rod.curvature != "linear":
        raise ValueError(f"balances need a Rod with curvature='linear'; got {rod!r}")
    scene = run.stats.get("scene")
    if (run.problem is not None and run.problem.loads) or (isinstance(scene, dict) and scene.get("loads")):
        raise ValueError(
            "balances are those of a rod without loads; got a run with some: run.work and run.dissipated balance the energy"
        )
    frames, nodes = run.x.shape
    if frames < 3 or nodes <= DEGREE:
        raise ValueError(f"balances need at least 3 frames and {DEGREE + 1} nodes; got {frames} and {nodes}")

    period, advance = rod.length if closed else None, np.asarray(shift)[:, None, None] / rod.length

    def along(values: Float, order: int = 1) -> Float:
        return _spline(run.s, values, period).derivative(order)(run.s)

    def in_time(values: Float) -> Float:
        return np.gradient(values, run.t, axis=-2, edge_order=2)

    r, theta1, omega = np.stack([run.x, run.y]), along(run.theta), run.omega
    chord = advance * run.s  # r - chord is periodic
    r1, r2, r3, r4 = (along(r - chord, order) for order in (1, 2, 3, 4))
    r1 += advance
    there = rod.at(run.s)
    rho, alpha, radius = there.density, there.spin_inertia, there.radius
    beta, bend = there.torsion_stiffness, there.bending_stiffness
    rho1, alpha1, beta1, bend1 = (along(c) if c.ndim else 0.0 for c in (rho, alpha, beta, bend))
    bend2 = along(bend, 2) if bend.ndim else 0.0
    moment1, moment2 = bend * r3 + bend1 * r2, bend * r4 + 2 * bend1 * r3 + bend2 * r2  # (K r'')', (K r'')''
    if rolling is None:
        rod.uniform("balances of the free rod")
        if run.x_rate is None or run.y_rate is None or run.tension is None:
            raise ValueError("rolling=None needs a motion of the free rod, with x_rate, y_rate and tension")
        v, p = np.stack([run.x_rate, run.y_rate]), _at_nodes(run.s, run.tension, period)
        e = force = np.zeros_like(r)
    else:
        law = ROLLING[checks.choice("rolling", rolling, ROLLING)]
        e, p = law.arm(radius, r1) * _turned(r1), np.zeros_like(omega)
        v = e * omega
        e_rate = radius * _turned(law.rate(r1, along(v)))
        own = run.contact_force if run.problem is None else None  # of a field: per length
        torque = beta * along(run.theta, 2) + beta1 * theta1 - _dot(e, moment2) - rho * omega * _dot(e, e_rate)
        force = rho * (e * torque / (alpha + rho * _dot(e, e)) + e_rate * omega) + moment2 if own is None else own.swapaxes(0, 1)
    n = p * r1 - moment1
    kinetic, elastic = rho * _dot(v, v) + alpha * omega**2, bend * _dot(r2, r2) + beta * theta1**2
    energy, material = 0.5 * (kinetic + elastic), rho * _dot(v, r1) + alpha * omega * theta1
    uneven = 0.5 * (bend1 * _dot(r2, r2) + beta1 * theta1**2 - rho1 * _dot(v, v) - alpha1 * omega**2)
    ones, none = np.ones_like(omega), np.zeros_like(omega)
    laws = {
        "energy": (in_time(r), in_time(run.theta), energy, -(_dot(n, v) + bend * _dot(r2, along(v)) + beta * theta1 * omega)),
        "momentum_x": ((ones, none), none, rho * v[0], -n[0]),
        "momentum_y": ((none, ones), none, rho * v[1], -n[1]),
        "theta_momentum": ((none, none), ones, alpha * omega, -beta * theta1),
        "angular_momentum": (_turned(r), none, rho * _cross(r, v), -_cross(r, n) - bend * _cross(r1, r2)),
        "material_momentum": (r1, theta1, material, _dot(r1, moment1) - p - energy),
    }
    found = {}
    for name, (move, turn, density, flux) in laws.items():
        slip = np.zeros_like(r) if rolling is None else np.asarray(move) - e * turn
        source = _dot(force, slip) + (uneven if name == "material_momentum" else 0.0)
        if name == "angular_momentum" and closed:  # r x n is not periodic if r advances
            flux_s = along(flux + _cross(chord, n)) - _cross(advance, n) - _cross(chord, along(n))
        else:
            flux_s = along(flux)
        unforced = (in_time(density) + flux_s)[1:-1]
        found[name] = Balance(density, flux, source, np.hypot(*slip), unforced - source[1:-1], unforced)
    return found


def noether(found: dict[str, Balance]) -> dict[str, float]:
    """The largest violation of Noether's condition along a motion, by law. A law without violation is a conservation law."""
    return {name: float(law.violation.max()) for name, law in found.items()}


def _dot(a: Float, b: Float) -> Float:
    product: Float = (a * b).sum(axis=0)
    return product


def _cross(a: Float, b: Float) -> Float:
    product: Float = a[0] * b[1] - a[1] * b[0]
    return product


def _turned(a: Float) -> Float:
    """J a, turned by +90 degrees."""
    return np.stack([-a[1], a[0]])


def _spline(s: Float, values: Float, period: float | None) -> Spline:
    """Spline of degree 7 through values (..., N), periodic if a period is given."""
    ends = None
    if period is not None:
        s, values, ends = np.append(s, s[0] + period), np.concatenate([values, values[..., :1]], axis=-1), "periodic"
    spline: Spline = make_interp_spline(s, values, DEGREE, bc_type=ends, axis=-1)
    return spline


def _at_nodes(s: Float, tension: Float, period: float | None) -> Float:
    """Tension of links, interpolated at the nodes, (F, N); it is zero at free ends."""
    middle = s[: tension.shape[1]] + s[1] / 2
    if period is not None:
        return _spline(middle, tension, period)(s)
    return _spline(np.concatenate([s[:1], middle, s[-1:]]), np.pad(tension, ((0, 0), (1, 1))), None)(s)
