"""What every integrator is: a small frozen object with a name, an order, a reference and a step."""

import signal
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from discs.system import Phase, RollingDiscs


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
    """What a compiled run of steps reports: steps taken, its work, and a disc that lost its heading or -1."""

    steps: int
    gradients: int
    solves: int
    unconverged: int
    lost: int


class Cut(Exception):
    """A compiled call that Ctrl-C cut short; what it did is dropped, and the memory is that from before."""


def tally(found: tuple[int, int, int, int, int]) -> Tally:
    """What a kernel returned; of one that Ctrl-C ended, `Cut` if Python's handler of it does not raise KeyboardInterrupt itself."""
    if found[0] < 0:
        signal.raise_signal(signal.SIGINT)
        raise Cut
    return Tally(*found)


class Frame(NamedTuple):
    """Positions q = hi + lo and their rates of change, all (rows, n).

    lost : a disc that a compiled step on the way saw losing its heading, or -1; then the rest means nothing.
    seen : q, energy and largest slip, where the compiled form found them on the way.
    """

    hi: NDArray
    lo: NDArray
    rate: NDArray
    lost: int = -1
    seen: tuple[NDArray, float, float] | None = None


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
    adaptive : whether it chooses its own steps; then h, in what follows, is the longest it may take.
    """

    name: ClassVar[str]
    order: ClassVar[int]
    preserves: ClassVar[str]
    reference: ClassVar[str]
    stability_limit: ClassVar[float]
    offers: ClassVar[tuple[str, ...]] = ()
    adaptive: ClassVar[bool]

    @abstractmethod
    def begin(self, system: RollingDiscs, z: Phase, h: float, work: Work, chain: Any = None) -> Any:
        """What the method must remember between steps of size h, at the first time.

        `chain`, here and below, are the parameters for the compiled form, `system.kernel`; None for the plain one.
        """

    @abstractmethod
    def advance(self, system: RollingDiscs, memory: Any, h: float, work: Work) -> Any:
        """The memory one step h later."""

    @abstractmethod
    def at(self, system: RollingDiscs, memory: Any, tau: float, h: float, work: Work, chain: Any = None) -> Frame:
        """The discs a time 0 <= tau < h after the last step (of size h); the trajectory is not touched."""

    @abstractmethod
    def kinetic(self, system: RollingDiscs, memory: Any, h: float) -> float:
        """Kinetic energy at the last step; for a two-step method, half a step later."""

    @abstractmethod
    def keep(self, memory: Any) -> dict[str, Any]:
        """The memory as arrays and numbers by name, all that `recall` needs to go on bit for bit."""

    @abstractmethod
    def recall(self, memory: Any, kept: dict[str, Any]) -> Any:
        """The memory that was kept; `memory` is that of `begin`, of the same run."""

    def finer(self, system: RollingDiscs, memory: Any, h: float, chain: Any = None) -> NDArray | None:
        """Positions (rows, n) one step h later, of an error several times smaller, for `discs.trust`; None: steps are checked as
        they are taken."""
        return None

    def extras(self, system: RollingDiscs, memory: Any, h: float) -> dict[str, float]:
        """The quantities in `offers`, at the last step."""
        return {}


class FixedStep(Integrator):
    """A method of equal steps, which has a compiled twin."""

    adaptive: ClassVar[bool] = False

    @abstractmethod
    def march(self, chain: Any, memory: Any, h: float, steps: int, bound: float) -> tuple[Any, Tally]:
        """The compiled twin of `steps` times `advance`, for the parameters `system.kernel` of a chain.

        Stops after a step whose kinetic energy is not below `bound`, and in one in which a disc loses its heading; where the discs
        are means nothing then. Raises `Cut` on Ctrl-C, in every sweep.
        """


class OneStep(FixedStep):
    """A method whose step needs the state alone: the memory is the state, and frames are reached by a shorter step."""

    @abstractmethod
    def step(self, system: RollingDiscs, z: Phase, h: float, work: Work) -> Phase:
        """One step from z, a pure function of its arguments (work is counted up)."""

    @abstractmethod
    def kernel(self, chain: Any, hi: NDArray, lo: NDArray, pi: NDArray, h: float, steps: int, bound: float) -> Any:
        """The compiled twin of `steps` times `step`, in place; pi is (1, n), or (2, n) with own headings. Returns a tally's
        entries."""

    @final
    def begin(self, system: RollingDiscs, z: Phase, h: float, work: Work, chain: Any = None) -> Phase:
        return z

    @final
    def march(self, chain: Any, memory: Phase, h: float, steps: int, bound: float) -> tuple[Phase, Tally]:
        z = Phase(memory.hi.copy(), memory.lo.copy(), memory.pi.copy())
        return z, tally(self.kernel(chain, z.hi, z.lo, z.pi.reshape(-1, z.hi.shape[1]), h, steps, bound))

    @final
    def advance(self, system: RollingDiscs, memory: Phase, h: float, work: Work) -> Phase:
        return self.step(system, memory, h, work)

    @final
    def at(self, system: RollingDiscs, memory: Phase, tau: float, h: float, work: Work, chain: Any = None) -> Frame:
        if chain is None:
            z = self.step(system, memory, tau, work) if tau else memory
            return Frame(z.hi, z.lo, system.forward(system.frame(system.shape(z.hi, z.lo)), z.pi))
        import discs.kernels.methods as methods

        z, lost = memory, -1
        if tau:
            z, done = self.march(chain, memory, tau, 1, np.inf)
            work.add(done)
            lost = done.lost
        rate, q = np.empty_like(z.hi), np.empty_like(z.hi)
        energy, slip = methods.look(chain, z.hi, z.lo, z.pi.reshape(-1, z.hi.shape[1]), rate, q)
        return Frame(z.hi, z.lo, rate, lost, (q, energy, slip))

    @final
    def finer(self, system: RollingDiscs, memory: Phase, h: float, chain: Any = None) -> NDArray:
        if chain is not None:
            hi, pi = memory.hi.copy(), memory.pi.reshape(-1, memory.hi.shape[1]).copy()
            tally(self.kernel(chain, hi, memory.lo.copy(), pi, 0.5 * h, 2, np.inf))
            return hi
        work = Work()
        return self.step(system, self.step(system, memory, 0.5 * h, work), 0.5 * h, work).hi

    @final
    def keep(self, memory: Phase) -> dict[str, Any]:
        return memory._asdict()

    @final
    def recall(self, memory: Phase, kept: dict[str, Any]) -> Phase:
        return Phase(**kept)

    @final
    def kinetic(self, system: RollingDiscs, memory: Phase, h: float) -> float:
        return 0.5 * float(np.vdot(memory.pi, memory.pi))
