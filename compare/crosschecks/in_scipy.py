"""SciPy: the textbook's saddle point, in NumPy, with V differentiated by SymPy.

    [[M, A^T], [A, 0]] (v., -lambda) = (-grad V, -A. v),   A v = (x., y.) - e theta.

At every right-hand side it is solved densely, for all coordinates and two multipliers a disc; the constraint holds by its
derivative only. Orders of explicit methods are measured with equal steps: with tolerances so large, every step is the longest one.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from compare.crosschecks.both import compared, ours, start, terms, timed
from compare.crosschecks.stated import Stated
from compare.crosschecks.table import Row, order
from discs.arrays import Float


def saddle(stated: Stated) -> Callable[[Float, Float], tuple[Float, Float]]:
    """(q, v) -> accelerations (rows n) and multipliers (2, n)."""
    t, n, size = terms(stated), stated.n, stated.q0.size
    matrix = np.zeros((size + 2 * n, size + 2 * n))
    matrix[np.arange(size), np.arange(size)] = stated.inertia.ravel()
    rolling = size + np.arange(2 * n)
    matrix[rolling, np.arange(2 * n)] = 1.0
    roll = 2 * n + np.tile(np.arange(n), 2)

    def solve(q: Float, v: Float) -> tuple[Float, Float]:
        matrix[rolling, roll] = -t.arms(q).ravel()
        matrix[:size, size:] = matrix[size:, :size].T
        right = np.concatenate([-t.gradient(q), t.turning(q, v).ravel() * v[roll]])
        found = np.linalg.solve(matrix, right)
        return found[:size], -found[size:].reshape(2, n)

    return solve


def rows() -> list[Row]:
    """DOP853 and Radau for three laws; orders of RK45 and DOP853."""
    return [row for law in ("field", "unit", "own") for row in _rows(Stated(law, 6))]


def _rows(stated: Stated) -> list[Row]:
    solve, y0, size = saddle(stated), start(stated), stated.q0.size

    def rate(t: float, y: Float) -> Float:
        return np.concatenate([y[size:], solve(y[:size], y[size:])[0]])

    def run(method: str, tol: float, **options: Any) -> Float:
        span = (0.0, stated.duration)
        end = solve_ivp(rate, span, y0, method, t_eval=span[1:], rtol=tol, atol=tol, **options)
        if not end.success:
            raise ArithmeticError(f"{method}: {end.message}")
        return np.asarray(end.y[:, -1])

    def error(y: Float) -> float:
        return float(np.abs(y[:size].reshape(stated.q0.shape) - ours(stated).q).max())

    def equal(method: str, steps: Float) -> float:
        h = stated.duration / steps
        return order(h, [error(run(method, 1e9, first_step=step, max_step=step)) for step in h])

    def row(method: str, tol: float, slope: str) -> Row:
        y, seconds = timed(run, method, tol)
        fields = compared(stated, y[:size].reshape(stated.q0.shape), solve(y[:size], y[size:])[1])
        return Row(f"SciPy {method}", **fields, order=slope, their_seconds=seconds, differs="dense saddle point in NumPy")

    fine, loose = (2 if stated.law == "own" else 1), (1e-5, 1e-6, 1e-7)
    explicit = equal("DOP853", fine * np.array([70.0, 100, 140])), equal("RK45", np.array([800.0, 1600]))
    implicit = order(loose, [error(run("Radau", tol)) for tol in loose])
    return [
        row("DOP853", 1e-13, "{:.1f} in the step; RK45 {:.1f}".format(*explicit)),
        row("Radau", 1e-9, f"{implicit:.1f} in the tolerance"),
    ]
