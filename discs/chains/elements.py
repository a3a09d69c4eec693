r"""Discs of order four: discs with their own headings as the nodes of quadratic elements.

Three neighbouring discs 0, 1, 2 are an element; the next element begins with disc 2. In it x, y, theta and phi are the parabolas
through the discs. With xi in [-1, 1], s = s_1 + k xi and the links d_0 = q_1 - q_0, d_1 = q_2 - q_1,

    q = q_1 + xi (d_0 + d_1)/2 + xi^2 (d_1 - d_0)/2,    k q' = (1/2 - xi) d_0 + (1/2 + xi) d_1.

Strains are taken at Gauss's two points xi = -+ 1/sqrt(3), each for a share k of the length: as many strain points as links. V is
the sum over strain points of what `discs.chains.steered` sums over links, with the k q' and phi above for differences and mean
headings. The discs have Simpson's shares of the length, k/3, 4k/3, k/3 of an element. Both rules are exact for cubics. Errors of
positions, angles and rates of all discs fall like k^4 (measured, docs/accuracy.md).

From links to k q' at the strain points leads [[1/2 + g, 1/2 - g], [1/2 - g, 1/2 + g]] with g = 1/sqrt(3), a symmetric matrix: the
same one leads from tensions at strain points to those of links. With the mean headings m_0, m_1 of the links, the headings at the
strain points are this matrix times (m_0, m_1), less (d_1 - d_0)/12 of phi: at xi^2 = 1/3, q_1 + (d_1 - d_0)/6 and
q_1 = (m_0 + m_1)/2 - (d_1 - d_0)/4.
"""

from collections.abc import Iterator

import numpy as np

from discs import checks
from discs.arrays import Float, Int

G = 1 / np.sqrt(3.0)
NEAR, FAR = 0.5 + G, 0.5 - G
# of the three discs of an element, at its two strain points: k q' and q
SLOPES = np.array([[-NEAR, 2 * G, FAR], [-FAR, -2 * G, NEAR]])
VALUES = np.array([[1 + 3 * G, 4.0, 1 - 3 * G], [1 - 3 * G, 4.0, 1 + 3 * G]]) / 6


def check(degree: object, n: int, ends: str) -> int:
    """The degree of elements; ValueError if it is not 1 or 2, or if n discs do not make whole elements."""
    given = checks.whole("degree", degree)
    if given not in (1, 2):
        raise ValueError(f"degree must be 1 (two discs to a link) or 2 (three to an element); got {given}")
    if given == 2 and n % 2 == (ends == "ring"):
        odd, why = ("even", "each element of a ring adds two") if ends == "ring" else ("odd", "each element adds two to the first")
        raise ValueError(f"n (discs, ends={ends!r}, degree=2) must be {odd}, as {why}; got {n}: take {n + 1}")
    return given


def refuse(degree: object) -> None:
    """ValueError for elements of discs whose headings follow the line."""
    if checks.whole("degree", degree) != 1:
        raise ValueError(
            f"degree={checks.shown(degree)} needs discs with headings of their own (a SteeredRod, rolling='own'): headings that "
            "follow the line need r' at the discs, where parabolas of neighbouring elements differ in it; leave degree out"
        )


def shares(n: int, k: float, ends: str) -> Float:
    """Share of the length of each disc, (n,), by Simpson's rule."""
    w = np.full(n, 2 * k / 3)
    w[1::2] *= 2
    if ends != "ring":
        w[[0, -1]] = k / 3
    return w


def places(n_links: int, k: float) -> Float:
    """Places of the strain points, (n_links,)."""
    first = 2 * k * np.arange(n_links // 2)[:, None]
    found: Float = (first + k * np.array([1 - G, 1 + G])).ravel()
    return found


def mixed(values: Float) -> Float:
    """From links to strain points, (..., n_links); the same from strain points to links."""
    found = np.empty_like(values)
    a, b = values[..., ::2], values[..., 1::2]
    found[..., ::2] = NEAR * a + FAR * b
    found[..., 1::2] = FAR * a + NEAR * b
    return found


def at_points(d: Float, middle: Float) -> tuple[Float, Float]:
    """Differences (rows, n_links), phi last, and mean headings (n_links,) of links at the strain points: k q' and phi."""
    found = mixed(middle)
    bent = (d[-1, 1::2] - d[-1, ::2]) / 12
    found[::2] -= bent
    found[1::2] -= bent
    return mixed(d), found


def on_links(tension: Float, couple: Float) -> tuple[Float, Float]:
    """The transpose of `at_points`; a couple is half the derivative by a mean heading."""
    found = mixed(tension)
    bent = (couple[::2] + couple[1::2]) / 6
    found[-1, ::2] += bent
    found[-1, 1::2] -= bent
    return found, mixed(couple)


def joined(n: int, ring: bool) -> Iterator[tuple[Int, Float, Float]]:
    """For each of the three discs of an element, at the strain points (n_links,): its index, and its shares in k q' and in q."""
    count = (n - (not ring)) // 2
    first = np.repeat(2 * np.arange(count), 2)
    for i, (slopes, values) in enumerate(zip(SLOPES.T, VALUES.T, strict=True)):
        yield (first + i) % n, np.tile(slopes, count), np.tile(values, count)
