"""Compiled: the linearised equations at the stages of a step, and their linear systems; `discs.analysis.linear` has the equations.

With v = N dq + C dpi, S = grad^2 V - f_q and D = -f_v the matrix A of a stage takes (dq, dpi) to (v, -C^T (S dq + D v) - P dq).
Chains fill in C, how it changes with the headings, and grad^2 V; loads add sparse matrices. Linear systems are corrected by the
matrices of the step itself, I + h a C^T D C + (h a)^2 C^T S C for the eigenvalues of a, with C of the stage in the middle.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.integrators.collocation import spread, transform
from discs.kernels import protocol as do
from discs.kernels.compiled import part, stub
from discs.kernels.shared import column, forward
from discs.skew import Phase

SWEEPS = 60


class Sparse(NamedTuple):
    """A sparse matrix of q: entries (E,), and the rows and discs that they take from and add to."""

    data: NDArray
    to_row: NDArray
    to_disc: NDArray
    of_row: NDArray
    of_disc: NDArray


class Given(NamedTuple):
    """What loads add. drag : D. held : -f_q. forces : (M, rows, n), f at q = v = 0 at each stage; M = 1 if constant, 0 for none."""

    drag: Sparse
    held: Sparse
    forces: NDArray


class Stages(NamedTuple):
    """Workspace of the s stages of a step.

    c, v, g : (s, rows, n), C, C pi and grad V - f. arm : (s, 2, n), contact directions of discs of radius 1. turned : (s, headings,
    rows, n), dC/dh, times pi once `linearise` is done. pull : (s, headings, columns, n), dC/dh . g.
    work, flat : workspaces of the chain, at the last stage and at links of zero. still : (rows, n), zeros. along : (n,).
    kept : (s, `kept`, links), what else chains keep of a stage, at their links.
    stiff, single, double : matrices as in `discs.integrators.collocation.Stages`; x, z : right sides.
    """

    c: NDArray
    v: NDArray
    g: NDArray
    arm: NDArray
    turned: NDArray
    pull: NDArray
    work: Any
    flat: Any
    still: NDArray
    along: NDArray
    kept: NDArray
    stiff: Any
    single: Any
    double: Any
    x: NDArray
    z: NDArray


# What chains fill in; `at` : `Stages`, j : a stage


@stub
def headings(chain):
    """How many headings h of a disc C depends on."""


@stub
def kept(chain):
    """How many arrays over its links a chain keeps of a stage."""


@stub
def turns(chain, at, j):
    """c, arm, g = grad V and turned = dC/dh of stage j at the base position of `at.work`."""


@stub
def restore(chain, at, j, w, to):
    """to = (grad^2 V) w, (rows, n)."""


@stub
def turn(chain, at, j, dq, v, g):
    """v += d(C)[dq] pi; g -= d(C)^T[dq] (grad V - f)."""


@stub
def turn_back(chain, at, j, m, nu, to):
    """The transpose: to += what m . d(C)[dq] pi - nu . d(C)^T[dq] (grad V - f) changes by with dq."""


@stub
def weigh(chain, at, j, m, nu, p, sums):
    """sums (4, n) += what m . C p - nu . C^T g changes by with w rho, w alpha, R and w J of each disc."""


@part(_nrt=True)
def stages(rule, chain, rows, columns):
    """The workspace."""
    s, n = rule.b.size, chain.weights.shape[1]
    c, v, g, arm = np.empty((s, rows, n)), np.empty((s, rows, n)), np.empty((s, rows, n)), np.empty((s, 2, n))
    turned, pull = np.empty((s, headings(chain), rows, n)), np.empty((s, headings(chain), columns, n))
    stiff, single = do.factors(chain, 1.0, 1), do.factors(chain, 1.0, rule.real.size)
    double, z = do.factors(chain, 1.0j, rule.pairs.size), np.empty((columns, n), np.complex128)
    work, flat = do.workspace(chain), do.workspace(chain)
    still, along, x, more = np.zeros((rows, n)), np.empty(n), np.empty((columns, n)), np.empty((s, kept(chain), n + 1))
    return Stages(c, v, g, arm, turned, pull, work, flat, still, along, more, stiff, single, double, x, z)


@part
def weigh_roll(c, arm, mass, g, m, nu, p, sums):
    """`weigh` for the column of C by which a disc rolls, (e, 1)/root: with w rho, w alpha and R."""
    cx, cy, ct, ax, ay = c[0], c[1], c[2], arm[0], arm[1]
    for i in range(ct.size):
        x, y, t = m[0, i] * p[i] - nu[i] * g[0, i], m[1, i] * p[i] - nu[i] * g[1, i], m[2, i] * p[i] - nu[i] * g[2, i]
        whole, across = cx[i] * x + cy[i] * y + ct[i] * t, cx[i] * ax[i] + cy[i] * ay[i]
        sums[0, i] -= 0.5 * (cx[i] * cx[i] + cy[i] * cy[i]) * whole
        sums[1, i] -= 0.5 * ct[i] * ct[i] * whole
        sums[2, i] += ct[i] * (ax[i] * x + ay[i] * y - mass[i] * across * whole)


@part
def times(a, x, factor, to):
    """to += factor A x."""
    for e in range(a.data.size):
        to[a.to_row[e], a.to_disc[e]] += factor * a.data[e] * x[a.of_row[e], a.of_disc[e]]


@part
def across(a, x, factor, to):
    """to += factor A^T x."""
    for e in range(a.data.size):
        to[a.of_row[e], a.of_disc[e]] += factor * a.data[e] * x[a.to_row[e], a.to_disc[e]]


@part
def linearise(rule, chain, given, at, q, p, first):
    """The equations at the stages q (s, rows, n), p (s, columns, n) of a step, which are number `first` and so on of the forces."""
    for j in range(rule.b.size):
        c, v, g = at.c[j], at.v[j], at.g[j]
        do.settle(chain, at.work, q[j], at.still)
        turns(chain, at, j)
        forward(c, p[j], v)
        times(given.drag, v, 1.0, g)
        times(given.held, q[j], 1.0, g)
        if given.forces.shape[0] > 0:
            force = given.forces[min(first + j, given.forces.shape[0] - 1)]
            for row in range(g.shape[0]):
                for i in range(g.shape[1]):
                    g[row, i] -= force[row, i]
        for h in range(at.turned.shape[1]):
            at.pull[j, h] = 0.0
            for row in range(g.shape[0]):
                by, to, rate, force = at.turned[j, h, row], at.pull[j, h, column(row)], p[j, column(row)], g[row]
                for i in range(by.size):
                    to[i] += by[i] * force[i]
                    by[i] *= rate[i]


@part
def prepare(rule, chain, at, h, t, q, p):
    """The factors of the matrices, for a step h from the time t."""
    middle = rule.b.size // 2
    state, c, stiff = Phase(q[middle], at.still, p[middle]), at.c[middle], do.pick(chain, at.stiff, 0)
    if middle + 1 < rule.b.size:
        do.settle(chain, at.work, q[middle], at.still)
    do.stiffness(chain, at.work, at.still, c, stiff)
    now = t + h * rule.nodes[middle]
    for j in range(rule.real.size):
        value = h * rule.real[j]
        do.precondition(chain, stiff, state, now, at.still, c, value, value * value, do.pick(chain, at.single, j))
    for j in range(rule.pairs.size):
        pair = h * rule.pairs[j]
        do.precondition(chain, stiff, state, now, at.still, c, pair, pair * pair, do.pick(chain, at.double, j))


@part
def solve(rule, chain, transposed, at, rest, change):
    """change (s, columns, n) = the solution for `rest`, with a or its transpose."""
    x, z = at.x, at.z
    change[:] = 0.0
    for e in range(rule.real.size):
        transform(rule.real_out[e] if transposed else rule.real_in[e], rest, x)
        do.correct(chain, do.pick(chain, at.single, e), x)
        spread(rule.real_in[e] if transposed else rule.real_out[e], x, change)
    for e in range(rule.pairs.size):
        transform(rule.pairs_out[e] if transposed else rule.pairs_in[e], rest, z)
        do.correct(chain, do.pick(chain, at.double, e), z)
        spread(rule.pairs_in[e] if transposed else rule.pairs_out[e], z, change)


@part
def stiffened(chain, given, at, j, w, to):
    """to = S w at stage j."""
    restore(chain, at, j, w, to)
    times(given.held, w, 1.0, to)


@part
def gather(c, m, to):
    """to = C^T m."""
    for row in range(to.shape[0]):
        to[row] = 0.0
    for row in range(c.shape[0]):
        a, b, total = c[row], m[row], to[column(row)]
        for i in range(a.size):
            total[i] += a[i] * b[i]


@part
def shifted(values, factor, to):
    """to += factor values."""
    for row in range(to.shape[0]):
        a, b = values[row], to[row]
        for i in range(b.size):
            b[i] += factor * a[i]


@part(fastmath={"contract", "nnan", "nsz", "reassoc"})
def added(change, to):
    """to += change, (s, rows, n); returns the largest change over the largest entry."""
    moved, size = 0.0, 0.0
    for j in range(to.shape[0]):
        for row in range(to.shape[1]):
            a, b = change[j, row], to[j, row]
            for i in range(a.size):
                b[i] += a[i]
                moved, size = max(moved, abs(a[i])), max(size, abs(b[i]))
    return moved / size if size > 0 else moved


@part(fastmath={"contract", "nnan", "nsz", "reassoc"})
def replaced(new, old):
    """Copy new to old, (s, rows, n); returns the largest change over the largest entry."""
    moved, size = 0.0, 0.0
    for j in range(new.shape[0]):
        for row in range(new.shape[1]):
            a, b = new[j, row], old[j, row]
            for i in range(a.size):
                moved, size = max(moved, abs(a[i] - b[i])), max(size, abs(a[i]))
                b[i] = a[i]
    return moved / size if size > 0 else moved
