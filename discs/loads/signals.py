"""Signals: functions of time that loads are multiplied by, named so that scene files can hold them.

Each is a frozen function of t, a number or an array. Any other function of a number t can be a signal too.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float

Signal = Callable[[float], Any]


class Named:
    """A signal that takes arrays of times."""

    def formula(self, xp: Any = np) -> Callable[[Any], Any]:
        """It as a function of t, in functions of NumPy or of another module `xp` that has them; numba compiles it."""
        raise NotImplementedError

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times at which it, or a derivative of it, jumps."""
        return ()

    def __call__(self, t: ArrayLike) -> Float:
        found: Float = np.asarray(self.formula()(np.asarray(t, dtype=float)))
        return found


def _check_numbers(signal: Named, *names: str) -> None:
    """Store these attributes as floats; ValueError unless they are finite numbers."""
    for name in names:
        object.__setattr__(signal, name, checks.number(f"{name} of {type(signal).__name__}", getattr(signal, name)))


@dataclass(frozen=True)
class sine(Named):
    """amplitude sin(rate t + phase), with the rate in rad per time; ValueError for what is not a finite number."""

    amplitude: float
    rate: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        _check_numbers(self, "amplitude", "rate", "phase")

    def formula(self, xp: Any = np) -> Callable[[Any], Any]:
        amplitude, rate, phase = self.amplitude, self.rate, self.phase
        return lambda t: amplitude * xp.sin(rate * t + phase)


@dataclass(frozen=True)
class ramp(Named):
    """0 until t0, then a straight line to 1 at t1, then 1; ValueError unless t0 < t1."""

    t0: float
    t1: float

    def __post_init__(self) -> None:
        _check_numbers(self, "t0", "t1")
        if not self.t0 < self.t1:
            raise ValueError(f"t0 of {type(self).__name__} must be less than t1; got {self.t0:g} and {self.t1:g}")

    @property
    def breaks(self) -> tuple[float, ...]:
        return self.t0, self.t1

    def formula(self, xp: Any = np) -> Callable[[Any], Any]:
        t0, t1 = self.t0, self.t1
        return lambda t: xp.minimum(xp.maximum((t - t0) / (t1 - t0), 0.0), 1.0)


@dataclass(frozen=True)
class smooth(ramp):
    """0 until t0, 1 from t1 on, four continuous derivatives: x^5 (126 - 420 x + 540 x^2 - 315 x^3 + 70 x^4) of the ramp x."""

    def formula(self, xp: Any = np) -> Callable[[Any], Any]:
        t0, t1 = self.t0, self.t1

        def value(t: Any) -> Any:
            x = xp.minimum(xp.maximum((t - t0) / (t1 - t0), 0.0), 1.0)
            return x**5 * (126 + x * (-420 + x * (540 + x * (-315 + 70 * x))))

        return value


@dataclass(frozen=True)
class pulse(Named):
    """1 from t0 until t0 + width, otherwise 0; ValueError unless the width is positive.

    Fixed steps see it at the times at which they evaluate forces, so its length is right to about a step.
    """

    t0: float
    width: float

    def __post_init__(self) -> None:
        _check_numbers(self, "t0", "width")
        if self.width <= 0:
            raise ValueError(f"width of pulse must be positive; got {self.width:g}")

    @property
    def breaks(self) -> tuple[float, ...]:
        return self.t0, self.t0 + self.width

    def formula(self, xp: Any = np) -> Callable[[Any], Any]:
        t0, width = self.t0, self.width
        return lambda t: 1.0 * ((t - t0 >= 0) & (t - t0 < width))


@dataclass(frozen=True, eq=False, repr=False)
class table(Named):
    """Values at given times, straight lines between them; before the first and after the last time the value there.

    t : (m,), increasing. values : (m,). ValueError for others.
    """

    t: ArrayLike
    values: ArrayLike

    def __post_init__(self) -> None:
        t = checks.array("t of table", self.t)
        if t.ndim != 1 or not t.size or not np.isfinite(t).all() or (np.diff(t) <= 0).any():
            raise ValueError(f"t of table must be increasing times; got {checks.shown(self.t)}")
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "values", checks.field("values of table", self.values, t.size))

    def __repr__(self) -> str:
        return f"table({np.size(self.t)} values, t = {np.min(self.t):g} to {np.max(self.t):g})"

    @property
    def breaks(self) -> tuple[float, ...]:
        return tuple(np.asarray(self.t).tolist())

    def formula(self, xp: Any = np) -> Callable[[Any], Any]:
        times, values = self.t, self.values
        return lambda t: xp.interp(t, times, values)


@dataclass(frozen=True)
class steady(Named):
    """The signal of a load that has none: 1 at all times."""

    def formula(self, xp: Any = np) -> Callable[[Any], Any]:
        return lambda t: 0.0 * t + 1.0


NAMES: dict[str, type[Named]] = {cls.__name__: cls for cls in (sine, ramp, pulse, smooth, table)}


def check(signal: Signal, duration: float, name: str) -> None:
    """ValueError unless a signal gives finite numbers at the start and the end of a run, the same ones when it is called again.

    duration : of the run. name : of the load, for messages.
    """
    times = np.array([0.0, duration])
    first, again = values(signal, times, name), values(signal, times, name)
    if (first != again).any():
        i = int(np.argmax(first != again))
        need = f"{name}: the signal {checks.shown(signal)} must be a function of t"
        raise ValueError(f"{need}; at t = {times[i]:g} it gave {first[i]:g} and then {again[i]:g}: take signals.table(t, values)")


def values(signal: Signal, times: Float, name: str) -> Float:
    """A signal at times (m,). ValueError with `name`, the load's, and the time if it gives anything but finite real numbers."""
    found = signal(times) if isinstance(signal, Named) else np.array([_value(signal, float(t), name) for t in times])
    if not np.isfinite(found).all():
        i = int(np.argmin(np.isfinite(found)))
        raise ValueError(f"{name}: the signal {checks.shown(signal)} must give finite numbers; got {found[i]} at t = {times[i]:g}")
    return np.asarray(found, dtype=float)


def _value(signal: Signal, t: float, name: str) -> float:
    value = checks.called(f"{name}: the signal {checks.shown(signal)}", signal, t, where=f" at t = {t:g}")
    if isinstance(value, float):
        return value
    try:
        return checks.number("", value)
    except ValueError:
        raise ValueError(
            f"{name}: the signal {checks.shown(signal)} must give a finite number; got {checks.shown(value)} at t = {t:g}"
        ) from None
