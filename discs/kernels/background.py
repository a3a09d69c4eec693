"""Kernels compiled by a process of their own, while runs go on without them: what `engine="auto"` does.

A process is started by the first run that finds a kernel missing, and is sent functions to call, one after the other: each calls
its kernels once, which compiles them into the cache on disc. It outlives the run that started it, until they are all there. Where
several such processes run, they take turns, so that a kernel is not compiled by each; one whose run has ended does not wait for its
turn, as later runs ask again. Worker processes wait for their kernels instead, unless `compiling_aside`; so do machines without a
cache.
"""

import hashlib
import multiprocessing
import os
import pickle
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

from discs.kernels.cache import uncached
from discs.kernels.compiled import NotReady, readily

ENGINE = "DISCS_ENGINE"  # in the environment: the engine of runs that are given none
ASIDE = "DISCS_COMPILE_ASIDE"  # in the environment, so that worker processes inherit it; see `compiling_aside`
SECONDS = 1.0  # between two looks whether kernels are there
ASKING = os.getppid()  # the process that asks, where this is the one that compiles
USUAL = [os.environ.get(ENGINE) or "auto"]  # that engine


def usual() -> str:
    """The engine of runs that are given none: the environment variable DISCS_ENGINE, or "auto"."""
    return USUAL[0]


def wait_for_kernels() -> None:
    """Runs that are given no engine wait for their kernels, as where times are measured. DISCS_ENGINE goes first."""
    USUAL[0] = os.environ[ENGINE] = os.environ.get(ENGINE) or "compiled"


@contextmanager
def compiling_aside() -> Iterator[None]:
    """Within it kernels are compiled in the background at the lowest priority, and worker processes do not wait for them either.

    For jobs that plain runs finish before their kernels would be there.
    """
    before = os.environ.get(ASIDE)
    os.environ[ASIDE] = "yes"
    try:
        yield
    finally:
        os.environ.pop(ASIDE)
        if before is not None:
            os.environ[ASIDE] = before


class _Compiler:
    """The process, and what it was asked for."""

    def __init__(self) -> None:
        self.process: subprocess.Popen[bytes] | None = None
        self.asked: set[int] = set()  # hashes of the jobs
        self.lock, self.turn = threading.Lock(), threading.Lock()

    def ask(self, job: bytes) -> bool:
        """Send a job; False if the process ended before it did all that it was asked."""
        with self.lock:
            if self.process is None:
                environment = os.environ | {ENGINE: "compiled", "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
                self.process = subprocess.Popen(
                    [sys.executable, "-m", "discs.kernels.background", *["aside"] * (ASIDE in os.environ)],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    env=environment,
                    start_new_session=True,  # Ctrl-C is for the run
                )
                print("compiling kernels in the background: runs are plain, and slower, until they are there", file=sys.stderr)
            if self.process.poll() is not None:
                return False
            if hash(job) not in self.asked:
                self.asked.add(hash(job))
                threading.Thread(target=self._send, args=(self.process, job), daemon=True).start()
            return True

    def _send(self, process: "subprocess.Popen[bytes]", job: bytes) -> None:
        """Write a job, which waits while an earlier one compiles if it is large."""
        assert process.stdin is not None
        with self.turn:
            try:
                process.stdin.write(job)
                process.stdin.flush()
            except (OSError, ValueError):  # the process has ended, or its pipe is closed: `ask` sees it
                with suppress(OSError):
                    process.stdin.close()


COMPILER = _Compiler()


def missing(prepare: Callable[..., object], *arguments: Any, compiles: bool = True) -> bool:
    """Whether kernels that prepare(*arguments) calls are missing; they are then compiled in the background, if `compiles`.

    prepare is a function of a module, with arguments that can be pickled. If they cannot, in a worker process unless
    `compiling_aside`, and if the process has failed, nothing is missing: the caller waits for its kernels.
    """
    try:
        with readily():
            prepare(*arguments)
    except NotReady:
        if not compiles:
            return True
        if uncached or (multiprocessing.parent_process() is not None and ASIDE not in os.environ):
            return False
        try:
            job = pickle.dumps((prepare, arguments))
        except (pickle.PicklingError, AttributeError, TypeError):
            return False
        return COMPILER.ask(job)
    return False


class Kernels:
    """True if the kernels that prepare(*arguments) calls are there; see `missing`. Until they are it looks again, once a second.

    engine : "auto", which compiles them in the background, or "ready".
    """

    def __init__(self, engine: str, prepare: Callable[..., object], *arguments: Any) -> None:
        self._missing = partial(missing, prepare, *arguments, compiles=engine == "auto")
        self._there, self._looked = not self._missing(), time.monotonic()

    def __bool__(self) -> bool:
        if not self._there and time.monotonic() > self._looked + SECONDS:
            self._there, self._looked = not self._missing(), time.monotonic()
        return self._there


@contextmanager
def _turn(name: str) -> Iterator[None]:
    """Wait for the other processes of this user that compile into the same cache; not at all where files cannot be locked.

    SystemExit if the process that asked ends meanwhile.
    """
    cache = os.environ.get("NUMBA_CACHE_DIR", "") + os.fspath(Path(__file__).resolve().parent)
    with ExitStack() as opened:
        with suppress(ImportError, OSError, AttributeError):
            name = f"rolling-discs-{os.getuid()}-{hashlib.sha256(os.fsencode(cache)).hexdigest()[:12]}-{name}.lock"
            file = Path(tempfile.gettempdir(), name)
            held = os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
            opened.callback(os.close, held)
            while not _locked(held):
                if os.getppid() != ASKING:
                    raise SystemExit
                time.sleep(SECONDS / 4)
        yield


def _locked(file: int) -> bool:
    """Lock an open file, if no other process holds it."""
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _serve(turn: str) -> None:
    """Call the functions that are sent, until there are no more."""
    while True:
        try:
            prepare, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        with _turn(turn):
            prepare(*arguments)


if __name__ == "__main__":
    aside = "aside" in sys.argv
    if aside:
        with suppress(AttributeError, OSError):
            os.nice(19)
        with suppress(OSError):  # Linux may share processors among sessions first, and this process has one of its own
            Path("/proc/self/autogroup").write_text("19")
    _serve("aside" if aside else "soon")  # nobody waits for a process of the lowest priority
