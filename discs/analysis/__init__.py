"""Small motions about a state or a motion, states at rest, and gradients; see docs/small-motions.md and docs/gradients.md."""

from discs.analysis.adjoint import gradient
from discs.analysis.branch import Branch, relative_equilibria
from discs.analysis.horizon import Growth, growth, horizon
from discs.analysis.linear import Linearised, linearise
from discs.analysis.lyapunov import Exponents, lyapunov
from discs.analysis.modes import Modes, modes
from discs.analysis.rest import equilibrium
from discs.analysis.steady import Steady, steady

__all__ = [
    "Branch",
    "Exponents",
    "Growth",
    "Linearised",
    "Modes",
    "Steady",
    "equilibrium",
    "gradient",
    "growth",
    "horizon",
    "linearise",
    "lyapunov",
    "modes",
    "relative_equilibria",
    "steady",
]
