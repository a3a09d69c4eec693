"""What a notebook shows of a result: a small picture and a table."""

import base64
import html
import io

import numpy as np
from matplotlib.figure import Figure

from discs.mechanics import Trajectory
from discs.solution import Result, Solution
from discs.stats import doubts


def as_html(run: Result) -> str:
    """A picture from above (of a mechanical system its coordinates) and a table of what was computed, as HTML."""
    stats = run.stats if isinstance(run, Trajectory) else dict(run.discs.stats)
    energy = run.energy if isinstance(run, Trajectory) else run.discs.energy
    size = f"{len(run.names)} coordinates" if isinstance(run, Trajectory) else f"{run.discs.s.size} discs"
    rows = {"motion": f"{size}, {run.t.size} frames, t = {run.t[0]:g} to {run.t[-1]:g}"}
    rows |= {name: str(stats[name]) for name in ("method", "dt", "steps", "engine") if stats.get(name) is not None}
    rows["energy"] = f"{energy[0]:.6g}, changed by {np.abs(energy - energy[0]).max():.1e} at most"
    if isinstance(run, Solution) and run.events:
        rows["events"] = "; ".join(f"{each.name} at t = {each.t:.6g}" for each in run.events[:5])
    if not isinstance(run, Trajectory) and (said := doubts(run.discs.stats)):
        rows["not to be trusted"] = "; ".join(said)
    cells = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(words)}</td></tr>" for name, words in rows.items())
    return f'<div style="display:flex;flex-wrap:wrap;align-items:center">{_picture(run)}<table>{cells}</table></div>'


def _picture(run: Result) -> str:
    """A picture as an HTML image; empty for a motion that has none, as that of a single frame."""
    ax = Figure(figsize=(4.2, 3.0), dpi=80, layout="constrained").subplots()
    try:
        run.plot("coordinates" if isinstance(run, Trajectory) else "motion", ax=ax)
    except ValueError:
        return ""
    drawn = io.BytesIO()
    ax.figure.savefig(drawn, format="png")  # type: ignore[union-attr]
    what = "the motion, from above" if not isinstance(run, Trajectory) else "coordinates against time"
    return f'<img alt="{what}" src="data:image/png;base64,{base64.b64encode(drawn.getvalue()).decode("ascii")}">'
