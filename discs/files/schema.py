"""Format of run files: names, dimensions and units of variables, a problem as data, header and checksums."""

import json
import zlib
from collections.abc import Mapping
from dataclasses import fields
from platform import python_version
from typing import Any, NamedTuple

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.chains.chain import Chain, SteeredChain
from discs.loads.tables import load_of, table_of
from discs.problem import Problem, State
from discs.stats import Stats

FORMAT = "rolling-discs run, version 1"
UNITS = "any consistent system; units name the quantity, as 'length per time'"
WROTE = 1 << 32  # added to the checksum of a written frame, so that it is never zero
STATS_ROOM = 8192  # bytes reserved for the stats of an unfinished run
CHECKSUM = "CRC-32 of the frame plus 2**32; 0 where it has not been written"
CHAINS: dict[str, type[Chain] | type[SteeredChain]] = {"Chain": Chain, "SteeredChain": SteeredChain}


class Quantity(NamedTuple):
    """Dimensions after time, unit and meaning of a recorded quantity."""

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
    "contact_force": Quantity(
        ("axis", "disc"),
        "mass length per time squared; of a field mass per time squared",
        "force of the ground: on each disc, or per length",
    ),
    "end_force": Quantity(("end", "axis"), "mass length per time squared", "force of the ground at the ends of a field"),
    "end_couple": Quantity(("end", "axis"), "mass length squared per time squared", "couple of the ground at the ends of a field"),
    "contact_moments": Quantity(
        ("axis", "moment"), "mass length per time squared", "force of the ground on a field against test functions"
    ),
    "energy_density": Quantity(("disc",), "mass length per time squared", "energy per length of a field"),
    "energy_flux": Quantity(("disc",), "mass length squared per time cubed", "energy per time towards larger s, of a field"),
    "tension": Quantity(("link",), "mass length per time squared", "tension of the links"),
    "energy": Quantity((), "mass length squared per time squared", "kinetic and potential energy"),
    "balance": Quantity(("part",), "mass length squared per time squared", "work of loads, energy that dampers took"),
    "balance_by_load": Quantity(("part", "load"), "mass length squared per time squared", "balance of each load"),
    "reaction": Quantity(("motor",), "mass length squared per time squared", "torques of motors"),
    "modified_energy": Quantity((), "mass length squared per time squared", "invariant of the two-step scheme"),
    "rolling_residual": Quantity((), "length per time", "largest |r. - e omega| over the discs"),
}
# of the motion of a mechanical system, whose energy and discs are recorded as those of a run
MOTION = {
    "q": Quantity(("coordinate",), "unit of each coordinate", "coordinates"),
    "v": Quantity(("coordinate",), "unit of each coordinate per time", "velocities"),
    "multipliers": Quantity(("constraint",), "unit of power per unit of the constraint", "multipliers lambda"),
    "mu": Quantity(("constraint",), "unit of energy per unit of the constraint", "charges of a vakonomic motion"),
    "residual": Quantity((), "unit of the constraint", "largest |A v - b|"),
    "work": Quantity((), "mass length squared per time squared", "work of applied forces"),
    "reaction_work": Quantity((), "mass length squared per time squared", "work of the reaction of constraints"),
}
RECORDED = QUANTITIES | MOTION
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
    """Everything in a file except the frames.

    Attributes
    ----------
    attrs : attributes of the file, text and numbers.
    static : variables that do not depend on time, and the times.
    """

    attrs: dict[str, str | int]
    static: dict[str, Float]


def describe(problem: Problem) -> tuple[dict[str, Any], dict[str, Float]]:
    """A problem as numbers and text, and as arrays, by the names of `PARAMETERS`, where values differ between discs."""
    chain, initial = problem.chain, problem.initial
    given = {f.name: getattr(chain, f.name) for f in fields(chain)}
    given |= {f"initial_{f.name}": getattr(initial, f.name) for f in fields(initial)}
    arrays = {name: value for name, value in given.items() if isinstance(value, np.ndarray)}
    equal = {name: float(value[0]) for name, value in arrays.items() if (value.view(np.int64) == value.view(np.int64)[0]).all()}
    told = {name: value for name, value in given.items() if name not in arrays} | equal
    told = {"chain": type(chain).__name__, **told, "duration": problem.duration}
    if problem.loads:
        told["loads"] = [table_of(load) for load in problem.loads]
    return told, {name: value for name, value in arrays.items() if name not in equal}


def rebuild(told: dict[str, Any], arrays: dict[str, Float]) -> Problem:
    """The problem that `describe` described; ValueError if the data do not make one."""
    given = told | arrays
    loads = given.pop("loads", [])
    if not isinstance(loads, list):
        raise ValueError(f"loads are a list of tables; got {checks.shown(loads)}")
    kind = CHAINS[checks.choice("chain", given.pop("chain", None), CHAINS)]
    duration, n = given.pop("duration", None), checks.whole("n", given.get("n"), 1)
    state: dict[str, Any] = {name.removeprefix("initial_"): given.pop(name) for name in INITIAL if name in given}
    chain = kind(**given)
    full: dict[str, Any] = {name: None if value is None else np.broadcast_to(value, n) for name, value in state.items()}
    return Problem(chain, State(**full), duration, tuple(load_of(load) for load in loads))


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a run depends on."""
    from importlib.metadata import PackageNotFoundError, version  # slow to import

    found = {"python": python_version()}
    for name in ("rolling-discs", "numpy", "scipy", "numba"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def header(
    problem: Problem | None,
    times: Float,
    s: Float | None,
    stats: Stats,
    estimate: dict[str, float] | None,
    complete: bool,
    system: dict[str, Any] | None = None,
) -> Header:
    """The header of a file; `system` are the names and owners of a mechanical system, whose discs, if any, are at places s."""
    told, arrays = describe(problem) if problem is not None else (None, {})
    static = {"time": times} | ({} if s is None else {"s": s}) | arrays
    count = 0 if s is None else s.size
    title = f"a rod on {count} nodes" if "scene" in stats else f"{count} rolling discs"
    if system is not None:
        told, title = {**system, "discs": told}, f"a mechanical system of {len(system['names'])} coordinates"
    attrs: dict[str, str | int] = {
        "format": FORMAT,
        "title": title,
        "unit_system": UNITS,
        "problem": as_text(told),
        "method": str(stats.get("method")),
        "stats": as_text(stats).ljust(0 if complete else STATS_ROOM),  # blanks, which JSON allows, reserve space
        "error_estimate": as_text(estimate),
        "versions": as_text(versions()),
        # the only random number: the start of the search for the stiffest mode
        "seeds": as_text({"suggest_dt": 0} if stats.get("dt_suggested") else {}),
        "complete": int(complete),
    }
    return Header(attrs | {"checksum": header_checksum(attrs, static)}, static)


def header_checksum(attrs: Mapping[str, str | int], static: dict[str, Float]) -> int:
    """Checksum of the problem, the times and the places."""
    total = zlib.crc32(str(attrs["problem"]).encode())
    for name in sorted(static):
        total = zlib.crc32(np.ascontiguousarray(static[name]).data, total)
    return total


def frame_checksum(rows: dict[str, Float]) -> int:
    """Checksum of the arrays of one frame, by name; never zero."""
    total = 0
    for name in sorted(rows):
        total = zlib.crc32(np.ascontiguousarray(rows[name]).data, total)
    return total + WROTE


def as_text(value: object) -> str:
    """`value` as JSON; NumPy's numbers become Python's."""
    return json.dumps(value, default=lambda number: number.tolist())


def fixed(value: str | int) -> np.bytes_ | int:
    """Text as a string of fixed length, which HDF5 stores in the header itself; other values unchanged."""
    return np.bytes_(value.encode()) if isinstance(value, str) else value


def attributes(name: str, dims: tuple[str, ...]) -> dict[str, str]:
    """Unit, meaning and place of a variable."""
    meaning = (RECORDED | PARAMETERS | COORDINATES)[name]
    place = {"coordinates": "s"} if "disc" in dims and name != "s" else {}
    return {"units": meaning.units, "long_name": meaning.long_name} | place


def dimensions(name: str) -> tuple[str, ...]:
    """Dimensions of a variable."""
    return ("time", *RECORDED[name].dims) if name in RECORDED else (PARAMETERS | COORDINATES)[name].dims
