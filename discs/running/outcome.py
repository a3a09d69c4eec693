"""The outcome of some of many runs (`discs.running.ensemble`), and its form as data."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from discs.arrays import Float
from discs.files.archive import recorded
from discs.running.failure import SimulationError
from discs.solution import Solution
from discs.stats import Stats


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


def add(number: int, run: Solution, outcome: Outcome) -> None:
    """Add a run to the outcome."""
    rows = {name: value[None] for name, value in recorded(run).items()}
    outcome.blocks.append(Block([number], run.t, rows, [run.stats], [run.error_estimate]))


def fail(number: int, error: Exception, outcome: Outcome) -> None:
    """Add a failure to the outcome, without the runs that some errors hold."""
    if isinstance(error, SimulationError):
        error = SimulationError(error.message, error.step, float(error.time), error.disc, error.slope)
    outcome.failed[number] = error


def as_data(outcome: Outcome) -> dict[str, Any]:
    """An outcome as JSON stores it, arrays as the text of their bytes."""
    blocks = [
        block._asdict() | {"t": _text(block.t), "rows": {name: _text(value) for name, value in block.rows.items()}}
        for block in outcome.blocks
    ]
    failed = [[number, *_words(error)] for number, error in outcome.failed.items()]
    return {"blocks": blocks, "failed": failed, "warned": list(outcome.warned.items())}


def from_data(data: Any, numbers: Sequence[int]) -> Outcome:
    """The outcome that `as_data` stored, of runs with these numbers; ValueError if it is something else."""
    try:
        outcome = _from_data(data)
        whole = all(
            len(block.runs) == len(block.stats) == len(block.estimates)
            and all(value.shape[:2] == (len(block.runs), block.t.size) for value in block.rows.values())
            for block in outcome.blocks
        )
        runs = [number for block in outcome.blocks for number in block.runs]
        whole = whole and sorted([*runs, *outcome.failed]) == sorted(numbers)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError):
        whole = False
    if not whole:
        raise ValueError("the file of a checkpoint must be one that simulate_many has written; what it has of some runs is not")
    return outcome


def _from_data(data: Any) -> Outcome:
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
