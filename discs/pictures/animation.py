"""Movies of the discs on the plane, with spokes that show the roll, the rod through their centres, and their tracks.

The view is a parallel projection along c = (cos e cos a, cos e sin a, sin e), with azimuth a and elevation e: a point p is drawn at
(p . u, p . v), u = (-sin a, cos a, 0), v = c x u. Points with a larger p . c are nearer and drawn later. Everything that moves
above the ground is one sorted collection, and the ground is drawn once, so a frame takes some hundredths of a second.
"""

import os
from collections.abc import Iterator
from contextlib import closing
from itertools import chain
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from tqdm import tqdm

from discs import checks
from discs.arrays import Array, Float
from discs.pictures import geometry
from discs.pictures.style import BLUE, GREY, GROUND, INK, ORANGE, PALE
from discs.solution import Result, Solution

KINDS = (".mp4", ".gif")
ROUND = np.linspace(0, 2 * np.pi, 33)
SPOKES = np.arange(4) * np.pi / 2


def animate(
    run: Result,
    path: str | Path,
    fps: float = 25,
    progress: bool = True,
    radius: float | None = None,
    discs: int = 33,
    azimuth: float = -58.0,
    elevation: float = 28.0,
    size: tuple[int, int] | None = None,
) -> Path:
    """Write a movie, one picture for each frame of the run.

    Parameters
    ----------
    path : file to write: .mp4 (H.264, by the ffmpeg of imageio-ffmpeg) or .gif (by Pillow).
    fps : pictures per second.
    progress : show a progress bar after one second.
    radius : of the drawn discs, length. None takes an eighteenth of the rod, of few discs more; the movie shows the value. The
        spokes turn by the true theta, so a disc that is drawn too small appears to slide.
    discs : approximate number of discs drawn with their tracks; all, if there are fewer than twice as many. The rod is drawn whole.
    azimuth, elevation : direction of view, degrees.
    size : width and height in pixels, even; by default 1280 x 720, or 800 x 450 for a .gif.

    Returns
    -------
    The path.

    Raises
    ------
    ValueError : for another kind of file, a folder that does not exist, or a number outside its range.
    """
    path = Path(path)
    kind = checks.choice("the movie's ending", path.suffix.lower(), KINDS)
    if not path.parent.is_dir():
        raise ValueError(f"path must be in a folder that exists; got {str(path)!r}")
    fps = checks.number("fps", fps, positive=True)
    if size is None:
        size = (1280, 720) if kind == ".mp4" else (800, 450)
    stage = Stage(run.discs, radius, discs, azimuth, elevation, size)
    shown = tqdm(range(run.t.size), desc=path.name, unit="picture", delay=1, disable=not progress)
    partial = path.with_name(f".partial-{path.name}")
    try:
        (_write_mp4 if kind == ".mp4" else _write_gif)(partial, (stage.picture(f) for f in shown), fps, stage.size)
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
    return path


def _write_mp4(path: Path, pictures: Iterator[Array], fps: float, size: tuple[int, int]) -> None:
    import imageio_ffmpeg  # its import searches for the program ffmpeg

    with closing(imageio_ffmpeg.write_frames(str(path), size, "rgba", fps=fps, quality=8, macro_block_size=2)) as writer:
        writer.send(None)
        for picture in pictures:
            writer.send(picture)


def _write_gif(path: Path, pictures: Iterator[Array], fps: float, size: tuple[int, int]) -> None:
    from PIL import Image

    palette = Image.fromarray(begin := next(pictures)).convert("RGB").quantize(64)
    # one palette for all pictures, so that white is the same in each
    every = (
        Image.fromarray(p).convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE) for p in chain([begin], pictures)
    )
    next(every).save(path, save_all=True, append_images=every, duration=round(1000 / fps), loop=0)


class Stage:
    """A view of a run that draws single frames; parameters as of `animate`."""

    def __init__(
        self,
        run: Solution,
        radius: float | None = None,
        discs: int = 33,
        azimuth: float = -58.0,
        elevation: float = 28.0,
        size: tuple[int, int] = (1280, 720),
    ) -> None:
        self.run, self.radius = run, geometry.drawn_radius(run, radius)
        self.shown = geometry.picked(run.s, checks.whole("discs", discs, 1))
        self.size = (checks.whole("width", size[0], 16), checks.whole("height", size[1], 16))
        if self.size[0] % 2 or self.size[1] % 2:
            raise ValueError(f"size must be even numbers of pixels, as video formats require; got {size}")
        a, e = np.radians([checks.number("azimuth", azimuth), checks.number("elevation", elevation)])
        self._toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        self._screen = np.array([[-np.sin(a), np.cos(a), 0.0], [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]])
        self._forward = geometry.turn(geometry.axles(run))
        self._line = np.arange(run.s.size + geometry.is_ring(run)) % run.s.size
        contacts = np.stack([run.x[:, self.shown], run.y[:, self.shown], np.zeros((run.t.size, self.shown.size))], axis=-1)
        self._tracks = self._flat(contacts).swapaxes(0, 1)
        self._set_up()

    def _flat(self, points: Float) -> Float:
        """Screen coordinates (..., 2) of points (..., 3)."""
        return np.asarray(points @ self._screen.T)

    def _set_up(self) -> None:
        scale = self.size[0] / 1280
        figure = Figure(figsize=(self.size[0] / 100, self.size[1] / 100), dpi=100, layout="none")  # type: ignore[arg-type]  # whatever matplotlibrc says
        self._canvas = FigureCanvasAgg(figure)
        ax = figure.add_axes((0, 0, 1, 1))
        ax.set_axis_off()
        run, margin = self.run, 1.6 * self.radius
        low = np.array([run.x.min(), run.y.min()]) - margin
        high = np.array([run.x.max(), run.y.max()]) + margin
        box = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (0, 2 * self.radius)])
        seen = self._flat(box)
        middle, reach = (seen.min(axis=0) + seen.max(axis=0)) / 2, np.ptp(seen, axis=0) / 2
        half = max(reach[0] / self.size[0], 1.06 * reach[1] / self.size[1]) * np.array(self.size)
        ax.set_xlim(middle[0] - half[0], middle[0] + half[0])
        ax.set_ylim(middle[1] - half[1], middle[1] + half[1])
        ax.add_collection(self._ground(low, high, scale), autolim=False)
        note = f"radius drawn {self.radius:.3g}"
        ax.text(0.98, 0.03, note, ha="right", fontsize=12 * max(scale, 0.7), color=GREY, transform=ax.transAxes)
        self._tracked = LineCollection([], colors=GREY, linewidths=0.8 * scale, alpha=0.6, animated=True)
        self._shadows = LineCollection([], colors=INK, linewidths=2.5 * scale, alpha=0.25, animated=True)
        self._things = PolyCollection([], animated=True, joinstyle="round", capstyle="round")
        self._time = ax.text(0.03, 0.92, "", fontsize=20 * max(scale, 0.7), color=INK, transform=ax.transAxes, animated=True)
        self._scale, self._ax = scale, ax
        self._parts = (self._tracked, self._shadows, self._things, self._time)
        for part in self._parts[:3]:
            ax.add_collection(part, autolim=False)
        self._canvas.draw()
        self._behind = self._canvas.copy_from_bbox(figure.bbox)

    def _ground(self, low: Float, high: Float, scale: float) -> LineCollection:
        """Grid lines of the plane, with a round spacing."""
        power = 10 ** np.floor(np.log10(np.max(high - low) / 8))
        step = next(m * power for m in (1, 2, 5, 10) if m * power >= np.max(high - low) / 12)
        low, high = np.floor(low / step) * step, np.ceil(high / step) * step
        xs, ys = (np.arange(a, b + step / 2, step) for a, b in zip(low, high, strict=True))
        lines = [[(x, ys[0], 0), (x, ys[-1], 0)] for x in xs] + [[(xs[0], y, 0), (xs[-1], y, 0)] for y in ys]
        return LineCollection(list(self._flat(np.array(lines))), colors=GROUND, linewidths=1.2 * scale)

    def picture(self, f: int) -> Array:
        """Frame f of the run, counted from the end if negative; (height, width, 4) bytes, red, green, blue and opacity."""
        f = range(self.run.t.size)[f]
        self._tracked.set_segments(list(self._tracks[:, : f + 1]))
        self._time.set_text(f"t = {self.run.t[f]:.2f}")
        self._place(f)
        self._canvas.restore_region(self._behind)
        for part in self._parts:
            self._ax.draw_artist(part)
        return np.array(self._canvas.buffer_rgba())

    def _place(self, f: int) -> None:
        """Discs with spokes, and the rod between them, from the farthest to the nearest."""
        run, radius = self.run, self.radius
        r = np.stack([run.x[f], run.y[f], np.full(run.s.size, radius)], axis=-1)
        forward = np.append(self._forward[f].T, np.zeros((run.s.size, 1)), axis=1)[self.shown]

        def rim(angle: Float) -> Float:
            """Points of the discs' rims, (discs, angles, 3), by the angle from above towards where they roll."""
            up = np.array([0, 0, 1.0])
            around: Float = np.sin(angle)[..., None] * forward[:, None] + np.cos(angle)[..., None] * up
            return r[self.shown, None] + radius * around

        at = r[self.shown]
        tips = rim(run.theta[f, self.shown, None] + SPOKES)
        hub = np.broadcast_to(at[:, None], (len(at), 3, 3))
        cross = np.stack([hub, tips[:, 1:]], axis=2).reshape(len(at), 6, 3)  # out and back, three times
        mark = np.stack([at, tips[:, 0]], axis=1)
        rod = np.stack([r[self._line[:-1]], r[self._line[1:]]], axis=1)
        # parts of one disc are drawn in this order: later ones count as slightly nearer
        parts = [(rim(ROUND), at), (cross, at + 1e-9 * self._toward), (mark, at + 2e-9 * self._toward), (rod, rod.mean(axis=1))]
        order = np.argsort(np.concatenate([places @ self._toward for _, places in parts]), kind="stable")
        flat = [outline for points, _ in parts for outline in self._flat(points)]
        kind = np.repeat(np.arange(len(parts)), [len(points) for points, _ in parts])[order]
        self._things.set_verts([flat[i] for i in order], closed=False)
        self._things.set(
            facecolor=to_rgba_array([(PALE, 0.75), "none", "none", "none"])[kind],
            edgecolor=to_rgba_array([BLUE, INK, ORANGE, BLUE])[kind],
            linewidth=self._scale * np.array([1.4, 0.8, 3.0, 3.5])[kind],
        )
        ground = at * [1, 1, 0]
        self._shadows.set_segments(list(self._flat(np.stack([ground - radius * forward, ground + radius * forward], axis=1))))
