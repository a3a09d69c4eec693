"""Files that are written completely or not at all, by one process at a time, and opened without trust.

A new file is written under a temporary name in the same folder, flushed to the disc, and renamed; then the folder is flushed too.
Its writer holds a lock on it. A temporary file without a lock was left by a killed process and is removed.
"""

import errno
import os
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

try:
    import fcntl
except ImportError:  # Windows has none: nothing is locked there
    fcntl = None  # type: ignore[assignment]

PARTIAL = ".discs-partial-"  # prefix of temporary files
BUSY = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def target(path: str | Path) -> Path:
    """The file at a path, links resolved; ValueError if something other than a file is there."""
    try:
        real = Path(os.path.realpath(path))
        mode = real.lstat().st_mode
    except FileNotFoundError:
        return real
    except (OSError, ValueError, TypeError) as error:
        raise ValueError(f"{path} cannot be written: {_reason(error)}") from None
    if not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else "no regular file"
        raise ValueError(f"{path} cannot be written: it is {what}")
    return real


def check_writable(path: str | Path) -> None:
    """Raise ValueError if no file can be made at `path`."""
    try:
        with tempfile.TemporaryFile(dir=target(path).parent):
            pass
    except OSError as error:
        raise ValueError(f"{path} cannot be written: {_reason(error)}") from None


def opened(path: str | Path, flags: int = os.O_RDONLY) -> int:
    """Descriptor of a regular file; ValueError if there is none, or something that could block, as a FIFO."""
    try:
        fd = os.open(path, flags | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        if stat.S_ISREG(os.fstat(fd).st_mode):
            return fd
        os.close(fd)
    except (OSError, ValueError, TypeError) as error:
        if not (isinstance(error, OSError) and error.errno in (errno.EISDIR, errno.ENXIO)):
            raise ValueError(f"{path} cannot be read: {_reason(error)}") from None
    raise ValueError(f"{path} cannot be read: it is {'a folder' if os.path.isdir(path) else 'no regular file'}")


@contextmanager
def fresh(path: str | Path, room: int = 0) -> Iterator[IO[bytes]]:
    """A temporary file beside `path` that replaces it if the block succeeds and is removed if it fails.

    With `room`, ValueError if fewer bytes are free. The lock on the file belongs to its descriptor; a duplicate of the descriptor
    keeps it.
    """
    real = target(path)
    free = shutil.disk_usage(real.parent).free if room and real.parent.is_dir() else room
    if room > free:
        raise ValueError(f"{path} cannot be written: it needs {room / 1e6:.3g} MB, and {free / 1e6:.3g} MB are free on its disc")
    try:
        file = _partial(real.parent)
    except OSError as error:
        raise ValueError(f"{path} cannot be written: {_reason(error)}") from None
    with file:
        try:
            yield file
            file.flush()
            os.fsync(file.fileno())
            os.replace(file.name, real)
        except BaseException as error:
            with suppress(FileNotFoundError):
                os.unlink(file.name)
            if isinstance(error, OSError) and error.errno in FULL:
                raise OSError(f"{path} cannot be written: {_reason(error)}; make room, or give another path") from None
            raise
    sync(real.parent)


def sync(folder: Path) -> None:
    """Flush the names in a folder to the disc, in case the power fails, if the system can do that."""
    with suppress(OSError):
        fd = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)


def write_all(fd: int, data: bytes | memoryview, offset: int | None = None) -> None:
    """Write all of `data`, at the descriptor's place or at an offset."""
    left = memoryview(data)
    while left:
        done = os.write(fd, left) if offset is None else os.pwrite(fd, left, offset)
        left, offset = left[done:], None if offset is None else offset + done


# Locks


def lock(fd: int) -> bool:
    """Take the advisory lock of an open file; False if another descriptor has it. True if the system has no locks."""
    try:
        if fcntl is not None:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in BUSY
    return True


def hold(path: Path) -> int:
    """Descriptor of a file, created if there is none, that this process locks until it closes it.

    Raises BlockingIOError if another process holds it, another OSError if it cannot be written.
    """
    while True:
        fd = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NONBLOCK", 0), 0o666)
        if not lock(fd):
            os.close(fd)
            raise BlockingIOError(errno.EWOULDBLOCK, f"another process holds {path}")
        if same(fd, path):
            return fd
        os.close(fd)  # it was replaced or removed in between


def release(fd: int, path: Path | None = None) -> None:
    """Release a held file, and remove it if it is still at `path`."""
    if path is not None and same(fd, path):
        path.unlink()
    with suppress(OSError):
        if fcntl is not None:  # closing is not enough if a process forked from this one has it open too
            fcntl.flock(fd, fcntl.LOCK_UN)
    os.close(fd)


def same(fd: int, path: str | Path) -> bool:
    """Whether an open file is the one at a path."""
    try:
        return os.path.samestat(os.fstat(fd), os.stat(path))
    except FileNotFoundError:
        return False


def _partial(folder: Path) -> IO[bytes]:
    """A new locked file with the permissions of any new file; files left by killed processes are removed."""
    for left in folder.glob(f"{PARTIAL}*"):
        with suppress(OSError):
            release(hold(left), left)
    while True:
        file = open(folder / f"{PARTIAL}{secrets.token_hex(8)}", "x+b")  # noqa: SIM115, the caller closes it
        if lock(file.fileno()) and same(file.fileno(), file.name):
            return file
        file.close()  # another process has just removed it as one that was left


def _reason(error: Exception) -> str:
    return os.strerror(error.errno) if isinstance(error, OSError) and error.errno else str(error)
