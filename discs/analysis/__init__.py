"""Small motions about a state or a motion, and states at rest; see docs/small-motions.md."""

from discs.analysis.linear import Linearised, linearise
from discs.analysis.lyapunov import Exponents, lyapunov
from discs.analysis.modes import Modes, modes
from discs.analysis.rest import equilibrium
from discs.analysis.steady import Steady, steady

__all__ = ["Exponents", "Linearised", "Modes", "Steady", "equilibrium", "linearise", "lyapunov", "modes", "steady"]
