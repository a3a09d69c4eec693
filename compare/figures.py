"""Pictures. Every function draws into given or new axes and returns them; no window opens."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, ScalarFormatter
from mpl_toolkits.mplot3d.axes3d import Axes3D

from compare.results import Growth, Slips, Study, compared
from compare.work_precision import WorkPrecision
from continuum import Scene
from discs import Solution
from discs.arrays import Float
from discs.pictures import figures as of_discs
from discs.pictures import geometry
from discs.pictures.figures import given_or_new
from discs.pictures.style import BLUE, COORDINATE, ENDS, GREEN, GREY, INK, LABEL, LAW_COLOUR, METHOD, ORANGE, PURPLE, look

KIND = {
    "springs": "plain springs",
    "consistent": "consistent ends",
    "paper": "the paper's ends",
    "ring": "ring",
    "own": "own headings",
    "elements": "elements of three",
}
LAW = {"field": "field law", "unit": "unit law", "own": "own headings", "tilted": "tilted rod", "driven": "driven rod"}
SYMBOL = {"x": "x", "y": "y", "theta": "θ", "phi": "φ"}


def save(ax: Axes, path: str | Path) -> None:
    """Save the figure that an axes belongs to."""
    ax.figure.savefig(path, dpi=150)  # type: ignore[union-attr]


def convergence(studies: Sequence[Study], ax: Axes | None = None) -> Axes:
    """Error against number of discs, log-log, with slopes −1 and −2 and the field's own error estimate."""
    ax = given_or_new(ax, 6.8, 5.6)
    ax.set_xscale("log")
    if any((s.error > 0).any() for s in studies):
        ax.set_yscale("log")  # an error of 0, as of a rod at rest, has no logarithm
    for study in studies:
        colour = ENDS[study.ends]
        for j, (name, marker, line) in enumerate(zip(compared(study.scene), "os^d", ("-", "--", ":", "-."), strict=False)):
            label = f"{KIND[study.ends]}, {SYMBOL[name]}"
            ax.plot(study.n, study.error[:, j], marker=marker, linestyle=line, color=colour, label=label, markersize=5)
    # the two slopes, each beside the curves that should have it
    first = [s for s in studies if s.ends == "springs" and s.scene.rod.curvature == "linear"]
    slopes = [(1, s, 1.7) for s in first] + [(4 if s.ends == "elements" else 2, s, 0.5) for s in studies if s not in first]
    for slope, study, beside in slopes:
        n = study.n[-3:].astype(float)
        level = study.error[-1].max() if beside > 1 else study.error[-1].min()
        line = beside * level * (n / n[-1]) ** -slope
        ax.plot(n, line, color=GREY, linewidth=1)
        where = ("left", "bottom") if beside > 1 else ("right", "top")  # on the side away from the curves
        ax.text(n[1], line[1], f"slope −{slope} ", color=GREY, ha=where[0], va=where[1])
    floor = max(s.floor for s in studies)
    least = min((s.error[s.error > 0].min() for s in studies if (s.error > 0).any()), default=0.0)
    if floor > 0.01 * least:
        ax.axhline(floor, color="black", linestyle=(0, (1, 2)), label=f"estimated error of the field, {floor:.1e}")
    elif floor > 0:  # far below: a line there would press the curves together
        ax.plot([], [], " ", label=f"estimated error of the field: {floor:.1e}")
    ticks = sorted({int(m) for s in studies for m in s.n})
    ax.set_xticks(ticks, minor=False)
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_formatter(NullFormatter())
    scene = studies[0].scene
    ax.set_xlabel("number of discs N")
    ax.set_ylabel("largest error over the discs (length, rad)")
    ax.set_title(f"N discs against the field: {scene.name}, {scene.law}, t = {scene.duration:g}")
    ax.legend(fontsize=8, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.14))
    ax.grid(alpha=0.3, which="major")
    return ax


def slip(found: Sequence[Slips]) -> list[Axes]:
    """Distance of sliding discs from rolling ones of the same N, and their slip, against epsilon; a row for each scene."""
    figure = Figure(figsize=(10.5, 4.4 * len(found)), layout="constrained")
    axes = figure.subplots(len(found), 2, squeeze=False)
    for (far, at_ends), each in zip(axes, found, strict=True):
        ring = each.scene.closed
        for i, n in enumerate(each.n):
            colour = colormaps["viridis"](0.9 * i / max(1, len(each.n) - 1))
            far.loglog(each.epsilon, each.rolling[i], marker="o", markersize=4, color=colour, label=f"N = {n}")
            at_ends.loglog(each.epsilon, each.end[i], marker="o", markersize=4, color=colour)
            if not ring:
                at_ends.loglog(each.epsilon, each.inside[i], marker="s", markersize=3, color=colour, linestyle="--")
        ends = np.array([each.epsilon[0], each.epsilon[-1]])
        for ax, values, order in ((far, each.rolling[0], 1.0), (at_ends, each.end[-1], 1.0 if ring else 0.5)):
            level = (
                values[0]
                if order == 1
                else values[len(each.epsilon) // 2] * (ends[0] / each.epsilon[len(each.epsilon) // 2]) ** 0.5
            )
            ax.loglog(ends, 0.6 * level * (ends / ends[0]) ** order, color=GREY, linewidth=1, label=f"slope {order:g}")
        when = f"at t = {each.scene.duration:g}"
        far.set(title=f"{each.scene.name}: distance from rolling discs", ylabel=f"largest distance {when} (length, rad)")
        at_ends.set(title=f"{each.scene.name}: slip", ylabel=f"largest |dr/dt − e ω| {when} (length per time)")
        if not ring:
            at_ends.plot([], [], marker="o", markersize=4, color=GREY, label="end discs")
            at_ends.plot([], [], marker="s", markersize=3, color=GREY, linestyle="--", label="discs inside")
        for ax in (far, at_ends):
            ax.set_xlabel("ε, from sliding (right) to rolling (left)")
            ax.grid(alpha=0.3, which="major")
        far.legend(fontsize=8)
        at_ends.legend(fontsize=8)
    return list(axes.ravel())


def loads(found: Mapping[str, Sequence[Study]]) -> Axes:
    """Largest error of any field against the number of discs, a line for each load, a panel for each kind of ends."""
    ends = list(dict.fromkeys(study.ends for studies in found.values() for study in studies))
    figure = Figure(figsize=(4.2 * len(ends), 6.2), layout="constrained")
    axes = figure.subplots(1, len(ends), squeeze=False, sharey=True)[0]
    for ax, kind in zip(axes, ends, strict=True):
        shown = [(name, study) for name, studies in found.items() for study in studies if study.ends == kind]
        colours = GREY, ORANGE, BLUE, GREEN, PURPLE, INK
        for i, (name, study) in enumerate(shown):
            style = {"color": colours[i % len(colours)], "linestyle": ("-", "--", "-.")[i // len(colours) % 3]}
            ax.loglog(study.n, study.error.max(axis=1), marker="o", markersize=4, label=name, **style)
        n = shown[0][1].n[[0, -1]].astype(float)
        level = min(study.error[0].max() for _, study in shown)
        slope = 1 if kind == "springs" else 2
        ax.loglog(n, 0.5 * level * (n / n[0]) ** -slope, color=GREY, linestyle=":", label=f"slope −{slope}")
        ax.set(title=KIND[kind], xlabel="number of discs N")
        ax.set_xticks(shown[0][1].n, minor=False)
        ax.xaxis.set_major_formatter(ScalarFormatter())
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.grid(alpha=0.3, which="major")
        below = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.12)}  # no line is covered
        ax.legend(fontsize=8, ncols=2, handlelength=3.5, **below)
    axes[0].set_ylabel("largest error over discs and fields (length, rad)")
    first: Axes = axes[0]
    return first


def motion(run: Solution, scene: Scene, arrows: int = 24, instants: int = 5) -> Figure:
    """The paper's figure of the motion: at some instants the centre line and the director d_3 = cos(theta) e_z + sin(theta) J d_1.

    The last panel shows all of them from above.
    """
    columns, frames = 3, geometry.instants(run, instants)
    rows = -(-(len(frames) + 1) // columns)
    figure = Figure(figsize=(4.0 * columns, 3.4 * rows), layout="constrained")
    lines = [np.stack([run.x[f], run.y[f]]) for f in frames]
    if scene.closed:
        lines = [np.append(line, line[:, :1] + np.array(scene.shift)[:, None], axis=1) for line in lines]
    everything = np.concatenate(lines, axis=1)
    middle, reach = everything.mean(axis=1), np.ptp(everything, axis=1).max() / 2 * 1.1
    shown, sideways = geometry.picked(run.s, arrows), geometry.turn(geometry.axles(run))
    for panel, (f, (x, y)) in enumerate(zip(frames, lines, strict=True), 1):
        ax: Axes3D = figure.add_subplot(rows, columns, panel, projection="3d")
        sine, cosine = np.sin(run.theta[f]), np.cos(run.theta[f])
        d3 = np.array([*(sideways[f] * sine), cosine])[:, shown]
        ax.plot(x, y, 0, color=BLUE, linewidth=2)
        ax.quiver(x[shown], y[shown], 0, *(0.25 * reach * d3), color=ORANGE, linewidth=1, arrow_length_ratio=0.25)
        _stage(ax, middle, reach)
        ax.set_title(f"t = {run.t[f]:.3g}", y=0.98)
    top: Any = figure.add_subplot(rows, columns, len(lines) + 1)
    of_discs.motion(run, top, instants=len(lines))
    figure.suptitle(f"{scene.name}, {scene.law}; arrows are the directors d₃")
    return figure


def laws(runs: dict[str, Solution], distance: Float, instants: int = 5) -> list[Axes]:
    """Two motions of the same rod: the distance between them, (fields, F), and their centre lines from above."""
    (first, a), (second, b) = runs.items()
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for name, row in zip(("x", "y", "theta"), distance, strict=True):
        left.plot(a.t, row, label=SYMBOL[name], color=COORDINATE[name])
    left.set_xlabel("time t")
    left.set_ylabel("largest distance (length, rad)")
    left.legend()
    frames = geometry.instants(a, instants)
    for f, shade in zip(frames, np.linspace(0.25, 1, frames.size), strict=True):
        for run, law, line in ((a, first, "-"), (b, second, "--")):
            right.plot(
                run.x[f], run.y[f], line, color=LAW_COLOUR.get(law, GREEN), alpha=shade, label=f"{law} law" if shade == 1 else None
            )
        right.annotate(f"t = {a.t[f]:.2g}", (a.x[f, -1], a.y[f, -1]), fontsize=8, textcoords="offset points", xytext=(4, 0))
    right.set_aspect("equal", adjustable="datalim")
    right.set_xlabel("x")
    right.set_ylabel("y")
    right.legend()
    for ax in (left, right):
        ax.grid(alpha=0.3)
    return [left, right]


def _stage(ax: Axes3D, middle: Float, reach: float) -> None:
    ax.set_xlim(middle[0] - reach, middle[0] + reach)
    ax.set_ylim(middle[1] - reach, middle[1] + reach)
    ax.set_zlim(-0.3 * reach, 0.3 * reach)
    ax.set_box_aspect((1, 1, 0.3), zoom=1.2)
    ax.set_zticks([])
    ax.set_xlabel("x")  # without unit, which the view from above shows: a longer label would be cut off
    ax.set_ylabel("y")
    ax.tick_params(labelsize=8, pad=0)
    ax.view_init(elev=35, azim=-65)


def energy(runs: dict[str, Solution], ax: Axes | None = None) -> Axes:
    """Energy against time, all runs in the same axes; the modified energy, if recorded, is dotted."""
    ax = given_or_new(ax, 7.6, 4.6)
    for label, run in runs.items():
        colour = look(str(run.stats["method"]))["color"]
        ax.plot(run.t, run.energy, color=colour, label=label, linewidth=1)
        if run.modified_energy is not None:
            its = f"{label.split(',')[0]}: modified energy"
            ax.plot(run.t, run.modified_energy, color=colour, linestyle=":", linewidth=3, label=its)
    ax.set_xlabel(LABEL["t"])
    ax.set_ylabel("energy E (mass length²/time²)")
    ax.legend(fontsize=8, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.14))
    ax.grid(alpha=0.3)
    return ax


def precision(study: WorkPrecision) -> list[Axes]:
    """Error against time, log-log, a row of panels for each problem: our methods with thick solid lines, in front; peers with thin
    dashed ones, each with its colour and mark."""
    names = list(dict.fromkeys(name for name, _ in study.problems))
    sizes = list(dict.fromkeys(n for _, n in study.problems))
    peers = list(dict.fromkeys(r.method for r in study.rows if not r.ours))
    own = {r.method for r in study.rows if r.ours}
    own_in_order = [*(method for method in METHOD if method in own), *sorted(own - set(METHOD))]
    columns = len(sizes) if len(names) > 1 else min(len(sizes), 2)  # a single problem fills a page's width
    rows = -(-len(names) * len(sizes) // columns)
    figure = Figure(figsize=(1.5 + 3.3 * max(columns, 2), 1.8 + 3.4 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    shown: dict[str, Any] = {}
    for ax, (name, n) in zip(grid.ravel(), ((name, n) for name in names for n in sizes), strict=False):
        for method in (*peers, *own_in_order):
            errors, seconds = study.curve(name, n, method)
            if errors.size:
                shown.setdefault(method, ax.loglog(seconds, errors, **look(method))[0])
        ax.set_title(f"{LAW.get(name, name)}, N = {n}", fontsize="medium")
        ax.grid(alpha=0.3)
    for ax in grid[-1]:
        ax.set_xlabel("processor time (s)")
    for ax in grid[:, 0]:
        ax.set_ylabel("relative error of x, y, θ")
    order = [m for m in (*own_in_order, *peers) if m in shown]
    lines = [shown[m] for m in order]
    figure.legend(lines, order, loc="outside lower center", ncols=6 if columns > 2 else 4, fontsize="small", frameon=False)
    return list(grid.ravel())


def stability(size: str, drifts: dict[str, list[tuple[float, float, int]]], growth: dict[str, Growth]) -> list[Axes]:
    """Energy error against h/k for each method, and the growth of waves on the straight rolling rod by law.

    Parameters
    ----------
    size : of the chain, in words.
    drifts : method -> (h/k, relative error of the energy or NaN where it stopped, steps that were not converged: a cross).
    growth : law -> growth rates.
    """
    figure = Figure(figsize=(11.5, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for method, points in drifts.items():
        line = look(method)
        multiple, drift, unconverged = np.array(points).T
        if np.isfinite(drift).any():
            left.loglog(multiple, drift, label=method, **line)
        left.loglog(multiple[unconverged > 0], drift[unconverged > 0], "x", color=line["color"], markersize=9)
    left.set_xlabel("h/k")
    left.set_ylabel("relative error of the energy")
    left.set_title(f"paper's scene, {size}; × steps unconverged, no point: stopped", fontsize="medium")
    left.set_xticks([1, 2, 4, 8, 16, 32, 64], minor=False)
    left.xaxis.set_major_formatter(ScalarFormatter())
    left.xaxis.set_minor_formatter(NullFormatter())
    left.grid(alpha=0.3)
    if drifts:
        left.legend(fontsize=8, loc="upper left")
    for (law, waves), mark in zip(growth.items(), "os", strict=False):
        colour = LAW_COLOUR.get(law, GREEN)
        right.plot(waves.q, waves.relation, "-", color=colour, label=f"{law} law, dispersion relation of 33 discs")
        right.plot(waves.q, waves.measured, mark, color=colour, markersize=4, label=f"{law} law, measured, midpoint")
    if growth:
        right.legend(fontsize=8)
    right.set_xlabel("wave number q (1/length)")
    right.set_ylabel("growth rate σ (1/time)")
    right.set_title("straight rod rolling", fontsize="medium")
    right.grid(alpha=0.3)
    return [left, right]
