"""The saddle point of a mechanical system, M u = f + A^T lambda with A u = g, and what to say where it is singular."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import NDArray

SINGULAR = 1e-12  # pivots and ranks below this, relative to the largest, are looked into


def matrix(m: Any, a: Any) -> Any:
    """[[M, A^T], [A, 0]] of m (k, k) and a (c, k), sparse if A is."""
    if not scipy.sparse.issparse(a):
        return np.block([[m, a.T], [a, np.zeros((len(a), len(a)))]])
    m, a = scipy.sparse.coo_array(m), scipy.sparse.coo_array(a)
    row, column = a.coords[0] + m.shape[0], a.coords[1]
    places = np.concatenate([m.coords[0], row, column]), np.concatenate([m.coords[1], column, row])
    size = m.shape[0] + a.shape[0]
    return scipy.sparse.coo_array((np.concatenate([m.data, a.data, a.data]), places), shape=(size, size)).tocsc()


def solve(m: Any, a: Any, f: NDArray, g: NDArray, names: Sequence[str], owners: Sequence[str]) -> tuple[NDArray, NDArray]:
    """u (k,) and lambda (c,) of m (k, k), a (c, k), f (k,), g (c,).

    ValueError with what makes them undetermined, by the `names` of coordinates (k,) and the `owners` of rows (c,).
    """
    pivots, invert = _factors(matrix(m, a))
    if not pivots.min() > SINGULAR * pivots.max():
        _explain(m, scipy.sparse.csr_array(a), g, names, owners)
    unknowns = invert(np.concatenate([f, g]))
    return unknowns[: len(f)], -unknowns[len(f) :]


def _explain(m: Any, a: Any, g: NDArray, names: Sequence[str], owners: Sequence[str]) -> None:
    """Raise ValueError with what makes the saddle point singular, part by part of constraints that share coordinates."""
    parts, part = scipy.sparse.csgraph.connected_components(abs(a) @ abs(a).T, directed=False)
    for p in range(parts):
        rows = np.flatnonzero(part == p)
        block = a[rows].toarray()
        block, right = block[:, np.any(block != 0, axis=0)], g[rows]
        sizes = np.linalg.svd(block, compute_uv=False) if block.size else np.zeros(1)
        rank = np.count_nonzero(sizes > SINGULAR * sizes[0])
        if rank == len(rows):
            continue
        theirs = ", ".join(dict.fromkeys(owners[i] for i in rows.tolist()))
        least = np.linalg.lstsq(block, right, rcond=SINGULAR)[0] if block.size else np.zeros(0)
        if np.abs(block @ least - right).max() > 1e-9 * max(np.abs(right).max(), 1e-300):
            raise ValueError(f"constraints of {theirs} contradict each other: no motion obeys all {len(rows)}; take one away")
        raise ValueError(
            f"constraints of {theirs} are redundant: {len(rows)} rows of rank {rank}, so that multipliers are not determined; "
            f"take {len(rows) - rank} away"
        )
    kernel = scipy.linalg.null_space(a.toarray())
    sizes, directions = np.linalg.eigh(kernel.T @ (m @ kernel))
    if sizes[0] <= SINGULAR * sizes[-1]:
        worst = names[int(np.argmax(np.abs(kernel @ directions[:, 0])))]
        raise ValueError(f"M must be positive on velocities that the constraints allow; there is no inertia against {worst}")


def _factors(given: Any) -> tuple[NDArray, Callable[[NDArray], NDArray]]:
    """Pivots of a matrix, in size, and what solves with it."""
    if scipy.sparse.issparse(given):
        try:
            factors = scipy.sparse.linalg.splu(given, permc_spec="MMD_AT_PLUS_A")
        except RuntimeError:  # a pivot is zero exactly
            return np.zeros(1), lambda right: np.full_like(right, np.nan)
        return np.abs(factors.U.diagonal()), factors.solve
    lu, exchanges, _ = scipy.linalg.lapack.dgetrf(given)
    return np.abs(np.diag(lu)), lambda right: scipy.linalg.lapack.dgetrs(lu, exchanges, right)[0]
