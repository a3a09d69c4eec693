"""What every integrator is: a small frozen object with a name, an order, a reference and a step."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from discs.system import Phase, SkewGradient


@dataclass
class Work:
    """What a run has cost so far.

    Attributes
    ----------
    gradients : evaluations of grad V.
    solves : banded linear systems.
    unconverged : implicit steps that ended on their limit of sweeps.
    """

    gradients: int = 0
    solves: int = 0
    unconverged: int = 0


class Frame(NamedTuple):
    """Positions q = hi + lo and their rates of change, all (rows, n)."""

    hi: NDArray
    lo: NDArray
    rate: NDArray


class Integrator(ABC):
    """A method of integration with a fixed step.

    Attributes
    ----------
    name : as given to `simulate(method=...)`.
    order : declared order in the step; the tests measure it.
    preserves : what it keeps, in words.
    reference : where it comes from.
    stability_limit : largest h Omega for the fastest oscillation Omega; infinite if there is none.
    offers : names of extra quantities it can report per frame, see `extras`.
    """

    name: ClassVar[str]
    order: ClassVar[int]
    preserves: ClassVar[str]
    reference: ClassVar[str]
    stability_limit: ClassVar[float]
    offers: ClassVar[tuple[str, ...]]

    @abstractmethod
    def begin(self, system: SkewGradient, z: Phase, h: float, work: Work) -> Any:
        """What the method must remember between steps of size h, at the first time."""

    @abstractmethod
    def advance(self, system: SkewGradient, memory: Any, h: float, work: Work) -> Any:
        """The memory one step h later."""

    @abstractmethod
    def at(self, system: SkewGradient, memory: Any, tau: float, h: float, work: Work) -> Frame:
        """The discs a time 0 <= tau < h after the last step (of size h); the trajectory is not touched."""

    @abstractmethod
    def kinetic(self, system: SkewGradient, memory: Any, h: float) -> float:
        """Kinetic energy at the last step; for a two-step method, half a step later."""

    @abstractmethod
    def extras(self, system: SkewGradient, memory: Any, h: float) -> dict[str, float]:
        """The quantities in `offers`, at the last step."""


class OneStep(Integrator):
    """A method whose step needs the state alone: the memory is the state, and frames are reached by a shorter step."""

    offers: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def step(self, system: SkewGradient, z: Phase, h: float, work: Work) -> Phase:
        """One step from z, a pure function of its arguments (work is counted up)."""

    @final
    def begin(self, system: SkewGradient, z: Phase, h: float, work: Work) -> Phase:
        return z

    @final
    def advance(self, system: SkewGradient, memory: Phase, h: float, work: Work) -> Phase:
        return self.step(system, memory, h, work)

    @final
    def at(self, system: SkewGradient, memory: Phase, tau: float, h: float, work: Work) -> Frame:
        z = self.step(system, memory, tau, work) if tau else memory
        return Frame(z.hi, z.lo, system.forward(system.frame(system.shape(z.hi, z.lo)), z.pi))

    @final
    def kinetic(self, system: SkewGradient, memory: Phase, h: float) -> float:
        return 0.5 * float(np.vdot(memory.pi, memory.pi))

    @final
    def extras(self, system: SkewGradient, memory: Phase, h: float) -> dict[str, float]:
        return {}
