"""Discs with own headings: their limits, and their distance from the paper's rod."""

import time
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from tqdm import tqdm

from compare import figures
from compare.lump import lump
from compare.outputs import fresh_files
from compare.results import Study
from compare.study import apart, convergence
from compare.tables import aligned, write_csv
from continuum import solve, steered_rod, untwisting_rod
from discs import Gauss8, Solution, simulate
from discs.arrays import Float
from discs.pictures.style import BLUE, GREY, LAW_COLOUR, ORANGE

SIZES = (17, 33, 65, 129, 257, 513)
FAMILY = (10.0, 40.0, 160.0)
REACHED = 1e-6
LOCKING = (1e1, 1e2, 1e3, 1e4, 1e5)


@dataclass(frozen=True, eq=False)
class Distances:
    """Largest distances in s at the end of the paper's scene, between a steered rod and another model.

    Attributes
    ----------
    against : the other model.
    stretch, shear, inertia : (S,), A, G and J of the steered rods.
    distance : (S, 3), in x, y (length) and theta (rad).
    """

    against: str
    stretch: Float
    shear: Float
    inertia: Float
    distance: Float

    @property
    def rate(self) -> Float:
        """Slope of log distance against log G between rows, (S - 1, 3)."""
        return np.diff(np.log(self.distance), axis=0) / np.diff(np.log(self.shear))[:, None]


def _ends(field: Solution) -> Float:
    every = (field.s.size - 1) // 64
    return np.stack([getattr(field, name)[-1, ::every] for name in ("x", "y", "theta")])


def distances(against: str, family: list[tuple[float, float, float]], other: Solution, tol: float) -> Distances:
    """Solve steered rods (A, G, J) of a family and measure their distance from another field at the end."""
    end = _ends(other)
    found = [np.abs(_ends(solve(steered_rod(a, g, j), tol, frames=1, progress=False)) - end).max(axis=1) for a, g, j in family]
    a, g, j = np.array(family).T
    return Distances(against, a, g, j, np.array(found))


def towards_unit_law(shear: tuple[float, ...] = FAMILY, tol: float = 1e-4) -> Distances:
    """G -> infinity with J = 1/G and A = 0: the heading must follow the line, and has no inertia.

    The limit is the unit law with true curvature; the distance falls like 1/G.
    """
    limit = solve(untwisting_rod("unit", curvature="true"), tol, frames=1, progress=False)
    return distances("unit law, true curvature", [(0.0, g, 1 / g) for g in shear], limit, tol)


def from_the_paper(tol: float = 1e-3) -> list[Distances]:
    """Distances of steered rods from the paper's two laws at the end: the models differ and do not tend to these laws."""
    family = [(0.0, 160.0, 1 / 160), (1.0, 10.0, 0.05), (10.0, 10.0, 0.25), (100.0, 100.0, 0.05)]
    laws = [("the paper's rod, field law", "field"), ("the paper's rod, unit law", "unit")]
    return [distances(name, family, solve(untwisting_rod(law), tol, frames=1, progress=False), tol) for name, law in laws]


def locking(stiffness: tuple[float, ...] = LOCKING, n: int = 33) -> Float:
    """A = G -> infinity at J = 0.05: largest distance that any disc moves in [0, 4.5], for each stiffness, (S,).

    A rod that neither stretches nor shears and rolls without sliding moves like a rigid body (the paper's section 3.5); from this
    initial state it has no such motion. The distance falls slowly, like A**(-1/5).
    """
    reach = []
    for a in stiffness:
        run = simulate(lump(steered_rod(a, a, 0.05), n), "midpoint", 0.01, frames=91, progress=False)
        reach.append(np.hypot(run.x - run.s, run.y).max())
    return np.array(reach)


class Effort(NamedTuple):
    """Discs that reach an error: order, number, error of any field (length, rad), processor time of the run, s, and its engine."""

    order: int
    n: int
    error: float
    seconds: float
    engine: str


def effort(study: Study, field: Solution, degree: int, error: float = REACHED, steps: int = 30, rounds: int = 5) -> Effort:
    """About the fewest discs, near those of a study's law, that reach an error well above the field's own; the fastest of some
    rounds of gauss8 steps. Plain runs, which are slow, are not repeated."""
    scene, method, error = study.scene, Gauss8(tolerance=1e-13), max(error, 4 * study.floor)
    n, found = study.reaching(error) - 2, np.inf
    n += degree == 2 and n % 2 == 0
    while found > error:
        n += 2 + 2 * (n // 200)
        problem = lump(scene, n, degree=degree)
        run = simulate(problem, method, scene.duration / steps, frames=1, progress=False)
        found = float(apart(scene, run, field).max())
    seconds, engine = np.inf, str(run.stats["engine"])
    for _ in range(rounds if engine == "compiled" else 1):
        began = time.process_time()
        simulate(problem, method, scene.duration / steps, frames=1, progress=False)
        seconds = min(seconds, time.process_time() - began)
    return Effort(2 * degree, n, found, seconds, engine)


def limits(
    out: str | Path, progress: bool = True, n: tuple[int, ...] = SIZES, tol: float = 1e-9, executor: Executor | None = None
) -> str:
    """All limits of the steered rod: headings.csv, limits.csv, locking.csv and limits.png in `out`, and the tables as text.

    Discs of order two and four are compared with one field; `n` are odd. An executor, if given, runs the studies in parallel.
    """
    scene = steered_rod()
    with fresh_files(out) as folder, tqdm(total=4, desc="own headings", unit="limit", delay=1, disable=not progress) as bar:
        field = solve(scene, tol, frames=2, progress=False)
        beside = [executor.submit(convergence, scene, n, field=field, progress=False, degree=d) for d in (1, 2)] if executor else []
        unit = towards_unit_law()
        bar.update()
        reach = locking()
        bar.update()
        paper = from_the_paper()
        bar.update()
        studies = [future.result() for future in beside]
        studies = studies or [convergence(scene, n, field=field, progress=False, degree=d) for d in (1, 2)]
        bar.update()
        rows: list[tuple[str, ...]] = [("against", "A", "G", "J", "distance x", "distance y", "distance theta")]
        for d in (unit, *paper):
            for a, g, j, apart in zip(d.stretch, d.shear, d.inertia, d.distance, strict=True):
                rows.append((d.against, f"{a:g}", f"{g:g}", f"{j:g}", *(f"{v:.3e}" for v in apart)))
        efforts: list[tuple[str, ...]] = [("order", "N", "error", "ms", "engine")]
        for degree, study in enumerate(studies, 1):
            e = effort(study, field, degree)
            efforts.append((str(e.order), str(e.n), f"{e.error:.1e}", f"{1e3 * e.seconds:.3g}", e.engine))
        locks: list[tuple[str, ...]] = [("A = G", "largest motion")]
        locks += [(f"{a:g}", f"{r:.4f}") for a, r in zip(LOCKING, reach, strict=True)]
        table = [studies[0].columns, *(row for study in studies for row in study.rows())]
        for name, lines in (("headings.csv", table), ("limits.csv", rows), ("locking.csv", locks)):
            write_csv(folder / name, lines)
        _draw(studies, unit, paper, reach).savefig(folder / "limits.png", dpi=150)
    text = [
        f"discs with headings of their own, A = G = 10, J = 0.25, t = 4.5 (field's estimated error {studies[0].floor:.1e})",
        aligned(table),
        f"\nto reach an error of {REACHED:g} in all fields, gauss8, 30 steps",
        aligned(efforts),
        "\nrods with headings of their own, A, G, J, against rods whose headings are slaved to the line, t = 4.5",
        aligned(rows),
        "\nA = G to infinity, J = 0.05: the rod locks",
        aligned(locks),
    ]
    return "\n".join(text)


def _draw(studies: list[Study], unit: Distances, paper: list[Distances], reach: Float) -> Figure:
    figure = Figure(figsize=(10, 7.8), layout="constrained")
    axes = figure.subplots(2, 2)
    figures.convergence(studies, axes[0, 0]).legend(fontsize=7, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.16))
    axes[0, 0].set_title("(a) N discs against the field, A = G = 10, J = 0.25")
    for j, (symbol, line) in enumerate(zip(("x", "y", "θ"), ("o-", "s--", "^:"), strict=True)):
        axes[0, 1].loglog(unit.shear, unit.distance[:, j], line, color=BLUE, label=symbol)
    _slope(axes[0, 1], unit.shear, 0.5 * unit.distance.min(axis=1)[0], -1.0, "slope −1")
    axes[0, 1].set(
        xlabel="G, with A = 0 and J = 1/G",
        ylabel="distance at t = 4.5 (length, rad)",
        title="(b) to the unit law with true curvature",
    )
    axes[1, 0].loglog(LOCKING, reach, marker="o", color=ORANGE, label="largest motion of any disc")
    _slope(axes[1, 0], np.array(LOCKING), 0.6 * reach[0], -0.2, "slope −1/5")
    axes[1, 0].set(xlabel="A = G, with J = 0.05", ylabel="distance (length)", title="(c) the rod locks")
    axes[1, 0].yaxis.set_minor_locator(NullLocator())
    axes[1, 0].set_yticks([0.2, 0.5, 1, 2], ["0.2", "0.5", "1", "2"])
    kinds = [
        f"A = {a:g}, G = {g:g},\nJ = {j:.2g}" for a, g, j in zip(paper[0].stretch, paper[0].shear, paper[0].inertia, strict=True)
    ]
    for d, colour, shift in zip(paper, (LAW_COLOUR["field"], LAW_COLOUR["unit"]), (-0.18, 0.18), strict=True):
        axes[1, 1].barh(
            np.arange(len(kinds)) + shift, np.hypot(d.distance[:, 0], d.distance[:, 1]), 0.34, color=colour, label=d.against
        )
    axes[1, 1].set_yticks(np.arange(len(kinds)), kinds)
    axes[1, 1].set(xlabel="distance of centre lines at t = 4.5 (length)", title="(d) from the paper's rod")
    for ax in axes.flat[1:]:
        ax.grid(alpha=0.3, which="both" if ax is not axes[1, 1] else "major")
        ax.legend(fontsize=8)
    return figure


def _slope(ax: Axes, x: Float, level: float, slope: float, text: str) -> None:
    ax.loglog(x, level * (x / x[0]) ** slope, color=GREY, linewidth=1, label=text)
