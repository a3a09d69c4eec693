r"""Modes: small motions e^{sigma t} about equilibria and steady motions.

The rates sigma are the eigenvalues of the matrix A of the linearised equations, in axes that move along (`discs.analysis.steady`).

**Zero.** Equilibria of rolling discs come in families: what the discs cannot reach by rolling is a choice of its own. So zero is an
eigenvalue of high multiplicity, 2 n and more at rest, with Jordan blocks (a displacement that grows like t). It must not hide the
slow modes next to it:

* The matrix A^5 Q^{-3} with Q = A^2 - sqrt(2) s A + s^2 maps sigma to sigma^5/(sigma^2 - sqrt(2) s sigma + s^2)^3: zero to zero,
  with Jordan blocks of up to five, all others to about 1/sigma, the slow ones first, if s is below the slowest rate. It is bounded
  for real and imaginary sigma. Arnoldi's method (ARPACK) finds the largest; for few unknowns all are computed (`DENSE`).
* The multiplicity of zero follows from Jensen's formula: the mean of log |det(A - z)| over a circle |z| = r grows by the number of
  eigenvalues inside per log r.

**Rounding.** S has entries of size K/k^3 with differences of fourth order; a matrix with S loses digits of slow modes like k^-4. So
the forces of the springs, mu = sqrt(stiffness) B dq, are kept as unknowns of a larger sparse matrix with entries like k^-2.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs import checks
from discs.analysis.steady import Steady, described, steady
from discs.arrays import Complex, Float, Int
from discs.linkage import LinkageProblem, LinkageState, small
from discs.linkage.small import Small
from discs.problem import Problem, State

DENSE = 300  # unknowns
LOST = (
    "the slowest modes were not found: zero, with its Jordan blocks, and the slowest rates differ too little for the precision of "
    "numbers, as they do for long free rods that roll by the field law; take fewer discs, or a ring"
)
NEAR = 0.02  # images of the slowest rates are above this over s
SURE = 1e-3  # relative; a vector whose image and rate fit each other so well is that of a mode
MORE = 8  # modes computed besides those asked for, as the slowest of the map need not be the slowest
POINTS = 8  # of a circle


class Pencil:
    """The matrix M of d(dq, w)/dt, with E M' = M (dq, w, mu) for w = dpi/sqrt(m) and mu = sqrt(stiffness) B dq.

    Eliminating mu leaves A, similar to the matrix of the linearised equations in moving axes.
    """

    def __init__(self, state: Steady) -> None:
        lin, diagonal = state.equations, scipy.sparse.diags_array
        moved, own, push, drag = lin.parts
        root = (1 / lin.basis[2:]).ravel()[lin.free]
        stiff = np.flatnonzero(lin.strains.stiffness)
        b = diagonal(np.sqrt(lin.strains.stiffness[stiff])) @ lin.strains.matrix[stiff]
        self.roots, self.size = root, moved.shape[0] + root.size
        blocks = [
            [moved - state.turned, own @ diagonal(root), None],
            [diagonal(1 / root) @ push, diagonal(1 / root) @ drag @ diagonal(root), -diagonal(1 / root) @ own.T @ b.T],
            [b, None, -scipy.sparse.eye_array(stiff.size)],
        ]
        self._matrix = scipy.sparse.block_array(blocks, format="csc")
        self._unknown = diagonal((np.arange(self._matrix.shape[0]) < self.size).astype(float), format="csc")

    @classmethod
    def of_matrix(cls, matrix: Float) -> "Pencil":
        """The pencil of a matrix A that is known, without further unknowns."""
        made = cls.__new__(cls)
        made.size = len(matrix)
        made._matrix = scipy.sparse.csc_array(matrix)
        made._unknown = scipy.sparse.eye_array(made.size, format="csc")
        return made

    def fastest(self, count: int) -> tuple[Complex, Complex]:
        """The largest eigenvalues of A, without the digits that slow ones have otherwise, and their vectors."""
        m = self._matrix.toarray()
        rates, vectors = _eig(m[: self.size, : self.size] + m[: self.size, self.size :] @ m[self.size :, : self.size])
        largest = np.argsort(-np.abs(rates), kind="stable")[:count]
        return rates[largest].astype(complex), vectors[:, largest].astype(complex)

    def factors(self, shift: complex, exact: bool = False) -> "scipy.sparse.linalg.SuperLU":
        """Factors of M - shift E; `exact`, without scaling, so that their product is the determinant."""
        matrix = (self._matrix - shift * self._unknown).tocsc()
        return scipy.sparse.linalg.splu(matrix, options={"Equil": not exact})

    def divided(self, shift: float) -> Callable[[Any], tuple[Any, Any, Any]]:
        """The function x -> (y, A y, A^2 y) with y = Q^{-1} x and Q = A^2 - sqrt(2) shift A + shift^2, for x (size,) or (size, m).

        With s = shift e^{i pi/4}, Q = (A - s)(A - conj s). If (A - s) w = x with a real x, then y = Im w/Im s and
        A y - Re s y = Re w.
        """
        half, size, more = shift / np.sqrt(2), self.size, self._matrix.shape[0] - self.size
        factors = self.factors(half + 1j * half)

        def divide(x: Any) -> tuple[Any, Any, Any]:
            if np.iscomplexobj(x):
                real, imaginary = divide(x.real), divide(x.imag)
                return real[0] + 1j * imaginary[0], real[1] + 1j * imaginary[1], real[2] + 1j * imaginary[2]
            w = factors.solve(np.concatenate([x, np.zeros((more, *x.shape[1:]))]).astype(complex))[:size]
            y = w.imag / half
            moved = w.real + half * y
            return y, moved, x - shift**2 * y + 2 * half * moved

        return divide

    def within(self, radius: float) -> int:
        """How many eigenvalues are within a circle, if none is between half the circle and it."""
        angles = np.pi * (np.arange(POINTS // 2) + 0.5) / (POINTS // 2)  # the lower half is the conjugate

        def mean(r: float) -> float:
            parts = [self.factors(r * np.exp(1j * angle), exact=True).U.diagonal() for angle in angles]
            return float(np.mean([np.log(np.abs(part)).sum() for part in parts]))

        return round(float((mean(radius) - mean(0.5 * radius)) / np.log(2)))


@dataclass(frozen=True, eq=False)
class Modes:
    """The modes of a chain, slowest first.

    Attributes
    ----------
    rate : complex (count,), sigma of e^{sigma t}: real part growth, imaginary part frequency, both per time. A mode that oscillates
        has two, sigma and its complex conjugate.
    shape : complex (count, rows, n), displacements of x, y, theta (and phi); the largest is 1 rad, or one length of the chain. In a
        steady motion they are seen from the axes that move along.
    zero : how many eigenvalues are zero, multiplicities counted.
    symmetries : those of "x", "y", "turn", "roll" that displace the state without change, each with a zero mode.
    problem : with the state as its initial one.
    state : the steady motion.
    """

    rate: Complex
    shape: Complex
    zero: int
    symmetries: tuple[str, ...]
    problem: Problem | LinkageProblem
    state: Steady | Small

    @property
    def growth(self) -> float:
        """The largest real part of the rates, per time: positive if the motion is unstable by one of these modes."""
        return float(self.rate.real.max(initial=-np.inf))

    def displaced(self, mode: int, size: float = 1e-3, phase: float = 0.0) -> State | LinkageState:
        """The state displaced along a mode: by the real part of size e^{i phase} shape, with the rates of that mode.

        ValueError for a number of a mode that is not there.
        """
        if checks.whole("mode", mode, 0) >= self.rate.size:
            raise ValueError(f"mode must be below {self.rate.size}, the number of modes; got {mode}")
        return self.state.displaced(size * np.exp(1j * phase) * self.shape[mode], self.rate[mode])

    def table(self) -> str:
        """The rates in a table."""
        bodies = "nodes" if isinstance(self.problem, LinkageProblem) else "discs"
        lines = [f"{self.shape.shape[2]} {bodies} {described(self.state)}; {self.zero} zero modes"]
        if self.symmetries:
            lines[0] += f", of displacements by {', '.join(self.symmetries)} among others"
        lines += ["mode      growth   frequency      period"]
        for i, rate in enumerate(self.rate):
            period = f"{2 * np.pi / abs(rate.imag):11.5g}" if rate.imag else f"{'':>11}"
            lines.append(f"{i:4d} {rate.real:11.4g} {rate.imag:11.6g} {period}")
        return "\n".join(lines)


def modes(problem: Problem | LinkageProblem, count: int = 8, at: State | LinkageState | None = None) -> Modes:
    """The slowest modes about an equilibrium or a steady motion.

    Parameters
    ----------
    problem : the chain and its loads, which must not depend on time.
    count : how many rates; zero modes are left out.
    at : the state; None for the initial one.

    Returns
    -------
    Modes; about 1e-10 of relative error in the rates of up to 100 discs, 1e-8 up to 2000.

    Raises
    ------
    ValueError : if the motion of the state is not steady, or the chain has fewer modes than `count`.
    """
    count = checks.whole("count", count, 1)
    if isinstance(problem, LinkageProblem):
        if at is not None and not isinstance(at, LinkageState):
            raise ValueError(f"at must be a LinkageState, as the problem is one of a linkage; got {checks.shown(at)}")
        linkage = small.steady(problem, at)
        state: Steady | Small = linkage
        pencil, extra = Pencil.of_matrix(linkage.matrix), linkage.extra
    else:
        chain = steady(problem, at)  # type: ignore[arg-type]  # it refuses another kind of state
        state, pencil, extra = chain, Pencil(chain), 0
    rates, vectors, zero = _slowest(pencil, count, state.slow or 1 / problem.duration)
    zero -= extra
    if count > rates.size:
        raise ValueError(
            f"count must be at most {rates.size}, as the other {zero} modes of the {pencil.size} are zero; got {count}"
        )
    order = _sorted(rates)[:count]
    rates, vectors = rates[order], vectors[:, order]
    q = state.positions(vectors)
    scaled = (q / state.scale[:, None]).reshape(count, -1)
    largest = scaled[np.arange(count), np.argmax(np.abs(scaled) > (1 - 1e-9) * np.abs(scaled).max(axis=1, keepdims=True), axis=1)]
    return Modes(rates, q / largest[:, None, None], zero, state.symmetries(), state.problem, state)


def _sorted(rates: Complex) -> Int:
    """The order by size; of equal sizes those that decay last, and sigma before its conjugate."""
    size = np.abs(rates)
    rank = np.argsort(size, kind="stable")
    steps = np.diff(size[rank], prepend=0.0) > 1e-7 * size[rank]
    group = np.empty(rates.size)
    group[rank] = np.cumsum(steps)
    found: Int = np.lexsort((-rates.imag, -np.round(rates.real / np.maximum(size, 1e-300), 6), group))
    return found


def _slowest(pencil: Pencil, count: int, slow: float) -> tuple[Complex, Complex, int]:
    """At least the `count` slowest rates but zero, or all; their vectors as columns; and the multiplicity of zero.

    slow : an estimate of the slowest rate.
    """
    shift, asked = 0.5 * slow, count + MORE
    for _ in range(8):
        divide, whole = pencil.divided(shift), pencil.size <= DENSE or 2 * asked + 20 >= pencil.size
        images, vectors = _eig(_mapped(divide, np.eye(pencil.size))) if whole else _arnoldi(divide, pencil.size, asked)
        order = np.argsort(-np.abs(images), kind="stable")
        images, vectors = images[order], vectors[:, order]
        y, moved, _ = divide(vectors)
        rates = (y.conj() * moved).sum(axis=0) / (y.conj() * y).sum(axis=0)
        expected = rates**5 / (rates**2 - np.sqrt(2) * shift * rates + shift**2) ** 3
        sure = np.abs(expected - images) < SURE * np.abs(images)  # others are zero, or rounding
        slowest = np.abs(rates[sure & (np.abs(images) * shift > NEAR)]).min(initial=np.inf)
        if not 0.02 * slowest < shift < slowest < np.inf:
            shift = 0.6 * slowest if np.isfinite(slowest) else 0.1 * shift
            continue
        zero = pencil.within(0.5 * slowest)
        # of unknown rates |sigma| (1 + sqrt(2) x + x^2)^3 with x = shift/|sigma| is above `least`, so |sigma| is above `most`
        known = sure.size if sure.all() else int(np.argmin(sure))
        most = least = 1 / np.abs(images[min(known, sure.size - 1)])
        for _ in range(20):
            most = max(shift, least / (1 + np.sqrt(2) * shift / most + (shift / most) ** 2) ** 3)
        inside = np.flatnonzero(np.abs(rates[:known]) <= most)
        if inside.size >= count:
            return rates[inside], vectors[:, inside], zero
        if whole:
            return *pencil.fastest(pencil.size - zero), zero
        asked += count
    raise ValueError(LOST)


def _eig(a: Float) -> tuple[Complex, Complex]:
    """Eigenvalues and vectors, in random axes: LAPACK scales rows, by which entries of 1e-30 spoil all others."""
    frame = np.linalg.qr(np.random.default_rng(2).normal(size=a.shape))[0]
    values, vectors = np.linalg.eig(frame.T @ a @ frame)
    return values.astype(complex), frame @ vectors.astype(complex)


def _mapped(divide: Callable[..., Any], x: Float) -> Float:
    """A^5 Q^{-3} x."""
    found: Float = divide(divide(divide(x)[2])[2])[1]
    return found


def _arnoldi(divide: Callable[..., Any], size: int, asked: int) -> tuple[Complex, Complex]:
    """The largest eigenvalues of A^5 Q^{-3}, and their vectors."""
    operator = scipy.sparse.linalg.LinearOperator((size, size), lambda x: _mapped(divide, x), dtype=float)
    start = _mapped(divide, np.random.default_rng(1).normal(size=size))
    try:
        images, vectors = scipy.sparse.linalg.eigs(operator, asked, v0=start, ncv=2 * asked + 20, maxiter=40, tol=1e-14)
    except scipy.sparse.linalg.ArpackNoConvergence:
        raise ValueError(LOST) from None
    return images, vectors
