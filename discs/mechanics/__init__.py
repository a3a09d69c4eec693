"""General mechanical systems with linear velocity constraints, by Lagrange-d'Alembert with multipliers.

`equations` has the equations, `system` what users make and move, `derivatives` those of a user's formulas, `saddle` the linear
algebra, `motion` the motion in time with `sizes`, `drift`, `rank_drops` and `stiffness`. `lagrange` makes a system of a chain.
"""

from discs.mechanics.equations import Response
from discs.mechanics.motion import Trajectory
from discs.mechanics.system import MechanicalSystem

__all__ = ["MechanicalSystem", "Response", "Trajectory"]
