"""Warnings about a motion: energy that is not balanced, constraints that are violated."""

import numpy as np

from discs.mechanics.equations import Equations
from discs.mechanics.sizes import residual_size
from discs.mechanics.trajectory import Trajectory
from discs.warn import warn

DRIFT_WARNING = 0.01  # relative to the largest kinetic energy, or to a constraint's size


def _conserving(system: Equations, path: Trajectory) -> bool:
    """Whether the forces conserve the energy, as those of L do: v.f + d(v.Mv/2 + V)(v) = 0 with v held fixed, at all frames.

    A `force` that a user gave instead of that of L may damp or drive.
    """
    for q, v in zip(path.q, path.v, strict=True):
        step = 1e-5 * np.abs(path.q).max() / max(float(np.abs(v).max()), 1e-300)
        rise = (system.energy(q + step * v, v) - system.energy(q - step * v, v)) / (2 * step)
        power = float(v @ system.force(q, v))
        rounding = 1e-11 * np.abs(path.energy).max() / step
        if abs(power + rise) > 1e-3 * (abs(power) + abs(rise)) + rounding:
            return False
    return True


def watch(system: Equations, path: Trajectory) -> None:
    """Warn if the balance of the energy is violated (if nothing does work, the energy has changed), or a constraint is."""
    method, cure = path.stats["method"], f"the motion may not be trusted; take a smaller rtol than {path.stats['rtol']:g}"
    kinetic = np.array([0.5 * v @ (system.mass(q) @ v) for q, v in zip(path.q, path.v, strict=True)])
    done = np.zeros(len(path.t)) if path.work is None or path.reaction_work is None else path.work + path.reaction_work
    off = np.abs(path.energy - path.energy[0] - done)
    rounding = 1e-12 * max(np.abs(path.energy - kinetic).max(), np.abs(done).max())
    f = int(np.argmax(off))
    if off[f] > DRIFT_WARNING * kinetic.max() + rounding and _conserving(system, path):
        rule = "energy is conserved" if path.work is None else "energy - energy[0] is the work of forces and drives"
        due = path.energy[0] + done[f]
        warn(f"{method}: {rule}, but at t = {path.t[f]:g} energy is {path.energy[f]:.3g} and not {due:.3g}: {cure}")
    for t, q, v in zip(path.t, path.q, path.v, strict=True):
        left = np.abs(system.residual(q, v, t)) > DRIFT_WARNING * residual_size(system, q, v, t)
        if left.any():
            owner = system.owners[int(np.argmax(left))]
            warn(f"{method}: at t = {t:g} the velocity violates the constraint of {owner} by over 1 %: {cure}")
            return
