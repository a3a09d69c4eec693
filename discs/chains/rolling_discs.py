"""The base class of chains of rolling discs; `discs.skew` gives the form of their equations."""

from abc import abstractmethod
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float, Int, Matrix
from discs.kernels.direct import Known
from discs.skew import Parameters, Placed, Secant, Shape, SkewGradient


class Joined(NamedTuple):
    """One of the discs that each strain joins: its index, and its share in the difference and in the mean heading, (n_links,)."""

    disc: Int
    slope: Float | float
    mean: Float | float


class Strains(NamedTuple):
    """The strains s of all springs at a configuration: V = |sqrt(stiffness) s|^2/2 and grad^2 V = B^T (stiffness) B + bent.

    matrix : B = ds/dq, sparse (springs, rows n); the columns are row after row of q.
    stiffness : (springs,).
    bent : sum over the springs of stiffness s grad^2 s, sparse (rows n, rows n); zero if V is quadratic.
    strain : s, (springs,); grad V = B^T (stiffness s).
    """

    matrix: Matrix
    stiffness: Float
    bent: Matrix
    strain: Float


class Turn(NamedTuple):
    """The change of the basis C with one of the quantities h = heading q[row] that it depends on.

    row : of q. heading : sparse (n, n). basis : dC/dh, (rows, n), disc by disc.
    """

    row: int
    heading: Matrix
    basis: Float


class RollingDiscs(SkewGradient):
    """The equations of motion of a chain. A basis is the array of entries of C, (rows, n).

    Attributes
    ----------
    rows : names of the coordinates of a disc: "x", "y", "theta" and, with own headings, "phi".
    weights : (rows, n), inertia of each disc for each coordinate.
    closed : whether the chain is a ring.
    reach : the rates of a disc depend on so many discs to either side.
    vanishing : whether a heading can vanish.
    stiffest : upper bound of the entries of C^T (grad^2 V) C, per time squared.
    known : machine code that was called for this chain, see `discs.kernels.direct`.
    """

    weights: Float
    closed: bool
    reach: int
    vanishing: bool
    stiffest: float

    def parts(self, count: int) -> tuple[Parameters, ...]:
        """The parameters in lanes for each of several threads, where there are `lanes`."""
        from discs.kernels import parts  # numba is slow to import

        if count not in self._parts:
            self._parts[count] = tuple(self.part(own) for own in parts.parts(self.n, count))
        return self._parts[count]

    @cached_property
    def _parts(self) -> dict[int, tuple[Parameters, ...]]:
        return {}

    @abstractmethod
    def part(self, own: Parameters) -> Parameters:
        """The parameters in lanes of the discs of one thread, in the order `own`, a `discs.kernels.parts.Part`."""

    @cached_property
    def rates(self) -> tuple[str, ...]:
        """Names of the rates of `rows`."""
        return tuple("omega" if row == "theta" else f"{row}_rate" for row in self.rows)

    @cached_property
    def known(self) -> Known:
        return {}

    # Kinematics

    @abstractmethod
    def slope(self, shape: Shape) -> Float:
        """The headings, (2, n): the slope r' of the centre line (slaved headings), or (cos phi, sin phi) (own headings)."""

    @abstractmethod
    def contact(self, shape: Shape) -> Float:
        """Contact directions e, (2, n): r. = e omega. Length per rad."""

    @abstractmethod
    def contact_rate(self, shape: Shape, v: Float) -> Float:
        """Rates of the contact directions, e., (2, n), for rates v (rows, n) of the coordinates. Length per time."""

    @abstractmethod
    def momentum(self, shape: Shape, rates: Float) -> Float:
        """pi from the rates of roll (row 0) and, with own headings, of turning (row 1)."""

    @abstractmethod
    def lost_heading(self, before: Placed, after: Placed) -> int | None:
        """A disc whose heading vanishes between two configurations, or None."""

    def kinetic(self, v: Float) -> float:
        """Kinetic energy of rates (rows, n)."""
        return 0.5 * float(np.vdot(v, self.weights * v))

    @abstractmethod
    def turns(self, shape: Shape) -> list[Turn]:
        """How C changes with q. The columns of C at a disc depend on its heading only."""

    # Springs

    @abstractmethod
    def springs(self, shape: Shape) -> dict[str, float]:
        """V by kind of spring: "bending", "torsion", "stretch", "shear", those that the chain has."""

    @abstractmethod
    def strains(self, shape: Shape) -> Strains:
        """The strains of all springs and their derivatives, for linearised equations."""

    @abstractmethod
    def stiffness(self, secant: Secant, c: Float) -> Float:
        """Upper bands (width + 1, unknowns) of C^T B^T (stiffness) B C, as LAPACK stores them; unknowns in `order`."""

    @abstractmethod
    def polarised(self, shape: Shape, other: Shape) -> float:
        """The symmetric bilinear form V(q, q') with V(q, q) = V(q); ValueError unless V is quadratic."""

    def contact_force(self, shape: Shape, v: Float, f: Float | float = 0.0) -> Float:
        """Force lambda of the ground on each disc, (2, n), for admissible rates v (rows, n) and loads f (rows, n).

        With g = grad V - f, from rho w r.. = -g_r + lambda with r.. = e omega. + e. omega, and
        w (alpha + rho |e|^2) omega. = -e . g_r - g_theta - rho w omega e . e. .
        """
        gradient, mass, omega = self.gradient(shape) - f, self.weights[0], v[2]
        e, turning = self.contact(shape), self.contact_rate(shape, v)
        inertia = self.weights[2] + mass * (e * e).sum(axis=0)
        torque = -(e * gradient[:2]).sum(axis=0) - gradient[2] - mass * omega * (e * turning).sum(axis=0)
        found: Float = mass * (e * (torque / inertia) + turning * omega) + gradient[:2]
        return found

    def motor_torques(self, shape: Shape, v: Float, f: Float, changes: Float) -> Float:
        """Torques of motors, (motors,), for rates v (rows, n), other loads f (rows, n) and accelerations of the driven angles.

        From w (alpha + rho |e|^2) omega. + rho w omega e . e. = -e . g_r - g_theta + tau and J w Omega. = -g_phi + tau.
        """
        assert self.load is not None
        gradient, e = self.gradient(shape) - f, self.contact(shape)
        turning = self.weights[0] * v[2] * (e * self.contact_rate(shape, v)).sum(axis=0)
        inertia = np.array([self.weights[2] + self.weights[0] * (e * e).sum(axis=0), *self.weights[3:]])
        rest = np.array([turning + (e * gradient[:2]).sum(axis=0) + gradient[2], *gradient[3:]])
        at = np.array([(axle.row - 2, axle.disc) for axle in self.load.axles]).T
        found: Float = inertia[at[0], at[1]] * changes + rest[at[0], at[1]]
        return found

    @property
    @abstractmethod
    def parameters(self) -> Parameters:
        """The chain's parameters for the compiled methods of `discs.kernels`; None if it has no compiled form."""

    # The linear system of an implicit step

    @property
    @abstractmethod
    def order(self) -> Int | None:
        """Order of the unknowns pi in banded systems; None for the natural order."""

    @cached_property
    def _inverse_order(self) -> Int | None:
        return None if self.order is None else np.argsort(self.order)

    def solve(self, secant: Secant, c: Float, g: complex, rhs: Float, d: complex = 0.0, t: float = 0.0, q: Any = None) -> Float:
        """In O(n): for g > 0 by banded Cholesky, for a complex g, or with loads in steps back in time, by banded elimination.

        Compositions have steps back in time, d < 0. Their matrix is not positive definite if dampers are stiff, or hold a disc.

        Always in double precision. That is enough for a correction, also to a state in extended precision (`longdouble`).
        """
        matrix = g * self.stiffness(secant, c)
        matrix[-1] += 1
        if self.load is not None:
            guide = self.back(c, (d * self.load.damping + g * self.load.stiffness) * c).ravel()
            matrix = matrix.astype(np.result_type(matrix, guide))
            matrix[-1] += guide if self.order is None else guide[self.order]
            if self.load.viscosity is not None:
                matrix = _sum(matrix, d * self._viscous(self.load.viscosity, c))
            if (bands := self.load.bands(t, q, c, d, g)) is not None:
                matrix = _sum(matrix, bands)
        rhs = rhs.astype(matrix.dtype)
        flat = rhs.ravel() if self.order is None else rhs.ravel()[self.order]
        if np.iscomplexobj(matrix) or (self.load is not None and d.real < 0):
            width, n = len(matrix) - 1, matrix.shape[1]
            full = np.zeros((3 * width + 1, n), matrix.dtype, order="F")  # `width` more rows above for pivoting
            for j in range(width + 1):
                full[2 * width - j, j:] = full[2 * width + j, : n - j] = matrix[width - j, j:]
            eliminate = scipy.linalg.lapack.zgbsv if np.iscomplexobj(matrix) else scipy.linalg.lapack.dgbsv
            _, _, p, info = eliminate(width, width, full, flat, overwrite_ab=True)
        else:
            _, p, info = scipy.linalg.lapack.dpbsv(matrix, flat, overwrite_ab=True)
        if info:
            p = np.full(flat.size, np.nan)  # C is not finite, or rounding dominates
        if self._inverse_order is not None:
            p = p[self._inverse_order]
        found: Float = p.reshape(rhs.shape)
        return found

    def _viscous(self, viscosity: Float, c: Float) -> Float:
        """Upper bands of C^T B^T (viscosity) B C."""
        strains = [np.stack([slope * a[disc] for disc, slope, _ in self._joined], axis=1)[:, None, :] for a in c[2:]]
        links = len(self._joined[0].disc)
        return self._neighbours(*zip(strains, viscosity[:, 1 : 1 + links, None], strict=True))

    @cached_property
    def _joined(self) -> tuple[Joined, ...]:
        """The discs that a strain of a link joins."""
        first = np.arange(self.n - (not self.closed))
        return Joined(first, -1.0, 0.5), Joined((first + 1) % self.n, 1.0, 0.5)

    @cached_property
    def _neighbours(self) -> "Assembly":
        """For strains that join the rolls, or the turns, of neighbours."""
        place = np.arange(self.n * (len(self.rows) - 2)) if self._inverse_order is None else self._inverse_order
        discs = np.stack([disc for disc, _, _ in self._joined], axis=1)
        return Assembly(*(place[discs + column * self.n] for column in range(len(self.rows) - 2)))


def _sum(a: Any, b: Any) -> Any:
    """The sum of two matrices in upper bands, the diagonals last."""
    wide, narrow = (a, b) if len(a) >= len(b) else (b, a)
    found = np.array(wide, np.result_type(a, b), order="F")
    found[-len(narrow) :] += narrow
    return found


class Assembly:
    """Assembles the small matrices of springs into the bands of one symmetric matrix.

    Parameters
    ----------
    places : (springs, m), indices in the banded system of the unknowns that each spring joins.
    """

    def __init__(self, *places: Int) -> None:
        self._pairs = [np.triu_indices(p.shape[1]) for p in places]
        self.size = 1 + max(int(p.max()) for p in places)
        ends = [np.sort(np.stack([p[:, a], p[:, b]]), axis=0) for p, (a, b) in zip(places, self._pairs, strict=True)]
        self.width = max(int((high - low).max()) for low, high in ends)
        self._slots = np.concatenate([((self.width + 1) * high + self.width - (high - low)).ravel() for low, high in ends])

    def __call__(self, *strains: tuple[Float, Float]) -> Float:
        """Bands (width + 1, size) of the sum of B^T (stiffness) B over the springs.

        One argument for each of `places`: the rows B of the strains, (springs, strains, m), and the stiffness, (springs, strains).
        """
        entries = []
        for (b, stiffness), (i, j) in zip(strains, self._pairs, strict=True):
            local = np.matmul((b * stiffness[:, :, None]).transpose(0, 2, 1), b)
            entries.append(local[:, i, j].ravel())
        total = np.bincount(self._slots, np.concatenate(entries), (self.width + 1) * self.size).astype(float, copy=False)
        return total.reshape(self.size, self.width + 1).T


def folded(n: int) -> Int:
    """The order 0, n-1, 1, n-2, ... of a ring: neighbours are at most two places apart, so the matrix is banded."""
    order = np.empty(n, dtype=int)
    order[0::2] = np.arange((n + 1) // 2)
    order[1::2] = np.arange(n - 1, (n - 1) // 2, -1)
    return order
