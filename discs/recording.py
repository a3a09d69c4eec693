"""Where the frames of a run go: into memory, or into a file from which an interrupted run goes on.

Beside the file `run.nc` stands `run.nc.restart` while the run is not finished: what the integrator remembers, about once a second,
in a file that replaces the one before. After a kill the run goes on from there and takes the frames since then again, to the same
bits.
"""

import signal
import threading
import time as clock
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discs import archive, checks
from discs.framefile import DAMAGE, FrameFile, fresh
from discs.integrators import Integrator, from_settings
from discs.marching import March
from discs.problem import Problem
from discs.solution import Solution

SECONDS = 1.0  # between two restart files, and at least twenty times what writing one takes
SETTINGS = ("settings", "dt", "engine", "want")  # of stats: what a run must share with the one it goes on from


class Rows:
    """Frames in memory."""

    def __init__(self, problem: Problem, times: NDArray) -> None:
        self.problem, self.times = problem, times
        self.rows: dict[str, Any] = {}

    def __enter__(self) -> "Rows":
        return self

    def __exit__(self, *error: object) -> None:
        pass

    complete = False  # whether the run was finished before
    seconds = 0.0  # spent on it before

    def begin(self, march: March) -> int:
        """Bring the run to where it was interrupted; returns the first frame to compute."""
        return 0

    def write(self, f: int, found: dict[str, Any]) -> None:
        """Take frame f."""
        if not self.rows:
            self.rows = {name: np.empty((self.times.size, *getattr(value, "shape", ()))) for name, value in found.items()}
        for name, value in found.items():
            self.rows[name][f] = value

    def pause(self, f: int, march: March) -> None:
        """Between steps, before frame f is written."""

    def solution(self, stats: dict[str, Any]) -> Solution:
        """The run."""
        return Solution(t=self.times, s=self.problem.chain.s, stats=stats, problem=self.problem, **self.rows)


class Recording(Rows):
    """Frames in a file.

    Parameters
    ----------
    path : the file; made anew, or that of the same run, which then goes on.
    about : what is known of `stats` from the start.
    estimate : of the run's error, if it is known.

    Raises
    ------
    ValueError : if there is another run in the file, or something else.
    """

    def __init__(
        self, problem: Problem, times: NDArray, path: str | Path, about: dict[str, Any], estimate: dict[str, float] | None = None
    ) -> None:
        super().__init__(problem, times)
        self.path, self.about, self.estimate = Path(path), about, estimate
        self.restart = self.path.with_name(self.path.name + ".restart")
        self.file: FrameFile | None = None
        self.asked = False  # to stop
        self.due = clock.perf_counter() + SECONDS
        if self.path.is_dir():
            raise ValueError(f"{self.path} cannot be written: it is a folder")
        if self.path.exists():
            self.file = FrameFile.open(self.path, writable=True)
            try:
                self._check(self.file)
            except BaseException:
                self.__exit__()
                raise
            self.complete = bool(self.file.attrs["complete"])

    def __enter__(self) -> "Recording":
        # Ctrl-C is heard between steps, where the memory is whole; the second one at once
        self._handler: Any = None
        if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._handler = signal.signal(signal.SIGINT, self._interrupted)
        return self

    def _interrupted(self, number: int, frame: Any) -> None:
        self.asked = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    def __exit__(self, *error: object) -> None:
        if getattr(self, "_handler", None) is not None:
            signal.signal(signal.SIGINT, self._handler)
        if self.file is not None:
            self.file.__exit__()

    def begin(self, march: March) -> int:
        self._started = clock.perf_counter()
        if self.file is None or not self.restart.exists():
            return 0
        kept = read_restart(self.restart)
        try:
            march.recall(kept)
            self.seconds = float(kept["seconds"])
            return int(kept["frame"])
        except (KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
            raise ValueError(f"{_damaged(self.restart)}: {error}") from None

    def write(self, f: int, found: dict[str, Any]) -> None:
        if self.file is None:
            self.restart.unlink(missing_ok=True)  # of a run that is no more
            head = archive.header(self.problem, self.times, self.problem.chain.s, self.about, self.estimate, False)
            with fresh(self.path) as temporary:
                FrameFile.create(temporary, head, {name: np.shape(value) for name, value in found.items()}).__exit__()
            self.file = FrameFile.open(self.path, writable=True)
        self.file.write(f, found)

    def pause(self, f: int, march: March) -> None:
        if self.file is None or not (self.asked or clock.perf_counter() > self.due):
            return
        started = clock.perf_counter()
        self.file.flush()
        with fresh(self.restart) as temporary, open(temporary, "wb") as file:
            np.savez(file, frame=f, seconds=self.seconds + started - self._started, **march.keep())
        self.due = clock.perf_counter() + max(SECONDS, 20 * (clock.perf_counter() - started))
        if self.asked:
            where = f"interrupted at step {march.step}; {self.path} holds {f} of {self.times.size} frames"
            raise KeyboardInterrupt(f"{where}, and the same call goes on from there")

    def solution(self, stats: dict[str, Any]) -> Solution:
        """The run, its file finished, or as it was finished before."""
        if not self.complete:
            archive.finish(self.path, stats)
            self.restart.unlink(missing_ok=True)
        with FrameFile.open(self.path) as file:
            return file.solution(self.problem)

    def _check(self, file: FrameFile) -> None:
        """Whether the file is of the same run."""
        if file.problem is None:
            raise ValueError(f"{self.path} holds a field; give another path, or delete it")
        there, here = (numbers | arrays for numbers, arrays in map(archive.describe, (file.problem, self.problem)))
        there, here = (
            {k: v.tobytes() if isinstance(v, np.ndarray) else archive.as_text(v) for k, v in told.items()} for told in (there, here)
        )
        for name in SETTINGS:
            there[name], here[name] = (archive.as_text(told.get(name)) for told in (file.attrs["stats"], self.about))
        there["frames"], here["frames"] = file.static["time"].tobytes(), self.times.tobytes()
        for name in {**there, **here}:
            one, other = there.get(name), here.get(name)
            if one != other:
                told = "" if isinstance(one, bytes) or isinstance(other, bytes) else f": {one} there, {other} here"
                raise ValueError(f"{self.path} holds another run, whose {name} differs{told}; give another path, or delete it")
        if "phi" in file and "phi_rate" not in file:
            told = "was begun by an older version, which did not record phi_rate"
            raise ValueError(f"{self.path} {told}; give another path, or delete it")


def kept_settings(path: str | Path, tol: float | Mapping[str, float] | None) -> tuple[Integrator, float, dict[str, Any]] | None:
    """Integrator and step of the run in a file, and what is known of its search, for `stats`; None if there is no file.

    ValueError if it was made for another tolerance.
    """
    if not Path(path).exists():
        return None
    with FrameFile.open(path) as file:
        stats = file.attrs["stats"]
    if tol is not None and stats.get("tol") != tol:
        told = f": {stats.get('tol')} there, {tol} here"
        raise ValueError(f"{path} holds another run, whose tol differs{told}; give another path, or delete it")
    try:
        searched = {name: stats[name] for name in ("tol", "attempts") if name in stats}
        return from_settings(str(stats["settings"])), checks.number("dt", stats["dt"], positive=True), searched
    except (KeyError, ValueError) as error:
        raise ValueError(f"{path} holds no run that can go on: {error}; give another path, or delete it") from None


def read_restart(path: Path) -> dict[str, Any]:
    """What a restart file says, arrays by name; ValueError if it is damaged."""
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as kept:
            return {name: kept[name] for name in kept.files}
    except (*DAMAGE, EOFError, MemoryError, zipfile.BadZipFile, zlib.error) as error:
        raise ValueError(f"{_damaged(path)}: {error}") from None


def _damaged(path: Path) -> str:
    return f"{path} is damaged; without it the run starts from the beginning, so delete it"
