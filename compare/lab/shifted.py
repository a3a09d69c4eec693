"""Loads whose signals began some time ago: what a run that goes on from a later moment needs."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from discs.loads import signals
from discs.skew import Load


@dataclass(frozen=True)
class Later(signals.Named):
    """A signal of `discs.loads.signals`, a time `by` after its start."""

    signal: signals.Named
    by: float

    @property
    def breaks(self) -> tuple[float, ...]:
        return tuple(t - self.by for t in self.signal.breaks)

    def formula(self, xp: Any = np) -> Callable[[Any], Any]:
        inner, by = self.signal.formula(xp), self.by
        return lambda t: inner(t + by)


def later(load: Any, by: float) -> Any:
    """A load as it is a time `by` after the start of the run."""
    if not by or isinstance(load, Load):
        return load
    changed: dict[str, Any] = {}
    for entry in fields(load):
        value = getattr(load, entry.name)
        if entry.name in ("signal", "rate") and callable(value):
            changed[entry.name] = Later(value, by) if isinstance(value, signals.Named) else _after(value, by)
    return replace(load, **changed) if changed else load


def _after(signal: Callable[[float], Any], by: float) -> Callable[[float], Any]:
    return lambda t: signal(t + by)
