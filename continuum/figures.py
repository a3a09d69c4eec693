"""Figures of the field: `python -m continuum.figures docs/images` draws both. No window is opened."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from continuum import exact
from continuum.balance import balances
from continuum.dispersion import frequency, growth
from continuum.mesh import semidiscretise
from continuum.rod import Rod, Scene
from continuum.scenes import rolling_rod, untwisting_rod
from discs import Midpoint, Suzuki4, simulate
from discs.arrays import Float
from discs.chains.rolling import ROLLING, stretching
from discs.pictures.style import GREY, INK, LABEL, LAW_COLOUR, SIGNED, SKY, UNSIGNED

FINE = Suzuki4(Midpoint(tolerance=1e-13))


def _sheet() -> Figure:
    return Figure(figsize=(6.8, 4.6), layout="constrained")


def measured_growth(rod: Rod, omega: float, rolling: str, n: int, modes: int, duration: float = 1.0) -> Float:
    """Growth rates (modes,) of waves 1, 2, ... of n discs that roll sideways at the rate omega, measured in one simulation.

    The initial state is the sum of all waves, small enough not to interact: growing waves for the field law, standing waves for the
    unit law. The size of a standing wave is that of amplitude and rate together, sqrt(|theta_m|^2 + |omega_m|^2/rate^2).
    """
    waves, grows = range(1, modes + 1), bool(stretching(ROLLING[rolling]))

    def initial(s: Float) -> tuple[Float, ...]:
        line = exact.rolling_line(rod, s, 0.0, omega)
        start = np.array(line)[:, 0]
        for mode in waves:
            size = 1e-9 / mode  # equal slopes
            if grows:
                wave = np.array(exact.growing_wave(rod, s, 0.0, omega, mode, size, n, rolling)) - line
            else:
                wave = np.array(exact.standing_wave(rod, s, 0.0, mode, size, closed=True, n=n)) - exact.rolling_line(
                    rod, s, 0.0, 0.0
                )
            start += wave[:, 0]
        return tuple(start)

    scene = replace(rolling_rod(rolling, duration=duration), rod=rod, initial=initial, shift=(rod.length, 0.0))
    run = simulate(semidiscretise(scene, n, "ring"), FINE, duration / 200, frames=2, progress=False)
    theta, rate = (np.abs(np.fft.rfft(values, axis=1)[:, 1 : modes + 1]) for values in (run.theta, run.omega))
    size: Float = theta
    if not grows:
        size = np.hypot(theta, rate / frequency(rod, 2 * np.pi * np.arange(1, modes + 1) / rod.length, rod.length / n))
    rates: Float = np.log(size[1] / size[0]) / duration
    return rates


def dispersion(rod: Rod, omega: float = 1.0, n: int = 32, modes: int = 12, ax: Axes | None = None) -> Axes:
    """Growth rate against wave number of the straight rolling rod: field and n discs, both laws, measured rates as points."""
    ax = _sheet().subplots() if ax is None else ax
    most = 2 * np.pi * (modes + 0.5) / rod.length
    q, k = np.linspace(1e-3, most, 400), rod.length / n
    at = 2 * np.pi * np.arange(1, modes + 1) / rod.length
    ax.plot(q, growth(rod, q, omega), color=LAW_COLOUR["field"], label="field law, field")
    ax.plot(q, growth(rod, q, omega, k=k), color=SKY, linestyle="--", label=f"field law, {n} discs")
    ax.plot(at, measured_growth(rod, omega, "field", n, modes), "o", color=SKY, markersize=5, label=f"measured, {n} discs")
    ax.plot(q, growth(rod, q, omega, "unit"), color=LAW_COLOUR["unit"], label="unit law, field and discs: 0")
    ax.plot(
        at, measured_growth(rod, omega, "unit", n, modes), "s", color=LAW_COLOUR["unit"], markersize=5, label=f"measured, {n} discs"
    )
    p = rod.uniform("dispersion")
    limit = omega * np.sqrt(p.torsion_stiffness / p.bending_stiffness)
    ax.axhline(limit, color=GREY, linewidth=1, linestyle=(0, (1, 2)))
    ax.text(most, 1.02 * limit, "ω₀√(β/K)", color=GREY, ha="right", va="bottom")
    ax.set_xlabel("wave number q (1/length)")
    ax.set_ylabel("growth rate σ (1/time)")
    ax.set_title(f"The straight rod rolling at ω₀ = {omega:g}")
    ax.set_ylim(-0.05 * limit, 1.15 * limit)
    ax.legend(fontsize=8, loc="lower center", bbox_to_anchor=(0.45, 0.08))
    ax.grid(alpha=0.3)
    return ax


def fluxes(scene: Scene, n: int = 513, frames: int = 451) -> Figure:
    """Density and flux of energy over s and t, from n discs."""
    run = simulate(semidiscretise(scene, n, "consistent"), "suzuki4", frames=frames, progress=False)
    law = balances(scene.rod, run, scene.rolling, scene.closed, scene.shift)["energy"]
    figure = Figure(figsize=(9.6, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    parts = (
        (left, law.density, "density of energy T + V (energy/length)", UNSIGNED, "max"),
        (right, law.flux, "flux of energy towards larger s (energy/time)", SIGNED, "both"),
    )
    for ax, values, name, stops, beyond in parts:
        high = np.quantile(np.abs(values), 0.995)
        colours = LinearSegmentedColormap.from_list(name, stops)
        image = ax.pcolormesh(run.s, run.t, values, cmap=colours, vmin=-high if beyond == "both" else 0, vmax=high, rasterized=True)
        ax.contour(run.s, run.t, values, levels=np.linspace(-high, high, 13), colors=INK, linewidths=0.4)
        figure.colorbar(image, ax=ax, extend=beyond).set_label(name)
        ax.set_xlabel(LABEL["s"])
    left.set_ylabel(LABEL["t"])
    figure.suptitle(f"{scene.name}, {scene.law}", fontsize=10)
    return figure


def main(folder: str) -> None:
    """Draw both pictures of docs/continuum.md."""
    path = Path(folder)
    fluxes(untwisting_rod()).savefig(path / "fluxes.png", dpi=150)
    waves = _sheet()
    dispersion(untwisting_rod().rod, ax=waves.subplots())
    waves.savefig(path / "dispersion.png", dpi=150)


if __name__ == "__main__":
    main(*sys.argv[1:])
