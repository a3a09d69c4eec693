"""General mechanical systems with linear velocity constraints, by Lagrange-d'Alembert with multipliers.

`system` has the equations, `derivatives` those of a user's formulas, `saddle` the linear algebra, `motion` the motion in time with
`sizes`, `drift`, `rank_drops` and `stiffness`.
"""

from discs.mechanics.motion import Trajectory
from discs.mechanics.system import MechanicalSystem, Response

__all__ = ["MechanicalSystem", "Response", "Trajectory"]
