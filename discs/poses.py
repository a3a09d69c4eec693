"""How discs stand on the plane, for pictures: from what every Solution has.

Disc i touches the plane at r_i = (x_i, y_i) and stands upright. Its axle points along the heading d_1, which is (cos phi, sin phi)
of discs with a heading of their own and r'/|r'| of the others; it rolls along J d_1 (the paper's (constraintsphi):
r. = R omega J d_1). The spoke that points up at theta = 0 is the paper's director d_3 = cos(theta) e_z + sin(theta) J d_1.
"""

import numpy as np
from numpy.typing import NDArray

from discs import checks
from discs.solution import Solution


def is_ring(run: Solution) -> bool:
    """Whether the last disc is the first one's neighbour: never further from it than two of the longest links of the frame."""
    r = np.stack([run.x, run.y])
    longest = np.hypot(*np.diff(r, axis=2)).max(axis=1)
    return run.s.size > 3 and bool((np.hypot(*(r[..., -1] - r[..., 0])) <= 2 * longest).all())


def slopes(run: Solution) -> NDArray:
    """r', (F, 2, N): as recorded (want "slope"), or by central differences of the positions, one-sided at free ends."""
    if run.slope_x is not None and run.slope_y is not None:
        return np.stack([run.slope_x, run.slope_y], axis=1)
    r = np.stack([run.x, run.y], axis=1)
    if is_ring(run):
        return (np.roll(r, -1, axis=2) - np.roll(r, 1, axis=2)) / (2 * (run.s[1] - run.s[0]))
    return np.gradient(r, run.s, axis=2, edge_order=2)


def axles(run: Solution) -> NDArray:
    """Unit vectors d_1 along the axles, (F, 2, N); zero where r' is."""
    if run.phi is not None:
        return np.stack([np.cos(run.phi), np.sin(run.phi)], axis=1)
    slope = slopes(run)
    length = np.hypot(slope[:, 0], slope[:, 1])[:, None]
    return np.divide(slope, length, out=np.zeros_like(slope), where=length > 0)


def turn(vectors: NDArray) -> NDArray:
    """J (x, y) = (-y, x) for vectors (..., 2, N)."""
    return np.stack([-vectors[..., 1, :], vectors[..., 0, :]], axis=-2)


def picked(s: NDArray, about: int) -> NDArray:
    """Indices of about so many discs to draw: those nearest to equally spaced places, or all of fewer than twice as many."""
    if s.size < 2 * about:
        return np.arange(s.size)
    places = np.linspace(s[0], s[-1], about)
    return np.unique(np.abs(s[:, None] - places).argmin(axis=0))


def instants(run: Solution, count: int) -> NDArray:
    """Indices of at most `count` frames, equally spaced with the first and the last."""
    return np.unique(np.linspace(0, run.t.size - 1, count).round().astype(int))


def drawn_radius(run: Solution, radius: float | None) -> float:
    """The radius to draw discs with: as given, or an eighteenth of the rod, so that discs as large as the rod hide nothing."""
    if radius is None:
        return float(np.ptp(run.s)) / 18
    return checks.number("radius", radius, positive=True)
