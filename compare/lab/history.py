"""The frames of a live run that are kept: for going back, for the plots, and for saving it."""

from bisect import bisect_right
from dataclasses import dataclass
from typing import Any

import numpy as np

from discs import Problem, Solution, State
from discs.arrays import Float
from discs.stats import Stats

MOST_NUMBERS = 4_000_000  # of all frames: 32 MB
MOST_FRAMES = 4000


@dataclass(frozen=True, eq=False)
class Kept:
    """A frame. work, dissipated : since the start. touched : whether it is no longer the run of its scene, see `Session`."""

    t: float
    state: State
    energy: float
    work: float
    dissipated: float
    touched: bool


class History:
    """Frames in order of time. When they are too many every second one is dropped, and from then on only every second is kept."""

    def __init__(self, n: int) -> None:
        self.frames: list[Kept] = []
        self._most = max(64, min(MOST_FRAMES, MOST_NUMBERS // (6 * n)))
        self._every, self._passed = 1, 0

    def add(self, frame: Kept) -> None:
        """Keep a frame, which is later than all others."""
        self._passed += 1
        if (self._passed - 1) % self._every:
            return
        self.frames.append(frame)
        if len(self.frames) > self._most:
            self.frames, self._every = self.frames[::2], 2 * self._every

    def at(self, t: float) -> Kept:
        """The last frame at or before a time, or the first."""
        return self.frames[max(0, bisect_right(self.frames, t, key=lambda frame: frame.t) - 1)]

    def cut(self, t: float) -> None:
        """Drop the frames after a time."""
        del self.frames[max(1, bisect_right(self.frames, t, key=lambda frame: frame.t)) :]
        self._passed = 0

    def run(self, s: Float, stats: Stats, problem: Problem | None) -> Solution:
        """The frames as a run."""
        states = [frame.state for frame in self.frames]
        rows: dict[str, Any] = {name: np.array([getattr(state, name) for state in states]) for name in ("x", "y", "theta", "omega")}
        if states[0].phi is not None:
            rows |= {name: np.array([getattr(state, name) for state in states]) for name in ("phi", "phi_rate")}
        t, energy = (np.array([getattr(frame, name) for frame in self.frames]) for name in ("t", "energy"))
        balance = np.array([(frame.work, frame.dissipated) for frame in self.frames])
        return Solution(t=t, s=s, energy=energy, balance=balance, stats=stats, problem=problem, **rows)
