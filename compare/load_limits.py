"""Loaded rods and rods that vary: N discs against the field, N -> infinity, under one load after the other."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from compare.outputs import fresh_files
from compare.results import Study
from compare.study import convergence
from compare.tables import aligned, write_csv
from continuum import Scene, breathing_ring, solve, steered_rod, untwisting_rod
from discs.arrays import Float
from discs.loads import Damping, Motor, OnRod, Rest, Slope, Torque, signals

SIZES = (129, 257, 513, 1025)
DURATION = 3.0
START = signals.smooth(0.0, 2.0)  # a load that starts at once violates the conditions at free ends at t = 0: no clean order


def _middle(s: Float) -> Float:
    """A torque in the middle of the rod."""
    return 0.3 * np.exp(-((s - 2.0) ** 2))


def _round(s: Float) -> Float:
    """A torque on a ring of length 4."""
    return 0.3 * np.cos(0.5 * np.pi * s)


def _inside(s: Float) -> Float:
    """A curvature along the rod, zero at its ends."""
    return 0.6 * np.sin(0.25 * np.pi * s) ** 4


def _wave(s: Float) -> Float:
    """A curvature with one wave along the rod, or around a ring."""
    return 0.5 * np.cos(0.5 * np.pi * s)


def fitting_twist(s: Float, fields: int = 4) -> tuple[Float, ...]:
    """The straight rod, theta' ~ sin^5(pi s/4), so that it fits free and held ends; and zeros up to `fields`."""
    c = np.cos(0.25 * np.pi * s)
    return s, 0 * s, -1.5 * (c - 2 * c**3 / 3 + c**5 / 5), *(0 * s for _ in range(fields - 3))


def _speed(t: float) -> float:
    """The rate of a motor."""
    return 0.5 * float(signals.smooth(0.0, 1.5)(t))


LOADS: dict[str, tuple[OnRod, ...]] = {
    "none": (),
    "rolling resistance": (Damping(rolling=0.3),),
    "viscous torsion": (Damping(torsion=0.2),),
    "slope": (Slope(gx=0.1, gy=-0.2),),
    "torque in the middle": (Torque(_middle, START),),
    "driven end": (Torque(0.3, START, at=0.0),),
    "rest twist": (Rest(twist=0.2, signal=START),),
    "rest curvature": (Rest(curvature=_inside, signal=START),),
    "bending viscosity": (Damping(bending=0.2),),
}
AT_AN_END: dict[str, tuple[OnRod, ...]] = {"held end": (Motor(0.0, at=0.0),), "motor at the end": (Motor(_speed, at=0.0),)}
OWN_HEADINGS: dict[str, tuple[OnRod, ...]] = {
    "own, rest curvature": (Rest(curvature=_inside),),
    "own, actuated": (Rest(curvature=_wave, signal=signals.smooth(0.0, 1.2)),),
    "own, viscosity": (Damping(bending=0.2),),
}
ON_A_RING: dict[str, tuple[OnRod, ...]] = {
    "ring, resistance": (Damping(rolling=0.3, torsion=0.2),),
    "ring, torque": (Torque(_round, START),),
    "ring, actuated": (Rest(curvature=_wave, signal=signals.smooth(0.0, 0.8)),),
    "ring, bending viscosity": (Damping(bending=0.2), Torque(_round, START)),
}
CURVED_ENDS = "curved to the ends, t = 1.5"  # first order in the end: see `discs.loads.bends`


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
    bent = Rest(curvature=0.3, signal=signals.smooth(0.0, 1.2))
    on_rod[CURVED_ENDS] = replace(rod, loads=(bent,), duration=1.5)
    fitting = replace(rod, initial=fitting_twist, duration=2.0)
    on_rod |= {name: replace(fitting, loads=loads) for name, loads in AT_AN_END.items()}
    beam = steered_rod(duration=1.5)
    own = {name: replace(beam, loads=loads) for name, loads in OWN_HEADINGS.items()}
    fitting = replace(beam, initial=partial(fitting_twist, fields=6), duration=2.0)
    own |= {f"own, {name}": replace(fitting, loads=loads) for name, loads in AT_AN_END.items()}
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
    return on_rod | on_ring | own | uneven


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
        write_csv(folder / "loads.csv", rows)
        figures.save(figures.loads(found), folder / "loads.png")
    return aligned(rows)


def _rows(found: dict[str, list[Study]]) -> Iterable[tuple[str, ...]]:
    """A row for each size; the spread, by how much the orders before the last differ from it, is the error bar of the last."""
    yield "load", "ends", "N", "error", "order", "spread", "field's error"
    for name, studies in found.items():
        for each in studies:
            worst = each.error.max(axis=1)
            orders = np.log(worst[:-1] / worst[1:]) / np.log(each.k[:-1] / each.k[1:])
            told = ["", *(f"{order:.2f}" for order in orders)]
            spreads = [""] * orders.size + [f"{np.abs(orders[-3:] - orders[-1]).max():.2f}" if orders.size > 1 else ""]
            for n, error, order, spread in zip(each.n, worst, told, spreads, strict=True):
                yield name, each.ends, str(n), f"{error:.3e}", order, spread, f"{each.floor:.0e}"
