"""Which rates a motion of elements takes: the compiled ones, or the plain ones while they are compiled."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.kernels.background import Kernels, usual
from discs.running.engine import ENGINES

if TYPE_CHECKING:
    from continuum.elements import Elements

_THERE: list[bool] = []  # not empty if the kernel is there


def rates(elements: "Elements") -> Callable[[float, Float], Float]:
    """The time derivative of the unknowns of elements without loads, (6 n,), at a time and (6 n,)."""
    return compiled(elements) if ready() else elements.rate


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


def compiled(elements: "Elements") -> Callable[[float, Float], Float]:
    """The compiled rates of elements without loads."""
    from continuum.kernels.elements import rates

    grid, scene = elements.grid, elements.scene
    closing = np.array([*(scene.shift if scene.closed else (0.0, 0.0)), 0.0, 2 * np.pi * (scene.turns if scene.closed else 0)])
    half, w, d = np.ascontiguousarray(grid.half[:, 0]), np.ascontiguousarray(grid.w), grid.d
    stiffness, inertia = np.ascontiguousarray(elements.stiffness), np.ascontiguousarray(elements.inertia)
    radius = elements.radius

    def rate(t: float, y: Float) -> Float:
        out = np.empty_like(y)
        rates(y, half, w, d, stiffness, radius, inertia, closing, out)
        return out

    return rate
