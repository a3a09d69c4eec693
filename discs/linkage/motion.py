"""Runs of linkages, `simulate(LinkageProblem(...))`."""

import time as clock
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.linkage.midpoint import Moment, Stepper
from discs.linkage.problem import LinkageProblem
from discs.running.failure import SimulationError
from discs.running.frames import frame_times
from discs.running.progress import NO_BAR, Progress
from discs.running.whole_steps import check_steps, steps_before
from discs.solution import Solution
from discs.stats import Stats

FEWEST = 50  # steps of the first run of a search
MOST = 12  # halvings of the step in a search


def run(
    problem: LinkageProblem,
    method: object = None,
    dt: float | None = None,
    frames: int | ArrayLike = 101,
    want: Iterable[str] = (),
    progress: bool = True,
    tol: object = None,
) -> Solution:
    """A run by the midpoint rule with the step dt or, without dt, with steps halved until their error is within tol (1e-4).

    The error is that of x, y relative to the length, and of theta and phi in rad, at the frames: a third of the difference of two
    runs. Other arguments and errors (ValueError, SimulationError) are those of `discs.simulate`.
    """
    if not (method is None or (isinstance(method, str) and method in ("midpoint", "auto"))):
        raise ValueError(f"a linkage runs by 'midpoint', which takes rigid links; got method={checks.shown(method)}")
    for name in checks.several("want", want, "names of quantities"):
        checks.choice("want (of a linkage)", name, ("velocity",))  # always there
    times = frame_times(frames, problem.duration)
    if dt is not None:
        if tol is not None:
            raise ValueError("give dt or tol, not both: tol finds the step")
        h = checks.number("dt", dt, positive=True)
        if h > problem.duration * (1 + 1e-12):
            raise ValueError(f"dt must be at most the duration, {problem.duration:g}; got {h:g}")
        check_steps(problem.duration, h)
        return _fixed(problem, h, times, progress)
    tolerance = 1e-4 if tol is None else checks.number("tol", tol, positive=True)
    h, last = problem.duration / FEWEST, None
    for attempt in range(1, MOST + 1):
        try:
            found = _fixed(problem, h, times, progress)
        except SimulationError:
            if attempt == MOST:
                raise
            found = None
        if found is not None and last is not None:
            error = max(
                float(np.abs(getattr(found, row) - getattr(last, row)).max()) / (3 * size)
                for row, size in zip(("x", "y", "theta", "phi"), (problem.linkage.length,) * 2 + (1.0, 1.0), strict=True)
            )
            if error <= tolerance:
                found.stats.update(Stats(tol=tolerance, attempts=attempt, step_error=error, dt_suggested=True))
                return found
        last, h = found, 0.5 * h
    raise SimulationError(f"tol = {tolerance:g} was not reached; take a larger one, or dt", 0, problem.duration, 0)


def _fixed(problem: LinkageProblem, h: float, times: Float, progress: bool) -> Solution:
    of = problem.equations
    q, w = problem.start()
    z, stepper, extra = Moment(q, w, np.zeros((2, of.links))), Stepper(of), Stepper(of)
    spent, done, rows = np.zeros(2), 0, []
    total = steps_before(float(times[-1]), h)[0]
    shown = Progress("midpoint", total) if progress else NO_BAR
    started = clock.perf_counter()

    def step(by: Stepper, z: Moment, t: float, length: float) -> tuple[Moment, Float]:
        try:
            with np.errstate(all="ignore"):
                return by.step(z, t, length)
        except ArithmeticError:
            said = (
                f"the step of {length:g} has no solution that Newton's method finds: take a smaller dt; if that does not help, "
                "rigid links and wheels lock or become dependent there"
            )
            raise SimulationError(said, done, t, int(np.argmax(np.abs(z.w[2])))) from None

    with shown:
        for time in times.tolist():
            before, rest = steps_before(time, h)
            while done < before:
                z, more = step(stepper, z, done * h, h)
                spent, done = spent + more, done + 1
                shown.update(done)
            at, more = step(extra, z, done * h, rest) if rest > 0 else (z, np.zeros(2))
            v = of.forward(at.q[3], at.w)
            rows.append((at.q, v, of.energy(at.q, at.w, time), spent + more))
    places, rates, energy, balance = (np.array(part) for part in zip(*rows, strict=True))
    stats: Stats = {
        "method": "midpoint",
        "order": 2,
        "engine": "plain",
        "plain_because": "linkages have no compiled form",
        "dt": h,
        "dt_suggested": False,
        "steps": done,
        "solves": stepper.solves + extra.solves,
        "seconds": clock.perf_counter() - started,
        "linkage": True,
    }
    if np.ptp(problem.linkage.radius) == 0:
        stats["radius"] = float(np.max(problem.linkage.radius))
    balanced = bool(np.any(of.drag)) or callable(problem.linkage.rest_curvature)
    return Solution(
        t=times,
        s=problem.linkage.s,
        x=places[:, 0],
        y=places[:, 1],
        theta=places[:, 2],
        omega=rates[:, 2],
        energy=energy,
        stats=stats,
        phi=places[:, 3],
        x_rate=rates[:, 0],
        y_rate=rates[:, 1],
        phi_rate=rates[:, 3],
        balance=balance if balanced else None,
    )
