"""Odd arguments for every public function: each call must give a right result or a clear error of the project's.

    python -m tests.fuzz --seed 1 --count 2000 --minutes 10
    python -m tests.fuzz --seed 1 --only simulate Torque

Not part of the tests; `tests/test_fuzz.py` runs a short part of it. A finding is

* an exception other than ValueError, SimulationError and OSError, or one that another package raised;
* an error that does not name the argument (`--words` prints these);
* a number that is not finite in a result, without a warning;
* a warning of NumPy's, SciPy's or Python's (RuntimeWarning, DeprecationWarning);
* a call that takes more than 20 seconds of processor time.
"""

import argparse
import contextlib
import io
import os
import random
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from discs import SimulationError, checks
from discs.kernels.background import USUAL
from tests.fuzz import doors, made, odd

ROOT = Path(__file__).parents[2]
OURS = tuple(str(ROOT / name) for name in ("discs", "continuum", "compare"))
SECONDS = 20
TIMES = ("dt", "duration", "times", "make")  # tiny steps and long runs are right, and take as long as they do
DONE, REFUSED, WORDS, FAULT = "done", "refused", "words", "fault"


class TimeUp(BaseException):
    """A call takes too long."""


@contextlib.contextmanager
def at_most(seconds: int) -> Iterator[None]:
    """TimeUp after so many seconds of processor time, or twenty times as many of the clock."""

    def up(*_: object) -> None:
        raise TimeUp

    before = signal.signal(signal.SIGPROF, up), signal.signal(signal.SIGALRM, up)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.alarm(20 * seconds)  # of a call that waits for something
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.alarm(0)
        signal.signal(signal.SIGPROF, before[0])
        signal.signal(signal.SIGALRM, before[1])


class Answer(NamedTuple):
    """What came of a call: done, refused in words, refused in words that name no argument, or a fault."""

    kind: str
    door: str
    given: str
    said: str
    trace: str = ""


def infinite(value: Any, depth: int = 0) -> str:
    """Where a result has a number that is not finite; "" if nowhere. An infinite horizon has its meaning."""
    if isinstance(value, np.ndarray):
        return "array" if value.dtype.kind in "fc" and not np.isfinite(value).all() else ""
    if isinstance(value, float | complex):
        return "number" if np.isnan(value) else ""
    if depth < 3 and isinstance(value, dict):
        return next((f"{name}: {where}" for name, v in value.items() if (where := infinite(v, depth + 1))), "")
    if depth < 3 and isinstance(value, list | tuple):
        return next((where for v in value if (where := infinite(v, depth + 1))), "")
    if hasattr(value, "energy") and hasattr(value, "x"):
        return next((name for name in ("x", "y", "theta", "omega", "energy") if infinite(getattr(value, name))), "")
    return ""


def draw(rng: random.Random, every: list[doors.Door]) -> tuple[doors.Door, dict[str, Any]]:
    """A door and the odd values of one or two of its arguments."""
    door = rng.choices(every, [d.weight for d in every])[0]
    names = list(door.usual())
    chosen = rng.sample(names, min(len(names), 1 + (rng.random() < 0.2)))
    return door, {name: door.odd.get(name, odd.value if name not in TIMES else odd.time)(rng) for name in chosen}


def ask(door: doors.Door, given: dict[str, Any]) -> Answer:
    """Call a function with odd values."""
    shown = ", ".join(f"{name}={checks.shown(value)}" for name, value in given.items())
    told: list[str] = []
    try:
        with at_most(SECONDS), warnings.catch_warnings(record=True) as caught, contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("always")
            result = door.use(door.function(**door.usual() | given))
            told = [w.category.__name__ for w in caught]
    except (ValueError, OSError, SimulationError, *door.raises) as error:
        frames = traceback.extract_tb(error.__traceback__)
        trace = "".join(traceback.format_exception(error))
        last = frames[-1]
        if not last.filename.startswith((*OURS, str(ROOT / "tests/fuzz"))) or "raise" not in (last.line or "raise"):
            return Answer(FAULT, door.name, shown, f"of another package: {type(error).__name__}: {error}", trace)
        noise = [w for w in caught if not issubclass(w.category, UserWarning)]
        if noise:
            return Answer(FAULT, door.name, shown, f"{noise[0].category.__name__}: {noise[0].message}, then {error}", trace)
        words = str(error).lower().replace("'", "")
        named = bool(door.odd) or any(name.lower().split("_")[0] in words for name in given) or door.name.lower() in words
        return Answer(REFUSED if named else WORDS, door.name, shown, f"{type(error).__name__}: {error}")
    except TimeUp:
        return Answer(FAULT, door.name, shown, f"takes more than {SECONDS} s of processor time")
    except Exception as error:
        return Answer(FAULT, door.name, shown, f"{type(error).__name__}: {error}", "".join(traceback.format_exception(error)))
    noise = [w for w in caught if not issubclass(w.category, UserWarning)]
    if noise:
        return Answer(FAULT, door.name, shown, f"{noise[0].category.__name__}: {noise[0].message}")
    if not told and (where := infinite(result)):
        return Answer(FAULT, door.name, shown, f"{where} is not finite, without a word")
    return Answer(DONE, door.name, shown, f"{type(result).__name__}")


def answers(seed: int, count: int, seconds: float = np.inf, only: list[str] | None = None) -> Iterator[Answer]:
    """Answers to `count` odd calls, drawn by the seed, until the time is up."""
    rng, begun = random.Random(seed), time.monotonic()
    every = [door for door in doors.doors() if not only or door.name in only]
    for _ in range(count):
        if time.monotonic() - begun > seconds:
            return
        yield ask(*draw(rng, every))


def main() -> int:
    p = argparse.ArgumentParser(prog="python -m tests.fuzz", description="Odd arguments for every public function.")
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--count", type=int, default=2000)
    p.add_argument("--minutes", type=float, default=10.0)
    p.add_argument("--only", nargs="+", choices=[door.name for door in doors.doors()], metavar="DOOR")
    p.add_argument("--words", action="store_true", help="show errors that name no argument")
    p.add_argument("--traces", action="store_true", help="show tracebacks of findings")
    chosen = p.parse_args()
    os.chdir(made.FOLDER)
    USUAL[0] = "plain"  # nothing is compiled
    kinds: Counter[str] = Counter()
    for answer in answers(chosen.seed, chosen.count, 60 * chosen.minutes, chosen.only):
        kinds[answer.kind] += 1
        if answer.kind == FAULT or (answer.kind == WORDS and chosen.words):
            print(f"{answer.kind}: {answer.door}({answer.given}) -> {answer.said}", flush=True)
            if chosen.traces:
                print(answer.trace)
    print(
        f"{kinds.total()} calls: {kinds[DONE]} gave a result, {kinds[REFUSED] + kinds[WORDS]} were refused, {kinds[FAULT]} findings"
    )
    return int(kinds[FAULT] > 0)


if __name__ == "__main__":
    sys.exit(main())
