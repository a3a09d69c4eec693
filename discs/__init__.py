"""N rolling discs joined by springs: a finite-dimensional nonholonomic mechanical system."""

from discs.chain import Chain
from discs.integrators import Leapfrog, Midpoint, RK4, Suzuki4
from discs.problem import Problem, State
from discs.simulate import SimulationError, simulate, suggest_dt
from discs.solution import Solution

__all__ = [
    "Chain",
    "Leapfrog",
    "Midpoint",
    "Problem",
    "RK4",
    "SimulationError",
    "Solution",
    "State",
    "Suzuki4",
    "simulate",
    "suggest_dt",
]
