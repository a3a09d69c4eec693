r"""Moments at which rows of A become dependent on the way: found ahead, and passed where the motion is smooth.

A crank and a rod of equal length that both stand across the slider, a parallelogram of bars that is flat: there the smallest
singular value sigma of A is zero, and two ways part. The directions of the rows have limits along each way, and a motion that
arrives on one goes on smoothly on it. But a path that misses the place by c follows the hyperbola sigma^2 ~ c, its velocity is
off by c/tau^2 at a time tau before, and a step control that resolves this comes to a stop or changes ways.

So the moment is predicted from sigma = u.A w and its rate u.A. w, u and w singular vectors. From a time tau before it one step
is taken over it, to 1.1 tau behind; DOP853 evaluates nothing within tau/4 of the moment. The same is done in two steps. Their
difference times sigma^2 is c. Rows that are closed are held to rounding (`discs.mechanics.drift`), so that c is the data's own:
up to `MISS` the motion is taken to pass, and above it the steps follow the turn: one that would go over it is taken again,
shorter. Other rows have the errors of the steps; a motion that misses by more than those stops in words.
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

SMOOTH = 1e-5  # most that two ways over a moment may differ, relative to each quantity's size
MISS = 1e-9  # relative; initial data with nine digits still meet the place where ways part
NEAR = 1e-2  # of the largest sigma so far
LARGEST = 100_000  # entries of A; sigma is not watched beyond


class Passage(NamedTuple):
    """A step over dependent rows: the moment, the step's end, (q, v, mu) there, and at times between."""

    moment: float
    end: float
    y: Float
    between: Callable[[float], Float]


class RankDrops:
    """Watches sigma, the smallest singular value of A with rows relative to their largest norms so far, in coordinates of mass 1.

    owners : whose rows become dependent, in words.
    """

    def __init__(self, system: Equations, sizes: Sizes, drift: Drift) -> None:
        self.system, self.sizes, self.drift, self.m = system, sizes, drift, sizes.m
        self.norms = np.zeros(len(system.owners))
        self.watched = 0 < len(system.owners) * len(system.names) <= LARGEST
        self.sigma, self.largest, self.owners, self.held = np.inf, 0.0, "", True
        self.tried = np.inf
        self.rows: Float | None = None  # A of the last state, scaled

    def crossed(self, y: Float) -> bool:
        """Whether det(A A_0^T), A_0 of the last state, is negative: a step went over dependent rows unasked."""
        if not self.watched or self.rows is None or not np.isfinite(y).all():
            return False
        rows = dense(self.system.constraint(y[: self.m])) * self.sizes.unit
        return bool(np.linalg.det((rows / self._norms()) @ self.rows.T) < 0)

    def _norms(self) -> Float:
        return np.where(self.norms > 0, self.norms, 1.0)[:, None]

    def words(self) -> str:
        """Why a motion ends, if it is because of dependent rows."""
        if not self.watched or self.sigma >= NEAR * self.largest:
            return ""
        return (
            f"the constraints of {self.owners} become dependent there (smallest singular value of A {self.sigma:.1g}, "
            f"{self.largest:.1g} before), where ways part, and the motion has no smooth way on, or its error so far is too "
            "large to tell which is its own; take a smaller rtol, or stop before"
        )

    def passage(
        self, rate: Callable[[float, Float], Float], solver: "scipy.integrate.OdeSolver", direction: float, rtol: float
    ) -> Passage | None:
        """A step over a moment of dependent rows less than a step away; None if there is none, or no smooth way over it."""
        if not self.watched:
            return None
        step, tau = abs(getattr(solver, "h_abs", solver.step_size)), self._time_to_zero(solver.y, direction)
        if not tau < 1.2 * step:
            self.tried = np.inf
            return None
        if isinstance(solver, scipy.integrate.DOP853) and tau > 0.6 * step:
            solver.h_abs = 0.6 * tau  # and over it from there
            return None
        if tau > 0.3 * self.tried:
            return None
        self.tried = tau
        y = self.drift.corrected(solver.y)
        t, length = solver.t, direction * tau / 0.475  # nodes of DOP853 are 1/3 and 0.6, the moment is between
        once, between = _steps(rate, y, (t, t + length))
        twice, _ = _steps(rate, y, (t, t + 0.05 * length, t + length))
        off = float(np.max(np.abs(once - twice) / np.maximum(self.sizes.of(y), np.abs(once))))
        if off < SMOOTH and off * (self.sigma / self.largest) ** 2 < (MISS if self.held else 100 * rtol):
            self.rows = None  # rows have other signs there
            return Passage(t + direction * tau, t + length, once, between)
        return None

    def lost(self) -> bool:
        """Whether rows that drift are so near to dependent that no step can be trusted."""
        return self.watched and not self.held and self.sigma < NEAR * self.largest

    def _time_to_zero(self, y: Float, direction: float) -> float:
        q, v = y[: self.m], y[self.m : 2 * self.m]
        rows = dense(self.system.constraint(q)) * self.sizes.unit
        self.norms = np.maximum(self.norms, np.linalg.norm(rows, axis=1))
        norms = self._norms()
        self.rows = rows / norms
        left, values, right = np.linalg.svd(self.rows, full_matrices=False)
        self.sigma = float(values[-1])
        self.largest = max(self.largest, self.sigma)
        weight = np.abs(left[:, -1])
        theirs = weight > 0.1 * weight.max()
        self.owners = ", ".join(dict.fromkeys(o for o, w in zip(self.system.owners, theirs, strict=True) if w))
        self.held = bool(self.drift.rows[theirs].all())
        change = dense(self.system.constraint_rate(q, v)) * self.sizes.unit / norms
        falls = -direction * float(left[:, -1] @ change @ right[-1])
        return self.sigma / falls if falls > 0 else np.inf


def _steps(rate: Callable[[float, Float], Float], y: Float, times: tuple[float, ...]) -> tuple[Float, Callable[[float], Float]]:
    """DOP853 by given steps, whatever their error."""
    for a, b in pairwise(times):
        most = 1e6 * (1 + np.abs(y).max())
        found = scipy.integrate.solve_ivp(
            rate, (a, b), y, "DOP853", dense_output=True, rtol=1.0, atol=most, first_step=abs(b - a), max_step=abs(b - a)
        )
        y = found.y[:, -1]
    return y, found.sol
