"""Searches for steps to a tolerance, of many runs side by side."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from discs.arrays import Float
from discs.integrators import FixedStep, Integrator
from discs.problem import Problem
from discs.running.abreast import FEWEST, side_by_side
from discs.running.doubt import doubted
from discs.running.failure import SimulationError
from discs.running.once import run_fixed
from discs.running.outcome import Outcome, add, fail
from discs.running.tolerance import Request, search_with_doubt
from discs.solution import Solution
from discs.stats import begun
from discs.warn import kept


def search_abreast(
    problems: dict[int, Problem],
    method: Integrator | str,
    tol: float | Mapping[str, float] | None,
    times: Float,
    outcome: Outcome,
) -> None:
    """Run problems of a kind to a tolerance and add them to the outcome: each has its own search, as in `simulate`, and the runs
    that searches ask for go side by side where they have the same step."""
    looking = {number: search_with_doubt(problem, method, tol, times, coarse=True) for number, problem in problems.items()}
    replies: dict[int, Callable[[], Request]] = {number: partial(next, search) for number, search in looking.items()}
    said: dict[int, list[str]] = {number: [] for number in problems}
    while replies:
        together: dict[Any, dict[int, Problem]] = {}
        for number, reply in replies.items():
            try:
                problem, integrator, h, at = reply()
                together.setdefault((integrator, h, at.tobytes()), {})[number] = problem
            except StopIteration as found:
                run, doubt = found.value
                if message := doubted(problems[number], run) + doubt:
                    said[number].append(message)
                add(number, run, outcome)
            except Exception as error:
                fail(number, error, outcome)
        replies = {}
        for (integrator, h, frames), asked in together.items():
            for number, answer in runs_of(asked, integrator, h, np.frombuffer(frames), said).items():
                search = looking[number]
                replies[number] = partial(search.send, answer) if isinstance(answer, Solution) else partial(search.throw, answer)
    outcome.warned.update({number: list(dict.fromkeys(messages)) for number, messages in said.items() if messages})


def runs_of(
    problems: dict[int, Problem], integrator: Integrator, h: float, times: Float, said: dict[int, list[str]]
) -> dict[int, Solution | SimulationError]:
    """Runs with one step, side by side or alone; `said` gets the warnings of those that run alone."""
    runs: dict[int, Solution | SimulationError] = {}
    if len(problems) >= FEWEST and isinstance(integrator, FixedStep):
        found = side_by_side(list(problems.values()), integrator, h, times, False)
        about = begun(integrator, "", (), h, False)
        for i, (number, problem) in enumerate(problems.items()):
            if found is not None and found.done[i]:
                rows: dict[str, Any] = {name: value[i] for name, value in found.rows.items()}
                runs[number] = Solution(t=times, s=problem.chain.s, stats=about | found.stats(i), problem=problem, **rows)
    for number, problem in problems.items():
        if number not in runs:
            with kept() as messages:
                try:
                    runs[number] = run_fixed(problem, integrator, h, times)
                except SimulationError as error:
                    runs[number] = error
            said[number] += messages
    return runs
