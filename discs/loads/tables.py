"""Loads as tables of numbers and text: those of scene files, of command lines, and of saved runs."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.files.safe import opened
from discs.loads import signals
from discs.loads.binding import OnRod
from discs.loads.damping import Damping
from discs.loads.forces import Force, Slope, Spring, Torque
from discs.loads.motor import Motor
from discs.loads.rest import Rest

LOADS: dict[str, Any] = {cls.__name__: cls for cls in (Torque, Force, Slope, Spring, Damping, Rest, Motor)}
MOST_ROWS = 100_000  # of a CSV file, or values of a pattern


def load_of(table: Any, folder: Path | None = None) -> OnRod:
    """The load of a table such as {"load": "Torque", "pattern": 0.3, "signal": {"name": "sine", "amplitude": 1.0, "rate": 2.0}}.

    `folder` has the CSV files that tables of signals may name; without one they may not. ValueError for a table of no load.
    """
    if not isinstance(table, dict) or "load" not in table:
        raise ValueError(f'the table of a load must name it, as load = "Torque"; got {checks.shown(table)}')
    kind = LOADS[checks.choice("load", table["load"], LOADS)]
    values = {key: value for key, value in table.items() if key != "load"}
    check_keys(kind, values)
    for key in values.keys() & {"signal", "rate"}:
        if values[key] is not None and (key == "signal" or isinstance(values[key], dict)):
            values[key] = named("signal", values[key], signals.NAMES, folder)
    load: OnRod = kind(**values)
    return load


def table_of(load: Any) -> dict[str, Any]:
    """The table of a load. ValueError if it has functions other than those of `discs.loads.signals`, or is a class of its own."""
    kind: Any = type(load)
    if kind not in LOADS.values():
        names = ", ".join(LOADS)
        raise ValueError(f"a run with the load {checks.shown(load)} cannot be written to a file: files hold {names}")
    found: dict[str, Any] = {"load": kind.__name__}
    for f in fields(kind):
        value = getattr(load, f.name)
        if type(value) in signals.NAMES.values():
            found[f.name] = {"name": type(value).__name__} | {g.name: _plain(getattr(value, g.name)) for g in fields(value)}
        elif callable(value):
            cure = "a signal of discs.loads.signals, such as a table" if f.name in ("signal", "rate") else "numbers for the discs"
            raise ValueError(f"a run cannot be written to a file if {f.name} of {kind.__name__} is a function; give {cure}")
        else:
            found[f.name] = _plain(value)
    return found


def load_of_words(words: Sequence[str]) -> OnRod:
    """The load of words such as "Torque", "pattern=0.3", "at=0.0"; values are those of TOML. ValueError for other words."""
    name, *pairs = words
    try:
        table = tomllib.loads("\n".join(pairs))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"a load is its name and KEY=VALUE with values of TOML, as Torque pattern=0.3; {error}") from None
    return load_of({"load": name} | table, Path())


def named(key: str, table: Any, known: Mapping[str, Any], folder: Path | None) -> Any:
    """A signal, or a parameter of the rod that varies, from its table; ValueError for another one."""
    if not isinstance(table, dict) or "name" not in table:
        raise ValueError(
            f'{key} must be a table with its name, as {{ name = "{next(iter(known))}", ... }}; got {checks.shown(table)}'
        )
    kind = known[checks.choice(key, table["name"], known)]
    values = {name: value for name, value in table.items() if name != "name"}
    if table["name"] == "table" and "file" in values and folder is not None:
        names = [f.name for f in fields(kind)]
        values |= dict(zip(names, _columns(folder / str(values.pop("file")), names[0]), strict=True))
    check_keys(kind, values)
    return kind(**values)


def check_keys(kind: Any, values: Mapping[str, Any]) -> None:
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


def _plain(value: Any) -> Any:
    """Arrays as lists, which JSON and TOML have."""
    if not isinstance(value, np.ndarray | np.generic | list | tuple):
        return value
    if np.size(value) > MOST_ROWS:
        raise ValueError(f"files hold patterns and tables of at most {MOST_ROWS} values; got {np.size(value)}")
    return np.asarray(value).tolist()
