"""The main job: one scene, N -> infinity, the motion and the energy."""

import signal
import threading
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

from tqdm import tqdm

from compare import figures
from compare.lump import lump
from compare.outputs import fresh_files
from compare.study import COLUMNS, Study, checked_sizes, convergence, format_table, write_csv
from continuum import Scene, solve
from discs import Solution, simulate

SIZES = (17, 33, 65, 129, 257, 513)
LONG = 150.0
INSTANTS = 5


def overview(scene: Scene, out: str | Path, n: tuple[int, ...] = SIZES, tol: float = 1e-5, progress: bool = True) -> list[Study]:
    """Compare a scene's discs with its field; write the table and the pictures to `out`.

    Writes convergence.csv, convergence.png, motion.png and energy.png, all of them or none. The energy is shown over
    [0, 150], for a closed rod over the scene's duration (a ring under the unit law does not live longer).

    Returns
    -------
    The studies, one for each kind of ends.
    """
    kinds = ("springs",) if scene.closed else ("springs", "consistent")
    for ends in kinds:
        checked_sizes(scene, n, ends)
    long = scene if scene.closed else replace(scene, duration=LONG)
    # the long runs have a process of their own, which ends with this block whatever happens in it
    with fresh_files(out) as folder, get_context("spawn").Pool(1, initializer=_in_the_background) as other:
        energies = other.apply_async(energy_runs, (long,))
        field = solve(scene, tol, frames=INSTANTS, progress=progress)
        studies = [convergence(scene, n, ends, field=field, progress=progress) for ends in kinds]
        write_csv(folder / "convergence.csv", studies)
        studies[0].plot(folder / "convergence.png", *studies[1:])
        figures.motion(field, scene).savefig(folder / "motion.png", dpi=150)
        ax = figures.energy(energies.get())
        ax.set_title(f"{scene.name}, {scene.rolling} law, energy over [0, {long.duration:g}]")
        figures.save(ax, folder / "energy.png")
    return studies


def _in_the_background() -> None:
    """Leave interrupts to the main process, and lock progress bars within this one (a shared lock would leak)."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tqdm.set_lock(threading.RLock())


def energy_runs(scene: Scene, n: int = 32) -> dict[str, Solution]:
    """A scene by the paper's explicit scheme and by the midpoint method, both with n discs and the paper's ends."""
    explicit = solve(scene, method="leapfrog", n=n, frames=1001, progress=False)
    problem = lump(scene, n, ends="paper")
    midpoint = simulate(problem, "midpoint", dt=problem.chain.k / 2, frames=1001, progress=False)
    return {
        f"the paper's explicit scheme, N = {n}, h = k²/8": explicit,
        f"midpoint, N = {n}, h = k/2": midpoint,
    }


def summary(studies: list[Study]) -> str:
    """The table of all studies, and what it is measured against."""
    scene, floor = studies[0].scene, max(s.floor for s in studies)
    table = format_table([COLUMNS, *(row for study in studies for row in study.rows())])
    return (
        f"{scene.name}, {scene.rolling} law, t = {scene.duration:g}: largest error over the discs "
        f"against the field (estimated error {floor:.1e})\n{table}"
    )
