"""Save and restore the state of a SciPy solver, as arrays and numbers.

SciPy has no function for this. Its solvers hold their state in attributes: numbers, arrays, a sparse Jacobian, factors of a matrix
(computed again from the matrix, to the same bits) and the interpolant of the last step (computed again from the others).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float

PARTS = ("data", "indices", "indptr")


class Factors:
    """Factors of a sparse matrix, kept with the matrix.

    Parameters
    ----------
    matrix : the matrix.
    make : matrix -> factors, the function that SciPy's solver uses.
    """

    def __init__(self, matrix: "scipy.sparse.csc_matrix", make: Callable[["scipy.sparse.csc_matrix"], Any]) -> None:
        self.matrix, self._factors = matrix, make(matrix)

    def solve(self, b: Float) -> Float:
        """Solve with the matrix."""
        found: Float = self._factors.solve(b)
        return found


def keep(solver: "scipy.integrate.OdeSolver") -> dict[str, Any]:
    """The state of a solver; only the time of an LSODA whose state is hidden in Fortran (SciPy before 1.17)."""
    if isinstance(solver, scipy.integrate.LSODA):
        ode = solver._lsoda_solver
        inner = ode._integrator
        if not hasattr(inner, "state_doubles"):
            return {"replay": solver.t}
        arrays = {name: getattr(inner, name).copy() for name in ("rwork", "iwork", "state_doubles", "state_ints")}
        return _numbers(vars(solver)) | arrays | {"inner_y": ode._y.copy(), "inner_t": ode.t, "istate": inner.call_args[3]}
    kept = _numbers(vars(solver))
    for name, value in vars(solver).items():
        matrix = value.matrix if isinstance(value, Factors) else value
        if scipy.sparse.issparse(matrix) and name != "I":
            kept |= {f"{name}.{part}": getattr(matrix, part).copy() for part in PARTS}
    return kept


def recall(solver: "scipy.integrate.OdeSolver", kept: dict[str, Any]) -> None:
    """Restore the state that `keep` returned in a new solver of the same problem."""
    if "replay" in kept:  # the steps do not depend on frames: take them again
        while solver.t < kept["replay"]:
            solver.step()
        return
    kept = dict(kept)
    if isinstance(solver, scipy.integrate.LSODA):
        ode = solver._lsoda_solver
        inner = ode._integrator
        ode._y, ode.t, inner.call_args[3] = kept.pop("inner_y"), float(kept.pop("inner_t")), int(kept.pop("istate"))
        for name in ("rwork", "iwork", "state_doubles", "state_ints"):
            getattr(inner, name)[...] = kept.pop(name)
    for name in {name.split(".")[0] for name in kept if "." in name}:
        matrix = scipy.sparse.csc_matrix(tuple(kept.pop(f"{name}.{part}") for part in PARTS), shape=(solver.n, solver.n))
        setattr(solver, name, solver.lu(matrix) if name.startswith("LU") else matrix)
    for name, value in kept.items():  # last, so that counts of work are right
        now = getattr(solver, name)
        if isinstance(now, np.ndarray) and now.shape == np.shape(value):
            now[...] = value  # in place: some arrays are views of others
        else:
            setattr(solver, name, value if np.ndim(value) else value.item())
    if isinstance(solver, scipy.integrate.Radau) and solver.t_old is not None:
        solver.sol = solver._compute_dense_output()


def _numbers(attributes: dict[str, Any]) -> dict[str, Any]:
    """The attributes that are arrays or numbers."""
    wanted = (bool, int, float, np.ndarray, np.generic)
    return {name: np.array(value, copy=True) for name, value in attributes.items() if isinstance(value, wanted)}
