"""The links between discs with their own headings: geometry, strains and tensions; see `discs.chains.steered`.

`work` is the workspace of `discs.kernels.steered`. Cosines at the end of a step are computed from those at its start and those of
the change: two pairs for each disc and sweep.
"""

import math

from discs.kernels.compiled import part
from discs.kernels.steered_joints import close, to_links, to_points

TILE = 128

S1, S2, S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
S4, S5, S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
C1, C2, C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
C4, C5, C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11
QUARTER = 1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21


@part(inline="always")
def whole(x):
    """The whole number nearest to x, |x| < 2^51. (`floor` and branches on it would prevent vectorised loops.)"""
    return (x + 6755399441055744.0) - 6755399441055744.0


@part(inline="always")
def turn(x):
    """cos x and sin x to a unit in the last place for |x| < 1e6, without branches and calls, so that loops are vectorised.

    Reduction by quarter turns in three parts and the minimax polynomials of fdlibm (Sun Microsystems, 1993).
    """
    quarters = whole(x * (2 / math.pi))
    r = ((x - quarters * QUARTER[0]) - quarters * QUARTER[1]) - quarters * QUARTER[2]
    z = r * r
    sin = r + r * z * (S1 + z * (S2 + z * (S3 + z * (S4 + z * (S5 + z * S6)))))
    half = 0.5 * z
    rest = 1.0 - half
    cos = rest + (((1.0 - rest) - half) + z * z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * (C5 + z * C6))))))
    # one quarter turn maps (cos, sin) to (-sin, cos), one back to (sin, -cos), two change both signs
    halves = whole(0.5 * quarters)
    odd = quarters - 2.0 * halves
    sign = 1.0 - 2.0 * abs(halves - 2.0 * whole(0.5 * halves))
    even, odd = sign * (1.0 - abs(odd)), sign * odd
    return even * cos - odd * sin, even * sin + odd * cos


@part
def strains(chain, d, cos, sin, strain):
    """strain = stretch, shear, torsion and bending of links with differences d and mean headings of this cosine and sine."""
    per = 1 / chain.k
    dx, dy, dt, dp = d[0], d[1], d[2], d[3]
    stretch, shear, torsion, bend = strain[0], strain[1], strain[2], strain[3]
    for j in range(dx.size):
        stretch[j] = (cos[j] * dx[j] + sin[j] * dy[j]) * per - 1
        shear[j] = (cos[j] * dy[j] - sin[j] * dx[j]) * per
        torsion[j] = dt[j] * per
        bend[j] = dp[j] * per


@part
def spread(chain, work, y, a, b):
    """Differences of neighbours of y (4, n), and means of its headings, at links a to b: into `links` and `couple`.

    For elements those at their strain points.
    """
    n, first, last = y.shape[1], max(a, 1), min(b, y.shape[1])
    for row in range(4):
        before, after, d = y[row][first - 1 : last - 1], y[row][first:last], work.links[row][first:last]
        for j in range(d.size):
            d[j] = after[j] - before[j]
    before, after, mean = y[3][first - 1 : last - 1], y[3][first:last], work.couple[first:last]
    for j in range(mean.size):
        mean[j] = 0.5 * (after[j] + before[j])
    for j in (0, n):
        if chain.ring and a <= j < b:
            for row in range(4):
                work.links[row, j] = y[row, 0] - y[row, n - 1]
            work.couple[j] = 0.5 * (y[3, 0] + y[3, n - 1])
    to_points(chain.joints, work.links, work.couple, a, b)


@part
def secant(work, a, b, k, full):
    """Mean geometry at links a to b of a step whose half changes them by `links`; if not `full`, that of the position so moved.

    Results in `work`: along, the first row of the matrix from (dx, dy) to stretch and shear (the second row is the first one turned
    by 90 degrees); across; and the mean strain, in `tension`. The loops are short and use few arrays each, so that compilers can
    vectorise them.
    """
    per = 1 / k
    half, cos, sin = work.couple[a:b], work.turned[0][a:b], work.turned[1][a:b]
    for j in range(half.size):
        cos[j], sin[j] = turn(half[j])
    along_x, along_y, across_x, across_y = work.along[0][a:b], work.along[1][a:b], work.across[0][a:b], work.across[1][a:b]
    cos0, sin0 = work.angles[2][a:b], work.angles[3][a:b]
    for j in range(half.size):
        along_x[j] = cos0[j] * cos[j] - sin0[j] * sin[j]
    for j in range(half.size):
        along_y[j] = sin0[j] * cos[j] + cos0[j] * sin[j]
    bx, by, dx, dy = work.base[0][a:b], work.base[1][a:b], work.links[0][a:b], work.links[1][a:b]
    stretch, shear = work.tension[0][a:b], work.tension[1][a:b]
    if full:
        e0, e1 = work.strain[0][a:b], work.strain[1][a:b]
        for j in range(half.size):  # end of the step: the angle of the half step and the change of links twice
            c, s = along_x[j] * cos[j] - along_y[j] * sin[j], along_y[j] * cos[j] + along_x[j] * sin[j]
            x, y2 = bx[j] + 2 * dx[j], by[j] + 2 * dy[j]
            stretch[j] = 0.5 * (e0[j] + ((c * x + s * y2) * per - 1))
            shear[j] = 0.5 * (e1[j] + (c * y2 - s * x) * per)
    for j in range(half.size):
        x, y1 = (bx[j] + dx[j]) * per, (by[j] + dy[j]) * per
        across_x[j] = along_x[j] * y1 - along_y[j] * x
        across_y[j] = -(along_x[j] * x + along_y[j] * y1)
    if full:
        for j in range(half.size):
            h = half[j]
            shorter = sin[j] / h if abs(h) > 1e-8 else 1.0
            across_x[j] *= shorter
            across_y[j] *= shorter
        for j in range(half.size):
            along_x[j] *= cos[j] * per
            along_y[j] *= cos[j] * per
    else:
        for j in range(half.size):
            stretch[j], shear[j] = -across_y[j] - 1, across_x[j]
            along_x[j] *= per
            along_y[j] *= per
    for row in range(2, 4):
        start, d, strain = work.base[row][a:b], work.links[row][a:b], work.tension[row][a:b]
        for j in range(half.size):
            strain[j] = (start[j] + d[j]) * per


@part
def tensions(work, stiffness, a, b, k):
    """Tensions and couples of links a to b from their mean strain and geometry; `tension` holds the strain before."""
    per = 1 / k
    k0, k1 = stiffness[0][a:b], stiffness[1][a:b]
    along_x, along_y, across_x, across_y = work.along[0][a:b], work.along[1][a:b], work.across[0][a:b], work.across[1][a:b]
    s0, s1, couple = work.tension[0][a:b], work.tension[1][a:b], work.couple[a:b]
    for j in range(couple.size):
        s0[j] *= k0[j]
        s1[j] *= k1[j]
    for j in range(couple.size):
        couple[j] = 0.5 * (across_x[j] * s0[j] + across_y[j] * s1[j])
    for j in range(couple.size):
        n, q = s0[j], s1[j]
        s0[j], s1[j] = along_x[j] * n - along_y[j] * q, along_y[j] * n + along_x[j] * q
    for row in range(2, 4):
        k23, s = stiffness[row][a:b], work.tension[row][a:b]
        for j in range(couple.size):
            s[j] *= k23[j] * per


@part
def pull(chain, work, y, full):
    """Geometry and tensions after a step or a move y, TILE links at a time, so that intermediate results stay in the cache."""
    links = work.couple.size
    for a in range(chain.joints.first, links, TILE):
        b = min(a + TILE, links)
        spread(chain, work, y, a, b)
        secant(work, a, b, chain.k, full)
        tensions(work, chain.stiffness, a, b, chain.k)
        to_links(chain.joints, work.tension, work.couple, a, b)
    close(chain.joints, work.tension, work.couple)


@part
def pulled(work, c, g):
    """g = C^T grad V, from the tensions."""
    cx, cy, ct, cp = c[0], c[1], c[2], c[3]
    x, y, t, p, couple = work.tension[0], work.tension[1], work.tension[2], work.tension[3], work.couple
    roll, heading = g[0], g[1]
    for i in range(roll.size):
        roll[i] = cx[i] * (x[i] - x[i + 1]) + cy[i] * (y[i] - y[i + 1]) + ct[i] * (t[i] - t[i + 1])
    for i in range(roll.size):
        heading[i] = cp[i] * ((p[i] - p[i + 1]) + (couple[i] + couple[i + 1]))
