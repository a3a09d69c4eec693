"""Runs in files of other tools: the kind of a file follows from its ending."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from discs.arrays import Array
from discs.files import archive, safe, shapes
from discs.files.schema import RECORDED
from discs.mechanics import Trajectory
from discs.solution import Result

if TYPE_CHECKING:
    import pandas as pd

AXES = "x", "y"


def columns(run: Result) -> dict[str, tuple[str, Array]]:
    """The columns of a run in long form, name: (unit, values): a row for each frame and disc, frame after frame.

    What has a value a frame, as the energy, is repeated for each disc. What has another dimension (links, ends, moments, loads) is
    left out. The motion of a mechanical system has a row for each frame.
    """
    if isinstance(run, Trajectory):
        names = run.names or tuple(f"q{i}" for i in range(run.q.shape[1]))
        found: dict[str, tuple[str, Array]] = {"t": ("time", run.t)} | {
            name: ("its unit", q) for name, q in zip(names, run.q.T, strict=True)
        }
        found |= {f"{name}_rate": ("its unit per time", v) for name, v in zip(names, run.v.T, strict=True)}
        return found | {"energy": (RECORDED["energy"].units, run.energy)}
    one = run.discs
    frames, n = one.x.shape
    table: dict[str, tuple[str, Array]] = {
        "t": ("time", np.repeat(one.t, n)),
        "disc": ("number", np.tile(np.arange(n), frames)),
        "s": ("length", np.tile(one.s, frames)),
    }
    rows = archive.recorded(one)
    for name, (dims, units, _) in RECORDED.items():
        if (value := rows.get(name)) is None:
            continue
        of_discs, _, of_field = units.partition("; of a field ")
        units = of_field if of_field and "scene" in one.stats else of_discs
        if dims == ("disc",):
            table[name] = units, value.ravel()
        elif dims == ("axis", "disc"):
            table |= {f"{name}_{axis}": (units, value[:, i].ravel()) for i, axis in enumerate(AXES)}
        elif not dims:
            table[name] = units, np.repeat(value, n)
    if one.balance is not None:
        table |= {name: (RECORDED["energy"].units, np.repeat(getattr(one, name), n)) for name in ("work", "dissipated")}
    return table


def to_dataframe(run: Result) -> "pd.DataFrame":
    """See `Result.to_dataframe`."""
    import pandas as pd

    table = columns(run)
    frame = pd.DataFrame({name: value for name, (_, value) in table.items()})
    frame.attrs["units"] = {name: units for name, (units, _) in table.items()}
    return frame


def save_csv(run: Result, path: str | Path) -> None:
    """Write the columns of a run as comma-separated values, with units in the first line, as "x (length)"."""
    table = columns(run)
    frame = to_dataframe(run).rename(columns={name: f"{name} ({units})" for name, (units, _) in table.items()})
    with safe.fresh(safe.target(path)) as new:
        frame.to_csv(new, index=False)


KINDS: dict[str, tuple[Callable[[Result, str | Path], None], str]] = {
    ".csv": (save_csv, "a table"),
    ".glb": (shapes.save_glb, "Blender, web pages"),
    ".vtkhdf": (shapes.save_vtkhdf, "ParaView"),
}


def check_kind(path: str | Path) -> str:
    """The ending of a file for a run, in small letters; ValueError if none is written so, or no file can be there."""
    safe.target(path)
    kind = Path(path).suffix.lower()
    if kind not in (*archive.SUFFIXES, *KINDS):
        known = [f"{', '.join(archive.SUFFIXES)} (everything; discs.load reads it)"]
        known += [f"{ending} ({what})" for ending, (_, what) in KINDS.items()]
        raise ValueError(f"{path}: a run is saved in files whose names end in {', '.join(known)}; got {kind or 'no ending'}")
    return kind


def save(run: Result, path: str | Path) -> None:
    """Write a run in the format of the file's ending; see `Result.save`."""
    kind = check_kind(path)
    if kind in KINDS:
        KINDS[kind][0](run, path)
    else:
        archive.save(run, path)
