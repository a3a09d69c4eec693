"""One motion of a scene with slaved headings on n functions, at the times of frames and on the nodes of a solution."""

from typing import NamedTuple

import numpy as np

from continuum.density import Density
from continuum.end_identities import EndIdentities, hold
from continuum.functions import unresolved
from continuum.galerkin import SpectralRod
from continuum.ground import Ground
from continuum.initial import resolve
from continuum.pieces import POINTS
from continuum.rod import Scene
from continuum.stepping import Steps
from continuum.wants import with_inside
from discs import checks
from discs.arrays import Float
from discs.kernels.background import Kernels, usual
from discs.running.engine import ENGINES
from discs.skew import Phase

NODES = 1025  # nodes of a solution, enough for splines and their derivatives; more if the initial fields are narrow
MOST_NODES = 8192
FEWEST = 19  # functions of a step that only compiles
_PREPARED: set[tuple[type, ...]] = set()  # kinds of rods whose kernels are there


def first_step(scene: Scene, stages: int) -> None:
    """Take a short step of a scene, which compiles its kernel or reads it from disc."""
    rod = SpectralRod(scene, FEWEST, Density.of(resolve(scene)))
    moments = np.array([1e-6 * scene.duration])
    list(Steps(rod, moments[0], 1e-3, stages, moments[0]).at(moments))


class Motion(NamedTuple):
    """A motion on n functions.

    rod, states : the system, and its states at the times, in groups.
    fields : (F, S) by name, and wanted quantities.
    start : largest error of the fields at the start, by name, and what parameters that are not resolved may add to it.
    tolerance : of a step. steps : number of steps.
    balance, reaction : (F, 2), work and dissipation, and (F, motors), torques of motors; None without loads, and motors.
    """

    rod: SpectralRod
    states: list[Phase]
    fields: dict[str, Float]
    start: dict[str, float]
    n: int
    tolerance: float
    steps: int
    balance: Float | None = None
    reaction: Float | None = None


class Runner:
    """Runs motions of a scene on n functions.

    Parameters
    ----------
    times : (F,), the times at which fields are compared and returned.
    stages : number of stages of a step.
    compiled : whether to use `continuum.kernels` or the plain twin; None for the twin until they are compiled, in the background,
        unless DISCS_ENGINE in the environment is "compiled" or "plain".
    want : further quantities, see `continuum.wants`.

    Attributes
    ----------
    s : (S,), the places at which fields are returned.
    """

    def __init__(self, scene: Scene, times: Float, stages: int, compiled: bool | None = None, want: tuple[str, ...] = ()) -> None:
        self._scene, self.times, self._compiled, self.stages, self._want = scene, times, compiled, stages, want
        initial, length = resolve(scene), scene.rod.length
        narrowest = min((width for _, width in initial.features), default=length)
        nodes = NODES - 1
        while nodes < MOST_NODES and length / nodes > narrowest / 4:
            nodes *= 2
        self.s = length / nodes * np.arange(nodes + (not scene.closed), dtype=float)
        self._density = Density.of(initial)
        self._first = scene.duration / 16  # length of the first step

    def run(self, n: int, tolerance: float) -> Motion:
        rod = SpectralRod(self._scene, n, self._density)
        watch = EndIdentities(rod) if "contact_force" in self._want and hold(self._scene) else None
        settled = bool(self._want and rod.loads and rod.loads.viscous)
        steps = Steps(rod, self._scene.duration, tolerance, self.stages, self._first, self._kernels(rod), watch, settled)
        at, initial = rod.reader(self.s), self._scene.fields(self.s)
        begun = at(rod.start)
        states = list(steps.at(self.times))
        every = Phase(*(np.concatenate(parts) for parts in zip(*states, strict=True)))
        fields = at(every)
        if self._want:
            fields |= self._wanted(rod, states, watch, steps)
        if steps.lengths:
            self._first = steps.lengths[0]
        start = distances(begun, initial)
        if self._scene.rod.varying:
            missed = unresolved(rod.functions, self._scene.rod, *resolve(self._scene).quadrature(POINTS))
            start = {name: start[name] + missed * moved for name, moved in distances(fields, begun).items()}
        balance = reaction = None
        if rod.loads:  # what signals change of the energy is work, too
            balance = np.concatenate(steps.balance)
            balance[:, 0] += rod.loads.driven(self.times, every.hi + every.lo) - rod.loads.driven(np.zeros(1), rod.start.hi[None])
            reaction = np.concatenate(steps.reaction) if rod.loads.held.size else None
        return Motion(rod, states, fields, start, n, tolerance, len(steps.lengths), balance, reaction)

    def _kernels(self, rod: SpectralRod) -> bool | Kernels:
        """Whether to use kernels."""
        if self._compiled is not None:
            return self._compiled
        engine = checks.choice("DISCS_ENGINE", usual(), ENGINES)
        if engine in ("compiled", "plain"):
            return engine == "compiled"
        key = type(rod.parameters), *map(type, rod.parameters)
        if key not in _PREPARED:
            there = Kernels(engine, first_step, self._scene, self.stages)
            if not there:
                return there
            _PREPARED.add(key)
        return True

    def _wanted(self, rod: SpectralRod, states: list[Phase], watch: EndIdentities | None, steps: Steps) -> dict[str, Float]:
        ground, none = Ground(rod, self.s, self._want), [None] * len(states)
        times = np.split(self.times, np.cumsum([len(z.pi) for z in states])[:-1])
        known = none if watch is None else [watch.at(*group) for group in zip(states, steps.integrals, strict=True)]
        groups = zip(times, states, known, steps.rolling or none, steps.reaction or none, strict=True)
        parts = [ground.at(*group) for group in groups]
        return with_inside({name: np.concatenate([part[name] for part in parts]) for name in parts[0]}, self.s, rod.closed)


def distances(a: dict[str, Float], b: dict[str, Float]) -> dict[str, float]:
    """The largest difference in each field that both have."""
    return {name: float(np.abs(value - b[name]).max()) for name, value in a.items() if name in b}
