"""The restart file beside the file of a run: the integrator's state, its run, and the lock of the process that writes."""

import os
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from discs.arrays import Array
from discs.files import archive, safe
from discs.files.finishing import put_back
from discs.files.framefile import DAMAGE, FrameFile

FROM_THE_BEGINNING = "without it the run starts from the beginning, so delete it"


class Restart:
    """The restart file of the run at `path`; empty until a state is kept, removed when the run is complete.

    Attributes
    ----------
    path : of the restart file.
    kept : its content, by name.
    held : whether this process has the lock and so may write the file of the run.
    """

    def __init__(self, path: Path) -> None:
        self.run, self.path = path, archive.restart_of(path)
        self.kept: dict[str, Array] = {}
        self._fd: int | None = None

    @property
    def held(self) -> bool:
        return self._fd is not None

    def take(self) -> None:
        """Lock the file and read it. ValueError if another process has it, it is damaged, or none can be made for a new run."""
        try:
            self._fd = safe.hold(self.path)
        except BlockingIOError:
            raise archive.busy(self.run) from None
        except OSError as error:
            if not self.run.exists():  # an existing run can still be read
                raise ValueError(f"{self.run} cannot be written: {error.strerror}") from None
            return
        if os.fstat(self._fd).st_size:
            self.kept = read_restart(self.path)

    def opened(self) -> FrameFile:
        """The file of the run, restored first if its process was killed while completing it."""
        try:
            return FrameFile.open(self.run, writable=self.held)
        except ValueError:
            torn = self.held and "bytes" in self.kept and self.run.stat().st_size >= self.kept["ends"][-1, 1]
            if not torn:
                raise
        put_back(self.run, self.kept)
        return FrameFile.open(self.run, writable=True)

    def keep(self, content: dict[str, Any]) -> None:
        """Replace the content; the lock passes to the new file."""
        assert self._fd is not None
        with safe.fresh(self.path) as new:
            np.savez(new, **content)
            held = os.dup(new.fileno())
        os.close(self._fd)
        self._fd = held

    def clear(self) -> None:
        """Empty the file, whose run no longer exists."""
        assert self._fd is not None
        os.ftruncate(self._fd, 0)
        self.kept = {}

    def close(self, done: bool = False) -> None:
        """Release the lock; remove the file if the run is done or nothing was kept."""
        if self._fd is not None:
            safe.release(self._fd, self.path if done or not os.fstat(self._fd).st_size else None)


def read_restart(path: Path) -> dict[str, Array]:
    """The arrays of a restart file, by name; ValueError if it is damaged."""
    try:
        with open(safe.opened(path), "rb") as file, np.load(file, allow_pickle=False) as kept:
            return {name: kept[name] for name in kept.files}
    except (*DAMAGE, EOFError, MemoryError, zipfile.BadZipFile, zlib.error) as error:
        raise ValueError(f"{path} is damaged; {FROM_THE_BEGINNING}: {error}") from None
