"""Which rates a motion of elements takes: the compiled ones, or the plain ones while they are compiled."""

from collections.abc import Callable

import numpy as np

from continuum.element_grid import Grid
from discs import checks
from discs.arrays import Float
from discs.kernels.background import Kernels, usual
from discs.running.engine import ENGINES

_THERE: list[bool] = []  # not empty if the kernel is there


def ready() -> bool:
    """Whether to use the kernel: the plain form runs until it is compiled, unless DISCS_ENGINE says "compiled" or "plain"."""
    engine = checks.choice("DISCS_ENGINE", usual(), ENGINES)
    if engine not in ("compiled", "plain") and not _THERE and Kernels(engine, load):
        _THERE.append(True)
    return engine == "compiled" or (engine != "plain" and bool(_THERE))


def load() -> None:
    """Compile the kernel, or read it from disc, and call it for one element."""
    from continuum.kernels.elements import rates

    one, two = np.ones(2), np.ones((2, 2))
    rates(np.zeros(12), one[:1], two[:1], two, np.ones((4, 1, 2)), one, two, np.zeros(4), np.empty(12))


def compiled(grid: Grid, stiffness: Float, radius: Float, inertia: Float, closing: Float) -> Callable[[float, Float], Float]:
    """The rates (6 n,) of elements without loads, at a time and unknowns (6 n,); the parameters are those of the kernel."""
    from continuum.kernels.elements import rates

    half, w, d = grid.half[:, 0].copy(), np.ascontiguousarray(grid.w), grid.d

    def rate(t: float, y: Float) -> Float:
        out = np.empty_like(y)
        rates(y, half, w, d, stiffness, radius, inertia, closing, out)
        return out

    return rate
