"""N rolling discs joined by springs: a finite-dimensional nonholonomic mechanical system."""

from discs.beside import warn_of_others
from discs.chains.chain import Chain, SteeredChain
from discs.files.archive import load
from discs.integrators import (
    RK4,
    Gauss4,
    Gauss6,
    Gauss8,
    Integrator,
    KahanLi6,
    Leapfrog,
    McLachlanPerlmutter,
    Midpoint,
    Radau3,
    Radau5,
    Suzuki4,
)
from discs.linkage import Linkage, LinkageProblem, LinkageState
from discs.mechanics import MechanicalSystem
from discs.mechanics.friction import first_slip, friction_needed
from discs.mechanics.lagrange import lagrange_dalembert
from discs.problem import Problem, State
from discs.running.ensemble import simulate_many
from discs.running.failure import SimulationError
from discs.running.moments import steps
from discs.running.suggest import suggest_dt
from discs.simulation import simulate
from discs.solution import Solution

__all__ = [
    "RK4",
    "Chain",
    "Gauss4",
    "Gauss6",
    "Gauss8",
    "Integrator",
    "KahanLi6",
    "Leapfrog",
    "Linkage",
    "LinkageProblem",
    "LinkageState",
    "McLachlanPerlmutter",
    "MechanicalSystem",
    "Midpoint",
    "Problem",
    "Radau3",
    "Radau5",
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
    "simulate_many",
    "steps",
    "suggest_dt",
]

warn_of_others()
