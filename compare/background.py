"""Worker processes: a call that ends its process fails alone."""

import queue
import signal
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

import cloudpickle
from tqdm import tqdm

LOOK = 1.0  # seconds between checks that a process still exists


class Died(RuntimeError):
    """A call that ended its process."""


class NotStarted(RuntimeError):
    """No process could be started."""


class Workers(Executor):
    """An executor with a given number of processes, one call at a time each; functions that cannot be imported are sent by value.

    A call that ends its process raises `Died` with the cause; the next call gets a new process. If the process had served other
    calls before, they may have been the cause, so the call is repeated once in a new process.
    """

    def __init__(self, processes: int = 1) -> None:
        self._calls: queue.SimpleQueue[tuple[Future[Any], bytes] | None] = queue.SimpleQueue()
        self._most, self._workers, self._threads = processes, list[_Worker](), list[threading.Thread]()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call fn(*args, **kwargs) in one of the processes."""
        future: Future[Any] = Future()
        self._calls.put((future, cloudpickle.dumps((fn, args, kwargs))))
        if len(self._workers) < self._most:  # started here, so that an error of starting is raised here
            self._workers.append(_Worker())
            self._threads.append(threading.Thread(target=self._serve, args=(self._workers[-1],), daemon=True))
            self._threads[-1].start()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes when the calls are done, or, with `cancel_futures`, at once."""
        if cancel_futures:
            for worker in self._workers:
                worker.stop()
        for _ in self._threads:
            self._calls.put(None)
        if wait:
            for thread in self._threads:
                thread.join()

    def _serve(self, worker: "_Worker") -> None:
        """Send calls to one process, in a thread of this one."""
        while (order := self._calls.get()) is not None:
            future, call = order
            if worker.stopped:
                future.cancel()
            elif future.set_running_or_notify_cancel():
                try:
                    future.set_result(worker.call(call))
                except BaseException as error:
                    future.set_exception(error)
        worker.end()


class _Worker:
    """A process that is replaced when it has died."""

    def __init__(self) -> None:
        self.stopped, self._lock = False, threading.Lock()
        self._start()

    def _start(self) -> None:
        context = get_context("spawn")
        with self._lock:
            if self.stopped:
                raise Died("it was stopped")
            self._ours, theirs = context.Pipe()
            self._process = context.Process(target=_work, args=(theirs,))
            self._process.start()
        theirs.close()
        self._ready = self._used = False

    def call(self, call: bytes) -> Any:
        """Return the value of a call or raise its error."""
        done = self._answer(call)
        if done is None and self._used:
            self._renew()
            done = self._answer(call)
        if done is None:
            code, ready = self._process.exitcode, self._ready
            how = f"signal {signal.Signals(-code).name}" if code is not None and code < 0 else f"exit code {code}"
            self._renew()
            if not ready:
                raise NotStarted(
                    f"a process ended with {how} at its start; a script must begin this under if __name__ == '__main__'"
                )
            raise Died(f"its process ended with {how}")
        self._used = True
        worked, value = done
        if worked:
            return value
        raise value

    def _answer(self, call: bytes) -> tuple[bool, Any] | None:
        """Whether a call worked, and its value or error; None if its process has died."""
        try:
            if not self._ready:
                self._hear()
                self._ready = True
            self._ours.send_bytes(call)
            done: tuple[bool, Any] = cloudpickle.loads(self._hear())
            return done
        except (EOFError, OSError):
            self._process.join(LOOK)
            return None

    def _hear(self) -> bytes:
        """The next message of the process; EOFError if it died without one. (Its children may keep its end of the pipe open.)"""
        while not self._ours.poll(LOOK):
            if not self._process.is_alive() and not self._ours.poll():
                raise EOFError
        return self._ours.recv_bytes()

    def _renew(self) -> None:
        self._process.kill()
        self.end()
        self._start()

    def stop(self) -> None:
        """End the process at once and start no other."""
        with self._lock:
            self.stopped = True
            self._process.kill()

    def end(self) -> None:
        """Wait for the end of the process, which has no call."""
        self._ours.close()
        self._process.join()


def _work(calls: Connection) -> None:
    """The main function of a process: answer calls until the pipe closes."""
    # the main process handles interrupts; the lock of progress bars is local, as a shared one would leak
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tqdm.set_lock(threading.RLock())
    with suppress(EOFError, OSError):
        calls.send_bytes(b"ready")
        while True:
            calls.send_bytes(_answer(calls.recv_bytes()))


def _answer(call: bytes) -> bytes:
    try:
        function, args, kwargs = cloudpickle.loads(call)
        answer: bytes = cloudpickle.dumps((True, function(*args, **kwargs)))
    except BaseException as error:
        error.add_note(traceback.format_exc())
        try:
            answer = cloudpickle.dumps((False, error))
            cloudpickle.loads(answer)
        except Exception:
            answer = cloudpickle.dumps((False, RuntimeError(f"{type(error).__name__}, which cannot be sent to another process")))
    return answer


@contextmanager
def background(processes: int = 1) -> Iterator[Executor]:
    """An executor of `processes` processes; if the block fails, they are stopped at once."""
    workers = Workers(processes)
    try:
        yield workers
    except BaseException:
        workers.shutdown(cancel_futures=True)
        raise
    workers.shutdown()
