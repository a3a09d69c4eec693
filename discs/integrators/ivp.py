"""SciPy's integrators on the reduced equations: for comparisons, and for step control by local tolerances."""

import signal
from abc import ABC
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs import checks
from discs.arrays import Float
from discs.chains.rolling_discs import RollingDiscs
from discs.integrators import solvers
from discs.integrators.base import Integrator
from discs.integrators.work import Cut, Frame, Work
from discs.kernels import dop853
from discs.kernels.direct import direct
from discs.kernels.shared import columns
from discs.skew import Parameters, Phase

NODES = np.polynomial.legendre.leggauss(5)


class Reduced:
    """The reduced equations q. = C pi, pi. = -C^T (grad V - f) as y. = f(t, y). y lists (x, y, theta, pi) of disc 0, of disc 1, …
    (with own headings x, y, theta, phi and both momenta).

    Parameters
    ----------
    system : the chain.
    chain : `system.parameters` for the compiled form, None for the plain form.
    """

    def __init__(self, system: RollingDiscs, chain: Parameters = None) -> None:
        self.system, self.chain, self.rows, self.n = system, chain, len(system.rows), system.n
        self.each: int = self.rows + columns(self.rows)  # unknowns of a disc

    def join(self, q: Float, pi: Float) -> Float:
        """y from positions (rows, n) and momenta."""
        return np.concatenate([q, np.atleast_2d(pi)]).T.ravel()

    def split(self, y: Float) -> Phase:
        """Positions and momenta from y."""
        state = y.reshape(self.n, -1).T
        q, pi = np.ascontiguousarray(state[: self.rows]), np.ascontiguousarray(state[self.rows :])
        return Phase(q, np.zeros_like(q), pi if len(pi) > 1 else pi[0])

    def __call__(self, t: float, y: Float) -> Float:
        """The rate of y."""
        if self.chain is not None:
            import discs.kernels.driver as driver

            out, chain, load = np.empty_like(y), self.chain, self.system.load
            if load is not None:
                chain = chain._replace(load=load.timed(np.array([t]), 1.0))
            driver.reduced(chain, t, np.ascontiguousarray(y), out)
            if load is None or np.isfinite(out).all():
                return out  # a bad value of a user's function is NaN; the plain form raises
        z = self.split(y)
        shape = self.system.shape(z.hi)
        c = self.system.basis(shape)
        return self.join(self.system.forward(c, z.pi), -self.system.pull(c, self.system.gradient(shape), t, z, 0.0, z.pi))

    @property
    def width(self) -> int:
        """Half the bandwidth of the Jacobian of f for an open chain."""
        return (self.system.reach + 1) * self.each - 1

    def sparsity(self) -> "scipy.sparse.csc_array":
        """The sparsity pattern of the Jacobian of f."""
        n, reach = self.n, self.system.reach
        offsets = [j for j in range(-reach, reach + 1) if abs(j) < n]
        if self.system.closed:
            offsets += [j + side * n for j in range(-reach, reach + 1) for side in (-1, 1) if 0 < abs(j + side * n) < n]
        near = scipy.sparse.diags_array(np.ones((len(set(offsets)), 1)), offsets=sorted(set(offsets)), shape=(n, n))
        return scipy.sparse.csc_array(scipy.sparse.kron(near, np.ones((self.each, self.each))))


@dataclass(frozen=True)
class SolveIvp(Integrator, ABC):
    """A method of `scipy.integrate.solve_ivp` on y = (q, pi), with adaptive steps of at most dt; frames are interpolated.

    Energy is conserved only to the tolerances. The rolling constraint holds identically in these variables.

    Parameters
    ----------
    rtol, atol : tolerances of the error of a step, relative to |y| and absolute. (pi of a disc goes like the root of its share of
        length.)
    """

    rtol: float = 1e-6
    atol: float = 1e-9

    preserves: ClassVar[str] = "the rolling constraint"
    reference: ClassVar[str] = "Virtanen et al., SciPy, Nature Methods 17 (2020) 261; scipy.integrate.solve_ivp"
    stability_limit: ClassVar[float] = np.inf
    adaptive: ClassVar[bool] = True

    def __post_init__(self) -> None:
        checks.number("rtol", self.rtol, positive=True)
        checks.number("atol", self.atol, positive=True)

    @property
    def compiles(self) -> bool:
        return True

    def options(self, f: Reduced) -> dict[str, Any]:
        """The options of the solver about the Jacobian."""
        return {}

    def begin(self, system: RollingDiscs, z: Phase, h: float, work: Work, chain: Parameters = None) -> "Course":
        f = Reduced(system, chain)
        method = getattr(scipy.integrate, self.name)
        y = f.join(z.hi + z.lo, z.pi)
        solver = method(f, 0.0, y, np.inf, rtol=self.rtol, atol=self.atol, max_step=h, **self.options(f))
        if hasattr(solver, "lu"):
            make = solver.lu
            solver.lu = lambda matrix: solvers.Factors(matrix, make)
        return Course(f, solver, 0.0, z, 0.0 * work.spent[::2], 0.0 * work.spent[::2])

    def advance(self, system: RollingDiscs, memory: "Course", t: float, h: float, work: Work) -> "Course":
        return memory.to(memory.time + h, work)

    def at(
        self, system: RollingDiscs, memory: "Course", t: float, tau: float, h: float, work: Work, chain: Parameters = None
    ) -> Frame:
        z = memory.to(memory.time + tau, work) if tau else memory
        return Frame(z.hi, z.lo, system.forward(system.basis(system.shape(z.hi, z.lo)), z.pi), spent=z.spent)

    def kinetic(self, system: RollingDiscs, memory: "Course", h: float) -> float:
        return 0.5 * float(np.vdot(memory.pi, memory.pi))

    def keep(self, memory: "Course") -> dict[str, Any]:
        course = {name: getattr(memory, name) for name in ("time", "hi", "lo", "pi", "past", "spent")}
        return course | {f"solver.{name}": value for name, value in solvers.keep(memory.solver).items()}

    def recall(self, memory: "Course", kept: dict[str, Any]) -> "Course":
        of_solver = {name.removeprefix("solver."): value for name, value in kept.items() if name.startswith("solver.")}
        solvers.recall(memory.solver, of_solver)
        z = Phase(kept["hi"], kept["lo"], kept["pi"])
        return Course(memory.f, memory.solver, float(kept["time"]), z, kept["past"], kept["spent"])


class Course:
    """A running SciPy solver and its interpolated state at a time.

    past, spent : (2,), work of loads and dissipated energy until the last step of the solver (one array for all states of it), and
    until the time: integrals over the interpolated motion, by NODES in each step. With `Work.shares` (2, 1 + L).
    """

    def __init__(
        self,
        f: Reduced,
        solver: "scipy.integrate.OdeSolver",
        time: float,
        z: Phase,
        past: Float,
        spent: Float,
    ) -> None:
        self.f, self.solver, self.time, self.past, self.spent = f, solver, time, past, spent
        self.hi, self.lo, self.pi = z

    def to(self, time: float, work: Work) -> "Course":
        """The same solver, stepped ahead as needed, and its state at a later time."""
        while self.solver.t < time:
            self.past += self._spent(self.solver.t, work)
            message = self.solver.step()
            work.taken += 1
            if self.solver.status == "failed":
                raise ArithmeticError(f"{type(self.solver).__name__} failed at t = {self.solver.t:g}: {message}")
        work.gradients, work.solves = self.solver.nfev, self.solver.nlu
        z = self.f.split(self.solver.dense_output()(time))
        return Course(self.f, self.solver, time, z, self.past, self.past + self._spent(time, work))

    def _spent(self, end: float, work: Work) -> Float:
        """What loads do in the last step of the solver until a time, like `past`: work and dissipated energy."""
        load, system, start, found = self.f.system.load, self.f.system, self.solver.t_old, 0.0 * self.past
        if load is None or load.conservative or start is None:
            return found
        motion = self.solver.dense_output()
        for node, weight in zip(*NODES, strict=True):
            t = start + 0.5 * (1 + node) * (end - start)
            z = self.f.split(motion(t))
            v = system.forward(system.basis(system.shape(z.hi)), z.pi)
            found += 0.5 * weight * (end - start) * work.power(load, t, z.hi, v)
        return found


class RK45(SolveIvp):
    """Dormand and Prince's pair of orders 5 and 4; explicit."""

    name: ClassVar[str] = "RK45"
    order: ClassVar[int] = 5


class DOP853(SolveIvp):
    """Dormand and Prince's method of order 8; explicit. Compiled runs without loads, `want` and checkpoint are taken whole, by
    `discs.kernels.dop853`; others go step by step, by SciPy, and differ in the last digits."""

    name: ClassVar[str] = "DOP853"
    order: ClassVar[int] = 8
    runs_whole: ClassVar[bool] = True

    def whole(self, system: RollingDiscs, chain: Parameters, z: Phase, h: float, bound: float, album: Any) -> Work | None:
        """See `discs.kernels.dop853`."""
        method, state = dop853.coefficients(), Phase(z.hi, z.lo, z.pi if z.pi.ndim == 2 else z.pi[None])
        run = direct(system.known, dop853.run, method, chain)
        frames = album.times, album.q, album.rates, album.energy_slip
        done, taken, evaluations = run(method, chain, state, self.rtol, self.atol, h, bound, *frames)
        if done < 0:
            signal.raise_signal(signal.SIGINT)
            raise Cut
        return Work(gradients=evaluations, taken=taken) if done == album.times.size else None


class Radau(SolveIvp):
    """Radau IIA of order 5; implicit, damps unresolved oscillations."""

    name: ClassVar[str] = "Radau"
    damps: ClassVar[bool] = True
    order: ClassVar[int] = 5

    def options(self, f: Reduced) -> dict[str, Any]:
        return {"jac_sparsity": f.sparsity()}


class BDF(SolveIvp):
    """Backward differences of orders 1 to 5. Orders above 2 are unstable for oscillations, so it is slow for many discs."""

    name: ClassVar[str] = "BDF"
    damps: ClassVar[bool] = True
    order: ClassVar[int] = 5

    def options(self, f: Reduced) -> dict[str, Any]:
        return {"jac_sparsity": f.sparsity()}


class LSODA(SolveIvp):
    """Adams' methods or backward differences, chosen by the solver (ODEPACK)."""

    name: ClassVar[str] = "LSODA"
    order: ClassVar[int] = 5

    def options(self, f: Reduced) -> dict[str, Any]:
        return {} if f.system.closed else {"lband": f.width, "uband": f.width}
