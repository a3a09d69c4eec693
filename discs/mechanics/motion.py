r"""Time integration of a mechanical system by SciPy's methods, with accelerations from the saddle point.

The error of a step is bounded by rtol |y| + atol. By default atol is 1e-3 rtol times each quantity's own size
(`discs.mechanics.sizes`), so the steps do not depend on units. After each step of an explicit method q and v are projected back
onto the constraints (`discs.mechanics.drift`). If constraints become dependent at one moment, the integration continues where the
motion is smooth (`discs.mechanics.rank_drops`). If the problem is stiff, it continues with an implicit method
(`discs.mechanics.stiffness`).

If the equations have no finite solution at a trial state, the step is shortened. If no step is short enough, an error names the
time and the cause.
"""

from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.mechanics.bodies import Bodies
from discs.mechanics.drift import Drift
from discs.mechanics.equations import Equations
from discs.mechanics.rank_drops import RankDrops
from discs.mechanics.sizes import PROBES, Sizes, residual_size
from discs.mechanics.stiffness import Stiffness
from discs.mechanics.trajectory import Trajectory, at_frames
from discs.mechanics.watch import watch
from discs.warn import warn

METHODS = ("auto", "DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
EXPLICIT = ("DOP853", "RK45", "RK23")  # of one step: the state can be corrected after each
LEAST_RTOL = 100 * float(np.finfo(float).eps)
LEAST_STEPS = 100  # if forces or drives depend on t, so that a short signal is not stepped over
JUMP, SHORT = 1e-5, 1e-9  # velocities off a drive by this part of their size, after a step of this part of the span: it jumps
STALLED = 1000  # so many steps over less than 1e-6 of the time span stop the integration
STALLED_NEAR = 50  # the same near dependent rows


class Rate:
    """d/dt of the state y; nan where it is not finite, which makes the solver shorten its step; `trouble` is the cause.

    y is q, v, with charges mu for the vakonomic motion and, if forces or drives do work, the works of `Equations.response`.
    """

    def __init__(self, system: Equations, charges: int) -> None:
        self.system, self.m, self.charges = system, len(system.names), charges
        self.trouble, self.evaluations = "", 0

    def __call__(self, t: float, y: Float) -> Float:
        self.evaluations += 1
        if not np.isfinite(y).all():
            return np.full_like(y, np.nan)
        q, v, mu, works = np.split(y, np.cumsum([self.m, self.m, self.charges]))
        try:
            found, power = self.system.response(q, v, mu if mu.size else None, t)
        except (ValueError, ArithmeticError) as error:  # of the formulas, or of a singular saddle point
            self.trouble = str(error)
            return np.full_like(y, np.nan)
        return np.concatenate([v, found.acceleration, -found.multipliers[: mu.size], power[: works.size]])


def integrate(
    system: Equations,
    q: Float,
    v: Float,
    mu: Float | None,
    times: ArrayLike,
    method: str,
    rtol: float,
    atol: ArrayLike | None,
    progress: bool,
    max_step: float | None = None,
) -> Trajectory:
    """`MechanicalSystem.integrate`, with its errors, for q, v and mu that are checked."""
    t = np.atleast_1d(checks.array("times", times))
    if t.ndim != 1 or t.size < 2 or not np.isfinite(t).all() or not (np.all(np.diff(t) > 0) or np.all(np.diff(t) < 0)):
        raise ValueError("times must be at least two, all increasing or all decreasing; the first is that of q and v")
    checks.choice("method", method, METHODS)
    if checks.number("rtol", rtol, positive=True) < LEAST_RTOL:
        raise ValueError(f"rtol must be at least {LEAST_RTOL:.3g}, as doubles are rounded; got {rtol!r}")
    charges, works = np.zeros(0) if mu is None else mu, np.zeros(2 * system.worked)
    start = np.concatenate([q, v, charges, works])
    if atol is not None:
        atol = checks.field("atol", atol, start.size - works.size, least=0.0)
    if max_step is None:
        max_step = abs(t[-1] - t[0]) / LEAST_STEPS if system.timed else np.inf
    else:
        max_step = checks.number("max_step", max_step, positive=True)
    if not np.isfinite(height := system.potential(q)):
        raise ValueError(f"V must be finite at the start; V(q) = {height:g}")
    off = np.abs(system.residual(q, v, t[0]))
    wrong = off > 1e-9 * residual_size(system, q, v, t[0])
    if wrong.any():
        worst = int(np.argmax(np.where(wrong, off, 0)))
        raise ValueError(
            f"v must obey the constraints; that of {system.owners[worst]} is off by {off[worst]:.3g}: "
            f"take consistent_velocity(q, v{', t' * system.timed})"
        )
    if isinstance(system.bodies, Bodies):
        system.bodies.shape(q)
    system.accelerations(q, v, mu, t[0])  # raises an error of the initial state directly, and examines the derivatives
    rtol = _within_reach(system, rtol)
    found, stats = _follow(system, start, charges.size, t, method, rtol, atol, max_step, progress)
    path = at_frames(system, t, found, mu is not None, stats)
    watch(system, path)
    return path


def _within_reach(system: Equations, rtol: float) -> float:
    """rtol or, with a warning, the error of the formulas' derivatives if that is larger."""
    error, name = max(((f.error, f"{f.name}({f.arguments})") for f in system.derived), default=(0.0, ""))
    if error <= 10 * rtol:
        return rtol
    warn(
        f"derivatives of {name} have an error of {error:.1g}, as it has more rounding than doubles have, or is not smooth; "
        f"rtol is raised from {rtol:g} to {error:.1g}"
    )
    return error


def _follow(
    system: Equations,
    start: Float,
    charges: int,
    times: Float,
    method: str,
    rtol: float,
    atol: Float | None,
    max_step: float,
    progress: bool,
) -> tuple[Float, dict[str, Any]]:
    """The state (see `Rate`) at all times, and statistics."""
    from tqdm import tqdm

    rate, m, end = Rate(system, charges), len(system.names), times[-1]
    span, direction = abs(end - times[0]), float(np.sign(end - times[0]))
    probes = np.linspace(times[0], end, PROBES) if system.timed else times[:1]
    sizes = Sizes(system, start, [rate(t, start) for t in probes], charges, span)
    drift, stiffness = Drift(system, sizes, times[0]), Stiffness()
    ranks = RankDrops(system, sizes, drift)
    kind = "DOP853" if method == "auto" else method
    found, done = np.empty((times.size, start.size)), 1
    found[0], steps, moments = start, 0, []
    recent: deque[float] = deque([times[0]], maxlen=STALLED)

    def absolute(y: Float) -> Float:
        least = 1e-3 * rtol * sizes.of(y)
        return least if atol is None else np.append(atol, least[atol.size :])

    def solver_from(t: float, y: Float, step: float | None = None) -> "scipy.integrate.OdeSolver":
        first = None if step is None else min(step, abs(end - t))
        bounds = {"rtol": rtol, "atol": absolute(y), "first_step": first, "max_step": max_step}
        made = getattr(scipy.integrate, kind)(rate, t, y, end, **bounds)
        if hasattr(made, "h_abs") and not made.h_abs > 0:  # the rate was nan where SciPy looked for a first step
            made.h_abs = 1e-6 * abs(end - t)
        return made

    def record(until: float, between: Callable[[float], Float]) -> None:
        nonlocal done
        while done < times.size and direction * (times[done] - until) <= 0:
            found[done] = between(times[done])
            done += 1

    solver = solver_from(times[0], start)
    form = "{l_bar}{bar}| t = {n:.4g} of {total:.4g} [{elapsed}<{remaining}]"
    bar = tqdm(total=span, desc="motion", bar_format=form, delay=1, disable=not progress)
    with bar, np.errstate(all="ignore"):  # a trial step may overflow
        while done < times.size:
            before, y_before, said = solver.t, solver.y, solver.step()
            steps += 1
            y, drifted, again = solver.y, drift.off, False
            if solver.status != "failed":
                drift.add(y_before[:m], y[:m], before, solver.t)
                y = drift.corrected(y, solver.t) if kind in EXPLICIT else y
                large = np.abs(y - solver.y) > 100 * (rtol * np.abs(y) + absolute(y))
                again = ranks.crossed(solver.y) or bool(large.any())
            recent.append(before if again else solver.t)
            count = STALLED if not ranks.words() else STALLED_NEAR
            off = np.abs(y - solver.y)[m : 2 * m] > JUMP * sizes.of(solver.y)[m : 2 * m]
            if again and off.any() and abs(solver.t - before) < SHORT * span and callable(system.drive):
                worst = system.owners[int(np.argmax(np.abs(system.residual(solver.y[:m], solver.y[m : 2 * m], solver.t))))]
                raise RuntimeError(
                    f"the motion cannot be continued beyond t = {solver.t:.9g}: the drive b(t, q) of {worst} jumps there, and a "
                    "jump of the velocity needs an infinite force; give a drive that is continuous in t"
                )
            stalled = len(recent) >= count and abs(recent[-1] - recent[-count]) < 1e-6 * span
            if solver.status == "failed" or stalled:
                raise RuntimeError(
                    f"the motion cannot be continued beyond t = {solver.t:.9g}: {_reason(solver, rate, ranks, said)}"
                )
            if again:  # the step was too long for the constraints
                drift.off = drifted
                solver = solver_from(before, y_before, abs(solver.t - before) / 3)
                continue
            if direction * (times[done] - solver.t) <= 0:
                record(solver.t, solver.dense_output())
            bar.update(abs(solver.t - before))
            if done == times.size:
                break
            sizes.update(solver.y)
            solver.atol = absolute(solver.y)
            if y is not solver.y:
                solver.y, solver.f = y, rate(solver.t, y)
            if over := ranks.passage(rate, solver, direction, rtol):
                moments.append(float(over.moment))
                record(over.end, over.between)
                if done == times.size:
                    break
                drift.add(solver.y[:m], over.y[:m], solver.t, over.end)
                bar.update(abs(over.end - solver.t))
                solver = solver_from(over.end, drift.corrected(over.y, over.end), abs(over.end - solver.t))
            elif ranks.lost():
                raise RuntimeError(f"the motion cannot be continued beyond t = {solver.t:.9g}: {ranks.words()}")
            elif method == "auto" and kind == "DOP853" and stiffness.shown(solver):
                step = stiffness.implicit_step(rate, solver, rtol, absolute(solver.y))
                if step is not None:
                    kind = "Radau"
                    solver = solver_from(solver.t, solver.y, step)
    return found, {"method": kind, "rtol": rtol, "steps": steps, "evaluations": rate.evaluations, "rank_drops": moments}


def _reason(solver: "scipy.integrate.OdeSolver", rate: Rate, ranks: RankDrops, said: str | None) -> str:
    """Why the integration stopped."""
    if why := ranks.words() or rate.trouble:
        return why
    if said:
        return f"{said} (V = {rate.system.potential(solver.y[: rate.m]):.3g} there)"
    return f"the step has fallen to {abs(solver.step_size):.1g}; take a larger rtol, or a method for stiff problems"
