"""`simulate(problem, method, ...)`: run a problem with an integrator."""

import time as clock
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial, wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.integrators import Integrator, OneStep, find, from_settings
from discs.integrators.work import Cut
from discs.kernels.background import usual
from discs.linkage import LinkageProblem
from discs.linkage.motion import run as linkage_run
from discs.problem import Problem
from discs.running.album import Album
from discs.running.by_dop853 import pays
from discs.running.doubt import doubted
from discs.running.engine import WAITING, Overtaken, plain_because, refuse_loads
from discs.running.frames import ROUNDING, frame_times, observed, steps_before, wanted
from discs.running.moments import Event, checked_events, look_ahead
from discs.running.progress import NO_BAR, Progress
from discs.running.ready import kernels
from discs.running.recording import Recording, Rows, kept_settings
from discs.running.stats import Stats, begun, of_search
from discs.running.step_error import Watch
from discs.running.suggest import suggest_dt
from discs.running.time_loop import March
from discs.running.tolerance import USUAL, answered, search_with_doubt, some_of
from discs.solution import Solution
from discs.warn import warn

MOST_STEPS = 2.0**53
Result = TypeVar("Result")
Given = ParamSpec("Given")


def simulate(
    problem: Problem | LinkageProblem,
    method: str | Integrator | None = None,
    dt: float | None = None,
    frames: int | ArrayLike = 101,
    want: Iterable[str] = (),
    progress: bool = True,
    engine: str | None = None,
    tol: float | Mapping[str, float] | None = None,
    checkpoint: str | Path | None = None,
    events: Event | Sequence[Event] = (),
) -> Solution:
    """Run a problem.

    Without method, dt and tol, "auto" runs to a tolerance of 1e-3 and warns if it is not reached.

    Parameters
    ----------
    problem : the chain, its initial state, loads and duration. A `LinkageProblem` runs by the midpoint rule of
        `discs.linkage.motion` on the plain engine, with dt or tol.
    method : name of an integrator (`discs.integrators.METHODS`; docs/choosing.md helps to choose), an integrator with settings, as
        `Midpoint(sweeps=2)`, or "auto". None is "midpoint" if dt is given, otherwise "auto".
    dt : time step, at most the duration; for SciPy's methods the longest step. None is `suggest_dt(problem, method)`.
    frames : number of frames, equally spaced over the duration, or their times, increasing. A frame between two steps is
        computed by a shorter step of its own, so frames never change the trajectory.
    want : further quantities to record: "velocity", "slope", "contact_force", "work_by_load" (`run.work_by_load`), and those that
        the method offers (leapfrog: "modified_energy").
    progress : show a progress bar for runs of more than a second.
    tol : tolerance, instead of dt: steps are shortened until the errors of x, y, theta (and phi), relative to the largest value of
        each, are within it. A dictionary, as {"omega": 1e-4}, names the quantities; see `discs.running.tolerance`.
    checkpoint : a file, as "run.nc", to which frames are written as they are computed, in bounded memory. If it exists, its run
        continues where it was interrupted, to the same bits as one unbroken run; see docs/archives.md. With a tolerance, method and
        step are found first, by runs of at most 101 frames in memory; a run that continues takes them from its file.
    events : functions of a `discs.events.Moment` that are zero when something happens, own ones or those of `discs.events`;
        `run.events` tells when. One with `terminal = True` ends the run there. They need a method with fixed steps; "auto" is then
        "gauss6". The run is first done step by step to find them, see `discs.running.moments`.
    engine : "compiled", which waits until kernels are compiled, once on a machine; "plain" for NumPy and SciPy; "auto", the
        default: compiled if the kernels are there, otherwise plain while they are compiled in the background, and compiled from the
        start as soon as they are there; "ready", the same, but nothing is compiled. Both agree up to rounding (with step control to
        the tolerance). `stats["engine"]` tells which it was and `stats["plain_because"]` why a run is plain. With a checkpoint
        "auto" is "compiled". The environment variable DISCS_ENGINE names another default.

    Returns
    -------
    Solution with exactly these frames. A run warns if its energy drifts by more than a hundredth, if steps did not converge, and if
    the estimated error of positions or angles is above a twentieth (`discs.running.step_error`).

    Raises
    ------
    ValueError : for an unknown method or quantity; for a step that is not positive or longer than the duration; for frames outside
        the duration; for a checkpoint that holds another run or something else.
    KeyboardInterrupt : on Ctrl-C; with a checkpoint between two steps, and everything up to there is kept.
    SimulationError : if the kinetic energy exceeds ten times the initial total energy (no exact motion does), if a value is not
        finite, if a disc loses its heading (rolling="unit"), or if `tol` is not reached.
    """
    if isinstance(problem, LinkageProblem):
        if checkpoint is not None or events != ():
            raise ValueError("a linkage runs without checkpoint and events: leave them out, and save the run by its `save`")
        return linkage_run(problem, method, dt, frames, want, progress, tol)
    if not isinstance(problem, Problem):
        raise ValueError(f"simulate takes a Problem, as `compare.lump(scene, n)` makes; got {type(problem).__name__}")
    engine, nothing = engine or usual(), method is None and dt is None
    if events != ():
        events = checked_events(events)
        method = "gauss6" if method == "auto" or nothing else method
    if engine == "auto" and checkpoint is not None:
        engine = "compiled"
    if method == "auto" or tol is not None or nothing:
        if dt is not None:
            raise ValueError("give dt or tol, not both: tol (and method='auto') finds the step")
        found, doubt = _search(problem, method or "auto", frames, want, progress, engine, tol, checkpoint, events)
    elif events:
        found, doubt = _eventful(problem, find(method or "midpoint"), dt, frames, want, progress, engine, checkpoint, events), ""
    else:
        found, doubt = _run(problem, find(method or "midpoint"), dt, frames, want, progress, engine, checkpoint), ""
    if warning := doubted(problem, found) + doubt:
        warn(warning)
    return found


def _search(
    problem: Problem,
    method: str | Integrator,
    frames: int | ArrayLike,
    want: Iterable[str],
    progress: bool,
    engine: str,
    tol: float | Mapping[str, float] | None,
    checkpoint: str | Path | None,
    events: Sequence[Event],
) -> tuple[Solution, str]:
    """A run to a tolerance, and its warning or "". The arguments are those of `simulate`."""

    def run(problem: Problem, integrator: Integrator, dt: float, times: Float) -> Solution:
        return _run(problem, integrator, dt, times, want, progress, engine, None, False)

    want = wanted(want, () if method == "auto" else find(method).offers)
    times = frame_times(frames, problem.duration)
    kept = None if checkpoint is None else kept_settings(checkpoint, tol)
    if kept is not None:
        integrator, dt, searched = kept
        return _run(problem, integrator, dt, times, want, progress, engine, checkpoint, False, searched), ""
    looked_at = times if checkpoint is None else some_of(times)
    explicit = method == "auto" and checkpoint is None and not events and not want and _explicit(problem, tol, engine, not progress)
    found, doubt = answered(search_with_doubt(problem, method, tol, looked_at, want, explicit=explicit), run)
    if checkpoint is not None or events:
        integrator, dt = from_settings(found.stats["settings"]), found.stats["dt"]
        searched, known = of_search(found.stats), found.error_estimate
        if events:
            return _eventful(problem, integrator, dt, times, want, progress, engine, checkpoint, events, searched, known), doubt
        found = _run(problem, integrator, dt, times, want, progress, engine, checkpoint, False, searched, known)
    return found, doubt


def _explicit(problem: Problem, tol: float | Mapping[str, float] | None, engine: str, quiet: bool) -> bool:
    """Whether "auto" may try DOP853: for few discs without loads, if its kernel is there."""
    given = [USUAL] if tol is None else list(tol.values()) if isinstance(tol, Mapping) else [tol]
    least = min((value for value in given if isinstance(value, int | float) and value > 0), default=USUAL)  # checked later
    if engine == "plain" or problem.system.load is not None or problem.system.parameters is None or not pays(problem, least):
        return False
    return bool(kernels(engine, problem, find("DOP853"), problem.duration, False, quiet))


def _eventful(
    problem: Problem,
    integrator: Integrator,
    dt: float | None,
    frames: int | ArrayLike,
    want: Iterable[str],
    progress: bool,
    engine: str,
    checkpoint: str | Path | None,
    events: Sequence[Event],
    more: Stats | None = None,
    estimate: dict[str, float] | None = None,
) -> Solution:
    """A run with events, until one that ends it; the arguments are those of `simulate` and `_run`."""
    h = suggest_dt(problem, integrator) if dt is None else dt
    happened, times = look_ahead(problem, integrator, h, frame_times(frames, problem.duration), events, engine)
    told: Stats = (more or {}) | {"events": [(each.name, each.t) for each in happened]}
    found = _run(problem, integrator, dt, times, want, progress, engine, checkpoint, more is None, told, estimate)
    return replace(found, events=happened, error_estimate=estimate)


def run_fixed(problem: Problem, integrator: Integrator, dt: float, times: Float) -> Solution:
    """A run for a search: equal steps, frames at these times, (F,), and no estimate of the error of the steps."""
    return _run(problem, integrator, dt, times, (), False, "compiled", None, False)


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
def _run(
    problem: Problem,
    integrator: Integrator,
    dt: float | None,
    frames: int | ArrayLike,
    want: Iterable[str],
    progress: bool,
    engine: str,
    checkpoint: str | Path | None,
    checked: bool = True,
    more: Stats | None = None,
    estimate: dict[str, float] | None = None,
) -> Solution:
    """One run; the arguments are those of `simulate`.

    checked : estimate the error of the steps; otherwise a search asks, whose frames are times. more : further entries of `stats`.
    estimate : of the errors, if known.
    """
    want = () if want == () else wanted(want, integrator.offers)
    because = plain_because(problem, integrator, engine, want)
    suggested = dt is None
    h = suggest_dt(problem, integrator) if dt is None else checks.number("dt", dt, positive=True)
    if h > (1 + ROUNDING) * problem.duration and not integrator.adaptive:
        raise ValueError(f"dt must be at most the duration, {problem.duration:g}; got {h:g}")
    times = frame_times(frames, problem.duration) if checked else np.asarray(frames)
    end = float(times[-1])
    if end / h > MOST_STEPS:
        raise ValueError(f"dt = {h:g} makes {end / h:.1g} steps to t = {end:g}, more than can be counted: take a larger dt")
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
