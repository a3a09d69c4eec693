"""Where the loads of a scene act: the pieces on which their patterns are smooth, and the points of loads with `at`."""

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np

from continuum.pieces import Cut, Sampled, split
from continuum.rod import Scene
from discs import checks
from discs.arrays import Float
from discs.loads import Custom, OnRod
from discs.loads.binding import sampled

NOT_PATTERNS = ("signal", "rate", "V", "gradient", "force", "power", "per_length")  # functions of other variables than s


def read(name: str, pattern: Any, s: Float, least: float | None = None) -> Float:
    """A pattern, a number or a function of s, at places (S,)."""
    if not callable(pattern):
        checks.number(name, pattern)
    return sampled(name, pattern, s, least)


def patterns(loads: tuple[OnRod, ...]) -> dict[str, Callable[[Float], Float]]:
    """The patterns of loads that are functions of s, by names for messages."""
    found: dict[str, Callable[[Float], Float]] = {}
    for i, load in enumerate(loads):
        for name in (f.name for f in fields(load) if f.name not in NOT_PATTERNS):  # type: ignore[arg-type]  # all are dataclasses
            if callable(pattern := getattr(load, name)):
                found[f"{name} of {type(load).__name__} {i}"] = pattern
    return found


def cut_patterns(scene: Scene) -> Cut | None:
    """The pieces on which the patterns of the loads are smooth; None if no pattern is a function.

    Raises
    ------
    ValueError : for a bad pattern, or one that no pieces resolve.
    """
    given = patterns(scene.loads)
    if not given:
        return None
    length = scene.rod.length
    data = Sampled(lambda s: [read(name, f, s) for name, f in given.items()], length, tuple(given))
    cut = split(data, np.array([0.0, length]))
    if breaks := cut.breaks():
        cut = split(data, np.array([0.0, *breaks, length]))
    if cut.lost.any():
        p = int(np.argmax(cut.lost))
        data.refuse(int(cut.worst[p]), f"is not finite and piecewise smooth at s = {cut.edges[p]:g}", "take one that is")
    return cut


def check_densities(loads: tuple[OnRod, ...]) -> None:
    """ValueError for a force of a user's own that is not per length."""
    if any(isinstance(load, Custom) and not load.per_length for load in loads):
        raise ValueError(
            "Custom: its force acts on each disc, whatever its share of the length, and has no limit of many discs; give one per "
            "length, as Custom(force, per_length=True), or take discs: simulate(lump(scene, n))"
        )


def point_loads(scene: Scene) -> list[float]:
    """The places of loads that act at a point. ValueError for one that is not on the rod."""
    length = scene.rod.length
    points = [checks.number("at of a load", at) for load in scene.loads if (at := getattr(load, "at", None)) is not None]
    if bad := [at for at in points if not 0 <= at <= length]:
        raise ValueError(f"at of a load must be on the rod, from 0 to {length:g}; got {bad[0]:g}")
    return points
