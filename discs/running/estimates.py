"""Error estimates from runs with different steps: their differences, the observed order, and the part left by sweeps."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from discs.arrays import Float
from discs.problem import Problem, State
from discs.skew import SkewGradient
from discs.solution import Solution

LEAST_ORDER = 0.5  # lower bound of an observed order; an error of this order or less has stalled
MOST_ORDER = 2.0  # upper bound of an order in an estimate; higher orders vary from run to run
SAFETY = 1.5  # factor of estimates
ROUNDED = 1e-12  # a quantity below it, in units of its scale, is rounding only
SWEPT = 0.1  # part of a tolerance that sweeps may leave as an error ...
FIRST_SWEPT = 0.03  # ... in the first run: quantities may turn out to be smaller than one
LEFT = 0.5  # error that the sweeps of a step leave, in units of their tolerance; measured: at most 0.4 (rings), mostly 0.04
LEFT_RATE = 10.0  # the same of a rate, in units of their tolerance over the step
LEAST_SWEPT = 1e-16  # least tolerance of sweeps: rounding

RATES = ("omega", "phi_rate", "x_rate", "y_rate")
DERIVED = (*RATES, "slope_x", "slope_y", "contact_force", "modified_energy")


def differences(one: Solution, other: Solution, names: Iterable[str] | None = None) -> dict[str, float]:
    """The largest difference of two runs over discs and frames, of some quantities; None for every recorded one."""
    names = compared(one) if names is None else names
    return {name: float(np.abs(getattr(one, name) - getattr(other, name)).max()) for name in names}


def compared(run: Solution) -> list[str]:
    """Names of the quantities that a run records."""
    assert run.problem is not None
    recorded = (*run.problem.system.rows, *DERIVED, "energy")
    return [name for name in recorded if getattr(run, name) is not None]


def sizes(run: Solution, names: Iterable[str]) -> dict[str, float]:
    """The largest value of each quantity; its scale (length or radian, otherwise 1) where the value is rounding only."""
    assert run.problem is not None
    scale = _scales(run.problem.system)

    def size(name: str) -> float:
        largest = float(np.abs(getattr(run, name)).max())
        return largest if largest > ROUNDED * scale.get(name, 0.0) else scale.get(name, 1.0)

    return {name: size(name) for name in names}


def orders(earlier: Solution, run: Solution, finer: Solution, most: int, names: Iterable[str] | None = None) -> dict[str, float]:
    """The order p of each quantity's error C h^p, from two runs and a third with shorter steps as reference."""
    shorter = math.log(earlier.stats["dt"] / run.stats["dt"])
    before, after = differences(earlier, finer, names), differences(run, finer, names)
    found = {}
    for name, off in after.items():
        order = math.log(before[name] / off) / shorter if off and before[name] else most if before[name] or not off else 0.0
        found[name] = min(max(order, LEAST_ORDER), float(most))
    return found


def errors(
    run: Solution, finer: Solution, order: Mapping[str, float], swept: float, names: Iterable[str] | None = None
) -> dict[str, float]:
    """Estimated errors of a run, largest over discs and frames, from one with shorter steps; see `discs.running.tolerance`.

    order : observed orders, 1 where one is missing. swept : tolerance of the sweeps of `run`; the errors that they leave are added.
        The error of a conserved energy is its drift.
    """
    assert run.problem is not None
    ratio, more = run.stats["dt"] / finer.stats["dt"], unswept(run, swept)
    found = {}
    for name, off in differences(run, finer, names).items():
        part = 1 - ratio ** -min(order.get(name, 1.0), MOST_ORDER)
        found[name] = SAFETY * off / part + more.get(name, 0.0)
    return with_energy(found, run) if names is None else found


def with_energy(found: dict[str, float], run: Solution) -> dict[str, float]:
    """The errors, with the drift of a conserved energy as its error."""
    assert run.problem is not None
    return found | {"energy": float(np.abs(run.energy - run.problem.energy()).max())} if run.problem.conserves else found


def worst(errors: Mapping[str, float], bound: Mapping[str, float], size: Mapping[str, float]) -> float:
    """The largest error in units of its tolerance; quantities without one count as exact."""
    return max(errors.get(name, 0.0) / (tol * size[name]) for name, tol in bound.items())


def unswept(run: Solution, tolerance: float) -> dict[str, float]:
    """Errors of positions, angles and their rates that the sweeps of a run, to a tolerance, may leave."""
    assert run.problem is not None
    return {name: tolerance * most for name, most in left(run.problem.system, run.stats["dt"], float(run.t[-1])).items()}


def left(system: SkewGradient, dt: float, end: float) -> dict[str, float]:
    """Errors of positions, angles and their rates that sweeps leave at the time `end`, in units of their tolerance.

    The sweeps of a step end when they change its moves by no more than their tolerance, in units of the scale. The remaining
    errors of the steps add up, at worst linearly.
    """
    moves = {name: LEFT * end / dt * scale for name, scale in _scales(system).items()}
    length = float(system.scale[0])
    rates = {"omega": 1.0, "phi_rate": 1.0, "x_rate": length, "y_rate": length}
    return moves | {name: LEFT_RATE * scale / dt for name, scale in rates.items()}


def sweeps_to(problem: Problem, bound: Mapping[str, float], size: Mapping[str, float], dt: float, end: float) -> float:
    """The tolerance of sweeps that leaves errors of at most a part of the tolerances `bound`; less while sizes are unknown ({})."""
    most = left(problem.system, dt, end)
    parts = [tol * size.get(name, 1.0) / most.get(name, LEFT_RATE * end / dt) for name, tol in bound.items()]
    return max((SWEPT if size else FIRST_SWEPT) * min(parts), LEAST_SWEPT)


def nudged(problem: Problem) -> Problem:
    """The problem with initial positions and angles changed by one unit in the last place, up or down at random."""
    start, rng = problem.initial, np.random.default_rng(0)

    def nudge(value: Float) -> Float:
        near: Float = np.nextafter(value, value + rng.choice((-1.0, 1.0), value.shape))
        return near

    moved = {name: nudge(np.array(getattr(start, name))) for name in problem.system.rows}
    rates = {"omega": start.omega, "phi_rate": start.phi_rate}
    return replace(problem, initial=State(**moved, **rates))


def _scales(system: SkewGradient) -> dict[str, float]:
    return dict(zip(system.rows, system.scale.tolist(), strict=True))
