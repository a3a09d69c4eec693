"""Runs as NetCDF-4 files: readable by plain xarray, written completely or not at all, checked when read.

A file contains one variable for each quantity of a `Solution` over the dimensions (time, disc), the problem as JSON in its
attributes (parameters that differ between discs as variables), and a checksum of each frame. Nothing in a file is executed.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.files import safe
from discs.files.framefile import FrameFile, room
from discs.files.schema import (
    CHECKSUM,
    COORDINATES,
    MOTION,
    QUANTITIES,
    RECORDED,
    Header,
    attributes,
    dimensions,
    frame_checksum,
    header,
)
from discs.mechanics import Trajectory
from discs.solution import Result, Solution

if TYPE_CHECKING:
    import xarray

SUFFIXES = (".nc", ".nc4", ".h5", ".hdf5")  # of NetCDF-4, which is HDF5


def recorded(run: Result) -> dict[str, Float]:
    """The recorded arrays of a run, by name; of a mechanical system, also those of its discs."""
    parts: list[tuple[Result, Iterable[str]]] = [(run, (*MOTION, "energy") if isinstance(run, Trajectory) else QUANTITIES)]
    if isinstance(run, Trajectory) and run.bodies is not None:
        parts.append((run.discs, QUANTITIES))
    rows = {name: np.asarray(value) for part, names in parts for name in names if (value := getattr(part, name)) is not None}
    return {name: rows[name] for name in RECORDED if name in rows and rows[name].size}


def _header(run: Result) -> Header:
    discs = None if isinstance(run, Trajectory) and run.bodies is None else run.discs
    problem, s, estimate = (None,) * 3 if discs is None else (discs.problem, discs.s, discs.error_estimate)
    if not isinstance(run, Trajectory):
        return header(problem, run.t, s, run.discs.stats, estimate, True)
    if not (np.diff(run.t) > 0).all():
        raise ValueError("a file holds frames in order of time; those of this motion go back: integrate it forward from its end")
    stats: Any = run.stats | (discs.stats if discs else {})
    return header(problem, run.t, s, stats, None, True, {"names": list(run.names), "owners": list(run.owners)})


def to_xarray(run: Result) -> "xarray.Dataset":
    """A run as an xarray.Dataset, what `xarray.open_dataset` makes of a saved one; names of coordinates and owners are labels."""
    import xarray

    attrs, static = _header(run)
    rows = recorded(run)
    data: dict[str, Any] = {
        name: (dims := dimensions(name), value, {k: v for k, v in attributes(name, dims).items() if k != "coordinates"})
        for name, value in (static | rows).items()
    }
    sums = [frame_checksum({name: value[f] for name, value in rows.items()}) for f in range(run.t.size)]
    data["checksum"] = ("time", np.array(sums, np.int64), {"long_name": CHECKSUM})
    coords = {name: data.pop(name) for name in COORDINATES if name in data}
    if isinstance(run, Trajectory):
        coords |= {dim: (dim, list(names)) for dim, names in (("coordinate", run.names), ("constraint", run.owners)) if names}
    return xarray.Dataset(data, coords, attrs)


def named(path: str | Path) -> Path:
    """The file of a run at a path, links resolved; ValueError for another ending or if no file can be there."""
    real = safe.target(path)
    if Path(path).suffix.lower() not in SUFFIXES:
        raise ValueError(f"{path} would be a NetCDF-4 file: its name must end in {', '.join(SUFFIXES)}")
    return real


def restart_of(path: Path) -> Path:
    """The restart file of an unfinished run at `path`; the process that writes the run holds its lock."""
    return path.with_name(path.name + ".restart")


def busy(path: str | Path) -> ValueError:
    """The error if another run writes the file."""
    return ValueError(f"{path} is being written by another run: wait for its end, or give another path")


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """The real file at a path, to be replaced or deleted; the restart file of an interrupted run is removed too.

    ValueError if a run writes to it.
    """
    real = named(path)
    restart = restart_of(real)
    if not restart.exists():
        yield real
        return
    try:
        held = safe.hold(restart)
    except BlockingIOError:
        raise busy(path) from None
    done = None
    try:
        yield real
        done = restart
    finally:
        safe.release(held, done)


def save(run: Result, path: str | Path) -> None:
    """Write a run. At any time the file at `path` is the complete old or the complete new one.

    Raises
    ------
    ValueError : if the name does not end as those of NetCDF-4 files do, no file can be made there, a run writes to it, or there is
        too little room; if the frames of a mechanical system go back in time.
    """
    rows, head = recorded(run), _header(run)
    shapes = {name: value.shape[1:] for name, value in rows.items()}
    with replacing(path) as real, safe.fresh(real, room(head, shapes)) as new, FrameFile.create(new.name, head, shapes) as file:
        for f in range(run.t.size):
            file.write(f, {name: value[f] for name, value in rows.items()})


def load(path: str | Path) -> Solution | Trajectory:
    """Read a run, or the motion of a mechanical system.

    For a run that was interrupted or killed, the solution has the finished frames, and stats["frames_missing"] is the number of the
    others. Arrays of files above 64 MiB are mapped from the file (changes stay in memory).

    path : of a file that `save` or `simulate(..., checkpoint=)` wrote.

    Raises
    ------
    ValueError : if the file cannot be read, is not a run, is cut off or damaged, or too large for this machine's memory.
    """
    with FrameFile.open(checks.path("path", path)) as file:
        return file.trajectory() if "q" in file else file.solution()
