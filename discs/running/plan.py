"""What runs of a problem by a method have in common. The problem keeps its last plan, as runs with short steps are many."""

import math
import sys

from discs.integrators import FixedStep, Integrator, OneStep
from discs.problem import Problem


class Plan:
    """The engine of runs, and what they record.

    Parameters
    ----------
    problem, integrator : the problem and the method.
    because : why runs take the plain engine; empty if they are compiled.
    want : quantities asked for, checked.
    records : whether compiled steps record the frames, see `records`.

    Attributes
    ----------
    system : the equations of motion. s : places of the discs, (n,).
    parameters : of the chain for compiled code; None on the plain engine.
    twin : the method, if its steps are compiled; otherwise None.
    offered : whether quantities are asked for that the method offers. threads : of compiled steps.
    explicit : whether the step is limited by stability. implicit : whether a fixed step is not. bound : blow-up threshold.
    """

    def __init__(
        self, problem: Problem, integrator: Integrator, because: str = "", want: tuple[str, ...] = (), records: bool = False
    ) -> None:
        self.problem, self.integrator, self.because, self.want, self.records = problem, integrator, because, want, records
        self.system, self.s = problem.system, problem.chain.s
        self.parameters = None if because else self.system.parameters
        self.twin = integrator if self.parameters is not None and isinstance(integrator, FixedStep) else None
        self.offered = not set(want).isdisjoint(integrator.offers)
        self.threads = integrator.threads(self.system)
        self.explicit = integrator.stability_limit < math.inf
        self.implicit = not self.explicit and not integrator.adaptive
        self.bound = min(problem.blown_up, sys.float_info.max)  # an infinite energy exceeds it


def records(problem: Problem, integrator: Integrator, want: tuple[str, ...]) -> bool:
    """Whether compiled steps can record the frames of runs in memory, all at once."""
    lanes = isinstance(integrator, FixedStep) and integrator.in_lanes and problem.system.lanes is not None
    steps = isinstance(integrator, OneStep) and not lanes
    return (steps or integrator.runs_whole) and not want and problem.system.load is None
