"""Storage of frames: in memory, or in a file from which an interrupted run can continue.

Until a run is finished, a restart file `run.nc.restart` lies beside `run.nc`. It holds the memory of the integrator and is replaced
about once a second. A run that was killed continues from it and computes the later frames again, to the same bits; see
`discs.files.restart`.
"""

import hashlib
import signal
import threading
import time as clock
from collections.abc import Callable, Mapping
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.files import archive, safe, schema, untrusted
from discs.files.finishing import finish, outside
from discs.files.framefile import FrameFile, room
from discs.files.restart import FROM_THE_BEGINNING, Restart
from discs.integrators import Integrator, from_settings
from discs.problem import Problem
from discs.running.time_loop import March
from discs.solution import Solution
from discs.stats import Stats, of_search
from discs.warn import warn

SECONDS = 1.0  # between two restart files, or twenty times the time of writing one if that is more
SETTINGS = ("settings", "dt", "engine", "threads", "want")  # entries of stats that must agree for a run to continue


class Rows:
    """Frames in memory."""

    def __init__(self, problem: Problem, times: Float) -> None:
        self.problem, self.times = problem, times
        self.rows: dict[str, Any] = {}

    def __enter__(self) -> "Rows":
        return self

    def __exit__(self, *error: object) -> None:
        pass

    complete = False  # whether the file holds the finished run
    seconds = 0.0  # spent on the run by earlier calls

    def begin(self, march: March, first: Callable[[], dict[str, Any]]) -> int:
        """Restore the state of an interrupted run; returns the first frame to compute. `first()` is the frame at t = 0."""
        return 0

    def write(self, f: int, found: dict[str, Any]) -> None:
        """Store frame f."""
        if not self.rows:
            checks.fits(f"frames = {self.times.size}", self.times.size * sum(np.size(value) for value in found.values()))
            for name, value in found.items():
                shape = value.shape if type(value) is np.ndarray else ()
                self.rows[name] = np.empty((self.times.size, *shape))
        for name, value in found.items():
            self.rows[name][f] = value

    def pause(self, f: int, march: March) -> None:
        """Called between steps, before frame f is written."""

    def solution(self, stats: Stats, march: March | None = None) -> Solution:
        """The finished run."""
        return Solution.of(self.problem, self.problem.chain.s, self.times, stats, self.rows)


class Recording(Rows):
    """Frames in a file.

    The restart file exists as long as the run, and is empty at first. It is locked: only the process with the lock may write to
    either file. It names its run.

    Parameters
    ----------
    path : the file; a new one, or that of the same run, which then continues.
    about : the entries of `stats` that are known at the start.
    estimate : the error estimate of the run, if it is known.

    Raises
    ------
    ValueError : on entering, if the file holds another run or something else, or if another process writes to it.
    """

    def __init__(
        self, problem: Problem, times: Float, path: str | Path, about: Stats, estimate: dict[str, float] | None = None
    ) -> None:
        super().__init__(problem, times)
        self.path, self.about, self.estimate = archive.named(path), about, estimate
        self.restart = Restart(self.path)
        self.identity = _identity(problem, times, about)
        self.run = hashlib.sha256(repr(sorted(self.identity.items())).encode()).hexdigest()  # names it in the restart file
        self.file: FrameFile | None = None
        self.step = 0  # of the last restart file
        self.empty = False  # whether the file was created here and has no frames yet
        self.asked = False  # whether Ctrl-C was pressed
        self.due = clock.perf_counter() + SECONDS

    def __enter__(self) -> "Recording":
        try:
            self._open()
        except BaseException:
            self._close()
            raise
        # the first Ctrl-C takes effect between steps, where the memory is consistent; the second one at once
        self._handler: Callable[[int, FrameType | None], object] | int | None = None
        if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._handler = signal.signal(signal.SIGINT, self._interrupted)
        return self

    def _open(self) -> None:
        """Open the file, if it exists and holds this run."""
        self.restart.take()
        if not self.path.exists():
            return
        self.file = self.restart.opened()
        self._check(self.file)
        if self.restart.kept and str(self.restart.kept.get("run")) != self.run:
            raise ValueError(f"{self.restart.path} is of another run, or of an earlier version; {FROM_THE_BEGINNING}")
        self.complete = bool(self.file.attrs["complete"])
        if not self.complete and not self.restart.held:
            raise ValueError(f"{self.path} holds a run that is not finished, and {self.restart.path} cannot be written")

    def _interrupted(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    def __exit__(self, *error: object) -> None:
        if self._handler is not None:
            signal.signal(signal.SIGINT, self._handler)
        self._close()

    def _close(self) -> None:
        if self.file is not None:
            if self.empty and self.file.same():
                self.path.unlink()
            self.file.__exit__()
        self.restart.close(self.complete)

    def begin(self, march: March, first: Callable[[], dict[str, Any]]) -> int:
        self._started = clock.perf_counter()
        if self.file is None:
            self._create(first())
            return 0
        if lacking := [name for name in first() if name not in self.file]:
            what = f"was begun by an older version, which did not record {', '.join(lacking)}"
            raise ValueError(f"{self.path} {what}; give another path, or delete it")
        if not (kept := self.restart.kept):
            return 0
        try:
            f = int(kept["frame"])
            march.recall(kept)
            self.seconds, self.step = float(kept["seconds"]), march.step
        except (KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
            raise ValueError(f"{self.restart.path} is damaged; {FROM_THE_BEGINNING}: {error}") from None
        if (whole := self.file.whole(f)) < f:
            raise ValueError(
                f"{self.path} is older than {self.restart.path.name}, which goes on at frame {f}: frame {whole} is not there; "
                f"{FROM_THE_BEGINNING}"
            )
        return f

    def _create(self, found: dict[str, Any]) -> None:
        """Create the file with space for all frames, each with the quantities of the one found."""
        self.restart.clear()
        head = schema.header(self.problem, self.times, self.problem.chain.s, self.about, self.estimate, False)
        shapes = {name: np.shape(value) for name, value in found.items()}
        with safe.fresh(self.path, room(head, shapes)) as new:
            FrameFile.create(new.name, head, shapes).__exit__()
            if self.path.exists():
                raise ValueError(f"{self.path} was created by another process while the run began; give another path")
        self.file, self.empty = FrameFile.open(self.path, writable=True), True

    def write(self, f: int, found: dict[str, Any]) -> None:
        assert self.file is not None
        try:
            self.file.write(f, found)
        except OSError as error:
            raise OSError(f"frame {f} of {self.path} cannot be written: {error.strerror}; {self._goes_on()}") from None
        self.empty = False

    def pause(self, f: int, march: March) -> None:
        assert self.file is not None
        if not (self.asked or clock.perf_counter() > self.due):
            return
        started = clock.perf_counter()
        self._check_place()
        self.file.flush()
        self._keep(f, march, {})
        self.due = clock.perf_counter() + max(SECONDS, 20 * (clock.perf_counter() - started))
        if self.asked:
            how = "the same call goes on from there" if self.step == march.step else self._goes_on()
            raise KeyboardInterrupt(
                f"interrupted at step {march.step}; {self.path} holds {f} of {self.times.size} frames, and {how}"
            )

    def _keep(self, f: int, march: March, more: dict[str, Float]) -> None:
        """Replace the restart file and keep its lock. If it cannot be written, the run continues with a warning."""
        seconds = self.seconds + clock.perf_counter() - self._started
        try:
            self.restart.keep({"run": self.run, "frame": f, "seconds": seconds} | march.keep() | more)
        except OSError as error:
            warn(f"{error}; the run goes on, and if it is killed {self._goes_on()}")
        else:
            self.step, self.empty = march.step, False

    def _goes_on(self) -> str:
        """From where the same call would continue a run that ends here, in words."""
        return f"the same call goes on from {f'step {self.step}' if self.step else 'the beginning'}"

    def _check_place(self) -> None:
        assert self.file is not None
        if not self.file.same():
            raise OSError(f"{self.path} was deleted or replaced while a run wrote to it, and the run stops; its frames are lost")

    def solution(self, stats: Stats, march: March | None = None) -> Solution:
        """The finished run; its file is completed first, unless it was complete before."""
        assert self.file is not None
        if march is not None:
            self._check_place()
            self.file.flush()
            self._keep(self.times.size, march, outside(self.file))
            finish(self.file, stats)
            self.complete = True
        return self.file.solution(self.problem)

    def _check(self, file: FrameFile) -> None:
        """Raise ValueError unless the file holds the same run."""
        if file.problem is None:
            raise ValueError(f"{self.path} holds a field; give another path, or delete it")
        there, here = _identity(file.problem, file.static["time"], file.attrs["stats"]), self.identity
        for name in {**there, **here}:
            one, other = there.get(name), here.get(name)
            if one != other:
                words = (
                    ""
                    if isinstance(one, bytes) or isinstance(other, bytes)
                    else f": {untrusted.printable(one)} there, {other} here"
                )
                raise ValueError(f"{self.path} holds another run, whose {name} differs{words}; give another path, or delete it")


def _identity(problem: Problem, times: Float, stats: Stats) -> dict[str, str | bytes]:
    """All that identifies a run, by name: a hash of each array, the rest as text."""
    numbers, arrays = schema.describe(problem)
    told = {name: stats.get(name) for name in SETTINGS} | numbers
    return {name: schema.as_text(value) for name, value in told.items()} | {
        name: hashlib.sha256(np.ascontiguousarray(value).data).digest() for name, value in (arrays | {"frames": times}).items()
    }


def kept_settings(path: str | Path, tol: float | Mapping[str, float] | None) -> tuple[Integrator, float, Stats] | None:
    """Integrator and step of the run in a file, and its entries of `stats` about the search; None if there is no file.

    ValueError if the run was made for another tolerance.
    """
    if not (real := archive.named(path)).exists():
        safe.check_writable(path)
        return None
    restart = Restart(real)
    try:
        restart.take()
        with restart.opened() as file:
            stats = file.attrs["stats"]
    finally:
        restart.close()
    if tol is not None and stats.get("tol") != tol:
        told = f": {stats.get('tol')} there, {tol} here"
        raise ValueError(f"{path} holds another run, whose tol differs{told}; give another path, or delete it")
    try:
        searched = of_search(stats)
        return from_settings(str(stats["settings"])), checks.number("dt", stats["dt"], positive=True), searched
    except (KeyError, ValueError) as error:
        raise ValueError(f"{path} holds no run that can continue: {error}; give another path, or delete it") from None
