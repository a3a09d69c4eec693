"""One run with a method and a step, which `simulate` and the searches for a tolerance are made of."""

import time as clock
from collections.abc import Callable, Iterable
from functools import partial, wraps
from pathlib import Path
from typing import NamedTuple, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.integrators import Integrator, OneStep
from discs.integrators.work import Cut
from discs.problem import Problem
from discs.running.album import Album
from discs.running.engine import WAITING, Overtaken, plain_because, refuse_loads
from discs.running.frames import ROUNDING, frame_times, observed, wanted
from discs.running.progress import NO_BAR, Progress
from discs.running.ready import kernels
from discs.running.recording import Recording, Rows
from discs.running.step_error import Watch
from discs.running.suggest import suggest_dt
from discs.running.time_loop import March
from discs.running.whole_steps import MOST_STEPS, check_steps, steps_before
from discs.solution import Solution
from discs.stats import Stats, begun

Result = TypeVar("Result")
Given = ParamSpec("Given")


class Asked(NamedTuple):
    """What is asked of a run besides its method, step and frames: the arguments of `simulate` with these names."""

    want: Iterable[str] = ()
    progress: bool = False
    engine: str = "compiled"
    checkpoint: str | Path | None = None


def run_fixed(problem: Problem, integrator: Integrator, dt: float, times: Float) -> Solution:
    """A run for a search: equal steps, frames at these times, (F,), and no estimate of the error of the steps."""
    return run_once(problem, integrator, dt, times, Asked(), checked=False)


def _anew(once: Callable[Given, Solution]) -> Callable[Given, Solution]:
    """Decorator: a plain run that its kernels overtake begins anew."""

    @wraps(once)
    def run(*given: Given.args, **named: Given.kwargs) -> Solution:
        try:
            return once(*given, **named)
        except Overtaken:
            return once(*given, **named)

    return run


@_anew
def run_once(
    problem: Problem,
    integrator: Integrator,
    dt: float | None,
    frames: int | ArrayLike,
    asked: Asked,
    checked: bool = True,
    more: Stats | None = None,
    estimate: dict[str, float] | None = None,
) -> Solution:
    """One run; dt and frames are those of `simulate`.

    checked : estimate the error of the steps; otherwise a search asks, whose frames are times. more : further entries of `stats`.
    estimate : of the errors, if known.
    """
    _, progress, engine, checkpoint = asked
    want = () if type(asked.want) is tuple and not asked.want else wanted(asked.want, integrator.offers)
    because = plain_because(problem, integrator, engine, want)
    suggested = dt is None
    h = suggest_dt(problem, integrator) if dt is None else checks.number("dt", dt, positive=True)
    if h > (1 + ROUNDING) * problem.duration and not integrator.adaptive:
        raise ValueError(f"dt must be at most the duration, {problem.duration:g}; got {h:g}")
    times = frame_times(frames, problem.duration) if checked else np.asarray(frames)
    end = float(times[-1])
    if end / h > MOST_STEPS:
        check_steps(end, h)
    system = problem.system
    refuse_loads(problem, integrator)
    offered = set(want) & set(integrator.offers)
    if offered and not system.quadratic:
        raise ValueError(f"{integrator.offers[0]} needs a quadratic potential; that of this chain is not quadratic")
    stepwise = isinstance(integrator, OneStep) and not (integrator.in_lanes and system.lanes is not None)
    recorded = (stepwise or integrator.runs_whole) and checkpoint is None and not want and system.load is None
    there = bool(because) or kernels(engine, problem, integrator, h, not recorded, not progress)
    if not there:
        because = WAITING
    about = begun(integrator, because, want, h, suggested) | (more or {})
    record: Rows = Rows(problem, times) if checkpoint is None else Recording(problem, times, checkpoint, about, estimate)
    steps, rest = steps_before(end, h)
    shown = Progress(integrator.name, steps) if progress else None
    watch = Watch(steps, len(system.rows), system.n) if checked and not integrator.adaptive else None
    started = clock.perf_counter()
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"), shown or NO_BAR, record:
        if record.complete:
            return record.solution({})
        album = Album(system, times, h) if recorded and not because else None
        march = March(problem, integrator, h, not because, watch, "work_by_load" in want, album)
        first = record.begin(march, lambda: observed(march, 0.0, want, bool(offered)))
        if album is not None and (stepwise or _uncut(march.whole, record, 0, march)):
            _fill(album, march, shown, record)
            record.rows, first = album.rows, times.size
        for f in range(first, times.size):
            before, rest = steps_before(float(times[f]), h)
            while march.step < before:
                march.on(before)
                if because == WAITING and there:
                    raise Overtaken
                if shown is not None:
                    shown.update(march.step)
                if checkpoint is not None:
                    record.pause(f, march)
            frame = partial(observed, march, rest, want, bool(offered))
            record.write(f, _uncut(frame, record, f, march))  # not kept in a variable: the next step needs the memory
            if checkpoint is not None:
                record.pause(f + 1, march)
        work = march.work
        told: Stats = about | {"steps": work.taken or march.step, "gradients": work.gradients, "solves": work.solves}
        told["unconverged"] = work.unconverged
        if work.unconverged:
            short = sum(steps_before(time, h)[1] > 0 for time in times.tolist())
            told["short_steps"] = short
            told |= _uncut(march.remedy, record, times.size, march)
        if watch is not None:
            told["step_error"] = _uncut(partial(march.step_error, rest), record, times.size, march)
        return record.solution(told | {"seconds": record.seconds + clock.perf_counter() - started}, march)


def _fill(album: Album, march: March, shown: Progress | None, record: Rows) -> None:
    """Take all steps of a run, and all its frames on the way."""
    frames, steps = album.steps.size, int(album.steps[-1])
    while album.done < frames:
        march.on(steps)
        if shown is not None:
            shown.update(march.step)
        if album.done < frames and album.steps[album.done] == march.step:  # left by compiled steps: it may fail
            frame = partial(observed, march, float(album.rests[album.done]), (), False)
            album.write(_uncut(frame, record, album.done, march))


def _uncut(call: Callable[[], Result], record: Rows, f: int, march: March) -> Result:
    """The result of a call, repeated where Ctrl-C cuts it short without an exception, unless the run ends before frame f."""
    while True:
        try:
            return call()
        except Cut:
            record.pause(f, march)
