r"""Compiled: steps back along a run, which take the derivative of a cost from the state after each step to the state before it.

`discs.analysis.adjoint` has the equations. With the matrices A_j at the stages (`discs.kernels.linearised`) the multipliers obey

    M_i = h b_i w + h sum_j a_ji A_j^T M_j,   A^T (mu, nu) = (N^T m - S C nu - P^T nu, C^T m),   m = mu - D^T C nu.

A sweep takes what N and P do from the last one, finds mu, and corrects nu by the matrices of the step itself, factored once.
"""

import numpy as np

from discs.kernels.compiled import kernel, part
from discs.kernels.interrupts import interrupted
from discs.kernels.linearised import (
    SWEEPS,
    across,
    added,
    linearise,
    prepare,
    remaining,
    replaced,
    shifted,
    solve,
    stages,
    stiffened,
    turn_back,
    weigh,
)
from discs.kernels.shared import back as gather
from discs.kernels.shared import copy, forward


@part
def guess(rule, h, value, late, later, ahead, to):
    """A first guess of multipliers: h b w, and what else there was in the last step; with `ahead` = 1 as in the last two steps."""
    for i in range(to.shape[0]):
        for row in range(to.shape[1]):
            weight, v, one, two, out = h * rule.b[i], value[row], late[i, row], later[i, row], to[i, row]
            for k in range(out.size):
                out[k] = weight * v[k] + one[k] + ahead * (one[k] - two[k])


@part
def total(a, b, to):
    """to = a + b, (rows, n)."""
    for row in range(to.shape[0]):
        x, y, out = a[row], b[row], to[row]
        for k in range(out.size):
            out[k] = x[k] + y[k]


@part
def combined(rule, h, value, x, pulled, to):
    """to_i = h b_i w + h sum_j a_ji (x_j - pulled_j)."""
    for i in range(to.shape[0]):
        for row in range(to.shape[1]):
            weight, a, v, plus, less, out = h * rule.b[i], h * rule.a[0, i], value[row], x[0, row], pulled[0, row], to[i, row]
            for k in range(out.size):
                out[k] = weight * v[k] + a * (plus[k] - less[k])
            for j in range(1, to.shape[0]):
                a, plus, less = h * rule.a[j, i], x[j, row], pulled[j, row]
                for k in range(out.size):
                    out[k] += a * (plus[k] - less[k])


@part
def remainder(rule, h, value, y, nu, to):
    """to_i = h b_i w + h sum_j a_ji y_j - nu_i."""
    for i in range(to.shape[0]):
        for row in range(to.shape[1]):
            weight, a, v, plus, less, out = h * rule.b[i], h * rule.a[0, i], value[row], y[0, row], nu[i, row], to[i, row]
            for k in range(out.size):
                out[k] = weight * v[k] + a * plus[k] - less[k]
            for j in range(1, to.shape[0]):
                a, plus = h * rule.a[j, i], y[j, row]
                for k in range(out.size):
                    out[k] += a * plus[k]


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
    mu, new, x, m = np.empty((s, rows, n)), np.empty((s, rows, n)), np.zeros((s, rows, n)), np.empty((s, rows, n))
    nu, rest, change, y = np.empty((s, columns, n)), np.empty((s, columns, n)), np.empty((s, columns, n)), np.empty((s, columns, n))
    own, pulled, dragged = np.empty((s, rows, n)), np.empty((s, rows, n)), np.zeros((s, rows, n))
    late_q, later_q = np.zeros((s, rows, n)), np.zeros((s, rows, n))
    late_p, later_p = np.zeros((s, columns, n)), np.zeros((s, columns, n))
    damped = given.drag.data.size > 0
    for k in range(steps - 1, -1, -1):
        if interrupted(20 * s * value.size):
            return -1
        if place[k] >= 0:
            for i in range(value.size):
                value[i] += seeds[place[k], i]
        linearise(rule, chain, given, at, q[k], p[k], k * s)
        prepare(rule, chain, at, h, t + k * h, q[k], p[k])
        ahead = 1.0 if steps - 1 - k > 1 else 0.0
        guess(rule, h, value_q, late_q, later_q, ahead, mu)
        guess(rule, h, value_p, late_p, later_p, ahead, nu)
        for j in range(s):
            forward(at.c[j], nu[j], own[j])
            stiffened(chain, given, at, j, own[j], pulled[j])
        sweep, off, left = 0, np.inf, np.inf
        while sweep < SWEEPS and left > tolerance:
            for j in range(s):
                if damped:
                    dragged[j] = 0.0
                    across(given.drag, own[j], -1.0, dragged[j])
                    total(mu[j], dragged[j], m[j])
                x[j] = 0.0
                turn_back(chain, at, j, m[j] if damped else mu[j], nu[j], x[j])
            combined(rule, h, value_q, x, pulled, new)
            for j in range(s):
                if damped:
                    total(new[j], dragged[j], m[j])
                gather(at.c[j], m[j] if damped else new[j], y[j])
            remainder(rule, h, value_p, y, nu, rest)
            solve(rule, chain, True, at, rest, change)
            last, off = off, added(change, nu)
            for j in range(s):  # what that does to mu
                forward(at.c[j], nu[j], own[j])
                stiffened(chain, given, at, j, own[j], pulled[j])
            combined(rule, h, value_q, x, pulled, new)
            off = max(off, replaced(new, mu))
            left = remaining(last, off)
            sweep += 1
        if not (left <= tolerance and np.isfinite(nu.sum())):
            return steps - 1 - k
        for j in range(s):
            if sums.size > 0:
                copy(mu[j], m[j])
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
