r"""The contract between mechanics and integrators: q' = C(q) pi, pi' = -C(q)^T (grad V(q) - f(t, q, q')).

The columns of C span the velocities that the constraints allow, scaled so that C^T M C = 1 for the mass matrix M; the momenta pi
are the rates along them. The constraint holds identically. Without loads f, H = |pi|^2/2 + V(q) is constant, because one factor C
is the transpose of the other. `discs.chains.slaved` and `discs.chains.steered` derive this form for chains,
`continuum.galerkin` for the field.

A configuration q is an array (rows, n), one row for each coordinate of a disc. V and C depend on its *shape* only: the
differences between neighbours, and the headings of steered discs. Shapes are formed from both parts of the positions, hi and lo.

Energy-exact steps need the mean force between two configurations, a discrete gradient D with D . (q_1 - q_0) = V(q_1) - V(q_0). V
is half a sum of stiffness times strain squared. Let B be a secant matrix, s_1 - s_0 = B (q_1 - q_0) for the strains s. Then
D = B^T (stiffness) (s_0 + s_1)/2 is a discrete gradient.
"""

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, NamedTuple, Protocol, TypeAlias, final

import numpy as np

from discs.arrays import Float, Matrix
from discs.differences import jacobian

# Every system has its own types for these; integrators only pass them on
Shape: TypeAlias = Any
Basis: TypeAlias = Any
Secant: TypeAlias = Any
Parameters: TypeAlias = Any  # a NamedTuple for compiled code; None if there is no compiled form


class Placed(Protocol):
    """Any object with positions hi + lo, (rows, n)."""

    @property
    def hi(self) -> Float: ...

    @property
    def lo(self) -> Float: ...


class Phase(NamedTuple):
    """A point of phase space: positions as an unevaluated sum of two doubles, and momenta.

    hi, lo : (rows, n); q = hi + lo with lo below half a unit in the last place of hi.
    pi : (n,), or (2, n) with own headings, momenta: rates along the columns of C.
    """

    hi: Float
    lo: Float
    pi: Float


def add(hi: Float, lo: Float, increment: Float) -> tuple[Float, Float]:
    """The sum of hi + lo and an increment, low digits kept (Knuth's two-sum)."""
    term = increment + lo
    total = hi + term
    part = total - hi
    return total, (hi - (total - part)) + (term - part)


class Load(ABC):
    """Generalised forces f(t, q, v) that act on the coordinates besides -grad V.

    Attributes
    ----------
    damping, stiffness : (rows, n), minus the derivatives of f by v and by q, of its linear part that acts disc by disc. Implicit
        steps add them to their matrix. `force` is the whole of f, these parts included.
    viscosity : (columns, n + 1), of the part -B^T (viscosity) B v of f in the rows from theta on, where B v is the difference of
        neighbours. Link j is before disc j; on a ring links 0 and n are the same, at free ends they have 0. None for none.
    axles : driven angles, of motors; see `discs.loads.motor`.
    section : rest strains that become part of V: (2, n_links), stretch and shear of links of discs with their own headings, or
        (n_bends,), the curvature of chains with the true curvature. None for none.
    conservative : whether f = -grad U with U = `potential`; then the energy, U included, is conserved.
    passive : whether its power is that of -U and of dampers only, so that the energy can fall but not grow.
    least : a lower bound of U, used to detect blow-up; -inf if none is known.
    parameters : for the compiled form, see `discs.kernels.load`; None if there is none.
    signals : of `parameters`, each with the name of its load.
    """

    damping: Float
    stiffness: Float
    viscosity: Float | None = None
    axles: tuple[Any, ...] = ()
    section: Float | None = None
    conservative: bool = False
    passive: bool = False
    least: float = -np.inf
    signals: tuple[tuple[Any, str], ...] = ()

    def potential(self, t: float, q: Float) -> float:
        """U, the load's part of the energy, at the time t and positions (rows, n); 0 where it has none."""
        return 0.0

    def driven(self, t: float, q: Float) -> float:
        """The part of U that depends on time explicitly; `power` has the work of its forces, so its change is work too."""
        return 0.0

    def power(self, t: float, q: Float, v: Float) -> tuple[float, float]:
        """The rates of work and of dissipation, both outside of U; by default all that f does, or nothing if f = -grad U."""
        return (0.0 if self.conservative else float(np.vdot(v, self.force(t, q, v)))), 0.0

    @abstractmethod
    def force(self, t: float, q: Float, v: Float) -> Float:
        """f, (rows, n), at the time t, positions q (rows, n) and velocities v (rows, n)."""

    def derivatives(self, t: float, q: Float, v: Float) -> tuple[Matrix, Matrix]:
        """df/dq and df/dv without what motors do, sparse (rows n, rows n); here by differences, with errors of about 1e-12."""
        of_v = jacobian(lambda there: self.applied(t, q, there), v)
        return jacobian(lambda there: self.applied(t, there, v), q), of_v

    def bands(self, t: float, q: Float, c: Float, d: complex, g: complex) -> Any:
        """Upper bands of d C^T D C + g C^T S C, for the rest of D = -df/dv and S = -df/dq (`discs.loads.bends`); None for none."""
        return None

    def applied(self, t: float, q: Float, v: Float) -> Float:
        """f without what motors do."""
        return self.force(t, q, v)

    @property
    def parameters(self) -> Parameters:
        return None

    def timed(self, times: Float, h: float) -> Parameters:
        """New `parameters` for compiled steps of size h, whose forces are evaluated at these times, (m,)."""
        return self.parameters


class SkewGradient(ABC):
    """The equations q. = C(q) pi, pi. = -C(q)^T (grad V(q) - f(t, q, q.)), as integrators use them.

    Attributes
    ----------
    n : number of discs, or of basis functions of a field.
    rows : names of the rows of q.
    scale : (rows,), unit of each coordinate for tolerances: a length, or a radian.
    quadratic : whether V is quadratic; secants then do not depend on the step.
    renewed : whether each sweep of the midpoint rule solves with a matrix of its own; otherwise the first one serves all.
    load : f, or None for none; then nothing is computed for it.
    lanes : parameters for compiled steps in lanes; None for none.
    """

    n: int
    rows: tuple[str, ...]
    scale: Float
    quadratic: bool
    renewed: bool = True
    load: Load | None = None
    lanes: Parameters = None

    @abstractmethod
    def shape(self, hi: Float, lo: Float | None = None) -> Shape:
        """The shape of positions hi + lo."""

    @abstractmethod
    def moved(self, shape: Shape, dq: Float) -> Shape:
        """The shape after a change dq (rows, n) of the positions."""

    @abstractmethod
    def basis(self, shape: Shape) -> Basis:
        """The basis C, in the form that `forward`, `back` and `solve` take."""

    @abstractmethod
    def forward(self, c: Basis, p: Float) -> Float:
        """C p, (rows, n)."""

    @abstractmethod
    def back(self, c: Basis, g: Float) -> Float:
        """C^T g, of the shape of pi."""

    @abstractmethod
    def potential(self, shape: Shape) -> float:
        """V at a shape."""

    @abstractmethod
    def secant(self, shape: Shape, dq: Float) -> Secant:
        """The mean geometry of a step dq (rows, n) from a shape, for `mean_force` and `solve`."""

    @abstractmethod
    def mean_force(self, secant: Secant) -> Float:
        """The discrete gradient of V over the step, (rows, n); grad V if the step is zero."""

    @abstractmethod
    def solve(self, secant: Secant, c: Basis, g: complex, rhs: Float, d: complex = 0.0, t: float = 0.0, q: Any = None) -> Float:
        """Solve (I + d C^T D C + g C^T S C) p = rhs for p, of the shape of pi.

        S is B^T (stiffness) B plus the load's stiffness; D is the load's damping, both at the time t and positions q.
        """

    @final
    def pull(self, c: Basis, gradient: Float, t: float, z: Phase, move: Float | float, p: Float) -> Float:
        """Minus the rate of pi: C^T (gradient - f), of the shape of pi.

        f is evaluated at the time t, at the positions of z after a move (rows, n), with velocities C p.
        """
        if self.load is None:
            return self.back(c, gradient)
        return self.back(c, gradient - self.load.force(t, z.hi + (z.lo + move), self.forward(c, p)))

    def gradient(self, shape: Shape) -> Float:
        """grad V, (rows, n)."""
        return self.mean_force(self.secant(shape, self._no_step))

    @cached_property
    def _no_step(self) -> Float:
        return np.zeros((len(self.rows), self.n))

    # Several configurations, as the stages of a step: here one by one; a system may override these with one array operation

    def bases(self, shape: Shape, moves: Float) -> Basis:
        """C after each of `moves` (stages, rows, n)."""
        return [self.basis(self.moved(shape, move)) for move in moves]

    def forwards(self, bases: Basis, p: Float) -> Float:
        """C p at each stage, (stages, rows, n)."""
        return np.array([self.forward(c, stage) for c, stage in zip(bases, p, strict=True)])

    def pulls(self, bases: Basis, shape: Shape, t: Float, z: Phase, moves: Float, p: Float) -> Float:
        """C^T (grad V - f) at times t (stages,) after each of `moves` from z; of the shape of p."""
        stages = zip(bases, t, moves, p, strict=True)
        return np.array([self.pull(c, self.gradient(self.moved(shape, m)), time, z, m, own) for c, time, m, own in stages])
