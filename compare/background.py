"""Processes beside this one, that end with the work they help."""

import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context

from tqdm import tqdm


@contextmanager
def background(processes: int = 1) -> Iterator[Executor]:
    """An executor of so many processes; what they still do when the block fails is stopped at once."""
    with ProcessPoolExecutor(processes, get_context("spawn"), _quietly) as executor:
        try:
            yield executor
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            for process in active_children():
                process.terminate()
            raise


def _quietly() -> None:
    """Leave interrupts to the main process, and lock progress bars within this one (a shared lock would leak)."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tqdm.set_lock(threading.RLock())
