"""The same function for many cases, on all cores or a cluster, kept as it goes: `sweep(function, cases)`."""

import json
import os
import time as clock
import traceback
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError, Executor, Future, as_completed
from contextlib import nullcontext
from pathlib import Path
from typing import Any, NamedTuple

from tqdm import tqdm

from compare.background import background


class Result(NamedTuple):
    """What became of a case.

    case : as given. value : what the function returned, as JSON holds it (arrays and tuples are lists); None if it failed.
    error : "" or, if it failed, the kind of error and its message. trace : where it failed. seconds : what it took.
    """

    case: Any
    value: Any
    error: str
    trace: str
    seconds: float


def sweep(
    function: Callable[[Any], Any],
    cases: Iterable[Any],
    executor: Executor | None = None,
    archive: str | Path | None = None,
    progress: bool = True,
) -> list[Result]:
    """Call a function for every case.

    A case that fails is reported and does not hold up the others. With an archive each result is written as it arrives, and a
    sweep that was interrupted or killed takes from it what it has already; what failed is tried again.

    Parameters
    ----------
    function : takes a case. For other processes it must be importable (no lambda), and a script that calls `sweep` must do so
        under `if __name__ == "__main__":`.
    cases : whatever JSON can hold (numbers, strings, lists, dictionaries), all different. What the function returns must be
        so too; NumPy's arrays and numbers become lists and numbers, whether a result is fresh or from the archive.
    executor : any `concurrent.futures` executor. None: as many processes on this machine as there are cores to use. For a cluster,
        Dask's: `distributed.Client(address).get_executor()`.
    archive : file that keeps the results, a line of JSON each (NaN and infinities as Python writes them). One file belongs to one
        function; one sweep at a time may use it.
    progress : show a progress bar.

    Returns
    -------
    One `Result` for each case, in the order of the cases.

    Raises
    ------
    ValueError : for cases that JSON cannot hold or that are there twice, and an archive of another function or that is none.
    """
    cases = list(cases)
    keys = [_key(case) for case in cases]
    if len(set(keys)) < len(keys):
        twice = next(key for i, key in enumerate(keys) if key in keys[:i])
        raise ValueError(f"the cases of a sweep must differ; got {twice} twice")
    name = f"{function.__module__}.{function.__qualname__}" if hasattr(function, "__qualname__") else repr(function)
    known = {_key(found.case): found for found in read(archive, name)} if archive else {}
    done = {key: known[key] for key in keys if key in known and not known[key].error}
    rest = {key: case for key, case in zip(keys, cases, strict=True) if key not in done}
    processes = nullcontext(executor) if executor else background(min(cores(), len(rest) or 1))
    with processes as workers, Archive(archive, name) as kept:
        futures = {workers.submit(_attempt, function, case): key for key, case in rest.items()}
        try:
            with tqdm(total=len(cases), initial=len(done), desc="sweep", unit="case", disable=not progress) as bar:
                for future in as_completed(futures):
                    key = futures[future]
                    line = _line(future, rest[key])
                    kept.write(line)
                    done[key] = Result(**json.loads(line))
                    bar.update()
                    bar.set_postfix(failed=sum(bool(r.error) for r in done.values()), refresh=False)
        except BaseException:
            for future in futures:
                future.cancel()
            raise
    return [done[key]._replace(case=case) for key, case in zip(keys, cases, strict=True)]


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def read(archive: str | Path, function: str | None = None) -> list[Result]:
    """The results in an archive, the last for each case; none if there is no file yet. A line that a kill cut short is left out.

    Raises ValueError if the file is not an archive, or one of another function than the one named.
    """
    path = Path(archive)
    if not path.exists():
        return []
    whole, _, _ = path.read_text(encoding="utf-8").rpartition("\n")
    try:
        lines = [json.loads(line) for line in whole.splitlines()]
        found = {_key(line["case"]): Result(**line) for line in lines[1:]}
        of = lines[0]["function"] if lines else function
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"archive must be a file that a sweep has written, or a new one; {path} is neither") from None
    if function is not None and of != function:
        raise ValueError(f"archive {path} holds results of {of}, not of {function}; take another file")
    return list(found.values())


class Archive:
    """Whole lines at the end of a file: each is written at once and reaches the disc before the next."""

    def __init__(self, path: str | Path | None, function: str) -> None:
        self._path, self._function = path and Path(path), function

    def __enter__(self) -> "Archive":
        if not self._path:
            return self
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._path.open("ab+", buffering=0)
        except OSError as error:
            raise ValueError(f"archive must be a file that can be written; {self._path} is not: {error.strerror}") from None
        self._file.seek(0)
        self._file.truncate(self._file.read().rfind(b"\n") + 1)  # what a kill left of a line
        if not self._file.tell() or not self._path.stat().st_size:
            self.write(json.dumps({"function": self._function}))
        return self

    def write(self, line: str) -> None:
        """Append a line."""
        if self._path:
            self._file.write(f"{line}\n".encode())
            os.fsync(self._file.fileno())

    def __exit__(self, *error: object) -> None:
        if self._path:
            self._file.close()


def _key(case: Any) -> str:
    try:
        return json.dumps(case, sort_keys=True, default=_plain)
    except TypeError as error:
        raise ValueError(f"a case of a sweep must be what JSON can hold; got {case!r}: {error}") from None


def _plain(value: Any) -> Any:
    """NumPy's arrays and numbers as lists and numbers."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not something JSON can hold")


def _record(case: Any, value: Any = None, error: str = "", trace: str = "", seconds: float = 0.0) -> str:
    return json.dumps(Result(case, value, error, trace, seconds)._asdict(), default=_plain)


def _attempt(function: Callable[[Any], Any], case: Any) -> str:
    """The line of a case, made where the function runs."""
    begun = clock.perf_counter()
    try:
        value = function(case)
        return _record(case, value, seconds=clock.perf_counter() - begun)
    except Exception as error:
        what, trace = f"{type(error).__name__}: {error}", traceback.format_exc()
        return _record(case, None, what, trace, clock.perf_counter() - begun)


def _line(future: Future[str], case: Any) -> str:
    """The line of a case that has ended, even if what ran it has not survived."""
    try:
        return future.result()
    except (Exception, CancelledError) as error:
        return _record(case, None, f"{type(error).__name__}: {error}")
