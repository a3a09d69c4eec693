"""One Gauss step of a rod on n functions in NumPy; the compiled twin is `continuum.kernels.collocation`.

The stages are those of `discs.integrators.gauss`, and so is a sweep. Three things differ, as steps are long here and matrices full.
The common C is that of an earlier step, and its matrix is kept by its eigenvectors, which serve all lengths of steps. A step ends
when the rates of all stages are settled, not only the momenta. And sweeps are mixed by Anderson's method of depth 2 (Walker and Ni,
SIAM J. Numer. Anal. 49, 2011): the next guess is that combination of the last three results, with factors of sum one, whose changes
add up to the least. Sweeps then converge for longer steps, in half their number and less.

Within a step the motion is that of the collocation polynomials, of degree s in time for s stages: with rates v_j and momenta p_j of
the stages at c_j, and Lagrange's polynomials l_j through all c, L_j through 0 and all c,

    q(t + tau h) = q + h sum_j v_j int_0^tau l_j,   pi(t + tau h) = pi + sum_j (p_j - pi) L_j(tau),

which at tau = 1 are the step's end.
"""

from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from continuum.galerkin import Modes, SpectralRod
from discs.integrators.collocation import tableau
from discs.skew import Phase, add


def step(
    rod: SpectralRod, z: Phase, modes: Modes, h: float, stages: int, sweeps: int, tolerance: float
) -> tuple[Phase, NDArray, NDArray, int]:
    """The state a time h after z, the rates (stages, 3, n) and momenta (stages, n) of the stages, and the number of sweeps.

    Parameters
    ----------
    modes : of a configuration not far away.
    stages : even.
    tolerance : of the positions' last change, in units of `rod.scale`; where so many `sweeps` do not reach it, z and 0 are
        returned.
    """
    rule = tableau(stages)
    a, pairs = rule.a, (rule.pairs, rule.pairs_in, rule.pairs_out)
    base = z.hi + z.lo
    p = np.array([z.pi] * stages)
    v = rod.forward(rod.basis(base), p)
    results: list[tuple[NDArray, NDArray, NDArray]] = []
    for sweep in range(1, sweeps + 1):
        c = rod.basis(base + h * np.tensordot(a, v, 1))
        force = rod.back(c, rod.mean_force(base + h * np.tensordot(a, rod.forward(c, p), 1)))
        rest = z.pi - p - h * np.tensordot(a, force, 1)
        for value, into, out in zip(*pairs, strict=True):
            part = modes.vectors @ ((modes.back @ (into @ rest)) / (1 + h * h * value**2 * modes.values))
            p = p + np.multiply.outer(out, part).real
        moved = rod.forward(c, p) - v
        v = v + moved
        if (np.abs(0.5 * h * moved) <= tolerance * rod.scale[:, None]).all():
            return Phase(*add(z.hi, z.lo, h * np.tensordot(rule.b, v, 1)), z.pi + rule.last @ (p - z.pi)), v, p, sweep
        if not np.isfinite(moved).all():
            break
        results = [(v, p, moved), *results[:2]]
        factors = mixing([change for _, _, change in results])
        v, p = (sum(x * result[i] for x, result in zip(factors, results, strict=True)) for i in (0, 1))
    return z, v, p, 0


def within(z: Phase, h: float, v: NDArray, p: NDArray, parts: NDArray) -> Phase:
    """The states at z's time plus `parts` (F,) of a step's h, each array with F before its axes; v and p as `step` returns them."""
    rates, momenta = _polynomials(len(v))
    series = legendre.legvander(2 * parts - 1, len(v))
    return Phase(*add(z.hi, z.lo, h * np.tensordot(series @ rates, v, 1)), z.pi + series @ momenta @ (p - z.pi))


@cache
def _polynomials(stages: int) -> tuple[NDArray, NDArray]:
    """Legendre coefficients, (stages + 1, stages), of int_0^tau l_j and of L_j."""
    nodes, _ = legendre.leggauss(stages)
    rates = legendre.legint(np.linalg.inv(legendre.legvander(nodes, stages - 1)), lbnd=-1) / 2
    return rates, np.linalg.inv(legendre.legvander(np.concatenate([[-1.0], nodes]), stages))[:, 1:]


def mixing(changes: list[NDArray]) -> NDArray:
    """Factors of sum one that make the sum of at most three changes the least; the newest comes first."""
    newest = changes[0].ravel()
    less = np.array([newest - other.ravel() for other in changes[1:]]).reshape(-1, newest.size)
    others = np.linalg.lstsq(less.T, newest, rcond=1e-6)[0]
    return np.concatenate([[1 - others.sum()], others])
