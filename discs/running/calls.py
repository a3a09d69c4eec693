"""Calls on an executor, their end by Ctrl-C, and how many cores there are."""

import os
from collections.abc import Callable, Mapping
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed
from contextlib import suppress
from contextvars import ContextVar
from threading import Event
from typing import Any, TypeVar

Key = TypeVar("Key")


def call_each(
    workers: Executor, function: Callable[..., Any], calls: Mapping[Key, tuple[Any, ...]], took: Callable[[Key, Future[Any]], None]
) -> None:
    """Call a function with each of the arguments `calls`; `took` gets the key and the future of each call that ends.

    Calls that a broken executor loses are left out. If this or `took` raises, calls that have not begun are cancelled.
    """
    futures: dict[Future[Any], Key] = {}
    try:
        with suppress(BrokenExecutor):
            for key, arguments in calls.items():
                futures[workers.submit(function, *arguments)] = key
        for future in as_completed(futures):
            with suppress(BrokenExecutor):
                took(futures[future], future)
    except BaseException:
        for future in futures:
            future.cancel()
        raise


HALT: ContextVar[Event | None] = ContextVar("halt", default=None)  # of this thread, if it is not the main one


def heed_halt() -> None:
    """Raise KeyboardInterrupt if `HALT` is set: Ctrl-C reaches the main thread only."""
    if (halt := HALT.get()) is not None and halt.is_set():
        raise KeyboardInterrupt


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
