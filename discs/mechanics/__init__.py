"""General mechanical systems with velocity constraints, by Lagrange-d'Alembert with multipliers.

`equations` has the equations of motion, `system` the class for users, `inputs` and `derivatives` a user's functions and their
derivatives, `saddle` the linear algebra, `motion` the time integration (with `sizes`, `drift`, `rank_drops`, `stiffness`, `watch`),
`trajectory` the result. `lagrange` makes a system from a chain.
"""

from discs.mechanics.equations import Response
from discs.mechanics.system import MechanicalSystem
from discs.mechanics.trajectory import Trajectory

__all__ = ["MechanicalSystem", "Response", "Trajectory"]
