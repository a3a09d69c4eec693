"""Chains of nodes whose links may be rigid and whose nodes may lack a wheel: snakes, trailers, columns; see docs/snakes.md.

`linkage` has the parameters and the state, `equations` the equations of motion, `midpoint` the step, `motion` runs, `small` the
linearised equations.
"""

from discs.linkage.linkage import Linkage, LinkageProblem, LinkageState

__all__ = ["Linkage", "LinkageProblem", "LinkageState"]
