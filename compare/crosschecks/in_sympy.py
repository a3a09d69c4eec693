"""SymPy's own equations of motion: `LagrangesMethod` with its multipliers, and `KanesMethod` with rigid bodies.

* Lagrange: L = T - V of all coordinates and (x., y.) - e theta. = 0 as nonholonomic constraints. SymPy derives mass matrix and
  right-hand side, multipliers included.
* Kane: discs as rigid bodies whose frames turn about the vertical and the axle, springs as forces and torques on them. theta. (and
  phi.) are the independent speeds, x. and y. the dependent ones; no multipliers.

Both are compared with our accelerations and forces of the ground at the end of a run, and integrated from the start by DOP853.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp
from sympy.physics import mechanics as me

from compare.crosschecks.both import compared, start, timed
from compare.crosschecks.stated import Stated
from compare.crosschecks.table import Row
from discs.arrays import Float

Linear = Callable[[Float], tuple[Float, Float]]  # y = (q, v) -> matrix and right-hand side


def _symbols(stated: Stated) -> tuple[list[list[Any]], list[list[Any]]]:
    """Coordinates and their rates by rows, functions of time."""
    q = [[me.dynamicsymbols(f"{row}{i}") for i in range(stated.n)] for row in stated.rows]
    return q, [[c.diff(me.dynamicsymbols._t) for c in row] for row in q]


def _flat(rows: list[list[Any]]) -> list[Any]:
    return [entry for row in rows for entry in row]


def lagrange(stated: Stated) -> Linear:
    """Matrix and right-hand side for (q., v., lambda) by SymPy's LagrangesMethod."""
    q, v = _symbols(stated)
    flat, rates = _flat(q), _flat(v)
    kinetic = sum(sp.Float(m) * u**2 / 2 for m, u in zip(stated.inertia.ravel(), rates, strict=True))
    e = stated.arms(q, sp)
    rolling = [v[side][i] - e[side][i] * v[2][i] for side in range(2) for i in range(stated.n)]
    method = me.LagrangesMethod(kinetic - stated.potential(q, sp), flat, nonhol_coneqs=rolling)
    method.form_lagranges_equations()
    return _numbers(flat, rates, method.mass_matrix_full, method.forcing_full)


def kane(stated: Stated) -> Linear:
    """Matrix and right-hand side for (q., v.) by SymPy's KanesMethod, speeds ordered as coordinates."""
    q, v = _symbols(stated)
    n, own = stated.n, stated.law == "own"
    u = [[me.dynamicsymbols(f"u_{row}{i}") for i in range(n)] for row in stated.rows]
    ground, origin = me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(ground, 0)
    potential, e = stated.potential(q, sp), stated.arms(q, sp)
    bodies, loads = [], []
    for i in range(n):
        upright = ground.orientnew(f"A{i}", "Axis", (q[3][i] if own else 0, ground.z))
        disc = upright.orientnew(f"B{i}", "Axis", (-q[2][i], upright.x))  # rolls along y of its frame
        upright.set_ang_vel(ground, (u[3][i] if own else 0) * ground.z)
        disc.set_ang_vel(upright, -u[2][i] * upright.x)
        centre = origin.locatenew(f"P{i}", q[0][i] * ground.x + q[1][i] * ground.y)
        centre.set_vel(ground, u[0][i] * ground.x + u[1][i] * ground.y)
        mass, spin = map(sp.Float, stated.inertia[[0, 2], i])
        turn = sp.Float(stated.inertia[3, i]) if own else spin
        inertia = me.inertia(upright, spin, turn, turn), centre
        bodies.append(me.RigidBody(f"disc{i}", centre, disc, mass, inertia))
        force = -potential.diff(q[0][i]) * ground.x - potential.diff(q[1][i]) * ground.y
        torque = potential.diff(q[2][i]) * upright.x - (potential.diff(q[3][i]) if own else 0) * ground.z
        loads += [(centre, force), (disc, torque)]
    dependent = [*u[0], *u[1]]
    rolling = [u[side][i] - e[side][i] * u[2][i] for side in range(2) for i in range(n)]
    method = me.KanesMethod(
        ground,
        q_ind=_flat(q),
        u_ind=_flat(u[2:]),
        u_dependent=dependent,
        kd_eqs=[a - b for a, b in zip(_flat(v), _flat(u), strict=True)],
        velocity_constraints=rolling,
    )
    method.kanes_equations(bodies, loads)
    matrix, right = method.mass_matrix_full, method.forcing_full
    # SymPy has the independent speeds first; ours has x. and y. first
    size = n * len(q)
    place = {speed: j for j, speed in enumerate([*_flat(u[2:]), *dependent])}
    columns = [*range(size), *(size + place[speed] for speed in _flat(u))]
    return _numbers(_flat(q), _flat(u), matrix[:, columns], right)


def _numbers(q: list[Any], v: list[Any], matrix: Any, right: Any) -> Linear:
    """Functions of NumPy, by names that stand for rates first."""
    plain = sp.symbols(f"c:{len(q)}"), sp.symbols(f"w:{len(v)}")
    by_name = dict(zip(v, plain[1], strict=True)), dict(zip(q, plain[0], strict=True))
    both = sp.Matrix.hstack(matrix, right)
    for names in by_name:
        both = both.xreplace(names)
    f = sp.lambdify([plain[0], plain[1]], both, "numpy", cse=True)

    def numbers(y: Float) -> tuple[Float, Float]:
        found = f(y[: len(q)], y[len(q) :])
        return found[:, :-1], found[:, -1]

    return numbers


def solved(linear: Linear, y: Float) -> Float:
    """(q., v.), and the multipliers where there are any."""
    matrix, right = linear(y)
    return np.asarray(np.linalg.solve(matrix, right))


def at_the_end(stated: Stated, linear: Linear) -> Float:
    """(q, v) at the end, by DOP853."""
    y0 = start(stated)
    end = solve_ivp(lambda t, y: solved(linear, y)[: y0.size], (0.0, stated.duration), y0, "DOP853", rtol=1e-13, atol=1e-13)
    if not end.success:
        raise ArithmeticError(end.message)
    return np.asarray(end.y[:, -1])


CASES = Stated("own", 2), Stated("field", 3), Stated("unit", 3), Stated("field", 4)


def rows(cases: tuple[Stated, ...] = CASES) -> list[Row]:
    """Trajectories by both, multipliers by Lagrange's."""
    found = []
    for stated in cases:
        for name, derive in (("LagrangesMethod", lagrange), ("KanesMethod", kane)):
            linear = derive(stated)
            y, seconds = timed(at_the_end, stated, linear)
            size = stated.q0.size
            multipliers = solved(linear, y)[2 * size :].reshape(2, -1) if derive is lagrange else None
            fields = compared(stated, y[:size].reshape(stated.q0.shape), multipliers)
            differs = "its own equations, DOP853" if multipliers is not None else "rigid bodies, its own equations, DOP853"
            found.append(Row(f"SymPy {name}", **fields, their_seconds=seconds, differs=differs))
    return found
