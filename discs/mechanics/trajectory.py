"""The motion of a mechanical system at given times."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from discs.arrays import Float
from discs.mechanics.bodies import Bodies
from discs.mechanics.equations import Equations
from discs.solution import Result, Solution


@dataclass(frozen=True, eq=False)
class Trajectory(Result):
    """The motion of a mechanical system at F times, with m coordinates and c constraints A v = b.

    Attributes
    ----------
    t : (F,), times. q, v : (F, m), coordinates and velocities.
    multipliers : (F, c), lambda; the forces of constraint are A^T lambda.
    energy : (F,), kinetic and potential. residual : (F,), largest |A v - b|.
    mu : (F, c), the charges of a vakonomic motion, see `discs.mechanics.vakonomic`; None if it is nonholonomic.
    stats : "method", "rtol" as used, "steps", "evaluations" (of accelerations), "rank_drops" (times at which constraints were
        dependent), and "derivatives": of each formula how they were taken and their largest relative error at the frames.
    work, reaction_work : (F,), work since t[0] of the applied forces and of the reaction of constraints (of drives), with
        energy - energy[0] = work + reaction_work up to the tolerance; None if neither can do work.
    names, owners : of the m coordinates and the c constraints.
    bodies : where the system's discs are, or, from a file, their motion; None if it has no discs.

    Multipliers are nan at a moment when rows of A are dependent: they are not determined then. `plot` shows coordinates against
    time; `view` and `animate` need bodies.
    """

    t: Float
    q: Float
    v: Float
    multipliers: Float
    energy: Float
    residual: Float
    mu: Float | None = None
    stats: dict[str, Any] = field(default_factory=dict)
    work: Float | None = None
    reaction_work: Float | None = None
    names: tuple[str, ...] = ()
    owners: tuple[str, ...] = ()
    bodies: Bodies | Solution | None = None

    def __repr__(self) -> str:
        frames, m = self.q.shape
        done = None if self.work is None or self.reaction_work is None else self.work + self.reaction_work
        off = np.abs(self.energy - self.energy[0] - (0.0 if done is None else done)).max()
        return (
            f"Trajectory({frames} frames of {m} coordinates, t = {self.t[0]:g} to {self.t[-1]:g}, method "
            f"{self.stats.get('method')!r}, energy {self.energy[0]:.6g}{'' if done is None else ' and works'} to within {off:.1e})"
        )

    @property
    def discs(self) -> Solution:
        """The motion of the system's discs as a run; ValueError if it does not say where they are."""
        if self.bodies is None:
            raise ValueError(
                "the system does not say where its discs are: give it bodies, q -> (x, y, theta, phi), or plot its coordinates "
                "against time by plot()"
            )
        if isinstance(self.bodies, Solution):
            return self.bodies
        found = self.bodies.run(self.t, self.q, self.v, self.energy, self.stats)
        if self.work is None or self.reaction_work is None:
            return found
        return replace(found, balance=np.stack([self.work + self.reaction_work, 0 * self.work], axis=1))


def at_frames(system: Equations, t: Float, found: Float, charged: bool, stats: dict[str, Any]) -> Trajectory:
    """The trajectory of the states `found` (F, 2m + charges + works), see `discs.mechanics.motion.Rate`, at times t (F,)."""
    m, c = len(system.names), len(system.owners)
    path, speed, charges, works = np.split(found, np.cumsum([m, m, c * charged]), axis=1)
    multipliers = np.full((t.size, c), np.nan)
    errors = dict.fromkeys((f.name for f in system.derived), 0.0)
    for frame, (q, v, mu) in enumerate(zip(path, speed, charges, strict=True)):
        try:
            multipliers[frame] = system.accelerations(q, v, mu if charged else None, t[frame]).multipliers
        except ValueError:
            if not stats["rank_drops"]:
                raise
        errors = {f.name: max(errors[f.name], f.error) for f in system.derived}
    stats["derivatives"] = {f.name: {"how": f.how, "error": errors[f.name]} for f in system.derived}
    states = list(zip(path, speed, strict=True))
    energy = np.array([system.energy(q, v) for q, v in states])
    off = [np.abs(system.residual(q, v, time)).max(initial=0.0) for time, (q, v) in zip(t, states, strict=True)]
    work, reaction = works.T if works.size else (None, None)
    bodies = system.bodies if isinstance(system.bodies, Bodies) else None
    given = (charges if charged else None, stats, work, reaction, system.names, system.owners, bodies)
    return Trajectory(t, path, speed, multipliers, energy, np.array(off), *given)
