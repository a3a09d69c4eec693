"""What a run returns."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from discs.problem import Problem

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

    from discs.view import View


@dataclass(frozen=True, eq=False)
class Solution:
    """A motion at F frames of N discs (or of a field on N nodes). Time is the first axis, discs are the last.

    Attributes
    ----------
    t : (F,), times of the frames.
    s : (N,), places along the rod, length.
    x, y : (F, N), contact points, length.
    theta : (F, N), roll angles, rad.
    omega : (F, N), rates of roll, rad per time.
    energy : (F,), kinetic and potential energy.
    rolling_residual : (F,), largest |r. - e omega| over the discs, length per time, of the method's own velocities: zero up to
        rounding. (Methods in (q, pi) form r. from e omega; that their steps roll is |r_{n+1} - r_n - e (theta_{n+1} - theta_n)| = 0
        with e at the midpoint.) None for an extrapolated field.
    stats : what was done: method, order, dt and where it came from, steps, work, seconds.
    phi : (F, N), own headings, rad; only of discs that have them.
    x_rate, y_rate : (F, N), velocities of the contact points, length per time; want "velocity".
    phi_rate : (F, N), rates of turning, rad per time; want "velocity", own headings.
    slope_x, slope_y : (F, N), headings r', no unit; want "slope".
    contact_force : (F, 2, N), force (x, y) of the ground that keeps each disc rolling, the multiplier lambda, mass times length
        per time squared; want "contact_force".
    tension : (F, n_links), the multiplier p in the links of a free rod, force; of `continuum.free_rod`.
    modified_energy : (F,), the invariant of "leapfrog" at the last step before a frame; want "modified_energy".
    problem : what was computed, for discs; for a field of "richardson" that on the finest mesh, otherwise None.
    error_estimate : for a field, {"x", "y", "theta", "omega"} -> estimated largest error over nodes and frames.
    """

    t: NDArray
    s: NDArray
    x: NDArray
    y: NDArray
    theta: NDArray
    omega: NDArray
    energy: NDArray
    rolling_residual: NDArray | None = None
    stats: dict[str, Any] = field(default_factory=dict)
    phi: NDArray | None = None
    x_rate: NDArray | None = None
    phi_rate: NDArray | None = None
    y_rate: NDArray | None = None
    slope_x: NDArray | None = None
    slope_y: NDArray | None = None
    contact_force: NDArray | None = None
    tension: NDArray | None = None
    modified_energy: NDArray | None = None
    error_estimate: dict[str, float] | None = None
    problem: Problem | None = None

    def __repr__(self) -> str:
        frames, n = self.x.shape
        drift = np.abs(self.energy - self.energy[0]).max()
        return (
            f"Solution({frames} frames of {n} discs, t = {self.t[0]:g} to {self.t[-1]:g}, "
            f"method {self.stats.get('method')!r}, energy {self.energy[0]:.6g} to within {drift:.1e})"
        )

    def plot(self, *panels: str, ax: Any = None) -> "list[Axes]":
        """A first look at the run: all panels, or those named; see `discs.figures.first_look`."""
        from discs import figures  # pictures are imported when one is wanted

        return figures.first_look(self, panels, ax)

    def plot_motion(self, ax: "Axes | None" = None, **style: Any) -> "Axes":
        """The centre line and the discs from above at several times; see `discs.figures.motion`."""
        from discs import figures

        return figures.motion(self, ax, **style)

    def animate(self, path: str | Path, fps: float = 25, progress: bool = True, **style: Any) -> Path:
        """A movie, .mp4 or .gif, of the discs as they roll, one picture a frame; see `discs.animation.animate`."""
        from discs.animation import animate

        return animate(self, path, fps, progress, **style)

    def view(self, path: str | Path | None = None, beside: "Solution | None" = None, **style: Any) -> "View":
        """A page to turn and play the run in three dimensions, alone or beside another; see `discs.view.view`."""
        from discs.view import view

        return view(self, path, beside, **style)

    def save(self, path: str | Path) -> None:
        """Write the run to a NetCDF-4 file, read again by `discs.load`; see docs/archives.md."""
        from discs import archive

        archive.save(self, path)

    def to_xarray(self) -> "xarray.Dataset":
        """The run as a dataset with dimensions (time, disc), units and names."""
        from discs import archive

        return archive.to_xarray(self)
