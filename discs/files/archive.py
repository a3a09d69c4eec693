"""Runs as files: NetCDF-4 that opens in plain xarray, written whole or not at all, read without trusting it.

A file holds one variable for each quantity of a `Solution` over the dimensions (time, disc), what was computed as JSON in its
attributes (parameters that differ from disc to disc as variables), and a checksum of each frame. Nothing in a file is executed.
"""

import json
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.chains.chain import Chain, SteeredChain
from discs.files import safe
from discs.problem import Problem, State
from discs.solution import Solution

if TYPE_CHECKING:
    import xarray

FORMAT = "rolling-discs run, version 1"
UNITS = "any consistent system; units name the quantity, as 'length per time'"
WROTE = 1 << 32  # added to the checksum of a frame that is there, so that it is never zero
MAPPED = 64 * 2**20  # bytes; arrays of larger files are mapped, not read
SUFFIXES = (".nc", ".nc4", ".h5", ".hdf5")  # of NetCDF-4, which is HDF5
STATS_ROOM = 8192  # bytes; what is kept free for the stats of a run on its way
CHAINS: dict[str, type[Chain] | type[SteeredChain]] = {"Chain": Chain, "SteeredChain": SteeredChain}


class Quantity(NamedTuple):
    """Dimensions after time, unit and meaning of what a frame records."""

    dims: tuple[str, ...]
    units: str
    long_name: str


QUANTITIES = {
    "x": Quantity(("disc",), "length", "contact points, first coordinate"),
    "y": Quantity(("disc",), "length", "contact points, second coordinate"),
    "theta": Quantity(("disc",), "rad", "roll angles"),
    "phi": Quantity(("disc",), "rad", "own headings"),
    "omega": Quantity(("disc",), "rad per time", "rates of roll"),
    "x_rate": Quantity(("disc",), "length per time", "velocities of the contact points, first coordinate"),
    "y_rate": Quantity(("disc",), "length per time", "velocities of the contact points, second coordinate"),
    "phi_rate": Quantity(("disc",), "rad per time", "rates of turning"),
    "slope_x": Quantity(("disc",), "1", "headings r', first coordinate"),
    "slope_y": Quantity(("disc",), "1", "headings r', second coordinate"),
    "contact_force": Quantity(("axis", "disc"), "mass length per time squared", "force of the ground on each disc"),
    "tension": Quantity(("link",), "mass length per time squared", "tension of the links"),
    "energy": Quantity((), "mass length squared per time squared", "kinetic and potential energy"),
    "modified_energy": Quantity((), "mass length squared per time squared", "invariant of the two-step scheme"),
    "rolling_residual": Quantity((), "length per time", "largest |r. - e omega| over the discs"),
}
ROD = {
    "density": Quantity(("disc",), "mass per length", "rho"),
    "spin_inertia": Quantity(("disc",), "mass length", "alpha, moment of inertia about the axle per length"),
    "heading_inertia": Quantity(("disc",), "mass length", "J, moment of inertia about the vertical per length"),
    "radius": Quantity(("disc",), "length", "R"),
    "torsion_stiffness": Quantity(("link",), "mass length cubed per time squared", "beta"),
    "stretch_stiffness": Quantity(("link",), "mass length per time squared", "A"),
    "shear_stiffness": Quantity(("link",), "mass length per time squared", "G"),
    "bending_stiffness": Quantity(("bend",), "mass length cubed per time squared", "K"),
}
INITIAL = {f"initial_{f.name}": QUANTITIES[f.name]._replace(long_name=f"initial {f.name}") for f in fields(State)}
PARAMETERS = ROD | INITIAL
COORDINATES = {
    "time": Quantity(("time",), "time", "times of the frames"),
    "s": Quantity(("disc",), "length", "places along the rod"),
}


class Header(NamedTuple):
    """Everything but the frames.

    Attributes
    ----------
    attrs : attributes of the file, text and numbers.
    static : variables that do not depend on time, and the times.
    """

    attrs: dict[str, Any]
    static: dict[str, Float]


# A problem as data


def describe(problem: Problem) -> tuple[dict[str, Any], dict[str, Float]]:
    """A problem as numbers and words, and arrays by the names of `PARAMETERS` of what differs from disc to disc."""
    chain, initial = problem.chain, problem.initial
    if problem.loads:
        raise ValueError("a run with loads cannot be written to a file: files do not hold loads")
    given = {f.name: getattr(chain, f.name) for f in fields(chain)}
    given |= {f"initial_{f.name}": getattr(initial, f.name) for f in fields(initial)}
    arrays = {name: value for name, value in given.items() if isinstance(value, np.ndarray)}
    equal = {name: float(value[0]) for name, value in arrays.items() if (value.view(np.int64) == value.view(np.int64)[0]).all()}
    told = {name: value for name, value in given.items() if name not in arrays} | equal
    told = {"chain": type(chain).__name__, **told, "duration": problem.duration}
    return told, {name: value for name, value in arrays.items() if name not in equal}


def rebuild(told: dict[str, Any], arrays: dict[str, Float]) -> Problem:
    """The problem of `describe`; whatever does not make one is refused by it with a ValueError."""
    given = told | arrays
    kind = CHAINS[checks.choice("chain", given.pop("chain", None), CHAINS)]
    duration, n = given.pop("duration", None), checks.whole("n", given.get("n"), 1)
    state: dict[str, Any] = {name.removeprefix("initial_"): given.pop(name) for name in INITIAL if name in given}
    chain = kind(**given)
    full: dict[str, Any] = {name: None if value is None else np.broadcast_to(value, n) for name, value in state.items()}
    return Problem(chain, State(**full), duration)


# Datasets


def versions() -> dict[str, str]:
    """Versions of what a run depends on."""
    from importlib.metadata import PackageNotFoundError, version  # slow to import

    found = {"python": python_version()}
    for name in ("rolling-discs", "numpy", "scipy", "numba"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def header(
    problem: Problem | None, times: Float, s: Float, stats: dict[str, Any], estimate: dict[str, float] | None, complete: bool
) -> Header:
    """The header of a file."""
    told, arrays = describe(problem) if problem is not None else (None, {})
    static = {"time": times, "s": s} | arrays
    attrs: dict[str, Any] = {
        "format": FORMAT,
        "title": f"a rod on {s.size} nodes" if "scene" in stats else f"{s.size} rolling discs",
        "unit_system": UNITS,
        "problem": as_text(told),
        "method": str(stats.get("method")),
        "stats": as_text(stats).ljust(0 if complete else STATS_ROOM),  # blanks, which JSON allows, are room for more
        "error_estimate": as_text(estimate),
        "versions": as_text(versions()),
        # the one random thing: where the search for the stiffest mode starts
        "seeds": as_text({"suggest_dt": 0} if stats.get("dt_suggested") else {}),
        "complete": int(complete),
    }
    return Header(attrs | {"checksum": header_checksum(attrs, static)}, static)


def header_checksum(attrs: dict[str, Any], static: dict[str, Float]) -> int:
    """Of the problem, the times and the places."""
    total = zlib.crc32(attrs["problem"].encode())
    for name in sorted(static):
        total = zlib.crc32(np.ascontiguousarray(static[name]).data, total)
    return total


def frame_checksum(rows: dict[str, Float]) -> int:
    """Of what one frame records, by name; never zero."""
    total = 0
    for name in sorted(rows):
        total = zlib.crc32(np.ascontiguousarray(rows[name]).data, total)
    return total + WROTE


def as_text(value: Any) -> str:
    """JSON; numbers of NumPy become Python's."""
    return json.dumps(value, default=lambda number: number.tolist())


def fixed(value: Any) -> Any:
    """A text as one of fixed length, which HDF5 keeps in the header itself."""
    return np.bytes_(value.encode()) if isinstance(value, str) else value


def recorded(run: Solution) -> dict[str, Float]:
    """What the frames of a run hold, by name."""
    return {name: np.asarray(value) for name in QUANTITIES if (value := getattr(run, name)) is not None}


def attributes(name: str, dims: tuple[str, ...]) -> dict[str, str]:
    """Unit, meaning and place of a variable."""
    meaning = (QUANTITIES | PARAMETERS | COORDINATES)[name]
    place = {"coordinates": "s"} if "disc" in dims and name != "s" else {}
    return {"units": meaning.units, "long_name": meaning.long_name} | place


def dimensions(name: str) -> tuple[str, ...]:
    """Dimensions of a variable."""
    return ("time", *QUANTITIES[name].dims) if name in QUANTITIES else (PARAMETERS | COORDINATES)[name].dims


def to_xarray(run: Solution) -> "xarray.Dataset":
    """A run as an xarray.Dataset, what `xarray.open_dataset` makes of a saved one."""
    import xarray

    attrs, static = header(run.problem, run.t, run.s, run.stats, run.error_estimate, True)
    rows = recorded(run)
    data: dict[str, Any] = {
        name: (dims := dimensions(name), value, {k: v for k, v in attributes(name, dims).items() if k != "coordinates"})
        for name, value in (static | rows).items()
    }
    sums = [frame_checksum({name: value[f] for name, value in rows.items()}) for f in range(run.t.size)]
    data["checksum"] = ("time", np.array(sums, np.int64), {"long_name": CHECKSUM})
    coords = {name: data.pop(name) for name in COORDINATES}
    return xarray.Dataset(data, coords, attrs)


CHECKSUM = "CRC-32 of the frame plus 2**32; 0 where it has not been written"


def named(path: str | Path) -> Path:
    """The file of a run that a path names, links followed; ValueError for another ending or where no file can be."""
    real = safe.target(path)
    if Path(path).suffix.lower() not in SUFFIXES:
        raise ValueError(f"{path} would be a NetCDF-4 file: its name must end in {', '.join(SUFFIXES)}")
    return real


def restart_of(path: Path) -> Path:
    """The restart file of a run on its way into the file at `path`; who writes that file holds this one."""
    return path.with_name(path.name + ".restart")


def busy(path: str | Path) -> ValueError:
    """What is raised where another run has the file."""
    return ValueError(f"{path} is being written by another run: wait for its end, or give another path")


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """The real file at a path that is about to be replaced or deleted; what a run that was interrupted has left beside it goes too.

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


def save(run: Solution, path: str | Path) -> None:
    """Write a run; the file at `path` is the old one or the new one, never half of it.

    Raises
    ------
    ValueError : if the name does not end as those of NetCDF-4 files do, no file can be made there, a run writes to it, or there is
        too little room.
    """
    from discs.files.framefile import FrameFile, room

    rows = recorded(run)
    head = header(run.problem, run.t, run.s, run.stats, run.error_estimate, True)
    shapes = {name: value.shape[1:] for name, value in rows.items()}
    with replacing(path) as real, safe.fresh(real, room(head, shapes)) as new, FrameFile.create(new.name, head, shapes) as file:
        for f in range(run.t.size):
            file.write(f, {name: value[f] for name, value in rows.items()})


def load(path: str | Path) -> Solution:
    """Read a run.

    Of a run that was interrupted or killed come the frames that were finished, and stats["frames_missing"] says how many are not
    there. Arrays of files above 64 MiB are mapped from the file (changes stay in memory).

    Raises
    ------
    ValueError : if the file cannot be read, is not a run, is cut off or damaged, or too large for this machine's memory.
    """
    from discs.files.framefile import FrameFile

    with FrameFile.open(path) as file:
        return file.solution()
