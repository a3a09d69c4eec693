"""Whether a run may be trusted: its energy, its steps, and the warnings of `simulate`."""

import numpy as np

from discs.arrays import Float
from discs.integrators import METHODS
from discs.problem import BLOW_UP, Problem
from discs.running.whole_steps import steps_before
from discs.solution import Solution
from discs.stats import STEP_ERROR_WARNING, Stats, doubts

ENERGY_DRIFT_WARNING = 0.01  # relative
AIM = 1e-3  # relative error for which a warning suggests a step


def doubted(problem: Problem, run: Solution) -> str:
    """The warning for a run that may not be trusted; empty if there is none."""
    method = run.stats["method"]
    said = lost_energy(problem, method, run.t, run.energy, run) if run.balance is None else lost_balance(problem, method, run)
    stats = run.stats
    doubtful = (
        stats.get("unconverged") or stats.get("step_error", 0.0) > STEP_ERROR_WARNING
    )  # first, as it is cheap and most runs pass
    if doubtful and (reasons := doubts(stats)):
        joint = "; and " if said else ""
        said += f"{joint}{method}: {'; '.join(reasons)}: the run may not be trusted; take {_shorter(stats)}, or tol=1e-3"
    return said


def _shorter(stats: Stats) -> str:
    """A suggested dt, in words: with it steps converge, and the error is AIM if it goes like the square of dt."""
    shorter: float = stats["dt"] * np.sqrt(min(AIM / (stats.get("step_error") or AIM), 1.0))
    return f"dt = {min(shorter, stats.get('converging_dt', np.inf)):.2g}"


def lost_balance(problem: Problem, method: str, run: Solution) -> str:
    """The warning if energy - work + dissipated of a run drifts by more than ENERGY_DRIFT_WARNING of the largest of them."""
    terms = np.stack([run.energy, run.work, run.dissipated])
    taken = run.dissipated
    if _damped(method):  # a short step to a frame has its own error of a fast decay, where the steps are right
        taken = taken[[steps_before(float(t), run.stats["dt"])[1] == 0 for t in run.t]]
    if (falls := float(np.diff(taken, prepend=0.0).min(initial=0.0))) < -1e-6 * np.abs(terms).max():
        way = "take a smaller dt" + ("" if _damped(method) else ', or "radau5"')
        said = f"dampers only take energy, but between two frames they gave {-falls:.3g}: the run may not be trusted"
        return f"{method}: {said}; {way}"
    off = np.abs(run.energy - problem.energy() - run.work + run.dissipated)
    worst = int(off.argmax())
    if off[worst] <= ENERGY_DRIFT_WARNING * np.abs(terms).max():
        return ""
    return (
        f"{method}: the change of energy is work less what dampers took, but at t = {run.t[worst]:g} it is off by "
        f'{off[worst]:.3g}: the run may not be trusted; {_damped(method)}take a smaller dt, or "midpoint"'
    )


def _damped(method: str) -> str:
    """The cause of lost energy if a method damps."""
    return f"{method} damps what its steps do not resolve: " if method in METHODS and METHODS[method].damps else ""


def lost_energy(problem: Problem, method: str, t: Float, energy: Float, run: Solution | None = None) -> str:
    """The warning if energies (F,) at times (F,) drift from the initial one by more than ENERGY_DRIFT_WARNING; else empty.

    The drift is relative to the largest kinetic energy that is possible or, if loads set no bound, to the largest energy of `run`
    without that of loads.
    """
    off, load = energy - problem.energy(), problem.system.load
    most = problem.blown_up / BLOW_UP
    if load is not None and load.conservative and most == np.inf and run is not None:
        paths = np.stack([getattr(run, row) for row in problem.system.rows], axis=1)
        most = max(float(e) - load.potential(time, q) for time, e, q in zip(t, energy, paths, strict=True))
    allowed = ENERGY_DRIFT_WARNING * most
    if off.dot(off) < allowed * allowed:  # then none is larger than allowed; a quick test, which most runs pass
        return ""
    worst = int(np.abs(off).argmax())
    if abs(off[worst]) <= allowed:
        return ""
    return (
        f"{method}: energy is conserved, but at t = {t[worst]:g} it is {energy[worst]:.3g} and not {problem.energy():.3g}: the run "
        f'may not be trusted; {_damped(method)}take a smaller dt, or a method that keeps energy, as "midpoint"'
    )
