"""Scenes in TOML files."""

import inspect
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

from continuum import parameters
from continuum.rod import PARAMETERS, Scene
from continuum.scenes import LAW, SCENES, steered_rod
from discs import checks
from discs.chains.twist import PAPER
from discs.files.safe import opened
from discs.loads.tables import load_of, named

LARGEST = 2**14  # bytes of a scene file; the memory for a dotted key, as a.a.a, grows with the square of its length


def read_scene(path: str | Path) -> Scene:
    """Read a scene from a TOML file: the key `scene` gives its name, the other keys are its parameters.

        scene = "untwisting_rod"
        rolling = "unit"
        duration = 6.0
        radius = 0.7

        [[loads]]
        load = "Torque"
        pattern = 0.3
        at = 0.0
        signal = { name = "sine", amplitude = 1.0, rate = 2.0 }

    A parameter of the rod that varies is a table, one of `continuum.parameters`:

        density = { name = "polynomial", coefficients = [1.0, 0.25] }
        radius = { name = "table", s = [0.0, 2.0, 4.0], values = [1.0, 0.7, 0.8] }

    Each table `loads` is a load of `discs.loads` with numbers for patterns, `signal` one of `discs.loads.signals`. A table of
    a signal or of a parameter has its values, or `file`, a CSV file beside this one with a line "t, value" or "s, value" for each.

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
    loads = content.pop("loads", [])
    make = SCENES[checks.choice("scene", content.pop("scene"), SCENES)]
    own = [name for name, p in inspect.signature(make).parameters.items() if p.kind is not p.VAR_KEYWORD]
    for key in content:
        checks.choice(f"key of {make.__name__}", key, (*own, *PAPER, *(LAW if make is not steered_rod else ())))
    if not isinstance(loads, list):
        raise ValueError(f"loads of a scene file are tables [[loads]]; got {checks.shown(loads)}")
    folder = Path(path).parent
    for key, value in content.items():
        if key in PARAMETERS and isinstance(value, dict):
            content[key] = named(key, value, parameters.NAMES, folder)
    scene = make(**content)
    return replace(scene, loads=scene.loads + tuple(load_of(load, folder) for load in loads))


def _toml(path: str | Path, content: bytes) -> dict[str, Any]:
    if len(content) > LARGEST:
        raise ValueError(f"the scene file {path} is larger than {LARGEST} bytes; a scene needs some hundreds")
    try:
        return tomllib.loads(content.decode())
    except RecursionError:
        raise ValueError(f"the scene file {path} has more brackets within brackets than can be followed") from None
    except ValueError as error:
        raise ValueError(f"the scene file {path} is not TOML: {error}") from None
