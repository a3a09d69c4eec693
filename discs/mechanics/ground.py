r"""The ground's force and couple at the free ends of a chain.

For N -> infinity the ground's forces lambda_i of discs with slaved headings tend to a force per length inside, and to a force and a
couple at each free end (docs/ground-force.md). On a chain these are carried by a few discs at the end, in forces that grow with N:

    force = sum_i (lambda_i - w_i lambda(s_i)),   couple = sum_i (s_i - s_end) (lambda_i - w_i lambda(s_i)),

summed over the discs near the end, with the force per length lambda(s) that is found inside continued to the end. Discs with their
own headings have the force alone; their couple tends to zero.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs import checks
from discs.arrays import Float
from discs.solution import Solution

NEAR = 8  # discs at an end
DEGREE = 4  # of the polynomial in s through lambda_i/w_i of the next NEAR + 1 discs, which continues it
LEAST = 4 * NEAR + 3  # discs of a chain
SHARE = 1 / 8  # of the length, near each free end: where `inner` has no discs


class EndForces(NamedTuple):
    """Forces and couples of the ground at the two free ends, (F, 2, 2) each, [frame, end, component]."""

    force: Float
    couple: Float


def end_forces(run: Solution, inside: Float | None = None) -> EndForces:
    """The ground's force and couple at the free ends of a run of discs, from the discs near them.

    Parameters
    ----------
    run : with want=("contact_force",), of at least 35 discs.
    inside : (F, 2, n), the force per length of the limit at the discs, as of `continuum.solve`, if it is known. The sums are then
        over an eighth of the length at each end; otherwise over NEAR discs, with the force inside continued by a polynomial. There
        is no error estimate: compare two numbers of discs. On the paper's rod with consistent ends force and couple are off by
        29 % and 8 % with 129 discs, 9 % and 1.3 % with 257, and 0.02 % and 0.03 % with 1025.

    Raises
    ------
    ValueError : if the run has no ground forces, is of a ring or of a field, or has too few discs.
    """
    lam = forces(run)
    chain = run.problem.chain if run.problem is not None else None
    if chain is None or chain.ends == "ring":
        raise ValueError(
            "end forces are those of discs with free ends; a ring has none, and a field gives its own, as field.end_force"
        )
    if inside is None and chain.n < LEAST:
        raise ValueError(f"end forces of a chain alone need at least {LEAST} discs; got {chain.n}: take more, or give `inside`")
    s, per_length = chain.s, lam / chain.w
    force, couple = np.empty((2, lam.shape[0], 2, 2))
    for end in (0, 1):
        away = s if end == 0 else chain.length - s[::-1]
        found, w = (lam, chain.w) if end == 0 else (lam[..., ::-1], chain.w[::-1])
        if inside is None:
            near = slice(NEAR)
            fit, unit = slice(NEAR, 2 * NEAR + 1), away[NEAR]
            values = (per_length if end == 0 else per_length[..., ::-1])[..., fit]
            c = np.polynomial.polynomial.polyfit(away[fit] / unit, values.reshape(-1, NEAR + 1).T, DEGREE)
            limit = np.polynomial.polynomial.polyval(away[near] / unit, c).reshape(*lam.shape[:2], NEAR)
        else:
            near = slice(int((away < SHARE * chain.length).sum()))
            limit = (inside if end == 0 else inside[..., ::-1])[..., near]
        rest = found[..., near] - w[near] * limit
        force[:, end] = rest.sum(axis=-1)
        couple[:, end] = (1 if end == 0 else -1) * (rest * away[near]).sum(axis=-1)
    return EndForces(force, couple)


def inner(run: Solution) -> NDArray[np.bool_]:
    """Which discs are away from free ends by an eighth of the length or more, (n,) of booleans; all of a ring."""
    chain = None if run.problem is None else run.problem.chain
    if chain is None:
        raise ValueError("a run of discs is needed; got a field, whose contact_force is the force per length inside it")
    if chain.ends == "ring":
        return np.ones(chain.n, dtype=bool)
    away: NDArray[np.bool_] = np.minimum(chain.s, chain.length - chain.s) > (SHARE - 1e-9) * chain.length
    return away


def forces(run: Solution) -> Float:
    """The ground's forces (F, 2, n) of a run; ValueError if it has none."""
    if not isinstance(run, Solution) or run.contact_force is None:
        raise ValueError('ground forces are needed; simulate with want=("contact_force",)')
    return checks.array("contact_force", run.contact_force, "forces (F, 2, n)")
