"""The one door to a run: `simulate(problem, method, ...)`."""

import time as clock
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import LinearOperator, eigsh
from tqdm import tqdm

from discs import checks
from discs.integrators import Integrator, Work, find
from discs.integrators.base import Frame
from discs.problem import Problem
from discs.solution import Solution
from discs.system import SkewGradient

WANTS = ("velocity", "slope", "contact_force")


class SimulationError(RuntimeError):
    """A run that could not go on.

    Attributes
    ----------
    step, time, disc : where it stopped.
    """

    def __init__(self, message: str, step: int, time: float, disc: int) -> None:
        super().__init__(f"{message} (step {step}, time {time:g}, disc {disc})")
        self.message, self.step, self.time, self.disc = message, step, time, disc

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.message, self.step, self.time, self.disc)


def simulate(
    problem: Problem,
    method: str | Integrator = "midpoint",
    dt: float | None = None,
    frames: int | ArrayLike = 101,
    want: Iterable[str] = (),
    progress: bool = True,
) -> Solution:
    """Run a problem.

    Parameters
    ----------
    problem : what to compute.
    method : name of an integrator ("midpoint", "suzuki4", "rk4", "leapfrog"), or one with its own settings, as
        `Midpoint(sweeps=2)`.
    dt : time step; None takes `suggest_dt(problem, method)`.
    frames : how many frames, equally spaced over the duration, or their times, increasing. A frame between two steps is
        reached by a shorter step of its own, so asking for frames never changes the trajectory.
    want : what else to record: "velocity", "slope", "contact_force", and what the method offers (leapfrog: "modified_energy").
    progress : show a progress bar on anything that takes over a second.

    Returns
    -------
    Solution with exactly the frames asked for.

    Raises
    ------
    ValueError : for an unknown method or quantity, a step that is not positive, or frames outside the duration.
    SimulationError : as soon as the kinetic energy exceeds ten times the total energy of the start, which no exact
        motion does, something is not finite, or (rolling="unit") a disc loses its heading.
    """
    if not isinstance(problem, Problem):
        raise ValueError(f"simulate takes a Problem, as `compare.lump(scene, n)` makes; got {type(problem).__name__}")
    integrator = find(method)
    want = _wanted(want, integrator)
    suggested = dt is None
    h = suggest_dt(problem, integrator) if dt is None else checks.number("dt", dt, positive=True)
    times = frame_times(frames, problem.duration)
    system = problem.system
    # the number of whole steps before a frame; a frame within rounding of a step is taken at the step
    before = np.floor(times / h * (1 + 4e-16) + 1e-9).astype(np.int64)
    after = np.where(times - before * h > 1e-9 * h, times - before * h, 0.0)

    if set(want) & set(integrator.offers) and not system.quadratic:
        raise ValueError(f"{integrator.offers[0]} needs a quadratic potential, which this chain has not")
    rows: dict[str, Any] = {}

    started = clock.perf_counter()
    work = Work()
    watch = _Watch(problem, integrator, h)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        memory: Any = integrator.begin(system, problem.start(), h, work)
        step = 0
        with tqdm(total=int(before[-1]), desc=integrator.name, unit="step", delay=1, disable=not progress) as bar:
            for f, last in enumerate(before):
                while step < last:
                    previous, memory = memory, integrator.advance(system, memory, h, work)
                    step += 1
                    bar.update()
                    watch.check(integrator.kinetic(system, memory, h), previous, memory, step, step * h)
                frame = integrator.at(system, memory, after[f], h, work)
                if after[f]:
                    watch.check(system.kinetic(frame.rate), memory, frame, step, times[f])
                extras = integrator.extras(system, memory, h) if set(want) & set(integrator.offers) else {}
                for name, value in (_quantities(system, frame, want) | extras).items():
                    rows.setdefault(name, np.empty((len(times), *np.shape(value))))[f] = value
    stats = {
        "method": integrator.name,
        "order": integrator.order,
        "dt": h,
        "dt_suggested": suggested,
        "steps": step,
        **vars(work),
        "seconds": clock.perf_counter() - started,
    }
    return Solution(t=times, s=problem.chain.s, stats=stats, **rows)


def _quantities(system: SkewGradient, frame: Frame, want: tuple[str, ...]) -> dict[str, Any]:
    """What a frame records, by the names that `Solution` has for it."""
    shape, rate = system.shape(frame.hi, frame.lo), frame.rate
    slip = rate[:2] - system.contact(shape) * rate[2]
    found: dict[str, Any] = dict(zip(system.rows, frame.hi + frame.lo, strict=True))
    found |= {
        "omega": rate[2],
        "energy": system.kinetic(rate) + system.potential(shape),
        "rolling_residual": np.hypot(*slip).max(),
    }
    if "velocity" in want:
        found |= {f"{name}_rate": rate[row] for row, name in enumerate(system.rows) if name != "theta"}
    if "slope" in want:
        found |= dict(zip(("slope_x", "slope_y"), system.slope(shape), strict=True))
    if "contact_force" in want:
        found["contact_force"] = system.contact_force(shape, rate)
    return found


class _Watch:
    """Stops a run that has gone wrong, and says where and why."""

    def __init__(self, problem: Problem, integrator: Integrator, h: float) -> None:
        self.system, self.integrator, self.h = problem.system, integrator, h
        # V >= 0 and H is constant, so the kinetic energy cannot exceed H; far below one unit of twist is rounding
        chain = problem.chain
        rounding = 1e-16 * (np.max(chain.torsion_stiffness) + np.max(chain.bending_stiffness)) / chain.length
        self.bound = 10 * problem.energy() + rounding

    def check(self, kinetic: float, previous: Any, memory: Any, step: int, time: float) -> None:
        """Raise SimulationError if the way from `previous` to `memory` (positions hi + lo) cannot be trusted."""
        lost = self.system.lost_heading(previous, memory)
        if lost is not None:
            raise SimulationError(
                "a disc lost its heading: its neighbours met, r' = 0, and rolling='unit' has no direction there; "
                "end the run earlier, or take a smaller dt if the motion is not resolved",
                step,
                time,
                lost,
            )
        if kinetic <= self.bound:
            return
        speed = np.abs(memory.hi[2] - previous.hi[2])
        disc = int(np.argmax(np.where(np.isfinite(speed), speed, np.inf)))
        if np.isfinite(self.integrator.stability_limit):
            name = self.integrator.name
            cause = f"dt = {self.h:g} is above the stability limit of {name!r}: take a smaller dt or 'midpoint'"
        else:
            cause = "the step has lost all digits: take a smaller dt, fewer discs or softer springs"
        what = "kinetic energy above ten times the total" if np.isfinite(kinetic) else "values are not finite"
        raise SimulationError(f"the run blew up, {what}; likely {cause}", step, time, disc)


def suggest_dt(problem: Problem, method: str | Integrator = "midpoint") -> float:
    """A step for a method: accurate to about 1e-3 for smooth motion if implicit, 0.7 of the stability limit if explicit.

    Implicit: half the time a torsion wave takes from disc to disc, at most a hundredth of the duration.
    Explicit: the limit is the method's over Omega, Omega^2 the largest eigenvalue of C^T S C at the start; 0.7 leaves room for
    headings that grow.
    """
    integrator = find(method)
    chain = problem.chain
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
    c = system.frame(shape)

    def apply(p: NDArray) -> NDArray:
        move = system.forward(c, p.reshape(z.pi.shape))
        eps = 1e-6 * problem.chain.k / max(float(np.abs(move).max()), 1e-300)
        force = system.gradient(system.moved(shape, eps * move)) - system.gradient(system.moved(shape, -eps * move))
        return system.back(c, force).ravel() / (2 * eps)

    n = z.pi.size
    if n < 40:
        return float(np.linalg.eigvalsh(np.array([apply(row) for row in np.eye(n)])).max())
    start = np.random.default_rng(0).standard_normal(n)
    operator = LinearOperator((n, n), matvec=apply, dtype=float)
    return float(eigsh(operator, k=1, which="LA", v0=start, tol=1e-3, return_eigenvectors=False)[0])


def _wanted(want: Iterable[str], integrator: Integrator) -> tuple[str, ...]:
    if not isinstance(want, Iterable):
        raise ValueError(f"want must be names of quantities; got {want!r}")
    given = (want,) if isinstance(want, str) else tuple(want)
    return tuple(checks.choice("want", name, (*WANTS, *integrator.offers)) for name in given)


def frame_times(frames: int | ArrayLike, duration: float) -> NDArray:
    """The times of frames, (F,), from their number or themselves; see `simulate`."""
    if np.ndim(frames) == 0:
        count = checks.whole("frames", frames, 1, "the last state is always one")
        return np.linspace(0.0, duration, count) if count > 1 else np.array([duration])
    try:
        times = np.asarray(frames, dtype=float)
    except (TypeError, ValueError):
        times = np.array([np.nan])
    inside = np.isfinite(times).all() and times.ndim == 1 and times.size and times[0] >= 0 and times[-1] <= duration
    if not inside or (np.diff(times) <= 0).any():
        raise ValueError(f"frames must be increasing times within [0, {duration:g}], or their number; got {frames!r}")
    return times
