r"""Two mechanics of one constraint: Lagrange-d'Alembert (nonholonomic) and vakonomic, from the same initial data.

L = q.^T M q./2 - V(q), constraints A(q) q. = 0, c of them: a `MechanicalSystem` of m coordinates, written here for constant M. The
paper's introduction contrasts the two.

Nonholonomic: the ground's force does no work on any admissible displacement, so it is A^T lambda,

    M q.. = -grad V + A^T lambda,   A q.. + A. q. = 0.

Vakonomic (variational axiomatic kind; Kozlov 1983): the curve is an extremal of the action among the curves that keep the
constraint, hence a free one of the action of L + mu.A(q) q. with multipliers mu(t). The Euler-Lagrange equations
d/dt (M q. + A^T mu) = -grad V + d/dq (mu.A q.) are

    M q.. = -grad V - A^T mu. + G(q, q.) mu,   (G mu)_j = sum_{a,k} mu_a (dA_ak/dq_j - dA_aj/dq_k) q._k,

that is G mu = -sum_a mu_a i_q. dA^a. So a vakonomic system is the nonholonomic one (lambda = -mu.) in magnetic fields dA^a, with
charges mu_a that obey mu. = -lambda. The two agree where G mu does no work on admissible displacements: always if the constraint is
integrable (dA^a = 0), seldom if it is not. The field does no work on the motion itself, q. . G mu = 0, so both conserve the energy.
(A q. = b(t, q) adds -mu.b to the action, and the force -b_q^T mu.)

Initial data: q(0), admissible q.(0), and, for the vakonomic motion only, mu(0), c numbers that no law of mechanics determines. With
mu(0) = 0, or any that `agreeing_multipliers` spans, the initial accelerations agree.

One disc, r. = e theta., e = R J d_1, d_1 = (cos phi, sin phi), F = -dV/dr: put p = m r. + mu, the momentum of r. Then p. = F, and
as r. has no part along d_1, the only charge that acts is mu.d_1 = p.d_1:

    (I + m R^2) theta.. = F_theta + e.F - R (p.d_1) phi.,   J phi.. = F_phi + R (p.d_1) theta.,   p. = F.

With p = 0 (mu(0) = -m r.) the free disc rolls the same way in both mechanics, for all time (Fernandez and Bloch, J. Phys. A 41,
2008, 344005). A force changes p, and the motions separate: like t^2 for a general mu(0), like t^3 if the accelerations agree. Discs
in a `SteeredChain` obey the same equations, each with its own p.

`MechanicalSystem.accelerations` and `integrate` take mu and are meant for a few discs. `discs.simulate` is for many discs, and
nonholonomic only.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import null_space

from discs import checks
from discs.arrays import Float
from discs.mechanics import MechanicalSystem, Trajectory
from discs.mechanics.bodies import Bodies
from discs.mechanics.lagrange import frames, lagrange_dalembert
from discs.mechanics.saddle import dense
from discs.mechanics.sizes import units
from discs.problem import Problem

FLAT = 1e-9  # relative to the terms of G mu: a weaker field counts as zero


def solve(
    system: MechanicalSystem,
    q: ArrayLike,
    v: ArrayLike,
    times: ArrayLike,
    mu: ArrayLike | None = None,
    tol: float = 1e-11,
    **options: Any,
) -> Trajectory:
    """The motion from q, v at times[0]: nonholonomic without mu, vakonomic with the initial multipliers mu.

    Parameters
    ----------
    system, q, v, times, mu : as for `MechanicalSystem.integrate`, which this calls.
    tol : its rtol. A q. = 0 is an invariant of the equations.
    options : its `method`, `atol`, `progress`.
    """
    return system.integrate(q, v, times, tol, mu, **options)


def agreeing_multipliers(system: MechanicalSystem, q: ArrayLike, v: ArrayLike) -> Float:
    """Basis (c, d) of the mu(0) for which both mechanics give the same acceleration at q, v: N^T G mu = 0.

    N spans the admissible displacements, the null space of A. For a disc that turns or rolls, d = 1 of c = 2: the mu across its
    axle.
    """
    q, v = (checks.vector(name, given, len(system.names)) for name, given in (("q", q), ("v", v)))
    if not system.owners:
        return np.zeros((0, 0))
    unit = units(system, q)  # of coordinates of mass 1, so that units do not matter
    a = dense(system.constraint(q)) * unit
    norms = np.linalg.norm(a, axis=1)
    field = system.magnetic(q, v) * unit[:, None] / norms
    # G is the difference of two terms; one of them, A. of the directions of mass 1, sets what counts as 0
    slopes = [dense(system.constraint_rate(q, unit * e)) * unit / norms[:, None] for e in np.eye(len(q))]
    size = float(np.max([np.abs(s).max() for s in slopes])) * float(np.linalg.norm(v / unit))
    across = null_space(a).T @ field
    _, sizes, directions = np.linalg.svd(across)
    rank = int((sizes > FLAT * size).sum())
    return np.linalg.qr(directions[rank:].T / norms[:, None])[0]


def rolling_disc(
    *,
    mass: float,
    spin_inertia: float,
    heading_inertia: float,
    radius: float,
    pull: tuple[float, float] = (0.0, 0.0),
    spring: float = 0.0,
) -> MechanicalSystem:
    """One vertical disc, q = (x, y, theta, phi), that rolls: x. = -R theta. sin phi, y. = R theta. cos phi.

    V = -pull.r + spring |r|**2/2.

    Parameters
    ----------
    mass, spin_inertia, heading_inertia : m, I about the axle, J about the vertical; > 0.
    radius : R > 0.
    pull : constant force, for example that of an incline of angle gamma: m g sin(gamma) down the slope.
    spring : stiffness of a spring to the origin, force per length.

    Raises
    ------
    ValueError : for a parameter outside its range.
    """
    names = ("mass", "spin_inertia", "heading_inertia", "radius")
    given = zip(names, (mass, spin_inertia, heading_inertia, radius), strict=True)
    m, spin, turn, radius = (checks.number(name, value, positive=True) for name, value in given)
    force, spring = checks.field("pull", pull, 2), checks.number("spring", spring)

    inertia = np.diag([m, m, spin, turn])

    def constraint(q: Float) -> Float:
        cos, sin = np.cos(q[3]), np.sin(q[3])
        return np.array([[1.0, 0.0, radius * sin, 0.0], [0.0, 1.0, -radius * cos, 0.0]])

    def constraint_rate(q: Float, v: Float) -> Float:
        rate = np.zeros((2, 4))
        rate[:, 2] = radius * np.cos(q[3]) * v[3], radius * np.sin(q[3]) * v[3]
        return rate

    return MechanicalSystem(
        ("x", "y", "theta", "phi"),
        ("disc", "disc"),
        lambda q: inertia,
        lambda q: float(0.5 * spring * q[:2] @ q[:2] - force @ q[:2]),
        lambda q, v: np.array([*(force - spring * q[:2]), 0.0, 0.0]),
        constraint,
        constraint_rate,
        np.zeros(2),
        bodies=Bodies(lambda q: q, radius),
    )


def of_chain(problem: Problem) -> tuple[MechanicalSystem, Float, Float]:
    """A `Chain` or `SteeredChain` of a few discs with its initial q, v (rows*N,), in the order of `lagrange_dalembert`."""
    return lagrange_dalembert(problem, dense=True), *frames(problem)
