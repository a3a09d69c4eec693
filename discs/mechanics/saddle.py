r"""The saddle point of a mechanical system, M u = f + A^T lambda with A u = g; errors name the cause of a singular one.

Singularity must not depend on units. Pivots and ranks are therefore judged in coordinates of mass 1 with rows of norm 1, both to
the nearest power of two: other units of length, mass and time give the same matrix up to factors below 2.
"""

from collections.abc import Callable, Sequence

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float, Matrix

SINGULAR = 1e-12  # pivots and singular values below this, relative to the largest, count as 0
ASYMMETRY = 1e-10  # of M, relative to the root of both diagonal entries


def dense(a: Matrix) -> Float:
    """A dense or sparse array as a dense one."""
    return a.toarray() if scipy.sparse.issparse(a) else np.asarray(a)


def matrix(m: Matrix, a: Matrix) -> Matrix:
    """[[M, A^T], [A, 0]] of m (k, k) and a (c, k), sparse if A is."""
    if not scipy.sparse.issparse(a):
        return np.block([[m, a.T], [a, np.zeros((len(a), len(a)))]])
    m, a = scipy.sparse.coo_array(m), scipy.sparse.coo_array(a)
    row, column = a.coords[0] + m.shape[0], a.coords[1]
    places = np.concatenate([m.coords[0], row, column]), np.concatenate([m.coords[1], column, row])
    size = m.shape[0] + a.shape[0]
    return scipy.sparse.coo_array((np.concatenate([m.data, a.data, a.data]), places), shape=(size, size)).tocsc()


def solve(m: Matrix, a: Matrix, f: Float, g: Float, names: Sequence[str], owners: Sequence[str]) -> tuple[Float, Float]:
    """u (k,) and lambda (c,) of m (k, k), a (c, k), f (k,), g (c,).

    ValueError with the cause if they are not determined; it uses the `names` of coordinates (k,) and the `owners` of rows (c,).
    """
    check(m, a, f, g, names, owners)
    whole, right = matrix(m, a), np.concatenate([f, g])
    pivots, invert = _factors(whole)
    if not pivots.min() > SINGULAR * pivots.max():
        d = scales(m, a)
        pivots, inverse = _factors(_scaled(whole, d))
        if not pivots.min() > SINGULAR * pivots.max():
            explain(m, a, g, names, owners)
        unknowns = d * inverse(d * right)
    else:
        unknowns = invert(right)
    return unknowns[: len(f)], -unknowns[len(f) :]


def check(m: Matrix, a: Matrix, f: Float, g: Float, names: Sequence[str], owners: Sequence[str]) -> None:
    """ValueError unless all entries are finite and M is symmetric, and positive definite on velocities that A allows."""
    for what, given in (("M", m), ("A", a), ("the force", f), ("the right side of A u = g", g)):
        entries = given.data if scipy.sparse.issparse(given) else given
        if not np.isfinite(entries).all():
            raise ValueError(f"{what} must be finite; it is not at these q, v")
    symmetric(m, names)
    diagonal = m.diagonal()
    if np.count_nonzero(diagonal) == _count(m) and (diagonal > 0).all():
        return
    if not scipy.sparse.issparse(m):
        try:
            np.linalg.cholesky(m)
            return
        except np.linalg.LinAlgError:  # M alone is not positive definite; on the kernel of A it may be
            pass
    _inertia(m, a, names)


def symmetric(m: Matrix, names: Sequence[str]) -> None:
    """ValueError unless M is symmetric, with the entries that differ most."""
    diagonal = m.diagonal()
    if np.count_nonzero(diagonal) == _count(m):
        return
    off = abs(m - m.T)
    if not off.max() > 0:
        return
    off, size = dense(off), np.sqrt(np.abs(diagonal))
    scale = np.outer(size, size)
    off = off / np.where(scale > 0, scale, abs(m).max())
    if off.max() > ASYMMETRY:
        i, j = divmod(int(np.argmax(off)), len(names))
        raise ValueError(
            f"M must be symmetric; its entry ({names[i]}, {names[j]}) is {m[i, j]:g} and ({names[j]}, {names[i]}) is {m[j, i]:g}: "
            "kinetic energy is v.Mv/2, take (M + M^T)/2"
        )


def _count(m: Matrix) -> int:
    """Entries that are not zero."""
    return int(m.count_nonzero() if scipy.sparse.issparse(m) else np.count_nonzero(m))


def rank(rows: Float) -> int:
    """Rank of rows (c, k), each of them and then each column scaled to a largest entry near 1."""
    if not rows.size or not rows.any():
        return 0
    for axis in (1, 0, 1):
        largest = np.abs(rows).max(axis=axis, keepdims=True)
        rows = rows / np.where(largest > 0, largest, 1.0)
    sizes = np.linalg.svd(rows, compute_uv=False)
    return int(np.count_nonzero(sizes > SINGULAR * sizes[0]))


def explain(m: Matrix, a: Matrix, g: Float, names: Sequence[str], owners: Sequence[str]) -> None:
    """Raise ValueError with the cause of a singular saddle point, found in each set of constraints that share coordinates."""
    d = scales(m, a)
    a = scipy.sparse.diags_array(d[len(names) :]) @ scipy.sparse.csr_array(a) @ scipy.sparse.diags_array(d[: len(names)])
    g = g * d[len(names) :]
    parts, part = scipy.sparse.csgraph.connected_components(abs(a) @ abs(a).T, directed=False)
    for p in range(parts):
        rows = np.flatnonzero(part == p)
        block = a[rows].toarray()
        block, right = block[:, np.any(block != 0, axis=0)], g[rows]
        found = rank(block)
        if found == len(rows):
            continue
        theirs = ", ".join(dict.fromkeys(owners[i] for i in rows.tolist()))
        least = np.linalg.lstsq(block, right, rcond=SINGULAR)[0] if block.size else np.zeros(0)
        if np.abs(block @ least - right).max() > 1e-9 * max(np.abs(right).max(), 1e-300):
            raise ValueError(f"constraints of {theirs} contradict each other: no motion obeys all {len(rows)}; remove one")
        raise ValueError(
            f"constraints of {theirs} are redundant: {len(rows)} rows of rank {found}, so that multipliers are not determined; "
            f"remove {len(rows) - found}"
        )
    _inertia(m, a, names, d)


def _inertia(m: Matrix, a: Matrix, names: Sequence[str], d: Float | None = None) -> None:
    """ValueError unless M is positive definite on the kernel of A; with `d`, A is scaled by it already."""
    if d is None:
        d = scales(m, a)
        a = scipy.sparse.diags_array(d[len(names) :]) @ scipy.sparse.csr_array(a) @ scipy.sparse.diags_array(d[: len(names)])
    d = d[: len(names)]
    kernel = scipy.linalg.null_space(a.toarray()) if a.shape[0] else np.eye(len(names))
    if not kernel.size:
        return
    scaled = dense(m) * d * d[:, None]
    sizes, directions = np.linalg.eigh(kernel.T @ (scaled @ kernel))
    if sizes[0] <= SINGULAR * max(sizes[-1], 0.0):
        worst = names[int(np.argmax(np.abs(kernel @ directions[:, 0])))]
        what = "there is no inertia" if sizes[0] >= -SINGULAR * max(sizes[-1], 0.0) else "inertia is negative"
        raise ValueError(f"M must be positive on velocities that the constraints allow; {what} against {worst}")


def scales(m: Matrix, a: Matrix) -> Float:
    """d (k + c,), powers of two: coordinates near mass 1, rows near norm 1 in them.

    A coordinate without mass is scaled by the rows that it takes part in.
    """
    mass, size = np.abs(m.diagonal()), abs(a)
    d = np.where(mass > 0, 1 / np.sqrt(np.where(mass > 0, mass, 1.0)), 0.0)
    norms = size @ d
    r = np.where(norms > 0, 1 / np.where(norms > 0, norms, 1.0), 0.0)
    if not (mass > 0).all():
        reach = size.T @ r
        d = np.where(mass > 0, d, 1 / np.where(reach > 0, reach, 1.0))
        norms = size @ d
        r = 1 / np.where(norms > 0, norms, 1.0)
    found: Float = np.exp2(np.round(np.log2(np.concatenate([d, np.where(r > 0, r, 1.0)]))))
    return found


def _scaled(whole: Matrix, d: Float) -> Matrix:
    """D S D."""
    if scipy.sparse.issparse(whole):
        return (scipy.sparse.diags_array(d) @ whole @ scipy.sparse.diags_array(d)).asformat(whole.format)
    return whole * d * d[:, None]


def _factors(given: Matrix) -> tuple[Float, Callable[[Float], Float]]:
    """Absolute pivots of a matrix, and the function that solves with it."""
    if scipy.sparse.issparse(given):
        try:
            factors = scipy.sparse.linalg.splu(given, permc_spec="MMD_AT_PLUS_A")
        except RuntimeError:  # a pivot is zero exactly
            return np.zeros(1), lambda right: np.full_like(right, np.nan)
        return np.abs(factors.U.diagonal()), factors.solve
    lu, exchanges, _ = scipy.linalg.lapack.dgetrf(given)
    return np.abs(np.diag(lu)), lambda right: scipy.linalg.lapack.dgetrs(lu, exchanges, right)[0]
