"""The rows of the cross-checks, and the table of them: one module a peer, a row "not installed" for a peer that is not."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from importlib import import_module, metadata
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from tqdm import tqdm

from compare.outputs import fresh_files
from compare.tables import aligned, markdown, write_csv

# module here: (name in the table, package to import, package to install)
PEERS = {
    "in_sympy": ("SymPy", "sympy", "sympy"),
    "in_scipy": ("SciPy", "scipy", "scipy"),
    "in_sundials": ("scikit-sundae", "sksundae", "scikit-sundae"),
    "in_casadi": ("CasADi", "casadi", "casadi"),
    "in_diffrax": ("diffrax", "diffrax", "diffrax"),
    "in_exudyn": ("Exudyn", "exudyn", "exudyn"),
    "in_mujoco": ("MuJoCo", "mujoco", "mujoco"),
    "in_pymunk": ("pymunk", "pymunk", "pymunk"),
    "in_pyelastica": ("PyElastica", "elastica", "pyelastica"),
}


@dataclass(frozen=True)
class Row:
    """One comparison.

    Attributes
    ----------
    peer : program and method. problem : what both computed. quantity : what `ours` and `theirs` are.
    difference : the largest over all that was compared. order : how it falls, and in what; "" if that was not measured.
    our_seconds, their_seconds : processor time of the run of the row.
    differs : how the peer's model or statement differs from ours.
    """

    peer: str
    problem: str
    quantity: str = ""
    ours: float = np.nan
    theirs: float = np.nan
    difference: float = np.nan
    order: str = ""
    our_seconds: float = np.nan
    their_seconds: float = np.nan
    differs: str = ""


def order(settings: ArrayLike, errors: ArrayLike) -> float:
    """Slope of log error against log setting, by least squares."""
    return float(np.polyfit(np.log(settings), np.log(errors), 1)[0])


def rows_of(module: str) -> list[Row]:
    """The rows of one peer; one that says so where its package is not installed."""
    name, package, install = PEERS[module]
    if not find_spec(package):
        return [Row(name, f"not installed: pip install {install}")]
    version = metadata.version(install)
    found: Callable[[], list[Row]] = import_module(f"compare.crosschecks.{module}").rows
    return [Row(**asdict(row) | {"peer": row.peer.replace(name, f"{name} {version}", 1)}) for row in found()]


def crosscheck(out: str | Path, peers: Sequence[str] = tuple(PEERS), progress: bool = True) -> list[Row]:
    """All rows, written to crosschecks.md and crosschecks.csv in the folder `out`."""
    with fresh_files(out) as folder:
        found = [row for peer in tqdm(peers, desc="cross-checks", unit="peer", disable=not progress) for row in rows_of(peer)]
        write_csv(folder / "crosschecks.csv", [[f.name for f in fields(Row)], *(asdict(row).values() for row in found)])
        (folder / "crosschecks.md").write_text(table(found) + "\n", encoding="utf-8")
    return found


def _number(value: float, digits: int) -> str:
    return "" if np.isnan(value) else f"{value:.{digits}g}"


def table(rows: Sequence[Row]) -> str:
    """The table of the documentation."""
    head = "with", "problem", "compared", "ours", "theirs", "largest difference", "order", "ours, s", "theirs, s", "their model"
    cells = []
    for row in rows:
        values = _number(row.ours, 10), _number(row.theirs, 10), _number(row.difference, 2), row.order
        times = _number(row.our_seconds, 2), _number(row.their_seconds, 2)
        cells.append((row.peer, row.problem, row.quantity, *values, *times, row.differs))
    return markdown(head, cells)


def summary(rows: Sequence[Row]) -> str:
    """The table for a terminal, without what was compared and their models."""
    cells = [("with", "problem", "difference", "order", "ours, s", "theirs, s")]
    for row in rows:
        times = _number(row.our_seconds, 2), _number(row.their_seconds, 2)
        cells.append((row.peer, row.problem, _number(row.difference, 2), row.order, *times))
    return aligned(cells)
