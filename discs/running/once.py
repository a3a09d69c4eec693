"""One run with a method and a step, which `simulate` and the searches for a tolerance are made of."""

import time as clock
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.integrators import Integrator
from discs.integrators.work import Cut
from discs.kernels.background import Kernels
from discs.problem import Problem
from discs.running.album import Album
from discs.running.engine import WAITING, plain_because, refuse_loads
from discs.running.frames import ROUNDING, frame_times, observed, wanted
from discs.running.plan import Plan, records
from discs.running.progress import NO_BAR, NoBar, Progress
from discs.running.ready import kernels
from discs.running.recording import Recording, Rows
from discs.running.step_error import Watch
from discs.running.suggest import suggest_dt
from discs.running.time_loop import March, quiet
from discs.running.whole_steps import MOST_STEPS, check_steps, steps_before
from discs.solution import Solution
from discs.stats import Stats, begun

Result = TypeVar("Result")


class Asked(NamedTuple):
    """What is asked of a run besides its method, step and frames: the arguments of `simulate` with these names."""

    want: Iterable[str] = ()
    progress: bool = False
    engine: str = "compiled"
    checkpoint: str | Path | None = None


def run_fixed(problem: Problem, integrator: Integrator, dt: float, times: Float) -> Solution:
    """A run for a search: equal steps, frames at these times, (F,), and no estimate of the error of the steps."""
    return run_once(problem, integrator, dt, times, Asked(), checked=False)


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
    _, progress, _, checkpoint = asked
    want = () if type(asked.want) is tuple and not asked.want else wanted(asked.want, integrator.offers)
    h = suggest_dt(problem, integrator) if dt is None else checks.number("dt", dt, positive=True)
    if h > (1 + ROUNDING) * problem.duration and not integrator.adaptive:
        raise ValueError(f"dt must be at most the duration, {problem.duration:g}; got {h:g}")
    times = frame_times(frames, problem.duration) if checked else np.asarray(frames)
    end = times.item(-1)
    if end / h > MOST_STEPS:
        check_steps(end, h)
    plan, there = planned(problem, integrator, asked, want, h)
    about = begun(integrator, plan.because, want, h, dt is None, plan.threads)
    if more:
        about |= more
    last, started = steps_before(end, h), clock.perf_counter()
    steps, rest = last
    watch = Watch(steps, len(plan.system.rows), plan.system.n) if checked and not integrator.adaptive else None
    march = None
    if plan.records:
        album = Album(plan.system, times, h, last)
        march = March(plan, h, watch, album)
        if not integrator.runs_whole or _uncut(march.whole):
            _fill(album, march, steps, progress)
            _tell(about, march, times, rest)
            about["seconds"] = clock.perf_counter() - started
            return Solution.of(problem, plan.s.copy(), times, about, album.rows)
    record = Rows(problem, times) if checkpoint is None else Recording(problem, times, checkpoint, about.copy(), estimate)
    with quiet(), Progress(integrator.name, steps) if progress else NO_BAR as shown, record:
        if record.complete:
            return record.solution({})
        march = march or March(plan, h, watch)
        first = 0 if checkpoint is None else record.begin(march, partial(observed, march, 0.0))
        if _frame_by_frame(march, record, first, shown, there):
            _tell(about, march, times, rest, partial(record.pause, times.size, march))
            about["seconds"] = record.seconds + clock.perf_counter() - started
            return record.solution(about, march)
    return run_once(problem, integrator, dt, frames, asked, checked, more, estimate)  # overtaken by its kernels


def planned(problem: Problem, integrator: Integrator, asked: Asked, want: tuple[str, ...], h: float) -> tuple[Plan, Kernels | bool]:
    """The plan of a run, and what becomes true if kernels overtake it. ValueError for an engine, loads or quantities in `want`
    that do not fit.

    The last plan of a problem is kept, unless its runs wait for kernels.
    """
    _, progress, engine, checkpoint = asked
    last = problem.kept.get("plan")
    if last is not None:
        plan, for_engine, in_memory = last
        same = plan.integrator is integrator and for_engine is engine and in_memory is (checkpoint is None) and plan.want == want
        if same and plan.threads == integrator.threads(plan.system):
            return plan, False
    because = plain_because(problem, integrator, engine, want)
    refuse_loads(problem, integrator)
    if want and not problem.system.quadratic and not set(want).isdisjoint(integrator.offers):
        raise ValueError(f"{integrator.offers[0]} needs a quadratic potential; that of this chain is not quadratic")
    recorded = checkpoint is None and records(problem, integrator, want)
    there = bool(because) or kernels(engine, problem, integrator, h, not recorded, not progress)
    if there:
        plan = Plan(problem, integrator, because, want, recorded and not because)
        problem.kept["plan"] = plan, engine, checkpoint is None
        return plan, False
    return Plan(problem, integrator, WAITING, want), there


def _fill(album: Album, march: March, steps: int, progress: bool) -> None:
    """Take all steps of a run, and its frames on the way."""
    frames = album.times.size
    if album.done < frames:
        march.on(steps)
    if album.done == frames:  # as after most runs, which take one call
        return
    with quiet(), Progress(march.integrator.name, steps) if progress else NO_BAR as shown:
        while album.done < frames:
            if album.steps[album.done] == march.step:  # a frame that compiled steps left: it may fail
                album.write(_uncut(partial(observed, march, float(album.rests[album.done]))))
            else:
                march.on(steps)
                shown.update(march.step)


def _frame_by_frame(march: March, record: Rows, first: int, shown: Progress | NoBar, there: Kernels | bool) -> bool:
    """Take a run from frame number `first` on; False as soon as its kernels are `there`, so that it begins anew."""
    for f in range(first, record.times.size):
        before, rest = steps_before(float(record.times[f]), march.h)
        while march.step < before:
            march.on(before)
            if there:
                return False
            shown.update(march.step)
            record.pause(f, march)
        pause = partial(record.pause, f, march)
        record.write(f, _uncut(partial(observed, march, rest), pause))  # not kept in a variable: the next step needs the memory
        record.pause(f + 1, march)
    return True


def _tell(about: Stats, march: March, times: Float, rest: float, pause: Callable[[], object] = int) -> None:
    """Add to stats what is known of a finished run, whose last frame was a time `rest` after a step. pause : see `_uncut`."""
    work = march.work
    about["steps"], about["gradients"], about["solves"] = work.taken or march.step, work.gradients, work.solves
    about["unconverged"] = work.unconverged
    if work.unconverged:
        about["short_steps"] = sum(steps_before(time, march.h)[1] > 0 for time in times.tolist())
        about |= _uncut(march.remedy, pause)
    if march.watch is not None:
        about["step_error"] = _uncut(partial(march.step_error, rest), pause)


def _uncut(call: Callable[[], Result], pause: Callable[[], object] = int) -> Result:
    """The result of a call, repeated where Ctrl-C cuts it short without an exception, unless `pause` ends the run."""
    while True:
        try:
            return call()
        except Cut:
            pause()
