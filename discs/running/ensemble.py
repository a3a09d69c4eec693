"""`simulate_many(problems, ...)`: many problems at once, on all cores or a cluster."""

import hashlib
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.files import schema
from discs.files.results import Archive, record
from discs.integrators import Integrator, find
from discs.problem import Problem
from discs.running.calls import HALT, call_each, cores
from discs.running.failure import SimulationError
from discs.running.outcome import Outcome, as_data, from_data
from discs.running.part import Settings, parts_of, run_part
from discs.running.progress import NO_BAR, Progress
from discs.running.ready import NOTICE
from discs.runs import Runs
from discs.warn import warn


def simulate_many(
    problems: Iterable[Problem],
    method: str | Integrator | None = None,
    dt: float | None = None,
    frames: int | ArrayLike = 1,
    want: Iterable[str] = (),
    progress: bool = True,
    engine: str = "compiled",
    tol: float | Mapping[str, float] | None = None,
    checkpoint: str | Path | None = None,
    executor: Executor | None = None,
    threads: int | None = None,
) -> Runs:
    """Run many problems.

    Each run is what `simulate` makes of its problem, with its own errors and warnings: a run that fails leaves the others alone.
    Chains without loads, with slaved headings and linear curvature or with own headings and links of degree 1, that have the ends,
    law, number of discs, duration and step in common, run eight at a time in the lanes of a vector, by the midpoint method, its
    compositions, Gauss and Radau methods, where nothing is in `want`. Their sweeps go on until all eight have converged, and
    `stats["solves"]` counts these: numbers agree with those of `simulate` to the tolerance of sweeps, by default some units in the
    last place. With a tolerance they search among implicit methods, where `simulate` takes "DOP853" for few discs; both keep the
    tolerance. All other runs go one by one.

    Parameters
    ----------
    problems : the problems.
    method, dt, frames, want, tol : as for `simulate`; frames are the last states by default. A tolerance holds for each run: each
        has its own search for a step.
    engine : "compiled", which waits for kernels to be compiled, or "plain".
    progress : show a progress bar if it takes more than a second.
    checkpoint : a file, as "runs.jsonl", to which the runs are written, some at a time. If it exists, only the runs that are
        missing are computed; the result has the same bits.
    executor : any `concurrent.futures` executor; for a cluster Dask's, `distributed.Client(address).get_executor()`. It is given
        parts of several runs each.
    threads : number of threads if there is no executor; None for one for each core.

    Returns
    -------
    `discs.runs.Runs`: a sequence of Solutions, with arrays over all runs, as `runs.x` (runs, frames, discs), with `runs.failed`
    and `runs.warned`, and `runs.to_xarray()`. It warns once for all warnings and failures.

    Raises
    ------
    ValueError : for no problems, or arguments that no run can take; for a checkpoint of other runs, or of something else.
    KeyboardInterrupt : on Ctrl-C; with a checkpoint the parts that are done are kept.
    """
    given = checks.several("problems", problems, "problems, as `compare.lump(scene, n)` makes")
    for problem in given:
        if not isinstance(problem, Problem):
            raise ValueError(f"simulate_many takes Problems, as `compare.lump(scene, n)` makes; got {type(problem).__name__}")
    if not given:
        raise ValueError("simulate_many takes at least one problem; got none")
    if dt is not None and tol is not None:
        raise ValueError("give dt or tol, not both: tol finds the step")
    if dt is not None:
        dt = checks.number("dt", dt, positive=True)
    if method is not None and not (isinstance(method, str) and method == "auto"):
        method = find(method)
    threads = cores() if threads is None else checks.whole("threads", threads, 1)
    asked = checks.several("want", want, "names of quantities")
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise ValueError(f"executor must have a method submit, as those of concurrent.futures; got {checks.shown(executor)}")
    if checkpoint is not None:
        checkpoint = checks.path("checkpoint", checkpoint)
    settings = Settings(method, dt, tol, frames, asked, checks.choice("engine", engine, ("compiled", "plain")))
    done = _run(given, settings, checkpoint, executor, threads, progress)
    runs = Runs(
        given, [block for outcome in done for block in outcome.blocks], *(_merged(done, name) for name in ("failed", "warned"))
    )
    _report(runs)
    return runs


def _run(
    problems: tuple[Problem, ...],
    settings: Settings,
    checkpoint: str | Path | None,
    executor: Executor | None,
    threads: int,
    progress: bool,
) -> list[Outcome]:
    """All outcomes; the arguments are those of `simulate_many`."""
    rest, done, halt = dict(enumerate(parts_of(problems, settings))), dict[int, Outcome](), Event()
    told = "" if checkpoint is None else _fingerprint(problems, settings)
    words = "checkpoint", "simulate_many", "are not of these problems or arguments"
    shown = Progress("runs", len(problems), "run") if progress else NO_BAR
    with Archive(checkpoint, "discs.simulate_many", told, *words) as kept, shown:
        for found in kept.found:
            number = next((k for k, part in rest.items() if [k, *part] == found.case), None)
            if number is not None:
                done[number] = from_data(found.value, rest.pop(number).numbers)
        count = len(problems) - sum(len(part.numbers) for part in rest.values())

        def took(number: int, future: Future[Outcome]) -> None:
            nonlocal count
            done[number] = future.result()
            if checkpoint is not None:
                kept.write(record([number, *rest[number]], as_data(done[number])))
            count += len(rest[number].numbers)
            shown.update(count)

        calls = {k: (part, [problems[i] for i in part.numbers], settings) for k, part in rest.items()}
        pool: Any = nullcontext(executor)
        if executor is None:
            pool = ThreadPoolExecutor(threads, initializer=HALT.set, initargs=(halt,))
        with _notice(settings, progress), pool as workers:
            try:
                call_each(workers, run_part, calls, took)
            except BaseException:
                halt.set()
                raise
    if len(done) < len(calls):
        raise RuntimeError("the executor broke before all runs were done; give another, or none")
    return [done[k] for k in sorted(done)]


def _notice(settings: Settings, progress: bool) -> Any:
    """Says so if kernels are compiled for long."""
    if not progress or settings.engine == "plain":
        return nullcontext()
    from discs.kernels.compiled import compiling, say_so

    name = settings.method.name if isinstance(settings.method, Integrator) else settings.method or "auto"
    return compiling(lambda: say_so(name), NOTICE)


def _fingerprint(problems: tuple[Problem, ...], settings: Settings) -> str:
    """A hash of all problems and settings."""
    found = hashlib.sha256()
    frames = settings.frames if isinstance(settings.frames, int) else np.asarray(settings.frames).tolist()
    found.update(repr((*settings._replace(frames=frames),)).encode())
    for problem in problems:
        numbers, arrays = schema.describe(problem)
        found.update(schema.as_text(numbers).encode())
        for name in sorted(arrays):
            found.update(name.encode() + np.ascontiguousarray(arrays[name]).tobytes())
    return found.hexdigest()


def _merged(done: list[Outcome], name: str) -> Any:
    """The entries of a dictionary of all outcomes, in the order of the runs."""
    entries = [entry for outcome in done for entry in getattr(outcome, name).items()]
    return dict(sorted(entries, key=lambda entry: entry[0]))


def _report(runs: Runs) -> None:
    """Warn of failures and of the runs' own warnings; raise the first error if no run can take the arguments."""
    count, failed, warned = len(runs), runs.failed, runs.warned
    if len(failed) == count and not any(isinstance(error, SimulationError) for error in failed.values()):
        raise next(iter(failed.values()))
    said = []
    if failed:
        number, error = next(iter(failed.items()))
        said.append(f"{len(failed)} of {count} runs failed, as run {number}: {error}; see runs.failed")
    if warned:
        number, messages = next(iter(warned.items()))
        said.append(f"{len(warned)} of {count} runs have warnings, as run {number}: {messages[0]}; see runs.warned")
    if said:
        warn("; ".join(said))
