r"""Compiled: linear systems of the tangent of a step, and of its transpose, by sweeps; `discs.analysis.tangent` has the equations.

With the matrices A_j of the linearised equations at the stages of a step (`discs.analysis.stages`) they are

    Y_i = y_i + h sum_j a_ij A_j Y_j,    and    M_i = h b_i w + h sum_j a_ji A_j^T M_j.

For Y = (dq, dpi) and M = (mu, nu) at a stage, with v = N dq + C dpi, D = -f_v and S = grad^2 V - f_q,

    A Y = (v, -C^T (S dq + D v) - P dq),    A^T M = (N^T m - S^T C nu - P^T nu, C^T m),   m = mu - D^T C nu.

A sweep takes what N and P do from the last one, finds dq or mu, and corrects dpi or nu by I + h a C^T D C + (h a)^2 C^T S C, with
one C for all stages: the matrix of the step itself, decoupled by the eigenvectors of a, in bands, factored once.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels.compiled import kernel, part
from discs.kernels.interrupts import interrupted
from discs.kernels.shared import column

SWEEPS = 60


class Sparse(NamedTuple):
    """A sparse matrix by rows, (m, m), or several with entries at the same places: data (stages or 1, entries)."""

    data: NDArray
    indices: NDArray
    indptr: NDArray


class Stages(NamedTuple):
    """The linearised equations at M stages, the stages of a step next to each other; `discs.analysis.stages` makes them.

    c : (M, rows, n), and flat, the same as (M, rows n).
    turned : (M, headings, rows, n), dC/dh pi. pull : (M, headings, columns, n), dC/dh . g.
    heading : h = heading q of the rows `row`, (headings,).
    stiff, drag : S and D, of q row after row; drag without entries for none.
    """

    c: NDArray
    flat: NDArray
    turned: NDArray
    pull: NDArray
    heading: Sparse
    row: NDArray
    stiff: Sparse
    drag: Sparse


class Bands(NamedTuple):
    """Where entries of S or D are added up in the bands of a symmetric matrix of the momenta.

    entry : of `Sparse`. one, two : of q, which it joins. low : (entries,), the later unknown. apart : how far it is from the other.
    """

    entry: NDArray
    one: NDArray
    two: NDArray
    low: NDArray
    apart: NDArray


class Order(NamedTuple):
    """The order of the momenta in the bands. place : (unknowns,). width : bands beside the diagonal."""

    place: NDArray
    width: int
    stiff: Bands
    drag: Bands


@part
def times(a, k, x, factor, to, anew):
    """to += factor A x; `anew`, to = factor A x."""
    data = a.data[min(k, a.data.shape[0] - 1)]
    for i in range(a.indptr.size - 1):
        total = 0.0
        for j in range(a.indptr[i], a.indptr[i + 1]):
            total += data[j] * x[a.indices[j]]
        to[i] = factor * total if anew else to[i] + factor * total


@part
def across(a, k, x, factor, to):
    """to += factor A^T x."""
    data = a.data[min(k, a.data.shape[0] - 1)]
    for i in range(a.indptr.size - 1):
        value = factor * x[i]
        for j in range(a.indptr[i], a.indptr[i + 1]):
            to[a.indices[j]] += data[j] * value


@part
def assemble(given, bands, k, c, factor, matrix):
    """matrix += factor C^T A C, in bands (unknowns, width + 1)."""
    data = given.data[min(k, given.data.shape[0] - 1)]
    for e in range(bands.entry.size):
        matrix[bands.low[e], bands.apart[e]] += factor * (data[bands.entry[e]] * c[bands.one[e]] * c[bands.two[e]])


@part
def factor(matrix):
    """L D L^T in place: [i, j] of L joins i and i - j; reciprocals of D in [i, 0]."""
    for i in range(matrix.shape[0]):
        for d in range(min(matrix.shape[1] - 1, i), 0, -1):
            j = i - d
            for e in range(1, min(matrix.shape[1] - 1 - d, j) + 1):
                matrix[i, d] -= matrix[i, d + e] * matrix[j, e]
        for d in range(1, min(matrix.shape[1] - 1, i) + 1):
            joined = matrix[i, d]
            matrix[i, d] = joined * matrix[i - d, 0]
            matrix[i, 0] -= matrix[i, d] * joined
        matrix[i, 0] = 1 / matrix[i, 0]


@part
def substitute(matrix, x):
    """Solve with the factors of `factor`, in place."""
    m, width = matrix.shape[0], matrix.shape[1] - 1
    for i in range(m):
        for d in range(1, min(width, i) + 1):
            x[i] -= matrix[i, d] * x[i - d]
    for i in range(m):
        x[i] *= matrix[i, 0]
    for i in range(m - 1, -1, -1):
        for d in range(1, min(width, m - 1 - i) + 1):
            x[i] -= matrix[i + d, d] * x[i + d]


@part
def prepare(rule, lin, order, first, h, single, double):
    """The factors of I + h a C^T D C + (h a)^2 C^T S C for the eigenvalues of a, with C of the stage in the middle."""
    middle = first + rule.b.size // 2
    c = lin.flat[middle]
    for e in range(rule.real.size):
        filled(lin, order, middle, c, h * rule.real[e], single[e])
    for e in range(rule.pairs.size):
        filled(lin, order, middle, c, h * rule.pairs[e], double[e])


@part
def filled(lin, order, k, c, value, matrix):
    matrix[:] = 0.0
    matrix[:, 0] = 1.0
    assemble(lin.stiff, order.stiff, k, c, value * value, matrix)
    assemble(lin.drag, order.drag, k, c, value, matrix)
    factor(matrix)


@part
def correct(rule, transposed, order, single, double, rest, x, z, change):
    """change (s, columns n) = the solution for `rest`, with a or its transpose."""
    s, place = rule.b.size, order.place
    change[:] = 0.0
    for e in range(rule.real.size):
        into, out = (rule.real_out[e], rule.real_in[e]) if transposed else (rule.real_in[e], rule.real_out[e])
        for i in range(x.size):
            total = 0.0
            for j in range(s):
                total += into[j] * rest[j, i]
            x[place[i]] = total
        substitute(single[e], x)
        for j in range(s):
            for i in range(x.size):
                change[j, i] += out[j] * x[place[i]]
    for e in range(rule.pairs.size):
        into, out = (rule.pairs_out[e], rule.pairs_in[e]) if transposed else (rule.pairs_in[e], rule.pairs_out[e])
        for i in range(z.size):
            sum_ = 0.0j
            for j in range(s):
                sum_ += into[j] * rest[j, i]
            z[place[i]] = sum_
        substitute(double[e], z)
        for j in range(s):
            for i in range(z.size):
                change[j, i] += (out[j] * z[place[i]]).real


@part
def mix(a, transposed, i, parts, to, h):
    """to = h sum_j a_ij parts[j], or with a_ji."""
    to[:] = 0.0
    for j in range(parts.shape[0]):
        weight = h * (a[j, i] if transposed else a[i, j])
        for k in range(to.size):
            to[k] += weight * parts[j, k]


@part
def turn_back(lin, k, m, nu, along, to):
    """to += N^T m - P^T nu."""
    rows, n = lin.c.shape[1:]
    for h in range(lin.row.size):
        for i in range(n):
            total = 0.0
            for row in range(rows):
                total += lin.turned[k, h, row, i] * m[row * n + i]
            for col in range(lin.pull.shape[2]):
                total -= lin.pull[k, h, col, i] * nu[col * n + i]
            along[i] = total
        at = lin.row[h] * n
        across(lin.heading, 0, along, 1.0, to[at : at + n])


@part
def turn(lin, k, dq, along, moved, pulled):
    """moved += N dq; pulled -= P dq."""
    rows, n = lin.c.shape[1:]
    for h in range(lin.row.size):
        at = lin.row[h] * n
        times(lin.heading, 0, dq[at : at + n], 1.0, along, True)
        for row in range(rows):
            for i in range(n):
                moved[row * n + i] += lin.turned[k, h, row, i] * along[i]
        for col in range(lin.pull.shape[2]):
            for i in range(n):
                pulled[col * n + i] -= lin.pull[k, h, col, i] * along[i]


@part
def spread(c, p, to):
    """to = C p."""
    n = c.shape[1]
    for row in range(c.shape[0]):
        at = column(row) * n
        for i in range(n):
            to[row * n + i] = c[row, i] * p[at + i]


@part
def spread_more(c, p, to):
    """to += C p."""
    n = c.shape[1]
    for row in range(c.shape[0]):
        at = column(row) * n
        for i in range(n):
            to[row * n + i] += c[row, i] * p[at + i]


@part
def gather(c, q, to):
    """to += C^T q."""
    n = c.shape[1]
    for row in range(c.shape[0]):
        at = column(row) * n
        for i in range(n):
            to[at + i] += c[row, i] * q[row * n + i]


@part(fastmath={"contract", "nnan", "nsz", "reassoc"})
def added(change, to):
    """to += change; returns the largest change over the largest entry."""
    moved, size = 0.0, 0.0
    for row in range(to.shape[0]):
        for i in range(to.shape[1]):
            to[row, i] += change[row, i]
            moved, size = max(moved, abs(change[row, i])), max(size, abs(to[row, i]))
    return moved / size if size > 0 else moved


@part(fastmath={"contract", "nnan", "nsz", "reassoc"})
def replaced(new, old):
    """Copy new to old; returns the largest change over the largest entry."""
    moved, size = 0.0, 0.0
    for row in range(new.shape[0]):
        for i in range(new.shape[1]):
            moved, size = max(moved, abs(new[row, i] - old[row, i])), max(size, abs(new[row, i]))
            old[row, i] = new[row, i]
    return moved / size if size > 0 else moved


@kernel
def back(rule, lin, order, h, tolerance, seeds, at, value, m):
    """Take a derivative `value` (size,) with respect to the state back through steps; m (steps, s, size): multipliers of stages.

    After step k the row at[k] of `seeds`, if that is not negative, is added to the value first. Returns how many steps were taken,
    from the last one on: fewer than all before one whose sweeps do not converge, whose seed is added; -1 after Ctrl-C.
    """
    steps, s = m.shape[:2]
    rows, n = lin.c.shape[1:]
    nq, np_ = rows * n, lin.pull.shape[2] * n
    single = np.empty((rule.real.size, np_, order.width + 1))
    double = np.empty((rule.pairs.size, np_, order.width + 1), np.complex128)
    mu, nu = np.zeros((s, nq)), np.zeros((s, np_))
    x, y, w, dragged = np.empty((s, nq)), np.empty((s, np_)), np.empty((s, nq)), np.zeros((s, nq))
    new, pulled, force, damped = np.empty((s, nq)), np.empty((s, nq)), np.empty(nq), lin.drag.indices.size > 0
    rest, change, along, inner, complex_ = (
        np.empty((s, np_)),
        np.empty((s, np_)),
        np.empty(n),
        np.empty(np_),
        np.empty(np_, np.complex128),
    )
    late, later = np.zeros((s, nq + np_)), np.zeros((s, nq + np_))
    for k in range(steps - 1, -1, -1):
        if interrupted(20 * s * (nq + np_)):
            return -1
        if at[k] >= 0:
            for i in range(value.size):
                value[i] += seeds[at[k], i]
        prepare(rule, lin, order, k * s, h, single, double)
        known = steps - 1 - k
        for i in range(s):  # a first guess: what the stages add to h b w, as in the last steps
            for j in range(value.size):
                ahead = 2 * late[i, j] - later[i, j] if known > 1 else late[i, j]
                guess = h * rule.b[i] * value[j] + ahead
                if j < nq:
                    mu[i, j] = guess
                else:
                    nu[i, j - nq] = guess
        for j in range(s):
            spread(lin.c[k * s + j], nu[j], w[j])
            times(lin.stiff, k * s + j, w[j], 1.0, pulled[j], True)
        sweep, off = 0, np.inf
        while sweep < SWEEPS and off > tolerance:
            for j in range(s):
                if damped:
                    dragged[j] = 0.0
                    across(lin.drag, k * s + j, w[j], -1.0, dragged[j])
                for i in range(nq):
                    force[i] = mu[j, i] + dragged[j, i]
                    x[j, i] = -pulled[j, i]
                turn_back(lin, k * s + j, force, nu[j], along, x[j])
            for i in range(s):
                mix(rule.a, True, i, x, new[i], h)
                for j in range(nq):
                    new[i, j] += h * rule.b[i] * value[j]
            for j in range(s):
                for i in range(nq):
                    force[i] = new[j, i] + dragged[j, i]
                y[j] = 0.0
                gather(lin.c[k * s + j], force, y[j])
            for i in range(s):
                mix(rule.a, True, i, y, rest[i], h)
                for j in range(np_):
                    rest[i, j] += h * rule.b[i] * value[nq + j] - nu[i, j]
            correct(rule, True, order, single, double, rest, inner, complex_, change)
            off = added(change, nu)
            for j in range(s):  # what that does to mu
                spread(lin.c[k * s + j], nu[j], w[j])
                times(lin.stiff, k * s + j, w[j], 1.0, force, True)
                for i in range(nq):
                    x[j, i] += pulled[j, i] - force[i]
                    pulled[j, i] = force[i]
            for i in range(s):
                mix(rule.a, True, i, x, new[i], h)
                for j in range(nq):
                    new[i, j] += h * rule.b[i] * value[j]
            off = max(off, replaced(new, mu))
            sweep += 1
        total = 0.0
        for i in range(s):
            for j in range(np_):
                total += nu[i, j]
        if not (off <= tolerance and np.isfinite(total)):
            return steps - 1 - k
        later[:] = late
        for i in range(s):
            for j in range(value.size):
                m[k, i, j] = mu[i, j] if j < nq else nu[i, j - nq]
                late[i, j] = m[k, i, j] - h * rule.b[i] * value[j]
        for j in range(value.size):
            total = 0.0
            for i in range(s):
                share = 0.0
                for other in range(s):
                    share += rule.inverse[i, other]
                total += share * (m[k, i, j] / h - rule.b[i] * value[j])
            value[j] += total
    return steps


@kernel
def forward(rule, lin, order, h, tolerance, right, y):
    """Solve Y_i - h sum_j a_ij A_j Y_j = right_i, (s, size), for y, which holds a first guess; returns the sweeps, -1 if none."""
    s = rule.b.size
    rows, n = lin.c.shape[1:]
    nq, np_ = rows * n, lin.pull.shape[2] * n
    single = np.empty((rule.real.size, np_, order.width + 1))
    double = np.empty((rule.pairs.size, np_, order.width + 1), np.complex128)
    v, moved, new, q = np.empty((s, nq)), np.empty((s, nq)), np.empty((s, nq)), np.empty((s, nq))
    pulled, rest, change, pi = np.empty((s, np_)), np.empty((s, np_)), np.empty((s, np_)), np.empty((s, np_))
    along, inner, complex_, force = np.empty(n), np.empty(np_), np.empty(np_, np.complex128), np.empty(nq)
    damped = lin.drag.indices.size > 0
    prepare(rule, lin, order, 0, h, single, double)
    sweep, off = 0, np.inf
    for j in range(s):
        q[j], pi[j], moved[j] = y[j, :nq], y[j, nq:], 0.0
        turn(lin, j, q[j], along, moved[j], pulled[j])
    while sweep < SWEEPS and off > tolerance:
        for j in range(s):
            spread(lin.c[j], pi[j], v[j])
            for i in range(nq):
                v[j, i] += moved[j, i]
        for i in range(s):
            mix(rule.a, False, i, v, new[i], h)
            for j in range(nq):
                new[i, j] += right[i, j]
        for j in range(s):
            pulled[j], moved[j] = 0.0, 0.0
            turn(lin, j, new[j], along, moved[j], pulled[j])
            times(lin.stiff, j, new[j], -1.0, force, True)
            if damped:
                for i in range(nq):
                    v[j, i] = moved[j, i]
                spread_more(lin.c[j], pi[j], v[j])
                times(lin.drag, j, v[j], -1.0, force, False)
            gather(lin.c[j], force, pulled[j])
        for i in range(s):
            mix(rule.a, False, i, pulled, rest[i], h)
            for j in range(np_):
                rest[i, j] += right[i, nq + j] - pi[i, j]
        correct(rule, False, order, single, double, rest, inner, complex_, change)
        off = added(change, pi)
        for j in range(s):  # what that does to q
            spread(lin.c[j], change[j], v[j])
            moved[j] = 0.0
        for i in range(s):
            mix(rule.a, False, i, v, force, h)
            for j in range(nq):
                new[i, j] += force[j]
        for j in range(s):
            turn(lin, j, new[j], along, moved[j], pulled[j])
        off = max(off, replaced(new, q))
        sweep += 1
    for j in range(s):
        y[j, :nq], y[j, nq:] = q[j], pi[j]
    return sweep if off <= tolerance and np.isfinite(pi.sum()) else -1
