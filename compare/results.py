"""What comparisons return: tables, as text and CSV. Their pictures stand above this module, and are imported when wanted."""

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from continuum import Scene
from discs.arrays import Float, Int

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ERRORS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)


@dataclass(frozen=True, eq=False)
class Study:
    """Errors of chains of discs against the field at the end of a scene.

    Attributes
    ----------
    scene : the scene.
    ends : kind of ends of the chains; "elements" for degree 2.
    n : (S,), numbers of discs.
    k : (S,), spacings, length.
    error : (S, fields), largest error over the discs of x, y (length), theta and, for own headings, phi (rad); then those of wanted
        quantities, see `compare.quantities`.
    floor : estimated error of the field itself, the largest over positions and angles.
    dt : time step of the chains.
    names : wanted quantities. floors : estimated errors of the field for them; NaN where it has none.
    """

    scene: Scene
    ends: str
    n: Int
    k: Float
    error: Float
    floor: float
    dt: float
    names: tuple[str, ...] = ()
    floors: tuple[float, ...] = ()

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the quantities compared."""
        return (*compared(self.scene), *self.names)

    @property
    def columns(self) -> tuple[str, ...]:
        """Heading of the table of positions and angles."""
        return _columns(compared(self.scene))

    @property
    def order(self) -> Float:
        """Measured order between neighbouring rows, (S - 1, fields): log of the ratio of errors over log of that of spacings."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.diff(np.log(self.error), axis=0) / np.diff(np.log(self.k))[:, None]

    @property
    def order_spread(self) -> Float:
        """By how much the last order differs from the two before it, (fields,); NaN of fewer than three sizes.

        The error bar of a measured order. It is no bound: orders can all be off by more, see docs/accuracy.md.
        """
        order = self.order
        return np.abs(order[-3:] - order[-1]).max(axis=0) if len(order) > 1 else np.full(len(self.fields), np.nan)

    def reaching(self, error: float) -> int:
        """The number of discs at which positions and angles have this error, by the power law through the last two rows."""
        worst = self.error[-2:, : len(compared(self.scene))].max(axis=1)
        order = np.log(worst[0] / worst[1]) / np.log(self.k[-2] / self.k[-1])
        return int(np.ceil(self.scene.rod.length / (self.k[-1] * (error / worst[1]) ** (1 / order)))) + (self.ends != "ring")

    def rows(self, every: bool = False) -> list[tuple[str, ...]]:
        """The table of positions and angles as text, a row for each n; with `every` that of wanted quantities, too."""
        count = len(self.fields) if every else len(compared(self.scene))
        orders = [("",) * count] + [tuple(f"{o:.2f}" if np.isfinite(o) else "-" for o in row) for row in self.order[:, :count]]
        return [
            (self.ends, str(n), f"{k:.6f}", *(f"{e:.3e}" for e in error[:count]), *order)
            for n, k, error, order in zip(self.n, self.k, self.error, orders, strict=True)
        ]

    def table(self) -> str:
        """The table, aligned for a terminal, and that of wanted quantities."""
        text = format_table([self.columns, *self.rows()])
        return f"{text}\n\n{self.wants_table()}" if self.names else text

    def wants_table(self) -> str:
        """The table of wanted quantities, aligned for a terminal."""
        return format_table(self.wants_rows())

    def wants_rows(self) -> list[tuple[str, ...]]:
        """Its heading, and a row for each quantity: errors, last order ± spread, estimated error of the field."""
        start = len(compared(self.scene))
        last = self.order[-1] if len(self.n) > 1 else np.full(len(self.fields), np.nan)
        orders = [
            f"{o:.2f} ± {d:.2f}".removesuffix(" ± nan") if np.isfinite(o) else "-"
            for o, d in zip(last, self.order_spread, strict=True)
        ]
        return [
            (self.ends, *(f"N = {n}" for n in self.n), "order", "field's error"),
            *(
                (name, *(f"{e:.2e}" for e in errors), order, f"{floor:.0e}".replace("nan", "-"))
                for name, errors, order, floor in zip(self.names, self.error.T[start:], orders[start:], self.floors, strict=True)
            ),
        ]

    def plot(self, path: str | Path | None = None, *others: "Study", ax: "Axes | None" = None) -> "Axes":
        """Error against n, with `others` in the same axes; saved if a path is given."""
        from compare import figures

        ax = figures.convergence([self, *others], ax)
        if path is not None:
            figures.save(ax, path)
        return ax


@dataclass(frozen=True, eq=False)
class Slips:
    """Distances of sliding discs.

    Attributes
    ----------
    scene : the scene. n : (S,), numbers of discs. epsilon : (E,), slips.
    rolling : (S, E), distances from rolling discs of the same N. field : (S, E), from the rolling field.
    end, inside : (S, E), largest slip of end discs and of inner ones, length per time; of a ring the same.
    """

    scene: Scene
    n: tuple[int, ...]
    epsilon: tuple[float, ...]
    rolling: Float
    field: Float
    end: Float
    inside: Float

    def rows(self) -> list[tuple[str, ...]]:
        """A row for each N and epsilon: distances, slips, and the orders in epsilon since the row before."""
        found = []
        for i, n in enumerate(self.n):
            for j, epsilon in enumerate(self.epsilon):
                values = [part[i, j] for part in (self.rolling, self.field, self.end, self.inside)]
                orders = ["", "", ""]
                if j:
                    step = np.log(self.epsilon[j - 1] / epsilon)
                    parts = self.rolling, self.end, self.inside
                    orders = [f"{np.log(part[i, j - 1] / part[i, j]) / step:.2f}" for part in parts]
                found.append((self.scene.name, str(n), f"{epsilon:.0e}", *(f"{value:.2e}" for value in values), *orders))
        return found


def _columns(fields: tuple[str, ...]) -> tuple[str, ...]:
    return ("ends", "N", "k", *(f"error {f}" for f in fields), *(f"order {f}" for f in fields))


def compared(scene: Scene) -> tuple[str, ...]:
    """Names of the fields of a scene that a study compares."""
    return ("x", "y", "theta", "phi") if scene.steered else ("x", "y", "theta")


def write_csv(path: Path, studies: list[Study]) -> None:
    """The table of several studies as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([_columns(studies[0].fields), *(row for study in studies for row in study.rows(every=True))])


def format_table(rows: list[tuple[str, ...]]) -> str:
    """Rows of text as aligned columns, the first row the heading."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)) for row in rows]
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]])


class Row(NamedTuple):
    """One method with one setting on one problem.

    error : largest error of positions and angles at the end, each relative to its largest value; NaN if there is none.
    seconds : processor time, median of the rounds, or mean of a long run's two times. steps, gradients, solves : counts, None if a
    peer has none. remark : why there is no result, or what is wrong with it.
    """

    problem: str
    n: int
    method: str
    ours: bool
    setting: float = np.nan
    error: float = np.nan
    seconds: float = np.nan
    steps: int | None = None
    gradients: int | None = None
    solves: int | None = None
    remark: str = ""


@dataclass(frozen=True, eq=False)
class WorkPrecision:
    """Speed against error.

    Attributes
    ----------
    rows : one for each method, setting and problem, failures included.
    references : (problem, n) -> estimated error of the reference.
    differences : method -> how its problem differs from that of the others.
    """

    rows: list[Row]
    references: dict[tuple[str, int], float]
    differences: dict[str, str]

    @property
    def problems(self) -> list[tuple[str, int]]:
        """The problems, by name and number of discs."""
        return list(dict.fromkeys((row.problem, row.n) for row in self.rows))

    def curve(self, problem: str, n: int, method: str) -> tuple[Float, Float]:
        """Errors and seconds of a method, from loose to tight, without runs that are slower and less accurate than another one."""
        found = [(r.error, r.seconds) for r in self.rows if (r.problem, r.n, r.method) == (problem, n, method) and r.error < 1]
        best = [(e, s) for e, s in found if not any(f <= e and t <= s and (f, t) != (e, s) for f, t in found)]
        errors, seconds = np.array(sorted(best, reverse=True)).reshape(-1, 2).T
        return errors, seconds

    def time_at(self, error: float, problem: str, n: int, ours: bool) -> tuple[float, str]:
        """The least time in which any method reaches an error (log-log interpolation between its runs), and its name;
        infinite if none reaches it."""
        best = np.inf, ""
        for method in dict.fromkeys(r.method for r in self.rows if r.ours == ours):
            errors, seconds = self.curve(problem, n, method)
            if errors.size and errors[-1] <= error:
                at = float(np.exp(np.interp(-np.log(error), -np.log(errors), np.log(seconds))))
                best = min(best, (at, method))
        return best

    def speedups(self, errors: Iterable[float] = ERRORS) -> str:
        """Ratio of times, fastest peer over ours, at equal error, as a table."""
        lines = ["| problem | N | error | ours | | fastest peer | | times |", "| --- " * 8 + "|"]
        for problem, n in self.problems:
            for error in errors:
                (ours, mine), (peers, other) = self.time_at(error, problem, n, True), self.time_at(error, problem, n, False)
                if not np.isfinite(ours):
                    continue
                ratio = f"{peers / ours:.0f}" if np.isfinite(peers) else "no peer"
                there = f"{1e3 * peers:.3g} ms" if np.isfinite(peers) else "–"
                lines.append(
                    f"| {problem} | {n} | {error:.0e} | {mine} | {1e3 * ours:.3g} ms | {other or '–'} | {there} | {ratio} |"
                )
        return "\n".join(lines)

    def table(self) -> str:
        """All runs, as a table."""
        lines = ["| problem | N | method | setting | error | ms | steps | gradients | solves | remark |", "| --- " * 10 + "|"]
        for r in self.rows:
            counts = " | ".join("–" if c is None else str(c) for c in (r.steps, r.gradients, r.solves))
            error = f"{r.error:.1e}" if np.isfinite(r.error) else "–"
            lines.append(
                f"| {r.problem} | {r.n} | {r.method} | {r.setting:.3g} | {error} | {1e3 * r.seconds:.3g} | {counts} | {r.remark} |"
            )
        return "\n".join(lines)

    def report(self) -> str:
        """Speedups, what differs, and all runs, in Markdown."""
        floor = max(self.references.values(), default=0.0)
        return "\n\n".join(
            [
                "# Speed against error",
                f"Ours against the fastest peer at equal error. Reference: gauss8 with short steps, off by at most {floor:.1e}.",
                self.speedups(),
                *(f"* {name}: {how}." for name, how in self.differences.items()),
                "All runs; errors relative to the largest value of each of x, y, θ (φ); times are processor time, medians, "
                "of long runs means of two.",
                self.table(),
            ]
        )

    def save(self, path: str | Path) -> None:
        """All runs, as CSV."""
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(Row._fields)
            writer.writerows(self.rows)

    def plot(self, path: str | Path | None = None) -> "Sequence[Axes]":
        """Error against time, a panel for each problem; saved if a path is given."""
        from compare import figures

        axes = figures.precision(self)
        if path is not None:
            figures.save(axes[0], path)
        return axes


class Growth(NamedTuple):
    """Growth rates of waves on a rolling rod: wave numbers q (modes,), measured and by the dispersion relation of the discs."""

    q: Float
    measured: Float
    relation: Float
