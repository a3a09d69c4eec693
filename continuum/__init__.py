"""The rod as a field: a solver with an error estimate, the paper's scheme, exact solutions and linear waves."""

from continuum.free import free_rod
from continuum.rod import Rod, Scene, SteeredRod
from continuum.scenes import breathing_ring, rolling_rod, steered_rod, untwisting_rod
from continuum.solver import solve

__all__ = ["Rod", "Scene", "SteeredRod", "breathing_ring", "free_rod", "rolling_rod", "solve", "steered_rod", "untwisting_rod"]
