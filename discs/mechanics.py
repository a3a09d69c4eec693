r"""Lagrange-d'Alembert with its multipliers, as textbooks write it.

A mechanical system with L = v.M(q)v/2 - V(q), v = q., moves under linear constraints A(q) v = b (b constant: zero for rolling). The
forces that keep them do no work on virtual displacements, those with A dq = 0; so they are A^T lambda, and

    M v. = f + A^T lambda,   f = dL/dq - M. v,   A v. = -A. v,

the second by differentiating the constraint. Both together are the saddle point

    [ M  A^T ] (  v.    )   (  f     )
    [ A   0  ] ( -lambda) = ( -A. v  ).

For discs a constraint is r. - e theta. = 0, two rows for each disc: lambda is the ground's force, and -e.lambda its torque about
the axle. M is diagonal and a disc's rows of A take its own velocities only, so the sparse matrix is as good as block diagonal and
solved in O(n).

The reduced form has no multipliers. With the columns of B spanning the kernel of A and some w with A w = -A. v,

    v. = w + B u,   B^T M B u = B^T (f - M w),   lambda = (A A^T)^{-1} A (M v. - f).

The skew-gradient form of `discs.system` takes the B with B^T M B = 1. The three are one system of equations.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike, NDArray

from discs import checks, saddle

STEP = 1e-30  # of derivatives along the imaginary axis, which have no rounding: f(q + i h v) = f(q) + i h df/dq.v + O(h^2)


class Response(NamedTuple):
    """Accelerations (m,) and multipliers lambda (c,), the forces of constraint being A^T lambda."""

    acceleration: NDArray
    multipliers: NDArray


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A motion at F times: coordinates, velocities (F, m), multipliers (F, c), energy and largest |A v - b| (F,).

    mu : (F, c), the charges of a vakonomic motion, see `discs.vakonomic`; None if it is nonholonomic.
    """

    t: NDArray
    q: NDArray
    v: NDArray
    multipliers: NDArray
    energy: NDArray
    residual: NDArray
    mu: NDArray | None = None


@dataclass(frozen=True, eq=False)
class MechanicalSystem:
    """A mechanical system with linear velocity constraints; m coordinates, c constraints.

    Make one with `discs.lagrange.lagrange_dalembert` from discs, with `from_lagrangian` from formulas, or from its parts.

    Attributes
    ----------
    names : (m,), what the coordinates are.
    owners : (c,), whose constraint each row of A is, as "disc 3".
    mass : q -> M, (m, m), an array or a sparse one; positive definite on the kernel of A.
    potential : q -> V.
    force : q, v -> f, (m,).
    constraint : q -> A, (c, m).
    constraint_rate : q, v -> A. = dA/dq.v, (c, m).
    drive : b, (c,).
    symmetry : q -> X, (m, g): velocities of g one-parameter groups that leave L as it is, affine in q; None if none are known.
    """

    names: tuple[str, ...]
    owners: tuple[str, ...]
    mass: Callable[[NDArray], Any]
    potential: Callable[[NDArray], float]
    force: Callable[[NDArray, NDArray], NDArray]
    constraint: Callable[[NDArray], Any]
    constraint_rate: Callable[[NDArray, NDArray], Any]
    drive: NDArray
    symmetry: Callable[[NDArray], NDArray] | None = None

    @classmethod
    def from_lagrangian(
        cls,
        names: Sequence[str],
        mass: Callable[[NDArray], ArrayLike] | ArrayLike,
        potential: Callable[[NDArray], Any],
        constraint: Callable[[NDArray], ArrayLike],
        owners: Sequence[str],
        drive: ArrayLike = 0.0,
        symmetry: Callable[[NDArray], ArrayLike] | None = None,
    ) -> "MechanicalSystem":
        """A system from M (or M(q)), V(q) and A(q), formulas in NumPy that also take complex numbers (no abs, no hypot).

        Derivatives are taken along the imaginary axis, exact to rounding.
        """

        def m(q: NDArray) -> NDArray:
            return np.asarray(mass(q) if callable(mass) else mass)

        def along(f: Callable[[NDArray], Any], q: NDArray, v: NDArray) -> NDArray:
            return np.imag(f(q + 1j * STEP * v)) / STEP

        def force(q: NDArray, v: NDArray) -> NDArray:
            gradient = [along(lambda z: 0.5 * v @ m(z) @ v - potential(z), q, unit) for unit in np.eye(len(q))]
            return np.array(gradient) - along(m, q, v) @ v

        def a(q: NDArray) -> NDArray:
            return np.atleast_2d(np.asarray(constraint(q)))

        shape = (len(tuple(owners)), len(tuple(names)))
        given = a(np.zeros(shape[1])).shape, m(np.zeros(shape[1])).shape
        if given != (shape, (shape[1], shape[1])):
            raise ValueError(
                f"A must be of shape {shape} and M of shape {shape[1:] * 2}, for {shape[1]} names and {shape[0]} owners; "
                f"got {given[0]} and {given[1]}"
            )
        return cls(
            tuple(names),
            tuple(owners),
            m,
            lambda q: float(potential(q)),
            force,
            a,
            lambda q, v: along(a, q, v),
            checks.field("drive", drive, len(owners)),
            None if symmetry is None else lambda q: np.asarray(symmetry(q), dtype=float),
        )

    def also(self, rows: ArrayLike, owners: Sequence[str], drive: ArrayLike = 0.0) -> "MechanicalSystem":
        """The system with more constraints, constant rows (k, m) with rows @ v = drive: a disc that is held, a motor."""
        extra = scipy.sparse.csr_array(np.atleast_2d(np.asarray(rows, dtype=float)))
        if extra.shape != (len(owners), len(self.names)):
            raise ValueError(f"rows must have shape ({len(owners)}, {len(self.names)}), one row per owner; got {extra.shape}")
        none = scipy.sparse.csr_array(extra.shape)
        return replace(
            self,
            owners=(*self.owners, *owners),
            constraint=lambda q: scipy.sparse.vstack([scipy.sparse.csr_array(self.constraint(q)), extra], format="csr"),
            constraint_rate=lambda q, v: scipy.sparse.vstack(
                [scipy.sparse.csr_array(self.constraint_rate(q, v)), none], format="csr"
            ),
            drive=np.concatenate([self.drive, checks.field("drive", drive, len(owners))]),
        )

    # The equations

    def saddle_point(self, q: NDArray) -> Any:
        """The matrix [[M, A^T], [A, 0]], (m + c, m + c), sparse if A is."""
        return saddle.matrix(self.mass(q), self.constraint(q))

    def _solve(self, q: NDArray, f: NDArray, g: NDArray) -> Response:
        """u and lambda with M u = f + A^T lambda, A u = g."""
        return Response(*saddle.solve(self.mass(q), self.constraint(q), f, g, self.names, self.owners))

    def magnetic(self, q: ArrayLike, v: ArrayLike) -> NDArray:
        """G of the vakonomic equations, (m, c): (G mu)_j = sum_{a,k} mu_a (dA_ak/dq_j - dA_aj/dq_k) v_k; see `discs.vakonomic`."""
        q, v = self._vectors(q, v)
        slopes = (self.constraint_rate(q, unit) for unit in np.eye(len(q)))
        d = np.stack([a.toarray() if hasattr(a, "toarray") else a for a in slopes], axis=-1)  # dA_ak/dq_j
        return (v @ d - d @ v).T

    def accelerations(self, q: ArrayLike, v: ArrayLike, mu: ArrayLike | None = None) -> Response:
        """Accelerations and multipliers from the saddle point, sparse; nonholonomic without mu, vakonomic with mu.

        Parameters
        ----------
        q, v : (m,), coordinates and velocities; v obeys the constraints.
        mu : (c,), charges, where mu. = -lambda.

        Raises
        ------
        ValueError : if constraints are redundant or contradict each other, naming their owners, or inertia is missing.
        """
        q, v = self._vectors(q, v)
        f = self.force(q, v)
        if mu is not None:
            f = f + self.magnetic(q, v) @ checks.vector("mu", mu, len(self.owners))
        return self._solve(q, f, -(self.constraint_rate(q, v) @ v))

    def consistent_velocity(self, q: ArrayLike, v: ArrayLike) -> NDArray:
        """The velocity u nearest to v that the constraints allow: A u = b and (u - v).M(u - v) least, (m,).

        So M (u - v) = A^T mu: it is what an impulse of the constraints' own forces makes of v.
        """
        q, v = self._vectors(q, v)
        return self._solve(q, self.mass(q) @ v, self.drive).acceleration

    def reduced(self, q: ArrayLike, v: ArrayLike) -> Response:
        """The same accelerations and multipliers from the reduced form, dense: for small systems and for teaching."""
        q, v = self._vectors(q, v)
        m, a, f = self.mass(q), scipy.sparse.csc_array(self.constraint(q)), self.force(q, v)
        square = scipy.sparse.csc_array(a @ a.T)
        w = a.T @ scipy.sparse.linalg.spsolve(square, -(self.constraint_rate(q, v) @ v))
        b = scipy.linalg.null_space(a.toarray())
        u = np.linalg.solve(b.T @ (m @ b), b.T @ (f - m @ w))
        acceleration = w + b @ u
        return Response(acceleration, np.atleast_1d(scipy.sparse.linalg.spsolve(square, a @ (m @ acceleration - f))))

    def residual(self, q: ArrayLike, v: ArrayLike) -> NDArray:
        """A v - b, (c,)."""
        q, v = self._vectors(q, v)
        return self.constraint(q) @ v - self.drive

    def momentum(self, q: ArrayLike, v: ArrayLike) -> NDArray:
        """p = M v, (m,)."""
        q, v = self._vectors(q, v)
        return self.mass(q) @ v

    def energy(self, q: ArrayLike, v: ArrayLike) -> float:
        """v.Mv/2 + V; constant if b = 0."""
        q, v = self._vectors(q, v)
        return 0.5 * float(v @ (self.mass(q) @ v)) + self.potential(q)

    def integrate(
        self, q: ArrayLike, v: ArrayLike, times: ArrayLike, rtol: float = 1e-11, mu: ArrayLike | None = None
    ) -> Trajectory:
        """The motion from q, v at times[0], by SciPy's DOP853 on v. from the saddle point; for small systems.

        Nothing pulls the velocity back to the constraint: `residual` shows how well the equations alone keep it.

        Parameters
        ----------
        q, v : (m,), coordinates and velocities at times[0].
        times : (F,), increasing.
        rtol : tolerance of a step's error, relative to each coordinate.
        mu : (c,), charges at times[0] of the vakonomic motion, see `discs.vakonomic`; without them it is nonholonomic.

        Raises
        ------
        ValueError : if v does not obey the constraints, naming the worst owner, and for arrays of a wrong shape.
        RuntimeError : if the motion cannot be continued.
        """
        q, v = self._vectors(q, v)
        checks.number("rtol", rtol, positive=True)
        start = [q, v] if mu is None else [q, v, checks.vector("mu", mu, len(self.owners))]
        t = np.atleast_1d(np.asarray(times, dtype=float))
        if t.ndim != 1 or t.size < 2 or not np.all(np.diff(t) > 0):
            raise ValueError("times must be at least two, increasing, the first that of q and v")
        off = np.abs(self.residual(q, v))
        if off.max() > 1e-9 * max(np.abs(v).max(), np.abs(self.drive).max()):
            worst = int(np.argmax(off))
            raise ValueError(
                f"v must obey the constraints; that of {self.owners[worst]} is off by {off[worst]:.3g}: "
                "take consistent_velocity(q, v)"
            )
        m = len(q)

        def rate(_: float, z: NDArray) -> NDArray:
            q, v, mu = np.split(z, [m, 2 * m])
            found = self.accelerations(q, v, mu if mu.size else None)
            return np.concatenate([v, found.acceleration, -found.multipliers[: mu.size]])

        found = scipy.integrate.solve_ivp(rate, (t[0], t[-1]), np.concatenate(start), "DOP853", t, rtol=rtol, atol=1e-3 * rtol)
        if not found.success:
            raise RuntimeError(f"the motion cannot be continued beyond t = {found.t[-1]:g}: {found.message}")
        path, speed, charges = np.split(found.y.T, [m, 2 * m], axis=1)
        frames = list(zip(path, speed, strict=True))
        charged = frames if mu is None else zip(path, speed, charges, strict=True)
        return Trajectory(
            t,
            path,
            speed,
            np.array([self.accelerations(*z).multipliers for z in charged]),
            np.array([self.energy(*z) for z in frames]),
            np.array([np.abs(self.residual(*z)).max() for z in frames]),
            None if mu is None else charges,
        )

    def _vectors(self, q: ArrayLike, v: ArrayLike) -> tuple[NDArray, NDArray]:
        return tuple(checks.vector(name, given, len(self.names)) for name, given in (("q", q), ("v", v)))  # type: ignore[return-value]
