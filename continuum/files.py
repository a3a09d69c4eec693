"""Scenes in TOML files."""

import inspect
import tomllib
from dataclasses import MISSING, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from continuum import parameters
from continuum.rod import PARAMETERS, Scene
from continuum.scenes import LAW, SCENES, steered_rod
from discs import checks
from discs.arrays import Float
from discs.chains.twist import PAPER
from discs.files.safe import opened
from discs.loads import Damping, Force, Motor, OnRod, Rest, Slope, Spring, Torque, signals

LOADS: dict[str, Any] = {cls.__name__: cls for cls in (Torque, Force, Slope, Spring, Damping, Rest, Motor)}
MOST_ROWS = 100_000  # of a CSV file
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
    named = [name for name, p in inspect.signature(make).parameters.items() if p.kind is not p.VAR_KEYWORD]
    for key in content:
        checks.choice(f"key of {make.__name__}", key, (*named, *PAPER, *(LAW if make is not steered_rod else ())))
    if not isinstance(loads, list):
        raise ValueError(f"loads of a scene file are tables [[loads]]; got {checks.shown(loads)}")
    folder = Path(path).parent
    for key, value in content.items():
        if key in PARAMETERS and isinstance(value, dict):
            content[key] = _named(key, value, parameters.NAMES, folder)
    return replace(make(**content), loads=tuple(_load(load, folder) for load in loads))


def _load(given: Any, folder: Path) -> OnRod:
    """A load from its table."""
    if not isinstance(given, dict) or "load" not in given:
        raise ValueError(f'a table [[loads]] must name its load, as load = "Torque"; got {checks.shown(given)}')
    kind = LOADS[checks.choice("load", given["load"], LOADS)]
    values = {key: value for key, value in given.items() if key != "load"}
    _check_keys(kind, values)
    for key in values.keys() & {"signal", "rate"}:
        if key == "signal" or isinstance(values[key], dict):
            values[key] = _named("signal", values[key], signals.NAMES, folder)
    load: OnRod = kind(**values)
    return load


def _named(key: str, given: Any, known: dict[str, Any], folder: Path) -> Any:
    """A signal, or a parameter of the rod that varies, from its table."""
    if not isinstance(given, dict) or "name" not in given:
        raise ValueError(
            f'{key} must be a table with its name, as {{ name = "{next(iter(known))}", ... }}; got {checks.shown(given)}'
        )
    kind = known[checks.choice(key, given["name"], known)]
    values = {name: value for name, value in given.items() if name != "name"}
    if given["name"] == "table" and "file" in values:
        values |= dict(
            zip((f.name for f in fields(kind)), _columns(folder / str(values.pop("file")), fields(kind)[0].name), strict=True)
        )
    _check_keys(kind, values)
    return kind(**values)


def _check_keys(kind: Any, values: dict[str, Any]) -> None:
    """ValueError unless the values are those of the fields of a dataclass, with none missing."""
    known = {f.name: f.default is MISSING for f in fields(kind)}
    for key in values:
        checks.choice(f"key of {kind.__name__}", key, known)
    if missing := [name for name, needed in known.items() if needed and name not in values]:
        raise ValueError(f"{kind.__name__} needs {', '.join(missing)}; got {checks.shown(values)}")


def _columns(path: Path, first: str) -> Float:
    """The two columns of a CSV file, (2, m)."""
    try:
        with open(opened(path), encoding="utf-8") as file:
            found = np.loadtxt(file, delimiter=",", ndmin=2, max_rows=MOST_ROWS)
    except (ValueError, UnicodeError) as error:
        raise ValueError(f"{path} must be lines '{first}, value': {error}") from None
    if found.shape[1] != 2:
        raise ValueError(f"{path} must be lines '{first}, value'; got {found.shape[1]} columns")
    columns: Float = found.T
    return columns


def _toml(path: str | Path, content: bytes) -> dict[str, Any]:
    if len(content) > LARGEST:
        raise ValueError(f"the scene file {path} is larger than {LARGEST} bytes; a scene needs some hundreds")
    try:
        return tomllib.loads(content.decode())
    except RecursionError:
        raise ValueError(f"the scene file {path} has more brackets within brackets than can be followed") from None
    except ValueError as error:
        raise ValueError(f"the scene file {path} is not TOML: {error}") from None
