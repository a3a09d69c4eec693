"""A part of many runs (`discs.running.ensemble`): some runs, one after the other, and their outcome."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from discs.arrays import Float
from discs.files.archive import recorded
from discs.integrators import Integrator
from discs.problem import Problem
from discs.running.failure import SimulationError
from discs.running.stats import Stats
from discs.simulation import simulate
from discs.warn import kept


class Settings(NamedTuple):
    """The arguments of `simulate` that many runs share."""

    method: str | Integrator | None
    dt: float | None
    tol: float | Mapping[str, float] | None
    frames: int | ArrayLike
    want: tuple[str, ...]
    engine: str


class Block(NamedTuple):
    """Runs with frames at the same times and of one shape.

    runs : their numbers, B of them. t : (F,). rows : recorded quantities by name, (B, F, ...). stats, estimates : of each.
    """

    runs: list[int]
    t: Float
    rows: dict[str, Float]
    stats: list[Stats]
    estimates: list[dict[str, float] | None]


class Outcome(NamedTuple):
    """What a part has become. failed : errors by the number of a run. warned : its warnings."""

    blocks: list[Block]
    failed: dict[int, Exception]
    warned: dict[int, list[str]]


def run_part(numbers: Sequence[int], problems: Sequence[Problem], settings: Settings) -> Outcome:
    """Run some problems, with these numbers. A run that fails leaves the others alone."""
    outcome = Outcome([], {}, {})
    for number, problem in zip(numbers, problems, strict=True):
        with kept() as messages:
            run_one(number, problem, settings, outcome)
        if messages:
            outcome.warned[number] = messages
    return outcome


def run_one(number: int, problem: Problem, settings: Settings, outcome: Outcome) -> None:
    """Run one problem and add it to the outcome."""
    method, dt, tol, frames, want, engine = settings
    try:
        run = simulate(problem, method, dt, frames, want, progress=False, engine=engine, tol=tol)
    except SimulationError as error:  # without the runs that some hold
        outcome.failed[number] = SimulationError(error.message, error.step, float(error.time), error.disc, error.slope)
    except Exception as error:
        outcome.failed[number] = error
    else:
        rows = {name: value[None] for name, value in recorded(run).items()}
        outcome.blocks.append(Block([number], run.t, rows, [run.stats], [run.error_estimate]))


def as_data(outcome: Outcome) -> dict[str, Any]:
    """An outcome as JSON stores it, arrays as the text of their bytes."""
    blocks = [
        block._asdict() | {"t": _text(block.t), "rows": {name: _text(value) for name, value in block.rows.items()}}
        for block in outcome.blocks
    ]
    failed = [[number, *_words(error)] for number, error in outcome.failed.items()]
    return {"blocks": blocks, "failed": failed, "warned": list(outcome.warned.items())}


def from_data(data: dict[str, Any]) -> Outcome:
    """The outcome that `as_data` stored."""
    blocks = [
        Block(**block | {"t": _array(block["t"]), "rows": {name: _array(value) for name, value in block["rows"].items()}})
        for block in data["blocks"]
    ]
    failed: dict[int, Exception] = {
        number: SimulationError(*told) if told[1:] else ValueError(*told) for number, *told in data["failed"]
    }
    return Outcome(blocks, failed, dict(data["warned"]))


def _words(error: Exception) -> list[Any]:
    if isinstance(error, SimulationError):
        return [error.message, error.step, error.time, error.disc, error.slope]
    return [str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"]


def _text(array: Float) -> list[Any]:
    return [np.ascontiguousarray(array, float).tobytes().hex(), *np.shape(array)]


def _array(text: list[Any]) -> Float:
    return np.frombuffer(bytes.fromhex(text[0])).reshape(text[1:]).copy()
