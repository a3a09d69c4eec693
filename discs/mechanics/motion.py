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
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.mechanics.drift import Drift
from discs.mechanics.equations import Equations
from discs.mechanics.rank_drops import RankDrops
from discs.mechanics.sizes import Sizes, residual_size
from discs.mechanics.stiffness import Stiffness
from discs.warn import warn

METHODS = ("auto", "DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
EXPLICIT = ("DOP853", "RK45", "RK23")  # of one step: the state can be corrected after each
LEAST_RTOL = 100 * float(np.finfo(float).eps)
DRIFT_WARNING = 0.01  # relative to the largest kinetic energy, or to a constraint's size
STALLED = 1000  # so many steps over less than 1e-6 of the time span stop the integration
STALLED_NEAR = 50  # the same near dependent rows


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A motion at F times: coordinates, velocities (F, m), multipliers (F, c), energy and largest |A v - b| (F,).

    mu : (F, c), the charges of a vakonomic motion, see `discs.mechanics.vakonomic`; None if it is nonholonomic.
    stats : "method", "rtol" as used, "steps", "evaluations" (of accelerations), "rank_drops" (times at which constraints were
        dependent), and "derivatives": of each formula how they were taken and their largest relative error at the frames.

    Multipliers are nan at a moment when rows of A are dependent: they are not determined then.
    """

    t: Float
    q: Float
    v: Float
    multipliers: Float
    energy: Float
    residual: Float
    mu: Float | None = None
    stats: dict[str, Any] = field(default_factory=dict)


class Rate:
    """d/dt of (q, v, mu); nan where it is not finite, which makes the solver shorten its step; `trouble` is the cause."""

    def __init__(self, system: Equations) -> None:
        self.system, self.m = system, len(system.names)
        self.trouble, self.evaluations = "", 0

    def __call__(self, t: float, y: Float) -> Float:
        self.evaluations += 1
        if not np.isfinite(y).all():
            return np.full_like(y, np.nan)
        q, v, mu = np.split(y, [self.m, 2 * self.m])
        try:
            found = self.system.accelerations(q, v, mu if mu.size else None)
        except (ValueError, ArithmeticError) as error:  # of the formulas, or of a singular saddle point
            self.trouble = str(error)
            return np.full_like(y, np.nan)
        return np.concatenate([v, found.acceleration, -found.multipliers[: mu.size]])


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
) -> Trajectory:
    """`MechanicalSystem.integrate` for q, v and mu that are checked."""
    t = np.atleast_1d(checks.array("times", times))
    if t.ndim != 1 or t.size < 2 or not np.isfinite(t).all() or not (np.all(np.diff(t) > 0) or np.all(np.diff(t) < 0)):
        raise ValueError("times must be at least two, all increasing or all decreasing; the first is that of q and v")
    checks.choice("method", method, METHODS)
    if checks.number("rtol", rtol, positive=True) < LEAST_RTOL:
        raise ValueError(f"rtol must be at least {LEAST_RTOL:.3g}, as doubles are rounded; got {rtol!r}")
    start = np.concatenate([q, v] if mu is None else [q, v, mu])
    if atol is not None:
        atol = checks.field("atol", atol, start.size, least=0.0)
    if not np.isfinite(height := system.potential(q)):
        raise ValueError(f"V must be finite at the start; V(q) = {height:g}")
    off = np.abs(system.residual(q, v))
    wrong = off > 1e-9 * residual_size(system, q, v)
    if wrong.any():
        worst = int(np.argmax(np.where(wrong, off, 0)))
        raise ValueError(
            f"v must obey the constraints; that of {system.owners[worst]} is off by {off[worst]:.3g}: "
            "take consistent_velocity(q, v)"
        )
    system.accelerations(q, v, mu)  # raises an error of the initial state directly, and examines the derivatives
    rtol = _within_reach(system, rtol)
    found, stats = _follow(system, start, t, method, rtol, atol, progress)
    path = _trajectory(system, t, found, mu is not None, stats)
    _watch(system, path)
    return path


def _within_reach(system: Equations, rtol: float) -> float:
    """rtol or, with a warning, the error of the formulas' derivatives if that is larger."""
    error, name = max(((f.error, f.name) for f in system.formulas), default=(0.0, ""))
    if error <= 10 * rtol:
        return rtol
    warn(
        f"derivatives of {name}(q) have an error of {error:.1g}, as it has more rounding than doubles have, or is not smooth; "
        f"rtol is raised from {rtol:g} to {error:.1g}"
    )
    return error


def _follow(
    system: Equations,
    start: Float,
    times: Float,
    method: str,
    rtol: float,
    atol: Float | None,
    progress: bool,
) -> tuple[Float, dict[str, Any]]:
    """(q, v, mu) at all times, and statistics."""
    from tqdm import tqdm

    rate, m, end = Rate(system), len(system.names), times[-1]
    span, direction = abs(end - times[0]), float(np.sign(end - times[0]))
    sizes = Sizes(system, start, rate(times[0], start), span)
    drift, stiffness = Drift(system, sizes), Stiffness()
    ranks = RankDrops(system, sizes, drift)
    kind = "DOP853" if method == "auto" else method
    found, done = np.empty((times.size, start.size)), 1
    found[0], steps, moments = start, 0, []
    recent: deque[float] = deque([times[0]], maxlen=STALLED)

    def absolute(y: Float) -> Float:
        return 1e-3 * rtol * sizes.of(y) if atol is None else atol

    def solver_from(t: float, y: Float, step: float | None = None) -> "scipy.integrate.OdeSolver":
        first = None if step is None else min(step, abs(end - t))
        made = getattr(scipy.integrate, kind)(rate, t, y, end, rtol=rtol, atol=absolute(y), first_step=first)
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
                drift.add(y_before[:m], y[:m], solver.t - before)
                y = drift.corrected(y) if kind in EXPLICIT else y
                large = np.abs(y - solver.y) > 100 * (rtol * np.abs(y) + absolute(y))
                again = ranks.crossed(solver.y) or bool(large.any())
            recent.append(before if again else solver.t)
            count = STALLED if not ranks.words() else STALLED_NEAR
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
                drift.add(solver.y[:m], over.y[:m], over.end - solver.t)
                bar.update(abs(over.end - solver.t))
                solver = solver_from(over.end, drift.corrected(over.y), abs(over.end - solver.t))
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


def _trajectory(system: Equations, t: Float, found: Float, charged: bool, stats: dict[str, Any]) -> Trajectory:
    m = len(system.names)
    path, speed, charges = np.split(found, [m, 2 * m], axis=1)
    multipliers = np.full((t.size, len(system.owners)), np.nan)
    errors = dict.fromkeys((f.name for f in system.formulas), 0.0)
    for frame, (q, v, mu) in enumerate(zip(path, speed, charges, strict=True)):
        try:
            multipliers[frame] = system.accelerations(q, v, mu if charged else None).multipliers
        except ValueError:
            if not stats["rank_drops"]:
                raise
        errors = {f.name: max(errors[f.name], f.error) for f in system.formulas}
    stats["derivatives"] = {f.name: {"how": f.how, "error": errors[f.name]} for f in system.formulas}
    energy = np.array([system.energy(*z) for z in zip(path, speed, strict=True)])
    residual = np.array([np.abs(system.residual(*z)).max(initial=0.0) for z in zip(path, speed, strict=True)])
    return Trajectory(t, path, speed, multipliers, energy, residual, charges if charged else None, stats)


def _conserving(system: Equations, path: Trajectory) -> bool:
    """Whether the forces conserve the energy, as those of L do: v.f + d(v.Mv/2 + V)(v) = 0 with v held fixed, at all frames.

    A `force` that a user gave instead of that of L may damp or drive.
    """
    for q, v in zip(path.q, path.v, strict=True):
        step = 1e-5 * np.abs(path.q).max() / max(float(np.abs(v).max()), 1e-300)
        rise = (system.energy(q + step * v, v) - system.energy(q - step * v, v)) / (2 * step)
        power = float(v @ system.force(q, v))
        rounding = 1e-11 * np.abs(path.energy).max() / step
        if abs(power + rise) > 1e-3 * (abs(power) + abs(rise)) + rounding:
            return False
    return True


def _watch(system: Equations, path: Trajectory) -> None:
    """Warn if a conserved energy has changed, or a constraint is violated."""
    method, cure = path.stats["method"], f"the motion may not be trusted; take a smaller rtol than {path.stats['rtol']:g}"
    kinetic = np.array([0.5 * v @ (system.mass(q) @ v) for q, v in zip(path.q, path.v, strict=True)])
    off = np.abs(path.energy - path.energy[0])
    rounding = 1e-12 * np.abs(path.energy - kinetic).max()
    f = int(np.argmax(off))
    if not np.any(system.drive) and off[f] > DRIFT_WARNING * kinetic.max() + rounding and _conserving(system, path):
        warn(
            f"{method}: energy is conserved, but at t = {path.t[f]:g} it is {path.energy[f]:.3g} and not {path.energy[0]:.3g}: "
            f"{cure}"
        )
    for t, q, v in zip(path.t, path.q, path.v, strict=True):
        left = np.abs(system.residual(q, v)) > DRIFT_WARNING * residual_size(system, q, v)
        if left.any():
            owner = system.owners[int(np.argmax(left))]
            warn(f"{method}: at t = {t:g} the velocity violates the constraint of {owner} by over 1 %: {cure}")
            return
