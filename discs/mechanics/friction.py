r"""Whether the ground can hold the discs: the friction that a motion without sliding needs.

The ground's force lambda on a disc lies in the plane. By Coulomb's law it holds while |lambda| <= mu N, N the force that presses
the disc down. The model knows no gravity, so N is asked for. Discs stand upright by assumption: no load goes over from one to
the next.

At a free end the coefficient depends on the number n of discs: in the limit the ground carries a point force there, and with slaved
headings a couple too. The end disc's coefficient grows like n**2 (own headings: like n), so it answers for this chain and not for
the rod. Away from free ends it converges; docs/mechanics.md has figures.

lambda does no work: on the actual motion lambda.r. is what -e.lambda theta. takes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.solution import Solution


@dataclass(frozen=True)
class Slip:
    """Where rolling first needs more than the ground gives.

    Attributes
    ----------
    disc : which one.
    time : when |lambda| = mu N, between frames by linear interpolation; the first frame's time if it would not even start.
    needed : the friction coefficient that it would take at the next frame.
    """

    disc: int
    time: float
    needed: float


def friction_needed(run: Solution, weight: ArrayLike) -> Float:
    """The friction coefficient |lambda|/N that each disc needs at each frame, (F, n).

    Near free ends it grows with the number of discs, without a limit (see above): for what a rod needs take discs away from
    the ends.

    Parameters
    ----------
    run : a run with want=("contact_force",).
    weight : N > 0, the force that presses each disc to the ground, mass times length per time squared; a number or one per disc.
        For discs of a rod under gravity g it is g rho w, `g * chain.density * chain.w`.

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

    On chains with free ends it is mostly an end disc, and the more discs a chain has the earlier: see `friction_needed`.
    What happens between two frames is seen only as far as frames show it: take as many as the motion needs.

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
