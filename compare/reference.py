"""Where a motion of discs ends, by "gauss8" with short steps, and how far another end is off."""

import numpy as np

from discs import Gauss8, Problem, simulate
from discs.arrays import Float


def reference(problem: Problem, steps: int = 1000) -> tuple[Float, float]:
    """Positions at the end by "gauss8" with 2 `steps` steps, (rows, n), and the change from half as many."""
    found = []
    fewest = steps if problem.system.parameters is not None else steps // 4  # the plain form takes 50 times as long
    for count in (fewest, 2 * fewest):
        run = simulate(problem, Gauss8(tolerance=1e-14, sweeps=20), problem.duration / count, frames=1, progress=False)
        found.append(np.array([getattr(run, row)[-1] for row in problem.system.rows]))
    return found[1], distance(found[0], found[1])


def distance(q: Float, exact: Float, sizes: Float | None = None) -> float:
    """Largest difference, each row relative to its largest value; absolute of a row that is zero or rounding.

    sizes : (rows,), the values that differences are relative to; None for the largest of `exact`.
    """
    size = (np.abs(exact).max(axis=1) if sizes is None else sizes)[:, None]
    return float((np.abs(q - exact) / np.where(size > 1e-12, size, 1.0)).max())


def rms_distance(q: Float, exact: Float) -> float:
    """The largest root mean square difference of a row, each relative to that of its values; absolute of a row that is zero."""
    size = np.sqrt((exact**2).mean(axis=1))
    return float((np.sqrt(((q - exact) ** 2).mean(axis=1)) / np.where(size > 1e-12, size, 1.0)).max())
