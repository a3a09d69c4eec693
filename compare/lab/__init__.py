"""The lab: discs that move as one watches, and that can be pulled, kicked and held, beside the field.

Modules, from the inside out:

* `settings`: what a page can choose, and the scene, the problem, the program and the file that follow;
* `session`: one live simulation. It takes messages, {"kind": ...}, and gives replies: objects and, of frames, 32-bit floats.
  It knows no network, and is tested without a browser. `messages` is the schema of what it takes; `history` the frames that are
  kept; `hand` what pulls and holds discs; `beside` the field, computed by another process; `engine` the kernels, read by a thread;
  `drawing` what is drawn;
* `server`: pages of a browser, on 127.0.0.1, by tornado. `widget`: the same in a notebook, by anywidget. Both pass messages on.
* `data`: the page, one ES module for both, made of three.js, of the drawing code of `run.view` and of `lab.js`.

The page sets the pace: it asks for the next frame when the last one is drawn, "advance" with the time that has passed. So nothing
runs while no page asks, a slow page or machine slows the motion down instead of falling behind, and a session needs neither clock
nor thread. A session steps for at most 0.04 s a message (and the page says that it is slower than real time).

Nothing that a page sends is executed or used as a name of a file: numbers in ranges, and words out of lists.
"""

from typing import TYPE_CHECKING

from compare.lab.settings import Settings
from continuum import Scene

if TYPE_CHECKING:
    from compare.lab.widget import LabWidget


def lab(scene: Scene | None = None, n: int = 32) -> "LabWidget":
    """The lab in a notebook: discs to watch, pull, kick and hold, with sliders for their parameters, and the field beside them.

    `python -m compare lab` opens the same in a browser.

    Parameters
    ----------
    scene : a scene of your own to begin with; None for the paper's untwisting rod. Its parameters that are numbers have sliders.
    n : number of discs at first.

    Returns
    -------
    A widget, which a notebook shows as the last line of a cell; its `run` is the run so far, a `discs.Solution`.

    Raises
    ------
    ValueError : for something else than a scene, for a scene with a `Custom` load, and for a number of discs that the chain cannot
        have. ImportError without anywidget: pip install "rolling-discs[lab]".
    """
    settings = Settings.of(scene, n)
    from compare.lab.widget import LabWidget

    return LabWidget(settings)
