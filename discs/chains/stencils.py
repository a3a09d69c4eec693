"""Finite differences along a chain, taken of its links.

A link is the difference of neighbouring discs, d_i = r_{i+1} - r_i; on a ring the last one closes it. Everything
the springs and the headings need is a combination of links, and forming them first keeps rounding small: second and
fourth differences of positions of order 1 would lose k**2 and k**4 of their digits, differences of links do not.

Kinds of ends: "springs" (plain), "paper" (the same springs; the end discs weigh more, see `shares`), "consistent" (end discs bear
a spring too), "ring" (none). Beyond each free end lies a ghost disc, see `extended`.
"""

import numpy as np

from discs.arrays import Float

ENDS = ("springs", "consistent", "paper", "ring")


def spacing(n: int, length: float, ends: str) -> float:
    """Distance k of neighbouring discs: length/(n-1), or length/n on a ring."""
    return length / (n if ends == "ring" else n - 1)


def shares(n: int, k: float, ends: str) -> Float:
    """Length that each disc stands for, (n,): k, and k/2 at free ends.

    The paper gives its end discs the full k: the rod is then k longer than it should be, an error of first order.
    """
    w = np.full(n, k)
    if ends in ("springs", "consistent"):
        w[[0, -1]] = k / 2
    return w


def links(values: Float, ends: str) -> Float:
    """Differences of neighbours along the last axis, (..., n) -> (..., n_links)."""
    inner = values[..., 1:] - values[..., :-1]
    if ends != "ring":
        return inner
    return np.concatenate([inner, values[..., :1] - values[..., -1:]], axis=-1)


def pull(tension: Float, ends: str) -> Float:
    """The transpose of `links`, (..., n_links) -> (..., n): minus the force that link tensions exert on the discs."""
    if ends == "ring":
        return np.roll(tension, 1, axis=-1) - tension
    force = np.empty((*tension.shape[:-1], tension.shape[-1] + 1), tension.dtype)
    force[..., 0] = -tension[..., 0]
    force[..., -1] = tension[..., -1]
    np.subtract(tension[..., :-1], tension[..., 1:], out=force[..., 1:-1])
    return force


def extended(d: Float, ends: str) -> Float:
    """Links with one more at each end, (..., n_links) -> (..., n + 1): the i-th lies before disc i, the next one after it.

    Around a ring the closing link is the first and the last. Beyond a free end lies a ghost disc, at "springs" and "paper" ends
    r_{-1} = 3 r_0 - 3 r_1 + r_2, at "consistent" ones r_{-1} = 4 r_0 - 6 r_1 + 4 r_2 - r_3.
    """
    if ends == "ring":
        return np.concatenate([d[..., -1:], d], axis=-1)
    longer = np.empty((*d.shape[:-1], d.shape[-1] + 2), d.dtype)
    longer[..., 1:-1] = d
    for inner, to in ((d, longer), (d[..., ::-1], longer[..., ::-1])):
        if ends == "consistent":
            to[..., 0] = 3 * (inner[..., 0] - inner[..., 1]) + inner[..., 2]
        else:
            to[..., 0] = 2 * inner[..., 0] - inner[..., 1]
    return longer


def gathered(tension: Float, ends: str) -> Float:
    """The transpose of `extended`, (..., n + 1) -> (..., n_links): what pulls at a ghost link pulls at those it is made of."""
    if ends == "ring":
        own = tension[..., 1:].copy()
        own[..., -1] += tension[..., 0]
        return own
    own = tension[..., 1:-1].copy()
    for inner, ghost in ((own, tension[..., 0]), (own[..., ::-1], tension[..., -1])):
        for i, share in enumerate((3.0, -3.0, 1.0) if ends == "consistent" else (2.0, -1.0)):
            inner[..., i] += share * ghost
    return own


def slopes(d: Float, k: float, ends: str) -> Float:
    """Headings r' at the discs from the links, (..., n_links) -> (..., n).

    Inside, and with the ghosts everywhere, r'_i = (r_{i+1} - r_{i-1})/2k. At an end
    "springs", "paper": (-3 r_0 + 4 r_1 - r_2)/2k;
    "consistent": (-4 r_0 + 7 r_1 - 4 r_2 + r_3)/2k, whose truncation error k**2 r'''/6 is the inner one.
    """
    longer = extended(d, ends)
    return (longer[..., 1:] + longer[..., :-1]) / (2 * k)


def bends(d: Float, ends: str) -> Float:
    """k**2 r'' at the discs from the links, (..., n_links) -> (..., n): k**2 r''_i = r_{i+1} - 2 r_i + r_{i-1}.

    With "consistent" ends that is 2 r_0 - 5 r_1 + 4 r_2 - r_3 at an end; "springs" and "paper" have no spring there.
    """
    return np.diff(extended(d, ends))


def bend_bands(stiffness: Float, ends: str) -> Float:
    """B^T (stiffness) B for B that takes discs to `bends`, (4, n): [j, i] couples discs i and i + j, around a ring n and 0 too.

    stiffness : (n,), zero where there is no spring.
    """
    inner, n = stiffness.copy(), stiffness.size
    bands = np.zeros((4, n))
    if ends == "consistent":
        end = np.array([2.0, -5.0, 4.0, -1.0])
        for j in range(4):
            couple = end[: 4 - j] * end[j:]
            bands[j, : 4 - j] += stiffness[0] * couple
            bands[j, n - 4 : n - j] += stiffness[-1] * couple[::-1]
        inner[[0, -1]] = 0
    after = np.roll(inner, -1)
    bands[0] += np.roll(inner, 1) + 4 * inner + after
    bands[1] -= 2 * (inner + after)
    bands[2] += after
    return bands


def bend_shares(n: int, k: float, ends: str) -> Float:
    """Length that each bend stands for, (n_bends,): k, and k/2 for the end bends of "consistent"."""
    w = np.full(n if ends in ("ring", "consistent") else n - 2, k)
    if ends == "consistent":
        w[[0, -1]] = k / 2
    return w
