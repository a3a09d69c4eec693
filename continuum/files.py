"""Scenes in TOML files."""

import inspect
import tomllib
from pathlib import Path
from typing import Any

from continuum.rod import Scene
from continuum.scenes import LAW, SCENES, steered_rod
from discs import checks
from discs.chains.twist import PAPER
from discs.files.safe import opened

LARGEST = 2**14  # bytes of a scene file; the memory for a dotted key, as a.a.a, grows with the square of its length


def read_scene(path: str | Path) -> Scene:
    """Read a scene from a TOML file: the key `scene` gives its name, the other keys are its parameters.

        scene = "untwisting_rod"
        rolling = "unit"
        duration = 6.0
        radius = 0.7

    Raises
    ------
    ValueError : if the file cannot be read, or if a key or value does not belong to the scene.
    """
    with open(opened(path), "rb") as file:
        content = _toml(path, file.read(LARGEST + 1))
    if "scene" not in content:
        raise ValueError(
            f"the scene file {path} must name its scene, as in scene = {next(iter(SCENES))!r}; its keys are {list(content)}"
        )
    make = SCENES[checks.choice("scene", content.pop("scene"), SCENES)]
    named = [name for name, p in inspect.signature(make).parameters.items() if p.kind is not p.VAR_KEYWORD]
    for key in content:
        checks.choice(f"key of {make.__name__}", key, (*named, *PAPER, *(LAW if make is not steered_rod else ())))
    return make(**content)


def _toml(path: str | Path, content: bytes) -> dict[str, Any]:
    if len(content) > LARGEST:
        raise ValueError(f"the scene file {path} is larger than {LARGEST} bytes; a scene needs some hundreds")
    try:
        return tomllib.loads(content.decode())
    except RecursionError:
        raise ValueError(f"the scene file {path} has more brackets within brackets than can be followed") from None
    except ValueError as error:
        raise ValueError(f"the scene file {path} is not TOML: {error}") from None
