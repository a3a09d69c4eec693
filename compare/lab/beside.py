"""The field beside the discs: computed by another process, once for each scene, and compared with the discs as they move."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import Executor, Future
from typing import Any, NamedTuple

import numpy as np

from compare.background import Workers
from compare.lab.settings import Settings
from continuum import Scene, solve
from continuum.solver import spline
from discs.arrays import Float

TOLERANCE = 2e-3  # of the field, loose: the discs of a lab are farther away
FRAMES = 181
MOST = 8  # fields that are remembered
SETTLED = 0.4  # seconds without a change before the field is computed


class Field(NamedTuple):
    """A field at the places of the discs: t (F,), values (F, rows, n), rates of them, and the estimated error of x, y, theta."""

    t: Float
    rows: tuple[str, ...]
    values: Float
    rates: Float
    error: float

    def at(self, t: float) -> dict[str, Float] | None:
        """The rows at a time, (n,), by cubic Hermite interpolation; None after the end."""
        if not t <= self.t[-1] * (1 + 1e-9):
            return None
        j = min(int(np.searchsorted(self.t, t, side="right")), self.t.size - 1)
        h = float(self.t[j] - self.t[j - 1])
        u = min((t - float(self.t[j - 1])) / h, 1.0)
        a, b = self.values[j - 1], self.values[j]
        da, db = h * self.rates[j - 1], h * self.rates[j]
        now = a + u * u * (3 - 2 * u) * (b - a) + u * (1 - u) ** 2 * da - u * u * (1 - u) * db
        return dict(zip(self.rows, now, strict=True))


def computed(scene: Scene, s: Float) -> Field:
    """The field of a scene at places s (n,): what the other process does."""
    found = solve(scene, TOLERANCE, frames=FRAMES, progress=False, want=("velocity",))
    rows = ("x", "y", "theta", "phi") if scene.steered else ("x", "y", "theta")
    of = {"x": "x_rate", "y": "y_rate", "theta": "omega", "phi": "phi_rate"}
    growth = {"x": scene.shift[0], "y": scene.shift[1], "phi": 2 * np.pi * scene.turns}

    def sampled(name: str, grows: float = 0.0) -> Any:
        values = getattr(found, name) - grows * found.s / scene.rod.length
        return spline(scene, found.s, values)(s).T + grows * s / scene.rod.length

    values = np.stack([sampled(name, growth.get(name, 0.0)) for name in rows], axis=1)
    rates = np.stack([sampled(of[name]) for name in rows], axis=1)
    error = max(value for name, value in (found.error_estimate or {}).items() if name in rows)
    return Field(found.t, rows, values, rates, error)


class Fields:
    """Fields by what they depend on; one process computes them, one after the other, and is started by the first."""

    def __init__(self) -> None:
        self._workers: Executor | None = None
        self._kept: OrderedDict[Hashable, Future[Field]] = OrderedDict()
        self._lock = threading.Lock()

    def ask(self, key: Hashable, scene: Scene, s: Float) -> "Future[Field]":
        """The field of a scene, known by its key; those that wait and were asked for before, for other keys, are not cancelled."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
            if self._workers is None:
                self._workers = Workers(1)
            future: Future[Field] = self._workers.submit(computed, scene, s)
            self._kept[key] = future
            while len(self._kept) > MOST:
                self._kept.popitem(last=False)[1].cancel()
            return future

    def close(self) -> None:
        """End the process."""
        with self._lock:
            if self._workers is not None:
                self._workers.shutdown(wait=False, cancel_futures=True)
            self._workers = None
            self._kept.clear()


class Beside:
    """The field that one session compares its discs with: whether it is asked for, on its way, or there.

    Parameters
    ----------
    fields : computes fields; None shows none.
    clock : seconds.
    """

    def __init__(self, fields: Fields | None, clock: Callable[[], float]) -> None:
        self.on = fields is not None
        self._fields, self._clock, self._changed = fields, clock, clock()
        self._future: Future[Field] | None = None

    def show(self, on: bool) -> None:
        """Show it, or not."""
        self.on = on and self._fields is not None

    def change(self, again: bool) -> None:
        """The settings have changed; `again` : from t = 0, so another field belongs to them."""
        self._changed = self._clock()
        if again:
            self._future = None

    def look(self, settings: Settings, s: Float) -> None:
        """Ask for the field of the settings, at the places s of the discs, when nothing has changed for a while."""
        if self._fields is not None and self.on and self._future is None and self._clock() - self._changed > SETTLED:
            self._future = self._fields.ask(settings.of_field, settings.make_scene(), s)

    def told(self, touched: bool) -> tuple[str, Field | None]:
        """What the page says of the field, and the field if it can be shown."""
        if not self.on:
            return "", None
        if touched:
            return "The field is that of an untouched run: press Reset to compare with it.", None
        if self._future is not None and self._future.cancelled():
            self._future = None
        if self._future is None or not self._future.done():
            return "The field is being computed.", None
        error = self._future.exception()
        if error is not None:
            return f"There is no field for this scene: {error}", None
        return "", self._future.result()
