"""N discs converge to the rod: lumping, N -> infinity, pictures."""

from compare.lump import lump
from compare.main_job import overview
from compare.study import Study, convergence

__all__ = ["Study", "convergence", "lump", "overview"]
