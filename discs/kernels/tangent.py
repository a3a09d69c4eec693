r"""Compiled: the tangent of a step by sweeps; `discs.analysis.tangent` has the equations, `discs.kernels.adjoint` the transpose.

With the matrices A_j at the stages (`discs.kernels.linearised`) the changes of the stages obey

    Y_i = y + h sum_j a_ij A_j Y_j,   A (dq, dpi) = (v, -C^T (S dq + D v) - P dq),   v = N dq + C dpi.

A sweep takes what N and P do from the last one, finds dq, and corrects dpi by the matrices of the step itself, factored once.
"""

import numpy as np

from discs.integrators.collocation import combine
from discs.kernels.compiled import kernel
from discs.kernels.linearised import (
    SWEEPS,
    added,
    gather,
    linearise,
    prepare,
    replaced,
    shifted,
    solve,
    stages,
    stiffened,
    times,
    turn,
)
from discs.kernels.shared import copy, forward


@kernel
def tangent(rule, chain, given, h, t, q, p, tolerance, dy):
    """dy (m, size): changes of the state before a step h from the time t become those after it.

    q (s, rows, n), p (s, columns, n) : the stages of the step. Returns whether all sweeps converged.
    """
    s, rows, n = q.shape
    columns = p.shape[1]
    at = stages(rule, chain, rows, columns)
    dq, new, v, moved = np.empty((s, rows, n)), np.empty((s, rows, n)), np.empty((s, rows, n)), np.empty((s, rows, n))
    dpi, pulled, rest = np.empty((s, columns, n)), np.empty((s, columns, n)), np.empty((s, columns, n))
    change, force, push = np.empty((s, columns, n)), np.empty((rows, n)), np.empty((columns, n))
    linearise(rule, chain, given, at, q, p, 0)
    prepare(rule, chain, at, h, t, q, p)
    for k in range(dy.shape[0]):
        start_q, start_p = dy[k, : rows * n].reshape(rows, n), dy[k, rows * n :].reshape(columns, n)
        for j in range(s):
            copy(start_q, dq[j])
            copy(start_p, dpi[j])
            moved[j], pulled[j] = 0.0, 0.0
            turn(chain, at, j, dq[j], moved[j], pulled[j])
        sweep, off = 0, np.inf
        while sweep < SWEEPS and off > tolerance:
            for j in range(s):
                forward(at.c[j], dpi[j], v[j])
                shifted(moved[j], 1.0, v[j])
            for i in range(s):
                combine(rule.a[i], v, h, new[i])
                shifted(start_q, 1.0, new[i])
            for j in range(s):
                pulled[j], moved[j] = 0.0, 0.0
                turn(chain, at, j, new[j], moved[j], pulled[j])
                stiffened(chain, given, at, j, new[j], force)
                forward(at.c[j], dpi[j], v[j])
                shifted(moved[j], 1.0, v[j])
                times(given.drag, v[j], 1.0, force)
                gather(at.c[j], force, push)
                shifted(push, -1.0, pulled[j])
            for i in range(s):
                combine(rule.a[i], pulled, h, rest[i])
                shifted(start_p, 1.0, rest[i])
                shifted(dpi[i], -1.0, rest[i])
            solve(rule, chain, False, at, rest, change)
            off = added(change, dpi)
            for j in range(s):  # what that does to dq
                forward(at.c[j], change[j], v[j])
            for i in range(s):
                combine(rule.a[i], v, h, force)
                shifted(force, 1.0, new[i])
            for j in range(s):
                moved[j], pulled[j] = 0.0, 0.0
                turn(chain, at, j, new[j], moved[j], pulled[j])
            off = max(off, replaced(new, dq))
            sweep += 1
        if not (off <= tolerance and np.isfinite(dpi.sum())):
            return False
        share = 1.0 - rule.last.sum()
        for row in range(rows):
            for i in range(n):
                start_q[row, i] *= share
        for row in range(columns):
            for i in range(n):
                start_p[row, i] *= share
        for j in range(s):
            shifted(dq[j], rule.last[j], start_q)
            shifted(dpi[j], rule.last[j], start_p)
    return True
