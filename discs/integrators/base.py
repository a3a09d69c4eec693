"""What every integrator is: a small frozen object with a name, an order, a reference and a step."""

import signal
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, TypeAlias, final

import numpy as np

from discs.arrays import Float, Int
from discs.chains.rolling_discs import RollingDiscs
from discs.skew import Parameters, Phase


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

    def add(self, tally: "Tally") -> None:
        """Count what a compiled run has cost."""
        self.gradients += tally.gradients
        self.solves += tally.solves
        self.unconverged += tally.unconverged


class Tally(NamedTuple):
    """What a compiled run of steps reports: steps taken, its work, and a disc that lost its heading or -1; how many looks were
    passed, and whether it stopped before one that is doubted; whether the kinetic energy is not below the bound."""

    steps: int
    gradients: int
    solves: int
    unconverged: int
    lost: int
    passed: int
    doubted: bool
    blown: bool


Memory: TypeAlias = Any  # what a method keeps between steps, of its own kind
Looks = tuple[int, Int, Float, Float, float]  # what `discs.kernels.driver` is told of them
NO_LOOKS: Looks = 0, np.empty(0, np.int64), np.empty((1, 1, 0)), np.empty((1, 2, 1)), np.inf


class Cut(Exception):
    """A compiled call that Ctrl-C cut short; what it did is dropped, and the memory is that from before."""


class Frame(NamedTuple):
    """Positions q = hi + lo and their rates of change, all (rows, n).

    lost : a disc that a compiled step on the way saw losing its heading, or -1; then the rest is undefined.
    seen : q, energy and largest slip, where the compiled form found them on the way.
    """

    hi: Float
    lo: Float
    rate: Float
    lost: int = -1
    seen: tuple[Float, float, float] | None = None


class Integrator(ABC):
    """A method of integration: of fixed steps, `FixedStep`, or of steps of its own choice.

    Attributes
    ----------
    name : as given to `simulate(method=...)`.
    order : declared order in the step; the tests measure it.
    preserves : what it keeps, in words.
    reference : where it comes from.
    stability_limit : largest h Omega for the fastest oscillation Omega; infinite if there is none.
    offers : names of extra quantities it can report per frame, see `extras`.
    takes_loads : whether it computes what acts besides the springs.
    adaptive : whether it chooses its own steps; then h, in what follows, is the longest it may take.
    """

    name: ClassVar[str]
    order: ClassVar[int]
    preserves: ClassVar[str]
    reference: ClassVar[str]
    stability_limit: ClassVar[float]
    offers: ClassVar[tuple[str, ...]] = ()
    takes_loads: ClassVar[bool] = True
    adaptive: ClassVar[bool]

    @final
    @cached_property
    def settings(self) -> str:
        """What `stats` tells of it."""
        return repr(self)

    @property
    @abstractmethod
    def compiles(self) -> bool:
        """Whether it has a compiled form, or takes the chain's in a form of its own; else it runs on the plain engine."""

    @abstractmethod
    def begin(self, system: RollingDiscs, z: Phase, h: float, work: Work, chain: Parameters = None) -> Memory:
        """What the method must remember between steps of size h, at the first time.

        `chain`, here and below, are the parameters for the compiled form, `system.parameters`; None for the plain one.
        """

    @abstractmethod
    def advance(self, system: RollingDiscs, memory: Memory, t: float, h: float, work: Work) -> Memory:
        """The memory one step h later than t."""

    @abstractmethod
    def at(
        self, system: RollingDiscs, memory: Memory, t: float, tau: float, h: float, work: Work, chain: Parameters = None
    ) -> Frame:
        """The discs a time 0 <= tau < h after the last step (of size h) to t; the trajectory is not touched."""

    @abstractmethod
    def kinetic(self, system: RollingDiscs, memory: Memory, h: float) -> float:
        """Kinetic energy at the last step; for a two-step method, half a step later."""

    @abstractmethod
    def keep(self, memory: Memory) -> dict[str, Any]:
        """The memory as arrays and numbers by name, all that `recall` needs to go on bit for bit."""

    @abstractmethod
    def recall(self, memory: Memory, kept: dict[str, Any]) -> Memory:
        """The memory that was kept; `memory` is that of `begin`, of the same run."""

    def finer(self, system: RollingDiscs, memory: Memory, t: float, h: float, chain: Parameters = None) -> Float | None:
        """Positions (rows, n) one step h later, of an error several times smaller, for `discs.running.step_error`.

        None: steps are checked as they are taken.
        """
        return None

    @property
    def sweep_tolerance(self) -> float:
        """What its sweeps converge to; 0 where it has no sweeps, or a fixed number of them."""
        return 0.0

    def with_sweeps(self, tolerance: float) -> "Integrator":
        """The same method with its sweeps converged to a tolerance; itself where it has no sweeps, or a fixed number of them."""
        return self

    def extras(self, system: RollingDiscs, memory: Memory, h: float) -> dict[str, float]:
        """The quantities in `offers`, at the last step."""
        return {}


class FixedStep(Integrator):
    """A method of equal steps.

    Attributes
    ----------
    parameters : what `discs.kernels.driver` is given for the compiled twin, a NamedTuple whose kind has a `step` filled in; None if
        there is none, and runs then take the plain form.
    """

    adaptive: ClassVar[bool] = False

    @property
    def parameters(self) -> Parameters:
        return None

    @final
    @property
    def compiles(self) -> bool:
        return self.parameters is not None

    @final
    def march(
        self, chain: Parameters, memory: Memory, t: float, h: float, steps: int, bound: float, looks: Looks = NO_LOOKS
    ) -> tuple[Memory, Tally]:
        """The compiled twin of `steps` times `advance` from the time t; `chain` is `system.parameters`.

        Stops after a step whose kinetic energy is not below `bound`, and after one in which a disc loses its heading; the returned
        state is then undefined. Raises `Cut` on Ctrl-C, heard in every sweep, where Python's handler of it does not raise itself.
        """
        import discs.kernels.driver as driver

        state = type(memory)(*[np.array(array, ndmin=2) for array in memory])  # momenta of roll alone are one row there
        tally = Tally(*driver.march(self.parameters, chain, state, t, h, steps, bound, *looks))
        if tally.steps < 0:
            signal.raise_signal(signal.SIGINT)
            raise Cut
        return state if memory[-1].ndim == 2 else Phase(state.hi, state.lo, state.pi[0]), tally


class OneStep(FixedStep):
    """A method whose step needs the state alone: the memory is the state, and frames are reached by a shorter step."""

    @abstractmethod
    def step(self, system: RollingDiscs, z: Phase, t: float, h: float, work: Work) -> Phase:
        """The state a step h after z at the time t, a pure function of its arguments (work is counted up)."""

    @final
    def begin(self, system: RollingDiscs, z: Phase, h: float, work: Work, chain: Parameters = None) -> Phase:
        return z

    @final
    def advance(self, system: RollingDiscs, memory: Phase, t: float, h: float, work: Work) -> Phase:
        return self.step(system, memory, t, h, work)

    @final
    def at(
        self, system: RollingDiscs, memory: Phase, t: float, tau: float, h: float, work: Work, chain: Parameters = None
    ) -> Frame:
        if chain is None:
            z = self.step(system, memory, t, tau, work) if tau else memory
            return Frame(z.hi, z.lo, system.forward(system.basis(system.shape(z.hi, z.lo)), z.pi))
        import discs.kernels.driver as driver

        z, lost = memory, -1
        if tau:
            z, tally = self.march(chain, memory, t, tau, 1, np.inf)
            work.add(tally)
            lost = tally.lost
        rate, q = np.empty(z.hi.shape), np.empty(z.hi.shape)
        energy, slip = driver.look(chain, z if z.pi.ndim == 2 else Phase(z.hi, z.lo, z.pi[None]), rate, q)
        return Frame(z.hi, z.lo, rate, lost, (q, energy, slip))

    @final
    def finer(self, system: RollingDiscs, memory: Phase, t: float, h: float, chain: Parameters = None) -> Float:
        if chain is not None:
            z: Phase = self.march(chain, memory, t, 0.5 * h, 2, np.inf)[0]
            return z.hi
        work = Work()
        return self.step(system, self.step(system, memory, t, 0.5 * h, work), t + 0.5 * h, 0.5 * h, work).hi

    @final
    def keep(self, memory: Phase) -> dict[str, Any]:
        return memory._asdict()

    @final
    def recall(self, memory: Phase, kept: dict[str, Any]) -> Phase:
        return Phase(**kept)

    @final
    def kinetic(self, system: RollingDiscs, memory: Phase, h: float) -> float:
        return 0.5 * float(np.vdot(memory.pi, memory.pi))
