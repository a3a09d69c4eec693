"""General mechanical systems with linear velocity constraints, by Lagrange-d'Alembert with multipliers.

`equations` has the equations of motion, `system` the class for users, `derivatives` the derivatives of a user's formulas, `saddle`
the linear algebra, `motion` the time integration (with `sizes`, `drift`, `rank_drops`, `stiffness`). `lagrange` makes a system from
a chain.
"""

from discs.mechanics.equations import Response
from discs.mechanics.motion import Trajectory
from discs.mechanics.system import MechanicalSystem

__all__ = ["MechanicalSystem", "Response", "Trajectory"]
