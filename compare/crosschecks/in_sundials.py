"""SUNDIALS: IDA on the differential-algebraic equations with multipliers, CVODE on the reduced ones.

* IDA: q. = v, M v. = -grad V + A^T lambda, 0 = A v; index 2, dense, in NumPy. Its own errors of multipliers are not controlled,
  as those of an index-2 system of variable order are not.
* CVODE: q. = C u, and u. from (C^T M C) u. = -C^T (grad V + M C. u), with u = theta.(, phi.): rates, where ours has momenta.
"""

from typing import Any

import numpy as np
from sksundae.cvode import CVODE
from sksundae.ida import IDA

from compare.crosschecks.both import compared, largest, ours, start, terms, timed
from compare.crosschecks.in_scipy import saddle
from compare.crosschecks.stated import Stated
from compare.crosschecks.table import Row, order
from discs.arrays import Float


def with_multipliers(stated: Stated, rtol: float) -> tuple[Float, Float]:
    """q (rows, n) and multipliers (2, n) at the end, by IDA."""
    t, n, size, mass = terms(stated), stated.n, stated.q0.size, stated.inertia.ravel()

    def residual(time: float, y: Float, yp: Float, out: Float) -> None:
        q, v, force = np.split(y.copy(), (size, 2 * size))
        force = force.reshape(2, n)
        e = t.arms(q)
        out[:size] = yp[:size] - v
        push = -t.gradient(q)
        push[: 2 * n] += force.ravel()
        push[2 * n : 3 * n] -= (e * force).sum(axis=0)
        out[size : 2 * size] = mass * yp[size : 2 * size] - push
        out[2 * size :] = v[: 2 * n] - (e * v[2 * n : 3 * n]).ravel()

    y0 = start(stated)
    acceleration, force = saddle(stated)(y0[:size], y0[size:])
    allowed = np.ones(2 * size + 2 * n)
    allowed[2 * size :] = 1e6
    solver = IDA(residual, rtol=rtol, atol=rtol * allowed, algebraic_idx=2 * size + np.arange(2 * n), max_num_steps=10**6)
    begin = np.concatenate([y0, force.ravel()]), np.concatenate([y0[size:], acceleration, 0 * force.ravel()])
    found = solver.solve(np.array([0.0, stated.duration]), *begin)
    if not found.success:
        raise ArithmeticError(str(found.message))
    return found.y[-1, :size].reshape(-1, n), found.y[-1, 2 * size :].reshape(2, n)


def reduced(stated: Stated, rtol: float, **options: Any) -> Float:
    """q (rows, n) at the end, by CVODE."""
    t, n, size = terms(stated), stated.n, stated.q0.size
    mass = stated.inertia

    def rate(time: float, y: Float, out: Float) -> None:
        q, u = y[:size].copy(), y[size:].reshape(-1, n)
        e = t.arms(q)
        v = np.concatenate([e * u[0], u])
        gradient, turning = t.gradient(q).reshape(-1, n), t.turning(q, v.ravel())
        out[:size] = v.ravel()
        pull = -gradient[2] - (e * (gradient[:2] + mass[:2] * turning * u[0])).sum(axis=0)
        out[size : size + n] = pull / (mass[2] + mass[0] * (e**2).sum(axis=0))
        out[size + n :] = (-gradient[3:] / mass[3:]).ravel()

    solver = CVODE(rate, rtol=rtol, atol=rtol, max_num_steps=10**6, **options)
    found = solver.solve(np.array([0.0, stated.duration]), np.concatenate([stated.q0.ravel(), stated.u0.ravel()]))
    if not found.success:
        raise ArithmeticError(str(found.message))
    return np.asarray(found.y[-1, :size].reshape(-1, n))


def rows() -> list[Row]:
    """IDA with its multipliers and CVODE's Adams for three laws."""
    return [row for law in ("field", "unit", "own") for row in _rows(Stated(law, 6))]


def _rows(stated: Stated) -> list[Row]:
    loose = (1e-4, 1e-5, 1e-6, 1e-7)
    (q, force), ida = timed(with_multipliers, stated, 1e-9)
    first = order(loose, [largest(stated, *with_multipliers(stated, rtol)) for rtol in loose])
    both = compared(stated, q, force)
    q, adams = timed(reduced, stated, 1e-12, method="Adams")
    second = order(loose, [float(np.abs(reduced(stated, rtol, method="Adams") - ours(stated).q).max()) for rtol in loose])
    cases = (
        ("IDA", both, first, ida, "index 2, dense, in NumPy"),
        ("CVODE Adams", compared(stated, q), second, adams, "rates for momenta, in NumPy"),
    )
    return [
        Row(f"scikit-sundae {name}", **fields, order=f"{slope:.1f} in the tolerance", their_seconds=seconds, differs=differs)
        for name, fields, slope, seconds, differs in cases
    ]
