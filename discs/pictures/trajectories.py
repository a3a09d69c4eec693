"""Standard panels of the motion of a mechanical system: coordinates, velocities, multipliers, energy, and paths from above."""

from collections.abc import Callable, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes

from discs.arrays import Float
from discs.mechanics import Trajectory
from discs.pictures.style import BLUE, GREEN, GREY, LABEL, ORANGE, PURPLE

LINES = [((BLUE, ORANGE, GREEN, PURPLE, GREY)[i % 5], ("-", "--", "-.", ":")[i % 4]) for i in range(20)]
NAMED = 15  # so many curves have a legend


def _against_time(ax: Axes, t: Float, values: Float, names: Sequence[str], label: str) -> Axes:
    for column, name, (colour, line) in zip(values.T, names, cycle(LINES), strict=False):
        ax.plot(t, column, line, color=colour, label=name)
    ax.set_xlabel(LABEL["t"])
    ax.set_ylabel(label)
    if len(names) <= NAMED:
        ax.legend(fontsize=8)
    ax.grid(alpha=0.3)
    return ax


def _names(given: Sequence[str], count: int) -> Sequence[str]:
    return given or [str(i) for i in range(count)]


def coordinates(path: Trajectory, ax: Axes) -> Axes:
    """All coordinates against time."""
    return _against_time(ax, path.t, path.q, _names(path.names, path.q.shape[1]), "coordinates q")


def velocities(path: Trajectory, ax: Axes) -> Axes:
    """All velocities against time."""
    return _against_time(ax, path.t, path.v, _names(path.names, path.v.shape[1]), "velocities v")


def multipliers(path: Trajectory, ax: Axes) -> Axes:
    """All multipliers against time, with the owners of their constraints."""
    owners = _names(path.owners, path.multipliers.shape[1])
    names = [owner if owners.count(owner) == 1 else f"{owner}, row {i}" for i, owner in enumerate(owners)]
    return _against_time(ax, path.t, path.multipliers, names, "multipliers λ")


def energy(path: Trajectory, ax: Axes) -> Axes:
    """The change of the energy against time and, where forces or drives do work, their works, whose sum it is."""
    curves = {"energy − energy[0]": path.energy - path.energy[0]}
    if path.work is not None and path.reaction_work is not None:
        curves |= {"work of forces": path.work, "work of reactions": path.reaction_work}
    return _against_time(ax, path.t, np.array(list(curves.values())).T, list(curves), "energy")


def above(path: Trajectory, ax: Axes) -> Axes:
    """The path (x, y), of every disc if the system says where they are."""
    if path.bodies is None:
        x, y = (path.q[:, [path.names.index(name)]] for name in ("x", "y"))
    else:
        x, y = path.discs.x, path.discs.y
    for i, (colour, _) in zip(range(x.shape[1]), cycle(LINES), strict=False):
        ax.plot(x[:, i], y[:, i], color=colour)
        ax.plot(x[-1, i], y[-1, i], "o", color=colour, markersize=4)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel(LABEL["x"])
    ax.set_ylabel(LABEL["y"])
    ax.set_title("from above, ● the end", fontsize="medium")
    ax.grid(alpha=0.3)
    return ax


def panels(path: Trajectory) -> dict[str, Callable[[Trajectory, Axes], Axes]]:
    """The panels that a motion has, by name."""
    found: dict[str, Callable[[Trajectory, Axes], Axes]] = {"coordinates": coordinates, "velocities": velocities}
    if path.multipliers.shape[1]:
        found["multipliers"] = multipliers
    found["energy"] = energy
    if path.bodies is not None or {"x", "y"} <= set(path.names):
        found["above"] = above
    return found
