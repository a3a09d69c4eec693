r"""Two mechanics of one constraint: Lagrange-d'Alembert (nonholonomic) and vakonomic, from the same initial data.

L = q.^T M q./2 - V(q) with constant M, constraints A(q) q. = 0, m of them. The paper's introduction contrasts the two.

Nonholonomic: the ground's force does no work on any admissible displacement, so it is A^T lambda,

    M q.. = -grad V + A^T lambda,   A q.. + A. q. = 0.

Vakonomic (variational axiomatic kind; Kozlov 1983): the curve is an extremal of the action among the curves that keep the
constraint, hence a free one of the action of L + mu.A(q) q. with multipliers mu(t). The Euler-Lagrange equations
d/dt (M q. + A^T mu) = -grad V + d/dq (mu.A q.) are

    M q.. = -grad V - A^T mu. + G(q, q.) mu,   (G mu)_j = sum_{a,k} mu_a (dA_ak/dq_j - dA_aj/dq_k) q._k,

that is G mu = -sum_a mu_a i_q. dA^a. So a vakonomic system is the nonholonomic one (lambda = -mu.) in magnetic fields dA^a, with
charges mu_a that follow the ground's force, mu. = -lambda. The two agree where G mu does no work on admissible displacements:
always if the constraint is integrable (dA^a = 0), seldom if it is not. The field does no work on the motion itself,
q. . G mu = 0, so both conserve the energy.

Initial data: q(0), admissible q.(0), and, for the vakonomic motion only, mu(0), m numbers that no law of mechanics gives. With
mu(0) = 0, or any that `agreeing_multipliers` spans, the initial accelerations agree.

One disc, r. = e theta., e = R J d_1, d_1 = (cos phi, sin phi), F = -dV/dr: put p = m r. + mu, the momentum of r. Then p. = F, and
as r. has no part along d_1, the only charge that acts is mu.d_1 = p.d_1:

    (I + m R^2) theta.. = F_theta + e.F - R (p.d_1) phi.,   J phi.. = F_phi + R (p.d_1) theta.,   p. = F.

With p = 0 (mu(0) = -m r.) the free disc rolls the same way in both mechanics, for all time (Fernandez and Bloch, J. Phys. A 41,
2008, 344005). A force makes p, and they part: by t^2 for a general mu(0), by t^3 where the accelerations agree. Discs in a
`SteeredChain` obey the same equations, each with its own p.

These are dense equations for a few discs; `discs.simulate` is for many.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import null_space

from discs import checks
from discs.problem import Problem


@dataclass(frozen=True, eq=False)
class ConstrainedSystem:
    """L = q.^T M q./2 - V(q) with m constraints A(q) q. = 0 on n coordinates.

    Attributes
    ----------
    mass : M, (n, n), constant.
    constraint : q (n,) -> A, (m, n), of full rank.
    derivative : q (n,) -> (m, n, n), entry [a, k, j] = dA_ak/dq_j.
    potential : q (n,) -> V.
    gradient : q (n,) -> grad V, (n,).
    """

    mass: NDArray
    constraint: Callable[[NDArray], NDArray]
    derivative: Callable[[NDArray], NDArray]
    potential: Callable[[NDArray], float]
    gradient: Callable[[NDArray], NDArray]

    def energy(self, q: NDArray, v: NDArray) -> float:
        """Kinetic and potential energy."""
        return 0.5 * float(v @ self.mass @ v) + self.potential(q)

    def magnetic(self, q: NDArray, v: NDArray) -> NDArray:
        """G of the vakonomic equations, (n, m)."""
        return _magnetic(self.derivative(q), v)

    def accelerations(self, q: NDArray, v: NDArray, mu: NDArray | None = None) -> tuple[NDArray, NDArray]:
        """q.., (n,), and lambda, (m,); nonholonomic without mu, vakonomic with mu (m,), where mu. = -lambda.

        From the saddle point

            [M  -A^T] [q..   ]   [-grad V + G mu]
            [A   0  ] [lambda] = [-A. q.        ].
        """
        a, d = self.constraint(q), self.derivative(q)
        m, n = a.shape
        saddle, known = np.zeros((n + m, n + m)), np.empty(n + m)
        saddle[:n, :n], saddle[:n, n:], saddle[n:, :n] = self.mass, -a.T, a
        known[:n], known[n:] = -self.gradient(q), -(d @ v) @ v
        if mu is not None:
            known[:n] += _magnetic(d, v) @ mu
        found = np.linalg.solve(saddle, known)
        return found[:n], found[n:]


def _magnetic(d: NDArray, v: NDArray) -> NDArray:
    return (v @ d - d @ v).T


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion at F times.

    Attributes
    ----------
    t : (F,), times.
    q, v : (F, n), coordinates and their rates.
    ground_force : (F, m), lambda, the force of the constraints.
    mu : (F, m), multipliers of a vakonomic motion, mass times length per time for a rolling disc; None if it is nonholonomic.
    energy : (F,), kinetic and potential energy.
    """

    t: NDArray
    q: NDArray
    v: NDArray
    ground_force: NDArray
    mu: NDArray | None
    energy: NDArray


def solve(
    system: ConstrainedSystem, q: ArrayLike, v: ArrayLike, times: ArrayLike, mu: ArrayLike | None = None, tol: float = 1e-11
) -> Motion:
    """The motion from q, v at times[0]: nonholonomic without mu, vakonomic with the initial multipliers mu.

    Parameters
    ----------
    system : the mechanical system.
    q, v : (n,), initial coordinates and rates; A(q) v = 0.
    times : (F,), increasing, the first is that of the initial data.
    mu : (m,), initial multipliers.
    tol : relative and absolute tolerance of the Runge-Kutta method (DOP853). A q. = 0 is an invariant of the equations, kept to
        about this.

    Raises
    ------
    ValueError : for arrays of a wrong shape, times that do not increase, or v that the constraint forbids.
    RuntimeError : if the solution cannot be continued.
    """
    n = len(system.mass)
    q, v = checks.field("q", q, n), checks.field("v", v, n)
    a = system.constraint(q)
    m = len(a)
    slip = np.abs(a @ v).max()
    if slip > 1e-9 * max(1.0, float(np.abs(v).max())):
        raise ValueError(f"v must satisfy the constraint A(q) v = 0; got A v up to {slip:.2g}")
    times = np.asarray(times, dtype=float)
    if times.ndim != 1 or times.size < 2 or not (np.diff(times) > 0).all():
        raise ValueError(f"times must be at least two, increasing; got {times!r}")
    start = [q, v] if mu is None else [q, v, checks.field("mu", mu, m)]

    def rate(_: float, z: NDArray) -> NDArray:
        q, v, mu = np.split(z, [n, 2 * n])
        acceleration, force = system.accelerations(q, v, mu if mu.size else None)
        return np.concatenate([v, acceleration, -force[: mu.size]])

    checks.number("tol", tol, positive=True)
    run = solve_ivp(rate, (times[0], times[-1]), np.concatenate(start), "DOP853", times, rtol=tol, atol=tol)
    if not run.success:
        raise RuntimeError(f"the motion cannot be continued beyond t = {run.t[-1]:g}: {run.message}")
    qs, vs, mus = np.split(run.y.T, [n, 2 * n], axis=1)
    charges = [None] * len(times) if mu is None else list(mus)
    force = np.array([system.accelerations(*z)[1] for z in zip(qs, vs, charges, strict=True)])
    energy = np.array([system.energy(*z) for z in zip(qs, vs, strict=True)])
    return Motion(times, qs, vs, force, None if mu is None else mus, energy)


def agreeing_multipliers(system: ConstrainedSystem, q: ArrayLike, v: ArrayLike) -> NDArray:
    """Basis (m, d) of the mu(0) with which the vakonomic acceleration at q, v is the nonholonomic one: N^T G mu = 0.

    N spans the admissible displacements, the null space of A. For a disc that turns or rolls, d = 1 of m = 2: the mu across its
    axle.
    """
    q, v = (checks.field(name, value, len(system.mass)) for name, value in (("q", q), ("v", v)))
    return null_space(null_space(system.constraint(q)).T @ system.magnetic(q, v))


def rolling_disc(
    *,
    mass: float,
    spin_inertia: float,
    heading_inertia: float,
    radius: float,
    pull: tuple[float, float] = (0.0, 0.0),
    spring: float = 0.0,
) -> ConstrainedSystem:
    """One vertical disc, q = (x, y, theta, phi), that rolls: x. = -R theta. sin phi, y. = R theta. cos phi.

    V = -pull.r + spring |r|**2/2.

    Parameters
    ----------
    mass, spin_inertia, heading_inertia : m, I about the axle, J about the vertical; > 0.
    radius : R > 0.
    pull : constant force, as an incline of slope angle gamma gives: m g sin(gamma) down the slope.
    spring : stiffness of a spring to the origin, force per length.

    Raises
    ------
    ValueError : for a parameter outside its range.
    """
    names = ("mass", "spin_inertia", "heading_inertia", "radius")
    given = zip(names, (mass, spin_inertia, heading_inertia, radius), strict=True)
    m, spin, turn, radius = (checks.number(name, value, positive=True) for name, value in given)
    force, spring = checks.field("pull", pull, 2), checks.number("spring", spring)

    def constraint(q: NDArray) -> NDArray:
        cos, sin = np.cos(q[3]), np.sin(q[3])
        return np.array([[1.0, 0.0, radius * sin, 0.0], [0.0, 1.0, -radius * cos, 0.0]])

    def derivative(q: NDArray) -> NDArray:
        d = np.zeros((2, 4, 4))
        d[:, 2, 3] = radius * np.cos(q[3]), radius * np.sin(q[3])
        return d

    def potential(q: NDArray) -> float:
        return float(0.5 * spring * q[:2] @ q[:2] - force @ q[:2])

    def gradient(q: NDArray) -> NDArray:
        return np.array([*(spring * q[:2] - force), 0.0, 0.0])

    return ConstrainedSystem(np.diag([m, m, spin, turn]), constraint, derivative, potential, gradient)


def of_chain(problem: Problem) -> tuple[ConstrainedSystem, NDArray, NDArray]:
    """A `Chain` or `SteeredChain` of a few discs with its initial q, v (rows*N,): x of all discs, then y, theta (and phi).

    The constraints are r.x - e_x theta. = 0 of all discs, then those of y, m = 2 N.
    """
    system, start = problem.system, problem.start()
    n, size = system.n, start.hi.size
    units = np.eye(size).reshape(size, *start.hi.shape)
    rolls, discs = np.arange(2 * n), 2 * n + np.tile(np.arange(n), 2)  # a constraint and the place of its theta

    def shape(q: NDArray) -> NDArray:
        return system.shape(q.reshape(start.hi.shape))

    def constraint(q: NDArray) -> NDArray:
        a = np.eye(2 * n, size)
        a[rolls, discs] = -system.contact(shape(q)).ravel()
        return a

    def derivative(q: NDArray) -> NDArray:
        d, at = np.zeros((2 * n, size, size)), shape(q)
        d[rolls, discs] = -np.array([system.contact_rate(at, unit).ravel() for unit in units]).T
        return d

    def potential(q: NDArray) -> float:
        return system.potential(shape(q))

    def gradient(q: NDArray) -> NDArray:
        return system.gradient(shape(q)).ravel()

    whole = ConstrainedSystem(np.diag(system.weights.ravel()), constraint, derivative, potential, gradient)
    return whole, start.hi.ravel(), system.forward(system.frame(shape(start.hi.ravel())), start.pi).ravel()
