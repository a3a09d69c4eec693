"""CasADi in the manner of Modelica: the equations as they stand, its index reduction, and its integrators.

CasADi gets x_impl = (q, v), algebraic variables lambda, and the residuals q. = v, M v. = -grad V + A^T lambda, 0 = A v, of index 2.
`dae_reduce_index` differentiates what must be and adds Baumgarte's terms, `dae_map_semi_expl` makes a semi-explicit system, and
SUNDIALS' IDAS or collocation (Legendre, 2 points, order 4) integrates it. No derivative is ours.
"""

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from compare.crosschecks.both import compared, largest, ours, start, timed
from compare.crosschecks.in_scipy import saddle
from compare.crosschecks.stated import Stated
from compare.crosschecks.table import Row, order
from discs.arrays import Float

POLE = -1.0  # of Baumgarte's terms


class Reduced(NamedTuple):
    """A semi-explicit system of index 1, and the start (x, z) of it; the map from it to (q, v, lambda)."""

    dae: dict[str, Any]
    x0: Float
    z0: Float
    back: Any


def reduced(stated: Stated) -> Reduced:
    """The statement with its index reduced by CasADi."""
    n, size = stated.n, stated.q0.size
    q, v, force = ca.SX.sym("q", size), ca.SX.sym("v", size), ca.SX.sym("f", 2 * n)
    rates, t = ca.SX.sym("d", 2 * size), ca.SX.sym("t")
    by_row = [[q[n * row + i] for i in range(n)] for row in range(len(stated.rows))]
    e = ca.vertcat(*stated.arms(by_row, ca)[0], *stated.arms(by_row, ca)[1])
    rolling = v[: 2 * n] - e * ca.repmat(v[2 * n : 3 * n], 2, 1)
    push = -ca.gradient(stated.potential(by_row, ca), q) + ca.mtimes(ca.jacobian(rolling, v).T, force)
    residual = ca.vertcat(rates[:size] - v, ca.DM(stated.inertia.ravel()) * rates[size:] - push, rolling)
    given = {"x_impl": ca.vertcat(q, v), "dx_impl": rates, "z": force, "alg": residual, "t": t}
    lower, found = ca.dae_reduce_index(given, {"baumgarte_pole": POLE})
    if found["index"] != 2:
        raise ArithmeticError(f"CasADi finds index {found['index']}, not 2")
    explicit, back, _ = ca.dae_map_semi_expl(given, lower)
    names = explicit["x"], explicit["z"]
    y0 = start(stated)
    acceleration, first = saddle(stated)(y0[:size], y0[size:])
    values = dict(zip(map(str, ca.vertsplit(given["x_impl"])), y0, strict=True))
    values |= dict(zip(map(str, ca.vertsplit(rates)), np.concatenate([y0[size:], acceleration]), strict=True))
    values |= dict(zip(map(str, ca.vertsplit(force)), first.ravel(), strict=True))
    x0, z0 = (np.array([values[str(c)] for c in ca.vertsplit(part)]) for part in names)
    return Reduced(explicit, x0, z0, back)


def rows() -> list[Row]:
    """IDAS with the multipliers, and collocation, whose multipliers are not those of the end, for three laws."""
    return [row for law in ("field", "unit", "own") for row in _rows(Stated(law, 6))]


def _rows(stated: Stated) -> list[Row]:
    system, n, size = reduced(stated), stated.n, stated.q0.size

    def run(name: str, options: dict[str, Any]) -> tuple[Float, Float, float]:
        integrate = ca.integrator("run", name, system.dae, 0.0, stated.duration, options)
        got, seconds = timed(integrate, x0=system.x0, z0=system.z0)
        y = system.back(xf=got["xf"], zf=got["zf"])
        return np.array(y["x_impl"])[:size].reshape(-1, n), np.array(y["z"]).reshape(2, n), seconds

    def idas(tol: float) -> tuple[Float, Float, float]:
        return run("idas", {"reltol": tol, "abstol": tol, "max_num_steps": 10**6})

    def collocation(steps: int) -> tuple[Float, Float, float]:
        points = {"interpolation_order": 2, "collocation_scheme": "legendre", "rootfinder": "newton"}
        return run("collocation", {"number_of_finite_elements": steps, **points})

    differs = "index reduced from 2 by CasADi"
    loose = (1e-5, 1e-6, 1e-7, 1e-8)
    slope = f"{order(loose, [largest(stated, *idas(tol)[:2]) for tol in loose]):.1f} in the tolerance"
    q, force, seconds = idas(1e-11)
    found = [Row("CasADi IDAS", **compared(stated, q, force), order=slope, their_seconds=seconds, differs=differs)]
    steps = np.array([200, 400, 800])
    ends = [collocation(count) for count in steps]
    errors = [float(np.abs(q - ours(stated).q).max()) for q, _, _ in ends]
    slope = f"{order(stated.duration / steps, errors):.1f} in the step"
    q, _, seconds = ends[-1]
    return [*found, Row("CasADi collocation", **compared(stated, q), order=slope, their_seconds=seconds, differs=differs)]
