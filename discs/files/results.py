"""Archives of results, of `compare.sweep` and `discs.simulate_many`: a line of JSON that identifies what was computed, and a line
for each result.

The last entry of a line, `sum`, is the CRC-32 of the line without it. A line that was changed since is refused: a digit that
changed would be another result. Archives of version 0.1 have no sums.
"""

import json
import os
import re
import zlib
from pathlib import Path
from typing import Any, NamedTuple

from discs.files import safe


class Result(NamedTuple):
    """The result of a case.

    case : as given. value : the return value as JSON stores it (arrays and tuples are lists); None if the case failed.
    error : the kind and message of an error, or "". trace : its traceback. seconds : run time.
    """

    case: Any
    value: Any
    error: str
    trace: str
    seconds: float


def key_of(case: Any) -> str:
    """A case as text, equal for equal cases; ValueError if JSON cannot store it."""
    try:
        return json.dumps(case, sort_keys=True, default=_plain)
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"a case of a sweep must be what JSON can store; got {case!r}: {error}") from None


def record(case: Any, value: Any = None, error: str = "", trace: str = "", seconds: float = 0.0) -> str:
    """The line of a result."""
    return json.dumps(Result(case, value, error, trace, seconds)._asdict(), default=_plain)


SUM = re.compile(rb', "sum": "([0-9a-f]{8})"}\Z')


def _summed(line: str) -> bytes:
    """A line of JSON, an object, with its checksum."""
    content = line.encode()
    return content[:-1] + f', "sum": "{zlib.crc32(content):08x}"}}'.encode()


def _checked(line: bytes, needed: bool) -> dict[str, Any]:
    """The object in a line, without its checksum; ValueError if that is not right, or missing where it is needed."""
    found = SUM.search(line)
    if found:
        line = line[: found.start()] + b"}"
    if zlib.crc32(line) != int(found[1], 16) if found else needed:
        raise Damaged
    content: dict[str, Any] = json.loads(line)
    return content


class Damaged(ValueError):
    """A line is not what was written."""


def read(archive: str | Path) -> list[Result]:
    """The results in an archive, the last for each case; none if there is no file. An incomplete last line is left out.

    Raises ValueError if the file is not an archive.
    """
    if not os.path.lexists(archive):
        return []
    with open(safe.opened(archive), "rb") as file:
        content = file.read()
    return _parsed(archive, content)[1] if content else []


def _parsed(path: str | Path, content: bytes, name: str = "archive", by: str = "sweep") -> tuple[dict[str, str], list[Result], int]:
    """The first line of an archive, its results, and the number of its bytes that are complete lines."""
    whole = content.rfind(b"\n") + 1
    try:
        first, *lines = content[:whole].split(b"\n")[:-1]
        of = json.loads(first)
        if not isinstance(of, dict) or not of.keys() <= {"function", "content", "sums"} or not isinstance(of["function"], str):
            raise ValueError
        found, summed, number = {}, bool(of.pop("sums", False)), 1
        for line in lines:
            number += 1
            result = Result(**_checked(line, summed))
            found[key_of(result.case)] = result
    except Damaged:
        raise ValueError(
            f"{name} {path} is damaged: line {number} is not what was written; delete that line, and its case is computed again"
        ) from None
    except (ValueError, KeyError, TypeError, RecursionError):
        raise ValueError(f"{name} must be a file that a {by} has written, or a new one; {path} is neither") from None
    return of, list(found.values()), whole


class Archive:
    """A file to which complete lines are appended; each reaches the disc before the next.

    A file that is no archive, belongs to another function, or is in use by another sweep is refused and not changed. A path of None
    stores nothing.

    Parameters
    ----------
    function, content : name of what was computed, and its fingerprint.
    name, by, changed : for errors: of the file, of its writer, and how `content` can differ.

    Attributes
    ----------
    found : the results in the file.
    """

    def __init__(
        self,
        path: str | Path | None,
        function: str,
        content: str,
        name: str = "archive",
        by: str = "sweep",
        changed: str = "has changed since, or Python has",
    ) -> None:
        self._path, self._of = path and Path(path), {"function": function, "content": content}
        self._name, self._by, self._changed = name, by, changed
        self.found: list[Result] = []

    def __enter__(self) -> "Archive":
        if not self._path:
            return self
        try:
            if not os.path.lexists(self._path) or not self._path.stat().st_size:
                self._path.parent.mkdir(parents=True, exist_ok=True)
                with safe.fresh(self._path) as new:  # the first line is written completely or not at all
                    new.write(f"{json.dumps(self._of | {'sums': True})}\n".encode())
            self._fd = safe.opened(self._path, os.O_RDWR)
        except (OSError, ValueError) as error:
            raise ValueError(f"{self._name} must be a file that can be written; {self._path} is not: {error}") from None
        try:
            self._take(self._path)
        except BaseException:
            os.close(self._fd)
            raise
        return self

    def _take(self, path: Path) -> None:
        if not safe.lock(self._fd):
            raise ValueError(f"{self._name} {path} is being written by another {self._by}: wait for its end, or take another file")
        with open(os.dup(self._fd), "rb") as file:
            of, self.found, whole = _parsed(path, file.read(), self._name, self._by)
        if of["function"] != self._of["function"]:
            raise ValueError(
                f"{self._name} {path} has results of {of['function']}, not of {self._of['function']}; take another file"
            )
        if of != self._of:
            why = self._changed if "content" in of else "may have changed: an earlier version did not keep what it was"
            raise ValueError(f"{self._name} {path} has results of {of['function']}, which {why}; take another file")
        os.ftruncate(self._fd, whole)  # removes an incomplete last line
        os.lseek(self._fd, 0, os.SEEK_END)

    def write(self, line: str) -> None:
        """Append a line."""
        if self._path:
            safe.write_all(self._fd, _summed(line) + b"\n")
            os.fsync(self._fd)

    def __exit__(self, *error: object) -> None:
        if self._path:
            safe.release(self._fd)


def _plain(value: Any) -> Any:
    """NumPy's arrays and numbers as lists and numbers."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot be stored as JSON")
