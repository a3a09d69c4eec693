"""Fields of slaved headings to a tolerance, by Galerkin's method (`continuum.galerkin`) with more functions and shorter steps.

The error is measured: a motion on m_j functions is compared with one on m_{j+1} functions, so each motion measures the one before.

1. The tolerance of steps (`continuum.stepping`) falls to a fifth from motion to motion, so that one difference shows the errors of
   functions and of steps together. After five motions (two if the initial fields are narrow) it is constant, and the errors of
   steps are measured by a separate motion. So they are where the finer motion took no more steps than the coarser one, as its
   smaller tolerance shortened none.
2. If a difference is more than a third of the last one, a motion with shorter steps on the same functions shows which of the two
   errors dominates. If it is that of the steps, their tolerance falls again, and the number of functions goes back by one size.
3. The finer motion has an error too. Let p be the ratio of its error to that of the coarser one. Then the difference d is (1 - p)
   times the error of the coarser one, and the estimate is d/(1 - p). p is taken from the last two differences, and is at least
   1/3. If there is only one difference p is 1/2, or 4/5 if the initial fields are narrow, because functions that do not resolve
   narrow fields change little.
4. What sweeps leave is added, as a bound, which may be far above the error of a motion that is much more accurate than asked for.
   If the tolerance of sweeps of the finer motion is half or less, most of it is part of the difference, and UNSEEN of it is added:
   sweeps that converge fast may be as many in both motions.

At the corner s = 0, t = 0 the initial twist violates an end condition. This leaves waves of wave number q and size q^-6 or less in
theta, and q^-4 in omega. So the errors finally fall like a power of the step, the third for theta, the second for omega.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from tqdm import tqdm

from continuum.bounds import FIELDS, missed, over
from continuum.hints import bent_hint, corner_hint, point_hint, points_inside, rough_hint
from continuum.initial import resolve
from continuum.motion import Motion, Runner, distances
from continuum.rod import Scene
from continuum.stepping import TooFast, stages_for, sweeps
from continuum.wants import arrays, estimated
from discs import SimulationError, Solution
from discs.arrays import Float
from discs.stats import Stats

SIZES = (19, 27, 37, 51, 71, 97, 135, 187, 259, 361)  # functions; odd, as a series has one more cosine than sines
SLOW, MORE = 259, (505, 707, 1001)  # from here on motions are slow, and taken only if the errors fall fast enough
LOOSEST = 2e-4  # largest tolerance of a step
FINER = 0.2  # ratio of the tolerances of steps of two motions; errors are about in proportion to it, so p is below LEAST
ROUNDED = 1e-13  # smallest tolerance of a step: rounding hides the effect of smaller ones
FAR = 100.0  # times the tolerance: for larger errors shorter steps are not tried
LEAST, MOST = 1 / 3, 0.8  # limits of p, the error of a finer motion over that of the coarser one
RATE = 0.5  # least p of omega
WANTED = 0.4  # p of wanted quantities: the estimate is within five of the error where their own p is from -2 to 0.88
MORE_STEPS = 1.2  # ratio of the numbers of steps above which two motions differ by their errors of steps
UNSEEN = 0.001  # share of what sweeps leave that the difference of two motions may not show; 5e-4 on waves of a straight rod
SAME = 0.05  # relative: the end of a motion is real if two motions agree on its time to this


class Plan(NamedTuple):
    """The search strategy for functions and steps.

    more : the search starts one size further for each of these that the tolerance of the fields is below.
    first : tolerance of a step in the first motion, over that of the fields. finer : number of times it falls.
    slow : ratio of the last two errors above which errors fall slowly.
    unknown : assumed ratio of the error of the second motion to that of the first.
    """

    more: tuple[float, ...]
    first: float
    finer: int
    slow: float
    unknown: float


PLAN = Plan(more=(3e-4, 3e-6, 3e-8, 3e-10), first=0.5, finer=4, slow=1 / 3, unknown=0.5)
# narrow fields send short waves through the rod: errors of the functions fall like n^-2.7, and a step passes many waves
NARROW = Plan(more=(0.5, 2e-2, 3e-3, 3e-4, 3e-5, 2e-5), first=0.2, finer=1, slow=0.6, unknown=0.8)
NARROW_STAGES = 12


class Search:
    """The search for functions and steps that reach a tolerance.

    Parameters
    ----------
    bound : largest errors allowed, by field.

    Attributes
    ----------
    runner : runs the motions.
    estimate : estimated errors of the last motion that was measured, by field.
    """

    def __init__(self, scene: Scene, bound: Mapping[str, float], times: Float, bar: tqdm, want: tuple[str, ...] = ()) -> None:
        self._bound, self._bar = bound, bar
        tol = min(bound.values())
        narrow = bool(resolve(scene).features)
        self._plan = NARROW if narrow else PLAN
        self.runner = Runner(scene, times, NARROW_STAGES if narrow else stages_for(tol), want=want)
        self.estimate = dict.fromkeys((*FIELDS, *estimated(want, scene.closed)), np.inf)
        self._change = np.inf  # of the last two motions, over its bound
        self._ratio = np.inf  # of the last two changes
        self._pointed = bool(points_inside(scene))
        self._narrow = narrow
        self._swept = {"x": 0.1 * scene.rod.length, "y": 0.1 * scene.rod.length, "theta": 0.2}
        self._pair: tuple[Motion, Motion] | None = None

    def result(self) -> Motion:
        """A motion within the bounds. ValueError, with a hint at the cause, if none is found."""
        tol = min(self._bound.values())
        start = sum(tol < below for below in self._plan.more)
        sizes = (SIZES + MORE)[min(start, len(SIZES) - 2) :]
        tolerance = min(self._plan.first * tol, LOOSEST)
        finest = tolerance * FINER**self._plan.finer
        last, failure = None, None
        for n, fewer in zip(sizes, (sizes[0], *sizes), strict=False):
            if self._hopeless(n, last, len(sizes[sizes.index(n) :])):
                break
            try:
                found = self._run(n, tolerance)
                if last is not None:
                    before = self._change
                    if self._reached(last, found):
                        return last
                    if self._plan.slow * before < self._change < FAR and found.tolerance > ROUNDED:
                        shorter = self._run(n, found.tolerance / float(np.clip(2 * self._change, 4.0, 30.0)))
                        by_steps = over(distances(found.fields, shorter.fields), self._bound)
                        if by_steps > self._plan.slow * self._change:  # the steps dominate: shorter ones, functions as before
                            last, found = self._run(fewer, shorter.tolerance / FINER), shorter
                            if self._reached(last, found):
                                return last
                            tolerance, finest = shorter.tolerance, FINER * shorter.tolerance
            except SimulationError as error:
                if failure and abs(error.time - failure.time) <= SAME * failure.time:
                    # the earlier one, as rounding, which grows where r' vanishes, may have carried the other beyond the end
                    raise min(failure, error, key=lambda e: (isinstance(e, TooFast), e.time)) from None
                failure, last, self._change = error, None, np.inf
                continue
            last, tolerance = found, max(FINER * tolerance, finest, ROUNDED)
        if failure:
            raise failure
        rounded = ", whose rounding may be the cause" if last and last.tolerance <= ROUNDED else ""
        raise ValueError(missed(self.estimate, self._bound, f"on {last.n if last else SIZES[-1]} functions{rounded}"))

    def _hopeless(self, n: int, last: Motion | None, left: int) -> bool:
        """Whether n functions, and `left` sizes from there on, will not do.

        Changes fall ever faster once a motion is resolved: at most as if by the square of the last ratio. With loads at points they
        fall like 1/n (`hints.point_hint`).
        """
        if self._pointed and last is not None and np.isfinite(self._ratio):
            at_most = over(self.estimate, self._bound) * last.n / SIZES[-1]
            return n > SIZES[-1] or at_most > 3  # as estimates are up to that much too large
        return (n in MORE or (n >= SLOW and not self._narrow)) and self._change * min(self._ratio, 1.0) ** (2 * left) > 1

    def rough(self) -> str:
        """A hint from the last two motions, see `hints.rough_hint`."""
        if self._pair is None:
            return ""
        coarse, fine = self._pair
        times = self.runner.times
        off = [
            np.abs(coarse.fields[name] - fine.fields[name]).reshape(times.size, -1).max(axis=1) / limit
            for name, limit in self._bound.items()
        ]
        slopes = np.concatenate([fine.rod.slopes(z) for z in fine.states])
        return rough_hint(slopes, times, np.max(off, axis=0) <= 1)

    def _run(self, n: int, tolerance: float) -> Motion:
        self._bar.set_postfix(functions=n, refresh=False)
        self._bar.update()
        return self.runner.run(n, tolerance)

    def _reached(self, coarse: Motion, fine: Motion) -> bool:
        """Whether the coarser motion is within the bounds."""
        change, self._pair = distances(coarse.fields, fine.fields), (coarse, fine)
        before, self._change = self._change, over(change, self._bound)
        self._ratio = self._change / before
        ratio = float(np.clip(self._ratio, LEAST, MOST)) if np.isfinite(before) else self._plan.unknown
        ratios = {name: max(ratio, RATE) if name == "omega" else ratio for name in FIELDS}
        self.estimate = {
            name: max(error / (1 - ratios.get(name, WANTED)), coarse.start.get(name, 0.0)) for name, error in change.items()
        }
        if over(self.estimate, self._bound) > 1:
            return False
        if fine.tolerance >= coarse.tolerance or fine.steps <= coarse.steps:  # the difference does not show the error of steps
            by_steps = distances(coarse.fields, self._shorter(coarse).fields)
            self.estimate = {name: error + by_steps[name] / (1 - LEAST) for name, error in self.estimate.items()}
        # on nine scenes sweeps moved x and y by up to 0.02 of their tolerance times the length, theta by 0.12, rates by 1.1 of it
        rest = sweeps(coarse.tolerance)
        if rest >= 2 * sweeps(fine.tolerance):
            rest *= UNSEEN
        self.estimate = {name: error + rest * self._swept.get(name, 1.0) for name, error in self.estimate.items()}
        return over(self.estimate, self._bound) <= 1

    def _shorter(self, motion: Motion) -> Motion:
        """The motion on the same functions in more steps; a smaller tolerance may leave the number of a few steps as it is."""
        tolerance, found = motion.tolerance, motion
        for _ in range(4):
            tolerance *= FINER
            found = self._run(motion.n, tolerance)
            if found.steps > MORE_STEPS * motion.steps:
                break
        return found


def solve_spectral(scene: Scene, bound: Mapping[str, float], times: Float, progress: bool, want: tuple[str, ...] = ()) -> Solution:
    """The fields of a scene with slaved headings at `times` (F,), within bounds by name; see `continuum.solve`, for errors too."""
    with (
        tqdm(desc=f"field to {min(bound.values()):g}", unit="run", delay=1, disable=not progress) as bar,
        np.errstate(over="ignore", invalid="ignore", divide="ignore"),
    ):
        search = Search(scene, bound, times, bar, want)
        try:
            found = search.result()
        except TooFast as error:
            raise SimulationError(error.message + bent_hint(scene), error.step, error.time, error.disc) from None
        except ValueError as error:
            hints = bent_hint(scene) + point_hint(scene) + corner_hint(scene)
            raise ValueError(f"{error}{hints or search.rough()}") from None
    estimate = search.estimate
    stats: Stats = {
        "method": "spectral",
        "order": None,
        "functions": found.n,
        "dt": scene.duration / max(found.steps, 1),
        "steps": found.steps,
    }
    slip = np.concatenate([found.rod.slip(z) for z in found.states])
    ends = np.cumsum([len(z.pi) for z in found.states])[:-1]
    groups = zip(found.states, np.split(times, ends), strict=True)
    energy = np.concatenate([found.rod.energies(z, t) for z, t in groups])
    if found.balance is not None:
        estimate["energy"] = float(np.abs(energy - found.balance @ (1, -1) - found.rod.start_energy).max())
    x, y, theta, omega = (found.fields[name] for name in FIELDS)
    run = Solution(times, search.runner.s, x, y, theta, omega, energy, slip, stats, error_estimate=estimate, balance=found.balance)
    wanted: dict[str, Any] = {name: found.fields[name] for name in arrays(want, scene.closed)}
    return replace(run, reaction=found.reaction, **wanted)
