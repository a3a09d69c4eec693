"""Fields of slaved headings to a tolerance, by Galerkin's method (`continuum.galerkin`) with ever more functions and steps.

The error of m_j functions is measured, not extrapolated: it is what m_{j+1} functions change, which err several times less. The
coarser field is the solution, the finer one only its measure. Functions are added in long steps; when that changes less than half
of the tolerance the steps of "gauss8" are halved until half as long ones change less than a quarter, and the functions are measured
again: long steps hide high waves. The rest of the tolerance is for the errors of the finer ones. (The corner s = 0, t = 0, where
the initial twist breaks a condition of the ends, leaves waves of wave number q and size q^-6 or less in theta: an error does not
fall exponentially in the end, and how fast it falls cannot be told from the falls before.)
"""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from continuum.bounds import FIELDS, missed, over
from continuum.galerkin import SpectralRod
from continuum.rod import Scene
from discs import Gauss8, SimulationError, Solution
from discs.integrators.base import Work
from discs.integrators.gauss import tableau
from discs.simulation import steps_before
from discs.system import Phase

SIZES = (19, 27, 37, 51, 71, 97, 135, 187, 259)  # functions; odd, as a series has one more cosine than sines
FEWEST = 16
MOST_STEPS = FEWEST * 2**10
NODES = 1025  # of a solution, so many that splines through them do for derivatives too
POSITIONS = FIELDS[:3]
BENT = 1e-3  # curvature times the length at a free end, from which on a line is said to start bent there


class Course:
    """Runs of a scene on n functions with a number of steps, kept for comparison.

    Parameters
    ----------
    times : (F,), when fields are compared and given.
    tolerance : of the sweeps of a step.
    compiled : whether steps are taken by `continuum.kernels`, or one by one by their plain twin.
    """

    def __init__(self, scene: Scene, times: NDArray, tolerance: float, bar: tqdm, compiled: bool = True) -> None:
        self._scene, self._times, self._bar, self._compiled = scene, times, bar, compiled
        self.tolerance, self._method = tolerance, Gauss8(tolerance=tolerance)
        length = scene.rod.length
        self.s = np.linspace(0, length, NODES) if not scene.closed else length / (NODES - 1) * np.arange(NODES - 1)
        self._found: dict[tuple[int, int], dict[str, Any]] = {}
        self.hint = bent_hint(scene)

    def run(self, n: int, steps: int) -> dict[str, Any]:
        """Fields (F, S), energy and slip (F,); SimulationError if the motion cannot go on, or not with these steps."""
        if (n, steps) not in self._found:
            self._bar.set_postfix(functions=n, steps=steps, refresh=False)
            self._bar.update()
            self._found[n, steps] = self._run(n, steps)
        return self._found[n, steps]

    def _run(self, n: int, steps: int) -> dict[str, Any]:
        rod = SpectralRod(self._scene, n)
        h, z = self._scene.duration / steps, rod.start(self._scene)
        bound = 10 * rod.energy(z)
        rows: dict[str, list] = {}
        done = 0
        for time in self._times.tolist():
            last, rest = steps_before(time, h)
            while done < last:
                z, taken = self._march(rod, z, h, last - done, bound)
                done += taken
                self._check(rod, z, taken, done, h)
            shown = z
            if rest:
                shown, taken = self._march(rod, z, rest, 1, bound)
                self._check(rod, shown, taken, done, h)
            found = rod.at(shown, self.s) | {"energy": rod.energy(shown), "rolling_residual": rod.slip(shown)}
            for name, value in found.items():
                rows.setdefault(name, []).append(value)
        return {name: np.array(values) for name, values in rows.items()}

    def _march(self, rod: SpectralRod, z: Phase, h: float, steps: int, bound: float) -> tuple[Phase, int]:
        """At most so many steps from z, to the last that converges or the first that loses a heading; and how many they are."""
        if not self._compiled:
            work = Work()
            after = self._method.step(rod, z, h, work)
            return (z, 0) if work.unconverged or not rod.energy(after) <= bound else (after, 1)
        from continuum.kernels.collocation import gauss

        z = Phase(z.hi.copy(), z.lo.copy(), z.pi.copy())
        method, coefficients = self._method, tuple(tableau(self._method.stages))
        return z, gauss(rod.kernel, z.hi, z.lo, z.pi[None], coefficients, h, steps, method.sweeps, method.tolerance, bound)[0]

    def _check(self, rod: SpectralRod, z: Phase, taken: int, step: int, h: float) -> None:
        """Stop where |r'| vanishes under the unit law (or where a step that does not converge leads), or no step was taken."""
        slopes = rod.slopes(z, 0.0 if taken else h)
        node = int(np.argmin(slopes))
        if not slopes[node] > rod.near:
            raise SimulationError(
                "the rod lost its heading: r' = 0, and rolling='unit' has no direction there", step, step * h, node
            )
        if not taken:
            raise SimulationError(f"steps do not converge: the motion is too fast for them{self.hint}", step, step * h, node)

    def effect(self, n: int, steps: int) -> dict[str, float]:
        """Of the steps on n functions: what twice as many change."""
        return distances(self.run(n, steps), self.run(n, 2 * steps))


def distances(a: dict[str, NDArray], b: dict[str, NDArray]) -> dict[str, float]:
    """Largest difference of each field."""
    return {name: float(np.abs(a[name] - b[name]).max()) for name in FIELDS}


def possible_steps(course: Course, sizes: tuple[int, ...], steps: int) -> int:
    """So many steps, or twice, four times, ... as many, that the motion can be followed on these numbers of functions."""
    last = None
    while steps <= MOST_STEPS:
        try:
            for n in sizes:
                course.run(n, steps)
            return steps
        except SimulationError as error:
            if last and error.message == last.message and abs(error.time - last.time) < 0.02 * last.time:
                raise  # twice as many steps end there too
            last = error
        steps *= 2
    raise _too_fast(course)


def enough_steps(course: Course, n: int, steps: int, bound: Mapping[str, float]) -> int:
    """So many steps, or twice, four times, ... as many, that their effect on n functions is below a quarter of the bounds."""
    while steps <= MOST_STEPS:
        if over(course.effect(n, steps), bound) <= 1 / 4:
            return steps
        steps *= 2
    raise _too_fast(course)


def _too_fast(course: Course) -> ValueError:
    return ValueError(
        f"tol is not reached in {MOST_STEPS} time steps: the motion is too sensitive or too fast; "
        f"ask for a larger tol or a shorter duration{course.hint}"
    )


def bent_hint(scene: Scene) -> str:
    """What to say of a scene that starts bent at a free end, against the end's condition x'y'' = y'x''; empty of others."""
    if scene.closed or not scene.rod.bending_stiffness or not scene.rod.radius:
        return ""
    length = scene.rod.length
    d = 1e-4 * length
    curvature = 0.0
    for places in (d * np.arange(4), length - d * np.arange(4)):
        fields = scene.fields(places)
        r = fields["x"] + 1j * fields["y"]
        slope, bend = (-3 * r[0] + 4 * r[1] - r[2]) / (2 * d), (2 * r[0] - 5 * r[1] + 4 * r[2] - r[3]) / d**2  # to d^2
        curvature = max(curvature, float(abs((slope.conjugate() * bend).imag)) / max(float(abs(slope)) ** 2, 1e-300))
    if curvature * length < BENT:
        return ""
    return "; the line starts bent at a free end, which may be why: the end has no curvature and sends out ever shorter waves"


def solve_spectral(scene: Scene, bound: Mapping[str, float], times: NDArray, progress: bool) -> Solution:
    """The fields of a scene with slaved headings at `times` (F,), within the bounds by name; see `continuum.solve`."""
    tol = min(bound.values())
    with (
        tqdm(desc=f"field to {tol:g}", unit="run", delay=1, disable=not progress) as bar,
        np.errstate(over="ignore", invalid="ignore", divide="ignore"),
    ):
        course = Course(scene, times, min(1e-8, 1e-3 * tol), bar)
        steps = FEWEST
        for n, more in pairwise(SIZES):
            steps = possible_steps(course, (n, more), steps)
            space = distances(course.run(n, steps), course.run(more, steps))
            if over(space, bound) <= 1 / 2:
                steps = enough_steps(course, n, steps, bound)
                space = distances(course.run(n, steps), course.run(more, steps))
            if over(space, bound) > 1 / 2:
                continue
            time, found = course.effect(n, steps), course.run(n, steps)
            unit = {"x": scene.rod.length, "y": scene.rod.length}
            rest = {name: course.tolerance * unit.get(name, 1.0) for name in FIELDS}  # of the sweeps
            estimate = {name: space[name] + time[name] + rest[name] for name in FIELDS}
            stats = {"method": "spectral", "order": None, "functions": n, "dt": scene.duration / steps, "steps": steps}
            return Solution(t=times, s=course.s, error_estimate=estimate, stats=stats, **found)
    raise ValueError(missed(space, bound, f"on {n} functions") + course.hint)
