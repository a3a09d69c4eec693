"""What a page draws: the choices as an object for JSON, a frame as 32-bit floats."""

from typing import Any

import numpy as np

from compare.lab.beside import Field
from compare.lab.messages import MOST_DISCS
from compare.lab.settings import FIXED, Settings
from discs import Problem
from discs.arrays import Float
from discs.pictures.geometry import picked
from discs.pictures.style import LABEL
from discs.running.moments import Moment

DRAWN = 65  # discs, about; all, if there are fewer than twice as many
STEPS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05)


def description(settings: Settings, problem: Problem) -> dict[str, Any]:
    """The choices, their present values, and the chain."""
    shown, s = picked(problem.chain.s, DRAWN), problem.chain.s
    return {
        "choices": {
            "scene": list(settings.scenes),
            "rolling": list(settings.laws),
            "ends": list(settings.kinds_of_ends),
            "method": list(FIXED),
            "dt": sorted({*STEPS, settings.dt}),
        },
        "chosen": {
            "scene": settings.scene,
            "rolling": settings.rolling if settings.rolling in settings.laws else settings.laws[0],
            "ends": settings.ends if settings.ends in settings.kinds_of_ends else settings.kinds_of_ends[0],
            "method": settings.method,
            "dt": settings.dt,
            "n": settings.n,
        },
        "most": MOST_DISCS,
        "sliders": [
            {"name": s.name, "label": s.label, "low": s.low, "high": s.high, "value": settings.value(s.name), "again": s.again}
            for s in settings.sliders
        ],
        "discs": shown.tolist(),
        "ring": problem.chain.ends == "ring" and not any(problem.chain.shift),
        "length": float(problem.chain.length),
        "spacing": float(problem.chain.k),
        "radius": float(np.ptp(s)) / min(18, 3 * (s.size - 1)),
        "labels": LABEL,
    }


def frame(now: Moment, t: float, field: Field | None) -> tuple[dict[str, Any], bytes]:
    """A frame: numbers, and rows of the drawn discs as little-endian 32-bit floats, those of the field last.

    `rows` names them. error : largest distances of the discs from the field, length and rad; None without it.
    """
    chain: Any = now.problem.chain
    shown = picked(chain.s, DRAWN)
    slope, force = now.slope, now.contact_force
    stretch = slope if now.phi is None else (np.gradient(now.x, chain.s), np.gradient(now.y, chain.s))
    rows = {
        "x": now.x,
        "y": now.y,
        "theta": now.theta,
        "omega": now.omega,
        "axle": np.arctan2(slope[1], slope[0]),
        "stretch": np.hypot(*stretch),
        "force_x": force[0],
        "force_y": force[1],
    }
    error = None
    there = None if field is None else field.at(t)
    if there is not None:
        error = {"place": float(np.hypot(now.x - there["x"], now.y - there["y"]).max())}
        error["angle"] = float(np.abs(now.theta - there["theta"]).max())
        rows |= {
            "field_x": there["x"],
            "field_y": there["y"],
            "field_theta": there["theta"],
            "field_axle": there["phi"] if "phi" in there else _axle(chain, there["x"], there["y"]),
        }
    data = np.ascontiguousarray([row[shown] for row in rows.values()], dtype="<f4")
    return {"t": t, "energy": now.energy, "error": error, "rows": list(rows), "n": int(shown.size)}, data.tobytes()


def _axle(chain: Any, x: Float, y: Float) -> Float:
    """The direction of the centre line at the discs."""
    if chain.ends != "ring":
        edge: Any = 2 if x.size > 2 else 1
        found: Float = np.arctan2(np.gradient(y, chain.s, edge_order=edge), np.gradient(x, chain.s, edge_order=edge))
        return found
    dx, dy = (np.roll(value, -1) - np.roll(value, 1) for value in (x, y))
    for d, shift in ((dx, chain.shift[0]), (dy, chain.shift[1])):
        d[0] += shift
        d[-1] += shift
    return np.asarray(np.arctan2(dy, dx))
