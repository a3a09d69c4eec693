"""Compiled loads: one type for all of them, or none, so that a load needs no kernels of its own. Plain twin: `discs.loads.Linear`.

Compiled code cannot call a signal. It is given the values of signals at the times at which a method evaluates forces, and finds
those of a time by bisection. A time that is not among them gives NaN, which stops the run.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import protocol as do
from discs.kernels.bends import NO_BENDS, Bends, bend, spent_by_bends, stiffen_bends
from discs.kernels.compiled import fill, part
from discs.kernels.limits import HELD
from discs.kernels.shared import column


class Linear(NamedTuple):
    """f = constant - damping v - stiffness q - B^T (viscosity) B v + sum_k (signal k) (pattern k), and that of bends.

    Arrays have no entries for none.

    constant, damping, stiffness : (rows, n). level : (rows,), of a row: 3 if it has stiffness, otherwise 2 if it has damping,
    otherwise 1 if it has a constant, otherwise 0. viscosity : (columns, n + 1), of the rates of theta and phi, link j before disc
    j; B v is the difference of neighbours. patterns : (K, rows, n). pushed : (K, rows), whether a pattern has entries in a row.
    times : (M,), increasing. values : (M, K + A), signals and rates of motors at these times. near : (1,), how far a time may be
    from one of them. bends : see `discs.kernels.bends`. spent : (4,), work and dissipated energy since the last call from Python,
    each with its lost digits. axles : (A, 2), row and disc of the angles that motors drive, see `discs.loads.motor`.
    """

    constant: NDArray
    damping: NDArray
    stiffness: NDArray
    level: NDArray
    viscosity: NDArray
    patterns: NDArray
    pushed: NDArray
    times: NDArray
    values: NDArray
    near: NDArray
    bends: Bends
    spent: NDArray
    axles: NDArray


NONE = np.empty((0, 0))
FEW, NO_LEVEL, NO_PATTERNS, UNPUSHED = np.empty(0), np.empty(0, int), np.empty((0, 0, 0)), np.empty((0, 0), bool)
NO_AXLES = np.empty((0, 2), int)
UNLOADED = Linear(NONE, NONE, NONE, NO_LEVEL, NONE, NO_PATTERNS, UNPUSHED, FEW, NONE, FEW, NO_BENDS, FEW, NO_AXLES)


@fill(do.loaded, Linear)
def _loaded(load):
    return load.constant.size > 0


@fill(do.driven, Linear)
def _driven(load):
    return load.axles.size > 0


@part
def at(load, t):
    """The row of the table of signals that is nearest to the time t; -1 if none is near."""
    low, high = 0, load.times.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if load.times[middle] <= t:
            low = middle
        else:
            high = middle
    if high < 0:
        return -1
    row = high if abs(load.times[high] - t) < abs(load.times[low] - t) else low
    return row if abs(load.times[row] - t) <= load.near[0] else -1


@fill(do.push, Linear)
def _push(load, state, t, move, c, p, factor, g):
    for row in range(load.constant.shape[0]):
        a, rate, to = c[row], p[column(row)], g[column(row)]
        constant, damping, stiffness = load.constant[row], load.damping[row], load.stiffness[row]
        hi, lo, step = state.hi[row], state.lo[row], move[row]
        if load.level[row] > 2:
            for i in range(to.size):
                f = constant[i] - damping[i] * (a[i] * rate[i]) - stiffness[i] * (hi[i] + (lo[i] + step[i]))
                to[i] += factor * a[i] * f
        elif load.level[row] > 0:
            for i in range(to.size):
                to[i] += factor * a[i] * (constant[i] - damping[i] * (a[i] * rate[i]))
    for row in range(load.viscosity.shape[0]):
        a, rate, links, to = c[2 + row], p[row], load.viscosity[row], g[row]
        last = a.size - 1
        for j in range(last + 2):  # the link between discs i and k
            i, k = j - 1 if j > 0 else last, j if j <= last else 0
            f = links[j] * (a[k] * rate[k] - a[i] * rate[i])
            if j <= last:
                to[k] -= factor * a[k] * f
            if j > 0:
                to[i] += factor * a[i] * f
    place = at(load, t)
    if load.bends.rest.size > 0:
        bend(load.bends, load.values, place, state, move, c, p, factor, g)
    if load.patterns.shape[0] > 0:
        for k in range(load.patterns.shape[0]):
            signal = factor * load.values[place, k] if place >= 0 else np.nan
            for row in range(c.shape[0]):
                a, pattern, to = c[row], load.patterns[k, row], g[column(row)]
                for i in range(to.size if load.pushed[k, row] else 0):
                    to[i] += signal * a[i] * pattern[i]


@fill(do.hold, Linear)
def _hold(load, t, c, p, factor, g):
    place = at(load, t) if load.axles.size > 0 else -1
    for m in range(load.axles.shape[0]):
        row, i = load.axles[m, 0], load.axles[m, 1]
        rate = load.values[place, load.patterns.shape[0] + m] if place >= 0 else np.nan
        g[column(row), i] += factor * c[row, i] * (HELD * (rate - c[row, i] * p[column(row), i]))


@fill(do.guide, Linear)
def _guide(load, c, d, g, roll, roll_beside, turn, turn_beside):
    for row in range(load.constant.shape[0]):
        a, damping, stiffness = c[row], load.damping[row], load.stiffness[row]
        to = turn if column(row) else roll
        for i in range(damping.size if load.level[row] > 1 else 0):
            to[i] += a[i] * a[i] * (d * damping[i] + g * stiffness[i])
    for row in range(load.viscosity.shape[0]):
        a, links = c[2 + row], load.viscosity[row]
        to, beside = (turn, turn_beside) if row else (roll, roll_beside)
        last = a.size - 1
        for i in range(last + 1):
            to[i] += d * a[i] * a[i] * (links[i] + links[i + 1])
            beside[i] -= d * links[i + 1] * a[i] * a[i + 1 if i < last else 0]
    for m in range(load.axles.shape[0]):
        row, i = load.axles[m, 0], load.axles[m, 1]
        to = turn if column(row) else roll
        to[i] += c[row, i] * c[row, i] * (d * HELD)


@fill(do.stiffen, Linear)
def _stiffen(load, state, t, move, c, d, g, matrix):
    if load.bends.rest.size > 0:
        stiffen_bends(load.bends, load.values, at(load, t), state, move, c, d, g, matrix)


@part
def book(spent, at, amount):
    """Add an amount to the sum spent[at], whose lost digits are in spent[at + 1] (Knuth's two-sum)."""
    term = amount + spent[at + 1]
    total = spent[at] + term
    part = total - spent[at]
    spent[at + 1] = (spent[at] - (total - part)) + (term - part)
    spent[at] = total


@fill(do.spend, Linear)
def _spend(load, state, t, weight, move, v, scale):
    if load.spent.size == 0:
        return
    place = at(load, t)
    work, dissipated = spent_by_bends(load.bends, load.values, place, state, move, v)
    for row in range(load.damping.shape[0]):
        rate, damping = v[row], load.damping[row]
        for i in range(rate.size):
            dissipated += damping[i] * rate[i] * rate[i]
    for row in range(load.viscosity.shape[0]):
        rate, links = v[2 + row], load.viscosity[row]
        for j in range(1, rate.size + 1):
            apart = rate[j if j < rate.size else 0] - rate[j - 1]
            dissipated += links[j] * apart * apart
    if load.patterns.shape[0] > 0:
        for k in range(load.patterns.shape[0]):
            signal = load.values[place, k] if place >= 0 else np.nan
            for row in range(v.shape[0]):
                rate, pattern = v[row], load.patterns[k, row]
                for i in range(rate.size):
                    work += signal * pattern[i] * rate[i]
    book(load.spent, 0, weight * scale * work)
    book(load.spent, 2, weight * scale * scale * dissipated)


@fill(do.react, Linear)
def _react(load, gained, p):
    for m in range(load.axles.shape[0]):
        turn, i = column(load.axles[m, 0]), load.axles[m, 1]
        book(load.spent, 0, gained[turn, i] * p[turn, i])
