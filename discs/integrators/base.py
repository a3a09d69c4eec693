"""Base classes of integrators: small frozen objects with a name, an order, a reference and a step."""

import signal
from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, ClassVar, final

import numpy as np

from discs.arrays import Float
from discs.chains.rolling_discs import RollingDiscs
from discs.integrators.work import NO_LOOKS, NO_STOPS, NOTHING, Cut, Frame, Looks, Memory, Stops, Tally, Work
from discs.kernels import driver, teams
from discs.kernels.direct import Known, direct
from discs.skew import Parameters, Phase


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
    adaptive : whether it chooses its own steps; below, h is then the longest step. runs_whole : whether it has `whole`.
    back : longest substep back in time, over h.

    Its methods have these arguments: `system`, the equations of motion of the chain; `z`, a state; `memory`, what the method
    remembers from step to step, the state itself for one-step methods; `t`, the time of that state; `h`, the step; `work`, counters
    to which the cost is added; `chain`, `system.parameters` for the compiled form, None for the plain one.
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
    runs_whole: ClassVar[bool] = False

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
        """The memory of the method at t = 0, where the state is z, for steps of size h."""

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
        """The memory from `kept`, what `keep` returned; `memory` is that of `begin` for the same run."""

    def whole(self, system: RollingDiscs, chain: Parameters, z: Phase, h: float, bound: float, album: Any) -> Work | None:
        """All frames of an `album` (`discs.running.album.Album`) from the state z at once, by steps of at most h; without loads.

        None if it cannot, or if the run fails or its kinetic energy exceeds `bound`; it then goes step by step.
        """
        return None

    def threads(self, system: RollingDiscs) -> int:
        """The number of threads of compiled steps: as asked for (`discs.kernels.teams.using`), for chains in lanes."""
        return 1

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
    in_lanes : whether the compiled twin takes chains in lanes (`discs.kernels.lanes`).
    """

    adaptive: ClassVar[bool] = False
    in_lanes: ClassVar[bool] = False

    @property
    def parameters(self) -> Parameters:
        """The NamedTuple of the compiled twin, whose type `step` of `discs.kernels.protocol` is filled in for.

        None if there is none: runs then take the plain form.
        """
        return None

    @final
    @property
    def compiles(self) -> bool:
        return self.parameters is not None

    @final
    def threads(self, system: RollingDiscs) -> int:
        return teams.threads(system.n) if self.in_lanes and system.lanes is not None else 1

    @final
    def twin_of(self, system: RollingDiscs, chain: Parameters) -> Parameters:
        """What the compiled twin is given for `system.parameters`: those in lanes, if it takes them and there are."""
        lanes = system.lanes if self.in_lanes else None
        if lanes is None:
            return chain
        timed = {} if system.load is None else {name: getattr(chain.load, name) for name in ("times", "values", "near", "spent")}
        if (count := self.threads(system)) > 1:
            parts = system.parts(count)
            return teams.Team(tuple(part._replace(load=part.load._replace(**timed)) for part in parts), chain.load.spent)
        return lanes._replace(load=lanes.load._replace(**timed)) if timed else lanes

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
        stops: Stops = NO_STOPS,
    ) -> tuple[Memory, Tally]:
        """The compiled twin of `steps` times `advance` from the time t; `chain` is `system.parameters`.

        Stops after a step whose kinetic energy exceeds `bound`, and after one in which a disc loses its heading; the returned
        state is then undefined. Ctrl-C is polled in every sweep; `Cut` is raised if Python's handler of it does not raise.
        """
        if system.load is not None and not system.load.conservative:
            starts = t + h * np.arange(steps + 1.0)
            times = np.add.outer(starts, h * np.array([0.0, *self.parameters.nodes]))
            chain = chain._replace(load=system.load.timed(times.ravel(), abs(h)))
        if flat := memory[-1].ndim == 1:  # momenta (n,) are (1, n) in compiled code
            state = Phase(memory.hi.copy(), memory.lo.copy(), memory.pi[None].copy())
        else:
            state = type(memory)(*[array.copy() for array in memory])
        tally = self.steps(self.twin_of(system, chain), state, t, h, steps, bound, looks, stops, system.known)
        if system.load is not None and not system.load.conservative:
            tally = tally._replace(spent=chain.load.spent)
        return Phase(state.hi, state.lo, state.pi[0]) if flat else state, tally

    @final
    def steps(
        self,
        chain: Parameters,
        state: Memory,
        t: float,
        h: float,
        steps: int,
        bound: float,
        looks: Looks = NO_LOOKS,
        stops: Stops = NO_STOPS,
        known: Known | None = None,
    ) -> Tally:
        """Compiled steps from a state of the types of compiled code, in place. `Cut` as for `march`.

        known : that of the chain's `RollingDiscs`; None for chains side by side.
        """
        own, arguments = self.parameters, (chain, state, t, h, steps, bound, *looks, *stops)
        if isinstance(chain, teams.Team):
            tally = Tally(*teams.march(driver.march, own, *arguments))
        else:
            call = driver.march if known is None else direct(known, driver.march, own, chain)
            tally = Tally(*call(own, *arguments))
        if tally.steps < 0:
            signal.raise_signal(signal.SIGINT)
            raise Cut
        return tally


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
