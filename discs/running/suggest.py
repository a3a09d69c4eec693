"""`suggest_dt`: a time step to begin with."""

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs import checks
from discs.arrays import Float
from discs.integrators import Integrator, find
from discs.problem import Problem


def suggest_dt(problem: Problem, method: str | Integrator = "midpoint") -> float:
    """A time step to begin with: an implicit method resolves torsion waves, an explicit one is stable.

    Parameters
    ----------
    problem : the chain, its initial state, loads and duration.
    method : an integrator, by name or with settings, as for `simulate`.

    The error is not bounded; for a bound give `simulate` a tol. Measured with the midpoint method, N = 17 to 257, relative to the
    largest value of each coordinate: 1e-5 to 1e-3 on the paper's twist of half a turn (both laws, own headings A = G = 10) and the
    breathing ring; of order 1 for two turns at N = 65, where a third of the steps do not converge.

    Implicit methods: half the time in which a torsion wave passes from disc to disc, at most a hundredth of the duration.
    SciPy's methods: a tenth of the duration, as the longest step.
    Explicit methods: 0.7 of the stability limit, at most a hundredth of the duration. The limit is `stability_limit`/Omega with
    Omega^2 the largest eigenvalue of C^T S C at the start; the factor 0.7 allows for slopes |r'| that grow.
    """
    integrator = find(method)
    chain = checks.instance("problem", problem, Problem, "a Problem, as `compare.lump(scene, n)` makes").chain
    if integrator.adaptive:
        return problem.duration / 10
    if not np.isfinite(integrator.stability_limit):
        stiffest = np.max(chain.torsion_stiffness)
        least = np.min(np.asarray(chain.spin_inertia) + np.asarray(chain.density) * np.asarray(chain.radius) ** 2)
        wave = chain.k * np.sqrt(least / stiffest) if stiffest > 0 else np.inf
        return float(min(0.5 * wave, problem.duration / 100))
    omega = np.sqrt(_stiffest(problem))
    limit = integrator.stability_limit / omega if omega > 0 else np.inf
    return float(min(0.7 * limit, problem.duration / 100))


def _stiffest(problem: Problem) -> float:
    """Largest eigenvalue of C^T S C at the initial state."""
    system, z = problem.system, problem.start()
    shape = system.shape(z.hi, z.lo)
    c = system.basis(shape)

    def apply(p: Float) -> Float:
        move = system.forward(c, p.reshape(z.pi.shape))
        eps = 1e-6 * problem.chain.k / max(float(np.abs(move).max()), 1e-300)
        force = system.gradient(system.moved(shape, eps * move)) - system.gradient(system.moved(shape, -eps * move))
        return system.back(c, force).ravel() / (2 * eps)

    n = z.pi.size
    if n < 40:
        return float(np.linalg.eigvalsh(np.array([apply(row) for row in np.eye(n)])).max())
    start = np.random.default_rng(0).standard_normal(n)
    operator = scipy.sparse.linalg.LinearOperator((n, n), matvec=apply, dtype=float)
    return float(scipy.sparse.linalg.eigsh(operator, k=1, which="LA", v0=start, tol=1e-3, return_eigenvectors=False)[0])
