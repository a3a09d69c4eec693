"""Motions of elements in time, by SciPy's methods with control of the error of steps; without loads `continuum.element_whole`."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float, Matrix

MOST_CALLS = 12 * 2**17  # evaluations of the rates, twelve per step of DOP853
TRIED = 12 * 2**8  # evaluations after which their total is predicted
RTOL = 1e-12  # relative tolerance of the steps
INSIDE = 1e-12  # of the duration: signals are evaluated this far from their jumps, on the side of the step


def march(
    rate: Callable[[float, Float], Float], start: Float, times: Float, edges: Float, tol: float, what: str, pattern: Matrix = None
) -> Float:
    """The unknowns at the times, (F, m), with an error of the steps below tol.

    Parameters
    ----------
    rate : the time derivative of the unknowns (m,).
    times : (F,), increasing.
    edges : (P + 1,), from 0: steps end there, and `rate` is evaluated on their side of each.
    what : the system in words, for messages.
    pattern : where the Jacobian of `rate` has entries, (m, m), for stiff systems: Radau's method of order 5. None for DOP853.
    """
    calls, end = 0, max(float(times[-1]), 1e-300)
    edges = np.append(edges[edges < end], end)

    def counted(t: float, y: Float) -> Float:
        nonlocal calls
        calls += 1
        if calls > MOST_CALLS or (calls == TRIED and pattern is None and t * MOST_CALLS < TRIED * end):
            raise too_many(what)
        return rate(t, y)

    options: dict[str, Any] = {"rtol": RTOL, "atol": tol}
    method = scipy.integrate.DOP853 if pattern is None else partial(scipy.integrate.Radau, jac_sparsity=pattern)
    found = [start] * int(np.count_nonzero(times <= 0))
    for a, b in pairwise(edges):
        low, high = (a + INSIDE * end, b - INSIDE * end) if edges.size > 2 else (a, b)

        def inside(t: float, y: Float, low: float = low, high: float = high) -> Float:
            return counted(min(max(t, low), high), y)

        with np.errstate(over="ignore", invalid="ignore"):  # Radau's differences by unknowns that act on nothing
            solver = method(inside, a, start, b, **options)
            while solver.status == "running":
                t, y = solver.t, solver.y
                step(solver)
                for asked in times[(times > t) & (times <= solver.t)]:
                    if asked == solver.t:
                        found.append(solver.y)
                    elif pattern is not None:
                        found.append(solver.dense_output()(asked))
                    else:  # a shorter step: inside steps near the limit of stability the polynomial of order 7 is far less accurate
                        short = method(inside, t, y, asked, first_step=asked - t, **options)
                        while short.status == "running":
                            step(short)
                        found.append(short.y)
        start = solver.y
    return np.array(found)


def step(solver: Any) -> None:
    message = solver.step()
    if solver.status == "failed":
        raise failed(message)


def too_many(what: str) -> ValueError:
    """The error for a motion of a system, in words, that takes more than MOST_CALLS evaluations."""
    return ValueError(f"tol is not reached in {MOST_CALLS // 12} time steps of {what}: ask for a larger tol or a shorter duration")


def failed(message: str) -> ValueError:
    """The error for steps that fail."""
    return ValueError(f"the field could not be integrated: {message}; ask for a larger tol or a shorter duration")
