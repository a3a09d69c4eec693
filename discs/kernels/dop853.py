"""A whole run by the explicit method of order 8 of Dormand and Prince, with SciPy's coefficients and step control.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I (1993), section II.10; first step, II.4.
Plain twin: `scipy.integrate.DOP853` on `discs.integrators.ivp.Reduced`. Frames are states of the interpolant of order 7.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import protocol as do
from discs.kernels.compiled import fill, kernel, part, stub
from discs.kernels.interrupts import interrupted
from discs.kernels.shared import columns, copy, forward
from discs.skew import Phase

SAFETY, LEAST, MOST = 0.9, 0.2, 10.0  # factors of the step, as in SciPy
STAGES = 12


class Coefficients(NamedTuple):
    """Those of `scipy.integrate.DOP853`: a (12, 12), b, c (12,) of the step, e3, e5 (13,) of its error; more (3, 16), at (3,),
    d (4, 16) of the interpolant."""

    a: NDArray
    b: NDArray
    c: NDArray
    e3: NDArray
    e5: NDArray
    more: NDArray
    at: NDArray
    d: NDArray


@cache
def coefficients() -> Coefficients:
    """The coefficients, from SciPy."""
    import scipy

    made = scipy.integrate.DOP853
    table = made.A, made.B, made.C, made.E3, made.E5, made.A_EXTRA, made.C_EXTRA, made.D
    return Coefficients(*map(np.ascontiguousarray, table))


class Motion(NamedTuple):
    """Positions (rows, n) and momenta (columns, n), or several of them."""

    q: NDArray
    p: NDArray


@kernel
def run(method, chain, state, rtol, atol, longest, bound, times, q, rates, told):
    """The frames at `times` (F,) of the motion from a state at t = 0, recorded as in `discs.kernels.driver.march`.

    Returns the numbers of frames recorded, of steps taken and of evaluations. The run ends early if its steps become too short, if
    the kinetic energy exceeds `bound`, or if a heading vanishes; the number of frames is -1 after Ctrl-C.
    """
    rows, n = state.hi.shape
    work, still, c, v, slope = do.workspace(chain), np.zeros((rows, n)), np.empty((rows, n)), np.empty((rows, n)), np.zeros((2, n))
    k = Motion(np.empty((16, rows, n)), np.empty((16, columns(rows), n)))
    series = Motion(np.empty((7, rows, n)), np.empty((7, columns(rows), n)))
    now, then, inside = (
        Motion(state.hi + state.lo, state.pi.copy()),
        Motion(np.empty((rows, n)), np.empty_like(state.pi)),
        Motion(np.empty((rows, n)), np.empty_like(state.pi)),
    )
    t, done, taken, h, shown = 0.0, 0, 0, 0.0, False
    rate(chain, work, t, now, c, still, k, 0)
    do.lost(chain, work, slope)
    if times.size and times[0] == 0.0:
        do.frame(chain, work, Phase(now.q, still, now.p), c, v, q[:, 0], rates[:, 0], told[:, 0])
        done = 1
    if done < times.size:
        h = first(chain, work, now, inside, c, still, k, rtol, atol, longest)
    evaluations = 2
    while done < times.size:
        if interrupted(now.q.size):
            return -1, taken, evaluations
        end, longer, more = step(method, chain, work, t, np.inf, h, longest, k, now, inside, then, c, still, rtol, atol)
        evaluations += more
        if end == t:
            return done, taken, evaluations
        h = end - t
        kinetic = 0.0
        for row in range(then.p.shape[0]):
            for i in range(n):
                kinetic += 0.5 * then.p[row, i] ** 2
        if do.lost(chain, work, slope) >= 0 or not kinetic <= bound:
            return done, taken, evaluations
        shown = False
        while done < times.size and times[done] <= end:
            if not shown:
                for j in range(3):
                    combine(method.more[j], STAGES + 1 + j, k, h, now, inside)
                    rate(chain, work, t + method.at[j] * h, inside, c, still, k, STAGES + 1 + j)
                evaluations, shown = evaluations + 3, True
                expand(method.d, k.q, h, now.q, then.q, series.q)
                expand(method.d, k.p, h, now.p, then.p, series.p)
            x = (times[done] - t) / h
            between(series.q, x, now.q, inside.q)
            between(series.p, x, now.p, inside.p)
            do.settle(chain, work, inside.q, still)
            place = Phase(inside.q, still, inside.p)
            do.frame(chain, work, place, c, v, q[:, done], rates[:, done], told[:, done])
            done += 1
        t, now, then, taken = end, then, now, taken + 1
        copy(k.q[STAGES], k.q[0])
        copy(k.p[STAGES], k.p[0])
        h = longer
    return done, taken, evaluations


@part
def step(method, chain, work, t, last, h, longest, k, now, inside, then, c, still, rtol, atol):
    """A step from the state `now` at t to `then`, not beyond a time `last`. k[0] holds the rates before it, k[STAGES] those after.

    Returns its end, which is t if it became too short; the length that the next one is to have; and the number of evaluations.
    """
    least, rejected, evaluations = 10 * (np.nextafter(t, np.inf) - t), False, 0
    h = min(max(h, least), longest)
    while True:
        if not h >= least:
            return t, h, evaluations
        end = min(t + h, last)
        h = end - t
        for stage in range(1, STAGES):
            combine(method.a[stage], stage, k, h, now, inside)
            rate(chain, work, t + method.c[stage] * h, inside, c, still, k, stage)
        combine(method.b, STAGES, k, h, now, then)
        rate(chain, work, end, then, c, still, k, STAGES)
        evaluations += STAGES
        error = norm(method, k, h, now, then, rtol, atol)
        if error < 1:
            break
        h, rejected = h * max(LEAST, SAFETY * error ** (-1 / 8)), True
    factor = MOST if error == 0 else min(MOST, SAFETY * error ** (-1 / 8))
    return end, h * (min(1.0, factor) if rejected else factor), evaluations


@stub
def rate(chain, work, t, z, c, still, k, stage):
    """k[stage] = the time derivative at the time t and the state z."""


@fill(rate, object)
def _reduced(chain, work, t, z, c, still, k, stage):
    """By the reduced equations; z becomes the base position."""
    v, g = k.q[stage], k.p[stage]
    do.settle(chain, work, z.q, still)
    do.basis(chain, work, still, c)
    forward(c, z.p, v)
    do.pullback(chain, work, Phase(z.q, still, z.p), t, still, c, z.p, g)
    for row in range(g.shape[0]):
        for i in range(g.shape[1]):
            g[row, i] = -g[row, i]


@part
def combine(weights, count, k, h, start, to):
    """to = start + h times the sum of the first `count` of k with these weights."""
    add_stages(weights, count, k.q, h, start.q, to.q)
    add_stages(weights, count, k.p, h, start.p, to.p)


@part
def add_stages(weights, count, k, h, start, to):
    for row in range(to.shape[0]):
        total, begin = to[row], start[row]
        for i in range(total.size):
            total[i] = 0.0
        for j in range(count):
            if weights[j] != 0:
                w, x = weights[j], k[j, row]
                for i in range(total.size):
                    total[i] += w * x[i]
        for i in range(total.size):
            total[i] = begin[i] + h * total[i]


@part
def first(chain, work, now, inside, c, still, k, rtol, atol, longest):
    """The first step; k[0] holds the rates, k[1] is workspace."""
    size, speed = 0.0, 0.0
    for z, r in ((now.q, k.q[0]), (now.p, k.p[0])):
        for row in range(z.shape[0]):
            for i in range(z.shape[1]):
                scale = atol + abs(z[row, i]) * rtol
                size, speed = size + (z[row, i] / scale) ** 2, speed + (r[row, i] / scale) ** 2
    unknowns = now.q.size + now.p.size
    size, speed, change = np.sqrt(size / unknowns), np.sqrt(speed / unknowns), 0.0
    h = 1e-6 if size < 1e-5 or speed < 1e-5 else 0.01 * size / speed
    for z, r, to in ((now.q, k.q[0], inside.q), (now.p, k.p[0], inside.p)):
        for row in range(z.shape[0]):
            for i in range(z.shape[1]):
                to[row, i] = z[row, i] + h * r[row, i]
    rate(chain, work, h, inside, c, still, k, 1)
    for z, r, s in ((now.q, k.q[0], k.q[1]), (now.p, k.p[0], k.p[1])):
        for row in range(z.shape[0]):
            for i in range(z.shape[1]):
                change += ((s[row, i] - r[row, i]) / (atol + abs(z[row, i]) * rtol)) ** 2
    change = np.sqrt(change / unknowns) / h
    most = max(speed, change)
    other = max(1e-6, h * 1e-3) if most <= 1e-15 else (0.01 / most) ** (1 / 8)
    return min(100 * h, other, longest)


@part
def norm(method, k, h, now, then, rtol, atol):
    """The size of the error of a step, in units of the tolerances."""
    fifth, third = 0.0, 0.0
    for rates, a, b in ((k.q, now.q, then.q), (k.p, now.p, then.p)):
        for row in range(a.shape[0]):
            for i in range(a.shape[1]):
                e5, e3 = 0.0, 0.0
                for j in range(STAGES + 1):
                    e5, e3 = e5 + method.e5[j] * rates[j, row, i], e3 + method.e3[j] * rates[j, row, i]
                scale = atol + max(abs(a[row, i]), abs(b[row, i])) * rtol
                fifth, third = fifth + (e5 / scale) ** 2, third + (e3 / scale) ** 2
    if fifth == 0 and third == 0:
        return 0.0
    return h * fifth / np.sqrt((fifth + 0.01 * third) * (now.q.size + now.p.size))


@part
def expand(d, k, h, start, end, series):
    """The coefficients of the interpolant, series (7, ...)."""
    for row in range(start.shape[0]):
        for i in range(start.shape[1]):
            change, before, after = end[row, i] - start[row, i], h * k[0, row, i], h * k[STAGES, row, i]
            series[0, row, i], series[1, row, i] = change, before - change
            series[2, row, i] = 2 * change - (before + after)
            for j in range(4):
                total = 0.0
                for s in range(16):
                    total += d[j, s] * k[s, row, i]
                series[3 + j, row, i] = h * total


@part
def between(series, x, start, to):
    """The state at a part x of the step."""
    for row in range(start.shape[0]):
        for i in range(start.shape[1]):
            total = 0.0
            for j in range(7):
                total = (total + series[6 - j, row, i]) * (x if j % 2 == 0 else 1 - x)
            to[row, i] = start[row, i] + total
