"""Peers that take a right-hand side: SciPy, SUNDIALS, and the textbook's dense saddle point.

All but the last get the same compiled function, y. = f(t, y) with y = (x, y, theta, pi, ...) disc by disc, bound to its
chain so that a call costs no more than a call must.
"""

import time as clock
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs import Problem
from discs.integrators.ivp import Reduced


class Cutoff(Exception):
    """A run took longer than it was given."""


class Outcome(NamedTuple):
    """Where a peer ended: positions (rows, n), its steps, right-hand sides, linear solves or factorisations (None: not told),
    seconds, momenta where it has them."""

    q: NDArray
    steps: int
    gradients: int
    solves: int | None
    seconds: float
    pi: NDArray | None = None


class Peer(NamedTuple):
    """A peer with its settings, from loose to tight.

    name : as in the table. settings : its tolerances or steps. run : (setting, seconds it is given) -> Outcome. tells : how it
    differs.
    """

    name: str
    settings: tuple[float, ...]
    run: Callable[[float, float], Outcome]
    tells: str = ""


TOLERANCES = tuple(10.0**-k for k in range(2, 12))


def bound(problem: Problem) -> Callable[[float, NDArray, NDArray], None]:
    """f(t, y, out), compiled for one chain, whose parameters become constants of the code."""
    import numba

    from discs.kernels import methods
    from discs.kernels.compiled import OPTIONS

    chain, reduced = problem.system.kernel, methods.reduced.py_func
    inner = numba.njit(**OPTIONS)(reduced)

    @numba.njit(**OPTIONS)
    def f(t, y, out):  # type: ignore[no-untyped-def]
        inner(chain, y, out)

    return f


def _read_only(y: NDArray) -> NDArray:
    """As SUNDIALS hands arrays to callbacks."""
    y = y.copy()
    y.flags.writeable = False
    return y


class Bound:
    """The right-hand side that counts its calls and stops a run that is over its time.

    Parameters
    ----------
    f : (t, y, out), None to have one compiled for the chain, which takes seconds and saves a third of a call.
    """

    def __init__(self, problem: Problem, f: Callable[[float, NDArray, NDArray], None] | None = None) -> None:
        self.f, self.calls, self.until = f or bound(problem), 0, np.inf
        self.reduced = Reduced(problem.system)
        z = problem.start()
        self.y0 = self.reduced.join(z.hi, z.pi)
        mass, _, spin = problem.system.weights[:3]
        share = np.sqrt(np.where(spin > 0, spin, mass))
        # pi of a disc is small like the root of its share of length: so are the errors allowed
        self.unit = self.reduced.join(np.ones_like(z.hi), np.ones_like(z.pi) * share)
        for y in (self.y0, _read_only(self.y0)):  # compiled for both, before any clock runs
            self(0.0, y)

    def start(self, seconds: float) -> None:
        """Start counting."""
        self.calls, self.until = 0, clock.perf_counter() + seconds

    def fill(self, t: float, y: NDArray, out: NDArray) -> None:
        """SUNDIALS' form. A failed callback is reported by the solver, not raised: NaN makes it stop."""
        self.calls += 1
        if not self.calls & 63:
            self.watch(t)
        self.f(t, y, out)

    def watch(self, t: float) -> None:
        """Stop a run that is over its time; t is where it is."""
        if clock.perf_counter() > self.until:
            raise Cutoff

    def __call__(self, t: float, y: NDArray) -> NDArray:
        """SciPy's form."""
        out = np.empty_like(y)
        self.fill(t, np.ascontiguousarray(y), out)
        return out


def scipy_peers(problem: Problem, f: Bound) -> list[Peer]:
    """The methods of solve_ivp, with the band or the sparsity of the Jacobian."""
    from scipy.integrate import solve_ivp

    known: dict[str, dict[str, Any]] = {name: {} for name in ("RK45", "DOP853")}
    known |= {name: {"jac_sparsity": f.reduced.sparsity()} for name in ("Radau", "BDF")}
    known["LSODA"] = {} if problem.system.closed else {"lband": f.reduced.width, "uband": f.reduced.width}

    def runner(name: str, options: dict[str, Any]) -> Callable[[float, float], Outcome]:
        def run(rtol: float, seconds: float) -> Outcome:
            f.start(seconds)
            begun = clock.perf_counter()
            span = (0.0, problem.duration)
            found = solve_ivp(f, span, f.y0, name, t_eval=span[1:], rtol=rtol, atol=0.01 * rtol * f.unit, **options)
            spent = clock.perf_counter() - begun
            if not found.success:
                raise ArithmeticError(found.message)
            steps = max(1, round(found.nfev / {"RK45": 6, "DOP853": 12}.get(name, 1))) if name in ("RK45", "DOP853") else 0
            end = f.reduced.split(found.y[:, -1])
            return Outcome(end.hi, steps, f.calls, found.nlu or None, spent, end.pi)

        return run

    return [Peer(f"SciPy {name}", TOLERANCES, runner(name, options)) for name, options in known.items()]


def sundials_peers(problem: Problem, f: Bound) -> list[Peer]:
    """CVODE with a banded Jacobian by differences: BDF to order 2 and 5, Adams."""
    from sksundae.cvode import CVODE

    band = (
        {"linsolver": "dense"}
        if problem.system.closed
        else {"linsolver": "band", "lband": f.reduced.width, "uband": f.reduced.width}
    )

    def runner(**options: Any) -> Callable[[float, float], Outcome]:
        def run(rtol: float, seconds: float) -> Outcome:
            f.start(seconds)
            begun = clock.perf_counter()
            solver = CVODE(f.fill, rtol=rtol, atol=0.01 * rtol * f.unit, max_num_steps=10**8, **options, **band)
            found = solver.solve(np.array([0.0, problem.duration]), f.y0)
            spent = clock.perf_counter() - begun
            if spent > seconds:
                raise Cutoff
            if not found.success:
                raise ArithmeticError(str(found.message))
            end = f.reduced.split(found.y[-1])
            return Outcome(end.hi, 0, f.calls, int(found.njev or 0), spent, end.pi)

        return run

    return [
        Peer("CVODE BDF-2", TOLERANCES, runner(method="BDF", max_order=2)),
        Peer("CVODE BDF-5", TOLERANCES, runner(method="BDF", max_order=5)),
        Peer("CVODE Adams", TOLERANCES, runner(method="Adams")),
    ]


def multiplier_peer(problem: Problem) -> Peer:
    """IDA on q. = v, M v. = -grad V + A^T lambda, A(q) v = 0, the multipliers among the unknowns: index 2, banded, plain doubles.

    Written for slaved and own headings alike: A r. = r. - e theta., one row pair for each disc.
    """
    from sksundae.ida import IDA

    system = problem.system
    rows, n = len(system.rows), system.n
    width = 2 * rows + 2
    z = problem.start()
    shape = system.shape(z.hi)
    v0 = system.forward(system.frame(shape), z.pi)
    gradient, compiled = _gradient(problem)

    def residual(t: float, y: NDArray, yp: NDArray, out: NDArray) -> None:
        calls[0] += 1
        if not calls[0] & 63 and clock.perf_counter() > until[0]:
            raise Cutoff
        compiled(y, yp, out)

    calls, until = [0], [np.inf]
    force = system.contact_force(shape, v0)
    acceleration = -gradient(z.hi)
    acceleration[:2] += force
    e = system.contact(shape)
    acceleration[2] -= (e * force).sum(axis=0)
    acceleration /= system.weights
    y0 = np.concatenate([z.hi, v0, force]).T.ravel()
    yp0 = np.concatenate([v0, acceleration, np.zeros_like(force)]).T.ravel()
    compiled(_read_only(y0), _read_only(yp0), np.empty_like(y0))
    algebraic = np.arange(n * width).reshape(n, width)[:, 2 * rows :].ravel()
    allowed = np.ones((n, width))
    allowed[:, 2 * rows :] = 1e6  # multipliers of an index-2 system are not controlled
    options: dict[str, Any] = {"linsolver": "dense"}
    if not system.closed:
        half = (system.reach + 1) * width - 1
        options = {"linsolver": "band", "lband": half, "uband": half}

    def run(rtol: float, seconds: float) -> Outcome:
        calls[0], until[0] = 0, clock.perf_counter() + seconds
        begun = clock.perf_counter()
        solver = IDA(
            residual, rtol=rtol, atol=0.01 * rtol * allowed.ravel(), algebraic_idx=algebraic, max_num_steps=10**8, **options
        )
        found = solver.solve(np.array([0.0, problem.duration]), y0, yp0)
        spent = clock.perf_counter() - begun
        if spent > seconds:
            raise Cutoff
        if not found.success:
            raise ArithmeticError(str(found.message))
        return Outcome(found.y[-1].reshape(n, width).T[:rows], 0, calls[0], int(found.njev or 0), spent)

    return Peer("IDA, multipliers", TOLERANCES[:7], run, "index 2; errors of the multipliers are not controlled")


def _gradient(problem: Problem) -> tuple[Callable[[NDArray], NDArray], Callable[[NDArray, NDArray, NDArray], None]]:
    """grad V of positions, and the residual of the multiplier form, compiled for one chain."""
    import numba

    from discs.kernels import chain as do
    from discs.kernels.compiled import OPTIONS

    system, chain = problem.system, problem.system.kernel
    rows, n = len(system.rows), system.n
    weights, width = np.array(system.weights), 2 * len(system.rows) + 2

    @numba.njit(**OPTIONS)
    def residual(y, yp, out):  # type: ignore[no-untyped-def]
        work = do.workspace(chain)
        q, still, g, c = np.empty((rows, n)), np.zeros((rows, n)), np.empty((rows, n)), np.empty((rows, n))
        for i in range(n):
            for row in range(rows):
                q[row, i] = y[width * i + row]
        do.settle(chain, work, q, still)
        do.frame(chain, work, still, c)
        do.gradient(chain, work, still, g)
        for i in range(n):
            at = width * i
            ex, ey = c[0, i] / c[2, i], c[1, i] / c[2, i]
            fx, fy = y[at + 2 * rows], y[at + 2 * rows + 1]
            for row in range(rows):
                out[at + row] = yp[at + row] - y[at + rows + row]
                out[at + rows + row] = weights[row, i] * yp[at + rows + row] + g[row, i]
            out[at + rows] -= fx
            out[at + rows + 1] -= fy
            out[at + rows + 2] += ex * fx + ey * fy
            omega = y[at + rows + 2]
            out[at + 2 * rows] = y[at + rows] - ex * omega
            out[at + 2 * rows + 1] = y[at + rows + 1] - ey * omega

    return lambda q: system.gradient(system.shape(q)), residual


def saddle_peer(problem: Problem) -> Peer:
    """The textbook: at every right-hand side the dense saddle point [[M, A^T], [A, 0]] for accelerations and multipliers, in
    DOP853."""
    from scipy.integrate import solve_ivp

    system = problem.system
    rows, n = len(system.rows), system.n
    size = rows * n
    z = problem.start()
    v0 = system.forward(system.frame(system.shape(z.hi)), z.pi)
    calls, until = [0], [np.inf]
    disc = np.arange(n)

    def f(t: float, y: NDArray) -> NDArray:
        calls[0] += 1
        if clock.perf_counter() > until[0]:
            raise Cutoff
        q, v = y[:size].reshape(rows, n), y[size:].reshape(rows, n)
        shape = system.shape(q)
        e, turning = system.contact(shape), system.contact_rate(shape, v)
        matrix = np.zeros((size + 2 * n, size + 2 * n))
        matrix[np.arange(size), np.arange(size)] = system.weights.ravel()
        for side in range(2):
            row = size + side * n + disc
            matrix[row, side * n + disc] = 1.0
            matrix[row, 2 * n + disc] = -e[side]
        matrix[:size, size:] = matrix[size:, :size].T
        right = np.concatenate([-system.gradient(shape).ravel(), (turning * v[2]).ravel()])
        return np.concatenate([y[size:], np.linalg.solve(matrix, right)[:size]])

    def run(rtol: float, seconds: float) -> Outcome:
        calls[0], until[0] = 0, clock.perf_counter() + seconds
        begun = clock.perf_counter()
        y0 = np.concatenate([z.hi.ravel(), v0.ravel()])
        found = solve_ivp(f, (0.0, problem.duration), y0, "DOP853", t_eval=(problem.duration,), rtol=rtol, atol=rtol)
        spent = clock.perf_counter() - begun
        if not found.success:
            raise ArithmeticError(found.message)
        return Outcome(found.y[:size, -1].reshape(rows, n), found.nfev // 12, calls[0], calls[0], spent)

    return Peer("saddle point, DOP853", TOLERANCES[:5], run, "NumPy, dense; index-1 form, so the constraint drifts")
