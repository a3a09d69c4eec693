"""Pictures of the discs. Every function returns its figure; nothing opens a window."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from discs.chain import SteeredChain
from discs.problem import Problem, State
from discs.vakonomic import Motion, of_chain, rolling_disc, solve

# Okabe and Ito's colours, distinct for colour-blind readers
BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#666666"


def vakonomic() -> Figure:
    """Vakonomic motions beside the nonholonomic one: a disc on an incline, how the two part, a chain of three discs."""
    figure = Figure(figsize=(14.0, 4.9), layout="constrained")
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
        "μ(0) = 0": (np.zeros(2), ORANGE),
        "μ(0) = −m ṙ": (-m * v[:2], GREEN),
        "μ(0) = −m ṙ + 0.1 d₁": (-m * v[:2] + 0.1 * np.array([np.cos(phi), np.sin(phi)]), PURPLE),
    }
    long, short = np.linspace(0, 10, 401), np.array([0.0, *np.geomspace(0.01, 3, 40)])
    own = solve(disc, q, v, short, tol=1e-13)
    above.plot(*solve(disc, q, v, long).q[:, :2].T, color=BLUE, linewidth=2, label="nonholonomic")
    for label, (mu, colour) in charges.items():
        above.plot(*solve(disc, q, v, long, mu, tol=1e-8).q[:, :2].T, color=colour, label=label)
        gap = np.abs(solve(disc, q, v, short, mu, tol=1e-13).q[1:, 3] - own.q[1:, 3])
        parted.loglog(short[1:], gap, color=colour, label=label)
    for power, level in ((2, 0.04), (3, 0.04), (4, 0.02)):
        t = np.array([0.015, 0.06])
        parted.loglog(t, level * t**power, color=GREY, linewidth=1)
        parted.text(t[-1] * 1.1, level * t[-1] ** power, f"t{'²³⁴'[power - 2]}", color=GREY, va="center")
    above.plot(0, 0, "o", color="black", markersize=5)
    above.annotate("down", (0.06, 0.06), (0.06, 0.2), xycoords="axes fraction", arrowprops={"arrowstyle": "->"}, ha="center")
    _from_above(above, "one disc on an incline")
    above.legend(fontsize=8, loc="center right")
    parted.set_xlabel("time t")
    parted.set_ylabel("|φ vakonomic − φ nonholonomic|  (rad)")
    parted.set_title("they part")
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


def _paths(ax: Axes, run: Motion, label: str, colour: str) -> None:
    """Paths of the discs, (x, y) of all of them first in q, and the chain at the first, middle and last frame."""
    x, y = run.q[:, :3], run.q[:, 3:6]
    ax.plot(x, y, color=colour, linewidth=0.8)
    for f in (0, len(run.t) // 2, -1):
        ax.plot(x[f], y[f], "o-", color=colour, linewidth=2, markersize=5, alpha=1 if f else 0.5, label=label if f < 0 else None)


def _from_above(ax: Axes, title: str) -> None:
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("x")
    ax.set_ylabel("y")
    ax.set_title(title)
    ax.grid(alpha=0.3)
