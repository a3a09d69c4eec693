"""The main job: one scene, N -> infinity, the motion and the energy."""

import warnings
from concurrent.futures import Executor, Future, wait
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from tqdm import tqdm

from compare.lump import lump
from compare.outputs import fresh_files
from compare.quantities import offered
from compare.results import Study, write_studies
from compare.study import checked_sizes, convergence
from compare.tables import aligned
from continuum import Scene, solve
from discs import Gauss8, Solution, simulate, suggest_dt
from discs.kernels.background import usual
from discs.running.ready import kernels

SIZES = (17, 33, 65, 129, 257, 513)
T = TypeVar("T")
LONG = 100 / 3  # durations of a scene with free ends, 150 for the paper's
INSTANTS = 5


def overview(
    scene: Scene,
    out: str | Path,
    n: tuple[int, ...] = SIZES,
    tol: float = 1e-7,
    progress: bool = True,
    executor: Executor | None = None,
    degree: int = 1,
) -> list[Study]:
    """Compare a scene's discs with its field; write the table and the pictures to `out`.

    Writes convergence.csv, convergence.png, limits-of-all.png (velocities, slopes, energy and the ground's force), motion.png and
    energy.png. The energy is shown over 33 times the scene's duration, [0, 150] for the paper's, and over the duration itself for a
    closed rod (under the unit law a ring collapses).

    Parameters
    ----------
    scene : a scene of `continuum`.
    out : folder to write to.
    n : numbers of discs, increasing.
    tol : tolerance of the field.
    progress : show progress bars.
    executor : a `concurrent.futures` executor that runs energies and plain springs in parallel; processes need a scene that can be
        pickled.
    degree : 2 to compare discs of order four beside those of order two; own headings only.

    Returns
    -------
    The studies, one for each kind of ends or links.
    """
    kinds = [("springs", 1)] if scene.closed or scene.steered else [("springs", 1), ("consistent", 1)]
    if degree != 1:
        kinds.append(("springs", degree))
    for ends, of_links in kinds:
        checked_sizes(scene, n, ends, of_links)
    from compare import figures, limit_figures  # and matplotlib, for the process that draws

    long = scene if scene.closed else replace(scene, duration=LONG * scene.duration)
    with fresh_files(out) as folder:
        energies = executor.submit(energy_runs, long) if executor else None
        want = offered(scene)
        field = solve(scene, tol, frames=INSTANTS, progress=progress, want=want)
        study = partial(convergence, scene, n, field=field, want=want)
        (ends, of_links), *others = kinds
        beside = [executor.submit(study, ends=ends, degree=of_links, progress=False)] if executor and others else []
        here = [study(ends=ends, degree=of_links, progress=progress) for ends, of_links in kinds[len(beside) :]]
        studies = [_awaited(future, f"discs, {'own' if scene.steered else 'springs'}", progress) for future in beside] + here
        write_studies(folder / "convergence.csv", studies)
        studies[0].plot(folder / "convergence.png", *studies[1:])
        figures.save(limit_figures.limits_of_all(studies)[0], folder / "limits-of-all.png")
        figures.motion(field, scene).savefig(folder / "motion.png", dpi=150)
        ax = figures.energy(
            _awaited(energies, "energy over a long time", progress) if energies else energy_runs(long, progress=progress)
        )
        ax.set_title(f"{scene.name}, {scene.law}, energy over [0, {long.duration:g}]")
        figures.save(ax, folder / "energy.png")
    return studies


def quick(scene: Scene, n: tuple[int, ...]) -> bool:
    """Whether the job takes less time in one process than another one takes to start: few discs, and their kernels are there."""
    with warnings.catch_warnings(action="ignore"):  # the job warns itself
        problem = lump(scene, SIZES[0])
    if max(n) > SIZES[-1] or usual() == "plain" or problem.system.parameters is None:
        return False
    return bool(kernels("ready", problem, Gauss8(), problem.duration, True, True))


def _awaited(future: Future[T], what: str, progress: bool) -> T:
    """Wait for the result of a future, with a clock."""
    form = "{desc} {elapsed}"
    with tqdm(desc=what, bar_format=form, delay=1, disable=not progress, leave=False) as bar:
        while not wait([future], timeout=0.5).done:
            bar.refresh()
    return future.result()


def energy_runs(scene: Scene, n: int = 32, progress: bool = False) -> dict[str, Solution]:
    """A scene by the paper's explicit scheme and by the midpoint method, both with n discs and the paper's ends."""
    problem = lump(scene, n, ends="springs" if scene.steered else "paper")
    k = problem.chain.k
    step = min(k**2 / 8, suggest_dt(problem, "leapfrog"))
    want = ("modified_energy",) if problem.system.quadratic else ()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "leapfrog: energy is conserved, but")  # the figure shows it
        explicit = simulate(problem, "leapfrog", step, frames=1001, want=want, progress=progress)
    midpoint = simulate(problem, "midpoint", k / 2, frames=1001, progress=progress)
    return {
        f"the paper's explicit scheme, N = {n}, h = k²/{k**2 / step:.3g}": explicit,
        f"midpoint, N = {n}, h = k/2": midpoint,
    }


def summary(studies: list[Study]) -> str:
    """The table of all studies, and the field's estimated error."""
    scene, floor = studies[0].scene, max(s.floor for s in studies)
    table = aligned([studies[0].columns, *(row for study in studies for row in study.rows())])
    return (
        f"{scene.name}, {scene.law}, t = {scene.duration:g}: largest error over the discs "
        f"against the field (estimated error {floor:.1e})\n{table}\n\n"
        "Velocity and slope; then energy and ground's force, relative to the field's largest value (inside: an eighth of the\n"
        "length or more away from free ends)\n" + "\n\n".join(study.wants_table() for study in studies)
    )
