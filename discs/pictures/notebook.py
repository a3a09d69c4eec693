"""Movies and sliders for notebooks. Both leave a picture where a notebook is only read, as on a page of the site."""

import base64
import html
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from matplotlib.animation import Animation
from matplotlib.figure import Figure

from discs import checks
from discs.pictures.animation import animate
from discs.solution import Result

# it plays by itself unless the reader's system asks for less motion
PLAYS = "if(!matchMedia('(prefers-reduced-motion: reduce)').matches)this.play()"


@dataclass(frozen=True)
class Film:
    """A movie that a notebook shows as the last line of a cell: H.264 within the page, with a caption below.

    Attributes
    ----------
    data : the movie, .mp4.
    caption : words.
    """

    data: bytes
    caption: str

    def _repr_html_(self) -> str:
        source = base64.b64encode(self.data).decode("ascii")
        return (
            f'<figure style="margin:0"><video controls loop muted playsinline style="max-width:100%" onloadeddata="{PLAYS}" '
            f'src="data:video/mp4;base64,{source}"></video><figcaption>{html.escape(self.caption)}</figcaption></figure>'
        )

    def __repr__(self) -> str:
        return f"Film({len(self.data) / 1000:.0f} kB, {self.caption!r})"


def film(shown: Result | Animation, caption: str, fps: int = 20, **style: Any) -> Film:
    """A movie of a run, or of an animation of matplotlib, for a notebook.

    Parameters
    ----------
    shown : a run, drawn as by `run.animate`, or an animation; the figure of an animation is closed.
    caption : what is to be seen.
    fps : pictures per second.
    style : of a run, as for `run.animate`; size is (512, 288) pixels if it is not given.

    Raises
    ------
    ValueError : for a style of an animation, which is drawn already, or a number outside its range.
    """
    fps = checks.whole("fps", fps, 1)
    if style and isinstance(shown, Animation):
        raise ValueError(f"an animation is drawn already, so it takes no style; got {', '.join(style)}")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        if isinstance(shown, Animation):
            _write(shown, path, fps)
        else:
            animate(shown, path, fps, progress=False, **({"size": (512, 288)} | style))
        return Film(path.read_bytes(), caption)


def _write(animation: Animation, path: Path, fps: int) -> None:
    import imageio_ffmpeg  # its import searches for the program ffmpeg
    from matplotlib import pyplot, rc_context

    figure: Figure = animation._fig  # type: ignore[attr-defined]
    animation._init_draw()  # type: ignore[attr-defined]  # the first picture, with its title
    if engine := figure.get_layout_engine():  # once, as it takes longer than a picture
        engine.execute(figure)
        figure.set_layout_engine("none")
    with rc_context({"animation.ffmpeg_path": imageio_ffmpeg.get_ffmpeg_exe()}):
        animation.save(path, "ffmpeg", fps)
    pyplot.close(figure)  # a notebook would show it once more


def slide(draw: Callable[..., Figure], **numbers: tuple[float, float, float, float]) -> None:
    """Show a figure, with a slider for each of its numbers where the notebook has ipywidgets.

    Parameters
    ----------
    draw : called with the numbers by name; returns a figure, which is closed.
    numbers : for each name where it starts, its least and largest value, and the step of the slider.

    Raises
    ------
    ValueError : for a start outside the range, or a step that is not positive.
    """
    from IPython.display import display
    from matplotlib import pyplot

    for name, (start, least, most, step) in numbers.items():
        if not (least <= start <= most and step > 0):
            raise ValueError(
                f"{name} must be (start, least, largest, step) with least <= start <= largest and step > 0; "
                f"got {(start, least, most, step)}"
            )

    def drawn(values: dict[str, float]) -> Figure:
        figure = draw(**values)
        pyplot.close(figure)
        return figure

    shown = display(drawn({name: start for name, (start, *_) in numbers.items()}), display_id=True)
    try:
        import ipywidgets
    except ImportError:
        return
    sliders = {
        name: ipywidgets.FloatSlider(start, min=least, max=most, step=step, description=name, continuous_update=False)
        for name, (start, least, most, step) in numbers.items()
    }

    def change(_: Any) -> None:
        shown.update(drawn({name: slider.value for name, slider in sliders.items()}))

    for slider in sliders.values():
        slider.observe(change, "value")
    display(*sliders.values())
