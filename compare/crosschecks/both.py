"""Our result for a statement, what SymPy derives of it for peers that take a right-hand side, and the fields of a row with both."""

import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from statistics import median
from typing import Any, ParamSpec, TypeVar

import numpy as np
import sympy as sp

from compare.crosschecks.stated import Stated
from discs import Gauss8, simulate
from discs.arrays import Float

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Ours:
    """Our result at the end.

    Attributes
    ----------
    q : coordinates, (rows, n). force : of the ground, (2, n).
    change : the largest change of the coordinates if the step is doubled.
    seconds : of a run without the forces.
    """

    q: Float
    force: Float
    change: float
    seconds: float


@cache
def ours(stated: Stated) -> Ours:
    """gauss8 with equal steps, solved to rounding; the time is the median of three runs."""
    problem, steps = stated.problem(), round(40 * stated.duration)

    def run(steps: int, **options: Any) -> Any:
        return simulate(problem, Gauss8(tolerance=1e-15), stated.duration / steps, frames=1, progress=False, **options)

    fine, coarse = run(steps, want=("contact_force",)), run(steps // 2)
    q, other = (np.array([getattr(r, row)[-1] for row in stated.rows]) for r in (fine, coarse))
    return Ours(q, fine.contact_force[-1], float(np.abs(q - other).max()), median(timed(run, steps)[1] for _ in range(3)))


def timed(run: Callable[P, T], *args: P.args, **options: P.kwargs) -> tuple[T, float]:
    """A result and its processor time, s."""
    begun = clock.process_time()
    found = run(*args, **options)
    return found, clock.process_time() - begun


@dataclass(frozen=True, eq=False)
class Terms:
    """What SymPy derives of a statement, as functions of NumPy.

    gradient : q -> dV/dq, (rows n). arms : q -> e, (2, n). turning : (q, v) -> e., (2, n). q, v : (rows n), row after row.
    """

    gradient: Callable[[Float], Float]
    arms: Callable[[Float], Float]
    turning: Callable[[Float, Float], Float]


@cache
def terms(stated: Stated) -> Terms:
    """V differentiated and e with its rate, by SymPy."""
    rows, n = len(stated.rows), stated.n
    q, v = sp.symbols(f"q:{rows * n}"), sp.symbols(f"v:{rows * n}")
    by_row = [q[n * row : n * (row + 1)] for row in range(rows)]
    potential = stated.potential(by_row, sp)
    e = sp.Matrix([*stated.arms(by_row, sp)[0], *stated.arms(by_row, sp)[1]])
    gradient = sp.lambdify([q], [sp.diff(potential, c) for c in q], "numpy", cse=True)
    arms = sp.lambdify([q], list(e), "numpy", cse=True)
    turning = sp.lambdify([q, v], list(e.jacobian(q) * sp.Matrix(v)), "numpy", cse=True)
    return Terms(
        lambda q: np.array(gradient(q)),
        lambda q: np.array(arms(q)).reshape(2, n),
        lambda q, v: np.array(turning(q, v)).reshape(2, n),
    )


def start(stated: Stated) -> Float:
    """(q, v) at the start, (2 rows n): velocities from rolling."""
    e, u = terms(stated).arms(stated.q0.ravel()), stated.u0
    return np.concatenate([stated.q0.ravel(), (e * u[0]).ravel(), u.ravel()])


def compared(stated: Stated, q: Float, force: Float | None = None) -> dict[str, Any]:
    """The fields of a row that compare coordinates (rows, n) and, if given, the ground's forces (2, n), with ours."""
    found = ours(stated)
    last = f"y of disc 1; all {q.size} coordinates"
    compared = {"problem": stated.name, "quantity": last, "ours": found.q[1, 0], "theirs": float(q[1, 0])}
    return (
        compared
        | {"difference": float(np.abs(q - found.q).max()), "our_seconds": found.seconds}
        | ({} if force is None else {"quantity": f"{last}, {force.size} multipliers", "difference": largest(stated, q, force)})
    )


def largest(stated: Stated, q: Float, force: Float) -> float:
    """The largest difference from ours, of coordinates and forces."""
    found = ours(stated)
    return float(max(np.abs(q - found.q).max(), np.abs(force - found.force).max()))
