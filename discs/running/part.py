"""A part of many runs (`discs.running.ensemble`): some runs, side by side or one after the other, and their outcome."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from discs.integrators import FixedStep, Integrator, find
from discs.kernels.vectors import LANES
from discs.problem import Problem
from discs.running.abreast import FEWEST, kind_of, side_by_side
from discs.running.frames import frame_times
from discs.running.outcome import Block, Outcome, add, fail
from discs.running.searches import search_abreast
from discs.running.suggest import suggest_dt
from discs.simulation import simulate
from discs.stats import Stats, begun
from discs.warn import kept

MOST = 8  # runs in a part, one by one
WIDEST = 32  # bundles in a part, ...
DISCS = 8192  # ... or so many discs


class Settings(NamedTuple):
    """The arguments of `simulate` that many runs share."""

    method: str | Integrator | None
    dt: float | None
    tol: float | Mapping[str, float] | None
    frames: int | ArrayLike
    want: tuple[str, ...]
    engine: str


class Part(NamedTuple):
    """Some runs. numbers : of the problems. abreast : whether they run side by side."""

    numbers: list[int]
    abreast: bool


def parts_of(problems: Sequence[Problem], settings: Settings) -> list[Part]:
    """The parts of some runs; they depend on nothing else, so that runs that continue have the same parts."""
    kinds: dict[Any, list[int]] = {}
    methods, alone = in_lanes(settings), list[int]()
    for i, problem in enumerate(problems):
        if methods and (kind := kind_of(problem)) is not None:
            suggested = settings.dt is None and not to_a_tolerance(settings)
            kinds.setdefault((*kind, suggest_dt(problem, methods) if suggested else 0), []).append(i)
        else:
            alone.append(i)
    parts = []
    for (n, *_), numbers in kinds.items():
        if len(numbers) < FEWEST:
            alone += numbers
        else:
            most = LANES * max(1, min(WIDEST, DISCS // (n * LANES)))
            parts += [Part(numbers[i : i + most], True) for i in range(0, len(numbers), most)]
    alone.sort()
    return parts + [Part(alone[i : i + MOST], False) for i in range(0, len(alone), MOST)]


def to_a_tolerance(settings: Settings) -> bool:
    """Whether the runs have a tolerance, as those of `simulate` with the same arguments."""
    return settings.tol is not None or settings.method == "auto" or (settings.method is None and settings.dt is None)


def in_lanes(settings: Settings) -> Integrator | str | None:
    """The method, if runs with it can go side by side."""
    if settings.engine == "plain" or settings.want:
        return None
    if to_a_tolerance(settings) and settings.method in (None, "auto"):
        return "auto"
    integrator = find("midpoint" if settings.method is None else settings.method)
    return integrator if isinstance(integrator, FixedStep) and integrator.in_lanes else None


def run_part(part: Part, problems: Sequence[Problem], settings: Settings) -> Outcome:
    """Run the problems of a part. A run that fails leaves the others alone."""
    outcome = Outcome([], {}, {})
    given = dict(zip(part.numbers, problems, strict=True))
    if part.abreast:
        given = run_abreast(given, settings, outcome)
    for number, problem in given.items():
        with kept() as messages:
            run_one(number, problem, settings, outcome)
        if messages:
            outcome.warned[number] = messages
    return outcome


def run_abreast(problems: dict[int, Problem], settings: Settings, outcome: Outcome) -> dict[int, Problem]:
    """Run problems of a kind side by side and add them to the outcome; returns those that have to run one by one."""
    given, method = list(problems.values()), in_lanes(settings)
    assert method is not None
    try:
        times = frame_times(settings.frames, given[0].duration)
    except ValueError:  # as each run says
        return problems
    if to_a_tolerance(settings):
        search_abreast(problems, method, settings.tol, times, outcome)
        return {}
    assert isinstance(method, FixedStep)
    h = suggest_dt(given[0], method) if settings.dt is None else settings.dt
    found = side_by_side(given, method, h, times)
    if found is None:
        return problems
    done = np.flatnonzero(found.done)
    if done.size:
        about = begun(method, "", (), h, settings.dt is None)
        numbers, rows = list(problems), {name: value[done] for name, value in found.rows.items()}
        stats = [about | found.stats(int(i)) | Stats(step_error=float(found.errors[i])) for i in done]
        outcome.blocks.append(Block([numbers[i] for i in done], times, rows, stats, [None] * done.size))
    return {number: problem for (number, problem), ran in zip(problems.items(), found.done, strict=True) if not ran}


def run_one(number: int, problem: Problem, settings: Settings, outcome: Outcome) -> None:
    """Run one problem and add it to the outcome."""
    method, dt, tol, frames, want, engine = settings
    try:
        add(number, simulate(problem, method, dt, frames, want, progress=False, engine=engine, tol=tol), outcome)
    except Exception as error:
        fail(number, error, outcome)
