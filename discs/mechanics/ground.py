r"""The ground's force and couple at the free ends of a chain.

For N -> infinity the ground's forces lambda_i of discs with slaved headings tend to a force per length inside, and to a force and a
couple at each free end (docs/ground-force.md). On a chain these are carried by a few discs at the end, in forces that grow with N:

    force = sum_i (lambda_i - w_i lambda(s_i)),   couple = sum_i (s_i - s_end) (lambda_i - w_i lambda(s_i)),

summed over the discs near the end, with the force per length lambda(s) that is found inside continued to the end. With headings of
their own the end disc alone carries the force, and there is no couple.

**Continuation.** Beyond the discs that the end disturbs (six with slaved headings, and more than one in a hundred; one with own
headings) a polynomial of degree 5 in s is fitted to lambda_i/w_i of the next nine discs, or one in 32.

**Elements.** On discs of order four (quadratic elements, Simpson's shares) lambda_i is the integral of lambda times the element
function of disc i. So lambda_i/w_i is off by -k^2 lambda''/5 where elements meet and by k^2 lambda''/10 in their middles, and a sum
that ends within an element by k^3. The sum over whole elements, the last disc by half, is off by k^4, and so is the mean force per
length of an element, (lambda_1/2 + lambda_2 + lambda_3/2)/2k. Sums with `inside` are over whole elements.

**Error.** (a) That of the continuation is the change to another one: half as many discs more are left out, and the degree is 4.
(b) That of the discs: their end is uncertain by about half a spacing. At plain ends, of first order, it moves the force by
(k/2) lambda and the couple by (k/2) force; at other ends, of second order, by (k/2)^2 lambda' and (k/2)^2 lambda. The estimate is
the sum, lambda being that at the end.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from discs import checks
from discs.arrays import Float
from discs.chains.chain import SteeredChain
from discs.solution import Solution
from discs.warn import warn

DISTURBED, FITTED, DEGREE = 6, 9, 5
LEAST = 2 * (DISTURBED + DISTURBED // 2 + FITTED) - 1  # discs of a chain
SHARE = 1 / 8  # of the length, near each free end: where `inner` has no discs
ROUGH = 0.1  # error over value from which on there is a warning
NEGLIGIBLE = 1e-6  # of the couple K/length


class EndForces(NamedTuple):
    """Forces and couples of the ground at the two free ends, (F, 2, 2) each, [frame, end, component].

    force_error, couple_error : (F, 2), [frame, end], their estimated errors, the largest of both components.
    """

    force: Float
    couple: Float
    force_error: Float
    couple_error: Float


def end_forces(run: Solution, inside: Float | None = None) -> EndForces:
    """The ground's force and couple at the free ends of a run of discs, from the discs near them, with estimates of their errors.

    Parameters
    ----------
    run : with want=("contact_force",), of at least 35 discs.
    inside : (F, 2, n), the force per length of the limit at the discs, as of `continuum.solve`, if it is known. The sums are then
        over an eighth of the length at each end, and the errors are those of the discs alone. Otherwise a warning is given if the
        largest estimated error is above a tenth of the largest value: the force inside then rises more steeply towards the end
        than so few discs show.

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
    own, elements = isinstance(chain, SteeredChain), isinstance(chain, SteeredChain) and chain.degree == 2
    few = 1 if own else max(DISTURBED, chain.n // 100)
    s, k = chain.s, chain.k
    near = int((s < SHARE * chain.length).sum())
    near -= elements and near % 2 == 0
    values, errors = np.empty((2, lam.shape[0], 2, 2)), np.empty((2, lam.shape[0], 2))
    for end, order in enumerate((1, -1)):
        found, w = lam[..., ::order], chain.w[::order]
        if inside is None:
            limit, slope = _continued(s, found / w, few, DEGREE)
            other, _ = _continued(s, found / w, few + (few + 1) // 2, DEGREE - 1)
            change = _sums(found, w, s, limit) - _sums(found, w, s, other)
        else:
            known = inside[..., ::order]
            limit, slope = known[..., :near], (known[..., 1] - known[..., 0]) / k
            change = np.zeros_like(values[:, :, end])
        values[:, :, end] = _sums(found, w, s, limit, halved=elements and inside is not None)
        if own or chain.ends == "consistent":
            moved = (k / 2) ** 2 * np.stack([slope, limit[..., 0]])
        else:
            moved = k / 2 * np.stack([limit[..., 0], values[0, :, end]])
        errors[:, :, end] = (np.abs(change) + np.abs(moved)).max(axis=-1)
    values[1, :, 1] *= -1  # there s was the distance from the end
    if inside is None:
        bend = np.max(chain.bending_stiffness) / chain.length  # the couple that bends the rod; far smaller ones are rounding
        no_couple = isinstance(chain, SteeredChain) or chain.curvature != "linear"  # in the limit: what is found of it is error
        _warn_if_rough(values, errors, (NEGLIGIBLE * bend / chain.length, np.inf if no_couple else NEGLIGIBLE * bend), chain.n)
    return EndForces(*values, *errors)


def _continued(s: Float, values: Float, n: int, degree: int) -> tuple[Float, Float]:
    """A polynomial through values (F, 2, N) of the discs after the first n: its values there, (F, 2, n), and slope at s = 0."""
    fit, unit = slice(n, n + max(FITTED, s.size // 32)), s[n]
    c = polynomial.polyfit(s[fit] / unit, values[..., fit].reshape(-1, s[fit].size).T, degree)
    found, slope = polynomial.polyval(s[:n] / unit, c), c[1] / unit
    return found.reshape(*values.shape[:2], n), slope.reshape(values.shape[:2])


def _sums(lam: Float, w: Float, s: Float, limit: Float, halved: bool = False) -> Float:
    """Sums of the first discs' forces less w limit (F, 2, n), and their first moments, (2, F, 2); half of the last if `halved`."""
    n = limit.shape[-1]
    rest = lam[..., :n] - w[:n] * limit
    if halved:
        rest[..., -1] /= 2
    return np.stack([rest.sum(axis=-1), (rest * s[:n]).sum(axis=-1)])


def _warn_if_rough(values: Float, errors: Float, least: tuple[float, float], n: int) -> None:
    rough = [
        f"{name} (up to {np.abs(value).max():.2g}) by about {error.max():.1g}"
        for name, value, error, negligible in zip(("force", "couple"), values, errors, least, strict=True)
        if error.max() > max(ROUGH * np.abs(value).max(), negligible)
    ]
    if rough:
        warn(
            f"at the free ends the ground's {' and '.join(rough)} may be wrong: {n} discs are too few there; "
            "take more discs, with slaved headings ends='consistent', or the field, solve(scene, want='contact_force')"
        )


def inner(run: Solution) -> NDArray[np.bool_]:
    """Which discs are away from free ends by an eighth of the length or more, (n,) of booleans; all of a ring.

    ValueError for a field.
    """
    chain = None if run.problem is None else run.problem.chain
    if chain is None:
        raise ValueError("a run of discs is needed; got a field, whose contact_force is the force per length inside it")
    if chain.ends == "ring":
        return np.ones(chain.n, dtype=bool)
    return inner_places(chain.s, chain.length)


def inner_places(s: Float, length: float) -> NDArray[np.bool_]:
    """Which places s (n,) are away from the ends 0 and length by an eighth of the length or more."""
    away: NDArray[np.bool_] = np.minimum(s, length - s) > (SHARE - 1e-9) * length
    return away


def forces(run: Solution) -> Float:
    """The ground's forces (F, 2, n) of a run; ValueError if it has none."""
    if not isinstance(run, Solution) or run.contact_force is None:
        raise ValueError('ground forces are needed; simulate with want=("contact_force",)')
    return checks.array("contact_force", run.contact_force, "forces (F, 2, n)")
