"""Fields of slaved headings to a tolerance, by Galerkin's method (`continuum.galerkin`) with ever more functions and shorter steps.

The error is measured, not extrapolated: a motion on m_j functions is compared with one on m_{j+1} functions, and each measures the
one before. The tolerance of steps (`continuum.stepping`) falls for the first three, so that one difference shows the errors of
functions and of steps; then it stays, and errors of steps are measured by a motion of their own. Where a difference is more than a
third of the last one, shorter steps on the same functions show which of the two is to blame; if it is the steps, their tolerance
falls again and the functions go back by a size.

The finer motion errs too. With a ratio p of its error to that of the coarser one the difference d is (1 - p) times the error, so
the estimate is d/(1 - p): p from the last two differences, at least 1/3, and 1/2 where there is only one (4/5 where initial fields
are narrow, as functions that do not hold them change little). (The corner s = 0, t = 0,
where the initial twist breaks a condition of the ends, leaves waves of wave number q and size q^-6 or less in theta: errors fall
like a power in the end, of the steps like their third; of omega, whose waves have the size q^-4, like their square.)
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from continuum.bounds import FIELDS, missed, over
from continuum.density import Density
from continuum.galerkin import SpectralRod
from continuum.initial import resolve
from continuum.rod import Scene
from continuum.stepping import Steps, TooFast, coarser, finer, stages_for, sweeps
from discs import SimulationError, Solution
from discs.arrays import Float
from discs.running.stats import Stats
from discs.skew import Phase

SIZES = (19, 27, 37, 51, 71, 97, 135, 187, 259, 361)  # functions; odd, as a series has one more cosine than sines
NODES = 1025  # of a solution, so many that splines through them do for derivatives too; more where initial fields are narrow
MOST_NODES = 8192
LOOSEST = 2e-4  # tolerance of a step
FAR = 100.0  # times the tolerance: errors above that are not yet for shorter steps to mend
LEAST, MOST = 1 / 3, 0.8  # what a finer motion errs by, over the error of the coarser one
RATE = 0.5  # the least of that for omega
SAME = 0.05  # of the time: two motions that end so near to each other end there
BENT = 1e-3  # curvature times the length at a free end, from which on a line is said to start bent there


class Plan(NamedTuple):
    """How functions and steps are searched for.

    more : tolerances of the fields below which the search begins one size further.
    first : the tolerance of a step in the first motion, over that of the fields. finer : how often it falls.
    slow : of the last error; one above that falls slowly.
    unknown : what the second motion is thought to err by, over the error of the first.
    """

    more: tuple[float, ...]
    first: float
    finer: int
    slow: float
    unknown: float


PLAN = Plan(more=(3e-4, 3e-6, 3e-8), first=0.5, finer=2, slow=1 / 3, unknown=0.5)
# short waves of narrow fields fill the rod: errors of the functions fall like n^-2.7, and a step passes many waves
NARROW = Plan(more=(0.5, 2e-2, 3e-3, 3e-4, 3e-5, 2e-5), first=0.3, finer=1, slow=0.6, unknown=0.8)
NARROW_STAGES = 12


class Motion(NamedTuple):
    """A motion on n functions.

    rod, states : the functions, and the states at the times, some at once.
    fields : (F, S) by name.
    start : largest error of the fields at the start, (S,), by name.
    tolerance : of a step. steps : their number.
    """

    rod: SpectralRod
    states: list[Phase]
    fields: dict[str, Float]
    start: dict[str, float]
    n: int
    tolerance: float
    steps: int


class Course:
    """Motions of a scene on n functions.

    Parameters
    ----------
    times : (F,), when fields are compared and given.
    stages : of steps.
    compiled : whether steps are taken by `continuum.kernels`, or by their plain twin.

    Attributes
    ----------
    s : (S,), where fields are given.
    """

    def __init__(self, scene: Scene, times: Float, stages: int, compiled: bool = True) -> None:
        self._scene, self._times, self._compiled, self.stages = scene, times, compiled, stages
        initial, length = resolve(scene), scene.rod.length
        narrowest = min((width for _, width in initial.features), default=length)
        nodes = NODES - 1
        while nodes < MOST_NODES and length / nodes > narrowest / 4:
            nodes *= 2
        self.s = length / nodes * np.arange(nodes + (not scene.closed), dtype=float)
        self._density = Density.of(initial)
        self._first = scene.duration / 16  # step to begin with

    def run(self, n: int, tolerance: float) -> Motion:
        rod = SpectralRod(self._scene, n, self._density)
        steps = Steps(rod, self._scene.duration, tolerance, self.stages, self._first, self._compiled)
        at, initial = rod.reader(self.s), self._scene.fields(self.s)
        begun = at(rod.start)
        states = list(steps.at(self._times))
        fields = at(Phase(*(np.concatenate(parts) for parts in zip(*states, strict=True))))
        if steps.lengths:
            self._first = steps.lengths[0]
        start = {name: float(np.abs(begun[name] - initial[name]).max()) for name in FIELDS}
        return Motion(rod, states, fields, start, n, tolerance, len(steps.lengths))


def distances(a: dict[str, Float], b: dict[str, Float]) -> dict[str, float]:
    """Largest difference of each field."""
    return {name: float(np.abs(a[name] - b[name]).max()) for name in FIELDS}


def bent_hint(scene: Scene) -> str:
    """What to say of a scene that starts bent at a free end, against the end's condition x'y'' = y'x''; empty of others."""
    if scene.closed or not scene.rod.bending_stiffness or not scene.rod.radius:
        return ""
    length = scene.rod.length
    d = 1e-4 * length
    curvature = 0.0
    for places in (d * np.arange(4.0), length - d * np.arange(4.0)):
        fields = scene.fields(places)
        r = fields["x"] + 1j * fields["y"]
        slope, bend = (-3 * r[0] + 4 * r[1] - r[2]) / (2 * d), (2 * r[0] - 5 * r[1] + 4 * r[2] - r[3]) / d**2  # to d^2
        curvature = max(curvature, float(abs((slope.conjugate() * bend).imag)) / max(float(abs(slope)) ** 2, 1e-300))
    if curvature * length < BENT:
        return ""
    return "; the line starts bent at a free end, which may be why: the end has no curvature and sends out ever shorter waves"


class Search:
    """The search for functions and steps that reach a tolerance.

    Parameters
    ----------
    bound : largest errors wanted, by field.

    Attributes
    ----------
    course : what runs motions.
    estimate : of the errors of the last motion that was measured, by field.
    """

    def __init__(self, scene: Scene, bound: Mapping[str, float], times: Float, bar: tqdm) -> None:
        self._bound, self._bar = bound, bar
        tol = min(bound.values())
        narrow = bool(resolve(scene).features)
        self._plan = NARROW if narrow else PLAN
        self.course = Course(scene, times, NARROW_STAGES if narrow else stages_for(tol))
        self.estimate = dict.fromkeys(FIELDS, np.inf)
        self._change = np.inf  # of the last two motions, over its bound

    def result(self) -> Motion:
        """A motion within the bounds."""
        tol = min(self._bound.values())
        start = sum(tol < below for below in self._plan.more)
        sizes = SIZES[min(start, len(SIZES) - 2) :]
        tolerance = min(self._plan.first * tol, LOOSEST)
        stages = self.course.stages
        finest = tolerance
        for _ in range(self._plan.finer):
            finest = finer(finest, stages)
        last, failure = None, None
        for n, fewer in zip(sizes, (sizes[0], *sizes), strict=False):
            try:
                found = self._run(n, tolerance)
                if last is not None:
                    before = self._change
                    if self._reached(last, found):
                        return last
                    if self._plan.slow * before < self._change < FAR:
                        shorter = self._run(n, found.tolerance / float(np.clip(2 * self._change, 4.0, 30.0)))
                        by_steps = over(distances(found.fields, shorter.fields), self._bound)
                        if by_steps > self._plan.slow * self._change:  # shorter steps then, and functions as before
                            last, found = self._run(fewer, coarser(shorter.tolerance, stages)), shorter
                            if self._reached(last, found):
                                return last
                            tolerance, finest = shorter.tolerance, finer(shorter.tolerance, stages)
            except SimulationError as error:
                if failure and abs(error.time - failure.time) <= SAME * failure.time:
                    # the earlier one: rounding, which grows where r' vanishes, may carry the other beyond the end
                    raise min(failure, error, key=lambda e: (isinstance(e, TooFast), e.time)) from None
                failure, last, self._change = error, None, np.inf
                continue
            last, tolerance = found, max(finer(tolerance, stages), finest)
        if failure:
            raise failure
        raise ValueError(missed(self.estimate, self._bound, f"on {sizes[-1]} functions"))

    def _run(self, n: int, tolerance: float) -> Motion:
        self._bar.set_postfix(functions=n, refresh=False)
        self._bar.update()
        return self.course.run(n, tolerance)

    def _reached(self, coarse: Motion, fine: Motion) -> bool:
        """Whether the coarser motion is within the bounds."""
        change = distances(coarse.fields, fine.fields)
        before, self._change = self._change, over(change, self._bound)
        ratio = float(np.clip(self._change / before, LEAST, MOST)) if np.isfinite(before) else self._plan.unknown
        ratios = {name: max(ratio, RATE) if name == "omega" else ratio for name in FIELDS}
        self.estimate = {name: max(error / (1 - ratios[name]), coarse.start[name]) for name, error in change.items()}
        if over(self.estimate, self._bound) > 1:
            return False
        if fine.tolerance >= coarse.tolerance:  # both err alike by their steps
            shorter = self._run(coarse.n, finer(coarse.tolerance, self.course.stages))
            by_steps = distances(coarse.fields, shorter.fields)
            self.estimate = {name: error + by_steps[name] / (1 - LEAST) for name, error in self.estimate.items()}
        return over(self.estimate, self._bound) <= 1


def solve_spectral(scene: Scene, bound: Mapping[str, float], times: Float, progress: bool) -> Solution:
    """The fields of a scene with slaved headings at `times` (F,), within the bounds by name; see `continuum.solve`."""
    with (
        tqdm(desc=f"field to {min(bound.values()):g}", unit="run", delay=1, disable=not progress) as bar,
        np.errstate(over="ignore", invalid="ignore", divide="ignore"),
    ):
        search = Search(scene, bound, times, bar)
        try:
            found = search.result()
        except TooFast as error:
            raise SimulationError(error.message + bent_hint(scene), error.step, error.time, error.disc) from None
        except ValueError as error:
            raise ValueError(f"{error}{bent_hint(scene)}") from None
    rounded = {"x": scene.rod.length, "y": scene.rod.length}
    estimate = {name: error + sweeps(found.tolerance) * rounded.get(name, 1.0) for name, error in search.estimate.items()}
    stats: Stats = {
        "method": "spectral",
        "order": None,
        "functions": found.n,
        "dt": scene.duration / max(found.steps, 1),
        "steps": found.steps,
    }
    energy, slip = (np.concatenate([f(z) for z in found.states]) for f in (found.rod.energies, found.rod.slip))
    x, y, theta, omega = (found.fields[name] for name in FIELDS)
    return Solution(times, search.course.s, x, y, theta, omega, energy, slip, stats, error_estimate=estimate)
