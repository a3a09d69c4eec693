"""The result of a run: frames of the motion, and the statistics of the run.

Its methods for pictures and files import `discs.pictures` and `discs.files` when they are called, as these import this module.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from discs import checks
from discs.arrays import Float, Int
from discs.energy_by_kind import energy_by_kind
from discs.problem import Problem, State
from discs.stats import Stats, doubts

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

    from discs.pictures.view import View


class Result:
    """Pictures and files of a result: a run, or the motion of a mechanical system.

    t : (F,), times of the frames.
    """

    t: Float

    @property
    def discs(self) -> "Solution":
        """The motion of its discs, which movies and pages show."""
        raise NotImplementedError

    def plot(self, *panels: str, ax: "Axes | Iterable[Axes] | None" = None) -> "list[Axes]":
        """Plot standard `panels`, all or those named, in new axes or in `ax`; see `discs.pictures.figures.first_look`."""
        from discs.pictures import figures

        return figures.first_look(self, panels, ax)

    def animate(self, path: str | Path, fps: float = 25, progress: bool = True, **style: Any) -> Path:
        """Write a movie of the rolling discs, .mp4 or .gif, one picture per frame; see `discs.pictures.animation.animate`."""
        from discs.pictures.animation import animate

        return animate(self, path, fps, progress, **style)

    def view(self, path: str | Path | None = None, beside: "Result | None" = None, **style: Any) -> "View":
        """An interactive page with the run in three dimensions, alone or beside another; see `discs.pictures.view.view`."""
        from discs.pictures.view import view

        return view(self, path, beside, **style)

    def _repr_html_(self) -> str:
        """A small picture and a table, which notebooks show."""
        from discs.pictures import summary

        return summary.as_html(self)

    def save(self, path: str | Path) -> None:
        """Write it to a file of the kind that its name says; see docs/archives.md.

        .nc (.nc4, .h5, .hdf5): all of it, for `discs.load` and xarray. .csv: a table, a row for each frame and disc. .glb: moving
        discs for Blender and web pages (needs trimesh). .vtkhdf: moving discs for ParaView.

        Raises
        ------
        ValueError : for another ending; if no file can be made there.
        """
        from discs.files import exports

        exports.save(self, path)

    def to_dataframe(self) -> "pandas.DataFrame":
        """A pandas table, a row for each frame and disc (of a mechanical system for each frame); units in `.attrs["units"]`.

        What has one value a frame, as the energy, is repeated for each disc.
        """
        from discs.files import exports

        return exports.to_dataframe(self)

    def to_xarray(self) -> "xarray.Dataset":
        """An xarray dataset with dimensions (time, disc) or (time, coordinate), units and long names."""
        from discs.files import archive

        return archive.to_xarray(self)


class Occurrence(NamedTuple):
    """An event of a run. event : its number among those given. name : in words. t : time. state : of the discs."""

    event: int
    name: str
    t: float
    state: State


@dataclass(frozen=True, eq=False)
class Solution(Result):
    """A motion at F frames of N discs (or of a field on N nodes). Time is the first axis, discs are the last.

    `run[10:20]`, `run[::5]` and `run[run.t > 2]` are the same run at fewer frames. `run.state(frame)` is a state to start another
    run from.

    Attributes
    ----------
    t : (F,), times of the frames.
    s : (N,), places along the rod, length.
    x, y : (F, N), contact points, length.
    theta : (F, N), roll angles, rad.
    omega : (F, N), rates of roll, rad per time.
    energy : (F,), kinetic and potential energy; potentials of loads are part of it.
    rolling_residual : (F,), largest |r. - e omega| over the discs, length per time, of the method's own velocities: zero up to
        rounding. (Methods in (q, pi) compute r. as e omega. Their steps roll if |r_{n+1} - r_n - e (theta_{n+1} - theta_n)| = 0
        with e at the midpoint.) None for an extrapolated field.
    stats : method, order, dt, steps, work, seconds and more; see `discs.stats.Stats`.
    phi, phi_rate : (F, N), own headings, rad, and their rates, rad per time; only of discs that have them.
    x_rate, y_rate : (F, N), velocities of the contact points, length per time; want "velocity".
    slope_x, slope_y : (F, N), headings r', no unit; want "slope".
    contact_force : (F, 2, N), force (x, y) of the ground that keeps each disc rolling, the multiplier lambda, mass times length
        per time squared; want "contact_force". Of a field the force per length, without what acts at its ends.
    contact_moments : (F, 2, 5), of a field, the ground's force against test functions, what acts at the ends included: the
        integrals of lambda cos(k pi s/length), k = 0 ... 4; for a closed rod see `continuum.wants.smooth_tests`.
    end_force, end_couple : (F, 2, 2), [frame, end, component], force and couple of the ground at the two free ends of a field; the
        couple is the first moment of the force about the end. None of a closed rod; want "contact_force".
    energy_density, energy_flux : (F, N), of a field, energy per length and energy per time towards larger s; want these names.
    tension : (F, n_links), the multiplier p in the links of a free rod, force; of `continuum.free_rod`.
    work, dissipated : (F,), work of loads that are not part of the energy, and energy that dampers took, both since the start:
        energy - energy[0] = work - dissipated, to rounding for "midpoint", its compositions and the Gauss methods if V is
        quadratic, otherwise to the order of the method. Zeros without loads.
    balance : (F, 2), work and dissipated, as recorded; None if all loads are part of the energy.
    work_by_load, dissipated_by_load : (F, L), the same of each of `problem.loads`, in their order: their sums over loads are those
        of all, to rounding. Rest shapes that signals drive have an energy in common, which counts half for each. Want
        "work_by_load"; runs then take the plain engine.
    balance_by_load : (F, 2, L), both, as recorded.
    reaction : (F, motors), torque of each motor, about the axle or the vertical; None without motors.
    modified_energy : (F,), the invariant of "leapfrog" at the last step before a frame; want "modified_energy".
    events : what happened, in order of time, of simulate(..., events=...): event (its number), name, t and state. Files keep the
        names and times, in stats["events"].
    problem : the problem of discs; of a field by "richardson", the one on the finest mesh; otherwise None.
    error_estimate : estimated largest error over discs (or nodes) and frames, by quantity; None if it was not estimated.
    """

    t: Float
    s: Float
    x: Float
    y: Float
    theta: Float
    omega: Float
    energy: Float
    rolling_residual: Float | None = None
    stats: Stats = field(default_factory=Stats)
    phi: Float | None = None
    x_rate: Float | None = None
    phi_rate: Float | None = None
    y_rate: Float | None = None
    slope_x: Float | None = None
    slope_y: Float | None = None
    contact_force: Float | None = None
    contact_moments: Float | None = None
    end_force: Float | None = None
    end_couple: Float | None = None
    energy_density: Float | None = None
    energy_flux: Float | None = None
    tension: Float | None = None
    modified_energy: Float | None = None
    balance: Float | None = None
    balance_by_load: Float | None = None
    reaction: Float | None = None
    error_estimate: dict[str, float] | None = None
    problem: Problem | None = None
    events: tuple[Occurrence, ...] = ()

    @classmethod
    def of(cls, problem: Problem, s: Float, t: Float, stats: Stats, rows: Mapping[str, Float]) -> "Solution":
        """A run of a problem with the recorded `rows`: what else there is has its default, which the class holds.

        (A frozen dataclass sets each of its thirty attributes by a call, which takes a fifth of a short run.)
        """
        run = cls.__new__(cls)
        vars(run).update(rows, t=t, s=s, stats=stats, problem=problem)
        return run

    @property
    def discs(self) -> "Solution":
        """The run itself."""
        return self

    @property
    def energy_by_kind(self) -> dict[str, Float]:
        """The energy by kind, each (F,), computed from the frames: its sum is `energy`, to rounding.

        Kinetic: "translation", "rolling" and, for own headings, "turning". Springs: "bending", "torsion", and where the chain has
        them "stretch" and "shear". "loads": what loads add, in runs that have some. A rest twist or a rest curvature is a load: the
        springs' own energies are those of a straight rod at rest, and the difference is in "loads". (The rest stretch and shear,
        and the rest curvature of the true curvature, are in the energies of the springs.)

        Raises
        ------
        ValueError : for a field, a linkage, a run without its problem, and for own headings without phi_rate.
        """
        return energy_by_kind(self.problem, {f.name: getattr(self, f.name) for f in fields(self)})

    @property
    def work(self) -> Float:
        """Work of the loads that are not part of the energy, since the start, (F,)."""
        return np.zeros(self.t.size) if self.balance is None else self.balance[:, 0]

    @property
    def dissipated(self) -> Float:
        """Energy that dampers took since the start, (F,)."""
        return np.zeros(self.t.size) if self.balance is None else self.balance[:, 1]

    @property
    def work_by_load(self) -> Float:
        """The part of each load in `work`, (F, L). ValueError if it was not asked for."""
        return self._by_load(0)

    @property
    def dissipated_by_load(self) -> Float:
        """The part of each load in `dissipated`, (F, L). ValueError if it was not asked for."""
        return self._by_load(1)

    def _by_load(self, part: int) -> Float:
        if self.balance_by_load is not None:
            return self.balance_by_load[:, part]
        if self.balance is None and self.problem is not None:
            return np.zeros((self.t.size, len(self.problem.loads)))
        raise ValueError('this run did not book what each load does: take simulate(..., want=("work_by_load",))')

    def __repr__(self) -> str:
        frames, n = self.x.shape
        off = self.energy - self.work + self.dissipated
        drift = np.abs(off - off[0]).max()
        kept = "energy" if self.balance is None else "energy - work + dissipated"
        return (
            f"Solution({frames} frames of {n} discs, t = {self.t[0]:g} to {self.t[-1]:g}, "
            f"method {self.stats.get('method')!r}, {kept} = {off[0]:.6g}, constant to {drift:.1e}"
            f"{''.join(f'; {doubt}' for doubt in doubts(self.stats))})"
        )

    def __getitem__(self, frames: slice | Float | Int | Sequence[int]) -> "Solution":
        """The run at some of its frames, in order of time. They are given by a slice, a mask (F,) or frame numbers."""
        try:
            picked = np.arange(self.t.size)[frames]
        except (IndexError, TypeError, ValueError):
            picked = np.array(0)
        if picked.ndim != 1 or not picked.size or (np.diff(picked) <= 0).any():
            raise ValueError(
                f"frames of a run are picked by a slice, a mask or numbers of frames, at least one of the {self.t.size} and in "
                f"order of time; got {checks.shown(frames)}; of one frame take run[i : i + 1], or its state, run.state(i)"
            )
        whole = ("s", "stats", "error_estimate", "problem", "events")
        rows = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in whole}
        return replace(self, **{name: value[frames] for name, value in rows.items() if value is not None})

    __iter__ = None  # a run is no sequence of frames

    def state(self, frame: int = -1) -> State:
        """The state at a frame, from which another run can start.

        `replace(run.problem, initial=run.state(), duration=...)` continues from the last frame, for every chain; signals of loads
        begin at t = 0 again. The bits differ from those of one longer run, as frames do not hold the memory of a method;
        `simulate(checkpoint=)` continues to the same bits. For a field it is the state of the nodes.

        Parameters
        ----------
        frame : number of the frame, from the end if it is negative.

        Raises
        ------
        ValueError : if there is no such frame; for a free rod, whose velocities do not follow from rolling; and for own headings
            from an old archive without their rates.
        """
        frames = self.t.size
        if not -frames <= (i := checks.whole("frame", frame, -frames)) < frames:
            raise ValueError(f"frame must be one of the {frames} frames; got {frame}")
        if self.tension is not None:
            raise ValueError(
                "a free rod does not roll, and its state is more than a State: go on by free_rod with r0 = (x, y), "
                "v0 = (x_rate, y_rate), theta0 = theta and omega0 = omega of a frame"
            )
        if self.stats.get("linkage"):
            raise ValueError(
                "this is the run of a linkage, whose state is a LinkageState: take LinkageState(run.x[i], run.y[i], run.phi[i], "
                "run.theta[i], run.x_rate[i], run.y_rate[i], run.phi_rate[i])"
            )
        if self.phi is None:
            return State(self.x[i], self.y[i], self.theta[i], self.omega[i])
        if self.phi_rate is None:
            raise ValueError(
                "this run lacks phi_rate, the rates of its headings, as archives of an older version do where velocities were not "
                "asked for: no other run can start from it; compute it again"
            )
        return State(self.x[i], self.y[i], self.theta[i], self.omega[i], self.phi[i], self.phi_rate[i])

    def plot_motion(self, ax: "Axes | None" = None, **style: Any) -> "Axes":
        """Plot the centre line and the discs from above at several times, in new axes or in `ax`.

        `style` are the options of `discs.pictures.figures.motion`.
        """
        from discs.pictures import figures

        return figures.motion(self, ax, **style)
