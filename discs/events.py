"""Events of a run, for `simulate(..., events=[...])`: a disc reaches a line, two discs touch, friction is exceeded.

An event is a function of a `Moment` (t, x, y, theta, omega, energy, contact_force and more, see `discs.running.moments`) that is
zero when it happens. Any function will do: `lambda now: now.theta[0]`. Two attributes are optional, as in SciPy: `terminal = True`
ends the run there; `direction = 1` counts zeros that are crossed from below only, `-1` from above only.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.running.moments import Moment

__all__ = ["FrictionExceeded", "Line", "Moment", "Touch"]


@dataclass(frozen=True)
class Line:
    """A contact point reaches the straight line through `point` with the normal vector `normal`: normal . (r - point) = 0.

    disc : number of the disc; None is the one that is farthest along the normal.
    terminal, direction : whether it ends the run, and which crossings count, see `discs.events`.

    Raises
    ------
    ValueError : unless point and normal are two finite numbers each, the normal other than zero.
    """

    point: tuple[float, float]
    normal: tuple[float, float]
    disc: int | None = None
    terminal: bool = False
    direction: int = 0

    def __post_init__(self) -> None:
        checks.vector("point", self.point, 2)
        if not checks.vector("normal", self.normal, 2).any():
            raise ValueError("normal must be a vector other than zero; got (0, 0)")
        _check(self)

    def __call__(self, now: Moment) -> float:
        beyond = self.normal[0] * (now.x - self.point[0]) + self.normal[1] * (now.y - self.point[1])
        return float(beyond.max() if self.disc is None else beyond[_of(now, self.disc)[0]])


@dataclass(frozen=True)
class Touch:
    """Two upright discs of equal radius come as close as `gap`, a length > 0, the thickness of a disc.

    Both discs are symmetric about the plane z = R and convex, so they are nearest to each other there, where each is a diameter of
    length 2R along J d_1. The event is the distance of these two segments less the gap.

    one, other : numbers of the discs.
    terminal, direction : whether it ends the run, and which crossings count, see `discs.events`.

    Raises
    ------
    ValueError : for a gap that is not positive, or one disc twice; in a run, for discs of different radii.
    """

    one: int
    other: int
    gap: float
    terminal: bool = False
    direction: int = 0

    def __post_init__(self) -> None:
        checks.number("gap", self.gap, positive=True)
        _check(self, "one", "other")
        if self.one == self.other:
            raise ValueError(f"a disc touches another one: one and other must differ; got {self.one} twice")

    def __call__(self, now: Moment) -> float:
        pair = _of(now, self.one, self.other)
        radius = np.broadcast_to(now.problem.chain.radius, now.x.size)[pair]
        if radius[0] != radius[1]:
            raise ValueError(f"Touch is for discs of equal radius; those of {self.one} and {self.other} are {radius}")
        a, b = np.stack([now.x, now.y], axis=1)[pair]
        axle = now.slope[:, pair] / np.hypot(*now.slope[:, pair])
        u, v = radius[0] * np.stack([-axle[1], axle[0]], axis=1)
        return _segments(a - u, a + u, b - v, b + v) - self.gap


def _check(event: Any, *discs: str) -> None:
    """Check what all events have in common, and the numbers of their discs."""
    for name in discs or ("disc",):
        if discs or event.disc is not None:
            checks.whole(name, getattr(event, name))
    checks.flag("terminal", event.terminal)
    if checks.whole("direction", event.direction) not in (-1, 0, 1):
        raise ValueError(f"direction must be 1, from below only, -1, from above only, or 0, both; got {event.direction}")


def _of(now: Moment, *discs: int) -> list[int]:
    """Numbers of discs; ValueError if the chain has not so many. Negative ones count from the end."""
    n = now.x.size
    for disc in discs:
        if not -n <= disc < n:
            raise ValueError(f"disc must be one of the {n} discs, 0 to {n - 1}; got {disc}")
    return list(discs)


def _segments(a: Float, b: Float, c: Float, d: Float) -> float:
    """The distance between the segments ab and cd in the plane."""

    def side(p: Float, q: Float, r: Float) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
        return 0.0

    def off(p: Float, q: Float, r: Float) -> float:
        share = np.clip((r - p) @ (q - p) / ((q - p) @ (q - p)), 0, 1)
        return float(np.hypot(*(p + share * (q - p) - r)))

    return min(off(a, b, c), off(a, b, d), off(c, d, a), off(c, d, b))


@dataclass(frozen=True, eq=False)
class FrictionExceeded:
    """A disc needs a friction coefficient |lambda|/N above `mu` to keep rolling; `weight` is N, as for `discs.friction_needed`.

    disc : number of the disc; None is the first one of all. (The discs at free ends need more the more discs there are.)
    terminal, direction : whether it ends the run, and which crossings count, see `discs.events`.

    Raises
    ------
    ValueError : unless mu and the weights are positive.
    """

    mu: float
    weight: ArrayLike
    disc: int | None = None
    terminal: bool = False
    direction: int = 1

    def __post_init__(self) -> None:
        checks.number("mu", self.mu, positive=True)
        _check(self)

    def __call__(self, now: Moment) -> float:
        pressed = checks.field("weight", self.weight, now.x.size, least=0.0, strict=True)
        needed = np.hypot(*now.contact_force) / pressed
        return float((needed.max() if self.disc is None else needed[_of(now, self.disc)[0]]) - self.mu)
