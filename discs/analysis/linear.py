r"""The linearised equations: how small changes of a state grow.

With v = C pi and g = grad V - f the equations are q' = v, pi' = -C^T g (`discs.skew`). A small change (dq, dpi) obeys

    dq'  = N dq + C dpi,                                    N dq = d(C)[dq] pi,
    dpi' = -C^T (S dq - f_q dq - f_v dv) - P dq,            P dq = d(C)^T[dq] g,   dv = N dq + C dpi,

with S = grad^2 V = B^T (stiffness) B + bent. C depends on a few headings h_a = Z_a q_a of each disc (`RollingDiscs.turns`), so
N and P are diagonal matrices times Z_a, and the whole matrix is sparse: the rates of a disc depend on a few discs to either side.

At rest without loads g need not vanish, only C^T g = 0; then P dq is the change of the directions in which the discs may roll. It
is not symmetric: an equilibrium of rolling discs may flutter, although the energy is conserved.

A motor prescribes omega_i, or phi_i'. Its momentum then is no unknown: pi_i = sqrt(m_i) omega_i changes with sqrt(m_i), which
depends on the heading where the heading is slaved.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs import checks
from discs.arrays import Bool, Float, Matrix
from discs.chains.rolling_discs import RollingDiscs, Strains
from discs.problem import Problem, State
from discs.skew import Phase


@dataclass(frozen=True, eq=False)
class Linearised:
    """The linearised equations of a problem at a state.

    The unknowns y are q row after row, then pi: of size rows n + columns n, less one for each motor. They may be computed from the
    arrays by `join` and split into them by `split`.

    Attributes
    ----------
    problem : the chain and its loads. z : the state. t : the time of loads.
    """

    problem: Problem
    z: Phase
    t: float = 0.0

    @property
    def system(self) -> RollingDiscs:
        """The equations of motion."""
        return self.problem.system

    @cached_property
    def free(self) -> Bool:
        """Which of the momenta, (columns n,), are unknowns: those that no motor prescribes."""
        free: Bool = np.ones(self.z.pi.size, dtype=bool)
        for row, disc, *_ in () if self.system.load is None else self.system.load.axles:
            free[(row - 2) * self.system.n + disc] = False
        return free

    @property
    def shape(self) -> object:
        """The shape of the chain."""
        return self.system.shape(self.z.hi, self.z.lo)

    @cached_property
    def basis(self) -> Float:
        """C, (rows, n)."""
        basis: Float = self.system.basis(self.shape)
        return basis

    @cached_property
    def strains(self) -> Strains:
        """The strains of the springs."""
        return self.system.strains(self.shape)

    @cached_property
    def velocity(self) -> Float:
        """q', (rows, n)."""
        return self.system.forward(self.basis, self.z.pi)

    @cached_property
    def unbalanced(self) -> Float:
        """g = grad V - f, (rows, n), without what motors do."""
        load = self.system.load
        return self.gradient if load is None else self.gradient - load.applied(self.t, self.z.hi + self.z.lo, self.velocity)

    @cached_property
    def gradient(self) -> Float:
        """grad V, (rows, n)."""
        return self.system.gradient(self.shape)

    @cached_property
    def forces(self) -> tuple[Matrix, Matrix]:
        """f_q and f_v, sparse (rows n, rows n), without what motors do."""
        if self.system.load is not None:
            return self.system.load.derivatives(self.t, self.z.hi + self.z.lo, self.velocity)
        return 0 * self.strains.bent, 0 * self.strains.bent

    @cached_property
    def rate(self) -> Float:
        """The rates (q', pi') of the state itself, (size,)."""
        return self.join(self.velocity, -self.system.back(self.basis, self.unbalanced))

    @cached_property
    def columns(self) -> Matrix:
        """C as a sparse matrix (rows n, columns n)."""
        n, c = self.system.n, self.basis
        diagonal, none = scipy.sparse.diags_array, scipy.sparse.csr_array((n, n))
        if len(c) == 3:
            return scipy.sparse.vstack([diagonal(row) for row in c], format="csr")
        return scipy.sparse.block_array([*([diagonal(row), none] for row in c[:3]), [none, diagonal(c[3])]], format="csr")

    @cached_property
    def turned(self) -> tuple[Matrix, Matrix, Matrix]:
        """N, P, and the change of the momenta that motors prescribe, (columns n, rows n)."""
        n, rows, pi = self.system.n, len(self.basis), self.z.pi.reshape(-1, self.system.n)
        none, diagonal = scipy.sparse.csr_array((n, n)), scipy.sparse.diags_array
        moved = [[none] * rows for _ in range(rows)]
        pulled, held = [[none] * rows for _ in pi], [[none] * rows for _ in pi]
        for turn in self.system.turns(self.shape):
            for row in range(rows):
                moved[row][turn.row] = diagonal(turn.basis[row] * pi[row // 3]) @ turn.heading
            for column, own in enumerate(((0, 1, 2), (3,))[: len(pi)]):
                pull = sum(turn.basis[row] * self.unbalanced[row] for row in own)
                pulled[column][turn.row] = diagonal(pull) @ turn.heading
                # sqrt(m) = 1/C, and pi = sqrt(m) omega at a constant omega
                held[column][turn.row] = diagonal(-pi[column] * turn.basis[own[-1]] / self.basis[own[-1]]) @ turn.heading
        keep = diagonal((~self.free).astype(float))
        return *(scipy.sparse.block_array(part, format="csr") for part in (moved, pulled)), keep @ scipy.sparse.block_array(held)

    @cached_property
    def parts(self) -> tuple[Matrix, Matrix, Matrix, Matrix]:
        """The four blocks of the matrix, without -C^T B^T (stiffness) B: q' by q, q' by pi, pi' by q, pi' by pi."""
        c, (moved, pulled, held) = self.columns, self.turned
        free = scipy.sparse.eye_array(self.free.size, format="csr")[:, self.free]
        moved = moved + c @ held  # with the momenta of motors
        own, rest = c @ free, (c @ free).T
        of_q, drag = self.forces
        return moved, own, rest @ (of_q - self.strains.bent + drag @ moved) - free.T @ pulled, rest @ drag @ own

    @cached_property
    def matrix(self) -> Matrix:
        """The sparse matrix of the linearised equations, (size, size)."""
        moved, own, push, drag = self.parts
        b = self.strains.matrix
        spring = own.T @ (b.T @ scipy.sparse.diags_array(self.strains.stiffness) @ b)
        return scipy.sparse.block_array([[moved, own], [push - spring, drag]], format="csr")

    @cached_property
    def operator(self) -> "scipy.sparse.linalg.LinearOperator":
        """The same as an operator: its product with a change of the state, and that of its transpose, without the matrix S."""
        moved, own, push, drag = self.parts
        b, stiffness, m = self.strains.matrix, self.strains.stiffness, moved.shape[0]

        def forward(y: Float) -> Float:
            dq, dpi = y[:m], y[m:]
            return np.concatenate([moved @ dq + own @ dpi, push @ dq + drag @ dpi - own.T @ (b.T @ _times(stiffness, b @ dq))])

        def back(y: Float) -> Float:
            dq, dpi = y[:m], y[m:]
            pulled = moved.T @ dq + push.T @ dpi - b.T @ _times(stiffness, b @ (own @ dpi))
            return np.concatenate([pulled, own.T @ dq + drag.T @ dpi])

        size = m + drag.shape[0]
        return scipy.sparse.linalg.LinearOperator((size, size), forward, back, forward, float, back)

    def join(self, q: Float, pi: Float) -> Float:
        """The unknowns (size,) from arrays (rows, n) and of the shape of pi; those that motors prescribe are left out."""
        return np.concatenate([q.ravel(), pi.ravel()[self.free]])

    def split(self, y: Float) -> tuple[Float, Float]:
        """Changes of q, (rows, n), and of pi from unknowns (size,), those that motors prescribe included."""
        dq, m = y[: self.basis.size], self.basis.size
        dpi = self.turned[2] @ dq
        dpi[self.free] = y[m:]
        return dq.reshape(self.basis.shape), dpi.reshape(self.z.pi.shape)


def _times(factor: Float, values: Float) -> Float:
    """A diagonal matrix times a vector or the columns of a matrix."""
    found: Float = (factor * values.T).T
    return found


def linearise(problem: Problem, at: State | None = None, t: float = 0.0) -> Linearised:
    """The linearised equations of a problem.

    Parameters
    ----------
    problem : the chain and its loads.
    at : the state; None for the initial one.
    t : the time at which loads are taken.

    Raises
    ------
    ValueError : if this is no problem, or no state of its chain.
    """
    if not isinstance(problem, Problem):
        raise ValueError(
            f"linearised equations are those of a Problem, as `compare.lump(scene, n)` makes; got {checks.shown(problem)}"
        )
    if at is not None:
        if not isinstance(at, State):
            raise ValueError(f"at must be a State, as `equilibrium(problem)` finds; got {checks.shown(at)}")
        problem = Problem(problem.chain, at, problem.duration, problem.loads)
    return Linearised(problem, problem.start(), checks.number("t", t))
