"""Gauss's rule, computed once for each number of points."""

from functools import cache

from numpy.polynomial import legendre

from discs.arrays import Float


@cache
def gauss(points: int) -> tuple[Float, Float]:
    """Places in [-1, 1] and weights, (points,) each, not to be changed: exact for polynomials of degree 2 points - 1."""
    x, w = legendre.leggauss(points)
    x.flags.writeable = w.flags.writeable = False
    return x, w
