"""Geometry of discs for pictures, from a Solution or a textbook's single disc.

Disc i touches the plane at r_i = (x_i, y_i) and stands upright. Its axle points along the heading d_1, which is (cos phi, sin phi)
for discs with own headings and r'/|r'| for the others; it rolls along J d_1 (the paper's (constraintsphi):
r. = R omega J d_1). The spoke that points up at theta = 0 is the paper's director d_3 = cos(theta) e_z + sin(theta) J d_1.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from discs import checks
from discs.arrays import Float, Int
from discs.chains.rolling import ROLLING
from discs.mechanics import Trajectory
from discs.mechanics.bodies import Bodies
from discs.solution import Solution

MOST_FRAMES, MOST_POSES = 5000, 200_000  # of a run that is shown: frames, and frames times drawn discs
TOO_FAR = 0.2  # of the drawn radius: largest error of a point of a rim between two frames


def is_ring(run: Solution) -> bool:
    """Whether the last disc is the first one's neighbour: in every frame they are within two lengths of the longest link."""
    if run.s.size <= 3:
        return False
    r = np.stack([run.x, run.y])
    longest = np.hypot(*np.diff(r, axis=2)).max(axis=1)
    return bool((np.hypot(*(r[..., -1] - r[..., 0])) <= 2 * longest).all())


def slopes(run: Solution) -> Float:
    """r', (F, 2, N): as recorded (want "slope"), or by central differences of the positions, one-sided at free ends.

    For a single disc it is the direction of the axle.
    """
    if run.slope_x is not None and run.slope_y is not None:
        return np.stack([run.slope_x, run.slope_y], axis=1)
    if run.s.size == 1:
        return axles(run)
    r = np.stack([run.x, run.y], axis=1)
    if is_ring(run):
        return np.asarray((np.roll(r, -1, axis=2) - np.roll(r, 1, axis=2)) / (2 * (run.s[1] - run.s[0])))
    slope: Float = np.gradient(r, run.s, axis=2, edge_order=2 if run.s.size > 2 else 1)
    return slope


def axles(run: Solution) -> Float:
    """Unit vectors d_1 along the axles, (F, 2, N); zero where r' is. ValueError for one disc without a heading."""
    if run.phi is not None:
        return np.stack([np.cos(run.phi), np.sin(run.phi)], axis=1)
    if run.s.size == 1:
        raise ValueError("one disc has no centre line to follow: give its heading phi")
    slope = slopes(run)
    length = np.hypot(slope[:, 0], slope[:, 1])[:, None]
    return np.divide(slope, length, out=np.zeros_like(slope), where=length > 0)


def turn(vectors: Float) -> Float:
    """J (x, y) = (-y, x) for vectors (..., 2, N)."""
    return np.stack([-vectors[..., 1, :], vectors[..., 0, :]], axis=-2)


def picked(s: Float, about: int) -> Int:
    """Indices of about `about` discs to draw, nearest to equally spaced places; all, if there are fewer than twice as many."""
    if s.size < 2 * about:
        return np.arange(s.size)
    places = np.linspace(s[0], s[-1], about)
    return np.unique(np.abs(s[:, None] - places).argmin(axis=0))


def instants(run: Solution, count: int) -> Int:
    """Indices of at most `count` frames, equally spaced with the first and the last."""
    return np.unique(np.linspace(0, run.t.size - 1, count).round().astype(int))


def thinned(run: Solution, n: int) -> Solution:
    """The run at the frames that pages and files with n drawn discs hold at most, equally spaced with the first and the last."""
    return run[instants(run, max(2, min(MOST_FRAMES, MOST_POSES // n)))]


def poses(run: Solution, radius: float) -> tuple[Float, Float]:
    """Hubs (F, N, 3) of discs drawn with a radius, and their axes (F, N, 3, 3), columns: the axle d_1, d_3 x d_1, the spoke d_3."""
    axle = np.moveaxis(axles(run), 1, 2)
    flat = np.zeros((*axle.shape[:2], 1))
    first = np.append(axle, flat, axis=2)
    ahead = np.append(np.moveaxis(turn(np.moveaxis(axle, 2, 1)), 1, 2), flat, axis=2)
    spoke = np.sin(run.theta)[..., None] * ahead + np.cos(run.theta)[..., None] * np.array([0.0, 0.0, 1.0])
    hubs = np.stack([run.x, run.y, np.full(run.x.shape, radius)], axis=-1)
    return hubs, np.stack([first, np.cross(spoke, first), spoke], axis=-1)


def drawn_radius(run: Solution, radius: float | None) -> float:
    """The radius to draw discs with: as given, or an eighteenth of the rod, so that large discs do not hide each other.

    Of fewer than seven discs it is a third of their spacing. A single disc is drawn with its true radius or, if that is unknown or
    0, with an eighteenth of the size of its path.
    """
    if radius is not None:
        return checks.number("radius", radius, positive=True)
    if run.s.size > 1:
        return float(np.ptp(run.s)) / min(18, 3 * (run.s.size - 1))
    return _radius(run) or float(max(np.ptp(run.x), np.ptp(run.y))) / 18 or 1.0


def one_disc(path: Trajectory, radius: float) -> Solution:
    """The motion of a single disc, coordinates (x, y, theta, phi) as of `textbook.rolling_disc`, as a run for pictures."""
    if path.q.shape[1] != 4:
        raise ValueError(f"one disc has the coordinates x, y, theta, phi; got {path.q.shape[1]} of them")
    bodies = Bodies(lambda q: q, checks.number("radius", radius, positive=True))
    return replace(path, bodies=bodies, stats={"method": "textbook"}).discs


def _radius(run: Solution) -> float | None:
    """The common radius R of all discs; None if there is none or it is unknown."""
    told = run.problem.chain.radius if run.problem is not None else _scene(run).get("radius", run.stats.get("radius"))
    return float(np.max(told)) if told is not None and np.ptp(told) == 0 else None


def _scene(run: Solution) -> dict[str, Any]:
    """The scene of a field, see `Scene.description` of `continuum.rod`; empty for discs."""
    scene = run.stats.get("scene")
    return scene if isinstance(scene, dict) else {}


def off_between_frames(run: Solution, radius: float) -> float:
    """Largest error of a point of a rim if frames are interpolated linearly, relative to the drawn radius.

    Let D be the increment of a quantity between two frames, and a, b its rates at both times the step. The cubic Hermite
    interpolant differs from the straight line by u (1 - u) [(1 - u) (a - D) - u (b - D)], at most a quarter of the larger of
    |a - D| and |b - D|. The rate of theta is omega. Positions move along J d_1 with the speed R |h| omega, h of the law of
    rolling, and not along the axle; if R is unknown, only the latter is used.
    """
    if run.t.size < 2:
        return 0.0
    h = np.diff(run.t)[:, None]
    turned = _quarter(h, np.diff(run.theta, axis=0), run.omega)
    r, along = np.stack([run.x, run.y], axis=1), axles(run)
    way, size = np.diff(r, axis=0), _radius(run)
    across = [np.abs((way * d).sum(axis=1)) for d in (along[:-1], along[1:])]
    moved = 0.25 * np.maximum(*across)
    rate: Float | None = None
    if run.x_rate is not None and run.y_rate is not None:
        rate = np.stack([run.x_rate, run.y_rate], axis=1)
    elif size is not None:
        rate = size * run.omega[:, None] * _size(run) * turn(along)
    if rate is not None:
        moved = np.hypot(*(_quarter(h, way[:, j], rate[:, j]) for j in range(2)))
    return float((turned + moved / radius).max())


def _quarter(h: Float, change: Float, rate: Float) -> Float:
    return 0.25 * np.maximum(np.abs(h * rate[:-1] - change), np.abs(h * rate[1:] - change))


def _size(run: Solution) -> float | Float:
    """|h| of the law of rolling, (F, 1, N), or 1."""
    told = getattr(run.problem.chain, "rolling", None) if run.problem is not None else _scene(run).get("rolling")
    law = ROLLING.get(str(told)) if run.phi is None else None
    return 1.0 if law is None else law.size(np.hypot(*slopes(run).transpose(1, 0, 2)))[:, None]
