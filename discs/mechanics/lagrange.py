"""Discs as a mechanical system whose unknowns are all coordinates and the ground's forces."""

from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs import checks
from discs.arrays import Float
from discs.mechanics import MechanicalSystem
from discs.mechanics.bodies import Bodies
from discs.problem import Problem
from discs.solution import Solution


def lagrange_dalembert(problem: Problem, dense: bool = False) -> MechanicalSystem:
    """Lagrange-d'Alembert equations of the discs of a problem: A v is r. - e theta., lambda are the ground's forces.

    Coordinates are those of all discs row by row, (x_0 ... x_{n-1}, y_0 ..., theta_0 ..., and phi_0 ... with own headings), so that
    q.reshape(-1, n) has one row for each; multipliers.reshape(2, n) are the ground's forces (x, y). `frames` gives q and v of a
    problem's start or of a run.

    Symmetries are the motions of the plane (those that a shifted ring allows) and an equal roll of all discs of a piece. A piece is
    a set of discs joined by torsion springs.

    Parameters
    ----------
    problem : the chain and its initial state.
    dense : M and A are NumPy arrays, which are faster for a few discs; otherwise sparse arrays.

    Raises
    ------
    ValueError : for loads, as they are parts of a run: give the system their forces as `applied`.
    """
    checks.instance("problem", problem, Problem, "a Problem, as `compare.lump(scene, n)` makes")
    checks.flag("dense", dense)
    if problem.loads:
        raise ValueError(
            "lagrange_dalembert takes a problem without loads; got some: take replace(problem, loads=()), and give "
            "the system their forces, replace(system, applied=f) with f(t, q, v)"
        )
    system, n = problem.system, problem.chain.n
    rows, m = len(system.rows), len(system.rows) * n
    discs = np.arange(n)
    # row pairs r. - e theta.: entries 1 at x, y and -e at theta of the same disc
    columns = np.stack([np.concatenate([discs, discs + n]), np.tile(discs + 2 * n, 2)], axis=1).ravel()
    starts = np.arange(0, 4 * n + 1, 2)
    inertia = scipy.sparse.diags_array(system.weights.ravel(), format="csr")

    def shape(q: Float) -> Any:
        return system.shape(q.reshape(rows, n))

    def entries(diagonal: float, e: Float) -> "scipy.sparse.csr_array":
        data = np.stack([np.full(2 * n, diagonal), -e.ravel()], axis=1).ravel()
        return scipy.sparse.csr_array((data, columns, starts), shape=(2 * n, m))

    def filled(diagonal: float, e: Float) -> Float:
        a = np.zeros((2 * n, m))
        np.fill_diagonal(a, diagonal)
        a[np.arange(2 * n), columns[1::2]] = -e.ravel()
        return a

    moves, pieces = _moves(problem), _pieces(problem)
    mass, rolling = (inertia.toarray(), filled) if dense else (inertia, entries)

    def symmetry(q: Float) -> Float:
        generators = np.zeros((moves + len(pieces), rows, n))
        generators[0, 0] = generators[1, 1] = 1
        if moves == 3:
            x, y = q.reshape(rows, n)[:2]
            generators[2, :2] = -y, x
            generators[2, 3:] = 1
        generators[moves:, 2] = pieces
        return generators.reshape(-1, m).T

    return MechanicalSystem(
        tuple(f"{row} of disc {i}" for row in system.rows for i in range(n)),
        tuple(f"disc {i}" for i in range(n)) * 2,
        lambda q: mass,
        lambda q: system.potential(shape(q)),
        lambda q, v: -system.gradient(shape(q)).ravel(),
        lambda q: rolling(1.0, system.contact(shape(q))),
        lambda q, v: rolling(0.0, system.contact_rate(shape(q), v.reshape(rows, n))),
        np.zeros(2 * n),
        symmetry,
        bodies=Bodies(lambda q: q.reshape(rows, n), problem=problem),
    )


def _moves(problem: Problem) -> int:
    """Number of symmetries of the plane: two translations, and a rotation unless a ring closes only up to a shift."""
    return 2 if np.any(problem.chain.shift) else 3


def _pieces(problem: Problem) -> Float:
    """Pieces of the chain that torsion springs join, (pieces, n), one or zero."""
    n, degree = problem.chain.n, problem.chain.degree
    whole = np.asarray(problem.chain.torsion_stiffness).reshape(-1, degree).any(axis=1)  # links, or elements of two
    first = np.flatnonzero(np.repeat(whole, degree))
    links = scipy.sparse.coo_array((np.ones(first.size), (first, (first + 1) % n)), shape=(n, n))
    count, piece = scipy.sparse.csgraph.connected_components(links, directed=False)
    found: Float = (piece == np.arange(count)[:, None]).astype(float)
    return found


def frames(problem: Problem, run: Solution | None = None) -> tuple[Float, Float]:
    """Coordinates and velocities of a run with want=("velocity",), (F, m); without a run, of the initial state, (m,).

    Raises
    ------
    ValueError : for a run without velocities.
    """
    system = problem.system
    if run is None:
        z = problem.start()
        return z.hi.ravel(), system.forward(system.basis(system.shape(z.hi, z.lo)), z.pi).ravel()
    if run.x_rate is None:
        raise ValueError('velocities are needed; simulate with want=("velocity",)')
    q, v = (np.hstack([getattr(run, name) for name in names]) for names in (system.rows, system.rates))
    return q, v
