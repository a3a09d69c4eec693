"""Sparse matrices of partial derivatives, by real differences of order 4: for functions of which nothing else is known."""

from collections.abc import Callable

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float, Matrix

STEP = 2e-4  # relative: the error of rounding is 1e-12, that of order 4 as small if f varies over 0.2 or more
WEIGHTS = {1: 2 / 3, 2: -1 / 12}


def slope(call: Callable[[float], Float], size: float) -> Float:
    """The derivative of a function at 0, for changes of its argument of this size."""
    h = STEP * size
    parts = [weight / h * (call(j * h) - call(-j * h)) for j, weight in WEIGHTS.items()]
    return parts[0] + parts[1]


def jacobian(call: Callable[[Float], Float], at: Float) -> Matrix:
    """df/da at the array `at` (rows, n), sparse (f.size, a.size): column by column, 4 a.size evaluations.

    The size of changes is that of the largest value in a row, so f is to vary over such lengths, not over much shorter ones.
    """
    largest = np.abs(at).max(axis=-1, keepdims=True)
    sizes = np.broadcast_to(np.where(largest > 0, largest, 1.0), at.shape)
    rows, columns, values = [], [], []
    for j, size in enumerate(sizes.flat):

        def moved(step: float, j: int = j) -> Float:
            there = at.copy()
            there.flat[j] += step
            return np.asarray(call(there), dtype=float).ravel()

        column = slope(moved, float(size))
        changed = np.flatnonzero(column)
        rows.append(changed)
        columns.append(np.full(changed.size, j))
        values.append(column[changed])
    indices = np.concatenate(rows), np.concatenate(columns)
    return scipy.sparse.csr_array((np.concatenate(values), indices), shape=(np.size(call(at)), at.size))
