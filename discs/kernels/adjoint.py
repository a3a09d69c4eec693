r"""Compiled: steps back along a run, which take the derivative of a cost from the state after each step to the state before it.

`discs.analysis.adjoint` has the equations. With the matrices A_j at the stages (`discs.kernels.linearised`) the multipliers obey

    M_i = h b_i w + h sum_j a_ji A_j^T M_j,   A^T (mu, nu) = (N^T m - S C nu - P^T nu, C^T m),   m = mu - D^T C nu.

A sweep takes what N and P do from the last one, finds mu, and corrects nu by the matrices of the step itself, factored once.
"""

import numpy as np

from discs.integrators.collocation import combine
from discs.kernels.compiled import kernel
from discs.kernels.interrupts import interrupted
from discs.kernels.linearised import (
    SWEEPS,
    across,
    added,
    gather,
    linearise,
    prepare,
    replaced,
    shifted,
    solve,
    stages,
    stiffened,
    turn_back,
    weigh,
)
from discs.kernels.shared import copy, forward


@kernel
def back(rule, chain, given, h, t, q, p, tolerance, seeds, place, value, sums, v, w):
    """Take a derivative `value` (size,) with respect to the state back through steps of size h, the first one from the time t.

    q (steps, s, rows, n), p (steps, s, columns, n) : their stages. After step k the row place[k] of `seeds`, if that is not
    negative, is added to the value first. sums : (4, n), see `linearised.weigh`, added up. v, w : (steps, s, rows, n) or without
    entries, C pi and C nu of the stages.

    Returns how many steps were taken, from the last one on: fewer than all before one whose sweeps do not converge, whose seed is
    added; -1 after Ctrl-C.
    """
    steps, s, rows, n = q.shape
    columns = p.shape[2]
    at = stages(rule, chain, rows, columns)
    value_q, value_p = value[: rows * n].reshape(rows, n), value[rows * n :].reshape(columns, n)
    mu, new, x, m, own = (
        np.zeros((s, rows, n)),
        np.empty((s, rows, n)),
        np.empty((s, rows, n)),
        np.empty((s, rows, n)),
        np.empty((s, rows, n)),
    )
    nu, rest, change, y = np.zeros((s, columns, n)), np.empty((s, columns, n)), np.empty((s, columns, n)), np.empty((s, columns, n))
    pulled, force, dragged, damped = np.empty((s, rows, n)), np.empty((rows, n)), np.zeros((s, rows, n)), given.drag.data.size > 0
    late_q, later_q = np.zeros((s, rows, n)), np.zeros((s, rows, n))
    late_p, later_p = np.zeros((s, columns, n)), np.zeros((s, columns, n))
    for k in range(steps - 1, -1, -1):
        if interrupted(20 * s * value.size):
            return -1
        if place[k] >= 0:
            for i in range(value.size):
                value[i] += seeds[place[k], i]
        linearise(rule, chain, given, at, q[k], p[k], k * s)
        prepare(rule, chain, at, h, t + k * h, q[k], p[k])
        ahead = 1.0 if steps - 1 - k > 1 else 0.0
        for i in range(s):  # a first guess: what the stages add to h b w, as in the last steps
            for row in range(rows):
                for disc in range(n):
                    guess = (1.0 + ahead) * late_q[i, row, disc] - ahead * later_q[i, row, disc]
                    mu[i, row, disc] = h * rule.b[i] * value_q[row, disc] + guess
            for row in range(columns):
                for disc in range(n):
                    guess = (1.0 + ahead) * late_p[i, row, disc] - ahead * later_p[i, row, disc]
                    nu[i, row, disc] = h * rule.b[i] * value_p[row, disc] + guess
        for j in range(s):
            forward(at.c[j], nu[j], own[j])
            stiffened(chain, given, at, j, own[j], pulled[j])
        sweep, off = 0, np.inf
        while sweep < SWEEPS and off > tolerance:
            for j in range(s):
                if damped:
                    dragged[j] = 0.0
                    across(given.drag, own[j], -1.0, dragged[j])
                for row in range(rows):
                    for i in range(n):
                        m[j, row, i] = mu[j, row, i] + dragged[j, row, i]
                        x[j, row, i] = -pulled[j, row, i]
                turn_back(chain, at, j, m[j], nu[j], x[j])
            for i in range(s):
                combine(rule.a[:, i], x, h, new[i])
                shifted(value_q, h * rule.b[i], new[i])
            for j in range(s):
                copy(new[j], m[j])
                if damped:
                    shifted(dragged[j], 1.0, m[j])
                gather(at.c[j], m[j], y[j])
            for i in range(s):
                combine(rule.a[:, i], y, h, rest[i])
                shifted(value_p, h * rule.b[i], rest[i])
                shifted(nu[i], -1.0, rest[i])
            solve(rule, chain, True, at, rest, change)
            off = added(change, nu)
            for j in range(s):  # what that does to mu
                forward(at.c[j], nu[j], own[j])
                stiffened(chain, given, at, j, own[j], force)
                for row in range(rows):
                    for i in range(n):
                        x[j, row, i] += pulled[j, row, i] - force[row, i]
                        pulled[j, row, i] = force[row, i]
            for i in range(s):
                combine(rule.a[:, i], x, h, new[i])
                shifted(value_q, h * rule.b[i], new[i])
            off = max(off, replaced(new, mu))
            sweep += 1
        total = 0.0
        for i in range(s):
            for row in range(columns):
                for disc in range(n):
                    total += nu[i, row, disc]
        if not (off <= tolerance and np.isfinite(total)):
            return steps - 1 - k
        for j in range(s):
            if sums.size > 0:
                copy(mu[j], m[j])
                if damped:
                    across(given.drag, own[j], -1.0, m[j])
                weigh(chain, at, j, m[j], nu[j], p[k, j], sums)
            if w.size > 0:
                copy(own[j], w[k, j])
                copy(at.v[j], v[k, j])
        later_q[:], later_p[:] = late_q, late_p
        for i in range(s):
            copy(mu[i], late_q[i])
            copy(nu[i], late_p[i])
            shifted(value_q, -h * rule.b[i], late_q[i])
            shifted(value_p, -h * rule.b[i], late_p[i])
        for i in range(s):
            share = rule.inverse[i].sum() / h
            shifted(late_q[i], share, value_q)
            shifted(late_p[i], share, value_p)
    return steps
