"""N rolling discs joined by springs: a finite-dimensional nonholonomic mechanical system."""

from discs.chain import Chain, SteeredChain
from discs.integrators import RK4, Integrator, Leapfrog, Midpoint, Suzuki4
from discs.problem import Problem, State
from discs.simulation import SimulationError, simulate, suggest_dt
from discs.solution import Solution

__all__ = [
    "RK4",
    "Chain",
    "Integrator",
    "Leapfrog",
    "Midpoint",
    "Problem",
    "SimulationError",
    "Solution",
    "State",
    "SteeredChain",
    "Suzuki4",
    "simulate",
    "suggest_dt",
]
