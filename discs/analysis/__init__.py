"""Small motions about a state: the linearised equations and what follows from them; see docs/small-motions.md."""

from discs.analysis.linear import Linearised, linearise
from discs.analysis.modes import Modes, modes
from discs.analysis.steady import Steady, steady

__all__ = ["Linearised", "Modes", "Steady", "linearise", "modes", "steady"]
