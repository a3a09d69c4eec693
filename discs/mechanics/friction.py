r"""The friction coefficient that rolling without sliding needs.

The ground's force lambda on a disc lies in the plane. By Coulomb's law the disc rolls while |lambda| <= mu N with the normal force
N. The model has no gravity, so the user gives N. Discs stay upright by assumption, so no load passes from one to the next.

At a free end the coefficient depends on the number n of discs: in the limit the ground exerts a point force there, and with slaved
headings also a couple. The end disc's coefficient grows like n**2 (own headings: like n), so it describes this chain and not the
rod. Away from free ends it converges; docs/mechanics.md has figures.

lambda does no work: its power lambda.r. on the motion of the centre and the power -e.lambda theta. of its torque cancel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.solution import Solution


@dataclass(frozen=True)
class Slip:
    """The first disc that needs more friction than the ground has.

    Attributes
    ----------
    disc : its index.
    time : when |lambda| = mu N, by linear interpolation between frames; that of the first frame if the disc slips at once.
    needed : the friction coefficient needed at the next frame.
    """

    disc: int
    time: float
    needed: float


def friction_needed(run: Solution, weight: ArrayLike) -> Float:
    """The friction coefficient |lambda|/N that each disc needs at each frame, (F, n).

    Near free ends it grows with the number of discs without limit (see above): for the rod, use discs away from the ends.

    Parameters
    ----------
    run : a run with want=("contact_force",).
    weight : N > 0, the normal force on each disc, mass times length per time squared; a number or one per disc.
        For discs of a rod under gravity g it is g rho w: `g * chain.density * chain.w`.

    Raises
    ------
    ValueError : if the run has no ground forces, or a weight is not positive.
    """
    if run.contact_force is None:
        raise ValueError('ground forces are needed; simulate with want=("contact_force",)')
    pressed = checks.field("weight", weight, run.x.shape[1], least=0.0, strict=True)
    needed: Float = np.hypot(run.contact_force[:, 0], run.contact_force[:, 1]) / pressed
    return needed


def first_slip(run: Solution, weight: ArrayLike, mu: ArrayLike) -> Slip | None:
    """The first disc that would slip on ground of friction coefficient mu, or None.

    On chains with free ends it is mostly an end disc, and it slips earlier if the chain has more discs: see `friction_needed`.
    Only the frames are examined: record enough of them to resolve the motion.

    Parameters
    ----------
    run, weight : as for `friction_needed`.
    mu : friction coefficient > 0; a number or one per disc.

    Raises
    ------
    ValueError : as `friction_needed`, or if mu is not positive.
    """
    needed = friction_needed(run, weight)
    excess = needed - checks.field("mu", mu, needed.shape[1], least=0.0, strict=True)
    slipping = np.flatnonzero((excess > 0).any(axis=1))
    if not slipping.size:
        return None
    f = int(slipping[0])
    discs = np.flatnonzero(excess[f] > 0)
    times = np.full(discs.size, run.t[0])
    if f:
        before, after = excess[f - 1, discs], excess[f, discs]
        times = run.t[f - 1] + (run.t[f] - run.t[f - 1]) * before / (before - after)
    first = int(np.argmin(times))
    return Slip(int(discs[first]), float(times[first]), float(needed[f, discs[first]]))
