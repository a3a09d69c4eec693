"""Pictures of the discs. Every function draws into given or new axes and returns them; no window opens."""

from collections.abc import Callable, Iterable
from functools import partial
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from discs import checks
from discs.chains.chain import SteeredChain
from discs.files import schema
from discs.mechanics import Trajectory
from discs.mechanics.vakonomic import of_chain, rolling_disc, solve
from discs.pictures import geometry, trajectories
from discs.pictures.style import BLUE, COORDINATE, GREEN, GREY, INK, LABEL, ORANGE, PURPLE, SIGNED, UNSIGNED
from discs.problem import Problem, State
from discs.solution import Result, Solution


def given_or_new(ax: Axes | None, width: float, height: float) -> Axes:
    """The axes to draw into: those given, or of a new figure of this size in inches."""
    return Figure(figsize=(width, height), layout="constrained").subplots() if ax is None else ax


def first_look(run: Result, panels: Iterable[str] = (), ax: Axes | Iterable[Axes] | None = None) -> list[Axes]:
    """Standard panels of a run, or of the motion of a mechanical system: the named ones, or all.

    Parameters
    ----------
    panels : "motion" (from above), "theta" and "omega" over (s, t), "end" (the first disc against time), "profiles" (theta along
        the rod), "energy" (its error). By name only: "phase" (omega against theta), and over (s, t) every quantity that the run
        recorded for each disc, as "x" or "contact_force" (its size). One disc has nothing along s. Of a mechanical system:
        "coordinates", "velocities", "multipliers", "energy" (its change, and works) against time, "above" (paths in the plane).
    ax : one axes for each panel, or None for a new figure.

    Raises
    ------
    ValueError : for an unknown panel, another number of axes, or a run of a single frame.
    """
    usual = _panels(run)
    every = usual | _further(run)
    names = [checks.choice("panel", name, every) for name in panels] or list(usual)
    if ax is None:
        columns = min(len(names), 3)
        rows = -(-len(names) // columns)
        figure = Figure(figsize=(4.8 * columns, 3.7 * rows), layout="constrained")
        axes = [figure.add_subplot(rows, columns, i + 1) for i in range(len(names))]
    else:
        axes = [ax] if isinstance(ax, Axes) else list(ax)
    if len(axes) != len(names):
        raise ValueError(f"ax must be one axes for each of the {len(names)} panels; got {len(axes)}")
    if run.t.size < 2:
        raise ValueError("a picture over time needs at least two frames; got 1")
    for name, one in zip(names, axes, strict=True):
        every[name](one)
    return axes


def _panels(run: Result) -> dict[str, Callable[[Axes], Axes]]:
    """The panels of a result, by name."""
    if isinstance(run, Trajectory):
        return {name: partial(draw, run) for name, draw in trajectories.panels(run).items()}
    one = run.discs
    return {name: partial(draw, one) for name, draw in PANELS.items() if one.s.size > 1 or name not in ALONG}


def _further(run: Result) -> dict[str, Callable[[Axes], Axes]]:
    """The panels that are drawn only if they are asked for."""
    if isinstance(run, Trajectory):
        return {}
    one = run.discs
    maps = {name: partial(spacetime, one, name) for name in _recorded(one) if name not in PANELS} if one.s.size > 1 else {}
    return {"phase": partial(phase, one), **maps}


def _recorded(run: Solution) -> list[str]:
    """The quantities of each disc that a run recorded."""
    return [name for name, of in schema.QUANTITIES.items() if of.dims[-1:] == ("disc",) and getattr(run, name) is not None]


def phase(run: Solution, ax: Axes | None = None, discs: int = 3) -> Axes:
    """The phase portrait: omega against theta of some discs, among them the first and the last; a dot is the end."""
    ax = given_or_new(ax, 5.4, 4.4)
    for i, colour in zip(
        np.unique(np.linspace(0, run.s.size - 1, checks.whole("discs", discs, 1)).astype(int)),
        cycle((BLUE, ORANGE, GREEN, PURPLE, GREY)),
        strict=False,
    ):
        ax.plot(run.theta[:, i], run.omega[:, i], color=colour, label=f"disc at s = {run.s[i]:.3g}")
        ax.plot(run.theta[-1, i], run.omega[-1, i], "o", color=colour, markersize=4)
    ax.set_xlabel(LABEL["theta"])
    ax.set_ylabel(LABEL["omega"])
    ax.legend(fontsize=8)
    ax.grid(alpha=0.3)
    return ax


def motion(run: Solution, ax: Axes | None = None, instants: int = 5, discs: int = 9, radius: float | None = None) -> Axes:
    """The centre line from above at several times. Discs are bars; a dot on each marks the tip of its spoke d_3.

    Parameters
    ----------
    instants : number of times.
    discs : approximate number of discs drawn; all, if there are fewer than twice as many.
    radius : half the length of a bar; None takes an eighteenth of the rod, of few discs more.
    """
    ax = given_or_new(ax, 6.4, 4.8)
    frames = geometry.instants(run, checks.whole("instants", instants, 1))
    shown = geometry.picked(run.s, checks.whole("discs", discs, 1))
    size = geometry.drawn_radius(run, radius)
    forward = geometry.turn(geometry.axles(run))
    ring = geometry.is_ring(run)
    for f, shade in zip(frames, np.linspace(0.25, 1, frames.size), strict=True):
        r = np.stack([run.x[f], run.y[f]])
        line = np.append(r, r[:, :1], axis=1) if ring else r
        ax.plot(*line, color=BLUE, alpha=shade, linewidth=2, label=f"t = {run.t[f]:.3g}")
        at, along = r[:, shown], size * forward[f][:, shown]
        ax.plot(*np.stack([at - along, at + along], axis=1), color=INK, alpha=shade, linewidth=0.9)
        tip = at + np.sin(run.theta[f, shown]) * along
        up = np.cos(run.theta[f, shown]) >= 0
        ax.plot(*tip[:, up], "o", color=ORANGE, alpha=shade, markersize=3.5)
        ax.plot(*tip[:, ~up], "o", color=ORANGE, markerfacecolor="white", alpha=shade, markersize=3.5)
    _from_above(ax, "from above; ● spoke up, ○ down")
    ax.legend(fontsize=8)
    return ax


def spacetime(run: Solution, name: str = "omega", ax: Axes | None = None) -> Axes:
    """A quantity of each disc in colour over (s, t); contour lines, dashed below zero, remain readable without colour.

    name : "theta", "omega" or any other that the run recorded; of "contact_force" its size.
    """
    ax = given_or_new(ax, 5.4, 4.4)
    values = getattr(run, checks.choice("name", name, _recorded(run)))
    size = values.ndim == 3
    values = np.hypot(values[:, 0], values[:, 1]) if size else values
    reach = np.abs(values).max() or 1.0
    colours = LinearSegmentedColormap.from_list("colours", UNSIGNED if size else SIGNED)
    low = 0.0 if size else -reach
    mesh = ax.pcolormesh(run.s, run.t, values, cmap=colours, vmin=low, vmax=reach, shading="gouraud", rasterized=True)
    if np.ptp(values) > 1e-9 * reach:
        ax.contour(run.s, run.t, values, levels=9, colors=INK, linewidths=0.5)
    bar = ax.figure.colorbar(mesh, ax=ax)
    bar.set_label(LABEL.get("force" if size else name, f"{name} ({schema.QUANTITIES[name].units})"))
    ax.set_xlabel(LABEL["s"])
    ax.set_ylabel(LABEL["t"])
    return ax


def end_disc(run: Solution, ax: Axes | None = None) -> Axes:
    """Position and roll angle of the first disc against time."""
    ax = given_or_new(ax, 5.4, 4.0)
    for name, symbol, line in (("x", "x", "-"), ("y", "y", "--"), ("theta", "θ", "-.")):
        ax.plot(run.t, getattr(run, name)[:, 0], line, color=COORDINATE[name], label=symbol)
    ax.set_xlabel(LABEL["t"])
    ax.set_ylabel("x, y (length), θ (rad)")
    ax.set_title(f"disc at s = {run.s[0]:g}", fontsize="medium")
    ax.legend(fontsize=8)
    ax.grid(alpha=0.3)
    return ax


def profiles(run: Solution, name: str = "theta", ax: Axes | None = None, instants: int = 5) -> Axes:
    """theta or omega along the rod at several times, later ones darker."""
    ax = given_or_new(ax, 5.4, 4.0)
    values = getattr(run, checks.choice("name", name, ("theta", "omega")))
    frames = geometry.instants(run, checks.whole("instants", instants, 1))
    for f, shade in zip(frames, np.linspace(0.25, 1, frames.size), strict=True):
        ax.plot(run.s, values[f], color=BLUE, alpha=shade, label=f"t = {run.t[f]:.3g}")
    ax.set_xlabel(LABEL["s"])
    ax.set_ylabel(LABEL[name])
    # above: the curves leave no corner free
    ax.legend(fontsize=8, ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1), frameon=False, handlelength=1, columnspacing=0.8)
    ax.grid(alpha=0.3)
    return ax


def energy_error(run: Solution, ax: Axes | None = None) -> Axes:
    """Change of the energy against time, less work and dissipation, relative to the initial energy unless that is zero."""
    ax = given_or_new(ax, 5.4, 4.0)
    start = float(run.energy[0])
    off = run.energy - run.work + run.dissipated
    ax.plot(run.t, (off - off[0]) / (start or 1.0), color=BLUE)
    ax.set_xlabel(LABEL["t"])
    change = "E − E₀" if run.balance is None else "E − E₀ − work + dissipated"
    ax.set_ylabel(f"({change})/E₀" if start else change)
    ax.set_title(f"energy, E₀ = {start:.6g}", fontsize="medium")
    ax.grid(alpha=0.3)
    return ax


PANELS: dict[str, Callable[[Solution, Axes], Axes]] = {
    "motion": motion,
    "theta": lambda run, ax: spacetime(run, "theta", ax),
    "omega": lambda run, ax: spacetime(run, "omega", ax),
    "end": end_disc,
    "profiles": lambda run, ax: profiles(run, "theta", ax),
    "energy": energy_error,
}
ALONG = ("theta", "omega", "profiles")  # over s


def vakonomic() -> Figure:
    """Vakonomic motions beside the nonholonomic one: a disc on an incline, the growth of the difference, a chain of three discs."""
    figure = Figure(figsize=(11.5, 4.3), layout="constrained")
    axes = figure.subplots(1, 3)
    _incline(axes[0], axes[1])
    _chain(axes[2])
    return figure


def _incline(above: Axes, parted: Axes) -> None:
    m, radius, turning, phi = 1.3, 0.7, 1.5, 0.0
    disc = rolling_disc(mass=m, spin_inertia=0.4, heading_inertia=0.25, radius=radius, pull=(0.0, -0.5))
    omega = 0.6
    q = np.array([0.0, 0.0, 0.0, phi])
    v = np.array([-radius * omega * np.sin(phi), radius * omega * np.cos(phi), omega, turning])
    charges = {
        "μ(0) = 0": (np.zeros(2), ORANGE, "-"),
        "μ(0) = −m ṙ": (-m * v[:2], GREEN, "--"),
        "μ(0) = −m ṙ + 0.1 d₁": (-m * v[:2] + 0.1 * np.array([np.cos(phi), np.sin(phi)]), PURPLE, "-."),
    }
    long, short = np.linspace(0, 10, 401), np.array([0.0, *np.geomspace(0.01, 3, 40)])
    own = solve(disc, q, v, short, tol=1e-13)
    above.plot(*solve(disc, q, v, long).q[:, :2].T, color=BLUE, linewidth=2, label="nonholonomic")
    for label, (mu, colour, line) in charges.items():
        above.plot(*solve(disc, q, v, long, mu, tol=1e-8).q[:, :2].T, line, color=colour, label=label)
        gap = np.abs(solve(disc, q, v, short, mu, tol=1e-13).q[1:, 3] - own.q[1:, 3])
        parted.loglog(short[1:], gap, line, color=colour, label=label)
    for power, level in ((2, 0.04), (3, 0.04), (4, 0.02)):
        t = np.array([0.015, 0.06])
        parted.loglog(t, level * t**power, color=GREY, linewidth=1)
        parted.text(t[-1] * 1.1, level * t[-1] ** power, f"t{'²³⁴'[power - 2]}", color=GREY, va="center")
    above.plot(0, 0, "o", color="black", markersize=5)
    above.annotate("down", (0.09, 0.06), (0.09, 0.2), xycoords="axes fraction", arrowprops={"arrowstyle": "->"}, ha="center")
    _from_above(above, "one disc on an incline")
    above.legend(fontsize=8, loc="center right", bbox_to_anchor=(1, 0.62), handlelength=1.5)
    parted.set_xlabel(LABEL["t"])
    parted.set_ylabel("|φ vakonomic − φ nonholonomic|  (rad)")
    parted.set_title("growth of the difference", fontsize="medium")
    parted.legend(fontsize=8)
    parted.grid(alpha=0.3)


def _chain(ax: Axes) -> None:
    chain = SteeredChain(
        n=3,
        length=2.0,
        density=1.3,
        spin_inertia=0.6,
        heading_inertia=0.3,
        stretch_stiffness=4.0,
        shear_stiffness=3.0,
        torsion_stiffness=0.9,
        bending_stiffness=0.8,
        radius=0.7,
    )
    x = np.array([0.0, 1.0, 2.0])
    initial = State(x, 0.0 * x, theta=[-1.0, 0.2, 0.8], omega=[1.6, 0.8, 0.9], phi=0.0 * x, phi_rate=[0.4, 0.1, -0.3])
    system, q, v = of_chain(Problem(chain, initial, 4.0))
    times = np.linspace(0, 4, 161)
    for label, mu, colour in (("nonholonomic", None, BLUE), ("vakonomic, μ(0) = 0", np.zeros(6), ORANGE)):
        _paths(ax, solve(system, q, v, times, mu, tol=1e-8), label, colour)
    _from_above(ax, "three discs, own headings, t = 0, 2, 4")
    ax.legend(fontsize=8, loc="upper right")


def _paths(ax: Axes, run: Trajectory, label: str, colour: str) -> None:
    """Paths of the discs, (x, y) of all of them first in q, and the chain at the first, middle and last frame."""
    x, y = run.q[:, :3], run.q[:, 3:6]
    ax.plot(x, y, color=colour, linewidth=0.8)
    for f in (0, len(run.t) // 2, -1):
        ax.plot(x[f], y[f], "o-", color=colour, linewidth=2, markersize=5, alpha=1 if f else 0.5, label=label if f < 0 else None)


def _from_above(ax: Axes, title: str) -> None:
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel(LABEL["x"])
    ax.set_ylabel(LABEL["y"])
    ax.set_title(title, fontsize="medium")
    ax.grid(alpha=0.3)
