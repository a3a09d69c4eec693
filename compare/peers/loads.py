"""Loads in the forms that peers take: compiled, with their signals, for any time; in JAX; as a compiled sum for multiplier forms.

Our own methods find signals in a table of their steps. A peer asks for them at any time, so they are compiled with its equations.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from discs import Problem
from discs.loads import Linear
from discs.loads.signals import Named


def check(problem: Problem) -> None:
    """ValueError for loads that peers do not take: motors, and signals of one's own where equations are compiled."""
    load = problem.system.load
    if load is not None and load.axles:
        raise ValueError("peers take no motors; got a problem with a Motor: leave it out, or compare methods of ours only")
    if isinstance(load, Linear) and problem.system.parameters is not None:
        for drive in load.drives:
            if not isinstance(drive.signal, Named):
                raise ValueError(f"{drive.name}: peers take signals of discs.loads.signals, as signals.sine; got {drive.signal!r}")


def signals(load: Linear, jit: Callable[..., Any]) -> Any:
    """(t, out): the signals at the time t, compiled; out (K,)."""

    def following(k: int) -> Any:
        if k == len(load.drives):
            return jit(lambda t, out: None)
        signal: Any = load.drives[k].signal
        first, rest = jit(signal.formula()), following(k + 1)

        @jit
        def fill(t, out):  # type: ignore[no-untyped-def]
            out[k] = first(t)
            rest(t, out)

        return fill

    return following(0)


def timed(problem: Problem, jit: Callable[..., Any]) -> Any:
    """t -> the parameters of the chain with the signals of its loads at the time t, compiled."""
    from discs.kernels import load as kernels

    chain, load, table = problem.system.parameters, problem.system.load, kernels.Linear
    if not isinstance(load, Linear):
        raise ValueError(f"peers take loads with a compiled form; got {load!r}")
    kind, others, given, fill, count = type(chain), chain[:-1], chain.load, signals(load, jit), len(load.drives)
    constant, damping, stiffness, level, viscosity, patterns, pushed = given[:7]
    bends, spent, axles = given.bends, given.spent, given.axles

    @jit
    def at(t):  # type: ignore[no-untyped-def]
        now, near = np.empty((1, count)), np.zeros(1)
        fill(t, now[0])
        times = np.array([t])
        parts = constant, damping, stiffness, level, viscosity, patterns, pushed, times, now, near, bends, spent, axles
        return kind(*others, table(*parts))

    return at


def pull(load: Linear | None, jit: Callable[..., Any]) -> Any:
    """(t, q, v, g): g -= f(t, q, v), all (rows, n), compiled; loads without bends."""
    if load is None:
        return jit(lambda t, q, v, g: None)
    fill, count = signals(load, jit), len(load.drives)
    constant, damping, stiffness, _, links, patterns = load.parameters[:6]

    @jit
    def subtract(t, q, v, g):  # type: ignore[no-untyped-def]
        now = np.empty(count)
        fill(t, now)
        for row in range(g.shape[0]):
            for i in range(g.shape[1]):
                g[row, i] += damping[row, i] * v[row, i] + stiffness[row, i] * q[row, i] - constant[row, i]
                for k in range(count):
                    g[row, i] -= now[k] * patterns[k, row, i]
        for row in range(links.shape[0]):
            for j in range(1, links.shape[1]):  # the link before disc j
                i, k = j - 1, j % g.shape[1]
                moment = links[row, j] * (v[2 + row, k] - v[2 + row, i])
                g[2 + row, k] += moment
                g[2 + row, i] -= moment

    return subtract


def in_jax(load: Linear | None, jnp: Any) -> Callable[[Any, Any, Any], Any]:
    """f(t, q, v), (rows, n), in the functions of `jnp`; loads without bends."""
    if load is None:
        return lambda t, q, v: 0.0
    constant, damping, stiffness = (jnp.asarray(part) for part in (load.constant, load.damping, load.stiffness))
    drives: Any = load.drives
    pushes = [(drive.signal.formula(jnp), jnp.asarray(drive.pattern)) for drive in drives]
    links = None if load.viscosity is None else jnp.asarray(load.viscosity)

    def force(t: Any, q: Any, v: Any) -> Any:
        found = constant - damping * v - stiffness * q + sum(signal(t) * pattern for signal, pattern in pushes)
        if links is None:
            return found
        moments = links * jnp.diff(v[2:], prepend=v[2:, -1:], append=v[2:, :1])
        return found.at[2:].add(jnp.diff(moments))

    return force
