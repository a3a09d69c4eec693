r"""The friction coefficient that rolling without sliding needs.

The ground's force lambda on a disc lies in the plane. By Coulomb's law the disc rolls while |lambda| <= mu N with the normal force
N. The model has no gravity, so the user gives N. Discs stay upright by assumption, so no load passes from one to the next.

Inside a rod the coefficient converges as the number n of discs grows. At a free end it does not: in the limit the ground exerts a
point force there, and with slaved headings also a couple (docs/ground-force.md). The end disc's coefficient grows like n**2 (own
headings: like n), so it describes this chain and not the rod. So the two are reported separately: the coefficient inside, and the
force and the couple at the ends.

lambda does no work: its power lambda.r. on the motion of the centre and the power -e.lambda theta. of its torque cancel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.mechanics.ground import LEAST, end_forces, forces, inner
from discs.solution import Solution
from discs.warn import warn


@dataclass(frozen=True, eq=False)
class Friction:
    """What rolling needs of the ground.

    Attributes
    ----------
    discs : (F, n), the friction coefficient of each disc; near free ends it depends on the number of discs.
    inner : (F,), the largest one of discs an eighth of the length away from free ends; NaN if there are none. It converges for
        n -> infinity.
    end_force, end_couple : (F, 2, 2), [frame, end, component], force and couple of the ground at the free ends, from the discs
        there, see `discs.mechanics.ground`; None of rings and of fewer than 35 discs.
    end_force_error, end_couple_error : (F, 2), [frame, end], their estimated errors.
    """

    discs: Float
    inner: Float
    end_force: Float | None = None
    end_couple: Float | None = None
    end_force_error: Float | None = None
    end_couple_error: Float | None = None

    def __str__(self) -> str:
        words = f"friction coefficient inside: {np.max(self.inner):.3g}"
        at_ends = (self.end_force, self.end_force_error), (self.end_couple, self.end_couple_error)
        force, couple = (
            "" if value is None or error is None else f"{np.hypot(*np.moveaxis(value, -1, 0)).max():.3g} ± {error.max():.1g}"
            for value, error in at_ends
        )
        if not force:
            return words
        return (
            f"{words}; at the free ends a force up to {force} and a couple up to {couple} (the end discs need up to "
            f"{self.discs.max():.3g}, which grows with their number)"
        )


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


def friction_needed(run: Solution, weight: ArrayLike) -> Friction:
    """The friction coefficients |lambda|/N that rolling needs, and the ground's force and couple at free ends.

    A warning is given if these are rough, see `discs.mechanics.ground.end_forces`.

    Parameters
    ----------
    run : a run with want=("contact_force",).
    weight : N > 0, the normal force on each disc, mass times length per time squared; a number or one per disc.
        For discs of a rod under gravity g it is g rho w: `g * chain.density * chain.w`.

    Raises
    ------
    ValueError : if the run has no ground forces, or a weight is not positive.
    """
    needed, away = _needed(run, weight), inner(run)
    inside = needed[:, away].max(axis=1) if away.any() else np.full(needed.shape[0], np.nan)
    if away.all() or away.size < LEAST:
        return Friction(needed, inside)
    return Friction(needed, inside, *end_forces(run))


def first_slip(run: Solution, weight: ArrayLike, mu: ArrayLike, ends: bool = False) -> Slip | None:
    """The first disc that would slip on ground of friction coefficient mu, or None.

    Only the frames are examined: record enough of them to resolve the motion.

    Parameters
    ----------
    run, weight : as for `friction_needed`.
    mu : friction coefficient > 0; a number or one per disc.
    ends : examine all discs. Otherwise those near free ends, an eighth of the length, are left out, as they slip the earlier the
        more discs there are.

    Raises
    ------
    ValueError : as `friction_needed`; if mu is not positive; if no disc is away from the ends.
    """
    needed, away = _needed(run, weight), inner(run)
    checks.flag("ends", ends)
    if not ends and not away.any():
        raise ValueError(f"none of {away.size} discs is an eighth of the length away from the free ends; take ends=True")
    excess = needed - checks.field("mu", mu, needed.shape[1], least=0.0, strict=True)
    if not ends:
        excess[:, ~away] = -np.inf
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
    slip = Slip(int(discs[first]), float(times[first]), float(needed[f, discs[first]]))
    if away.any() and not away[slip.disc]:
        warn(
            f"disc {slip.disc} is near a free end, where the coefficient depends on the number of discs and grows without limit: "
            f"this slip is of {away.size} discs, not of a rod; take ends=False, and `friction_needed` for what acts at the ends"
        )
    return slip


def _needed(run: Solution, weight: ArrayLike) -> Float:
    """|lambda|/N of each disc, (F, n)."""
    force = forces(checks.instance("run", run, Solution, 'a run with want=("contact_force",)'))
    pressed = checks.field("weight", weight, run.x.shape[1], least=0.0, strict=True)
    needed: Float = np.hypot(force[:, 0], force[:, 1]) / pressed
    return needed
