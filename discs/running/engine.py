"""Which engine a run takes, and why."""

from discs import checks
from discs.integrators import Integrator
from discs.loads.own import OwnLoad
from discs.problem import Problem

ENGINES = ("auto", "ready", "compiled", "plain")
WAITING = "its kernels are not compiled yet"


def refuse_loads(problem: Problem, integrator: Integrator) -> None:
    """ValueError for loads that the method cannot take."""
    if not integrator.takes_loads and not problem.conserves:
        raise ValueError(
            f"{integrator.name!r} takes loads that are part of the energy only, as Slope, Spring, or Rest without a signal; take a "
            "method that takes all, as 'midpoint'"
        )
    if problem.system.load is not None and problem.system.load.axles and not integrator.takes_motors:
        raise ValueError(f"{integrator.name!r} does not take motors; take an implicit method with fixed steps, as 'midpoint'")


def plain_because(problem: Problem, integrator: Integrator, engine: str, want: tuple[str, ...]) -> str:
    """Why a run takes the plain engine, for `stats`; empty if it is compiled. ValueError for an unknown engine."""
    if checks.choice("engine", engine, ENGINES) == "plain":
        return "it was asked for"
    if "work_by_load" in want and not problem.conserves:
        return "the work of each load is booked by the plain engine only"
    if not integrator.compiles:
        return f"{integrator.name!r} has no compiled form"
    if problem.system.parameters is not None:
        return ""
    for given, load in zip(problem.loads, problem.bound, strict=True):
        name = type(given).__name__
        if isinstance(load, OwnLoad) and not load.compiles:
            return f"the functions of {name} are not compiled by numba, as with numba.njit"
        if not isinstance(load, OwnLoad) and load.parameters is None:
            return f"{name} has no compiled form here"
    return "the laws of this chain have no compiled form"
