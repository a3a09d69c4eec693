r"""The Lagrange-d'Alembert equations with multipliers, in textbook form.

A mechanical system with L = v.M(q)v/2 - V(q), v = q., and further forces Q(t, q, v) moves under constraints A(q) v = b(t, q): b = 0
for rolling, a constant b for a motor, b(t, q) for a drive (affine, and rheonomic where b depends on t). Virtual displacements are
those at a fixed time, A dq = 0. The constraint forces do no work on them, so they have the form A^T lambda, and

    M v. = f + Q + A^T lambda,   f = dL/dq - M. v,   A v. = g,   g = db/dt - A. v = b_t + b_q v - A. v.

The second equation is the constraint, differentiated along the motion: d/dt (A v) = A v. + A. v with A. = dA/dq.v. Together they
are the saddle point

    [ M  A^T ] (  v.    )   ( f + Q )
    [ A   0  ] ( -lambda) = (   g   ).

The energy E = v.Mv/2 + V changes only by the power of the forces and of the constraints' reaction, since f keeps E:

    E. = v.Q + v.A^T lambda = v.Q + lambda.b.

Constraints phi(q, v) = b that are not linear in v are differentiated likewise, phi_v v. + phi_q v = db/dt. By Chetaev's rule
virtual displacements are those with phi_v dq = 0, so that the reaction is phi_v^T lambda: the same saddle point with A = phi_v and
g = db/dt - phi_q v. The rule is an assumption (N. G. Chetaev 1932), which d'Alembert's principle contains for linear constraints
only; other devices may realise the same phi with another reaction. The reaction's power lambda.(phi_v v) is 0 if phi is homogeneous
in v and b = 0, by Euler's theorem.

For discs a constraint is r. - e theta. = 0, two rows for each disc: lambda is the ground's force, and -e.lambda its torque about
the axle. M is diagonal and a disc's rows of A involve only its own velocities, so the sparse matrix is block diagonal up to its
order and is solved in O(n).

The reduced form has no multipliers. With the columns of B spanning the kernel of A and some w with A w = g,

    v. = w + B u,   B^T M B u = B^T (f + Q - M w),   lambda = (A A^T)^{-1} A (M v. - f - Q).

The skew-gradient form of `discs.chains.rolling_discs` takes the B with B^T M B = 1. All three forms are equivalent.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float, Matrix
from discs.mechanics import saddle
from discs.mechanics.bodies import Bodies
from discs.mechanics.derivatives import Formula
from discs.mechanics.inputs import Given, as_given, function_of
from discs.mechanics.saddle import dense


class Response(NamedTuple):
    """The answer of a system to its forces at one moment.

    acceleration : (m,), of the coordinates. multipliers : lambda (c,); the forces of constraint are A^T lambda.
    """

    acceleration: Float
    multipliers: Float


@dataclass(frozen=True, eq=False)
class Equations:
    """M, V, f, A and b of a mechanical system, and what follows from them at given q and v; m coordinates, c constraints.

    Attributes
    ----------
    names : (m,), names of the coordinates.
    owners : (c,), the owner of each constraint in messages, as "disc 3".
    mass : q -> M, (m, m), an array or a sparse one; positive definite on the kernel of A.
    potential : q -> V.
    force : q, v -> f, (m,), the forces of L.
    constraint : q -> A, (c, m).
    constraint_rate : q, v -> A. = dA/dq.v, (c, m).
    drive : b, (c,), or a function t, q -> b.
    symmetry : q -> X, (m, g): velocities of g one-parameter groups that leave L invariant, affine in q; None if none are known.
    formulas : M(q), V(q), A(q) of `from_lagrangian`; `how` and `error` describe their derivatives.
    applied : t, q, v -> Q, (m,), forces beside those of L; None for none.
    phi : q, v -> phi, (c,), of constraints phi(q, v) = b that are not linear in v; then there is no A(q).
    bodies : where its discs are, for pictures: `Bodies`, or a function q -> (x, y, theta, phi); None if it has no discs.
    """

    names: tuple[str, ...]
    owners: tuple[str, ...]
    mass: Callable[[Float], Matrix]
    potential: Callable[[Float], float]
    force: Callable[[Float, Float], Float]
    constraint: Callable[[Float], Matrix]
    constraint_rate: Callable[[Float, Float], Matrix]
    drive: Float | Callable[[float, Float], Any]
    symmetry: Callable[[Float], Float] | None = None
    formulas: tuple[Formula, ...] = ()
    applied: Callable[[float, Float, Float], Any] | None = None
    phi: Callable[[Float, Float], Any] | None = None
    bodies: Bodies | Callable[[Float], Any] | None = None

    def __post_init__(self) -> None:
        names, owners = names_of("names", self.names), names_of("owners", self.owners)
        m, c = len(names), len(owners)
        function_of("q, v", "force", self.force)
        parts: dict[str, Any] = {"names": names, "owners": owners}
        parts["drive"] = as_given("t, q", "b", self.drive, c, m) if callable(self.drive) else checks.field("drive", self.drive, c)
        if self.applied is not None:
            parts["applied"] = as_given("t, q, v", "f", self.applied, m, m)
        if self.phi is not None:
            parts |= {"phi": as_given("q, v", "phi", self.phi, c, m), "constraint": _not_linear, "constraint_rate": _not_linear}
        if callable(self.bodies):
            parts["bodies"] = Bodies(self.bodies)
        for name, value in parts.items():
            object.__setattr__(self, name, value)

    @property
    def timed(self) -> bool:
        """Whether forces or drives are functions of t."""
        return self.applied is not None or callable(self.drive)

    @property
    def worked(self) -> bool:
        """Whether something besides the forces of L may do work: applied forces, a drive, or constraints phi."""
        return self.timed or self.phi is not None or (not callable(self.drive) and bool(self.drive.any()))

    @property
    def derived(self) -> tuple[Formula, ...]:
        """All formulas of which derivatives are taken."""
        return (*self.formulas, *(g.formula for g in (self.drive, self.phi) if isinstance(g, Given)))

    def rows(self, q: Float, v: Float) -> Matrix:
        """The rows A of the saddle point, (c, m): A(q), or d phi/dv."""
        if isinstance(self.phi, Given):
            return self.phi.slopes(q, v)[:, len(q) :]
        return self.constraint(q)

    def level(self, q: Float, t: float | None) -> Float:
        """b, (c,)."""
        return self.drive(self._moment(t), q) if callable(self.drive) else self.drive

    def saddle_point(self, q: Float) -> Matrix:
        """The matrix [[M, A^T], [A, 0]], (m + c, m + c), sparse if A is."""
        return saddle.matrix(self.mass(q), self.constraint(q))

    def _rows_and_rate(self, q: Float, v: Float, t: float) -> tuple[Matrix, Float]:
        """A and the right side g of A v. = g."""
        if isinstance(self.phi, Given):
            slopes = self.phi.slopes(q, v)
            rows, g = slopes[:, len(q) :], -(slopes[:, : len(q)] @ v)
        else:
            rows, g = self.constraint(q), -(self.constraint_rate(q, v) @ v)
        if isinstance(self.drive, Given):
            self.drive(t, q)  # an error, if it is not finite: a derivative by the complex step may hide this
            g = g + self.drive.along((t, q), (1.0, v))
        return rows, g

    def magnetic(self, q: ArrayLike, v: ArrayLike) -> Float:
        """G of the vakonomic equations, (m, c): (G mu)_j = sum_{a,k} mu_a (dA_ak/dq_j - dA_aj/dq_k) v_k; see
        `discs.mechanics.vakonomic`."""
        q, v = self._vectors(q, v)
        slopes = (self.constraint_rate(q, unit) for unit in np.eye(len(q)))
        d = np.stack([dense(a) for a in slopes], axis=-1)  # dA_ak/dq_j
        return (v @ d - d @ v).T

    def accelerations(self, q: ArrayLike, v: ArrayLike, mu: ArrayLike | None = None, t: float | None = None) -> Response:
        """Accelerations and multipliers from the saddle point, sparse; nonholonomic without mu, vakonomic with mu.

        Parameters
        ----------
        q, v : (m,), coordinates and velocities; v obeys the constraints.
        mu : (c,), charges, where mu. = -lambda.
        t : time; needed if forces or drives depend on it.

        Raises
        ------
        ValueError : if constraints are redundant or contradict each other, with their owners, or inertia is missing; if forces or
            drives are not finite numbers of the right number, with t.
        """
        return self.response(q, v, mu, t)[0]

    def response(self, q: ArrayLike, v: ArrayLike, mu: ArrayLike | None, t: float | None) -> tuple[Response, Float]:
        """`accelerations`, and the powers of the applied forces, v.Q, and of the constraints' reaction, (2,)."""
        q, v = self._vectors(q, v)
        t = self._moment(t)
        f, power = self.force(q, v), np.zeros(2)
        if self.applied is not None:
            push = self.applied(t, q, v)
            f, power[0] = f + push, v @ push
        if mu is not None:
            charged = self._charged(q, v, checks.vector("mu", mu, len(self.owners)), t)
            f, power[1] = f + charged, v @ charged
        rows, g = self._rows_and_rate(q, v, t)
        found = Response(*saddle.solve(self.mass(q), rows, f, g, self.names, self.owners))
        power[1] += found.multipliers @ (rows @ v)
        return found, power

    def _charged(self, q: Float, v: Float, mu: Float, t: float) -> Float:
        """The forces on charges mu, G mu - b_q^T mu, (m,)."""
        f = self.magnetic(q, v) @ mu
        return f - mu @ self.drive.slopes(t, q)[:, 1:] if isinstance(self.drive, Given) else f

    def consistent_velocity(self, q: ArrayLike, v: ArrayLike, t: float | None = None) -> Float:
        """The velocity u nearest to v that the constraints allow: A u = b and (u - v).M(u - v) least, (m,).

        Then M (u - v) = A^T mu: an impulse of the constraint forces changes v to u. For phi(q, u) = b that is repeated with A =
        d phi/dv at the last u, Newton's method along M^-1 A^T; u is the nearest velocity up to terms of second order in u - v.

        Raises
        ------
        ValueError : also if Newton's method finds no such u.
        """
        q, v = self._vectors(q, v)
        mass, b, u = self.mass(q), self.level(q, t), v
        for _ in range(1 if self.phi is None else 50):
            rows = self.rows(q, u)
            level = b if self.phi is None else b - self.phi(q, u) + rows @ u
            before, u = u, saddle.solve(mass, rows, mass @ u, level, self.names, self.owners)[0]
            if self.phi is None or _square(mass, u - before) <= 1e-24 * _square(mass, u):
                return u
        raise ValueError(f"no velocity near v = {v} was found that obeys the constraints at q = {q}; start from another v")

    def reduced(self, q: ArrayLike, v: ArrayLike, t: float | None = None) -> Response:
        """The same accelerations and multipliers from the reduced form, dense: for small systems and for teaching."""
        q, v = self._vectors(q, v)
        t = self._moment(t)
        m, f = dense(self.mass(q)), self.force(q, v)
        f = f if self.applied is None else f + self.applied(t, q, v)
        rows, right = self._rows_and_rate(q, v, t)
        a = dense(rows)
        saddle.check(m, a, f, right, self.names, self.owners)
        if saddle.rank(a) < len(a):
            saddle.explain(m, a, right, self.names, self.owners)
        d, r = np.split(saddle.scales(m, a), [len(f)])  # coordinates near mass 1, rows near norm 1
        m, a, f, right = m * d * d[:, None], a * d * r[:, None], f * d, right * r
        square = a @ a.T
        w = a.T @ np.linalg.solve(square, right)
        b = scipy.linalg.null_space(a) if len(a) else np.eye(len(f))
        acceleration = w + b @ np.linalg.solve(b.T @ m @ b, b.T @ (f - m @ w))
        return Response(d * acceleration, r * np.linalg.solve(square, a @ (m @ acceleration - f)))

    def residual(self, q: ArrayLike, v: ArrayLike, t: float | None = None) -> Float:
        """A v - b, or phi - b, (c,)."""
        q, v = self._vectors(q, v)
        held = self.constraint(q) @ v if self.phi is None else self.phi(q, v)
        return np.asarray(held - self.level(q, t))

    def momentum(self, q: ArrayLike, v: ArrayLike) -> Float:
        """p = M v, (m,)."""
        q, v = self._vectors(q, v)
        return np.asarray(self.mass(q) @ v)

    def energy(self, q: ArrayLike, v: ArrayLike) -> float:
        """v.Mv/2 + V; its rate is v.Q + lambda.b."""
        q, v = self._vectors(q, v)
        return 0.5 * float(v @ (self.mass(q) @ v)) + self.potential(q)

    def _vectors(self, q: ArrayLike, v: ArrayLike) -> tuple[Float, Float]:
        return tuple(checks.vector(name, given, len(self.names)) for name, given in (("q", q), ("v", v)))  # type: ignore[return-value]

    def _moment(self, t: float | None) -> float:
        """The time, which may be left out where nothing depends on it."""
        if t is None and self.timed:
            raise ValueError("forces or drives of this system depend on time: give t")
        return 0.0 if t is None else checks.number("t", t)


def _square(mass: Matrix, v: Float) -> float:
    """v.Mv."""
    return float(v @ (mass @ v))


def _not_linear(*state: Float) -> Matrix:
    raise ValueError("constraints phi(q, v) are not linear in v, so there is no A(q): take rows(q, v) = d phi/dv")


def names_of(what: str, given: Sequence[str]) -> tuple[str, ...]:
    """Names as a tuple; a string is one name."""
    return checks.several(what, given, "names")
