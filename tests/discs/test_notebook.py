"""Movies and sliders of notebooks."""

import base64
import re
import sys
from types import SimpleNamespace

import IPython.display
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.animation import FuncAnimation
from matplotlib.figure import Figure

from discs import simulate
from discs.pictures.notebook import film, slide
from tests.conftest import Model, uneven

RUN = simulate(uneven(5, Model("springs", "field")), dt=0.05, frames=3, progress=False, engine="plain")


def test_a_movie_is_in_the_page_with_its_caption():
    shown = film(RUN, "5 discs & a rod", size=(320, 180))
    page = shown._repr_html_()
    movie = re.search(r'src="data:video/mp4;base64,([^"]+)"', page)
    assert base64.b64decode(movie[1]) == shown.data
    assert shown.data[4:8] == b"ftyp"
    assert "<figcaption>5 discs &amp; a rod</figcaption>" in page


def test_a_movie_of_an_animation_closes_its_figure():
    figure, ax = plt.subplots(figsize=(2, 1))
    (line,) = ax.plot([], [])
    shown = film(FuncAnimation(figure, lambda i: line.set_data([0, 1], [0, i]), frames=3), "a line")
    assert shown.data[4:8] == b"ftyp"
    assert not plt.fignum_exists(figure.number)


def test_a_movie_of_an_animation_has_no_style():
    animation = FuncAnimation(Figure(), print, frames=1)
    animation._draw_was_started = True  # otherwise matplotlib warns of an animation that is never drawn
    with pytest.raises(ValueError, match="drawn already, so it takes no style; got radius"):
        film(animation, "", radius=1.0)


@pytest.fixture
def slider(monkeypatch):
    """What was shown, and a slider that stands for those of ipywidgets."""
    seen = SimpleNamespace(figures=[], change=None, value=None, settings=None)

    def display(*things, display_id=None):
        seen.figures += [thing for thing in things if isinstance(thing, Figure)]
        return SimpleNamespace(update=seen.figures.append)

    class Slider(SimpleNamespace):
        def __init__(self, value, **settings):
            super().__init__(value=value)
            seen.slider, seen.settings = self, settings

        def observe(self, change, name):
            seen.change = change

    monkeypatch.setattr(IPython.display, "display", display)
    monkeypatch.setitem(sys.modules, "ipywidgets", SimpleNamespace(FloatSlider=Slider))
    return seen


def line_of(slope):
    figure, ax = plt.subplots()
    ax.plot([0, 1], [0, slope])
    return figure


def test_a_slider_draws_again(slider):
    slide(line_of, slope=(1.0, 0.0, 2.0, 0.5))
    assert (slider.settings["min"], slider.settings["max"]) == (0.0, 2.0)
    slider.slider.value = 1.5
    slider.change(None)
    heights = [figure.axes[0].lines[0].get_ydata()[1] for figure in slider.figures]
    assert np.allclose(heights, [1.0, 1.5])
    assert not plt.get_fignums()


def test_without_widgets_there_is_a_picture(slider, monkeypatch):
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    slide(line_of, slope=(1.0, 0.0, 2.0, 0.5))
    assert len(slider.figures) == 1
    assert slider.change is None


@pytest.mark.parametrize("numbers", [(3.0, 0.0, 2.0, 0.5), (1.0, 0.0, 2.0, 0.0), (float("nan"), 0.0, 2.0, 0.5)])
def test_a_slider_starts_within_its_range(numbers):
    with pytest.raises(ValueError, match=r"slope must be \(start, least, largest, step\) with least <= start <= largest"):
        slide(line_of, slope=numbers)
