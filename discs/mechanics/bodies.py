"""Where the discs of a mechanical system are: its motion as a run of discs, for pictures and files."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from discs.arrays import Float
from discs.mechanics.derivatives import Formula
from discs.problem import Problem
from discs.solution import Solution
from discs.stats import Stats

ROWS = (("x", "x_rate"), ("y", "y_rate"), ("theta", "omega"), ("phi", "phi_rate"))


@dataclass(frozen=True, eq=False)
class Bodies:
    """The places of n upright discs at given coordinates.

    Attributes
    ----------
    place : q -> (x, y, theta, phi), each a number or (n,): contact point, roll angle, direction of the axle. A line of discs whose
        axles follow it needs no phi. Velocities are its derivatives, see `discs.mechanics.derivatives`.
    radius : of the discs; None if it is unknown, and pictures choose one.
    problem : the problem of discs, if they are a chain's.
    """

    place: Callable[[Float], Any]
    radius: float | None = None
    problem: Problem | None = None

    def shape(self, q: Float) -> tuple[int, int]:
        """Rows of `place` and number of discs; ValueError for a wrong shape at q."""
        given = np.asarray(self.place(q))
        shape = (len(given), 1) if given.ndim == 1 else given.shape
        least = 3 if given.ndim == 2 and shape[1] > 1 else 4  # one disc has no line to follow
        if len(shape) != 2 or not least <= shape[0] <= 4 or not shape[1]:
            raise ValueError(
                "bodies must be q -> (x, y, theta, phi), each a number or one for each disc, phi being the direction of the axle; "
                f"got shape {given.shape}"
            )
        return shape

    def run(self, t: Float, q: Float, v: Float, energy: Float, stats: dict[str, Any]) -> Solution:
        """The motion of the discs, from coordinates and velocities (F, m)."""
        place = Formula("bodies", self.place, self.shape(q[0]), q.shape[1])
        at = np.array([place(z) for z in q])
        rates = np.array([place.along(*z) for z in zip(q, v, strict=True)])
        rows: dict[str, Any] = {name: at[:, i] for i, (name, _) in enumerate(ROWS[: at.shape[1]])}
        rows |= {name: rates[:, i] for i, (_, name) in enumerate(ROWS[: at.shape[1]])}
        told: Stats = {"method": str(stats.get("method"))}
        if self.radius is not None:
            told["radius"] = self.radius
        return Solution(t=t, s=self._places(at[0]), energy=energy, problem=self.problem, stats=told, **rows)

    def _places(self, at: Float) -> Float:
        """Places along the line, (n,): those of the problem, or lengths along the line at the first frame."""
        if self.problem is not None:
            return self.problem.chain.s
        gaps = np.hypot(*np.diff(at[:2], axis=1))
        return np.append(0.0, np.cumsum(np.where(gaps > 0, gaps, 1.0)))


def blade(q: Float) -> list[Any]:
    """A skate at q = (x, y, phi), its blade along phi: drawn as a disc that does not turn."""
    return [q[0], q[1], 0 * q[2], q[2] - np.pi / 2]
