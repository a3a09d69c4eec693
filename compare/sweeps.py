"""`sweep(function, cases)`: one function for many cases, on all cores or a cluster, with an archive of results."""

import json
import pickle
import threading
import time as clock
import traceback
from collections.abc import Callable, Iterable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import nullcontext
from functools import cached_property, lru_cache
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

import cloudpickle
from tqdm import tqdm

from compare.background import NotStarted, background
from compare.fingerprint import fingerprint
from discs import checks
from discs.files.results import Archive, Result, key_of, read, record
from discs.running.calls import call_each, cores

__all__ = ["Result", "cores", "read", "sweep"]


def sweep(
    function: Callable[[Any], Any],
    cases: Iterable[Any],
    executor: Executor | None = None,
    archive: str | Path | None = None,
    progress: bool = True,
) -> list[Result]:
    """Call a function for every case.

    A case that fails is reported and does not stop the others, even if it ends its process. With an archive each result is written
    when it arrives, and a repeated call computes only the cases that are missing or have failed.

    Parameters
    ----------
    function : takes a case. A lambda, and a function of a notebook or script, is sent to other processes by value. A script that
        calls `sweep` must do so under `if __name__ == "__main__":`.
    cases : values that JSON can store (numbers, strings, lists, dictionaries), all different. The same holds for return values;
        NumPy's arrays and numbers become lists and numbers, in new results as in those from the archive.
    executor : any `concurrent.futures` executor. None: as many processes on this machine as there are cores to use. For a cluster,
        Dask's: `distributed.Client(address).get_executor()`. If a case breaks the executor, as it can a ProcessPoolExecutor, the
        unfinished cases run in processes of ours.
    archive : file of results, a line of JSON each (NaN and infinities as Python writes them). It belongs to one function with its
        present code, defaults, closure and globals (`compare.fingerprint`), and to one sweep at a time.
    progress : show a progress bar.

    Returns
    -------
    One `Result` for each case, in the order of the cases.

    Raises
    ------
    ValueError : for cases that JSON cannot store or that are equal, a function that cannot be sent to other processes, an
        archive of another function or that is none, or one that another sweep writes to.
    """
    if not callable(function):
        raise ValueError(f"function must be a function of a case; got {checks.shown(function)}")
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise ValueError(f"executor must have a method submit, as those of concurrent.futures; got {checks.shown(executor)}")
    if archive is not None:
        archive = checks.path("archive", archive)
    cases = list(checks.several("cases", cases, "cases, as a list of numbers"))
    keys = [key_of(case) for case in cases]
    if len(set(keys)) < len(keys):
        twice = next(key for i, key in enumerate(keys) if key in keys[:i])
        raise ValueError(f"the cases of a sweep must differ; got {twice} twice")
    with Archive(archive, *_identity(function, archive)) as kept:
        known = {key_of(found.case): found for found in kept.found}
        done = {key: known[key] for key in keys if key in known and not known[key].error}
        rest = {key: case for key, case in zip(keys, cases, strict=True) if key not in done}
        with tqdm(total=len(cases), initial=len(done), desc="sweep", unit="case", disable=not progress) as bar:

            def took(key: str, future: Future[str]) -> None:
                line = _line(future, rest[key])
                kept.write(line)
                done[key] = Result(**json.loads(line))
                del rest[key]
                bar.update()
                bar.set_postfix(failed=sum(bool(r.error) for r in done.values()), refresh=False)

            for given in (None,) if executor is None else (executor, None):
                if rest:
                    with nullcontext(given) if given else background(min(cores(), len(rest))) as workers:
                        sent = _Sent(function)
                        call_each(workers, _attempt, {key: (sent, case) for key, case in rest.items()}, took)
    return [done[key]._replace(case=case) for key, case in zip(keys, cases, strict=True)]


def _identity(function: Callable[[Any], Any], archive: str | Path | None) -> tuple[str, str]:
    """Name of a function and, for an archive, its fingerprint."""
    name = f"{function.__module__}.{function.__qualname__}" if hasattr(function, "__qualname__") else repr(function)
    if not archive:
        return name, ""
    try:
        return name, fingerprint(function)
    except ValueError as error:
        raise ValueError(
            f"an archive must identify its function, and cannot identify {name}: {error}; put that into the cases"
        ) from None


class _Sent:
    """A function that is sent to other processes by value if they cannot import it, and unpickled once in each."""

    def __init__(self, function: Callable[[Any], Any]) -> None:
        self.function = function

    @cached_property
    def content(self) -> bytes:
        try:
            content: bytes = cloudpickle.dumps(self.function)
        except Exception as error:
            raise ValueError(
                f"the function of a sweep cannot be sent to other processes: {type(error).__name__}: {error}"
            ) from None
        return content

    def __call__(self, case: Any) -> Any:
        return self.function(case)

    def __reduce__(self) -> tuple[Any, ...]:
        return _received, (self.content,)


@lru_cache(1)
def _received(content: bytes) -> Callable[[Any], Any]:
    function: Callable[[Any], Any] = pickle.loads(content)
    return function


def _attempt(function: Callable[[Any], Any], case: Any) -> str:
    """The line of a case, made in the process that runs it. All its errors, even SystemExit, are its result."""
    begun = clock.perf_counter()
    try:
        return record(case, function(case), seconds=clock.perf_counter() - begun)
    except BaseException as error:
        here = parent_process() is None and threading.current_thread() is threading.main_thread()
        if here and isinstance(error, KeyboardInterrupt):
            raise  # the user interrupts this process
        return record(case, None, _words(error), traceback.format_exc(), clock.perf_counter() - begun)


def _line(future: Future[str], case: Any) -> str:
    """The line of a case that has ended, even if its process has died."""
    try:
        return future.result()
    except (NotStarted, BrokenExecutor):
        raise
    except (Exception, CancelledError) as error:
        return record(case, None, _words(error))


def _words(error: BaseException) -> str:
    try:
        return f"{type(error).__name__}: {error}"
    except Exception:
        return f"{type(error).__name__}, whose message cannot be read"
