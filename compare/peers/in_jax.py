"""diffrax as a peer, with the right-hand side in JAX, as it accepts no compiled function."""

import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np

from compare.peers import loads
from compare.peers.peer import TOLERANCES, Cutoff, Outcome, Peer
from discs import Chain, Problem, checks


def diffrax_peers(problem: Problem) -> list[Peer]:
    """diffrax on the reduced equations, written in JAX in double precision; free ends only."""
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    system, z = problem.system, problem.start()
    rows, n = len(system.rows), system.n
    rate = _in_jax(problem)
    begin = jnp.asarray(np.concatenate([z.hi, np.atleast_2d(z.pi)]))
    share = np.sqrt(problem.system.weights[2])
    unit = jnp.asarray(np.concatenate([np.ones((rows, n)), np.ones(np.atleast_2d(z.pi).shape) * share]))

    def peer(name: str, method: Any, settings: tuple[float, ...], most: int) -> Peer:
        @jax.jit
        def solve(tol: Any, end: Any) -> Any:
            return diffrax.diffeqsolve(
                diffrax.ODETerm(lambda t, y, _: rate(t, y)),
                method,
                0.0,
                end,
                None,
                begin,
                stepsize_controller=diffrax.PIDController(rtol=tol, atol=tol, norm=lambda e: jnp.sqrt(jnp.mean((e / unit) ** 2))),
                saveat=diffrax.SaveAt(t1=True),
                max_steps=most,
                throw=False,
            )

        def run(tol: float, seconds: float) -> Outcome:
            part = problem.duration / 100  # compiled code cannot be interrupted: the time of a part predicts the whole
            solve(tol, part).ys.block_until_ready()
            begun = clock.process_time()
            solve(tol, part).ys.block_until_ready()
            if 100 * (clock.process_time() - begun) > 2 * seconds:
                raise Cutoff
            begun = clock.process_time()
            found = solve(tol, problem.duration)
            q = np.asarray(found.ys[0])[:rows]
            spent = clock.process_time() - begun
            if int(found.stats["num_steps"]) >= most or spent > seconds:
                raise Cutoff
            steps = int(found.stats["num_steps"])
            return Outcome(q, steps, steps * len(method.tableau.b_sol), None, spent)

        return Peer(f"diffrax {name}", settings, run, "right-hand side written in JAX and compiled by XLA")

    most = 2_000_000 // max(1, n // 32)
    return [peer("Tsit5", diffrax.Tsit5(), TOLERANCES[:8], most), peer("Dopri8", diffrax.Dopri8(), TOLERANCES[:9], most)]


def _in_jax(problem: Problem) -> Callable[[Any, Any], Any]:
    """The reduced equations in JAX, forces by differentiating the potential; plain springs and own headings with free ends."""
    import jax
    import jax.numpy as jnp

    chain, system = problem.chain, problem.system
    if chain.ends not in ("springs", "paper") or chain.degree != 1:
        raise ValueError("the JAX form of the equations is written for plain free ends and degree 1")
    headings: dict[str, Callable[[Any], Any]] = {"field": lambda z: z, "unit": lambda z: z / jnp.hypot(z[0], z[1])}
    if isinstance(chain, Chain):  # laws are written in NumPy, which JAX does not trace
        checks.choice("rolling (diffrax)", chain.rolling, headings)
        checks.choice("curvature (diffrax)", chain.curvature, ("linear",))
    k, rows = chain.k, len(system.rows)
    weights, radius = jnp.asarray(system.weights), jnp.asarray(chain.radius)
    torsion, bending = jnp.asarray(chain.torsion_stiffness), jnp.asarray(chain.bending_stiffness)

    def potential(q: Any) -> Any:
        d = jnp.diff(q, axis=1)
        twist = 0.5 / k * jnp.sum(torsion * d[2] ** 2)
        if isinstance(chain, Chain):
            return twist + 0.5 / k**3 * jnp.sum(bending * jnp.diff(d[:2], axis=1) ** 2)
        middle = 0.5 * (q[3, 1:] + q[3, :-1])
        stretch = (jnp.cos(middle) * d[0] + jnp.sin(middle) * d[1]) / k - 1
        shear = (jnp.cos(middle) * d[1] - jnp.sin(middle) * d[0]) / k
        beam = jnp.asarray(chain.stretch_stiffness) * stretch**2 + jnp.asarray(chain.shear_stiffness) * shear**2
        return twist + 0.5 * k * jnp.sum(beam) + 0.5 / k * jnp.sum(bending * d[3] ** 2)

    load: Any = system.load
    push = loads.in_jax(load, jnp)

    def rate(t: Any, y: Any) -> Any:
        q, pi = y[:rows], y[rows:]
        if isinstance(chain, Chain):
            first = -3 * q[:2, :1] + 4 * q[:2, 1:2] - q[:2, 2:3]
            last = 3 * q[:2, -1:] - 4 * q[:2, -2:-1] + q[:2, -3:-2]
            slope = jnp.concatenate([first, q[:2, 2:] - q[:2, :-2], last], axis=1) / (2 * k)
            slope = headings[chain.rolling](slope)
            e = radius * jnp.stack([-slope[1], slope[0]])
        else:
            e = radius * jnp.stack([-jnp.sin(q[3]), jnp.cos(q[3])])
        root = jnp.sqrt(weights[2] + weights[0] * jnp.sum(e * e, axis=0))
        moves = [e[0] / root * pi[0], e[1] / root * pi[0], pi[0] / root]
        if rows == 4:
            turn = jnp.sqrt(weights[3])
            moves.append(pi[1] / turn)
        g = jax.grad(potential)(q) - push(t, q, jnp.stack(moves))
        pulls = [-(e[0] * g[0] + e[1] * g[1] + g[2]) / root]
        if rows == 4:
            pulls.append(-g[3] / turn)
        return jnp.stack([*moves, *pulls])

    return rate
