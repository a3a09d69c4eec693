"""The rod as a field: the paper's scheme, a solver with an error estimate, exact solutions, linear waves."""

from continuum.rod import Rod, Scene
from continuum.scenes import breathing_ring, rolling_rod, untwisting_rod
from continuum.solver import solve

__all__ = ["Rod", "Scene", "breathing_ring", "rolling_rod", "solve", "untwisting_rod"]
