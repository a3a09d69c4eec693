"""Systems with a known solution: their record, integration in both time directions, checks of parameters."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.mechanics import MechanicalSystem, Trajectory

WORKS = ("work", "reaction_work")
FRAMES = ("t", "q", "v", "multipliers", "energy", "residual", *WORKS)  # of a Trajectory


@dataclass(frozen=True, eq=False)
class Textbook:
    """A system with a known solution.

    Attributes
    ----------
    system : the equations.
    q, v : (m,), coordinates and velocities at t = 0.
    exact : t -> (q, v, lambda), the motion in closed form; None if there is none.
    invariants : conserved functions of q, v, by name.
    """

    system: MechanicalSystem
    q: Float
    v: Float
    exact: Callable[[float], tuple[Float, Float, Float]] | None = None
    invariants: dict[str, Callable[[Float, Float], float]] = field(default_factory=dict)

    def integrate(self, times: ArrayLike, rtol: float = 1e-11, **options: Any) -> Trajectory:
        """The motion from the initial state at t = 0, at increasing times (F,), which may be negative.

        `options` and errors as of `MechanicalSystem.integrate`; ValueError for times that do not increase.
        """
        t = np.atleast_1d(checks.array("times", times))
        if t.ndim != 1 or not t.size or not np.isfinite(t).all() or not (np.diff(t) > 0).all():
            raise ValueError("times must be at least one, increasing; the initial state is at t = 0")
        before, after = t[t < 0][::-1], t[t >= 0]
        if not before.size and after.size > 1 and after[0] == 0:
            return self.system.integrate(self.q, self.v, after, rtol, **options)
        parts = []
        if before.size:
            path = self.system.integrate(self.q, self.v, [0.0, *before], rtol, **options)
            parts.append(_frames(path, slice(None, 0, -1)))
        if after.size:
            first = () if after[0] == 0 else (0.0,)
            # if only the initial state is needed, it is the first frame of a short motion
            path = self.system.integrate(self.q, self.v, [*first, *after] if after[-1] > 0 else [0.0, _moment(t)], rtol, **options)
            parts.append(_frames(path, slice(len(first), len(first) + after.size)))
        return _joined(parts)


def _moment(t: Float) -> float:
    """A short time, for a motion of which only the initial state is needed."""
    return 1e-6 * float(np.abs(t).max()) or 1e-6


def _frames(path: Trajectory, part: slice) -> Trajectory:
    return replace(path, **{name: value[part] for name in FRAMES if (value := getattr(path, name)) is not None})


def _joined(parts: list[Trajectory]) -> Trajectory:
    last = parts[-1]
    stats = last.stats | {n: sum(p.stats[n] for p in parts) for n in ("steps", "evaluations")}
    stats["rank_drops"] = sorted(moment for p in parts for moment in p.stats["rank_drops"])
    rows: dict[str, Any] = {
        name: np.concatenate([getattr(p, name) for p in parts]) for name in FRAMES if getattr(last, name) is not None
    }
    rows |= {name: rows[name] - rows[name][0] for name in WORKS if name in rows}
    return replace(last, **rows, stats=stats)


def nonzero(name: str, value: float, why: str) -> float:
    """Return a parameter that is finite and not 0, else raise ValueError; `why` says what the system would be with 0."""
    if checks.number(name, value) == 0:
        raise ValueError(f"{name} must not be 0 ({why}); got {checks.shown(value)}")
    return float(value)


def positive(**values: float) -> None:
    """Refuse parameters that are not positive, by name."""
    for name, value in values.items():
        checks.number(name, value, positive=True)


def finite(**values: float) -> None:
    """Refuse parameters that are not finite numbers, by name."""
    for name, value in values.items():
        checks.number(name, value)
