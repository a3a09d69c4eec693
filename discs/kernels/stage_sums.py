"""Sums over the stages of a step of collocation, of which there are four at most, each in one pass over the discs in lanes."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import protocol as do
from discs.kernels.compiled import part
from discs.kernels.vectors import LANES, load, pair, store


class Stages(NamedTuple):
    """The workspace `discs.integrators.collocation.Stages`, with an x for each real eigenvalue and a z for each pair."""

    c: NDArray
    common: NDArray
    x: NDArray
    z: NDArray
    change: NDArray
    stiff: Any
    single: Any
    double: Any


@part(_nrt=True)
def workspace(chain, rule, rows, columns):
    """The workspace for the stages of a method with this tableau."""
    reals, pairs, n = rule.real.size, rule.pairs.size, chain.weights.shape[1]
    c, common, x = np.empty((rule.b.size, rows, n)), np.empty((rows, n)), np.zeros((max(reals, 1), columns, n))
    z, change, stiff = np.zeros((max(pairs, 1), columns, n), np.complex128), np.empty(n), do.factors(chain, 1.0, 1)
    return Stages(c, common, x, z, change, stiff, do.factors(chain, 1.0, reals), do.factors(chain, 1.0j, pairs))


@part
def four(weights, h):
    """h times up to four weights, and zeros."""
    n = weights.size
    return h * weights[0], h * weights[1] if n > 1 else 0.0, h * weights[2] if n > 2 else 0.0, h * weights[3] if n > 3 else 0.0


@part
def rows(parts, row):
    """A row of up to four parts, the last of them repeated."""
    last = parts.shape[0] - 1
    return parts[0, row], parts[min(1, last), row], parts[min(2, last), row], parts[min(3, last), row]


@part
def mixed(w, x, i):
    """The entries from i on of sum_j w_j x_j."""
    return w[0] * load(x[0], i) + w[1] * load(x[1], i) + w[2] * load(x[2], i) + w[3] * load(x[3], i)


@part
def mix(weights, h, parts, row, to, start):
    """h sum_j weights[j] parts[j, row] in `to` from `start` on."""
    w, x = four(weights, h), rows(parts, row)
    for i in range(0, parts.shape[2], LANES):
        store(to, start + i, mixed(w, x, i))


@part
def through(a, weights, h, j):
    """-h sum_k weights[k] a[k, j], or 0."""
    total = 0.0 * weights[0]
    if j < weights.size:
        for k in range(weights.size):
            total -= h * weights[k] * a[k, j]
    return total


@part
def composed(a, weights, h):
    """`through` for up to four stages."""
    return through(a, weights, h, 0), through(a, weights, h, 1), through(a, weights, h, 2), through(a, weights, h, 3)


@part
def behind(w, start, x, i):
    """The entries from i on of sum_j w_j (start - x_j)."""
    pi = load(start, i)
    first = w[0] * (pi - load(x[0], i)) + w[1] * (pi - load(x[1], i))
    return first + (w[2] * (pi - load(x[2], i)) + w[3] * (pi - load(x[3], i)))


@part
def residual(a, weights, h, start, p, force, row, to):
    """to = sum_k weights[k] (start - p_k - h sum_j a_kj force_j), for a row of the momenta."""
    w, x, u, f = four(weights, 1.0), rows(p, row), composed(a, weights, h), rows(force, row)
    for i in range(0, to.size, LANES):
        store(to, i, mixed(u, f, i) + behind(w, start, x, i))


@part
def residuals(a, weights, h, start, p, force, row, to):
    """As `residual`, for complex weights."""
    real, imag, x, f = four(weights.real, 1.0), four(weights.imag, 1.0), rows(p, row), rows(force, row)
    u, v = composed(a, weights.real, h), composed(a, weights.imag, h)
    for i in range(0, to.size, LANES):
        store(to, i, pair(mixed(u, f, i) + behind(real, start, x, i), mixed(v, f, i) + behind(imag, start, x, i)))
