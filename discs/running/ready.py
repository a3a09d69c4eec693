"""Whether the kernels of a run are there."""

import warnings

import numpy as np

from discs.chains.rolling_discs import RollingDiscs
from discs.integrators import FixedStep, Integrator
from discs.kernels.background import Kernels
from discs.kernels.teams import Team
from discs.problem import Problem
from discs.running.album import Album
from discs.running.plan import Plan
from discs.running.time_loop import March

NOTICE = 2.0  # seconds of compiling after which a notice is printed; reading kernels from the cache does not count
PREPARED: set[tuple[object, ...]] = set()  # what `kinds` gave of runs whose kernels are there


def kernels(engine: str, problem: Problem, integrator: Integrator, h: float, asked: bool, quiet: bool) -> Kernels | bool:
    """Whether the kernels of a run are there: with the engine "compiled" they are, as it waits.

    asked : whether frames are asked for, or recorded by steps. quiet : print no notice that kernels are being compiled.
    """
    key = kinds(problem.system, integrator, asked)
    if key in PREPARED:
        return True
    if engine != "compiled":
        there = Kernels(engine, compile_kernels, problem, integrator, h, asked)
        if not there:
            return there
    from discs.kernels.compiled import compiling, say_so

    with compiling(lambda: None if quiet else say_so(integrator.name), NOTICE):
        compile_kernels(problem, integrator, h, asked)
    PREPARED.add(key)
    return True


def compile_kernels(problem: Problem, integrator: Integrator, h: float, asked: bool) -> None:
    """Compile the kernels of a run, or read them from disc."""
    album = None if asked else Album(problem.system, np.empty(0), h)
    with warnings.catch_warnings(action="ignore"):  # about the problem: the run itself warns
        March(Plan(problem, integrator), h, album=album).prepare()


def kinds(system: RollingDiscs, integrator: Integrator, asked: bool) -> tuple[object, ...]:
    """What the kernels of a run depend on. asked : whether frames are asked for, or recorded by steps."""
    chain = integrator.twin_of(system, system.parameters) if isinstance(integrator, FixedStep) else system.parameters
    if isinstance(chain, Team):
        chain = chain.chains[0]
    return asked, type(integrator), type(chain), *map(type, chain or ())  # the types of the chain's laws and load too
