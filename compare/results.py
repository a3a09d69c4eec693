"""What comparisons return: tables, as text and CSV. Their pictures stand above this module, and are imported when wanted."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from compare import tables
from continuum import Scene
from discs.arrays import Float, Int

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LIMITED = 3.0  # errors over the field's below which they are no longer those of the discs


@dataclass(frozen=True, eq=False)
class Study:
    """Errors of chains of discs against the field at the end of a scene.

    Attributes
    ----------
    scene : the scene.
    ends : kind of ends of the chains; "own" for own headings with free ends, "elements" for degree 2.
    n : (S,), numbers of discs.
    k : (S,), spacings, length.
    error : (S, fields), largest error over the discs of x, y (length), theta and, for own headings, phi (rad); then those of wanted
        quantities, see `compare.quantities`.
    floor : estimated error of the field itself, the largest over positions and angles.
    dt : time step of the chains.
    names : wanted quantities. floors : estimated errors of the field for them.
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
        text = tables.aligned([self.columns, *self.rows()])
        return f"{text}\n\n{self.wants_table()}" if self.names else text

    def wants_table(self) -> str:
        """The table of wanted quantities, aligned for a terminal."""
        return tables.aligned(self.wants_rows())

    def wants_rows(self) -> list[tuple[str, ...]]:
        """Its heading, and a row for each quantity: errors, order ± spread, estimated error of the field.

        The order is the last one between errors of at least three times the field's. "2.05 to 257": later ones are not shown.
        """
        start = len(compared(self.scene))
        head = (self.ends, *(f"N = {n}" for n in self.n), "order", "field's error")
        found = zip(self.names, self.error.T[start:], self.order.T[start:], self.floors, strict=True)
        return [
            head,
            *(
                (name, *(f"{e:.2e}" for e in errors), self._last_order(errors, orders, floor), f"{floor:.0e}")
                for name, errors, orders, floor in found
            ),
        ]

    def _last_order(self, errors: Float, orders: Float, floor: float) -> str:
        """The last order that is one of the discs, with its spread, and up to which N if the field's own error hides later ones."""
        above = np.flatnonzero(errors >= LIMITED * floor)
        last = int(above[-1]) if above.size else 0
        if last == 0 or not np.isfinite(orders[last - 1]):
            return "-"
        before = np.abs(orders[max(0, last - 3) : last] - orders[last - 1])
        spread = f" ± {before.max():.2f}" if last > 1 else ""
        return f"{orders[last - 1]:.2f}{spread}" + (f" to {self.n[last]}" if last + 1 < len(self.n) else "")

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


def write_studies(path: Path, studies: list[Study]) -> None:
    """The table of several studies as CSV."""
    tables.write_csv(path, [_columns(studies[0].fields), *(row for study in studies for row in study.rows(every=True))])


class Growth(NamedTuple):
    """Growth rates of waves on a rolling rod: wave numbers q (modes,), measured and by the dispersion relation of the discs."""

    q: Float
    measured: Float
    relation: Float
