"""Whether the kernels of a run are there."""

import warnings

import numpy as np

from discs.integrators import Integrator
from discs.kernels.background import Kernels
from discs.problem import Problem
from discs.running.album import Album
from discs.running.engine import PREPARED, kinds
from discs.running.time_loop import March


def kernels(engine: str, problem: Problem, integrator: Integrator, h: float, asked: bool) -> Kernels | bool:
    """Whether the kernels of a run are there. If not, with the engine "auto" they are being compiled in the background."""
    return kinds(problem.system, integrator, asked) in PREPARED or Kernels(engine, compile_kernels, problem, integrator, h, asked)


def compile_kernels(problem: Problem, integrator: Integrator, h: float, asked: bool) -> None:
    """Compile the kernels of a run, or read them from disc."""
    album = None if asked else Album(problem.system, np.empty(0), h)
    with warnings.catch_warnings(action="ignore"):  # about the problem: the run itself warns
        March(problem, integrator, h, compiled=True, quiet=True, album=album)
