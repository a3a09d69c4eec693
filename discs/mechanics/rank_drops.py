r"""Moments at which rows of A become dependent: predicted, and crossed in one step if the motion is smooth.

Examples: a crank and a rod of equal length, both perpendicular to the slider; a flat parallelogram of bars. There the smallest
singular value sigma of A is zero, and the set of configurations has two branches. Along each branch the directions of the rows have
limits, so a motion that arrives on a branch continues on it smoothly. But a path that misses the branch point by c follows the
hyperbola sigma^2 ~ c; its velocity is off by c/tau^2 at a time tau before, and a step control that resolves this stalls or changes
branch.

The moment is predicted from sigma = u.A w and its rate u.A. w, with singular vectors u and w. From a time tau before it, one step
crosses it and ends 1.1 tau after it; no stage of DOP853 is within tau/4 of the moment. The same interval is also crossed in two
steps. The difference of the two results times sigma^2 is c. Closed rows are accurate to rounding (`discs.mechanics.drift`), so
their c is a property of the initial data: up to `MISS` the motion passes through the branch point; above it, the steps follow the
turn, and a step that would cross the moment is repeated with a shorter length. For other rows c contains the errors of the steps;
if it is larger than these, an error ends the integration.

Rows d phi/dv of constraints that are not linear in v may also vanish, as for v.v = 0, or be reversed, and the motion may branch
there. These moments are detected and end the integration, but they are not predicted or crossed.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float
from discs.mechanics.drift import Drift
from discs.mechanics.equations import Equations
from discs.mechanics.saddle import dense
from discs.mechanics.sizes import Sizes

SMOOTH = 1e-5  # largest difference of the two results, relative to each quantity's size
MISS = 1e-9  # relative; initial data with nine digits still reach the branch point
NEAR = 1e-2  # of the largest sigma so far
LARGEST = 100_000  # entries of A; sigma is not watched beyond


class Passage(NamedTuple):
    """A step across a moment of dependent rows: the moment, the step's end, (q, v, mu) there, and a function for times between."""

    moment: float
    end: float
    y: Float
    between: Callable[[float], Float]


class RankDrops:
    """The smallest singular value sigma of A along a motion; rows relative to their largest norms so far, coordinates of mass 1.

    owners : owners of the rows that become dependent, for messages.
    """

    def __init__(self, system: Equations, sizes: Sizes, drift: Drift) -> None:
        self.system, self.sizes, self.drift, self.m = system, sizes, drift, sizes.m
        self.norms = np.zeros(len(system.owners))
        self.linear, self.reversed = system.phi is None, False
        self.watched = 0 < len(system.owners) * len(system.names) <= LARGEST
        self.sigma, self.largest, self.owners, self.held = np.inf, 0.0, "", True
        self.tried = np.inf
        self.rows: Float | None = None  # A of the last state, scaled

    def crossed(self, y: Float) -> bool:
        """Whether det(A A_0^T), A_0 of the last state, is negative: a step crossed dependent rows by accident."""
        if not self.watched or self.rows is None or not np.isfinite(y).all():
            return False
        rows = dense(self.system.rows(y[: self.m], y[self.m : 2 * self.m])) * self.sizes.unit
        self.reversed = bool(np.linalg.det((rows / self._norms()) @ self.rows.T) < 0)
        return self.reversed

    def _norms(self) -> Float:
        return np.where(self.norms > 0, self.norms, 1.0)[:, None]

    def words(self) -> str:
        """The message of an integration that dependent rows end; empty if they do not."""
        if self.watched and self.reversed and not self.linear:
            return (
                f"the rows d phi/dv of the constraints of {', '.join(dict.fromkeys(self.system.owners))} vanish there, or are "
                "reversed: the constraints are singular, and the motion may branch; stop earlier, or write them differently"
            )
        if not self.watched or self.sigma >= NEAR * self.largest:
            return ""
        return (
            f"the constraints of {self.owners} become dependent there (smallest singular value of A {self.sigma:.1g}, "
            f"{self.largest:.1g} before): the motion branches there, and no branch continues it smoothly, or its error is too "
            "large to choose one; take a smaller rtol, or stop earlier"
        )

    def passage(
        self, rate: Callable[[float, Float], Float], solver: "scipy.integrate.OdeSolver", direction: float, rtol: float
    ) -> Passage | None:
        """A step across a moment of dependent rows less than a step away; None if there is none, or the motion is not smooth."""
        if not self.watched:
            return None
        step, tau = abs(getattr(solver, "h_abs", solver.step_size)), self._time_to_zero(solver.y, direction)
        if not tau < 1.2 * step:
            self.tried = np.inf
            return None
        if isinstance(solver, scipy.integrate.DOP853) and tau > 0.6 * step:
            solver.h_abs = 0.6 * tau  # the next step crosses it from there
            return None
        if tau > 0.3 * self.tried:
            return None
        self.tried = tau
        y = self.drift.corrected(solver.y, solver.t)
        t, length = solver.t, direction * tau / 0.475  # nodes of DOP853 are 1/3 and 0.6, the moment is between
        once, between = _steps(rate, y, (t, t + length))
        twice, _ = _steps(rate, y, (t, t + 0.05 * length, t + length))
        off = float(np.max(np.abs(once - twice) / np.maximum(self.sizes.of(y), np.abs(once))))
        if off < SMOOTH and off * (self.sigma / self.largest) ** 2 < (MISS if self.held else 100 * rtol):
            self.rows = None  # the rows change sign
            return Passage(t + direction * tau, t + length, once, between)
        return None

    def lost(self) -> bool:
        """Whether rows that are not closed are too near to dependent for any step to be reliable."""
        return self.watched and not self.held and self.sigma < NEAR * self.largest

    def _time_to_zero(self, y: Float, direction: float) -> float:
        q, v = y[: self.m], y[self.m : 2 * self.m]
        rows, norms = dense(self.system.rows(q, v)) * self.sizes.unit, self.norms if self.linear else 0.0
        self.norms = np.maximum(norms, np.linalg.norm(rows, axis=1))
        norms = self._norms()
        self.rows = rows / norms
        left, values, right = np.linalg.svd(self.rows, full_matrices=False)
        self.sigma = float(values[-1])
        self.largest = max(self.largest, self.sigma)
        weight = np.abs(left[:, -1])
        theirs = weight > 0.1 * weight.max()
        self.owners = ", ".join(dict.fromkeys(o for o, w in zip(self.system.owners, theirs, strict=True) if w))
        self.held = bool(self.drift.rows[theirs].all())
        if not self.linear:
            return np.inf
        change = dense(self.system.constraint_rate(q, v)) * self.sizes.unit / norms
        falls = -direction * float(left[:, -1] @ change @ right[-1])
        return self.sigma / falls if falls > 0 else np.inf


def _steps(rate: Callable[[float, Float], Float], y: Float, times: tuple[float, ...]) -> tuple[Float, Callable[[float], Float]]:
    """DOP853 with given steps, without error control."""
    for a, b in pairwise(times):
        most = 1e6 * (1 + np.abs(y).max())
        found = scipy.integrate.solve_ivp(
            rate, (a, b), y, "DOP853", dense_output=True, rtol=1.0, atol=most, first_step=abs(b - a), max_step=abs(b - a)
        )
        y = found.y[:, -1]
    return y, found.sol
