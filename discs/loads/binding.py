"""Loads as users give them: patterns along a rod, which a chain turns into arrays over its discs."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.chains.chain import Chain, SteeredChain
from discs.loads.linear import Drive, Linear
from discs.loads.signals import Signal, steady
from discs.skew import Load

Discs: TypeAlias = Chain | SteeredChain
Pattern: TypeAlias = Any  # a number, an array over the discs (or links), or a function of s
ROW = {"roll": 2, "turn": 3}


class OnRod(ABC):
    """A load whose patterns are numbers, arrays over the discs or functions of s.

    It can be given to any chain, and to the scene of a rod if no pattern is an array.
    """

    @abstractmethod
    def on(self, chain: Discs) -> Load:
        """The load for the discs of a chain. ValueError if it does not fit them."""

    @property
    def _name(self) -> str:
        return type(self).__name__

    def _sampled(self, name: str, pattern: Pattern, places: Float, least: float | None = None) -> Float:
        """A pattern at places (m,) along the rod, (m,)."""
        return sampled(f"{name} of {self._name}", pattern, places, least)

    def _shared(self, chain: Discs, at: float | None, least: float | None = None, **patterns: Pattern) -> list[Float]:
        """Patterns per length times the shares of the discs, (n,); numbers for the disc nearest to `at`, if that is given."""
        if at is None:
            return [self._sampled(name, pattern, within(chain, chain.s), least) * chain.w for name, pattern in patterns.items()]
        disc = self._disc(chain, at)
        return [np.where(np.arange(chain.n) == disc, self._number(name, value, least), 0.0) for name, value in patterns.items()]

    def _number(self, name: str, value: Pattern, least: float | None = None) -> float:
        """A pattern of a load at a point."""
        if callable(value):
            raise ValueError(f"{name} of {self._name} with at= is one number; got {checks.shown(value)}")
        number = checks.number(f"{name} of {self._name} with at=", value)
        if least is not None and number < least:
            raise ValueError(f"{name} of {self._name} must be finite and at least {least:g}; got {number:g}")
        return number

    def _disc(self, chain: Discs, at: float) -> int:
        """The disc nearest to a place along the rod, which may be beyond its end by rounding."""
        place = checks.number(f"at of {self._name}", at)
        if not abs(place - 0.5 * chain.length) <= 0.5 * chain.length * (1 + 1e-12):
            raise ValueError(f"at of {self._name} must be on the rod, from 0 to {chain.length:g}; got {place:g}")
        apart = np.abs(chain.s - place)
        return int(np.argmin(np.minimum(apart, chain.length - apart) if chain.ends == "ring" else apart))

    def _row(self, chain: Discs, about: str) -> int:
        """The row of q of an angle."""
        if checks.choice(f"about of {self._name}", about, ROW) == "turn":
            self._needs_headings(chain, "about='turn'")
        return ROW[about]

    def _needs_headings(self, chain: Discs, what: str) -> None:
        if not isinstance(chain, SteeredChain):
            raise ValueError(f"{self._name}: {what} is for discs with headings of their own; this chain's follow the line")

    def _push(self, chain: Discs, rows: dict[int, Float], signal: Signal | None) -> Linear:
        """Forces (n,) in rows of q, times a signal."""
        return Linear(drives=(Drive(spread(chain, rows), signal_of(self._name, signal), self._name),))


def sampled(name: str, pattern: Pattern, places: Float, least: float | None = None) -> Float:
    """A pattern at places (m,) along the rod, (m,), all at least `least`. ValueError with its name, and s, if it fails."""
    if not callable(pattern):
        return checks.field(name, pattern, places.size, least=least)
    where = f"; it is given an array of {places.size} places s, from {places.min():g} to {places.max():g}"
    values = checks.called(name, pattern, places.copy(), where=where)
    return checks.field(name, values, places.size, least=least, places=places)


def nonzero(pattern: Pattern) -> bool:
    """Whether a pattern is not zero. What is no pattern counts too: it is refused where it is used."""
    try:
        return callable(pattern) or bool(np.any(pattern))
    except (ValueError, TypeError):
        return True


def within(chain: Discs, places: Float) -> Float:
    """Places along the rod, (m,), not beyond its end by rounding."""
    return np.minimum(places, chain.length)


def spread(chain: Discs, rows: Mapping[int, ArrayLike]) -> Float:
    """An array (rows, n) with some of its rows."""
    found = np.zeros((4 if isinstance(chain, SteeredChain) else 3, chain.n))
    for row, values in rows.items():
        found[row] = values
    return found


def signal_of(name: str, signal: Signal | None) -> Signal:
    """The signal of a load, 1 for None; ValueError for what is no function."""
    if signal is None:
        return steady()
    if not callable(signal):
        raise ValueError(f"signal of {name} must be a function of t, as signals.sine(1, 2); got {checks.shown(signal)}")
    return signal
