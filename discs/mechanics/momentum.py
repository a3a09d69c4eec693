r"""Symmetry and momentum: Noether's theorem under the rolling constraint.

Let xi_Q(q) = X(q) xi, with xi in a vector space g, be the velocities of a group that leaves L invariant: motions of the plane, and
an equal roll of all discs that torsion springs join. For any xi, constant or not, p = M v satisfies

    d/dt <p, xi_Q> = <A^T lambda + Q, xi_Q> + <p, (d xi/dt)_Q>,

because L is invariant along xi_Q and the only other forces are the ground's and applied forces Q, if there are any (Q = 0 below).
For constant xi this is the balance of momentum, of moment of momentum and of spin (`symmetry_momenta`).

The ground does no work along directions that obey the constraints, A xi_Q = 0. The symmetries among them form the kernel g^q of
A(q) X(q). For a section xi(q) in g^q, the *nonholonomic momentum map* J = <p, xi_Q> obeys the *momentum equation*, which does not
contain lambda:

    dJ/dt = <p, (d xi/dt)_Q>.

J is conserved if xi is constant (the paper's NHnoether), and otherwise only if the right side happens to vanish, as for a single
disc. The sections used here are xi_j(q) = P(q) xi_j, P the orthogonal projector of g onto g^q and xi_j a basis of g^q at the start.
With N = A X and its pseudo-inverse N+, P = 1 - N+ N, and N P = 0 gives P. = -N+ N. P - (N+ N. P)^T while the rank of N is constant.

Many discs have no such direction: N discs have 2N constraints, and g has 3 + (pieces joined by torsion springs) dimensions. One
disc has two: it can roll and turn. Two discs without torsion between them have one: both roll about the point where their axles
meet.

Source: A. M. Bloch, P. S. Krishnaprasad, J. E. Marsden, R. M. Murray, Nonholonomic mechanical systems with symmetry, Arch. Rational
Mech. Anal. 136 (1996) 21-99, section 4.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from discs.arrays import Float
from discs.mechanics import MechanicalSystem
from discs.mechanics.saddle import dense
from discs.mechanics.sizes import units

RANK = 1e-9  # singular values of N, with rows and columns of norm 1, below this count as 0


@dataclass(frozen=True, eq=False)
class Momenta:
    """Momenta along a motion, at F times.

    Attributes
    ----------
    t : (F,).
    value : (F, k), <p, xi_Q>.
    rate : (F, k), its time derivative by the momentum equation.
    section : (F, k, g), xi in the basis of `MechanicalSystem.symmetry`.
    """

    t: Float
    value: Float
    rate: Float
    section: Float

    def residual(self) -> Float:
        """value(t) - value(0) - integral of rate, (F, k): zero up to the errors of the method and of a cubic spline in t."""
        found: Float = self.value - self.value[0] - CubicSpline(self.t, self.rate).antiderivative()(self.t)
        return found


def symmetry_momenta(system: MechanicalSystem, t: ArrayLike, q: ArrayLike, v: ArrayLike) -> Momenta:
    """Momenta of all known symmetries, and their rates by the ground's forces, d/dt <p, xi_Q> = <A^T lambda, xi_Q>.

    Parameters
    ----------
    system : with a `symmetry`.
    t : (F,), times, at least 4.
    q, v : (F, m), a motion, from `MechanicalSystem.integrate` or, for a run, from `discs.mechanics.lagrange.frames`.

    Returns
    -------
    Momenta; the section is the identity, (F, g, g). For discs: momentum along x, y, moment of momentum about the origin and spin.
    """
    t, path = _motion(system, t, q, v)
    value, rate = [], []
    for time, (q_now, v_now) in zip(t, path, strict=True):
        x = _generators(system, q_now)
        reaction = system.constraint(q_now).T @ system.accelerations(q_now, v_now, t=time).multipliers
        value.append(x.T @ system.momentum(q_now, v_now))
        rate.append(x.T @ (reaction + _applied(system, time, q_now, v_now)))
    size = len(value[0])
    return Momenta(t, np.array(value), np.array(rate), np.broadcast_to(np.eye(size), (len(t), size, size)))


def nonholonomic_momenta(system: MechanicalSystem, t: ArrayLike, q: ArrayLike, v: ArrayLike) -> Momenta:
    """The nonholonomic momentum map J along a motion, and its rate <p, (d xi/dt)_Q>; parameters as of `symmetry_momenta`.

    k = dim g^q, and may be 0.

    Raises
    ------
    ValueError : if the system has no known symmetry, or dim g^q changes along the motion.
    """
    t, path = _motion(system, t, q, v)
    start = admissible_symmetries(system, path[0][0])
    value, rate, section = [], [], []
    for time, (q_now, v_now) in zip(t, path, strict=True):
        x = _generators(system, q_now)
        n = np.asarray(system.constraint(q_now) @ x)
        left, sizes, right = np.linalg.svd(n, full_matrices=False)
        rank = _rank(system, q_now, n, x)
        turning = _generators_rate(system, q_now, v_now)
        n_rate = np.asarray(system.constraint_rate(q_now, v_now) @ x + system.constraint(q_now) @ turning)
        inverse = (right[:rank].T / sizes[:rank]) @ left[:, :rank].T
        projector = np.eye(x.shape[1]) - inverse @ n
        if round(float(np.trace(projector))) != len(start):
            raise ValueError(
                f"the number of symmetries that the constraints allow must not change: {len(start)} at the start, "
                f"{round(float(np.trace(projector)))} at t = {time:g}; split the motion there"
            )
        half = inverse @ n_rate @ projector
        p = system.momentum(q_now, v_now)
        section.append(start @ projector)
        value.append(section[-1] @ (x.T @ p))
        rate.append(start @ -(half + half.T) @ (x.T @ p) + section[-1] @ (x.T @ _applied(system, time, q_now, v_now)))
    return Momenta(t, np.array(value), np.array(rate), np.array(section))


def admissible_symmetries(system: MechanicalSystem, q: ArrayLike) -> Float:
    """A basis of g^q, the symmetries xi with A xi_Q = 0 at q, (k, g)."""
    q = np.asarray(q, dtype=float)
    x = _generators(system, q)
    n = np.asarray(system.constraint(q) @ x)
    return np.linalg.svd(n)[2][_rank(system, q, n, x) :]


def _rank(system: MechanicalSystem, q: Float, n: Float, x: Float) -> int:
    """Rank of N = A X, independent of units: rows of A and columns of X have norm 1 in coordinates of mass 1."""
    unit = units(system, q)
    rows = np.linalg.norm(dense(system.constraint(q)) * unit, axis=1)
    columns = np.linalg.norm(x / np.where(unit > 0, unit, 1.0)[:, None], axis=0)
    scaled = n / np.where(rows > 0, rows, 1.0)[:, None] / np.where(columns > 0, columns, 1.0)
    return int((np.linalg.svd(scaled, compute_uv=False) > RANK).sum())


def _applied(system: MechanicalSystem, t: float, q: Float, v: Float) -> Float:
    """Q, the forces beside those of L, (m,)."""
    return np.zeros(len(q)) if system.applied is None else np.asarray(system.applied(t, q, v))


def _generators_rate(system: MechanicalSystem, q: Float, v: Float) -> Float:
    """dX/dq.v, X being affine in q."""
    return _generators(system, q + v) - _generators(system, q)


def _generators(system: MechanicalSystem, q: Float) -> Float:
    if system.symmetry is None:
        raise ValueError("momenta need a symmetry; give the system one, q -> X (m, g)")
    return system.symmetry(q)


def _motion(system: MechanicalSystem, t: ArrayLike, q: ArrayLike, v: ArrayLike) -> tuple[Float, list[tuple[Float, Float]]]:
    t, q, v = (np.asarray(given, dtype=float) for given in (t, q, v))
    shape = (t.size, len(system.names))
    if t.ndim != 1 or t.size < 4 or q.shape != shape or v.shape != shape:
        raise ValueError(
            f"a motion needs at least 4 times, and q, v of shape (times, {shape[1]}); got {t.shape}, {q.shape}, {v.shape}"
        )
    return t, list(zip(q, v, strict=True))
