"""Compiled: the linearised equations of discs with slaved headings and linear curvature, whose grad^2 V is constant.

The headings are r' = (d_i + d_{i+1})/2k along x and along y, from the links beside a disc; `discs.kernels.slaved` has the ghost
links of free ends. The plain twin is `discs.analysis.stages`.
"""

from discs.chains.links.linear import fold
from discs.kernels import linearised
from discs.kernels import protocol as do
from discs.kernels.compiled import fill, part
from discs.kernels.slaved import Slaved, basis_of, moved
from discs.kernels.slaved_matrix import GHOST, RING


@fill(linearised.headings, Slaved)
def _headings(chain):
    return 2


@fill(linearised.kept, Slaved)
def _kept(chain):
    return 0


@fill(linearised.turns, Slaved)
def _turns(chain, at, j):
    c, arm, d, half = at.c[j], at.arm[j], at.work.base, 0.5 / chain.k
    basis_of(chain, d, c)
    do.gradient(chain, at.work, at.still, at.g[j])
    cx, cy, ct, x_by, y_by = c[0], c[1], c[2], at.turned[j, 0], at.turned[j, 1]
    for i in range(ct.size):
        z = complex(half * (d[0, i] + d[0, i + 1]), half * (d[1, i] + d[1, i + 1]))
        h, by_x, _ = do.jet(chain.rolling, z, complex(1.0, 0.0), complex(0.0, 0.0))
        _, by_y, _ = do.jet(chain.rolling, z, complex(0.0, 1.0), complex(0.0, 0.0))
        arm[0, i], arm[1, i] = -h.imag, h.real
        radius, mass, top = chain.radius[i], chain.weights[0, i], ct[i]
        change(radius, mass, by_x, cx[i], cy[i], top, i, x_by)
        change(radius, mass, by_y, cx[i], cy[i], top, i, y_by)


@part
def change(radius, mass, h, x, y, top, i, to):
    """dC for a change h of the direction of rolling: de = R J h, and the root sqrt(m) = 1/top changes too."""
    ex, ey = -radius * h.imag, radius * h.real
    shrink = -mass * (x * ex + y * ey) * top
    to[0, i], to[1, i], to[2, i] = ex * top + x * shrink, ey * top + y * shrink, top * shrink


@fill(linearised.restore, Slaved)
def _restore(chain, at, j, w, to):
    do.gradient(chain, at.flat, w, to)


@fill(linearised.turn, Slaved)
def _turn(chain, at, j, dq, v, g):
    moved(chain, at.flat.base, dq, at.flat.links, 2)
    half = 0.5 / chain.k
    for h in range(2):
        d, pull, to = at.flat.links[h], at.pull[j, h, 0], g[0]
        for row in range(3):
            by, rate = at.turned[j, h, row], v[row]
            for i in range(by.size):
                rate[i] += by[i] * (half * (d[i] + d[i + 1]))
        for i in range(pull.size):
            to[i] -= pull[i] * (half * (d[i] + d[i + 1]))


@fill(linearised.turn_back, Slaved)
def _turn_back(chain, at, j, m, nu, to):
    half, n, along = 0.5 / chain.k, at.along.size, at.along
    for h in range(2):
        (bx, by, bt), pull, tension, x = at.turned[j, h], at.pull[j, h, 0], at.flat.tension[h], to[h]
        for i in range(n):
            along[i] = half * (bx[i] * m[0, i] + by[i] * m[1, i] + bt[i] * m[2, i] - pull[i] * nu[0, i])
        tension[0], tension[n] = along[0], along[n - 1]
        for i in range(1, n):
            tension[i] = along[i - 1] + along[i]
        release(chain.ends, tension)
        for i in range(n):
            x[i] += tension[i] - tension[i + 1]


@part
def release(ends, to):
    """The transpose of `discs.kernels.slaved.close_ends`, for a row of links."""
    fold(ends, to)
    if ends != RING and ends != GHOST:
        n = to.size - 1
        first, last = to[0], to[n]
        to[1] += 2 * first
        to[2] -= first
        to[n - 1] += 2 * last
        to[n - 2] -= last
        to[0], to[n] = 0.0, 0.0


@fill(linearised.weigh, Slaved)
def _weigh(chain, at, j, m, nu, p, sums):
    linearised.weigh_roll(at.c[j], at.arm[j], chain.weights[0], at.g[j], m, nu[0], p[0], sums)
