"""The compiled chain of slaved headings; `discs.chains.slaved` has the derivation and the plain twin.

Arrays of links have one more at each end: link j is before disc j, link j + 1 after it. On a ring links 0 and n are the same. At
free ends they belong to ghost discs, d_0 = 2 d_1 - d_2 ("springs", "paper") or 3 d_1 - 3 d_2 + d_3 ("consistent"), and headings
there are central differences with them.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.chains.chain import Chain
from discs.kernels import protocol as do
from discs.kernels.compiled import fill, part
from discs.kernels.limits import LOST_HEADING
from discs.kernels.load import UNLOADED
from discs.kernels.shared import forward, renew, torques
from discs.kernels.slaved_matrix import GHOST, PLAIN, RING, Matrix, factor, solve


class Slaved(NamedTuple):
    """Parameters. radius : (n,). weights : (3, n), inertia for each row. rolling, links, load : parameters of the laws and
    the load; their types select the laws."""

    radius: NDArray
    weights: NDArray
    scale: NDArray
    shift: NDArray
    k: float
    ends: int
    rolling: Any
    links: Any
    load: Any


def parameters(
    given: Chain, weights: NDArray, scale: NDArray, shift: NDArray, rolling: Any, links: Any, load: Any = UNLOADED
) -> Slaved:
    """The parameters of a chain, from those of its laws and its load."""
    ends = {"ring": RING, "consistent": GHOST}.get(given.ends, PLAIN)
    return Slaved(np.array(given.radius), weights, scale, shift, given.k, ends, rolling, links, load)


class Workspace(NamedTuple):
    """Workspace. base : links of the base position. links, tension : those of a moved position. c : C. step : (3, n), for loads.
    rhs : (1, n)."""

    base: NDArray
    links: NDArray
    tension: NDArray
    c: NDArray
    step: NDArray
    rhs: NDArray
    matrix: Matrix


@fill(do.workspace, Slaved, _nrt=True)
def _workspace(chain):
    n = chain.radius.size
    matrix = Matrix(np.empty(n), np.empty(n), np.empty(n), np.empty(2), np.empty((2, n)), np.empty(9))
    base, links, tension = np.zeros((3, n + 1)), np.zeros((3, n + 1)), np.zeros((3, n + 1))
    return Workspace(base, links, tension, np.empty((3, n)), np.empty((3, n * do.loaded(chain.load))), np.empty((1, n)), matrix)


@fill(do.factors, Slaved, _nrt=True)
def _factors(chain, g, count):
    n, kind = chain.radius.size, np.array([g]).dtype
    a, u, w = np.empty((count, n), kind), np.empty((count, n), kind), np.empty((count, n), kind)
    return Matrix(a, u, w, np.empty((count, 2), kind), np.empty((count, 2, n), kind), np.empty((count, 9), kind))


@fill(do.pick, Slaved)
def _pick(chain, m, j):
    return Matrix(m.a[j], m.u[j], m.w[j], m.corner[j], m.columns[j], m.edge[j])


@part
def close_ends(ends, d):
    """Set the first and the last link from the others."""
    n = d.shape[1] - 1
    for row in range(2):
        if ends == RING:
            d[row, 0] = d[row, n]
        elif ends == GHOST:
            d[row, 0] = 3 * (d[row, 1] - d[row, 2]) + d[row, 3]
            d[row, n] = 3 * (d[row, n - 1] - d[row, n - 2]) + d[row, n - 3]
        else:
            d[row, 0] = 2 * d[row, 1] - d[row, 2]
            d[row, n] = 2 * d[row, n - 1] - d[row, n - 2]
    d[2, 0] = d[2, n]


@fill(do.settle, Slaved)
def _settle(chain, work, hi, lo):
    d = work.base
    n = hi.shape[1]
    for row in range(3):
        x, e, to = hi[row], lo[row], d[row]
        for j in range(1, n):
            to[j] = (x[j] - x[j - 1]) + (e[j] - e[j - 1])
        if chain.ends == RING:
            to[n] = (x[0] - x[n - 1]) + (e[0] - e[n - 1]) + chain.shift[row]
    close_ends(chain.ends, d)


@part
def moved(chain, base, move, d, rows):
    """d = links after a move, in the first `rows` rows."""
    n = move.shape[1]
    for row in range(rows):
        y, b, to = move[row], base[row], d[row]
        for j in range(1, n):
            to[j] = b[j] + (y[j] - y[j - 1])
        if chain.ends == RING:
            to[n] = b[n] + (y[0] - y[n - 1])
    close_ends(chain.ends, d)


@part
def basis_of(chain, d, c):
    """c = C for links d, with r' = (d_i + d_{i+1})/2k."""
    n = c.shape[1]
    dx, dy, cx, cy, ct = d[0], d[1], c[0], c[1], c[2]
    radius, mass, spin = chain.radius, chain.weights[0], chain.weights[2]
    half = 0.5 / chain.k
    for i in range(n):
        x, y, e, square = do.contact(chain.rolling, radius[i], half, dx[i] + dx[i + 1], dy[i] + dy[i + 1])
        t = 1 / np.sqrt(spin[i] + mass[i] * square)
        ct[i], cx[i], cy[i] = t, -y * (e * t), x * (e * t)


@fill(do.basis, Slaved)
def _basis(chain, work, move, c):
    moved(chain, work.base, move, work.links, 2)
    basis_of(chain, work.links, c)


@fill(do.gradient, Slaved)
def _gradient(chain, work, move, g):
    moved(chain, work.base, move, work.links, 3)
    do.tension(chain.links, chain.ends, work.links, work.links, work.tension)
    for row in range(3):
        x, to = work.tension[row], g[row]
        for i in range(to.size):
            to[i] = x[i] - x[i + 1]


@part
def pulled(chain, work, before, state, t, move, c, p, g):
    """g = C^T (mean grad V - f), of a step from the links `before`, with the links after the move in its middle."""
    moved(chain, work.base, move, work.links, 3)
    do.tension(chain.links, chain.ends, before, work.links, work.tension)
    x, y, z = work.tension
    cx, cy, ct, to = c[0], c[1], c[2], g[0]
    for i in range(to.size):
        to[i] = cx[i] * (x[i] - x[i + 1]) + cy[i] * (y[i] - y[i + 1]) + ct[i] * (z[i] - z[i + 1])
    do.push(chain.load, state, t, move, c, p, -1.0, g)


@fill(do.pullback, Slaved)
def _pullback(chain, work, state, t, move, c, p, g):
    pulled(chain, work, work.links, state, t, move, c, p, g)


@fill(do.book_motors, Slaved)
def _book_motors(chain, work, state, t, h, p, move):
    if do.driven(chain.load):
        pulled(chain, work, work.base, state, t, move, work.c, p, work.rhs)
        torques(chain.load, state.pi, h, p, work.rhs)


@fill(do.sweep, Slaved)
def _sweep(chain, work, state, t, h, p, move, first):
    n = p.shape[1]
    c, q, b, m = work.c, p[0], work.rhs[0], work.matrix
    moved(chain, work.base, move, work.links, 2)
    basis_of(chain, work.links, c)
    half = 0.5 * h
    # links after the half step with this C
    for row in range(3):
        f, base, to = c[row], work.base[row], work.links[row]
        for j in range(1, n):
            to[j] = base[j] + half * (f[j] * q[j] - f[j - 1] * q[j - 1])
        if chain.ends == RING:
            to[n] = base[n] + half * (f[0] * q[0] - f[n - 1] * q[n - 1])
    close_ends(chain.ends, work.links)
    do.tension(chain.links, chain.ends, work.base, work.links, work.tension)
    x, y, z = work.tension
    cx, cy, ct = c
    before = state.pi[0]
    for i in range(n):
        pull = cx[i] * (x[i] - x[i + 1]) + cy[i] * (y[i] - y[i + 1]) + ct[i] * (z[i] - z[i + 1])
        b[i] = before[i] - q[i] - half * pull
    do.assemble(chain.links, chain.ends, work.base, work.links, c, 1.0, half * half, m)
    if do.loaded(chain.load):
        forward(c, p, work.step, half)
        do.push(chain.load, state, t + half, work.step, c, p, half, work.rhs)
        do.hold(chain.load, t + half, c, p, half, work.rhs)
    do.guide(chain.load, c, half, half * half, m.a, m.u, m.a, m.u)
    do.stiffen(chain.load, state, t + half, work.step, c, half, half * half, m)
    factor(chain, m)
    solve(chain, m, b)
    for i in range(n):
        q[i] += b[i]
    return renew(c, p, half, move, chain.scale, b)


@fill(do.stiffness, Slaved)
def _stiffness(chain, work, move, c, matrix):
    moved(chain, work.base, move, work.links, 3)
    do.assemble(chain.links, chain.ends, work.links, work.links, c, 0.0, 1.0, matrix)


@fill(do.precondition, Slaved)
def _precondition(chain, stiff, state, t, move, c, d, g, matrix):
    for i in range(stiff.a.size):
        matrix.a[i] = 1 + g * stiff.a[i]
        matrix.u[i] = g * stiff.u[i]
        matrix.w[i] = g * stiff.w[i]
    matrix.corner[0], matrix.corner[1] = g * stiff.corner[0], g * stiff.corner[1]
    do.guide(chain.load, c, d, g, matrix.a, matrix.u, matrix.a, matrix.u)
    do.stiffen(chain.load, state, t, move, c, d, g, matrix)
    factor(chain, matrix)


@fill(do.correct, Slaved)
def _correct(chain, matrix, r):
    solve(chain, matrix, r[0])


@fill(do.potential, Slaved)
def _potential(chain, work):
    return do.elastic(chain.links, work.base)


@fill(do.spend, Slaved)
def _spend(chain, state, t, weight, move, v, scale):
    do.spend(chain.load, state, t, weight, move, v, scale)


@fill(do.vanishing, Slaved)
def _vanishing(chain):
    return do.vanishing(chain.rolling)


@fill(do.lost, Slaved)
def _lost(chain, work, slope):
    d, half, worst, disc = work.base, 0.5 / chain.k, LOST_HEADING**2, -1
    if not do.vanishing(chain.rolling):
        return disc
    for i in range(slope.shape[1]):
        ax, ay = slope[0, i], slope[1, i]
        bx, by = (d[0, i] + d[0, i + 1]) * half, (d[1, i] + d[1, i + 1]) * half
        mx, my = bx - ax, by - ay
        part = min(max(-(ax * mx + ay * my) / max(mx * mx + my * my, 1e-300), 0.0), 1.0)
        nearest = (ax + part * mx) ** 2 + (ay + part * my) ** 2
        if nearest < worst:
            worst, disc = nearest, i
        slope[0, i], slope[1, i] = bx, by
    return disc
