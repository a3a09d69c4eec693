"""N discs against the field, N -> infinity."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike
from tqdm import tqdm

from compare import figures
from compare.lump import lump
from continuum import Scene, solve
from continuum.solver import spline
from discs import Integrator, Midpoint, Problem, Solution, Suzuki4, checks, simulate
from discs.arrays import Float, Int

TIGHT = Suzuki4(Midpoint(tolerance=1e-10))


@dataclass(frozen=True, eq=False)
class Study:
    """Errors of chains of discs against the field at the end of a scene.

    Attributes
    ----------
    scene : the scene.
    ends : kind of ends of the chains.
    n : (S,), numbers of discs.
    k : (S,), spacings, length.
    error : (S, fields), largest error over the discs of x, y (length), theta and, of own headings, phi (rad).
    floor : estimated error of the field itself, the largest over the fields.
    dt : time step of the chains.
    """

    scene: Scene
    ends: str
    n: Int
    k: Float
    error: Float
    floor: float
    dt: float

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields compared."""
        return compared(self.scene)

    @property
    def columns(self) -> tuple[str, ...]:
        """Heading of the table."""
        return ("ends", "N", "k", *(f"error {f}" for f in self.fields), *(f"order {f}" for f in self.fields))

    @property
    def order(self) -> Float:
        """Measured order between neighbouring rows, (S - 1, fields): log of the ratio of errors over log of that of spacings."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.diff(np.log(self.error), axis=0) / np.diff(np.log(self.k))[:, None]

    def rows(self) -> list[tuple[str, ...]]:
        """The table as text, a row for each n."""
        orders = [("",) * len(self.fields)] + [tuple(f"{o:.2f}" if np.isfinite(o) else "-" for o in row) for row in self.order]
        return [
            (self.ends, str(n), f"{k:.6f}", *(f"{e:.3e}" for e in error), *order)
            for n, k, error, order in zip(self.n, self.k, self.error, orders, strict=True)
        ]

    def table(self) -> str:
        """The table, aligned for a terminal."""
        return format_table([self.columns, *self.rows()])

    def plot(self, path: str | Path | None = None, *others: "Study", ax: Axes | None = None) -> Axes:
        """Error against n, with `others` in the same axes; saved if a path is given."""
        ax = figures.convergence([self, *others], ax)
        if path is not None:
            figures.save(ax, path)
        return ax


def convergence(
    scene: Scene,
    n: tuple[int, ...] = (17, 33, 65, 129),
    ends: str = "springs",
    field: Solution | None = None,
    dt: float | None = None,
    method: str | Integrator = TIGHT,
    tol: float = 1e-5,
    progress: bool = True,
) -> Study:
    """Simulate a scene with n = n_1, n_2, ... discs and compare with the field at the end.

    Parameters
    ----------
    n : numbers of discs, increasing, at least one.
    ends : see `lump`.
    field : the scene's `solve(scene, tol)`, computed if not given; its last frame, at the end of the scene, counts.
    dt : time step of the chains; None takes 300 steps, and at least eight for each of the field's.
    method : integrator of the chains.
    """
    sizes, problems = checked_sizes(scene, n, ends)
    if field is None:
        field = solve(scene, tol, frames=2, progress=progress)
    if field.error_estimate is None or not np.isclose(field.t[-1], scene.duration, rtol=1e-12):
        raise ValueError(
            f"field must be solve(scene, tol) of this scene up to t = {scene.duration:g}, with an error estimate; got {field!r}"
        )
    h = scene.duration / max(300, 8 * field.stats.get("steps", 0)) if dt is None else checks.number("dt", dt, positive=True)
    fields = compared(scene)
    limit = {name: spline(scene, field.s, _periodic(scene, name, field)[-1:]) for name in fields}
    error = np.empty((len(problems), len(fields)))
    bar = tqdm(problems, desc=f"discs, {problems[0].chain.ends} ends", unit="chain", delay=1, disable=not progress)
    for i, problem in enumerate(bar):
        run = simulate(problem, method, h, frames=1, progress=progress and i == 0)  # the first says that kernels are compiled
        for j, name in enumerate(fields):
            error[i, j] = np.abs(_periodic(scene, name, run)[-1] - limit[name](run.s)[:, 0]).max()
    floor = max(field.error_estimate[name] for name in fields)
    k = np.array([problem.chain.k for problem in problems])
    return Study(scene, problems[0].chain.ends, sizes, k, error, floor, h)


def compared(scene: Scene) -> tuple[str, ...]:
    """Names of the fields of a scene that a study compares."""
    return ("x", "y", "theta", "phi") if scene.steered else ("x", "y", "theta")


def checked_sizes(scene: Scene, n: ArrayLike, ends: str) -> tuple[Int, list[Problem]]:
    """The sizes of a study and their problems; ValueError if they are not increasing or too small."""
    sizes = np.atleast_1d(np.asarray(n))
    if sizes.ndim != 1 or not sizes.size or sizes.dtype.kind not in "iu" or (np.diff(sizes) <= 0).any():
        raise ValueError(f"n must be increasing whole numbers of discs; got {n!r}")
    return sizes, [lump(scene, int(size), ends) for size in sizes]


def _periodic(scene: Scene, name: str, run: Solution) -> Float:
    """A field (F, N) less the part that grows around a rod periodic up to a shift."""
    shift = {"x": scene.shift[0], "y": scene.shift[1], "phi": 2 * np.pi * scene.turns}.get(name, 0.0)
    values: Float = getattr(run, name)
    return values - shift * run.s / scene.rod.length


def format_table(rows: list[tuple[str, ...]]) -> str:
    """Rows of text as aligned columns, the first row the heading."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)) for row in rows]
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]])


def write_csv(path: Path, studies: list[Study]) -> None:
    """The table of several studies as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([studies[0].columns, *(row for study in studies for row in study.rows())])
