r"""What every chain of rolling discs is: a skew-gradient system q' = C(q) pi, pi' = -C(q)^T grad V(q).

The columns of C span the velocities that rolling allows, scaled so that C^T M C = 1 for the mass matrix M; pi are the rates along
them. H = |pi|^2/2 + V(q) is constant because the two factors C are each other's transpose, and the constraint holds identically.
`discs.slaved` and `discs.steered` are chains in this form; the derivations stand there. (`continuum.galerkin` is the field.)

A configuration q is an array (rows, n), one row for each coordinate of a disc. All that forces need of it is its *shape*: the
differences between neighbours, and headings where a disc has its own. Shapes are formed from both parts of the positions.

Energy-exact steps need the mean force between two configurations, a discrete gradient D with D . (q_1 - q_0) = V(q_1) - V(q_0). V
is half a sum of stiffness times strain squared; if the strains' changes are written as s_1 - s_0 = B (q_1 - q_0) with a
secant matrix B, then D = B^T (stiffness) (s_0 + s_1)/2 is one.
"""

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import NDArray


class Placed(Protocol):
    """What has positions hi + lo, (rows, n)."""

    @property
    def hi(self) -> NDArray: ...

    @property
    def lo(self) -> NDArray: ...


class Phase(NamedTuple):
    """A point of phase space: positions as an unevaluated sum of two doubles, and momenta.

    hi, lo : (rows, n); q = hi + lo with lo below half a unit in the last place of hi.
    pi : (n,), or (2, n) with own headings, rates along the columns of C.
    """

    hi: NDArray
    lo: NDArray
    pi: NDArray


def add(hi: NDArray, lo: NDArray, increment: NDArray) -> tuple[NDArray, NDArray]:
    """Add an increment to hi + lo without losing its low digits (Knuth's two-sum)."""
    term = increment + lo
    total = hi + term
    part = total - hi
    return total, (hi - (total - part)) + (term - part)


class SkewGradient(ABC):
    """Equations q. = C(q) pi, pi. = -C(q)^T grad V(q): all that integrators need to know.

    Attributes
    ----------
    n : number of discs, or of functions that a field is made of.
    rows : names of the rows of q.
    scale : (rows,), the size of a motion: a length, and a radian.
    quadratic : whether V is quadratic, so that secants do not depend on the step.
    """

    n: int
    rows: tuple[str, ...]
    scale: NDArray
    quadratic: bool

    @abstractmethod
    def shape(self, hi: NDArray, lo: NDArray | None = None) -> Any:
        """The shape of positions hi + lo: what C and V depend on."""

    @abstractmethod
    def moved(self, shape: Any, dq: NDArray) -> Any:
        """The shape after a change dq (rows, n) of the positions."""

    @abstractmethod
    def frame(self, shape: Any) -> Any:
        """C, as `forward`, `back` and `solve` take it."""

    @abstractmethod
    def forward(self, c: Any, p: NDArray) -> NDArray:
        """C p, (rows, n)."""

    @abstractmethod
    def back(self, c: Any, g: NDArray) -> NDArray:
        """C^T g, of the shape of pi."""

    @abstractmethod
    def potential(self, shape: Any) -> float:
        """V."""

    @abstractmethod
    def secant(self, shape: Any, dq: NDArray) -> Any:
        """What depends on a step dq (rows, n) from a shape: the mean geometry that `mean_force` and `solve` need."""

    @abstractmethod
    def mean_force(self, secant: Any) -> NDArray:
        """The discrete gradient of V over the step, (rows, n); grad V if the step is zero."""

    @abstractmethod
    def solve(self, secant: Any, c: Any, g: complex, rhs: NDArray) -> NDArray:
        """Solve (I + g C^T S C) p = rhs for p, of the shape of pi, S = B^T (stiffness) B."""

    def gradient(self, shape: Any) -> NDArray:
        """grad V, (rows, n)."""
        return self.mean_force(self.secant(shape, self._no_step))

    @cached_property
    def _no_step(self) -> NDArray:
        return np.zeros((len(self.rows), self.n))

    # Several configurations, the stages of a step; here one after the other, a system may take them at once

    def frames(self, shape: Any, moves: NDArray) -> Any:
        """C after each of `moves` (stages, rows, n)."""
        return [self.frame(self.moved(shape, move)) for move in moves]

    def forwards(self, frames: Any, p: NDArray) -> NDArray:
        """C p of each, (stages, rows, n)."""
        return np.array([self.forward(c, stage) for c, stage in zip(frames, p, strict=True)])

    def forces(self, frames: Any, shape: Any, moves: NDArray) -> NDArray:
        """C^T grad V after each of `moves`, of the shape of p."""
        return np.array([self.back(c, self.gradient(self.moved(shape, m))) for c, m in zip(frames, moves, strict=True)])


class RollingDiscs(SkewGradient):
    """The equations of motion of a chain. A frame is the entries of C, (rows, n).

    Attributes
    ----------
    rows : names of the coordinates of a disc, "x", "y", "theta" and, with own headings, "phi".
    weights : (rows, n), inertia of each disc against each coordinate's rate.
    closed : whether the chain is a ring.
    reach : how many discs to either side a disc's rates depend on.
    vanishing : whether a heading can vanish.
    stiffest : bound of the entries of C^T (grad^2 V) C, per time squared.
    """

    weights: NDArray
    closed: bool
    reach: int
    vanishing: bool
    stiffest: float

    # Kinematics

    @abstractmethod
    def slope(self, shape: Any) -> NDArray:
        """The headings: the slope r' of the centre line (slaved), or (cos phi, sin phi); (2, n)."""

    @abstractmethod
    def contact(self, shape: Any) -> NDArray:
        """Contact directions e, (2, n): a disc moves by e per unit of roll. Length per rad."""

    @abstractmethod
    def contact_rate(self, shape: Any, v: NDArray) -> NDArray:
        """Rates of the contact directions, e., (2, n), for rates v (rows, n) of the coordinates. Length per time."""

    @abstractmethod
    def momentum(self, shape: Any, rates: NDArray) -> NDArray:
        """pi of the rates of roll (row 0) and, with own headings, of turning (row 1)."""

    @abstractmethod
    def lost_heading(self, before: Placed, after: Placed) -> int | None:
        """A disc whose heading vanished between two configurations, or None."""

    def kinetic(self, v: NDArray) -> float:
        """Kinetic energy of rates (rows, n)."""
        return 0.5 * float(np.vdot(v, self.weights * v))

    # Springs

    @abstractmethod
    def stiffness(self, secant: Any, c: NDArray) -> NDArray:
        """Upper bands (width + 1, unknowns) of C^T B^T (stiffness) B C, as LAPACK stores them, unknowns in `order`."""

    @abstractmethod
    def polarised(self, shape: Any, other: Any) -> float:
        """The symmetric bilinear form of which V is the square; ValueError unless V is quadratic."""

    def contact_force(self, shape: Any, v: NDArray) -> NDArray:
        """Force lambda of the ground on each disc, (2, n), for admissible rates v (rows, n).

        From rho w r.. = -dV/dr + lambda with r.. = e omega. + e. omega, and
        w (alpha + rho |e|^2) omega. = -e . dV/dr - dV/dtheta - rho w omega e . e. .
        """
        gradient, mass, omega = self.gradient(shape), self.weights[0], v[2]
        e, turning = self.contact(shape), self.contact_rate(shape, v)
        inertia = self.weights[2] + mass * (e * e).sum(axis=0)
        torque = -(e * gradient[:2]).sum(axis=0) - gradient[2] - mass * omega * (e * turning).sum(axis=0)
        return mass * (e * (torque / inertia) + turning * omega) + gradient[:2]

    @property
    @abstractmethod
    def kernel(self) -> Any:
        """The chain's parameters for the compiled methods of `discs.kernels`; None if it has no compiled form."""

    # The linear system of an implicit step

    @property
    @abstractmethod
    def order(self) -> NDArray | None:
        """Order in which the unknowns of pi are taken in banded systems; None as they stand."""

    @cached_property
    def _inverse_order(self) -> NDArray | None:
        return None if self.order is None else np.argsort(self.order)

    def solve(self, secant: Any, c: NDArray, g: complex, rhs: NDArray) -> NDArray:
        """In O(n): for g > 0 by banded Cholesky, for a complex g by banded elimination. In double precision whatever that of
        `rhs`, which is enough for a correction: a state in `longdouble` is carried on in extended precision.
        """
        matrix = g * self.stiffness(secant, c)
        matrix[-1] += 1
        rhs = rhs.astype(matrix.dtype)
        flat = rhs.ravel() if self.order is None else rhs.ravel()[self.order]
        if np.iscomplexobj(matrix):
            width, n = len(matrix) - 1, matrix.shape[1]
            full = np.zeros((3 * width + 1, n), complex, order="F")  # `width` more rows above for the exchange of pivots
            for j in range(width + 1):
                full[2 * width - j, j:] = full[2 * width + j, : n - j] = matrix[width - j, j:]
            _, _, p, info = scipy.linalg.lapack.zgbsv(width, width, full, flat, overwrite_ab=True)
        else:
            _, p, info = scipy.linalg.lapack.dpbsv(matrix, flat, overwrite_ab=True)
        if info:
            p = np.full(flat.size, np.nan)  # not positive definite: C is not finite, or all digits are lost
        if self._inverse_order is not None:
            p = p[self._inverse_order]
        return p.reshape(rhs.shape)


class Assembly:
    """Adds the small matrices of springs up to the bands of one symmetric matrix.

    Parameters
    ----------
    places : (springs, m), the places of the unknowns that each spring joins, in the order of the banded system.
    """

    def __init__(self, *places: NDArray) -> None:
        self._pairs = [np.triu_indices(p.shape[1]) for p in places]
        self.size = 1 + max(int(p.max()) for p in places)
        ends = [np.sort(np.stack([p[:, a], p[:, b]]), axis=0) for p, (a, b) in zip(places, self._pairs, strict=True)]
        self.width = max(int((high - low).max()) for low, high in ends)
        self._slots = np.concatenate([((self.width + 1) * high + self.width - (high - low)).ravel() for low, high in ends])

    def __call__(self, *strains: tuple[NDArray, NDArray]) -> NDArray:
        """Bands of the sum of B^T (stiffness) B, (width + 1, size).

        Each argument belongs to one of `places`: rows B of its strains, (springs, strains, m), and their stiffness,
        (springs, strains).
        """
        entries = []
        for (b, stiffness), (i, j) in zip(strains, self._pairs, strict=True):
            local = np.matmul((b * stiffness[:, :, None]).transpose(0, 2, 1), b)
            entries.append(local[:, i, j].ravel())
        total = np.bincount(self._slots, np.concatenate(entries), (self.width + 1) * self.size)
        return total.reshape(self.size, self.width + 1).T


def folded(n: int) -> NDArray:
    """The order 0, n-1, 1, n-2, ... of a ring, in which neighbours are at most two places apart: rings are banded too."""
    order = np.empty(n, dtype=int)
    order[0::2] = np.arange((n + 1) // 2)
    order[1::2] = np.arange(n - 1, (n - 1) // 2, -1)
    return order
