"""Convergence: the error against the number of discs, for both kinds of ends."""

from compare import convergence
from continuum import solve, untwisting_rod

scene = untwisting_rod(duration=2.0)
field = solve(scene, tol=1e-6)
springs, consistent = (convergence(scene, n=(9, 17, 33, 65), ends=ends, field=field) for ends in ("springs", "consistent"))
consistent.plot("15_convergence.png", springs)
