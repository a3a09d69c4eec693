"""`simulate(problem, method, ...)`: run a problem with an integrator."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.integrators import Integrator, find, from_settings
from discs.kernels.background import usual
from discs.kernels.teams import using
from discs.linkage import LinkageProblem
from discs.linkage.motion import run as linkage_run
from discs.problem import Problem
from discs.running.by_dop853 import pays
from discs.running.doubt import doubted
from discs.running.frames import frame_times, wanted
from discs.running.moments import Event, checked_events, look_ahead
from discs.running.once import Asked, run_once
from discs.running.ready import kernels
from discs.running.recording import kept_settings
from discs.running.suggest import suggest_dt
from discs.running.tolerance import USUAL, answered, search_with_doubt, some_of
from discs.solution import Solution
from discs.stats import Stats, of_search
from discs.warn import warn


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
    threads: int = 1,
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
    engine : "compiled", which waits until kernels are compiled, once on a machine; "plain" for NumPy and SciPy; "auto", the
        default: compiled if the kernels are there, otherwise plain while they are compiled in the background, and compiled from the
        start as soon as they are there; "ready", the same, but nothing is compiled. Both agree up to rounding (with step control to
        the tolerance). `stats["engine"]` tells which it was and `stats["plain_because"]` why a run is plain. With a checkpoint
        "auto" is "compiled". The environment variable DISCS_ENGINE names another default.
    tol : tolerance, instead of dt: steps are shortened until the errors of x, y, theta (and phi), relative to the largest value of
        each, are within it. A dictionary, as {"omega": 1e-4}, names the quantities; see `discs.running.tolerance`.
    checkpoint : a file, as "run.nc", to which frames are written as they are computed, in bounded memory. If it exists, its run
        continues where it was interrupted, to the same bits as one unbroken run; see docs/archives.md. With a tolerance, method and
        step are found first, by runs of at most 101 frames in memory; a run that continues takes them from its file.
    events : functions of a `discs.events.Moment` that are zero when something happens, own ones or those of `discs.events`;
        `run.events` tells when. One with `terminal = True` ends the run there. They need a method with fixed steps; "auto" is then
        "gauss6". The run is first done step by step to find them, see `discs.running.moments`.
    threads : processor cores for one chain, if they have nothing else to do; it pays from 4000 discs on (docs/performance.md). For
        chains that run in lanes, `stats["threads"]` tells how many. Results depend on it by rounding. "auto" is then "compiled".

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
    if not isinstance(problem, Problem):
        if isinstance(problem, LinkageProblem):
            if checkpoint is not None or type(events) is not tuple or events:
                raise ValueError("a linkage runs without checkpoint and events: leave them out, and save the run by its `save`")
            return linkage_run(problem, method, dt, frames, want, progress, tol)
        raise ValueError(f"simulate takes a Problem, as `compare.lump(scene, n)` makes; got {type(problem).__name__}")
    engine, nothing = usual() if engine is None else engine, method is None and dt is None
    if type(threads) is not int or threads != 1:
        engine = "compiled" if engine == "auto" else engine
        with using(checks.whole("threads", threads, 1)):
            return simulate(problem, method, dt, frames, want, progress, engine, tol, checkpoint, events)
    if checkpoint is not None:
        checkpoint = checks.path("checkpoint", checkpoint)
    if method is not None and (type(method) is not str or not method):
        method = find(method)
    if type(events) is not tuple or events:
        events = checked_events(events)
    if events:
        method = "gauss6" if method == "auto" or nothing else method
    if engine == "auto" and checkpoint is not None:
        engine = "compiled"
    want = tuple(want) if type(want) is not tuple and isinstance(want, Iterator) else want  # a run may begin anew
    asked = Asked(want, progress, engine, checkpoint)
    if method == "auto" or tol is not None or nothing:
        if dt is not None:
            raise ValueError("give dt or tol, not both: tol (and method='auto') finds the step")
        found, doubt = _search(problem, "auto" if method is None else method, frames, asked, tol, events)
    elif events:
        found, doubt = _eventful(problem, find(method or "midpoint"), dt, frames, asked, events), ""
    else:
        found, doubt = run_once(problem, find(method or "midpoint"), dt, frames, asked), ""
    if warning := doubted(problem, found) + doubt:
        warn(warning)
    return found


def _search(
    problem: Problem,
    method: str | Integrator,
    frames: int | ArrayLike,
    asked: Asked,
    tol: float | Mapping[str, float] | None,
    events: Sequence[Event],
) -> tuple[Solution, str]:
    """A run to a tolerance, and its warning or "". The arguments are those of `simulate`."""

    def run(problem: Problem, integrator: Integrator, dt: float, times: Float) -> Solution:
        return run_once(problem, integrator, dt, times, in_memory, checked=False)

    want, checkpoint = wanted(asked.want, () if method == "auto" else find(method).offers), asked.checkpoint
    asked = asked._replace(want=want)
    in_memory = asked._replace(checkpoint=None)
    times = frame_times(frames, problem.duration)
    kept = None if checkpoint is None else kept_settings(checkpoint, tol)
    if kept is not None:
        integrator, dt, searched = kept
        return run_once(problem, integrator, dt, times, asked, False, searched), ""
    looked_at = times if checkpoint is None else some_of(times)
    explicit = method == "auto" and checkpoint is None and not events and not want and _explicit(problem, tol, asked)
    found, doubt = answered(search_with_doubt(problem, method, tol, looked_at, want, explicit=explicit), run)
    if checkpoint is not None or events:
        integrator, dt = from_settings(found.stats["settings"]), found.stats["dt"]
        searched, known = of_search(found.stats), found.error_estimate
        if events:
            return _eventful(problem, integrator, dt, times, asked, events, searched, known), doubt
        found = run_once(problem, integrator, dt, times, asked, False, searched, known)
    return found, doubt


def _explicit(problem: Problem, tol: float | Mapping[str, float] | None, asked: Asked) -> bool:
    """Whether "auto" may try DOP853: for few discs without loads, if its kernel is there."""
    given = [USUAL] if tol is None else list(tol.values()) if isinstance(tol, Mapping) else [tol]
    least = min((value for value in given if isinstance(value, int | float) and value > 0), default=USUAL)  # checked later
    if asked.engine == "plain" or problem.system.load is not None or problem.system.parameters is None:
        return False
    if not pays(problem, least):
        return False
    return bool(kernels(asked.engine, problem, find("DOP853"), problem.duration, False, not asked.progress))


def _eventful(
    problem: Problem,
    integrator: Integrator,
    dt: float | None,
    frames: int | ArrayLike,
    asked: Asked,
    events: Sequence[Event],
    more: Stats | None = None,
    estimate: dict[str, float] | None = None,
) -> Solution:
    """A run with events, until one that ends it; the arguments are those of `simulate` and `run_once`."""
    h = suggest_dt(problem, integrator) if dt is None else dt
    happened, times = look_ahead(problem, integrator, h, frame_times(frames, problem.duration), events, asked.engine)
    told: Stats = (more or {}) | {"events": [(each.name, each.t) for each in happened]}
    found = run_once(problem, integrator, dt, times, asked, more is None, told, estimate)
    return replace(found, events=happened, error_estimate=estimate)
