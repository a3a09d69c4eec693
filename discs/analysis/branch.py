r"""Steady motions that change with a parameter, and their stability: continuation along a branch.

A steady motion (`discs.analysis.steady`) is a state y = (q, pi) and a rigid motion with a common rate of roll, (u, Omega, w):

    r' - u - Omega J r = 0,   theta' - w = 0,   phi' - Omega = 0,   pi' = 0.

Newton's method solves this, from the motion at the last value of the parameter. Steady motions come in families, by symmetries and
since discs cannot roll everywhere; each correction is the smallest that solves the linearised equations (the pseudo-inverse), so
that a motion near the last one is found, stable or not. It need not be straight where the last one was: a state that is known is
better given to `modes`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.analysis.modes import Modes, modes
from discs.analysis.steady import accelerations
from discs.analysis.tangent import Flow, units
from discs.arrays import Float
from discs.problem import Problem, State

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 1500  # unknowns: the pseudo-inverse takes a dense matrix
STEPS = 30
SMALL = 1e-11  # of a correction, relative
RANK = 1e-9  # relative; smaller singular values are those of a family


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
        """A diagram: growth and frequency of the slowest modes over the parameter, filled where the motion is unstable."""
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
    if y.size > MOST:
        raise ValueError(f"the branch is followed for at most {MOST} unknowns; this chain has {y.size}: take fewer discs")
    n, m = problem.chain.n, len(rows) * problem.chain.n
    lin = flow.at(y, 0.0)
    start = lin.velocity.mean(axis=1)
    motion = np.array([*start[:2], start[3] if len(start) == 4 else 0.0, start[2]])  # u, Omega, w
    sizes = np.concatenate([unit, [unit[0], unit[0], 1.0, 1.0]])
    for _ in range(STEPS):
        lin = flow.at(y, 0.0)
        rigid = np.zeros((len(rows), n, 4))
        rigid[0, :, 0], rigid[1, :, 1], rigid[2, :, 3] = 1.0, 1.0, 1.0
        rigid[0, :, 2], rigid[1, :, 2], rigid[3:, :, 2] = -lin.z.hi[1], lin.z.hi[0], 1.0
        matrix = np.zeros((y.size, y.size + 4))
        matrix[:, : y.size] = lin.matrix.toarray()
        matrix[:m, y.size :] = -rigid.reshape(m, 4)
        for disc in range(n):
            matrix[disc, n + disc] += motion[2]
            matrix[n + disc, disc] -= motion[2]
        off = lin.rate.copy()
        off[:m] -= (rigid @ motion).ravel()
        correction = sizes * np.linalg.lstsq(matrix * sizes / unit[:, None], -off / unit, rcond=RANK)[0]
        y, motion = y + correction[: y.size], motion + correction[y.size :]
        if np.abs(correction / sizes).max() < SMALL or not np.isfinite(correction).all():
            break
    lin = flow.at(y, 0.0)
    if not np.isfinite(y).all() or np.abs(accelerations(lin, 0.0)[0]).max(initial=0.0) > 1e-6 * (1 + np.abs(motion).max() ** 2):
        raise ValueError("no steady motion was found; take smaller steps of the parameter, or a first state that is nearer to one")
    rates = dict(zip(("omega", "phi_rate"), lin.velocity[2:], strict=False))
    return State(**dict(zip(rows, lin.z.hi, strict=True)), **rates)
