"""Warnings before a run: where rounding stops the convergence of implicit steps, and where substeps back in time amplify."""

from typing import Any

import numpy as np

from discs.arrays import Float
from discs.chains.rolling_discs import RollingDiscs
from discs.problem import Problem
from discs.warn import warn

LOST_DIGITS_WARNING = 0.1  # of the error of a sweep that rounding leaves


def lost_digits(h: float, stiffest: Float | float) -> Any:
    """The part of its error that a sweep of a step h leaves, due to rounding in the solve with I + h^2/4 C^T S C.

    It is the largest entry of the matrix, h^2 `stiffest`, times the unit of rounding, 1.1e-16. Sweeps do not converge where it is
    near one.
    """
    return 1.1e-16 * h * h * stiffest


def warn_of_lost_digits(system: RollingDiscs, h: float) -> None:
    """Warn where rounding stops the convergence of sweeps."""
    lost = lost_digits(h, system.stiffest)
    if lost > LOST_DIGITS_WARNING:
        warn(
            f"{system.n} discs at dt = {h:g}: each sweep of a step leaves {lost:.1g} of its error, due to rounding, and the run "
            f"may not be trusted; take dt below {h * np.sqrt(LOST_DIGITS_WARNING / lost):.1g}, or fewer discs"
        )


def warn_of_growth(problem: Problem, name: str, back: float, h: float) -> None:
    """Warn where substeps back in time, the longest of them back h, meet dampers faster than they can follow.

    A midpoint substep -a multiplies a mode that decays at the rate l by (1 + a l/2)/(1 - a l/2): near a l = 2 it grows without
    bound, whatever the balance of energy, which stays exact.
    """
    rate = fastest_decay(problem)
    if back * h * rate > 1.9:
        shorter = 1.9 / (back * rate)
        warn(
            f"{name}: its substeps back in time amplify what dampers slow down at rates near {2 / (back * h):.3g} per unit of "
            f"time, and here rates go up to {rate:.3g}: the run may not be trusted; take dt below {shorter:.2g}, or 'gauss6'"
        )


def fastest_decay(problem: Problem) -> float:
    """The largest rate at which dampers slow down the initial state, the largest eigenvalue of C^T D C, by power iteration."""
    system, z = problem.system, problem.start()
    load = system.load
    if load is None or load.conservative:
        return 0.0
    c = system.basis(system.shape(z.hi))
    rest, rate = load.applied(0.0, z.hi, np.zeros_like(z.hi)), 0.0
    p = np.random.default_rng(0).standard_normal(z.pi.shape)
    for _ in range(60):
        p = p / np.linalg.norm(p)
        slowed = system.back(c, rest - load.applied(0.0, z.hi, system.forward(c, p)))
        rate, p = float(np.vdot(p, slowed)), slowed
        if not p.any():
            return 0.0
    return rate
