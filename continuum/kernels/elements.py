"""The motion of a steered rod on elements without loads, compiled whole by the method of `discs.kernels.dop853`.

The plain twin, with the formulas, is `continuum.elements.Elements.rate`, by `continuum.element_march`. The unknowns (6, n) are the
"positions" of the method; there are no momenta.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import dop853
from discs.kernels.compiled import fill, kernel
from discs.kernels.dop853 import STAGES, Motion, first, step
from discs.kernels.interrupts import interrupted
from discs.kernels.shared import copy


class Steered(NamedTuple):
    """Elements of a steered rod.

    half : (P,), half the widths of the elements. w : (P, m), weights of their nodes. d : (m, m), the transposed derivative matrix.
    stiffness : (4, P, m). radius : (n,). inertia : (2, n). closing : (4,), what the last node of a ring adds to the first node's
    x, y, theta and phi.
    """

    half: NDArray
    w: NDArray
    d: NDArray
    stiffness: NDArray
    radius: NDArray
    inertia: NDArray
    closing: NDArray


class Workspace(NamedTuple):
    """local, flux : (4, m), of an element. cos, sin : (n,), of the headings."""

    local: NDArray
    flux: NDArray
    cos: NDArray
    sin: NDArray


@fill(dop853.rate, Steered)
def _rate(rod, work, t, z, c, still, rates, stage):
    """The time derivative of the unknowns (6, n)."""
    q, rate, d = z.q, rates.q[stage], rod.d
    n, count, m = rod.radius.size, rod.half.size, d.shape[0]
    local, flux, cos, sin = work
    for k in range(n):
        cos[k], sin[k] = np.cos(q[3, k]), np.sin(q[3, k])
        rate[4, k] = rate[5, k] = 0.0
    for p in range(count):
        for j in range(m):
            k = (p * (m - 1) + j) % n
            for row in range(4):
                local[row, j] = q[row, k]
        if n == count * (m - 1) and p == count - 1:
            for row in range(4):
                local[row, m - 1] += rod.closing[row]
        for i in range(m):
            dx = dy = twist = bend = 0.0
            for j in range(m):
                dx += local[0, j] * d[j, i]
                dy += local[1, j] * d[j, i]
                twist += local[2, j] * d[j, i]
                bend += local[3, j] * d[j, i]
            k, h, w = (p * (m - 1) + i) % n, rod.half[p], rod.w[p, i]
            a, b = cos[k], sin[k]
            u0, u1 = (a * dx + b * dy) / h, (a * dy - b * dx) / h
            n1, n2 = rod.stiffness[0, p, i] * (u0 - 1), rod.stiffness[1, p, i] * u1
            flux[0, i] = w / h * (a * n1 - b * n2)
            flux[1, i] = w / h * (b * n1 + a * n2)
            flux[2, i] = w / h * rod.stiffness[2, p, i] * twist / h
            flux[3, i] = w / h * rod.stiffness[3, p, i] * bend / h
            rate[5, k] += w * (u0 * n2 - u1 * n1)
        for j in range(m):
            fx = fy = torque = moment = 0.0
            for i in range(m):
                fx -= flux[0, i] * d[j, i]
                fy -= flux[1, i] * d[j, i]
                torque -= flux[2, i] * d[j, i]
                moment -= flux[3, i] * d[j, i]
            k = (p * (m - 1) + j) % n
            rate[4, k] += rod.radius[k] * (cos[k] * fy - sin[k] * fx) + torque
            rate[5, k] += moment
    for k in range(n):
        rate[0, k], rate[1, k] = -rod.radius[k] * sin[k] * q[4, k], rod.radius[k] * cos[k] * q[4, k]
        rate[2, k], rate[3, k] = q[4, k], q[5, k]
        rate[4, k] /= rod.inertia[0, k]
        rate[5, k] /= rod.inertia[1, k]


@kernel
def march(method, rod, start, times, rtol, atol, tried, most, found):
    """Fill `found` (F, 6, n) with the unknowns at `times` (F,), which increase, from `start` (6, n) at t = 0.

    Steps end at the last time. The state at any other time is reached by shorter steps of its own: within steps near the limit of
    stability the interpolant of order 7 is far less accurate.

    Returns the number of times reached, and of evaluations. It is below F if steps became too short; if more than `most`
    evaluations were made; or if after `tried` of them more would be needed to the end. It is -1 after Ctrl-C.
    """
    n, end = start.shape[1], max(times[-1], 1e-300)
    work = Workspace(np.empty((4, rod.d.shape[0])), np.empty((4, rod.d.shape[0])), np.empty(n), np.empty(n))
    k, own = Motion(np.empty((13, 6, n)), np.empty((13, 0, n))), Motion(np.empty((13, 6, n)), np.empty((13, 0, n)))
    none = np.empty((0, n))
    now, then, inside, aside, other = (
        Motion(start.copy(), none),
        Motion(start.copy(), none),
        Motion(start.copy(), none),
        Motion(start.copy(), none),
        Motion(start.copy(), none),
    )
    t, done, h, evaluations = 0.0, 0, 0.0, 2
    while done < times.size and times[done] <= 0:
        found[done] = start
        done += 1
    dop853.rate(rod, work, t, now, start, start, k, 0)
    if done < times.size:
        h = first(rod, work, now, inside, start, start, k, rtol, atol, end)
    while done < times.size:
        if interrupted(start.size):
            return -1, evaluations
        reached, h, more = step(method, rod, work, t, end, h, np.inf, k, now, inside, then, start, start, rtol, atol)
        evaluations += more
        if reached == t:
            return done, evaluations
        while done < times.size and times[done] <= reached:
            if times[done] == reached:
                found[done] = then.q
            else:  # from `now`, by a first step to this time
                copy(k.q[0], own.q[0])
                copy(now.q, aside.q)
                at, short = t, times[done] - t
                while at < times[done]:
                    to, short, more = step(
                        method, rod, work, at, times[done], short, np.inf, own, aside, inside, other, start, start, rtol, atol
                    )
                    evaluations += more
                    if to == at:
                        return done, evaluations
                    at, aside, other = to, other, aside
                    copy(own.q[STAGES], own.q[0])
                found[done] = aside.q
            done += 1
        t, now, then = reached, then, now
        copy(k.q[STAGES], k.q[0])
        if evaluations > most or (evaluations >= tried and t * most < evaluations * end):
            return done, evaluations
    return done, evaluations
