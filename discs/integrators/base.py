"""Base classes of integrators: small frozen objects with a name, an order, a reference and a step."""

import signal
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, TypeAlias, final

import numpy as np

from discs.arrays import Float, Int
from discs.chains.rolling_discs import RollingDiscs
from discs.loads.shares import Shares
from discs.skew import Load, Parameters, Phase, add


@dataclass
class Work:
    """The cost of a run so far.

    Attributes
    ----------
    gradients : evaluations of grad V.
    solves : banded linear systems.
    unconverged : implicit steps that reached their limit of sweeps.
    spent : (4,), the work of loads and the energy that they dissipate, each with its lost digits. With `shares` (4, 1 + L): that
        of all loads, and that of each.
    shares : the loads one by one, if asked for.
    """

    gradients: int = 0
    solves: int = 0
    unconverged: int = 0
    spent: Float = field(default_factory=lambda: np.zeros(4))
    shares: Shares | None = None

    def add(self, tally: "Tally") -> None:
        """Add the cost of compiled steps."""
        self.gradients += tally.gradients
        self.solves += tally.solves
        self.unconverged += tally.unconverged
        if tally.spent is not NOTHING:
            self.book(tally.spent[0], tally.spent[2])

    def book(self, work: float | Float, dissipated: float | Float) -> None:
        """Add the work of loads and the energy that they dissipate."""
        total, lost = add(self.spent[::2], self.spent[1::2], np.array([work, dissipated]))
        self.spent = np.array([total[0], lost[0], total[1], lost[1]])

    def power(self, load: Load, t: float, q: Float, v: Float) -> Float:
        """The rates of work and of dissipation, as they are booked: (2,), or (2, 1 + L)."""
        found = np.array(load.power(t, q, v))
        return found if self.shares is None else np.column_stack([found, self.shares.power(t, q, v)])

    def spend(self, load: Load | None, t: float, weight: float, z: Phase, move: Float, v: Float) -> None:
        """Book what a load does in a time `weight` around t, at the positions of z after a move, with velocities v (rows, n)."""
        if load is not None and not load.conservative:
            work, dissipated = self.power(load, t, z.hi + (z.lo + move), v)
            self.book(weight * work, weight * dissipated)

    def react(self, load: Load, gained: Float, p: Float) -> None:
        """Book the work of motors, whose torques changed the momenta by `gained` while the mean momenta were p, both like pi."""
        rows, discs = np.array([(axle.row, axle.disc) for axle in load.axles]).T
        gains, means = (np.atleast_2d(of)[rows - 2, discs] for of in (gained, p))
        if self.shares is None:
            self.book(float(gains @ means), 0.0)
            return
        work = np.zeros(self.spent.shape[1])
        work[0], work[1:][self.shares.motors] = gains @ means, gains * means
        self.book(work, 0.0 * work)


NOTHING = np.zeros(4)  # spent by a run without loads


class Tally(NamedTuple):
    """The result of compiled steps.

    steps, gradients, solves, unconverged : steps taken, and their cost. lost : a disc that lost its heading, or -1.
    passed : looks done. doubted : whether a step to be compared comes next. blown : whether the kinetic energy exceeds the bound.
    spent : (4,), as in `Work`.
    """

    steps: int
    gradients: int
    solves: int
    unconverged: int
    lost: int
    passed: int
    doubted: bool
    blown: bool
    spent: Float = NOTHING


Memory: TypeAlias = Any  # a NamedTuple or an object: all that a method needs between steps, of a type of its own
Looks = tuple[int, Int, Float, Float, float]  # arguments of `discs.kernels.driver.march`
NO_LOOKS: Looks = 0, np.empty(0, np.int64), np.empty((1, 1, 0)), np.empty((1, 2, 1)), np.inf


class Cut(Exception):
    """Ctrl-C interrupted a compiled call. Its steps are dropped; the memory is the one before the call."""


class Frame(NamedTuple):
    """Positions q = hi + lo and their rates of change, all (rows, n).

    lost : a disc that lost its heading in the compiled step to the frame, or -1. If there is one, the rest is undefined.
    seen : q, energy and largest slip, if the compiled form computed them.
    spent : (2,), work of loads and dissipated energy since the last step; with `Work.shares` (2, 1 + L).
    """

    hi: Float
    lo: Float
    rate: Float
    lost: int = -1
    seen: tuple[Float, float, float] | None = None
    spent: Float = NOTHING[:2]


class Integrator(ABC):
    """A method of integration, with fixed steps (`FixedStep`) or adaptive ones.

    Attributes
    ----------
    name : as given to `simulate(method=...)`.
    order : declared order in the step; the tests measure it.
    preserves : the invariants and symmetries that it keeps, in words.
    reference : the publication.
    stability_limit : largest h Omega for the fastest oscillation Omega; infinite if there is none.
    offers : names of further quantities at frames, see `extras`.
    takes_loads : whether it takes all loads, or only those that are part of the energy.
    takes_motors, damps : whether it takes discs whose rate is given, and whether it damps oscillations that steps do not resolve.
    adaptive : whether it chooses its own steps; below, h is then the longest step. back : longest substep back in time, over h.
    """

    name: ClassVar[str]
    order: ClassVar[int]
    preserves: ClassVar[str]
    reference: ClassVar[str]
    stability_limit: ClassVar[float]
    offers: ClassVar[tuple[str, ...]] = ()
    takes_loads: ClassVar[bool] = True
    takes_motors: ClassVar[bool] = False
    back: ClassVar[float] = 0.0
    damps: ClassVar[bool] = False
    adaptive: ClassVar[bool]

    @final
    @cached_property
    def settings(self) -> str:
        """The entry `settings` of `stats`."""
        return repr(self)

    @property
    @abstractmethod
    def compiles(self) -> bool:
        """Whether it can use the compiled form of a chain; otherwise it runs on the plain engine."""

    @abstractmethod
    def begin(self, system: RollingDiscs, z: Phase, h: float, work: Work, chain: Parameters = None) -> Memory:
        """The memory of the method at t = 0, for steps of size h.

        `chain`, here and below: `system.parameters` for the compiled form, None for the plain form.
        """

    @abstractmethod
    def advance(self, system: RollingDiscs, memory: Memory, t: float, h: float, work: Work) -> Memory:
        """The memory one step h after the time t."""

    @abstractmethod
    def at(
        self, system: RollingDiscs, memory: Memory, t: float, tau: float, h: float, work: Work, chain: Parameters = None
    ) -> Frame:
        """The discs at t + tau, 0 <= tau < h, with t the time of the last step; the trajectory does not change."""

    @abstractmethod
    def kinetic(self, system: RollingDiscs, memory: Memory, h: float) -> float:
        """Kinetic energy after the last step; for a two-step method, half a step later."""

    @abstractmethod
    def keep(self, memory: Memory) -> dict[str, Any]:
        """The memory as arrays and numbers by name, from which `recall` restores it to the same bits."""

    @abstractmethod
    def recall(self, memory: Memory, kept: dict[str, Any]) -> Memory:
        """The memory from what `keep` returned; `memory` is that of `begin` for the same run."""

    def finer(self, system: RollingDiscs, memory: Memory, t: float, h: float, chain: Parameters = None) -> Float | None:
        """Positions (rows, n) one step h later with an error several times smaller, for `discs.running.step_error`.

        None if the method controls the error of its steps itself.
        """
        return None

    @property
    def sweep_tolerance(self) -> float:
        """The tolerance of its sweeps; 0 if it has no sweeps or a fixed number of them."""
        return 0.0

    def with_sweeps(self, tolerance: float) -> "Integrator":
        """The same method with this tolerance of sweeps; itself if it has no sweeps or a fixed number of them."""
        return self

    def extras(self, system: RollingDiscs, memory: Memory, h: float) -> dict[str, float]:
        """The quantities in `offers`, after the last step."""
        return {}


class FixedStep(Integrator):
    """A method with equal steps.

    Attributes
    ----------
    parameters : the NamedTuple of the compiled twin, whose type `step` of `discs.kernels.protocol` is filled in for. None if there
        is none: runs then take the plain form.
    """

    adaptive: ClassVar[bool] = False
    in_lanes: ClassVar[bool] = False

    @property
    def parameters(self) -> Parameters:
        return None

    @final
    @property
    def compiles(self) -> bool:
        return self.parameters is not None

    @final
    def twin_of(self, system: RollingDiscs, chain: Parameters) -> Parameters:
        """What the compiled twin is given for `system.parameters`: those in lanes, if it takes them and there are."""
        return chain if not self.in_lanes or system.lanes is None else system.lanes

    @final
    def march(
        self,
        system: RollingDiscs,
        chain: Parameters,
        memory: Memory,
        t: float,
        h: float,
        steps: int,
        bound: float,
        looks: Looks = NO_LOOKS,
    ) -> tuple[Memory, Tally]:
        """The compiled twin of `steps` times `advance` from the time t; `chain` is `system.parameters`.

        Stops after a step whose kinetic energy exceeds `bound`, and after one in which a disc loses its heading; the returned
        state is then undefined. Ctrl-C is polled in every sweep; `Cut` is raised if Python's handler of it does not raise.
        """
        import discs.kernels.driver as driver

        if system.load is not None and not system.load.conservative:
            starts = t + h * np.arange(steps + 1.0)
            times = np.add.outer(starts, h * np.array([0.0, *self.parameters.nodes]))
            chain = chain._replace(load=system.load.timed(times.ravel(), abs(h)))
        state = type(memory)(*[np.array(array, ndmin=2) for array in memory])  # momenta (n,) are (1, n) in compiled code
        found = driver.march(self.parameters, self.twin_of(system, chain), state, t, h, steps, bound, *looks)
        tally = Tally(*found)
        if system.load is not None and not system.load.conservative:
            tally = tally._replace(spent=chain.load.spent)
        if tally.steps < 0:
            signal.raise_signal(signal.SIGINT)
            raise Cut
        return state if memory[-1].ndim == 2 else Phase(state.hi, state.lo, state.pi[0]), tally


class OneStep(FixedStep):
    """A one-step method: its memory is the state, and a frame between steps is computed by a shorter step."""

    @abstractmethod
    def step(self, system: RollingDiscs, z: Phase, t: float, h: float, work: Work) -> Phase:
        """The state a step h after z at the time t: a pure function of its arguments, apart from counting `work`."""

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
        z, lost, before = memory, -1, work.spent
        if chain is None:
            z = self.step(system, memory, t, tau, work) if tau else memory
            spent, work.spent = (work.spent - before)[::2], before
            return Frame(z.hi, z.lo, system.forward(system.basis(system.shape(z.hi, z.lo)), z.pi), spent=spent)
        import discs.kernels.driver as driver

        spent = NOTHING[::2]
        if tau:
            z, tally = self.march(system, chain, memory, t, tau, 1, np.inf)
            work.add(tally._replace(spent=NOTHING))
            lost, spent = tally.lost, tally.spent[::2]
        rate, q = np.empty(z.hi.shape), np.empty(z.hi.shape)
        energy, slip = driver.look(chain, z if z.pi.ndim == 2 else Phase(z.hi, z.lo, z.pi[None]), rate, q)
        return Frame(z.hi, z.lo, rate, lost, (q, energy, slip), spent)

    @final
    def finer(self, system: RollingDiscs, memory: Phase, t: float, h: float, chain: Parameters = None) -> Float:
        if chain is not None:
            z: Phase = self.march(system, chain, memory, t, 0.5 * h, 2, np.inf)[0]
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
