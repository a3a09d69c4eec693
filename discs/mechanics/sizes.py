r"""Sizes of the quantities of a motion, so that tolerances do not depend on units.

The size of a velocity is sqrt(2 T/M_kk) with the largest kinetic energy T so far; of a coordinate, the largest displacement so far;
of a charge mu_a of the vakonomic equations, sqrt(2 T)/|A_a| with the row's norm |A_a| in coordinates of mass 1; of work, 2 T.

At the start T may be zero. A motion from rest is given the speed that the accelerations would reach in a thousandth of the time
span. If they depend on t, the largest at `PROBES` times counts, as a force may begin later.
"""

from collections.abc import Sequence

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float, Matrix
from discs.mechanics.equations import Equations
from discs.mechanics.saddle import dense

TINY = float(np.finfo(float).tiny)
PROBES = 64


def units(system: Equations, q: Float, v: Float | None = None) -> Float:
    """1/sqrt(M_kk), (m,): the speed of each coordinate at kinetic energy 1/2.

    For a coordinate without inertia of its own: the largest speed that the constraints, linearised at v, allow at that energy.
    """
    mass = system.mass(q)
    diagonal = mass.diagonal()
    if (diagonal > 0).all():
        return np.asarray(1 / np.sqrt(diagonal))
    kernel = scipy.linalg.null_space(dense(system.constraint(q) if v is None else system.rows(q, v)))
    reduced = np.linalg.inv(kernel.T @ (mass @ kernel))
    speeds = np.sqrt(np.maximum(np.einsum("kb,bc,kc->k", kernel, reduced, kernel), 0))
    return np.where(diagonal > 0, 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0)), speeds)


def residual_size(system: Equations, q: Float, v: Float, t: float) -> Float:
    """Scale of A v - b, (c,): the sum of |A_ik| times the size of v_k, and |b|."""
    size = units(system, q, v) * _norm(system.mass(q), v)
    found: Float = abs(system.rows(q, v)) @ np.maximum(size, np.abs(v)) + np.abs(system.level(q, t))
    return found


class Sizes:
    """Sizes of q, v, mu and works along a motion.

    Parameters
    ----------
    y : the initial state, (2m + charges + works,); rates : its rates at the start and, if they depend on t, at other times.
    charges : number of charges mu, c or 0.

    Attributes
    ----------
    unit : (m,), see `units`; speed : sqrt(2 T), the largest so far; shift : (m,), the largest displacement so far.
    """

    def __init__(self, system: Equations, y: Float, rates: Sequence[Float], charges: int, span: float) -> None:
        self.system, self.m, self.charges, self.start = system, len(system.names), charges, y[: len(system.names)]
        self.unit = units(system, self.start, y[self.m : 2 * self.m])
        mass = system.mass(self.start)
        speed, *pulls = (_norm(mass, z[self.m : 2 * self.m]) for z in (y, *rates))
        pull = max(pulls)
        time = min(1e-3 * span, speed / pull) if speed and pull else 1e-3 * span  # a time in which the motion changes, or less
        self.speed = max(speed, pull * time)
        self.shift = np.maximum(self.unit * self.speed * time, TINY)

    def update(self, y: Float) -> None:
        q, v = y[: self.m], y[self.m : 2 * self.m]
        self.speed = max(self.speed, _norm(self.system.mass(q), v))
        self.shift = np.maximum(self.shift, np.abs(q - self.start))

    def of(self, y: Float) -> Float:
        """Sizes of the entries of y, (2m + charges + works,)."""
        parts = [self.shift, np.maximum(self.unit * self.speed, TINY)]
        if self.charges:
            rows = dense(self.system.constraint(y[: self.m])) * self.unit
            parts.append(self.speed / np.maximum(np.linalg.norm(rows, axis=1), TINY))
        works = len(y) - 2 * self.m - self.charges
        return np.concatenate([*parts, np.full(works, max(self.speed**2, TINY))])


def _norm(mass: Matrix, v: Float) -> float:
    """sqrt(v.Mv)."""
    return float(np.sqrt(max(float(v @ (mass @ v)), 0.0)))
