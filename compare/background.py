"""One process beside this one, that ends with the work it helps."""

import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context

from tqdm import tqdm


@contextmanager
def background() -> Iterator[Executor]:
    """An executor of one process; what it still does when the block fails is stopped at once."""
    with ProcessPoolExecutor(1, get_context("spawn"), _quietly) as executor:
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
