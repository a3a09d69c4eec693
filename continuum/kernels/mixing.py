"""Anderson mixing of sweeps, of depth 2; the plain twin is `continuum.collocation.mixing`."""

from typing import NamedTuple

from discs.arrays import Float
from discs.kernels.compiled import part


class History(NamedTuple):
    """The last three sweeps: rates and their changes (3, s rows n), momenta (3, s n)."""

    rates: Float
    changes: Float
    momenta: Float


@part
def dot(a, b):
    """Sum of the products of two arrays (m,)."""
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


@part
def blend(x, count, factors, out):
    """Replace out (m,) by sum_j factors[j] x_j, the newest first, after storing it in x (3, m) in place of the oldest."""
    now, before, first = x[count % 3], x[(count - 1) % 3], x[(count - 2) % 3]
    for i in range(out.size):
        now[i] = out[i]
        out[i] = factors[0] * now[i] + factors[1] * before[i] + factors[2] * first[i]


@part
def mix(history, count, change, v, p):
    """Replace the rates v and momenta p by a mixture of those after the last sweeps. Sweep number `count` changed v by `change`.

    All are (m,). The factors have the sum one and make the sum of the changes the smallest.
    """
    f, g, k = history.changes[count % 3], history.changes[(count - 1) % 3], history.changes[(count - 2) % 3]
    for i in range(f.size):
        f[i] = change[i]
    ff, fg, gg, x, y = dot(f, f), dot(f, g), dot(g, g), 0.0, 0.0
    a, u = ff - 2 * fg + gg, ff - fg  # with d = f - g: d.d and d.f
    if count > 0 and a > 0:
        x = u / a
    if count > 1:
        fk, gk, kk = dot(f, k), dot(g, k), dot(k, k)
        b, c, w = ff - 2 * fk + kk, ff - fg - fk + gk, ff - fk
        determinant = a * b - c * c
        if determinant > 1e-12 * a * b:
            x, y = (u * b - w * c) / determinant, (a * w - c * u) / determinant
    factors = (1.0 - x - y, x, y)
    blend(history.rates, count, factors, v)
    blend(history.momenta, count, factors, p)
