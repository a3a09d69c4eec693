"""Convergence of N discs to the rod: lumping, studies of N -> infinity, pictures."""

from compare.hardcases.table import Stability, stability
from compare.lab import lab
from compare.lump import lump
from compare.main_job import overview
from compare.precision import work_precision
from compare.results import Study
from compare.study import convergence
from compare.sweeps import sweep
from compare.work_precision import WorkPrecision

__all__ = ["Stability", "Study", "WorkPrecision", "convergence", "lab", "lump", "overview", "stability", "sweep", "work_precision"]
