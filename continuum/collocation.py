"""A Gauss step of a rod on n functions; the compiled twin is in `continuum.kernels`.

Stages and sweeps are those of `discs.integrators.collocated`. Three things differ, as steps are long here and matrices are full:

1. The common C is that of an earlier step. Its matrix is stored by its eigenvectors, which serve for every length of step
   (`continuum.modes`).
2. A step ends when the rates of all stages have converged, not only the momenta.
3. Sweeps are accelerated by Anderson mixing of depth 2 (Walker and Ni, SIAM J. Numer. Anal. 49, 2011): the next guess is the
   combination of the last three results, with factors whose sum is one, that has the least sum of changes. Sweeps then converge
   for longer steps, and in half the number or fewer.

Within a step the motion is given by the collocation polynomials, of degree s in time for s stages. With the rates v_j and momenta
p_j of the stages at c_j, and the Lagrange polynomials l_j through all c, and L_j through 0 and all c,

    q(t + tau h) = q + h sum_j v_j int_0^tau l_j,   pi(t + tau h) = pi + sum_j (p_j - pi) L_j(tau).

At tau = 1 these give the end of the step.
"""

import signal
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from continuum.galerkin import SpectralRod
from continuum.gauss import gauss
from continuum.modes import Modes, Pencil
from discs.arrays import Float
from discs.integrators.collocated import Guide, collocate
from discs.integrators.collocation import Collocation
from discs.integrators.tableaux import tableau
from discs.skew import Phase, add


class Frozen(Guide):
    """The frozen part of the sweeps: the modes of a nearby configuration. It mixes sweeps."""

    def __init__(self, rod: SpectralRod, z: Phase, modes: Modes | Pencil, h: float, tolerance: float) -> None:
        self._rod, self._modes, self._h, self._tolerance = rod, modes, h, tolerance
        self._start = rod.basis(z.hi + z.lo)
        self._results: list[tuple[Float, Float, Float]] = []

    def rates(self, p: Float) -> Float:
        return self._rod.forward(self._start, p)

    def solve(self, value: complex, rest: Float) -> Float:
        return self._modes.solve(self._h * value, self._h**2 * value**2, rest)

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
    rod: SpectralRod,
    z: Phase,
    modes: Modes | Pencil,
    t: float,
    h: float,
    stages: int,
    sweeps: int,
    tolerance: float,
    compiled: bool = True,
) -> tuple[Phase, Float, Float, int]:
    """One Gauss step.

    Parameters
    ----------
    modes : the modes of a nearby configuration.
    t : the time of z.
    stages : number of stages, even.
    sweeps : largest number of sweeps.
    tolerance : sweeps end when the positions change by less than this, in units of `rod.scale`.

    Returns
    -------
    The state a time h after z, the rates (stages, 3, n) and momenta (stages, n) of the stages, and the number of sweeps. The number
    is 0 if sweeps did not converge; the other results are then undefined.
    """
    rule = tableau(stages)
    if not compiled:
        after, v, p, taken = collocate(rod, z, t, h, rule, Frozen(rod, z, modes, h, tolerance), sweeps, tolerance)
        return after, v, p, taken if taken < sweeps else 0
    from continuum.kernels.collocation import step

    before = Phase(z.hi, z.lo, z.pi[None])
    after, v, p = Phase(*map(np.empty_like, before)), np.empty((stages, 3, rod.n)), np.empty((stages, 1, rod.n))
    method, chain = Collocation(rule, sweeps, tolerance), rod.parameters._replace(modes=modes.at(h, rule.pairs))
    if rod.loads:
        chain = chain._replace(load=rod.loads.stages(t + h * rule.nodes))
    while (cost := step(method, chain, before, after, t, h, v, p))[0] < 0:
        signal.raise_signal(signal.SIGINT)
    return after._replace(pi=after.pi[0]), v, p[:, 0], 0 if cost[2] else cost[0] // stages


def within(z: Phase, h: float, v: Float, p: Float, parts: Float) -> Phase:
    """The states at fractions `parts` (F,) of a step of length h from z, arrays with a first axis F. v and p are from `step`."""
    rates, momenta = _polynomials(len(v))
    series = legendre.legvander(2 * parts - 1, len(v))
    return Phase(*add(z.hi, z.lo, h * np.tensordot(series @ rates, v, 1)), z.pi + series @ momenta @ (p - z.pi))


def spent(h: float, power: Float, parts: Float) -> Float:
    """Work and dissipation at fractions `parts` (F,) of a step of length h, (F, 2), from their rates at the stages, (s, 2)."""
    return h * legendre.legvander(2 * parts - 1, len(power)) @ _polynomials(len(power))[0] @ power


def between(values: Float, parts: Float) -> Float:
    """Values at the stages of a step, (s, m), at fractions `parts` (F,) of it, (F, m): the polynomial through them."""
    nodes, _ = gauss(len(values))
    found: Float = legendre.legvander(2 * parts - 1, len(values) - 1) @ np.linalg.solve(
        legendre.legvander(nodes, len(values) - 1), values
    )
    return found


def rolling(h: float, v: Float, part: float) -> Float:
    """omega and omega. at a fraction of a step of length h, (2, n), by the polynomial through omega at its stages."""
    nodes, _ = gauss(len(v))
    series = np.linalg.solve(legendre.legvander(nodes, len(v) - 1), v[:, 2])
    return np.stack([legendre.legval(2 * part - 1, c) for c in (series, 2 / h * legendre.legder(series))])


@cache
def _polynomials(stages: int) -> tuple[Float, Float]:
    """Legendre coefficients, (stages + 1, stages), of int_0^tau l_j and of L_j."""
    nodes, _ = gauss(stages)
    rates = legendre.legint(np.linalg.inv(legendre.legvander(nodes, stages - 1)), lbnd=-1) / 2
    return rates, np.linalg.inv(legendre.legvander(np.concatenate([[-1.0], nodes]), stages))[:, 1:]


def mixing(changes: list[Float]) -> Float:
    """The factors, of sum one, that make the sum of at most three changes the smallest. The newest change is the first."""
    newest = changes[0].ravel()
    less = np.array([newest - other.ravel() for other in changes[1:]]).reshape(-1, newest.size)
    others = np.linalg.lstsq(less.T, newest, rcond=1e-6)[0]
    return np.concatenate([[1 - others.sum()], others])
