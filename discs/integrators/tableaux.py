"""Coefficients of collocation at Gauss or Radau points."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from discs.arrays import Complex, Float

POWERS = 8  # stages up to which coefficients are computed from powers


class Tableau(NamedTuple):
    """Coefficients of an s-stage collocation method.

    a, inverse : (s, s), and a^{-1}. b, nodes : (s,), weights, and places in [0, 1]. last : (s,), b^T a^{-1}, from the momenta of
    stages to those at the end of the step.

    a is diagonalised. real : its real eigenvalues (none or one). pairs : the complex ones with positive imaginary part, each for a
    pair. real_in, pairs_in : (number, s), rows that project stages on the eigenvectors. real_out, pairs_out : (number, s), the
    eigenvectors; those of pairs are doubled, in place of the conjugate ones.
    """

    a: Float
    inverse: Float
    b: Float
    nodes: Float
    last: Float
    real: Float
    real_in: Float
    real_out: Float
    pairs: Complex
    pairs_in: Complex
    pairs_out: Complex


@cache
def tableau(stages: int) -> Tableau:
    """Gauss: collocation at the zeros of the Legendre polynomial P_s on [0, 1], of order 2 s."""
    nodes, weights = legendre.leggauss(stages)
    return _collocation((nodes + 1) / 2, weights / 2)


@cache
def radau(stages: int) -> Tableau:
    """Radau IIA: collocation at the zeros of P_s - P_{s-1} on [0, 1], of order 2 s - 1. The last stage is the end of the step."""
    nodes = legendre.legroots(np.eye(stages + 1)[-1] - np.eye(stages + 1)[-2])
    c = (np.append(np.sort(nodes.real)[:-1], 1.0) + 1) / 2
    return _collocation(c, None)._replace(last=np.eye(stages)[-1])


def _collocation(c: Float, b: Float | None) -> Tableau:
    """Collocation at c: sum_j a_ij f(c_j) = int_0^c_i f for polynomials f of degree < s. Weights not given are the last stage's.

    f are powers, and Legendre polynomials for many stages: with 12 stages powers give coefficients that are off by 6e-10.
    """
    powers = np.arange(c.size)
    if c.size <= POWERS:
        a = (c[:, None] ** (powers + 1) / (powers + 1)) @ np.linalg.inv(c[:, None] ** powers)
    else:
        x = 2 * c - 1
        integrals = legendre.legval(x, legendre.legint(np.eye(c.size), lbnd=-1)) / 2
        a = integrals.T @ np.linalg.inv(legendre.legvander(x, c.size - 1))
    b = a[-1].copy() if b is None else b
    values, out = np.linalg.eig(a)
    into = np.linalg.inv(out)
    real, upper = np.abs(values.imag) < 1e-12, values.imag > 1e-12
    last = np.linalg.solve(a.T, b).astype(float, copy=False)
    of_real = values[real].real, into[real].real, out.T[real].real
    of_pairs = values[upper].astype(complex), into[upper].astype(complex), 2 * out.T[upper].astype(complex)
    return Tableau(a, np.linalg.inv(a), b, c, last, *(np.ascontiguousarray(x) for x in (*of_real, *of_pairs)))
