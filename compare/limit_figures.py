"""Pictures of the limit of velocities, slopes, energy and the ground's force."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, ScalarFormatter

from compare.figures import KIND
from compare.results import Study
from discs.pictures.style import BLUE, GREEN, GREY, INK, ORANGE

WANTED: dict[str, tuple[str, dict[str, Any]]] = {  # name in a study: in words, and its line
    "velocity": ("velocity", {"color": GREY, "linestyle": "--"}),
    "slope": ("direction r'", {"color": GREY, "linestyle": ":"}),
    "energy inside": ("energy per length, inside", {"color": GREEN}),
    "force inside": ("ground's force per length, inside", {"color": BLUE}),
    "force weak": ("ground's force as a whole (smooth test functions)", {"color": BLUE, "linestyle": "--"}),
    "end force": ("ground's force at the free ends", {"color": ORANGE}),
    "end couple": ("ground's couple at the free ends", {"color": ORANGE, "linestyle": "--"}),
}


def limits_of_all(studies: Sequence[Study]) -> list[Axes]:
    """Errors of velocities, slopes, energy and the ground's force against the number of discs; a panel for each study."""
    figure = Figure(figsize=(max(7.6, 5.2 * len(studies)), 6.2), layout="constrained")
    axes = list(figure.subplots(1, len(studies), squeeze=False, sharey=True)[0])
    for ax, study in zip(axes, studies, strict=True):
        limits_of(study, ax)
        ax.set_title(KIND[study.ends])
    axes[0].set_ylabel("error; of energy and force relative to the field's largest value")
    scene = studies[0].scene
    figure.suptitle(f"Not only the positions converge: {scene.name}, {scene.law}, t = {scene.duration:g}")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=9)
    return axes


def limits_of(study: Study, ax: Axes) -> None:
    """Errors of what a study wanted against the number of discs, and the slope that they should have."""
    errors = study.error[:, len(study.fields) - len(study.names) :]
    for name, error in zip(study.names, errors.T, strict=True):
        words, style = WANTED[name]
        ax.plot(study.n, error, marker="o", markersize=4, label=words, **style)
    n = study.n[[0, -1]].astype(float)
    slope = 4 if study.ends == "elements" else 1 if study.ends == "springs" and study.scene.rod.curvature == "linear" else 2
    line = 0.4 * (errors * (study.n[:, None] / n[0]) ** slope).min() * (n / n[0]) ** -slope
    ax.plot(n, line, color=INK, linewidth=1)
    ax.text(n[1], line[1], f"slope −{slope}  ", ha="right", va="top")
    ax.set(xscale="log", yscale="log", xlabel="number of discs N")
    ax.set_xticks(study.n, minor=False)
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.grid(alpha=0.3, which="major")
