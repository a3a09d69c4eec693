"""Chains of nodes whose links may be rigid and whose nodes may lack a wheel: snakes, trailers, columns; see docs/snakes.md.

`linkage` has the parameters and the state, `problem` what is run, `equations` the equations of motion, `starting` what a state
must obey, `midpoint` the step, `motion` runs, `small` the linearised equations.
"""

from discs.linkage.linkage import Linkage, LinkageState
from discs.linkage.problem import LinkageProblem
from discs.linkage.starting import nearest

__all__ = ["Linkage", "LinkageProblem", "LinkageState", "nearest"]
