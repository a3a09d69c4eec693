"""Gauss collocation of a rod on n functions in compiled form; the plain twin is `discs.integrators.gauss`."""

import numpy as np

from continuum.kernels.spectral import blank, energy, force, forward, frame, part, settle, stiffness
from discs.kernels.compiled import kernel
from discs.kernels.shared import add, copy


@part
def mixed(base, weights, parts, h, out):
    """out[i] = base[0] + h sum_j weights[i, j] parts[j], (s, rows, n)."""
    s, rows, n = out.shape
    for i in range(s):
        for row in range(rows):
            to = out[i, row]
            for k in range(n):
                to[k] = base[0, row, k]
            for j in range(parts.shape[0]):
                x, factor = parts[j, row], h * weights[i, j]
                for k in range(n):
                    to[k] += factor * x[k]


@part
def factor(stiff, g, matrix):
    """matrix = (I + g C^T (grad^2 V) C)^-1, complex."""
    n = len(stiff)
    for i in range(n):
        for k in range(n):
            matrix[i, k] = g * stiff[i, k]
        matrix[i, i] += 1
    found = np.linalg.inv(matrix)
    for i in range(n):  # assigning the whole would take as long to compile as all the rest
        for k in range(n):
            matrix[i, k] = found[i, k]


@part
def correct(inverse, into, out, rest, x, y, change):
    """Add to `change` the solution for `rest` (s, n) along one eigenvector of the tableau and its conjugate."""
    for k in range(x.size):
        x[k] = 0.0
        for i in range(len(rest)):
            x[k] += into[i] * rest[i, k]
    np.dot(inverse, x, y)
    for i in range(len(rest)):
        for k in range(x.size):
            change[i, k] += (out[i] * y[k]).real


@part
def within(moves, h, scale):
    """Whether h moves (s, 3, n) are nowhere larger than `scale` (3,)."""
    for i in range(moves.shape[0]):
        for row in range(3):
            for k in range(moves.shape[2]):
                if not abs(h * moves[i, row, k]) <= scale[row]:
                    return False
    return True


@kernel
def gauss(rod, hi, lo, pi, tableau, h, steps, sweeps, tolerance, bound):
    """Steps from hi + lo (3, n) and pi (1, n), in place; the tableau, `discs.integrators.gauss`, has an even number of stages.

    Returns (taken, sweeps). Stops before a step that does not converge or whose energy is not below `bound`, and after one in which
    |r'| is not above `rod.near`.
    """
    a, b, last, _, _, _, pairs, pairs_in, pairs_out = tableau
    s, n = b.size, pi.shape[1]
    stages, work = blank(rod, s)
    common, single = blank(rod, 1)
    base, middle, v1 = np.empty((1, 3, n)), np.empty((1, 3, n)), np.empty((1, 3, n))
    q, v, moves = np.empty((s, 3, n)), np.empty((s, 3, n)), np.empty((s, 3, n))
    p, pull, change, rest = np.empty((s, n)), np.empty((s, 1, n)), np.empty((s, n)), np.empty((s, 1, n))
    stiff, inverse = np.empty((n, n)), np.empty((pairs.size, n, n), np.complex128)
    x, y = np.empty(n, np.complex128), np.empty(n, np.complex128)
    half, weights, scale = np.full((1, 1), 0.5), b.reshape(1, s), tolerance * rod.scale
    before, total = (np.empty((3, n)), np.empty((3, n)), np.empty((1, n))), 0
    settle(hi, lo, base)
    frame(rod, single, base, common)
    for step in range(steps):
        copy(hi, before[0])
        copy(lo, before[1])
        copy(pi, before[2])
        forward(rod, single, common, pi, v1)
        mixed(base, half, v1, h, middle)
        frame(rod, single, middle, common)
        stiffness(rod, common, stiff)
        for j in range(pairs.size):
            factor(stiff, h * h * pairs[j] ** 2, inverse[j])
        for i in range(s):
            for k in range(n):
                p[i, k] = pi[0, k]
        forward(rod, work, common, p, v)
        sweep, settled = 0, False
        while sweep < sweeps and not settled:
            sweep += 1
            mixed(base, a, v, h, q)
            frame(rod, work, q, stages)
            forward(rod, work, stages, p, v)
            mixed(base, a, v, h, q)
            force(rod, work, q, stages, pull)
            mixed(pi.reshape(1, 1, n), a, pull, -h, rest)
            for i in range(s):
                for k in range(n):
                    rest[i, 0, k] -= p[i, k]
                    change[i, k] = 0.0
            for j in range(pairs.size):
                correct(inverse[j], pairs_in[j], pairs_out[j], rest.reshape(s, n), x, y, change)
            for i in range(s):
                for k in range(n):
                    p[i, k] += change[i, k]
            forward(rod, work, stages, p, v)
            forward(rod, work, common, change, moves)
            settled = within(moves, 0.5 * h, scale)
        total += sweep
        mixed(np.zeros((1, 3, n)), weights, v, h, v1)
        add(hi, lo, v1[0], 1.0)
        for k in range(n):
            start = pi[0, k]
            for i in range(s):
                pi[0, k] += last[i] * (p[i, k] - start)
        settle(hi, lo, base)
        least = frame(rod, single, base, common)
        if (sweep == sweeps and tolerance > 0) or not energy(rod, base[0], pi[0]) <= bound:
            copy(before[0], hi)
            copy(before[1], lo)
            copy(before[2], pi)
            return step, total
        if not least > rod.near:
            return step + 1, total
    return steps, total
