"""What comparisons of speed against error return."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from compare.tables import markdown, write_csv
from discs.arrays import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PACKAGES = ("numpy", "scipy", "numba", "scikit-sundae", "pydiffsol", "diffrax", "jax", "exudyn", "mujoco")
ERRORS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)


def versions() -> dict[str, str]:
    """The versions of the packages that methods come from, of those that are installed."""
    found: dict[str, str] = {}
    for name in PACKAGES:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


class Row(NamedTuple):
    """One method with one setting on one problem.

    error : largest error of positions and angles at the end, each relative to its largest value; NaN if there is none.
    seconds : processor time, median of the rounds, or mean of a long run's two times. steps, gradients, solves : counts, None if a
    peer has none. remark : why there is no result, or what is wrong with it. rms : the error in the 2-norm, the largest root mean
    square over the discs, each relative to that of its row.
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
    rms: float = np.nan

    def off(self, rms: bool) -> float:
        """The largest error, or that in the 2-norm."""
        return self.rms if rms else self.error


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

    def curve(self, problem: str, n: int, method: str, rms: bool = False) -> tuple[Float, Float]:
        """Errors and seconds of a method, from loose to tight, without runs that are slower and less accurate than another one.

        problem, n, method : as in a `Row`. rms : errors in the 2-norm instead of the largest ones.
        """
        mine = [r for r in self.rows if (r.problem, r.n, r.method) == (problem, n, method)]
        found = [(r.off(rms), r.seconds) for r in mine if r.off(rms) < 1]
        best = [(e, s) for e, s in found if not any(f <= e and t <= s and (f, t) != (e, s) for f, t in found)]
        errors, seconds = np.array(sorted(best, reverse=True)).reshape(-1, 2).T
        return errors, seconds

    def time_at(self, error: float, problem: str, n: int, ours: bool, rms: bool = False) -> tuple[float, str]:
        """The least time in which any method reaches an error (log-log interpolation between its runs), and its name.

        problem, n : as in a `Row`. ours : among our methods, otherwise among peers. rms : the error in the 2-norm. The time is
        infinite if none reaches it.
        """
        best = np.inf, ""
        for method in dict.fromkeys(r.method for r in self.rows if r.ours == ours):
            errors, seconds = self.curve(problem, n, method, rms)
            if errors.size and errors[-1] <= error:
                at = float(np.exp(np.interp(-np.log(error), -np.log(errors), np.log(seconds))))
                best = min(best, (at, method))
        return best

    def speedups(self, errors: Iterable[float] = ERRORS, rms: bool = False) -> str:
        """Ratio of times, fastest peer over ours, at each of `errors` (the largest ones, with `rms` in the 2-norm), as a table."""
        lines = []
        for problem, n in self.problems:
            for error in errors:
                (ours, mine), (peers, other) = (self.time_at(error, problem, n, whose, rms) for whose in (True, False))
                if not np.isfinite(ours):
                    continue
                ratio = f"{peers / ours:{'.0f' if peers > ours else '.2f'}}" if np.isfinite(peers) else "no peer"
                there = f"{1e3 * peers:.3g} ms" if np.isfinite(peers) else "–"
                lines.append([problem, n, f"{error:.0e}", mine, f"{1e3 * ours:.3g} ms", other or "–", there, ratio])
        return markdown(["problem", "N", "error", "ours", "", "fastest peer", "", "times"], lines)

    def table(self) -> str:
        """All runs, as a table."""
        lines = []
        for r in self.rows:
            counts = ["–" if c is None else c for c in (r.steps, r.gradients, r.solves)]
            error = f"{r.error:.1e}" if np.isfinite(r.error) else "–"
            lines.append([r.problem, r.n, r.method, f"{r.setting:.3g}", error, f"{1e3 * r.seconds:.3g}", *counts, r.remark])
        return markdown(["problem", "N", "method", "setting", "error", "ms", "steps", "gradients", "solves", "remark"], lines)

    def report(self) -> str:
        """Speedups, what differs, and all runs, in Markdown."""
        floor = max(self.references.values(), default=0.0)
        return "\n\n".join(
            [
                "# Speed against error",
                f"Ours against the fastest peer at equal error. Reference: gauss8 with short steps, off by at most {floor:.1e}.",
                self.speedups(),
                "The same at equal error in the 2-norm:",
                self.speedups(rms=True),
                f"Versions: {', '.join(f'{name} {of}' for name, of in versions().items())}.",
                *(f"* {name}: {how}." for name, how in self.differences.items()),
                "All runs; errors relative to the largest value of each of x, y, θ (φ); times are processor time, medians, "
                "of long runs means of two.",
                self.table(),
            ]
        )

    def save(self, path: str | Path) -> None:
        """All runs, as CSV."""
        write_csv(path, [Row._fields, *self.rows])

    def plot(self, path: str | Path | None = None) -> "Sequence[Axes]":
        """Error against time, a panel for each problem; saved if a path is given."""
        from compare import figures

        axes = figures.precision(self)
        if path is not None:
            figures.save(axes[0], path)
        return axes
