r"""Compiled: the linearised equations of discs with their own headings; the plain twin is `SteeredSystem.strains`.

C depends on the heading phi of a disc, with dC/dphi = J C. At a strain point with differences (dx, dy), mean heading m and k times
the stiffnesses A, G, the strains change by

    e_1 = a . (dx, dy) + b_1 dm,   e_2 = J a . (dx, dy) + b_2 dm,   a = (cos m, sin m)/k,   b = -J u,

with u = T(-m) d/k (`discs.chains.steered`). With the stresses n = k A Gamma_1 and q = k G Gamma_2, and z = n J a - q a, the
tension changes by k A e_1 a + k G e_2 J a + z dm, and the derivative by m by k A e_1 b_1 + k G e_2 b_2 + z . (dx, dy) - (n u_1 +
q u_2) dm.
"""

from discs.kernels import linearised
from discs.kernels import protocol as do
from discs.kernels.compiled import fill
from discs.kernels.steered import Steered, basis_of
from discs.kernels.steered_joints import close, to_links
from discs.kernels.steered_links import spread


@fill(linearised.headings, Steered)
def _headings(chain):
    return 1


@fill(linearised.kept, Steered)
def _kept(chain):
    return 6


@fill(linearised.turns, Steered)
def _turns(chain, at, j):
    c, work, k, per = at.c[j], at.work, chain.stiffness, 1 / chain.k
    basis_of(chain, work, at.still[3], c)
    do.gradient(chain, work, at.still, at.g[j])
    arm, by = at.arm[j], at.turned[j, 0]
    for i in range(c.shape[1]):
        arm[0, i], arm[1, i] = -work.angles[1, i], work.angles[0, i]
        by[0, i], by[1, i], by[2, i], by[3, i] = -c[1, i], c[0, i], 0.0, 0.0
    cos, sin = work.angles[2], work.angles[3]
    ax, ay, bx, by, n, q = at.kept[j, 0], at.kept[j, 1], at.kept[j, 2], at.kept[j, 3], at.kept[j, 4], at.kept[j, 5]
    for i in range(n.size):
        ax[i], ay[i] = cos[i] * per, sin[i] * per
        x, y = work.base[0, i], work.base[1, i]
        bx[i], by[i] = ax[i] * y - ay[i] * x, -(ax[i] * x + ay[i] * y)
        n[i], q[i] = k[0, i] * work.strain[0, i], k[1, i] * work.strain[1, i]


@fill(linearised.restore, Steered)
def _restore(chain, at, j, w, to):
    work, k, per, first = at.flat, chain.stiffness, 1 / chain.k, chain.joints.first
    ax, ay, bx, by, n, q = at.kept[j, 0], at.kept[j, 1], at.kept[j, 2], at.kept[j, 3], at.kept[j, 4], at.kept[j, 5]
    spread(chain, work, w, first, n.size)
    dx, dy, dt, dp, mean = work.links[0], work.links[1], work.links[2], work.links[3], work.couple
    tx, ty, tt, tp = work.tension[0], work.tension[1], work.tension[2], work.tension[3]
    for i in range(first, n.size):
        m, zx, zy = mean[i], -n[i] * ay[i] - q[i] * ax[i], n[i] * ax[i] - q[i] * ay[i]
        s = k[0, i] * (ax[i] * dx[i] + ay[i] * dy[i] + bx[i] * m)
        r = k[1, i] * (ax[i] * dy[i] - ay[i] * dx[i] + by[i] * m)
        tx[i], ty[i] = ax[i] * s - ay[i] * r + zx * m, ay[i] * s + ax[i] * r + zy * m
        mean[i] = 0.5 * (bx[i] * s + by[i] * r + zx * dx[i] + zy * dy[i] + (n[i] * by[i] - q[i] * bx[i]) * m)
        tt[i], tp[i] = k[2, i] * per * per * dt[i], k[3, i] * per * per * dp[i]
    to_links(chain.joints, work.tension, mean, first, n.size)
    close(chain.joints, work.tension, mean)
    for row in range(4):
        x, t = to[row], work.tension[row]
        for i in range(x.size):
            x[i] = t[i] - t[i + 1]
    for i in range(to.shape[1]):
        to[3, i] += mean[i] + mean[i + 1]


@fill(linearised.turn, Steered)
def _turn(chain, at, j, dq, v, g):
    by, pull, dphi = at.turned[j, 0], at.pull[j, 0, 0], dq[3]
    for i in range(dphi.size):
        v[0, i] += by[0, i] * dphi[i]
        v[1, i] += by[1, i] * dphi[i]
        g[0, i] -= pull[i] * dphi[i]


@fill(linearised.turn_back, Steered)
def _turn_back(chain, at, j, m, nu, to):
    by, pull, x = at.turned[j, 0], at.pull[j, 0, 0], to[3]
    for i in range(x.size):
        x[i] += by[0, i] * m[0, i] + by[1, i] * m[1, i] - pull[i] * nu[0, i]


@fill(linearised.weigh, Steered)
def _weigh(chain, at, j, m, nu, p, sums):
    c, g = at.c[j], at.g[j]
    linearised.weigh_roll(c, at.arm[j], chain.weights[0], g, m, nu[0], p[0], sums)
    for i in range(c.shape[1]):
        sums[3, i] -= 0.5 * c[3, i] ** 3 * (m[3, i] * p[1, i] - nu[1, i] * g[3, i])
