"""Fields of steered rods (sections with headings of their own) to a tolerance, by elements whose number grows."""

from collections.abc import Mapping, Sequence
from math import lcm
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from continuum.bounds import LEAST, missed, over
from continuum.element_grid import DEGREE
from continuum.element_ground import ElementGround
from continuum.elements import UNKNOWNS, Course, Elements
from continuum.initial import resolve
from continuum.rod import Scene
from continuum.wants import INSIDE, with_inside
from discs import Solution
from discs.arrays import Float

RATES = ("omega", "phi_rate")
MOST = 8.0  # largest ratio of an error to a change
WANTED = 2.5  # the same for wanted quantities: the estimate is then within five of the error from order 0.2 on
COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256)  # numbers of elements
SURE = 4  # changes after which slowly falling errors count as such
SLOW = 3.0  # order of errors below which fields count as rough
FRONTS = (
    "; errors fall slowly: loads that start at once, at a point or against the condition at an end, send fronts along the rod; "
    "start them smoothly, as by signals.smooth"
)
PLACES = 1024  # nodes of a solution, or a multiple


class Found(NamedTuple):
    """A motion on elements."""

    elements: Elements
    course: Course

    def sample(self, s: Float, times: Float, want: tuple[str, ...]) -> dict[str, Float]:
        """The unknowns (F, S) at places s (S,), by name, and wanted quantities."""
        values = self.elements.sample(self.course.q.swapaxes(0, 1), s)
        found = dict(zip(UNKNOWNS, values, strict=True))
        if want:
            ground = ElementGround(self.elements, s, want)
            frames = [ground.at(float(t), q) for t, q in zip(times, self.course.q, strict=True)]
            stacked = {name: np.stack([frame[name] for frame in frames]) for name in frames[0]}
            found |= with_inside(stacked, s, self.elements.scene.closed)
        return found


def solve_elements(scene: Scene, bound: Mapping[str, float], times: Float, progress: bool, want: tuple[str, ...] = ()) -> Solution:
    """The fields within bounds by name; the error is measured with more elements.

    1. Start with the fewest elements that resolve the initial fields: bounded fields within their bounds, other fields, and
       parameters that vary, to a tenth.
    2. Compute the motion with the next number of elements in COUNTS, and the change from the last motion.
    3. If errors fall like count^-p, the error of the coarser of two counts c < C, which is the result, is

           (change from c to C)/(1 - (c/C)^p).

       p is measured from the changes themselves (`falls`). The factor is at least 1.5 and at most `MOST`. Smooth data have p of 4
       and more. A corner of the data propagates as a corner; then p is at most 1. The estimate is at least the error of the initial
       fields.
    4. If the estimate is within the bounds, stop. Otherwise go to 2.

    Returns
    -------
    Solution on equally spaced nodes; the spacing is the length over a multiple of 1024.
    """
    rest = min(1e-7, *(limit / (1e4 if name in RATES else 1e2) for name, limit in bound.items()))  # of the steps, in angles
    first = next((i for i, count in enumerate(COUNTS) if _holds(Elements(scene, count), bound)), len(COUNTS))
    counts = COUNTS[first:]
    if len(counts) < 3:
        what = "initial fields and the rod's parameters" if scene.rod.varying else "initial fields"
        raise ValueError(
            f"tol is not reached on {COUNTS[-1]} elements, as these do not resolve the {what}: {_sharpest(scene)}; "
            f"take fields varying over length/{COUNTS[-1] // 4} = {4 * scene.rod.length / COUNTS[-1]:.2g} or more, or a larger tol"
        )
    runs: list[Found] = []
    changes: list[Float] = []
    with tqdm(desc=f"field to {min(bound.values()):g}", unit="run", delay=1, disable=not progress) as bar:
        for count in counts:
            system = Elements(scene, count)
            bar.set_postfix(elements=count, refresh=False)
            runs = [*runs[-1:], Found(system, system.run(times, rest))]
            bar.update()
            if len(runs) < 2:
                continue
            cells = lcm(PLACES, *(run.elements.count for run in runs))
            s = scene.rod.length / cells * np.arange(cells + (not scene.closed), dtype=float)
            values, finer = (run.sample(s, times, want) for run in runs)
            changes.append(np.array([np.abs(value - finer[name]).max() for name, value in values.items()]))
            if len(changes) < 2:
                continue
            found = runs[0].elements
            last, smooth = counts.index(count), not resolve(scene).kinks
            used = counts[last - len(changes[-3:]) : last + 1]
            factors = falls(np.array(changes[-3:]), used, np.inf if smooth else 1.0)
            factors[len(UNKNOWNS) :] = np.minimum(factors[len(UNKNOWNS) :], WANTED)
            estimates = zip(values, factors * changes[-1] + rest, strict=True)
            error = {name: max(float(estimate), found.misfit.get(name, 0.0)) for name, estimate in estimates}
            if over(error, bound) <= 1:
                break
            order = np.inf if smooth else 2.0  # at best
            measured = min(orders(np.array(changes[-3:]), used)[list(values).index(name)] for name in bound)
            fronts = bool(scene.loads) and len(changes) >= SURE and measured < SLOW
            if fronts:
                order = max(measured, 1.0) + 0.5
            if count == counts[-1] or _hopeless(over(error, bound), found.count, order):
                raise ValueError(missed(error, bound, f"on {found.n} nodes") + _corners(scene) + (FRONTS if fronts else ""))
    return Solution(
        t=times,
        s=s,
        energy=runs[0].course.energy,
        balance=runs[0].course.balance,
        reaction=runs[0].course.reaction,
        stats={"method": "elements", "order": DEGREE, "elements": found.grid.count, "nodes": found.n},
        error_estimate=error,
        **{name: value for name, value in values.items() if name not in INSIDE.values()},  # type: ignore[arg-type]
    )


def falls(changes: Float, counts: Sequence[int], most: float) -> Float:
    """The ratios of the error on the last count but one to the last change, (fields,).

    Parameters
    ----------
    changes : (m, fields), two or three changes between the counts (m + 1,).
    most : largest order p.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        factor: Float = 1 / (1 - (counts[-2] / counts[-1]) ** np.clip(orders(changes, counts), 1e-3, most))
    return np.clip(factor, 1.5, MOST)


def orders(changes: Float, counts: Sequence[int]) -> Float:
    """The orders p at which changes fall, (fields,); arguments are as for `falls`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        found: Float = np.nan_to_num(np.log(changes[0] / changes[-1]) / np.log(counts[-2] / counts[-len(changes) - 1]))
    return found


def _hopeless(times: float, count: int, order: float) -> bool:
    """Whether errors, `times` times the bounds, will stay above them if they fall at most at an order in the number of elements."""
    return bool(times * (count / COUNTS[-2]) ** order > 1)


def _corners(scene: Scene) -> str:
    """A hint for messages about initial fields that have corners; empty for others."""
    kinks = resolve(scene).kinks
    what = "initial fields or the rod's parameters" if scene.rod.varying else "initial fields"
    return f": the {what} have a corner at s = {kinks[0]:.4g}, which the motion keeps; round it" if kinks else ""


def _sharpest(scene: Scene) -> str:
    """Where the initial fields vary most, for messages."""
    features = resolve(scene).features
    if not features:
        return "they have corners" if resolve(scene).kinks else "they vary too fast"
    place, width = min(features, key=lambda feature: feature[1])
    return f"they vary within {width:.2g} at s = {place:.4g}"


def _holds(system: Elements, bound: Mapping[str, float]) -> bool:
    """Whether the elements resolve the initial fields: bounded fields within their bounds, others, and parameters, to a tenth."""
    scene = system.scene
    unit = {"x": scene.rod.length, "y": scene.rod.length, "omega": 1 / scene.duration, "phi_rate": 1 / scene.duration}
    if any(system.misfit[name] > 1 / 10 for name in scene.rod.varying):
        return False
    for name in UNKNOWNS:
        misfit = system.misfit[name]
        size = float(np.ptp(system.start[UNKNOWNS.index(name)])) / 2
        rounding = LEAST * unit.get(name, 1.0)
        small = max(size / 10, min(bound.values()) / scene.duration) if name in RATES else size / 10
        if misfit > bound.get(name, small) + rounding:
            return False
    return True
