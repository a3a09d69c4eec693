r"""Steady motions that change with a parameter, and their stability: continuation along a branch.

A steady motion (`discs.analysis.steady`) is a state y = (q, pi) and a rigid motion with a common rate of roll, (u, Omega, w):

    r' - u - Omega J r = 0,   theta' - w = 0,   phi' - Omega = 0,   pi' = 0.

Newton's method solves this, from the motion at the last value of the parameter. Steady motions come in families, by symmetries and
since discs cannot roll everywhere, so that the matrix M of the linearised equations M x = b has no inverse. Each correction
minimises |M x - b|^2 + a^2 |x|^2, with a far below the slowest rate: the smallest that solves the equations, so that a motion near
the last one is found, stable or not. With b - M x = a z it is the solution of

    [a   M^T] [x]   [0]
    [M   -a ] [-z] = [b],

a sparse symmetric matrix whose condition is |M|/a, and not its square. The motion need not be straight where the last one was: a
state that is known is better given to `modes`.

At first (u, Omega, w) alone are corrected, with the momenta that belong to them, as the shape may stay: else the rounding of stiff
springs, entries of M like K/k^4, roughens the shape of many discs.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike

from discs import checks
from discs.analysis.linear import Linearised
from discs.analysis.modes import Modes, modes
from discs.analysis.steady import Steady, accelerations
from discs.analysis.tangent import Flow, units
from discs.arrays import Float, Matrix
from discs.problem import Problem, State

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEPS = 60
SMALL = 1e-11  # of a correction, relative
ROUNDING = 1e-7  # relative; corrections below this that do not become smaller are rounding
REFINED = 3
FARTHEST = 1e6  # lengths, and rad
LOST = "no steady motion was found; take smaller steps of the parameter, or a first state that is nearer to one"
DAMPED = 1e-3  # of the slowest rate: smaller singular values are those of a family


@dataclass(frozen=True, eq=False)
class Branch:
    """Steady motions along a branch.

    Attributes
    ----------
    value : (M,), of the parameter. modes : the slowest modes of each motion; `modes[i].problem` has it as the initial state.
    """

    value: Float
    modes: tuple[Modes, ...]

    @property
    def growth(self) -> Float:
        """The largest growth rate of each, (M,), among the slowest modes: positive if unstable."""
        return np.array([found.growth for found in self.modes])

    @property
    def turning(self) -> Float:
        """Omega, (M,)."""
        return np.array([found.state.turning for found in self.modes])

    @property
    def drift(self) -> Float:
        """u, (M, 2)."""
        return np.array([found.state.drift for found in self.modes])

    def plot(self, name: str = "parameter") -> "Figure":
        """A diagram: growth and frequency of the slowest modes over the parameter, filled where the motion is unstable.

        name : of the parameter, for the axis.
        """
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.0, 4.0), layout="constrained")
        for ax, part, words in zip(figure.subplots(1, 2), ("real", "imag"), ("growth rate", "frequency"), strict=True):
            for value, found in zip(self.value, self.modes, strict=True):
                rates = getattr(found.rate, part)
                unstable = found.rate.real > 1e-6 * np.abs(found.rate)
                ax.plot(np.full((~unstable).sum(), value), rates[~unstable], "o", color="C0", fillstyle="none", markersize=4)
                ax.plot(np.full(unstable.sum(), value), rates[unstable], "o", color="C1", markersize=4)
            ax.set(xlabel=name, ylabel=words)
            ax.grid(alpha=0.3)
        return figure


def relative_equilibria(make: Callable[[float], Problem], values: ArrayLike, count: int = 8) -> Branch:
    """Steady motions, equilibria among them, for each value of a parameter, with their stability.

    Parameters
    ----------
    make : function of the parameter that returns the problem. The initial state of the first is the first guess.
    values : of the parameter, in the order of the branch.
    count : how many modes of each.

    Raises
    ------
    ValueError : with the value of the parameter, if no steady motion is found near the last one, or if `modes` refuses it.
    """
    if not callable(make):
        raise ValueError(f"make must be a function of the parameter that returns a Problem; got {checks.shown(make)}")
    given = checks.array("values", values).ravel()
    found: list[Modes] = []
    for value in given:
        problem = make(float(value))
        if not isinstance(problem, Problem):
            raise ValueError(f"make must return a Problem; got {checks.shown(problem)} for {value:g}")
        try:
            guess = _driven(problem, found[-1].problem.initial if found else problem.initial)  # type: ignore[arg-type]  # of a chain
            found.append(modes(problem, count, _steady(problem, guess)))
        except ValueError as error:
            raise ValueError(f"at the parameter {value:g}: {error}") from None
    return Branch(given, tuple(found))


def _driven(problem: Problem, guess: State) -> State:
    """A state whose driven discs have the rates of the problem's initial state."""
    rates = {name: np.broadcast_to(getattr(guess, name), problem.chain.n).copy() for name in ("omega", "phi_rate")}
    for row, disc, *_ in () if problem.system.load is None else problem.system.load.axles:
        name = "omega" if row == 2 else "phi_rate"
        rates[name][disc] = np.broadcast_to(getattr(problem.initial, name), problem.chain.n)[disc]
    return replace(guess, **rates)


def _steady(problem: Problem, guess: State) -> State:
    """The steady motion next to a state."""
    flow = Flow(Problem(problem.chain, guess, problem.duration, problem.loads))
    y, unit, rows = flow.start, units(flow), problem.system.rows
    n, m = problem.chain.n, len(rows) * problem.chain.n
    lin = flow.at(y, 0.0)
    start = lin.velocity.mean(axis=1)
    motion = np.array([*start[:2], start[3] if len(start) == 4 else 0.0, start[2]])  # u, Omega, w
    sizes, last = np.concatenate([unit, [unit[0], unit[0], 1.0, 1.0]]), np.inf
    damped = DAMPED * (Steady(lin, np.zeros(2), 0.0).slow or 1 / problem.duration)
    turns, shape = not any(problem.chain.shift), False  # a periodic rod that goes on along a line cannot turn
    for _ in range(STEPS):
        lin = flow.at(y, 0.0)
        rigid = np.zeros((len(rows), n, 4))
        rigid[0, :, 0], rigid[1, :, 1], rigid[2, :, 3] = 1.0, 1.0, 1.0
        if turns:
            rigid[0, :, 2], rigid[1, :, 2], rigid[3:, :, 2] = -lin.z.hi[1], lin.z.hi[0], 1.0
        own = lin.matrix.copy()
        turned = Steady(lin, motion[:2], motion[2]).turned
        turned.resize(own.shape)
        off = lin.rate.copy()
        off[:m] -= (rigid @ motion).ravel()
        along = scipy.sparse.csr_array(-rigid.reshape(m, 4))
        along.resize((y.size, 4))
        scaled = _scaled(scipy.sparse.hstack([own - turned, along]), 1 / unit, sizes)
        if shape:
            correction = sizes * _smallest(scaled, -off / unit, damped)
        else:
            rates = _rates(lin, turns) / sizes[:, None]
            correction = sizes * (rates @ np.linalg.lstsq(scaled @ rates, -off / unit, rcond=None)[0])
        y, motion = y + correction[: y.size], motion + correction[y.size :]
        change = np.abs(correction / sizes).max()
        if not SMALL <= change < np.inf or 0.5 * last < change < (ROUNDING if shape else np.inf):
            if shape:
                break
            shape, change = True, np.inf
        last = change
    lin, fast = flow.at(y, 0.0), 1 + float(np.abs(motion).max())
    if not np.isfinite(y).all() or np.abs(y[:m] / unit[:m]).max() > FARTHEST:
        raise ValueError(LOST)
    slips = (lin.velocity - rigid @ motion).ravel() / unit[:m]
    accelerated, allowed, _ = accelerations(lin, 0.0)
    if np.abs(slips).max() > 1e-7 * fast or (np.abs(accelerated) > np.maximum(allowed, 1e-6 * fast**2)).any():
        raise ValueError(LOST)
    rates = dict(zip(("omega", "phi_rate"), lin.velocity[2:], strict=False))
    return State(**dict(zip(rows, lin.z.hi, strict=True)), **rates)


def _rates(lin: Linearised, turns: bool) -> Float:
    """Changes of (u, Omega, w) alone, and of the momenta with them, (size + 4, 4) or, if the chain cannot turn, (size + 4, 3)."""
    found = np.zeros((lin.rate.size + 4, 4))
    found[-4:] = np.eye(4)
    for motion, row in ((3, 0), (2, 1))[: len(lin.basis) - 2]:
        pi = np.zeros((len(lin.basis) - 2, lin.system.n))
        pi[row] = 1 / lin.basis[2 + row]
        found[:-4, motion] = lin.join(np.zeros_like(lin.basis), pi)
    return found if turns else np.delete(found, 2, axis=1)


def _scaled(matrix: Matrix, rows: Float, columns: Float) -> Matrix:
    """A sparse matrix with its rows and columns multiplied by numbers."""
    found: Matrix = scipy.sparse.diags_array(rows) @ matrix @ scipy.sparse.diags_array(columns)
    return found


def _smallest(matrix: Matrix, right: Float, damped: float) -> Float:
    """The x that minimises |matrix x - right|^2 + damped^2 |x|^2."""
    size = matrix.shape[1]
    one, other = (damped * scipy.sparse.eye_array(count) for count in (size, matrix.shape[0]))
    both = scipy.sparse.block_array([[one, matrix.T], [matrix, -other]], format="csc")
    factors, given = scipy.sparse.linalg.splu(both), np.concatenate([np.zeros(size), right])
    found: Float = factors.solve(given)
    for _ in range(REFINED):  # entries like K/k^4 leave few digits in the first solution
        found += factors.solve(given - both @ found)
    return found[:size]
