r"""The Lagrange-d'Alembert equations with multipliers, in textbook form.

A mechanical system with L = v.M(q)v/2 - V(q), v = q., moves under linear constraints A(q) v = b (b constant: zero for rolling). The
constraint forces do no work on virtual displacements, A dq = 0, so they have the form A^T lambda, and

    M v. = f + A^T lambda,   f = dL/dq - M. v,   A v. = -A. v,

The second equation is the differentiated constraint. Together they are the saddle point

    [ M  A^T ] (  v.    )   (  f     )
    [ A   0  ] ( -lambda) = ( -A. v  ).

For discs a constraint is r. - e theta. = 0, two rows for each disc: lambda is the ground's force, and -e.lambda its torque about
the axle. M is diagonal and a disc's rows of A involve only its own velocities, so the sparse matrix is block diagonal up to its
order and is solved in O(n).

The reduced form has no multipliers. With the columns of B spanning the kernel of A and some w with A w = -A. v,

    v. = w + B u,   B^T M B u = B^T (f - M w),   lambda = (A A^T)^{-1} A (M v. - f).

The skew-gradient form of `discs.chains.rolling_discs` takes the B with B^T M B = 1. All three forms are equivalent.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float, Matrix
from discs.mechanics import saddle
from discs.mechanics.derivatives import Formula
from discs.mechanics.saddle import dense


class Response(NamedTuple):
    """Accelerations (m,) and multipliers lambda (c,), the forces of constraint being A^T lambda."""

    acceleration: Float
    multipliers: Float


@dataclass(frozen=True, eq=False)
class Equations:
    """M, V, f, A and b of a mechanical system, and what follows from them at given q and v; m coordinates, c constraints.

    Attributes
    ----------
    names : (m,), names of the coordinates.
    owners : (c,), the owner of each row of A in messages, as "disc 3".
    mass : q -> M, (m, m), an array or a sparse one; positive definite on the kernel of A.
    potential : q -> V.
    force : q, v -> f, (m,).
    constraint : q -> A, (c, m).
    constraint_rate : q, v -> A. = dA/dq.v, (c, m).
    drive : b, (c,).
    symmetry : q -> X, (m, g): velocities of g one-parameter groups that leave L invariant, affine in q; None if none are known.
    formulas : M(q), V(q), A(q) of `from_lagrangian`; `how` and `error` describe their derivatives.
    """

    names: tuple[str, ...]
    owners: tuple[str, ...]
    mass: Callable[[Float], Matrix]
    potential: Callable[[Float], float]
    force: Callable[[Float, Float], Float]
    constraint: Callable[[Float], Matrix]
    constraint_rate: Callable[[Float, Float], Matrix]
    drive: Float
    symmetry: Callable[[Float], Float] | None = None
    formulas: tuple[Formula, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", names_of("names", self.names))
        object.__setattr__(self, "owners", names_of("owners", self.owners))
        object.__setattr__(self, "drive", checks.field("drive", self.drive, len(self.owners)))

    def saddle_point(self, q: Float) -> Matrix:
        """The matrix [[M, A^T], [A, 0]], (m + c, m + c), sparse if A is."""
        return saddle.matrix(self.mass(q), self.constraint(q))

    def _solve(self, q: Float, f: Float, g: Float) -> Response:
        """u and lambda with M u = f + A^T lambda, A u = g."""
        return Response(*saddle.solve(self.mass(q), self.constraint(q), f, g, self.names, self.owners))

    def magnetic(self, q: ArrayLike, v: ArrayLike) -> Float:
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
        ValueError : if constraints are redundant or contradict each other, with their owners, or inertia is missing.
        """
        q, v = self._vectors(q, v)
        f = self.force(q, v)
        if mu is not None:
            f = f + self.magnetic(q, v) @ checks.vector("mu", mu, len(self.owners))
        return self._solve(q, f, -(self.constraint_rate(q, v) @ v))

    def consistent_velocity(self, q: ArrayLike, v: ArrayLike) -> Float:
        """The velocity u nearest to v that the constraints allow: A u = b and (u - v).M(u - v) least, (m,).

        Then M (u - v) = A^T mu: an impulse of the constraint forces changes v to u.
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

    def residual(self, q: ArrayLike, v: ArrayLike) -> Float:
        """A v - b, (c,)."""
        q, v = self._vectors(q, v)
        return np.asarray(self.constraint(q) @ v - self.drive)

    def momentum(self, q: ArrayLike, v: ArrayLike) -> Float:
        """p = M v, (m,)."""
        q, v = self._vectors(q, v)
        return np.asarray(self.mass(q) @ v)

    def energy(self, q: ArrayLike, v: ArrayLike) -> float:
        """v.Mv/2 + V; constant if b = 0."""
        q, v = self._vectors(q, v)
        return 0.5 * float(v @ (self.mass(q) @ v)) + self.potential(q)

    def _vectors(self, q: ArrayLike, v: ArrayLike) -> tuple[Float, Float]:
        return tuple(checks.vector(name, given, len(self.names)) for name, given in (("q", q), ("v", v)))  # type: ignore[return-value]


def names_of(what: str, given: Sequence[str]) -> tuple[str, ...]:
    """Names as a tuple; a string is one name."""
    return (given,) if isinstance(given, str) else tuple(given)
