"""A Gauss step of a rod on n functions in compiled form; the plain twin is `continuum.collocation`."""

import numpy as np

from continuum.kernels.spectral import basis, blank, force, forward, part, settle
from discs.kernels.compiled import kernel
from discs.kernels.shared import add
from discs.skew import Phase


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
def correct(modes, h, pairs, into, out, rest, parts, modal, change):
    """change = the solution for `rest` (s, n) along the eigenvectors of the tableau and their conjugates, with frozen modes."""
    s, n = rest.shape
    for j in range(pairs.size):
        for k in range(n):
            x = 0j
            for i in range(s):
                x += into[j, i] * rest[i, k]
            parts[2 * j, k], parts[2 * j + 1, k] = x.real, x.imag
    np.dot(parts, modes.vectors, modal)
    for j in range(pairs.size):
        g = h * h * pairs[j] * pairs[j]
        for k in range(n):
            y = complex(modal[2 * j, k], modal[2 * j + 1, k]) / (1 + g * modes.values[k])
            modal[2 * j, k], modal[2 * j + 1, k] = y.real, y.imag
    np.dot(modal, modes.back, parts)
    for i in range(s):
        for k in range(n):
            change[i, k] = 0.0
            for j in range(pairs.size):
                change[i, k] += out[j, i].real * parts[2 * j, k] - out[j, i].imag * parts[2 * j + 1, k]


@part
def within(moves, h, scale):
    """Whether h moves (s, 3, n) are nowhere larger than `scale` (3,)."""
    for i in range(moves.shape[0]):
        for row in range(3):
            for k in range(moves.shape[2]):
                if not abs(h * moves[i, row, k]) <= scale[row]:
                    return False
    return True


@part
def dot(a, b):
    """Sum of the products of two arrays (s, 3, n)."""
    total = 0.0
    for i in range(a.shape[0]):
        for row in range(3):
            x, y = a[i, row], b[i, row]
            for k in range(x.size):
                total += x[k] * y[k]
    return total


@part
def combine(x, factors, out):
    """out += sum_j factors[j] x[j]; x (3, s, rows, n), out (s, rows, n)."""
    for j in range(3):
        for i in range(out.shape[0]):
            for row in range(out.shape[1]):
                to, y = out[i, row], x[j, i, row]
                for k in range(to.size):
                    to[k] += factors[j] * y[k]


@part
def remember(count, x, history):
    """Put x (s, rows, n) into history (3, s, rows, n), in place of the oldest."""
    to = history[count % 3]
    for i in range(x.shape[0]):
        for row in range(x.shape[1]):
            for k in range(x.shape[2]):
                to[i, row, k] = x[i, row, k]


@part
def mixing(count, residuals, factors):
    """Anderson's mixing of depth 2: factors (3,) of sum one with which the last residuals (3, s, 3, n) add up to the least."""
    for j in range(3):
        factors[j] = 0.0
    now, before, first = count % 3, (count - 1) % 3, (count - 2) % 3
    factors[now] = 1.0
    if count == 0:
        return
    f = residuals[now]
    ff, fg, gg = dot(f, f), dot(f, residuals[before]), dot(residuals[before], residuals[before])
    a, u = ff - 2 * fg + gg, ff - fg  # with d = f - g: d.d and d.f
    x, y = (u / a if a > 0 else 0.0), 0.0
    if count > 1:
        fh, gh, hh = dot(f, residuals[first]), dot(residuals[before], residuals[first]), dot(residuals[first], residuals[first])
        b, c, w = ff - 2 * fh + hh, ff - fg - fh + gh, ff - fh
        determinant = a * b - c * c
        if determinant > 1e-12 * a * b:
            x, y = (u * b - w * c) / determinant, (a * w - c * u) / determinant
    factors[now], factors[before] = 1.0 - x - y, x
    if count > 1:
        factors[first] = y


@kernel
def step(rod, hi, lo, pi, modes, tableau, h, sweeps, tolerance, v, momentum):
    """A step from hi + lo (3, n) and pi (n,), in place if it converges; the plain twin is `continuum.collocation.step`.

    modes : `continuum.galerkin.Modes`, of a configuration not far away.
    tableau : of `discs.integrators.collocation`, with an even number of stages s.
    v, momentum : (s, 3, n) and (s, n), the rates and momenta of the stages, on return.

    Returns the number of sweeps, 0 if they did not converge.
    """
    a, b, last, pairs = tableau.a, tableau.b, tableau.last, tableau.pairs
    s, n = b.size, pi.size
    stages, work = blank(rod, s)
    base, v1, weights, scale = np.empty((1, 3, n)), np.empty((1, 3, n)), b.reshape(1, s), tolerance * rod.scale
    q, moves = np.empty((s, 3, n)), np.empty((s, 3, n))
    p, pull, change, rest = momentum.reshape(s, 1, n), np.empty((s, 1, n)), np.empty((s, n)), np.empty((s, 1, n))
    parts, modal = np.empty((2 * pairs.size, n)), np.empty((2 * pairs.size, n))
    rates, momenta, residuals, factors = np.zeros((3, s, 3, n)), np.zeros((3, s, 1, n)), np.zeros((3, s, 3, n)), np.zeros(3)
    start = pi.reshape(1, 1, n)
    settle(hi, lo, base)
    for i in range(s):
        for k in range(n):
            p[i, 0, k] = pi[k]
            for row in range(3):
                q[i, row, k] = base[0, row, k]
    basis(rod, work, q, stages)
    forward(rod, work, stages, momentum, v)
    for sweep in range(sweeps):
        mixed(base, a, v, h, q)
        basis(rod, work, q, stages)
        for i in range(s):
            for row in range(3):
                for k in range(n):
                    moves[i, row, k] = -v[i, row, k]
        forward(rod, work, stages, momentum, v)
        mixed(base, a, v, h, q)
        force(rod, work, q, stages, pull)
        mixed(start, a, pull, -h, rest)
        for i in range(s):
            for k in range(n):
                rest[i, 0, k] -= p[i, 0, k]
        correct(modes, h, pairs, tableau.pairs_in, tableau.pairs_out, rest.reshape(s, n), parts, modal, change)
        for i in range(s):
            for k in range(n):
                p[i, 0, k] += change[i, k]
        forward(rod, work, stages, momentum, v)
        for i in range(s):
            for row in range(3):
                for k in range(n):
                    moves[i, row, k] += v[i, row, k]
        if within(moves, 0.5 * h, scale):
            mixed(np.zeros((1, 3, n)), weights, v, h, v1)
            state = Phase(hi, lo, start[0])
            add(state, v1[0], 1.0, state)
            for k in range(n):
                before = pi[k]
                for i in range(s):
                    pi[k] += last[i] * (p[i, 0, k] - before)
            return sweep + 1
        remember(sweep, v, rates)
        remember(sweep, p, momenta)
        remember(sweep, moves, residuals)
        mixing(sweep, residuals, factors)
        for i in range(s):
            for k in range(n):
                p[i, 0, k] = 0.0
                v[i, 0, k], v[i, 1, k], v[i, 2, k] = 0.0, 0.0, 0.0
        combine(rates, factors, v)
        combine(momenta, factors, p)
    return 0
