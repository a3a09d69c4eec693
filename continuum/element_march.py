"""Motions of elements in time, by SciPy's methods with control of the error of steps."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float, Matrix

MOST_CALLS = 12 * 2**17  # evaluations of the rates, twelve per step of DOP853
TRIED = 12 * 2**8  # evaluations after which their total is predicted
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
            raise ValueError(
                f"tol is not reached in {MOST_CALLS // 12} time steps of {what}: ask for a larger tol or a shorter duration"
            )
        return rate(t, y)

    options: dict[str, Any] = {"method": "DOP853"} if pattern is None else {"method": "Radau", "jac_sparsity": pattern}
    found = [start[None]] * int(np.count_nonzero(times <= 0))
    for a, b in pairwise(edges):
        low, high = (a + INSIDE * end, b - INSIDE * end) if edges.size > 2 else (a, b)
        asked = times[(times > a) & (times <= b)]
        with np.errstate(over="ignore", invalid="ignore"):  # Radau's differences by unknowns that act on nothing
            part = scipy.integrate.solve_ivp(
                lambda t, y, low=low, high=high: counted(min(max(t, low), high), y),
                (a, b),
                start,
                t_eval=np.append(asked[asked < b], b),
                rtol=1e-12,
                atol=tol,
                **options,
            )
        if not part.success:
            raise ValueError(f"the field could not be integrated: {part.message}; ask for a larger tol or a shorter duration")
        found.append(part.y.T[: asked.size])
        start = part.y[:, -1]
    return np.concatenate(found)
