"""Peers with the multipliers among the unknowns: SUNDIALS' IDA, and the textbook's dense saddle point."""

import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np

from compare.peers import loads
from compare.peers.peer import TOLERANCES, Cutoff, Outcome, Peer
from compare.peers.reduced import banded, read_only
from discs import Problem
from discs.arrays import Float


def multiplier_peer(problem: Problem) -> Peer:
    """IDA on q. = v, M v. = f - grad V + A^T lambda, A(q) v = 0, with the multipliers as unknowns: index 2, banded, plain doubles.

    For slaved and own headings alike: A v = r. - e theta., two rows for each disc.
    """
    from sksundae.ida import IDA

    system = problem.system
    rows, n = len(system.rows), system.n
    width = 2 * rows + 2
    z = problem.start()
    shape = system.shape(z.hi)
    v0 = system.forward(system.basis(shape), z.pi)
    compiled = _residual(problem)

    def residual(t: float, y: Float, yp: Float, out: Float) -> None:
        calls[0] += 1
        if not calls[0] & 63 and clock.process_time() > until[0]:
            raise Cutoff
        compiled(t, y, yp, out)

    calls, until = [0], [np.inf]
    push = 0.0 if system.load is None else system.load.force(0.0, z.hi, v0)
    force = system.contact_force(shape, v0, push)
    acceleration = push - system.gradient(shape)
    acceleration[:2] += force
    e = system.contact(shape)
    acceleration[2] -= (e * force).sum(axis=0)
    acceleration /= system.weights
    y0 = np.concatenate([z.hi, v0, force]).T.ravel()
    yp0 = np.concatenate([v0, acceleration, np.zeros_like(force)]).T.ravel()
    compiled(0.0, read_only(y0), read_only(yp0), np.empty_like(y0))
    algebraic = np.arange(n * width).reshape(n, width)[:, 2 * rows :].ravel()
    allowed = np.ones((n, width))
    allowed[:, 2 * rows :] = 1e6  # multipliers of an index-2 system are not controlled
    options = banded(problem, (system.reach + 1) * width - 1)

    def run(rtol: float, seconds: float) -> Outcome:
        calls[0], until[0] = 0, clock.process_time() + seconds
        begun = clock.process_time()
        solver = IDA(
            residual, rtol=rtol, atol=0.01 * rtol * allowed.ravel(), algebraic_idx=algebraic, max_num_steps=10**8, **options
        )
        found = solver.solve(np.array([0.0, problem.duration]), y0, yp0)
        spent = clock.process_time() - begun
        if spent > seconds:
            raise Cutoff
        if not found.success:
            raise ArithmeticError(str(found.message))
        return Outcome(found.y[-1].reshape(n, width).T[:rows], 0, calls[0], int(found.njev or 0), spent)

    return Peer("IDA, multipliers", TOLERANCES[:7], run, "index 2; errors of the multipliers are not controlled")


def _residual(problem: Problem) -> Callable[[float, Float, Float, Float], None]:
    """The residual of the multiplier form, (t, y, y., out), compiled for one chain and its loads."""
    from discs.kernels import protocol as do
    from discs.kernels.compiled import jit

    system, chain = problem.system, problem.system.parameters
    rows, n = len(system.rows), system.n
    weights, width = np.array(system.weights), 2 * len(system.rows) + 2
    load: Any = system.load
    push = loads.pull(load, jit)

    @jit
    def residual(t, y, yp, out):  # type: ignore[no-untyped-def]
        work = do.workspace(chain)
        q, still, g, c = np.empty((rows, n)), np.zeros((rows, n)), np.empty((rows, n)), np.empty((rows, n))
        v = np.empty((rows, n))
        for i in range(n):
            for row in range(rows):
                q[row, i], v[row, i] = y[width * i + row], y[width * i + rows + row]
        do.settle(chain, work, q, still)
        do.basis(chain, work, still, c)
        do.gradient(chain, work, still, g)
        push(t, q, v, g)
        for i in range(n):
            at = width * i
            ex, ey = c[0, i] / c[2, i], c[1, i] / c[2, i]
            fx, fy = y[at + 2 * rows], y[at + 2 * rows + 1]
            for row in range(rows):
                out[at + row] = yp[at + row] - y[at + rows + row]
                out[at + rows + row] = weights[row, i] * yp[at + rows + row] + g[row, i]
            out[at + rows] -= fx
            out[at + rows + 1] -= fy
            out[at + rows + 2] += ex * fx + ey * fy
            omega = y[at + rows + 2]
            out[at + 2 * rows] = y[at + rows] - ex * omega
            out[at + 2 * rows + 1] = y[at + rows + 1] - ey * omega

    return residual


def saddle_peer(problem: Problem) -> Peer:
    """The textbook method: DOP853, with the dense saddle point [[M, A^T], [A, 0]] solved at every right-hand side."""
    from scipy.integrate import solve_ivp

    system = problem.system
    rows, n = len(system.rows), system.n
    size = rows * n
    z = problem.start()
    v0 = system.forward(system.basis(system.shape(z.hi)), z.pi)
    calls, until = [0], [np.inf]
    disc = np.arange(n)

    def f(t: float, y: Float) -> Float:
        calls[0] += 1
        if clock.process_time() > until[0]:
            raise Cutoff
        q, v = y[:size].reshape(rows, n), y[size:].reshape(rows, n)
        shape = system.shape(q)
        e, turning = system.contact(shape), system.contact_rate(shape, v)
        matrix = np.zeros((size + 2 * n, size + 2 * n))
        matrix[np.arange(size), np.arange(size)] = system.weights.ravel()
        for side in range(2):
            row = size + side * n + disc
            matrix[row, side * n + disc] = 1.0
            matrix[row, 2 * n + disc] = -e[side]
        matrix[:size, size:] = matrix[size:, :size].T
        push = 0.0 if system.load is None else system.load.force(t, q, v)
        right = np.concatenate([(push - system.gradient(shape)).ravel(), (turning * v[2]).ravel()])
        return np.concatenate([y[size:], np.linalg.solve(matrix, right)[:size]])

    def run(rtol: float, seconds: float) -> Outcome:
        calls[0], until[0] = 0, clock.process_time() + seconds
        begun = clock.process_time()
        y0 = np.concatenate([z.hi.ravel(), v0.ravel()])
        found = solve_ivp(f, (0.0, problem.duration), y0, "DOP853", t_eval=(problem.duration,), rtol=rtol, atol=rtol)
        spent = clock.process_time() - begun
        if not found.success:
            raise ArithmeticError(found.message)
        return Outcome(found.y[:size, -1].reshape(rows, n), found.nfev // 12, calls[0], calls[0], spent)

    return Peer("saddle point, DOP853", TOLERANCES[:5], run, "NumPy, dense; index-1 form, so the constraint drifts")
