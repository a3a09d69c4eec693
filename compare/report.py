"""Everything on one page: scene, motion, N -> infinity, the ground's force, two laws, energy, speed, stability, versions."""

import importlib.metadata
import os
import platform
from collections.abc import Sequence
from concurrent.futures import Executor, Future
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from tqdm import tqdm

from compare import figures
from compare.background import background
from compare.hardcases.table import stability
from compare.limit_figures import limits_of_all
from compare.lump import lump
from compare.main_job import INSTANTS, LONG, energy_runs
from compare.outputs import fresh_files
from compare.page import Page
from compare.peers import reduced
from compare.peers.peer import Peer
from compare.precision import work_precision
from compare.results import Study
from compare.study import convergence
from compare.tables import markdown
from continuum import Scene, solve, untwisting_rod
from discs import Problem, Solution, checks
from discs.analysis import Growth, growth
from discs.chains.rolling import ROLLING
from discs.pictures import geometry

SIZES = (17, 33, 65, 129, 257)
TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6)  # of which the horizon is said
LATER = 10  # durations of the scene in which it is looked for
FRAMES = 97  # of the fields, among them the instants of their pictures
LAWS = {name: law.formula for name, law in ROLLING.items()}
PACKAGES = ("numpy", "scipy", "matplotlib", "numba", "scikit-sundae", "rolling-discs")


def report(
    out: str | Path,
    n: Sequence[int] = SIZES,
    tol: float = 1e-4,
    timed: int = 32,
    long: float = LONG,
    progress: bool = True,
    scene: Scene | None = None,
) -> None:
    """Write report.html, which contains its pictures, report.md, and every picture and its data.

    Parameters
    ----------
    out : folder.
    n : numbers of discs for N -> infinity.
    tol : largest error of the fields.
    timed : number of discs where speed is measured.
    long : durations of the scene over which the energy is shown.
    progress : show progress bars.
    scene : None for the paper's; each law of rolling is taken in turn.

    Raises
    ------
    ValueError : for a scene that is not a rod with two free ends, linear curvature, and no loads.
    """
    checks.number("tol", tol, positive=True)
    scenes = under_each_law(untwisting_rod() if scene is None else scene)
    with (
        fresh_files(out) as folder,
        background() as beside,
        tqdm(total=6, desc="report", bar_format="{desc} {n}/{total} {elapsed} {postfix}", disable=not progress) as bar,
    ):

        def stage(name: str) -> None:
            bar.set_postfix_str(name)
            bar.update()

        page, sizes = Page(folder), tuple(n)
        first = replace(scenes["field"], duration=long * scenes["field"].duration)
        energies = beside.submit(energy_runs, first)
        stage("the scene and its motion")
        fields = {law: solve(scene, tol, frames=FRAMES, progress=False) for law, scene in scenes.items()}
        later = {law: _studied(scene, sizes, fields[law], beside) for law, scene in scenes.items()}
        ground = beside.submit(_of_the_ground, scenes["field"], sizes, min(tol, 1e-6))
        errors = beside.submit(_of_errors, scenes["field"], timed)
        _scene(page, scenes["field"])
        _motion(page, scenes, fields)
        stage("N to infinity")
        _limit(page, {law: [future.result() for future in futures] for law, futures in later.items()})
        _ground(page, ground.result())
        _laws(page, fields)
        stage("energy")
        _energy(page, energies.result(), first)
        stage("speed against error")
        _speed(page, scenes["field"], timed)
        _horizon(page, errors.result(), scenes["field"].duration, timed)
        stage("stability")
        _stability(page, beside, progress)
        stage("page")
        _machine(page)
        title = "N rolling discs and the rod they become"
        (folder / "report.md").write_text(page.markdown(), encoding="utf-8")
        (folder / "report.html").write_text(page.html(title), encoding="utf-8")


def under_each_law(scene: Scene) -> dict[str, Scene]:
    """A scene under each law of rolling. ValueError for one that the report does not cover."""
    if scene.closed or scene.steered or scene.loads or scene.rod.curvature != "linear":
        raise ValueError(
            "the report compares the laws of rolling of a rod with two free ends, linear curvature and no loads, which the "
            f"{scene.name} is not: take python -m compare --scene FILE.toml, the main job, for this scene"
        )
    return {law: replace(scene, rolling=law) for law in LAWS}


def _studied(scene: Scene, n: tuple[int, ...], field: Solution, executor: Executor) -> list[Future[Study]]:
    return [executor.submit(convergence, scene, n, ends, field, progress=False) for ends in ("springs", "consistent")]


def _scene(page: Page, scene: Scene) -> None:
    rod = scene.rod
    names = ("length", "density", "spin_inertia", "torsion_stiffness", "bending_stiffness", "radius")
    values = [(name.replace("_", " "), "varies along the rod" if name in rod.varying else getattr(rod, name)) for name in names]
    twisted = ", straight and at rest, twisted by θ ∝ cos(πs/ℓ) and released" if scene.name == "untwisting rod" else ""
    page.add(
        "# N rolling discs and the rod they become",
        "N vertical discs roll on a plane without sliding, joined by springs that resist bending and torsion. As N grows they "
        f"become the nonholonomic Cosserat rod of J. Vankerschaver. The scene of this page is the {scene.name}{twisted}.",
        "## The scene",
        markdown(("quantity", "value"), values),
        f"Time runs to {scene.duration:g}. The laws of rolling: {'; '.join(f'{law}, {words}' for law, words in LAWS.items())}.",
    )


def _motion(page: Page, scenes: dict[str, Scene], fields: dict[str, Solution]) -> None:
    page.add("## The motion")
    for law, run in fields.items():
        error = max(run.error_estimate[f] for f in ("x", "y", "theta")) if run.error_estimate else np.nan
        rows = [
            (t, s, run.x[f, i], run.y[f, i], run.theta[f, i])
            for f, t in ((f, run.t[f]) for f in geometry.instants(run, INSTANTS))
            for i, s in enumerate(run.s)
            if i % max(1, run.s.size // 128) == 0
        ]
        caption = f"The field under the {law} law, off by {error:.1e} at most by its own estimate."
        page.figure(
            f"motion_{law}", figures.motion(run, scenes[law], instants=INSTANTS), caption, ("t", "s", "x", "y", "theta"), rows
        )


def _limit(page: Page, studies: dict[str, list[Study]]) -> None:
    page.add(
        "## N → ∞",
        "The largest error of N discs at the end of the motion. With many discs it falls like 1/N if the last discs have plain "
        "springs, and like 1/N² with consistent ends, which treat the two free ends as the rod's equations do.",
    )
    for law, pair in studies.items():
        rows = [row for study in pair for row in study.rows()]
        page.figure(f"convergence_{law}", figures.convergence(pair), f"Errors of N discs, {law} law.", pair[0].columns, rows)
        page.add(markdown(pair[0].columns, rows))


def _of_the_ground(scene: Scene, n: tuple[int, ...], tol: float) -> Study:
    return convergence(scene, n, "consistent", tol=tol, want=("contact_force",), progress=False)


def _ground(page: Page, study: Study) -> None:
    columns, *rows = study.wants_rows()
    page.add(
        "## The force of the ground",
        "The ground keeps each disc rolling by a force. For N → ∞ this becomes a force per length inside the rod, and a force and "
        "a couple at each free end, as forces on the last discs grow like N. Errors with consistent ends, field law, relative to "
        "the largest value; ± is the spread of the last three orders.",
    )
    page.figure("ground", limits_of_all([study])[0], "Errors of the ground's force on N discs.", columns, rows)
    page.add(markdown(columns, rows))


def _laws(page: Page, fields: dict[str, Solution]) -> None:
    a, b = fields.values()
    count = min(a.s.size, b.s.size) - 1
    every = [(run.s.size - 1) // count for run in (a, b)]
    distance = np.array(
        [np.abs(getattr(a, f)[:, :: every[0]] - getattr(b, f)[:, :: every[1]]).max(axis=1) for f in ("x", "y", "theta")]
    )
    page.add(
        "## The paper's law against true rolling",
        "They agree while |r'| = 1, that is, while the line is not stretched; in the motion |r'| drifts.",
    )
    rows = [(f"{t:g}", *(f"{d:.3g}" for d in at)) for t, at in zip(a.t, distance.T, strict=True)]
    caption = (
        "Left: the largest distance between the two fields. Right: their lines from above; data of these are with the motions."
    )
    page.figure("laws", figures.laws(fields, distance, INSTANTS)[0], caption, ("t", "x", "y", "theta"), rows)


def _energy(page: Page, runs: dict[str, Solution], scene: Scene) -> None:
    rows = [(label, t, e) for label, run in runs.items() for t, e in zip(run.t, run.energy, strict=True)]
    words = [f"{label}: {np.abs(run.energy / run.energy[0] - 1).max():.1e}" for label, run in runs.items()]
    page.add(f"## Energy over [0, {scene.duration:g}]", f"Largest relative error: {'; '.join(words)}.")
    page.figure("energy", figures.energy(runs), "The energy of two methods against time.", ("method", "t", "energy"), rows)


def speed_peers(problem: Problem) -> list[Peer]:
    """The peers that take the compiled right-hand side."""
    f = reduced.Bound(problem)
    return reduced.scipy_peers(problem, f) + (reduced.sundials_peers(problem, f) if find_spec("sksundae") else [])


def _speed(page: Page, scene: Scene, n: int) -> None:
    found = work_precision({"paper's scene": scene}, (n,), speed_peers, repeats=3, seconds=1.0, progress=False)
    rows = [(r.method, r.setting, r.error, r.seconds, r.remark) for r in found.rows]
    page.add("## Speed against error", "`python -m compare precision` measures more sizes, laws and peers.", found.speedups())
    caption = f"Our methods with thick lines, SciPy's and SUNDIALS' with dashed ones, N = {n}."
    page.figure("precision", found.plot()[0], caption, ("method", "setting", "error", "seconds", "remark"), rows)


def _of_errors(scene: Scene, n: int) -> Growth:
    return growth(lump(replace(scene, duration=LATER * scene.duration), n), method="midpoint", most=1 / min(TOLERANCES))


def _horizon(page: Page, found: Growth, duration: float, n: int) -> None:
    end, last = float(np.interp(duration, found.t, found.growth)), found.t[-1]
    times = [(f"{tol:.0e}", found.horizon(tol)) for tol in TOLERANCES]
    page.add(
        "### How long a tolerance lasts",
        f"Errors of the start, in positions over the length of the chain and in angles, are {end:.3g} times as large at "
        f"t = {duration:g}, N = {n}. From its horizon on a run to a tolerance means nothing: an error of that size at the start "
        "has grown to 1.",
        markdown(("tolerance", "horizon"), [(tol, f"t = {t:.3g}" if t < np.inf else f"after t = {last:.3g}") for tol, t in times]),
    )


def _stability(page: Page, executor: Executor, progress: bool) -> None:
    found = stability(quick=True, executor=executor, progress=progress)
    found.save(page.folder / "report_stability_runs.csv")
    drawn = found.plot()
    page.add("## Hard cases", "Small ones; `python -m compare stability` runs all.", found.summary(), found.words, found.grid())
    page.add("All runs: [report_stability_runs.csv](report_stability_runs.csv).")
    rows = [(law, *row) for law, w in found.waves.items() for row in zip(w.q, w.relation, w.measured, strict=True)]
    caption = (
        "Left: errors of the energy at steps far above the explicit limit; data are with all runs above. Right: growth of waves."
    )
    page.figure("stability", drawn[0], caption, ("law", "q", "growth by the relation", "growth measured"), rows)


def _machine(page: Page) -> None:
    versions = [(name, importlib.metadata.version(name)) for name in PACKAGES if _installed(name)]
    system = [
        ("Python", platform.python_version()),
        ("machine", f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"),
    ]
    page.add("## Made with", markdown(("what", "version"), [*system, *versions]))


def _installed(name: str) -> bool:
    try:
        importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True
