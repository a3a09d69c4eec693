"""Loads given as functions that numba compiles, beside linear ones. Plain twins: `discs.loads.Custom` and `discs.loads.Potential`.

A kernel calls them by their address. So all of them have one type, and a new function needs no new kernel: it is compiled alone.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import types
from numba.core.errors import NumbaError
from numpy.typing import NDArray

from discs.kernels import protocol as do
from discs.kernels.compiled import fill
from discs.kernels.load import Linear, book
from discs.kernels.shared import column

KEPT = 64  # functions whose compiled forms are kept in memory


class Functions(NamedTuple):
    """linear : the linear loads. w : (n,), shares of the discs. spent : that of `linear`.

    force : (w, t, q, v) -> (rows, n), power : (w, t, q, v) -> the rate of its work; arrays q and v are (rows, n).
    """

    linear: Linear
    w: NDArray
    force: Any
    power: Any
    spent: NDArray


@lru_cache(KEPT)
def of_force(force: Any, power: Any, per_length: bool) -> tuple[Any, Any]:
    """Force and power of a `Custom`, whose functions take (t, q, v); None for the power of all that the force does."""
    push = numba.njit((lambda w, t, q, v: w * force(t, q, v)) if per_length else (lambda w, t, q, v: force(t, q, v)))
    if power is None:
        return push, numba.njit(lambda w, t, q, v: np.sum(push(w, t, q, v) * v))
    return push, numba.njit((lambda w, t, q, v: np.sum(w * power(t, q, v))) if per_length else (lambda w, t, q, v: power(t, q, v)))


@lru_cache(KEPT)
def of_gradient(gradient: Any) -> tuple[Any, Any]:
    """Force and power of a `Potential`, which is part of the energy."""

    @numba.njit
    def force(w, t, q, v):
        f = np.zeros_like(q)
        x, y = gradient(q[0], q[1])
        f[0], f[1] = -w * x, -w * y
        return f

    return force, numba.njit(lambda w, t, q, v: 0.0)


def added(functions: tuple[Any, ...]) -> Any:
    """The sum of functions of (w, t, q, v)."""
    if len(functions) == 1:
        return functions[0]
    first, rest = functions[0], added(functions[1:])
    return numba.njit(lambda w, t, q, v: first(w, t, q, v) + rest(w, t, q, v))


SHARES, ROWS = types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C")
GIVEN = SHARES, types.float64, ROWS, ROWS


@lru_cache(KEPT)
def addresses(pairs: tuple[tuple[Any, Any], ...]) -> tuple[Any, Any] | None:
    """Sums of forces and of powers, as kernels call them. A force that raises, or of another shape, is NaN, which stops the run.

    None for functions that numba cannot compile, or that return something else.
    """
    try:
        return _compiled(pairs)
    except NumbaError:
        return None


def _compiled(pairs: tuple[tuple[Any, Any], ...]) -> tuple[Any, Any]:
    force, power = (added(functions) for functions in zip(*pairs, strict=True))

    @numba.cfunc(ROWS(*GIVEN))
    def forces(w, t, q, v):
        f = np.full_like(q, np.nan)
        try:
            found = force(w, t, q, v)
            if found.shape == q.shape:
                f[:] = found
        except Exception:
            f[:] = np.nan
        return f

    @numba.cfunc(types.float64(*GIVEN))
    def powers(w, t, q, v):
        total = np.nan
        try:
            total = 1.0 * power(w, t, q, v)
        except Exception:
            total = np.nan
        return total

    return forces, powers


@fill(do.loaded, Functions)
def _loaded(load):
    return True


@fill(do.driven, Functions)
def _driven(load):
    return do.driven(load.linear)


@fill(do.push, Functions, _nrt=True)
def _push(load, state, t, move, c, p, factor, g):
    do.push(load.linear, state, t, move, c, p, factor, g)
    q, v = np.empty(move.shape), np.empty(move.shape)
    for row in range(c.shape[0]):
        for i in range(c.shape[1]):
            q[row, i] = state.hi[row, i] + (state.lo[row, i] + move[row, i])
            v[row, i] = c[row, i] * p[column(row), i]
    f = load.force(load.w, t, q, v)
    for row in range(c.shape[0]):
        for i in range(c.shape[1]):
            g[column(row), i] += factor * c[row, i] * f[row, i]


@fill(do.hold, Functions)
def _hold(load, t, c, p, factor, g):
    do.hold(load.linear, t, c, p, factor, g)


@fill(do.guide, Functions)
def _guide(load, c, d, g, roll, roll_beside, turn, turn_beside):
    do.guide(load.linear, c, d, g, roll, roll_beside, turn, turn_beside)


@fill(do.stiffen, Functions)
def _stiffen(load, state, t, move, c, d, g, matrix):
    do.stiffen(load.linear, state, t, move, c, d, g, matrix)


@fill(do.spend, Functions, _nrt=True)
def _spend(load, state, t, weight, move, v, scale):
    if load.spent.size == 0:
        return
    do.spend(load.linear, state, t, weight, move, v, scale)
    q, rates = np.empty(move.shape), np.empty(move.shape)
    for row in range(v.shape[0]):
        for i in range(v.shape[1]):
            q[row, i] = state.hi[row, i] + (state.lo[row, i] + move[row, i])
            rates[row, i] = scale * v[row, i]
    book(load.spent, 0, weight * load.power(load.w, t, q, rates))


@fill(do.react, Functions)
def _react(load, gained, p):
    do.react(load.linear, gained, p)
