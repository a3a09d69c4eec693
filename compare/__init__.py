"""N discs converge to the rod: lumping, N -> infinity, pictures."""

from compare.convergence import Study, convergence
from compare.lump import lump
from compare.overview import overview

__all__ = ["Study", "convergence", "lump", "overview"]
