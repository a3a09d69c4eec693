"""Signals of loads along the time: where steps must end, and how long they may be.

Signals are cut into pieces on which they are smooth, as the initial fields are (`continuum.pieces`). A step must not jump over a
pulse, and a polynomial in time does not follow a jump or a corner. So steps end at jumps and corners, and a step is not longer than
the shortest piece that it touches. A feature wider than duration/4000 is found wherever it is; narrower ones only if they are jumps
and corners of a signal of `discs.loads.signals`, which tells them.
"""

import numpy as np

from continuum.pieces import TINY, Sampled, split
from continuum.rod import Scene
from discs.arrays import Float
from discs.loads.signals import values


class Timing:
    """The pieces of the signals of a scene.

    Attributes
    ----------
    edges : (P + 1,), from 0 to the duration. stops : (B,), times of jumps and corners, and the duration.
    """

    def __init__(self, scene: Scene) -> None:
        duration = scene.duration
        given = [(getattr(load, "signal", None), type(load).__name__) for load in scene.loads]  # that of a motor is its rate
        changing = [(signal, name) for signal, name in given if signal is not None]
        self.edges, self.stops = np.array([0.0, duration]), np.array([duration])
        if not changing:
            return
        told = [t for signal, _ in changing for t in getattr(signal, "breaks", ()) if 0 < t < duration]

        def read(t: Float) -> list[Float]:
            return [values(signal, t, name) for signal, name in changing]

        edges = np.unique([0.0, *told, duration])
        unit = np.abs(read((edges[1:] + edges[:-1]) / 2)).max(axis=1)  # of pulses that no probe sees
        data = Sampled(read, duration, tuple(f"the signal of {name}" for _, name in changing), unit, "t")
        again = np.abs(data.read(data.probes[::64]) - data.known[:, ::64])
        if (again > 1e3 * data.allowed[:, None]).any():
            data.refuse(0, "", "")
        cut = split(data, edges)
        found = [t for t in cut.breaks() if not told or np.abs(np.array(told) - t).min() > 1e-8 * duration]
        if found:
            cut = split(data, np.unique([0.0, *told, *found, duration]))
        if cut.lost.any():
            p = int(np.argmax(cut.lost))
            data.refuse(int(cut.worst[p]), f"has no finite slope at t = {cut.edges[p]:g}", "take one with finite slopes there")
        self.stops = np.unique([*told, *found, duration])
        inner = cut.edges[(np.abs(cut.edges[:, None] - np.append(self.stops, 0.0)) > TINY * duration).all(axis=1)]
        self.edges = np.unique([0.0, *inner, *self.stops])

    @property
    def shortest(self) -> float:
        """The length of the shortest piece."""
        return float(np.diff(self.edges).min())

    def stop(self, t: float) -> float:
        """The next time after t at which a step must end."""
        return float(self.stops[np.searchsorted(self.stops, t, side="right")])

    def longest(self, t: float) -> float:
        """The longest step from t: it ends before each later piece, or is not longer than it."""
        later = self.edges[1:] > t * (1 + 1e-12)
        return float(np.maximum(self.edges[:-1][later] - t, np.diff(self.edges)[later]).min())
