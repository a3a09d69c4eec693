"""Files that are written whole or not at all, that one process at a time writes, and that are opened without being trusted.

A new file is written under another name in the same folder, brought to the disc, and renamed; then the folder is brought to the
disc too. Its writer holds a lock on it, by which what a killed process has left is told from what another one writes, and removed.
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
except ImportError:  # not on Windows: nothing is locked there
    fcntl = None  # type: ignore[assignment]

PARTIAL = ".discs-partial-"  # how names of files begin that are not finished
BUSY = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def target(path: str | Path) -> Path:
    """The file that a path names, links followed; ValueError where there is something else than a file."""
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
    """Descriptor of a regular file; ValueError at once where there is none, or something that would have to be waited for."""
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
    """A file to write beside `path`, which takes its place when the block ends well and vanishes when it does not.

    With `room`, ValueError at once if so many bytes are not free. The lock on the file belongs to its descriptor: who duplicates
    that holds the lock on.
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
    """Have the names in a folder on the disc, in case the power fails; where the system can do that."""
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
    """Lock an open file against other descriptors that ask; False if another holds it. Where nothing can be locked, True."""
    try:
        if fcntl is not None:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in BUSY
    return True


def hold(path: Path) -> int:
    """Descriptor of a file, made if there is none, that is locked by this process until it closes it.

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
    """Give a held file back, and remove it if it is still at `path`."""
    if path is not None and same(fd, path):
        path.unlink()
    with suppress(OSError):
        if fcntl is not None:  # closing is not enough where a process that was forked from this one has it open too
            fcntl.flock(fd, fcntl.LOCK_UN)
    os.close(fd)


def same(fd: int, path: str | Path) -> bool:
    """Whether an open file is the one at a path."""
    try:
        return os.path.samestat(os.fstat(fd), os.stat(path))
    except FileNotFoundError:
        return False


def _partial(folder: Path) -> IO[bytes]:
    """A new file that is locked, with the rights of any other new file; what killed processes have left is removed."""
    for left in folder.glob(f"{PARTIAL}*"):
        with suppress(OSError):
            release(hold(left), left)
    while True:
        file = open(folder / f"{PARTIAL}{secrets.token_hex(8)}", "x+b")  # noqa: SIM115, it is closed by who asked
        if lock(file.fileno()) and same(file.fileno(), file.name):
            return file
        file.close()  # another process has just taken it for one that was left


def _reason(error: Exception) -> str:
    return os.strerror(error.errno) if isinstance(error, OSError) and error.errno else str(error)
