"""Finite differences along a chain, computed from its links.

A link is the difference of neighbouring discs, d_i = r_{i+1} - r_i; on a ring the last link joins the last disc to the first. The
strains of the springs and the headings are combinations of links. Links are computed first to keep rounding small: second and
fourth differences of positions of order 1 have relative errors of rounding over k**2 and k**4, differences of links do not.

Kinds of ends: "springs" (plain), "paper" (the same springs, heavier end discs, see `shares`), "consistent" (bending springs at the
end discs too) and "ring" (no ends). Beyond each free end there is a ghost disc, see `extended`.
"""

from collections.abc import Callable

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float, Matrix

ENDS = ("springs", "consistent", "paper", "ring")


def spacing(n: int, length: float, ends: str) -> float:
    """Distance k of neighbouring discs: length/(n-1), or length/n on a ring."""
    return length / (n if ends == "ring" else n - 1)


def shares(n: int, k: float, ends: str) -> Float:
    """Share of the length of each disc, (n,): k, and k/2 at free ends.

    The paper's end discs have the full k: its rod is longer by k, an error of first order.
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
    """Links with one more at each end, (..., n_links) -> (..., n + 1): link i is before disc i, link i + 1 after it.

    On a ring the closing link is both the first and the last. Beyond a free end there is a ghost disc: r_{-1} = 3 r_0 - 3 r_1 + r_2
    for "springs" and "paper", r_{-1} = 4 r_0 - 6 r_1 + 4 r_2 - r_3 for "consistent".
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
    """The transpose of `extended`, (..., n + 1) -> (..., n_links): the tension of a ghost link acts on the links that define it."""
    if ends == "ring":
        own = tension[..., 1:].copy()
        own[..., -1] += tension[..., 0]
        return own
    own = tension[..., 1:-1].copy()
    for inner, ghost in ((own, tension[..., 0]), (own[..., ::-1], tension[..., -1])):
        for i, share in enumerate((3.0, -3.0, 1.0) if ends == "consistent" else (2.0, -1.0)):
            inner[..., i] += share * ghost
    return own


def slopes(d: Float, k: float | Float, ends: str) -> Float:
    """Headings r' at the discs from the links, (..., n_links) -> (..., n).

    r'_i = (r_{i+1} - r_{i-1})/2k, at the ends with the ghost discs. That is, at an end,
    "springs", "paper": (-3 r_0 + 4 r_1 - r_2)/2k;
    "consistent": (-4 r_0 + 7 r_1 - 4 r_2 + r_3)/2k, with the same truncation error k**2 r'''/6 as inside.
    """
    longer = extended(d, ends)
    return (longer[..., 1:] + longer[..., :-1]) / (2 * k)


def bends(d: Float, ends: str) -> Float:
    """k**2 r'' at the discs from the links, (..., n_links) -> (..., n): k**2 r''_i = r_{i+1} - 2 r_i + r_{i-1}.

    At a "consistent" end that is 2 r_0 - 5 r_1 + 4 r_2 - r_3; "springs" and "paper" have no bending spring there.
    """
    return np.diff(extended(d, ends))


def bend_bands(stiffness: Float, ends: str) -> Float:
    """B^T (stiffness) B for B from positions to `bends`, (4, n): [j, i] couples discs i and i + j (modulo n on a ring).

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
    """Share of the length of each bend, (n_bends,): k, and k/2 for the end bends of "consistent"."""
    w = np.full(n if ends in ("ring", "consistent") else n - 2, k)
    if ends == "consistent":
        w[[0, -1]] = k / 2
    return w


def matrix(stencil: Callable[[Float], Float], n: int, ends: str) -> Matrix:
    """The sparse matrix of a linear stencil, as `links`, that reaches at most four discs: (..., n) -> (..., m), m = n or n - 1.

    Rows inside are alike, so the rows of few discs give those of many.
    """
    few = min(n, 9)
    block = stencil(np.eye(few)).T
    m = block.shape[0] + n - few
    i = np.arange(m)[:, None]
    if few == n:
        like, first = i, 0 * i
    elif ends == "ring":
        like, first = 4 + 0 * i, i - 4
    else:
        near, far = i < 4, i >= m - 4
        like, first = np.where(near, i, np.where(far, i - n + few, 4)), np.where(near, 0, np.where(far, n - few, i - 4))
    columns = (first + np.arange(few)) % n
    found = scipy.sparse.csr_array((block[like[:, 0]].ravel(), columns.ravel(), few * np.arange(m + 1)), shape=(m, n))
    found.eliminate_zeros()
    return found
