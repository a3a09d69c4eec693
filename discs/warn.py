"""Warnings that point to a line of the user's program, not to one of these packages."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

OURS = ("discs", "continuum", "compare", "importlib")  # importlib: of a module that is imported only when needed


_KEPT: ContextVar[list[str] | None] = ContextVar("kept", default=None)


@contextmanager
def kept() -> Iterator[list[str]]:
    """The messages of our warnings in this block, in this thread, which are then not shown."""
    messages: list[str] = []
    before = _KEPT.set(messages)
    try:
        yield messages
    finally:
        _KEPT.reset(before)


def warn(message: str) -> None:
    """Warn at the nearest line outside our packages; from the command line, where there is none, at the outermost."""
    if (messages := _KEPT.get()) is not None:
        messages.append(message)
        return
    frame = sys._getframe(1)
    while frame.f_back is not None and (frame.f_globals.get("__package__") or "").partition(".")[0] in OURS:
        frame = frame.f_back
    place = frame.f_globals
    name, registry = place.get("__name__", "<string>"), place.setdefault("__warningregistry__", {})
    warnings.warn_explicit(message, UserWarning, frame.f_code.co_filename, frame.f_lineno, name, registry)
