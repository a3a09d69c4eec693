"""N rolling discs joined by springs: a finite-dimensional nonholonomic mechanical system."""

from discs.archive import load
from discs.chain import Chain, SteeredChain
from discs.friction import first_slip, friction_needed
from discs.integrators import RK4, Gauss4, Gauss6, Gauss8, Integrator, KahanLi6, Leapfrog, McLachlanPerlmutter, Midpoint, Suzuki4
from discs.lagrange import lagrange_dalembert
from discs.marching import SimulationError
from discs.mechanics import MechanicalSystem
from discs.problem import Problem, State
from discs.simulation import simulate
from discs.solution import Solution
from discs.step import suggest_dt

__all__ = [
    "RK4",
    "Chain",
    "Gauss4",
    "Gauss6",
    "Gauss8",
    "Integrator",
    "KahanLi6",
    "Leapfrog",
    "McLachlanPerlmutter",
    "MechanicalSystem",
    "Midpoint",
    "Problem",
    "SimulationError",
    "Solution",
    "State",
    "SteeredChain",
    "Suzuki4",
    "first_slip",
    "friction_needed",
    "lagrange_dalembert",
    "load",
    "simulate",
    "suggest_dt",
]
