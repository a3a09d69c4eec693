"""Loaded rods and rods that vary: N discs against the field, N -> infinity, under one load after the other."""

import csv
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from compare.outputs import fresh_files
from compare.results import Study, format_table
from compare.study import convergence
from continuum import Scene, breathing_ring, solve, steered_rod, untwisting_rod
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


def wavy(s: Float, mean: float, depth: float, q: float, phase: float = 0.0) -> Float:
    """A parameter that varies along the rod, between mean (1 - depth) and mean (1 + depth)."""
    return mean * (1 + depth * np.cos(q * s + phase))


def varying(q: float) -> dict[str, Any]:
    """The paper's parameters, each changing by a factor of two to four along waves of wave number q."""
    return {
        "density": partial(wavy, mean=1.0, depth=0.5, q=q, phase=-np.pi / 2),
        "spin_inertia": partial(wavy, mean=1.0, depth=0.5, q=q, phase=np.pi),
        "torsion_stiffness": partial(wavy, mean=0.8, depth=0.4, q=q),
        "bending_stiffness": partial(wavy, mean=0.7, depth=0.6, q=2 * q, phase=-np.pi / 2),
        "radius": partial(wavy, mean=1.0, depth=0.4, q=q),
    }


def scenes() -> dict[str, Scene]:
    """The paper's rod under each load, and a ring; both with parameters that vary, and such a rod with headings of its own."""
    rod, ring = untwisting_rod(duration=DURATION), breathing_ring(duration=1.0, omega=0.2)
    on_rod = {name: replace(rod, loads=loads) for name, loads in LOADS.items()}
    on_ring = {name: replace(ring, loads=loads) for name, loads in ON_A_RING.items()}
    half, whole = np.pi / rod.rod.length, 2 * np.pi / rod.rod.length
    beams: dict[str, Any] = {
        "stretch_stiffness": partial(wavy, mean=10.0, depth=0.4, q=half),
        "shear_stiffness": partial(wavy, mean=10.0, depth=0.4, q=half, phase=np.pi),
        "heading_inertia": partial(wavy, mean=0.25, depth=0.4, q=half),
    }
    uneven = {
        "varying rod": untwisting_rod(duration=DURATION, **varying(half)),
        "varying rod, unit law": untwisting_rod("unit", duration=DURATION, **varying(half)),
        "varying ring": breathing_ring(duration=0.5, omega=0.2, **varying(whole)),
        "varying, own headings": steered_rod(duration=1.5, **varying(half), **beams),
    }
    return on_rod | on_ring | uneven


def study(scene: Scene, n: tuple[int, ...], tol: float) -> list[Study]:
    """Discs against the field of a scene, with each kind of ends."""
    field = solve(scene, tol, frames=1, progress=False)
    if scene.steered:
        return [replace(convergence(scene, n, "springs", field, progress=False), ends="own")]
    ends = ("ring",) if scene.closed else ("springs", "consistent")
    return [convergence(scene, n, "springs" if kind == "ring" else kind, field, progress=False) for kind in ends]


def load_limits(out: str | Path, progress: bool = True, n: tuple[int, ...] = SIZES, tol: float = 1e-8) -> str:
    """Discs against the field under each load: loads.csv and loads.png in `out`, and the table as text."""
    from compare import figures

    given = scenes()
    with fresh_files(out) as folder:
        bar = tqdm(given.items(), desc="loads", unit="load", disable=not progress)
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
