"""Motions of elements without loads, compiled whole."""

import signal
from typing import TYPE_CHECKING

import numpy as np

from continuum.element_grid import Grid
from continuum.element_march import MOST_CALLS, RTOL, TRIED, failed, too_many
from discs import checks
from discs.arrays import Float
from discs.kernels.background import Kernels, usual
from discs.running.engine import ENGINES

if TYPE_CHECKING:
    from continuum.kernels.elements import Steered

_THERE: list[bool] = []  # not empty if the kernel is there


def ready() -> bool:
    """Whether to use the kernel: the plain form runs until it is compiled, unless DISCS_ENGINE says "compiled" or "plain"."""
    engine = checks.choice("DISCS_ENGINE", usual(), ENGINES)
    if engine not in ("compiled", "plain") and not _THERE and Kernels(engine, load):
        _THERE.append(True)
    return engine == "compiled" or (engine != "plain" and bool(_THERE))


def load() -> None:
    """Compile the kernel, or read it from disc, and call it for one element."""
    from continuum.kernels.elements import Steered

    one, two = np.ones(2), np.ones((2, 2))
    march(Steered(one[:1], two[:1], two, np.ones((4, 1, 2)), one, two, np.zeros(4)), np.zeros((6, 2)), np.zeros(1), 1.0, "")


def parameters(grid: Grid, stiffness: Float, radius: Float, inertia: Float, closing: Float) -> "Steered":
    """The parameters of the kernel."""
    from continuum.kernels.elements import Steered

    return Steered(grid.half[:, 0].copy(), np.ascontiguousarray(grid.w), grid.d, stiffness, radius, inertia, closing)


def march(rod: "Steered", start: Float, times: Float, tol: float, what: str) -> Float:
    """The unknowns at the times, (F, 6, n); the arguments are those of `continuum.element_march.march`, its plain twin."""
    from continuum.kernels.elements import march as whole
    from discs.kernels.dop853 import coefficients

    found = np.empty((times.size, *start.shape))
    while (reached := whole(coefficients(), rod, start, times, RTOL, tol, TRIED, MOST_CALLS, found))[0] < 0:
        signal.raise_signal(signal.SIGINT)
    done, evaluations = reached
    if done < times.size:
        raise too_many(what) if evaluations >= TRIED else failed("its steps become too short")
    return found
