"""A field says what scene it is of."""

from collections.abc import Callable
from dataclasses import asdict, replace
from functools import wraps
from typing import Any, Concatenate, ParamSpec

from continuum.rod import Scene
from discs import Solution

Rest = ParamSpec("Rest")


def describe(scene: Scene) -> dict[str, Any]:
    """A scene as numbers and words, all but its initial fields, which are a function."""
    words = {name: getattr(scene, name) for name in ("name", "rolling", "duration", "closed", "shift", "turns")}
    return words | asdict(scene.rod)


def tells_scene(solve: Callable[Concatenate[Scene, Rest], Solution]) -> Callable[Concatenate[Scene, Rest], Solution]:
    """A solver whose solutions have the scene in stats["scene"]."""

    @wraps(solve)
    def told(scene: Scene, *args: Rest.args, **options: Rest.kwargs) -> Solution:
        found = solve(scene, *args, **options)
        return replace(found, stats=found.stats | {"scene": describe(scene)})

    return told
