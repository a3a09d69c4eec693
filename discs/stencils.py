"""Finite differences along a chain, as sparse matrices that act on links.

A link is the difference of neighbouring discs, d_i = r_{i+1} - r_i; on a ring the last one closes it. Everything
the springs and the headings need is a combination of links, and forming them first keeps rounding small: second and
fourth differences of positions of order 1 would lose k**2 and k**4 of their digits, differences of links do not.

Kinds of ends: "springs" (plain), "paper" (the same springs; the end discs weigh more, see `shares`), "consistent"
(a ghost disc beyond each end), "ring" (none).
"""

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import NDArray

ENDS = ("springs", "consistent", "paper", "ring")


def spacing(n: int, length: float, ends: str) -> float:
    """Distance k of neighbouring discs: length/(n-1), or length/n on a ring."""
    return length / (n if ends == "ring" else n - 1)


def shares(n: int, k: float, ends: str) -> NDArray:
    """Length that each disc stands for, (n,): k, and k/2 at free ends.

    The paper gives its end discs the full k: the rod is then k longer than it should be, an error of first order.
    """
    w = np.full(n, k)
    if ends in ("springs", "consistent"):
        w[[0, -1]] = k / 2
    return w


def links(values: NDArray, ends: str) -> NDArray:
    """Differences of neighbours along the last axis, (..., n) -> (..., n_links)."""
    inner = values[..., 1:] - values[..., :-1]
    if ends != "ring":
        return inner
    return np.concatenate([inner, values[..., :1] - values[..., -1:]], axis=-1)


def pull(tension: NDArray, ends: str) -> NDArray:
    """The transpose of `links`, (..., n_links) -> (..., n): minus the force that link tensions exert on the discs."""
    if ends == "ring":
        return np.roll(tension, 1, axis=-1) - tension
    force = np.empty((*tension.shape[:-1], tension.shape[-1] + 1), tension.dtype)
    force[..., 0] = -tension[..., 0]
    force[..., -1] = tension[..., -1]
    np.subtract(tension[..., :-1], tension[..., 1:], out=force[..., 1:-1])
    return force


def link_matrix(n: int, ends: str) -> "scipy.sparse.csr_array":
    """`links` as a matrix, (n_links, n)."""
    if ends == "ring":
        return scipy.sparse.diags_array([-1.0, 1.0, 1.0], offsets=[0, 1, 1 - n], shape=(n, n), format="csr")
    return scipy.sparse.diags_array([-1.0, 1.0], offsets=[0, 1], shape=(n - 1, n), format="csr")


def slope_matrix(n: int, k: float, ends: str) -> "scipy.sparse.csr_array":
    """Headings r' at the discs from the links, (n, n_links).

    Inside r'_i = (r_{i+1} - r_{i-1})/2k. At an end
    "springs", "paper": (-3 r_0 + 4 r_1 - r_2)/2k;
    "consistent": central with the ghost r_{-1} = 4 r_0 - 6 r_1 + 4 r_2 - r_3, hence (-4 r_0 + 7 r_1 - 4 r_2 + r_3)/2k,
    whose truncation error k**2 r'''/6 is the inner one.
    """
    if ends == "ring":
        mean = scipy.sparse.diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, n - 1], shape=(n, n))
        return scipy.sparse.csr_array(mean / (2 * k))
    mean = scipy.sparse.diags_array([1.0, 1.0], offsets=[-1, 0], shape=(n, n - 1))
    more = [3.0, -3.0, 1.0] if ends == "consistent" else [2.0, -1.0]  # at an end, beside the one that is there
    m = len(more)
    places = np.array([[0] * m + [n - 1] * m, [*range(m), *range(n - 2, n - 2 - m, -1)]], np.int32)
    return scipy.sparse.csr_array((mean + scipy.sparse.coo_array((more + more, tuple(places)), shape=(n, n - 1))) / (2 * k))


def bend_matrix(n: int, k: float, ends: str) -> "scipy.sparse.csr_array":
    """Curvature vectors r'' at the bends from the links, (n_bends, n_links); a bend is a disc that has a bending spring.

    Inside r''_i = (r_{i+1} - 2 r_i + r_{i-1})/k**2. With "consistent" ends the end discs are bends too, with the same
    ghost as the heading: r''_0 = (2 r_0 - 5 r_1 + 4 r_2 - r_3)/k**2.
    """
    if ends == "ring":
        jump = scipy.sparse.diags_array([-1.0, 1.0, -1.0], offsets=[-1, 0, n - 1], shape=(n, n))
        return scipy.sparse.csr_array(jump / k**2)
    jump = scipy.sparse.diags_array([-1.0, 1.0], offsets=[0, 1], shape=(n - 2, n - 1))
    if ends == "consistent":
        first = scipy.sparse.coo_array(([-2.0, 3.0, -1.0], ([0, 0, 0], [0, 1, 2])), shape=(1, n - 1))
        last = scipy.sparse.coo_array(([2.0, -3.0, 1.0], ([0, 0, 0], [n - 2, n - 3, n - 4])), shape=(1, n - 1))
        jump = scipy.sparse.vstack([first, jump, last])
    return scipy.sparse.csr_array(jump / k**2)


def bend_shares(n: int, k: float, ends: str) -> NDArray:
    """Length that each bend stands for, (n_bends,): k, and k/2 for the end bends of "consistent"."""
    w = np.full(n if ends in ("ring", "consistent") else n - 2, k)
    if ends == "consistent":
        w[[0, -1]] = k / 2
    return w
