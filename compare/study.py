"""N discs against the field, N -> infinity."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike
from tqdm import tqdm

from compare.lump import lump
from compare.quantities import Limit, check_want
from compare.results import Study, compared
from continuum import Scene, solve
from continuum.mesh import viscous
from continuum.solver import spline
from discs import Gauss6, Gauss8, Integrator, Midpoint, Problem, Solution, Suzuki4, checks, simulate
from discs.arrays import Float, Int


def convergence(
    scene: Scene,
    n: tuple[int, ...] = (17, 33, 65, 129),
    ends: str = "springs",
    field: Solution | None = None,
    dt: float | None = None,
    method: str | Integrator | None = None,
    tol: float = 1e-5,
    progress: bool = True,
    degree: int = 1,
    want: Iterable[str] = (),
) -> Study:
    """Simulate a scene with n = n_1, n_2, ... discs and compare with the field at the end.

    Parameters
    ----------
    scene : a scene of `continuum`.
    n : numbers of discs, increasing, at least one.
    ends : see `lump`.
    field : the scene's `solve(scene, tol)`, computed if not given; its last frame must be at the end of the scene.
    dt : time step of the chains; None takes 300 steps, and at least eight for each of the field's.
    method : integrator of the chains; None for Suzuki's composition, "gauss6" with viscosity, "gauss8" for degree 2 and with
        ground forces, in which waves that steps do not resolve are large.
    tol : tolerance of the field, if it is not given.
    progress : show a progress bar.
    degree : see `lump`.
    want : further quantities, "velocity", "slope", "energy_density", "contact_force"; see `compare.quantities`. A given field must
        have them: `solve(scene, tol, want=want)`.

    Raises
    ------
    ValueError : for numbers of discs that do not increase or do not fit the scene; for a field that is not that of the scene, up to
        its end and with an error estimate.
    """
    sizes, problems = checked_sizes(scene, n, ends, degree)
    want = check_want(want, scene)
    checks.instance("field", field, Solution | None, "solve(scene, tol) of this scene, or None")  # type: ignore[arg-type]
    if field is None:
        field = solve(scene, tol, frames=1, progress=progress, want=want)
    if field.error_estimate is None or not np.isclose(field.t[-1], scene.duration, rtol=1e-12):
        raise ValueError(
            f"field must be solve(scene, tol) of this scene up to t = {scene.duration:g}, with an error estimate; got {field!r}"
        )
    h = scene.duration / max(300, 8 * field.stats.get("steps", 0)) if dt is None else checks.number("dt", dt, positive=True)
    if method is None:
        composed = Gauss6(tolerance=1e-10) if viscous(scene, "torsion", "bending") else Suzuki4(Midpoint(tolerance=1e-10))
        method = Gauss8(tolerance=1e-13) if degree == 2 or "contact_force" in want else composed
    fields = compared(scene)
    more = Limit(scene, field, want)
    error = np.empty((len(problems), len(fields) + len(more.names)))
    kind = "elements" if degree == 2 else "own" if scene.steered and not scene.closed else problems[0].chain.ends
    bar = tqdm(problems, desc=f"discs, {kind}", unit="chain", delay=1, disable=not progress)
    for i, problem in enumerate(bar):
        first = progress and i == 0  # which may report that kernels are compiled
        run = simulate(problem, method, h, frames=1, want=more.of_discs, progress=first)
        error[i] = *apart(scene, run, field), *more.errors(run)
    floor = max(field.error_estimate[name] for name in fields)
    k = np.array([problem.chain.k for problem in problems])
    return Study(scene, kind, sizes, k, error, floor, h, more.names, more.floors)


def apart(scene: Scene, run: Solution, field: Solution) -> Float:
    """Largest differences of a run of discs from the field at the end, over the discs, (fields,)."""
    found = []
    for name in compared(scene):
        limit = spline(scene, field.s, _periodic(scene, name, field)[-1:])
        found.append(np.abs(_periodic(scene, name, run)[-1] - limit(run.s)[:, 0]).max())
    return np.array(found)


def checked_sizes(scene: Scene, n: ArrayLike, ends: str, degree: int = 1) -> tuple[Int, list[Problem]]:
    """The sizes of a study and their problems; ValueError if they are not increasing or too small."""
    sizes = np.atleast_1d(np.asarray(n))
    if sizes.ndim != 1 or not sizes.size or sizes.dtype.kind not in "iu" or (np.diff(sizes) <= 0).any():
        raise ValueError(f"n must be increasing whole numbers of discs; got {n!r}")
    return sizes, [lump(scene, int(size), ends, degree) for size in sizes]


def _periodic(scene: Scene, name: str, run: Solution) -> Float:
    """A field (F, N) less the part that grows around a rod periodic up to a shift."""
    shift = {"x": scene.shift[0], "y": scene.shift[1], "phi": 2 * np.pi * scene.turns}.get(name, 0.0)
    values: Float = getattr(run, name)
    return values - shift * run.s / scene.rod.length
