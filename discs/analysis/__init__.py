"""Small motions about a state: the linearised equations and what follows from them; see docs/small-motions.md."""

from discs.analysis.linear import Linearised, linearise

__all__ = ["Linearised", "linearise"]
