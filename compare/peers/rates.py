"""The reduced equations with the rates omega as unknowns instead of the momenta pi; for the field law with plain ends and rings.

pi = root(q) omega with root² = alpha + rho |e|², e = R (-y', x') linear in the positions, so e. = e(q.), and

    omega. = (pi. - rho (x., y.) . e(q.) / root) / root,    as root root. = rho e . e(q.) and (x., y.) = e omega.

theta. = omega is linear then, which implicit methods like. The unit law has a constant root.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from compare.peers import loads
from discs import Chain, Problem
from discs.arrays import Float
from discs.skew import Phase


def takes(problem: Problem) -> bool:
    """Whether the equations have this form."""
    chain = problem.chain
    return (
        isinstance(chain, Chain)
        and (chain.rolling, chain.curvature) == ("field", "linear")
        and chain.ends in ("springs", "ring")
        and problem.system.parameters is not None
    )


def bound(problem: Problem, y: Float) -> Callable[[float, Float, Float], None]:
    """f(t, y, out), compiled for one chain and its loads; y as in `compare.peers.reduced.bound`, with omega for pi."""
    from discs.kernels import protocol as do
    from discs.kernels.compiled import jit
    from discs.kernels.lean import lean
    from discs.kernels.shared import forward

    chain = problem.system.parameters
    rows, n = chain.scale.size, chain.weights.shape[1]
    timed = bool(chain.load.patterns.size)
    at: Any = loads.timed(problem, jit) if timed else jit(lambda t: chain)

    @jit
    def f(t, y, out):  # type: ignore[no-untyped-def]
        chain = at(t)
        work, still = do.workspace(chain), np.zeros((rows, n))
        q, v, c, moved = np.empty((rows, n)), np.empty((rows, n)), np.empty((rows, n)), np.empty((rows, n))
        p, g = np.empty((1, n)), np.empty((1, n))
        for i in range(n):
            for row in range(rows):
                q[row, i] = y[(rows + 1) * i + row]
        do.settle(chain, work, q, still)
        do.basis(chain, work, still, c)
        for i in range(n):
            p[0, i] = y[(rows + 1) * i + rows] / c[2, i]
        forward(c, p, v)
        do.pullback(chain, work, Phase(q, still, p), t, still, c, p, g)
        do.settle(chain, work, v, still)
        do.basis(chain, work, still, moved)
        for i in range(n):
            for row in range(rows):
                out[(rows + 1) * i + row] = v[row, i]
            turned = chain.weights[0, i] * (v[0, i] * moved[0, i] + v[1, i] * moved[1, i]) / moved[2, i]
            out[(rows + 1) * i + rows] = -(g[0, i] + turned * c[2, i]) * c[2, i]

    with lean():
        f(0.0, y, np.empty_like(y))
    f.disable_compile()  # type: ignore[attr-defined]
    return f
