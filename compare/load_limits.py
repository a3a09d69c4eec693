"""Loaded rods: N discs against the field, N -> infinity, under one load after the other."""

import csv
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from compare.outputs import fresh_files
from compare.results import Study, format_table
from compare.study import convergence
from continuum import Scene, breathing_ring, solve, untwisting_rod
from discs.arrays import Float
from discs.loads import Damping, Rest, Slope, Torque, signals

SIZES = (129, 257, 513, 1025)
DURATION = 3.0
START = signals.smooth(0.0, 2.0)  # a load that starts at once violates the conditions at free ends at t = 0: no clean order


def _middle(s: Float) -> Float:
    """A torque in the middle of the rod."""
    return 0.3 * np.exp(-((s - 2.0) ** 2))


def _round(s: Float) -> Float:
    """A torque on a ring of length 4."""
    return 0.3 * np.cos(0.5 * np.pi * s)


LOADS = {
    "none": (),
    "rolling resistance": (Damping(rolling=0.3),),
    "viscous torsion": (Damping(torsion=0.2),),
    "slope": (Slope(gx=0.1, gy=-0.2),),
    "torque in the middle": (Torque(_middle, START),),
    "driven end": (Torque(0.3, START, at=0.0),),
    "rest twist": (Rest(twist=0.2, signal=START),),
}
ON_A_RING = {
    "ring, resistance": (Damping(rolling=0.3, torsion=0.2),),
    "ring, torque": (Torque(_round, START),),
}


def scenes() -> dict[str, Scene]:
    """The paper's rod under each load, and a ring."""
    rod, ring = untwisting_rod(duration=DURATION), breathing_ring(duration=1.0, omega=0.2)
    on_rod = {name: replace(rod, loads=loads) for name, loads in LOADS.items()}
    return on_rod | {name: replace(ring, loads=loads) for name, loads in ON_A_RING.items()}


def study(scene: Scene, n: tuple[int, ...], tol: float) -> list[Study]:
    """Discs against the field of a scene, with each kind of ends."""
    field = solve(scene, tol, frames=1, progress=False)
    ends = ("ring",) if scene.closed else ("springs", "consistent")
    return [convergence(scene, n, "springs" if kind == "ring" else kind, field, progress=False) for kind in ends]


def load_limits(out: str | Path, progress: bool = True, n: tuple[int, ...] = SIZES, tol: float = 1e-8) -> str:
    """Discs against the field under each load: loads.csv and loads.png in `out`, and the table as text."""
    from compare import figures

    given = scenes()
    with fresh_files(out) as folder:
        bar = tqdm(given.items(), desc="loads", unit="load", delay=1, disable=not progress)
        found = {name: study(scene, n, tol) for name, scene in bar}
        rows = list(_rows(found))
        with (folder / "loads.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)
        figures.save(figures.loads(found), folder / "loads.png")
    return format_table(rows)


def _rows(found: dict[str, list[Study]]) -> Iterable[tuple[str, ...]]:
    yield "load", "ends", "N", "error", "order", "field's error"
    for name, studies in found.items():
        for each in studies:
            worst = each.error.max(axis=1)
            orders = np.log(worst[:-1] / worst[1:]) / np.log(each.k[:-1] / each.k[1:])
            for n, error, order in zip(each.n, worst, ["", *(f"{o:.2f}" for o in orders)], strict=True):
                yield name, each.ends, str(n), f"{error:.3e}", order, f"{each.floor:.0e}"
