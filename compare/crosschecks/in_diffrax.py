"""diffrax: the reduced equations in JAX, all derivatives by JAX.

With v = C(q) u, u = theta.(, phi.), the equations are C^T (M d/dt(C u) + grad V) = 0: V is differentiated by `jax.grad`, C u along
the motion by `jax.jvp`. Orders are measured with equal steps, against the finest of them, as the finest has smaller errors than
our result.
"""

from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from compare.crosschecks.both import compared, timed
from compare.crosschecks.stated import Stated
from compare.crosschecks.table import Row, order
from discs.arrays import Float


def rows() -> list[Row]:
    """Tsit5 and Dopri8 for three laws."""
    jax.config.update("jax_enable_x64", True)
    return [row for law in ("field", "unit", "own") for row in _rows(Stated(law, 6))]


def _rows(stated: Stated) -> list[Row]:
    rows, mass = len(stated.rows), jnp.asarray(stated.inertia)

    def rate(t: Any, y: Any, _: Any) -> jax.Array:
        q, u = y[:rows], y[rows:]

        def velocity(q: Any, u: Any) -> jax.Array:
            e = jnp.stack([jnp.stack(side) for side in stated.arms(q, jnp)])
            return jnp.concatenate([e * u[0], u])

        v = velocity(q, u)
        e = velocity(q, jnp.ones_like(u))[:2]
        turning = jax.jvp(lambda q: velocity(q, u), (q,), (v,))[1]
        force = -jax.grad(lambda q: stated.potential(q, jnp))(q) - mass * turning
        pull = [(force[2] + (e * force[:2]).sum(axis=0)) / (mass[2] + mass[0] * (e**2).sum(axis=0)), *(force[3:] / mass[3:])]
        return jnp.concatenate([v, jnp.stack(pull)])

    begin = jnp.concatenate([jnp.asarray(stated.q0), jnp.asarray(stated.u0)])
    found = []
    for name, method, steps in (
        ("Tsit5", diffrax.Tsit5(), (400, 800, 1600)),
        ("Dopri8", diffrax.Dopri8(), (200, 280, 400) if stated.law == "own" else (140, 200, 280)),
    ):

        @jax.jit
        def at_the_end(h: float, method: Any = method) -> Any:
            problem, save = diffrax.ODETerm(rate), diffrax.SaveAt(t1=True)
            solution = diffrax.diffeqsolve(
                problem, method, 0.0, stated.duration, h, begin, saveat=save, max_steps=100_000, throw=False
            )
            return solution.ys[0][:rows]

        def run(count: int, at_the_end: Any = at_the_end) -> Float:
            return np.asarray(at_the_end(stated.duration / count))

        run(8)  # compiled before the time is taken
        many = 20_000 if name == "Tsit5" else 800
        q, seconds = timed(run, many)
        errors = [float(np.abs(run(count) - q).max()) for count in steps]
        slope = f"{order(stated.duration / np.array(steps), errors):.1f} in the step"
        differs = "derivatives by JAX, compiled by XLA"
        found.append(Row(f"diffrax {name}", **compared(stated, q), order=slope, their_seconds=seconds, differs=differs))
    return found
