"""Tangents and transposes of steps by compiled sweeps; `discs.analysis.sparse_tangent` has the plain twins, by sparse matrices."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from discs.analysis.parameters import INERTIAS
from discs.analysis.sparse_tangent import Tangent, tangent
from discs.analysis.stages import Passed, SweptEquations, equations
from discs.analysis.steps import Steps, Taken
from discs.arrays import Float, Matrix
from discs.kernels.background import missing, usual
from discs.problem import Problem
from discs.running.engine import plain_because

TOLERANCE = 1e-12  # of sweeps, relative


class Sweeps:
    """Compiled sweeps through the steps of a problem whose linearised equations are `SweptEquations`."""

    def __init__(self, steps: Steps, equations: SweptEquations) -> None:
        self.steps, self.equations = steps, equations
        self._drag, self._held = (_sparse(matrix, equations.chain.n) for matrix in (equations.drag, equations.held))

    def back(
        self, taken: Taken, t: float, h: float, count: int, value: Float, seeds: dict[int, Float], rates: bool
    ) -> tuple[int, Float, Passed | None]:
        """Take a value (size,), in place, back through the first `count` steps that were taken, of size h from the time t.

        seeds : what is added to it before it is taken back through the step of that number. rates : whether those of stages matter.

        Returns
        -------
        How many steps were taken, fewer than all before one whose sweeps do not converge, whose seed is added; the sums of
        `linearised.weigh`, (4, n); and what the parameters of springs and loads need, None without `rates`.
        """
        from discs.kernels.adjoint import back  # numba is slow to import

        q, p = taken.q[:count], taken.pi[:count]
        rows, place = np.array([*seeds.values()]).reshape(-1, value.size), np.full(count, -1)
        for row, number in enumerate(seeds):
            if number < count:
                place[number] = row
        sums, (v, w) = np.zeros((len(INERTIAS), q.shape[3])), np.empty((2, *(q.shape if rates else (0, *q.shape[1:]))))
        chain, given, times = *self._given(t, h, len(taken.q)), self.steps.times(t, h, count)
        done = back(self.steps.rule, chain, given, h, t, q, p, TOLERANCE, rows, place, value, sums, v, w)
        if done < 0:
            raise KeyboardInterrupt
        flat, first = (-1, *q.shape[2:]), (count - done) * q.shape[1]
        q, v, w = (part.reshape(flat)[first:] for part in (q, v, w))
        return done, sums, Passed(times[first:], q, v, w) if rates else None

    def forward(self, taken: Taken, t: float, h: float, dy: Float) -> bool:
        """Take changes dy (m, size) of the state, in place, through the one step that was taken; whether the sweeps converged."""
        from discs.kernels.tangent import tangent as sweep  # numba is slow to import

        chain, given = self._given(t, h, 1)
        return bool(sweep(self.steps.rule, chain, given, h, t, taken.q[0], taken.pi[0], TOLERANCE, dy))

    def _given(self, t: float, h: float, count: int) -> tuple[Any, Any]:
        """The parameters of the chain for some steps, and what loads add to the linearised equations."""
        from discs.kernels import slaved_linearised, steered_linearised  # noqa: F401, the forms
        from discs.kernels.linearised import Given  # numba is slow to import

        forces = self.equations.forces(self.steps.times(t, h, count))
        return self.steps.timed(t, h, count), Given(self._drag, self._held, forces)


@dataclass(frozen=True, eq=False)
class Swept:
    """The tangent of one step by sweeps; by the sparse matrix where these do not converge."""

    sweeps: Sweeps
    taken: Taken
    t: float
    h: float

    @property
    def _sparse(self) -> Tangent:
        at, steps = self.sweeps.equations, self.sweeps.steps
        return tangent(steps.rule, self.h, at.each(self.taken.q[0], self.taken.pi[0], self.t + self.h * steps.rule.nodes))

    def forward(self, dy: Float) -> Float:
        """T dy, for dy (size,) or (size, m)."""
        changes = np.array(dy.reshape(len(dy), -1).T, order="C")
        if not self.sweeps.forward(self.taken, self.t, self.h, changes):
            return self._sparse.forward(dy)
        return changes.T.reshape(dy.shape)

    def back(self, w: Float) -> Float:
        """T^T w, for w (size,) or (size, m)."""
        found = np.array(w.reshape(len(w), -1).T, order="C")
        for value in found:
            if not self.sweeps.back(self.taken, self.t, self.h, 1, value, {}, False)[0]:
                return self._sparse.back(w)
        return found.T.reshape(w.shape)


def _sparse(matrix: Matrix, n: int) -> Any:
    """A sparse matrix of q, row after row, for compiled code."""
    from discs.kernels.linearised import Sparse  # numba is slow to import

    entries = matrix.tocoo()
    places = [part.astype(np.intp) for row in entries.coords for part in divmod(row, n)]
    return Sparse(entries.data.astype(float), *places)


def sweeps(steps: Steps) -> Sweeps | None:
    """Compiled sweeps, if the steps are compiled and the linearised equations have a compiled form."""
    found = equations(steps.problem, steps.secant)
    return Sweeps(steps, found) if steps.compiled and isinstance(found, SweptEquations) else None


def ready(problem: Problem, integrator: Any, engine: str | None = None) -> bool:
    """Whether the kernels of steps and tangents are there; with the engine "compiled" they are, as it waits.

    engine : as for `simulate`; None for the usual one.
    """
    engine = usual() if engine is None else engine
    if plain_because(problem, integrator, engine, ()):
        return False
    if engine != "compiled":
        return not missing(prepare, problem, integrator, compiles=engine == "auto")
    prepare(problem, integrator)
    return True


def prepare(problem: Problem, integrator: Any) -> None:
    """Call the kernels of steps and tangents once, which compiles them or reads them from disc."""
    steps, z = Steps(problem, integrator, True), problem.start()
    taken, found, size = steps.take(z, 0.0, 1.0, 0), sweeps(steps), z.hi.size + z.pi.size
    if found is not None:
        found.back(taken, 0.0, 1.0, 0, np.zeros(size), {}, False)
        q, pi = np.empty((1, *taken.q.shape[1:])), np.zeros((1, *taken.pi.shape[1:]))
        q[:] = z.hi
        found.forward(Taken(z, q, pi, 0), 0.0, 1.0, np.empty((0, size)))
