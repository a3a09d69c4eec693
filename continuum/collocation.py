"""What guides the Gauss steps of a rod on n functions, and its motion within them; the compiled twin is `continuum.kernels`.

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

import signal
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from continuum.galerkin import Modes, SpectralRod
from discs.arrays import Float
from discs.integrators.collocation import Collocation, tableau
from discs.integrators.gauss import Guide, collocate
from discs.skew import Phase, add


class Frozen(Guide):
    """The modes of a configuration not far away; sweeps are mixed."""

    def __init__(self, rod: SpectralRod, z: Phase, modes: Modes, h: float, tolerance: float) -> None:
        self._rod, self._modes, self._h, self._tolerance = rod, modes, h, tolerance
        self._start = rod.basis(z.hi + z.lo)
        self._results: list[tuple[Float, Float, Float]] = []

    def rates(self, p: Float) -> Float:
        return self._rod.forward(self._start, p)

    def solve(self, value: complex, rest: Float) -> Float:
        return self._modes.vectors @ ((self._modes.back @ rest) / (1 + self._h**2 * value**2 * self._modes.values))

    def moved(self, change: Float, before: Float, v: Float, p: Float) -> tuple[float, Float, Float]:
        moved = v - before
        far = float((np.abs(0.5 * self._h * moved) / self._rod.scale[:, None]).max())
        if far <= self._tolerance or not np.isfinite(far):
            return far, v, p
        self._results = [(v, p, moved), *self._results[:2]]
        factors = mixing([change for _, _, change in self._results])
        v, p = (sum(x * result[i] for x, result in zip(factors, self._results, strict=True)) for i in (0, 1))
        return far, v, p


def step(
    rod: SpectralRod, z: Phase, modes: Modes, t: float, h: float, stages: int, sweeps: int, tolerance: float, compiled: bool = True
) -> tuple[Phase, Float, Float, int]:
    """The state a time h after z at t, the rates (stages, 3, n) and momenta (stages, n) of the stages, and the number of sweeps.

    Parameters
    ----------
    modes : of a configuration not far away.
    stages : even.
    tolerance : of the positions' last change, in units of `rod.scale`; where so many `sweeps` do not reach it, 0 is returned, and
        the rest is undefined.
    """
    rule = tableau(stages)
    if not compiled:
        after, v, p, taken = collocate(rod, z, t, h, rule, Frozen(rod, z, modes, h, tolerance), sweeps, tolerance)
        return after, v, p, taken if taken < sweeps else 0
    from continuum.kernels.collocation import step

    before = Phase(z.hi, z.lo, z.pi[None])
    after, v, p = Phase(*map(np.empty_like, before)), np.empty((stages, 3, rod.n)), np.empty((stages, 1, rod.n))
    method, chain = Collocation(rule, sweeps, tolerance), rod.parameters._replace(modes=modes)
    while (cost := step(method, chain, before, after, t, h, v, p))[0] < 0:
        signal.raise_signal(signal.SIGINT)
    return after._replace(pi=after.pi[0]), v, p[:, 0], 0 if cost[2] else cost[0] // stages


def within(z: Phase, h: float, v: Float, p: Float, parts: Float) -> Phase:
    """The states at z's time plus `parts` (F,) of a step's h, each array with F before its axes; v and p as `step` returns them."""
    rates, momenta = _polynomials(len(v))
    series = legendre.legvander(2 * parts - 1, len(v))
    return Phase(*add(z.hi, z.lo, h * np.tensordot(series @ rates, v, 1)), z.pi + series @ momenta @ (p - z.pi))


@cache
def _polynomials(stages: int) -> tuple[Float, Float]:
    """Legendre coefficients, (stages + 1, stages), of int_0^tau l_j and of L_j."""
    nodes, _ = legendre.leggauss(stages)
    rates = legendre.legint(np.linalg.inv(legendre.legvander(nodes, stages - 1)), lbnd=-1) / 2
    return rates, np.linalg.inv(legendre.legvander(np.concatenate([[-1.0], nodes]), stages))[:, 1:]


def mixing(changes: list[Float]) -> Float:
    """Factors of sum one that make the sum of at most three changes the least; the newest comes first."""
    newest = changes[0].ravel()
    less = np.array([newest - other.ravel() for other in changes[1:]]).reshape(-1, newest.size)
    others = np.linalg.lstsq(less.T, newest, rcond=1e-6)[0]
    return np.concatenate([[1 - others.sum()], others])
