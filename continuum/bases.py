"""The functions that a field is made of: polynomials between free ends, Fourier series on a closed rod."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from continuum.elements import lobatto

FINER = 1.5  # points a node: products of three polynomials are integrated exactly


class Basis(NamedTuple):
    """n functions of s, for the line by coefficients, for roll and its rate by values at nodes.

    s, w : (n,), nodes and the lengths they stand for.
    bends : (n + 3 F, n), coefficients to z at the nodes, then to z, z', z'' at F finer points (less a closed rod's shift), both of
        the headings: the highest functions are left out by `smooth`.
    rates : (3 F, n), values at the nodes to the field and its two derivatives at the finer points.
    project : (n, F + n), f'' at the finer points and f at the nodes to the coefficients of P f.
    bending : (n,), int |r''|^2 is the sum of this times |coefficient|^2. torsion : (n, n), of int theta'^2.
    fit : (n, n), r at the nodes to its coefficients.
    line, field : places (S,) to matrices (S, n) that take coefficients, or values at the nodes, there.
    """

    s: NDArray
    w: NDArray
    bends: NDArray
    rates: NDArray
    project: NDArray
    bending: NDArray
    torsion: NDArray
    fit: NDArray
    line: Callable[[NDArray], NDArray]
    field: Callable[[NDArray], NDArray]


def smooth(order: NDArray) -> NDArray:
    """Factors that leave the highest functions out of headings, for order/highest in [0, 1]: exp(-36 order^16).

    A line that moves by r. = i R omega r' alone moves like the Cauchy-Riemann equations: a wave of number q grows at the
    rate R omega q. What stops it is bending, through changes of omega. The highest functions of r are beyond its reach, as
    e omega would need still higher ones, and must not turn headings. (A steeper end, as exp(-36 order^36) of Hou and Li, 2007,
    leaves neighbouring functions with unequal factors, and some growth.)
    """
    return np.exp(-36.0 * order**16)


def polynomials(n: int, length: float) -> Basis:
    """Polynomials of degree n - 1 between free ends; coefficients of r are its values at the ends, then those of r'' by Legendre's
    polynomials."""
    half = length / 2
    x, w, _ = lobatto(n - 1)
    fine, wf = legendre.leggauss(int(np.ceil(FINER * n)))
    second = np.eye(n - 2)  # columns are functions, by their Legendre coefficients
    first, zeroth = legendre.legint(second, 1, lbnd=-1), legendre.legint(second, 2, lbnd=-1)
    at_end = zeroth.sum(axis=0)  # every Legendre polynomial is one there
    zeroth[:2] -= at_end / 2  # less the straight line 0 ... at_end
    first[0] -= at_end / 2
    to_legendre = np.linalg.inv(legendre.legvander(x, n - 1))
    derivatives = [to_legendre, legendre.legder(to_legendre) / half, legendre.legder(to_legendre, 2) / half**2]

    def value(points: NDArray, functions: NDArray) -> NDArray:
        return legendre.legvander(points, len(functions) - 1) @ functions

    def line(s: NDArray) -> NDArray:
        x = s / half - 1
        return np.column_stack([(1 - x) / 2, (1 + x) / 2, half**2 * value(x, zeroth)])

    def slope(points: NDArray) -> NDArray:
        ends = np.full(points.size, 1 / length)
        return np.column_stack([-ends, ends, half * value(points, first)])

    none = np.zeros((fine.size, 2))
    curved = np.hstack([none, value(fine, second)]), np.hstack([none, value(fine, legendre.legder(second)) / half])
    norm = 2 / (2 * np.arange(n - 2) + 1)
    project = np.zeros((n, fine.size + n))
    project[0, fine.size] = project[1, -1] = 1
    project[2:, : fine.size] = (legendre.legvander(fine, n - 3) * wf[:, None]).T / norm[:, None]
    twist = value(fine, derivatives[1])
    return Basis(
        s=half * (x + 1),
        w=half * w,
        bends=np.vstack([slope(x), slope(fine), *curved]) * smooth(np.concatenate([[0, 0], np.arange(n - 2) / (n - 3)])),
        rates=np.vstack([value(fine, d) for d in derivatives]),
        project=project,
        bending=np.concatenate([[0, 0], half * norm]),
        torsion=half * (twist.T * wf) @ twist,
        fit=np.vstack([np.eye(n)[[0, -1]], derivatives[2]]),
        line=line,
        field=lambda s: value(s / half - 1, to_legendre),
    )


def waves(n: int, length: float) -> Basis:
    """The first n (odd) of 1, cos, sin, ... on a closed rod; coefficients of r are those of the series."""
    q = 2 * np.pi / length * np.repeat(np.arange(1, n // 2 + 1), 2)
    phase = np.tile([0.0, -np.pi / 2], n // 2)
    s, count = length / n * np.arange(n), int(np.ceil(FINER * n))
    fine = length / count * np.arange(count)

    def value(s: NDArray, m: int = 0) -> NDArray:
        """The m-th derivatives at s, (S, n)."""
        return np.column_stack([np.full(s.size, m == 0), q**m * np.cos(np.outer(s, q) + phase + m * np.pi / 2)])

    fit = np.linalg.inv(value(s))
    square = np.full(n - 1, length / 2)  # int of cos^2
    project = np.zeros((n, count + n))
    project[0, count:] = 1 / n
    project[1:, :count] = -(value(fine)[:, 1:] * (length / count)).T / (q**2 * square)[:, None]
    twist = value(fine, 1) @ fit
    return Basis(
        s=s,
        w=np.full(n, length / n),
        bends=np.vstack([value(s, 1), *(value(fine, m) for m in (1, 2, 3))]) * smooth(np.concatenate([[0], q / q[-1]])),
        rates=np.vstack([value(fine, m) @ fit for m in range(3)]),
        project=project,
        bending=np.concatenate([[0.0], q**4 * square]),
        torsion=length / count * twist.T @ twist,
        fit=fit,
        line=value,
        field=lambda s: value(s) @ fit,
    )
