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

The skew-gradient form of `discs.chains.rolling_discs` takes the B with B^T M B = 1. The three are one system of equations.
"""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike, NDArray

from discs import checks
from discs.mechanics import motion, saddle
from discs.mechanics.derivatives import Formula, ShapeError
from discs.mechanics.motion import Trajectory
from discs.mechanics.sizes import dense


class Response(NamedTuple):
    """Accelerations (m,) and multipliers lambda (c,), the forces of constraint being A^T lambda."""

    acceleration: NDArray
    multipliers: NDArray


@dataclass(frozen=True, eq=False)
class MechanicalSystem:
    """A mechanical system with linear velocity constraints; m coordinates, c constraints.

    Make one with `discs.mechanics.lagrange.lagrange_dalembert` from discs, with `from_lagrangian` from formulas, or from its parts.

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
    formulas : M(q), V(q), A(q) of `from_lagrangian`; each says how its derivatives are taken and their error.
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
    formulas: tuple[Formula, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", _names("names", self.names))
        object.__setattr__(self, "owners", _names("owners", self.owners))
        object.__setattr__(self, "drive", checks.field("drive", self.drive, len(self.owners)))

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
        """A system from M (or M(q)), V(q) and A(q), formulas that take q (m,) and return numbers.

        Derivatives are exact to rounding where a formula also takes complex numbers, which is verified; elsewhere (`abs`,
        `np.linalg.norm`, `math.sin`, an array of zeros that is filled in) they are real differences with an error of about 1e-12:
        see `discs.mechanics.derivatives`. Formulas in `jax.numpy` are computed in double precision.

        Parameters
        ----------
        names : m names of coordinates.
        mass : M (m, m), symmetric, or q -> M.
        potential : q -> V.
        constraint : q -> A (c, m); c may be 0, with no owners.
        owners : c names, whose constraint each row is.
        drive, symmetry : as the attributes.

        Raises
        ------
        ValueError : for arrays of a wrong shape, a formula that does not take q alone, or an M that is not symmetric.
        """
        names, owners = _names("names", names), _names("owners", owners)
        m, c = len(names), len(owners)
        rows, height = Formula("A", _of_q("A", constraint), (c, m), m), Formula("V", _of_q("V", potential), (), m)
        inertia = Formula("M", _of_q("M", mass) if callable(mass) else lambda q: mass, (m, m), m)
        given = tuple(_shape_of(formula) for formula in (rows, inertia))
        if given != ((c, m), (m, m)):
            raise ValueError(
                f"A must be of shape {(c, m)} and M of shape {(m, m)}, for {m} names and {c} owners; got {given[0]} and {given[1]}"
            )
        constant = None if callable(mass) else inertia(np.zeros(m))
        if constant is not None:
            saddle.symmetric(constant, names)

        def force(q: NDArray, v: NDArray) -> NDArray:
            f = -height.slopes(q)
            if constant is None:
                slopes = inertia.slopes(q)  # dM_ij/dq_k
                f = f + 0.5 * np.einsum("i,ijk,j->k", v, slopes, v) - (slopes @ v) @ v
            return f

        return cls(
            names,
            owners,
            inertia if constant is None else lambda q: constant,
            lambda q: float(height(q)),
            force,
            rows,
            rows.along,
            np.asarray(drive),
            None if symmetry is None else lambda q: np.asarray(symmetry(q), dtype=float),
            (height, rows) if constant is not None else (height, rows, inertia),
        )

    def also(self, rows: ArrayLike, owners: Sequence[str], drive: ArrayLike = 0.0) -> "MechanicalSystem":
        """The system with more constraints, constant rows (k, m) with rows @ v = drive: a disc that is held, a motor."""
        owners = _names("owners", owners)
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
        """G of the vakonomic equations, (m, c): (G mu)_j = sum_{a,k} mu_a (dA_ak/dq_j - dA_aj/dq_k) v_k; see
        `discs.mechanics.vakonomic`."""
        q, v = self._vectors(q, v)
        slopes = (self.constraint_rate(q, unit) for unit in np.eye(len(q)))
        d = np.stack([dense(a) for a in slopes], axis=-1)  # dA_ak/dq_j
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
        m, a, f = dense(self.mass(q)), dense(self.constraint(q)), self.force(q, v)
        right = -(self.constraint_rate(q, v) @ v)
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
        self,
        q: ArrayLike,
        v: ArrayLike,
        times: ArrayLike,
        rtol: float = 1e-11,
        mu: ArrayLike | None = None,
        *,
        method: str = "auto",
        atol: ArrayLike | None = None,
        progress: bool = True,
    ) -> Trajectory:
        """The motion from q, v at times[0], by SciPy's methods on v. from the saddle point; for small systems.

        Explicit methods bring v, and q where a constraint is that of a position, back to the constraints after each step.
        `residual` shows how well they are kept. Where constraints become dependent at one moment and the motion is smooth, it
        goes on: see `discs.mechanics.rank_drops`.

        Parameters
        ----------
        q, v : (m,), coordinates and velocities at times[0].
        times : (F,), increasing, or all decreasing.
        rtol : tolerance of a step's error, relative to each coordinate.
        mu : (c,), charges at times[0] of the vakonomic motion, see `discs.mechanics.vakonomic`; without them it is nonholonomic.
        method : "DOP853", "RK45", "RK23" (explicit), "Radau", "BDF", "LSODA" (for stiff problems), or "auto": DOP853, and
            Radau from where the problem is stiff. `Trajectory.stats` tells which.
        atol : tolerance of a step's error, absolute: a number or one per entry of (q, v) or (q, v, mu). By default 1e-3 rtol of
            what each quantity reaches.
        progress : show a bar after a second.

        Raises
        ------
        ValueError : if v does not obey the constraints, naming the worst owner, V is not finite, M not symmetric or not positive,
            and for arrays of a wrong shape.
        RuntimeError : if the motion cannot be continued, with the time and why.

        Warns
        -----
        UserWarning : if energy that is conserved (without drive), or a constraint, is off by over a hundredth; if rtol is out
            of reach of the formulas' precision.
        """
        q, v = self._vectors(q, v)
        charges = None if mu is None else checks.vector("mu", mu, len(self.owners))
        return motion.integrate(self, q, v, charges, times, method, rtol, atol, progress)

    def _vectors(self, q: ArrayLike, v: ArrayLike) -> tuple[NDArray, NDArray]:
        return tuple(checks.vector(name, given, len(self.names)) for name, given in (("q", q), ("v", v)))  # type: ignore[return-value]


def _names(what: str, given: Sequence[str]) -> tuple[str, ...]:
    """Names as a tuple; a string is one name."""
    return (given,) if isinstance(given, str) else tuple(given)


def _of_q(name: str, formula: Callable[[NDArray], Any]) -> Callable[[NDArray], Any]:
    """`formula`, which must take q alone."""
    if not callable(formula):
        raise ValueError(f"{name} must be a function of q; got {formula!r}")
    try:
        inspect.signature(formula).bind(None)
    except TypeError as error:
        raise ValueError(f"{name} must be a function of q alone, {name}(q); {error}") from None
    except ValueError:  # a builtin without a signature
        pass
    return formula


def _shape_of(formula: Formula) -> tuple[int, ...]:
    """Shape of a formula's value at q = 0; the right one where it has none there."""
    try:
        formula(np.zeros(formula.size))
    except ShapeError as error:
        return error.given
    except (
        ArithmeticError,
        IndexError,
        RuntimeWarning,
        ValueError,
        np.linalg.LinAlgError,
    ):  # not defined at 0: seen at the first q
        pass
    return formula.shape
