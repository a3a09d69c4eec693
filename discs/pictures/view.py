"""An interactive page that shows runs in three dimensions: one file without network access, for a browser or a notebook.

The page contains three.js, the frames as base64 of 32-bit floats, little-endian, frame after frame, and a script; see
`discs/pictures/data`. Between frames positions and angles are interpolated linearly in time. If frames are too far apart for this
(`geometry.off_between_frames`), frames are shown one by one, and the page says so.

Data cannot become code: every "<" in them is escaped, and a content security policy allows only the page's two scripts, given by
their hashes, and no loading. The page is ASCII, so the hashes are right in every encoding that a browser may assume.
"""

import base64
import hashlib
import html
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.pictures import geometry
from discs.pictures.style import BLUE, INK, LABEL, ORANGE, UNSIGNED
from discs.solution import Result, Solution

SAND = "#e8d59a"  # the middle of the scale of signed values: no white, which would look as if it had no colour


@dataclass(frozen=True, eq=False)
class View:
    """An HTML page; a notebook shows it as the last line of a cell.

    Attributes
    ----------
    page : the whole page, HTML.
    path : where it was written, or None.
    """

    page: str
    path: Path | None = None

    def save(self, path: str | Path) -> "View":
        """Write the page to the file `path`; ValueError if its folder does not exist."""
        path = Path(path)
        if not path.parent.is_dir():
            raise ValueError(f"path must be in a folder that exists; got {str(path)!r}")
        path.write_text(self.page, encoding="utf-8")
        return View(self.page, path)

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.page)}" style="width:100%;height:620px;border:0"></iframe>'

    def __repr__(self) -> str:
        where = f"in {str(self.path)!r}" if self.path else "shown by a notebook, or written by .save('rod.html')"
        return f"View({len(self.page) / 1e6:.1f} MB, {where})"


def view(
    run: Result,
    path: str | Path | None = None,
    beside: Result | None = None,
    titles: Sequence[str] = (),
    radius: float | None = None,
    discs: int = 65,
) -> View:
    """The page of a run: play, scrub, speed, orbit, colour by theta, omega, |r'| or the ground's force, a plot of the energy.

    Parameters
    ----------
    path : file to write, .html; None writes nothing.
    beside : another run, shown to the right at the same time and from the same place.
    titles : strings, one for each run; by default the method and the number of discs.
    radius : of the drawn discs, length. None takes an eighteenth of the rod, of few discs more; the page shows the value. The
        spokes turn by the true theta, so a disc that is drawn too small appears to slide.
    discs : approximate number of discs drawn of each run, with the rod through them; all, if there are fewer than twice as many.

    The page plays when it is opened, unless the reader's system asks for less motion. Of a run with more than 5000 frames, or
    200 000 positions of drawn discs (3000 frames of 65), equally spaced frames are shown, and the page says how many.

    The ground's force can be chosen if both runs recorded it, want=("contact_force",).

    Raises
    ------
    ValueError : if `beside` is not a Solution; for a wrong number of titles, a folder that does not exist, another kind of file,
        values that are not finite, or one disc without a heading.
    """
    if beside is not None and not isinstance(beside, Result):
        raise ValueError(f"beside must be another Solution; got {type(beside).__name__}")
    if path is not None:
        checks.choice("the page's ending", Path(path).suffix.lower(), (".html",))
    runs = [r.discs for r in (run, beside) if r is not None]
    if isinstance(titles, str) or not all(isinstance(title, str) for title in titles):
        raise ValueError(f"titles must be a list of strings, one for each run; got {titles!r}")
    titles = list(titles) or [_title(r) for r in runs]
    if len(titles) != len(runs):
        raise ValueError(f"titles must be one for each of the {len(runs)} runs; got {len(titles)}")
    size = geometry.drawn_radius(runs[0], radius)
    about = checks.whole("discs", discs, 2)
    data = {
        "runs": [_data(r, title, about, size) for r, title in zip(runs, titles, strict=True)],
        "radius": size,
        "style": {"ink": INK, "signed": (BLUE, SAND, ORANGE), "unsigned": UNSIGNED},
        "label": LABEL,
    }
    parts = {
        "TITLE": html.escape(" and ".join(titles)).encode("ascii", "xmlcharrefreplace").decode("ascii"),
        "DATA": json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
        "STYLE": _data_file("view.css"),
        "SCRIPT": _data_file("stage.js") + _data_file("view.js"),
        "THREE": _data_file("three.min.js"),
    }
    parts["POLICY"] = (
        f"default-src 'none'; script-src {_hash(parts['THREE'])} {_hash(parts['SCRIPT'])}; style-src {_hash(parts['STYLE'])}; "
        "base-uri 'none'; form-action 'none'"
    )
    page = re.sub(f"@({'|'.join(parts)})@", lambda mark: parts[mark[1]], _data_file("view.html"))
    made = View(page)
    return made if path is None else made.save(path)


def _title(run: Solution) -> str:
    what = "nodes of the field" if "scene" in run.stats else "disc" if run.s.size == 1 else "discs"
    method = run.stats.get("method")
    return ", ".join([f"{run.s.size} {what}", *([str(method)] if method else [])])


def _hash(part: str) -> str:
    """The name of an inline script or style in a content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(part.encode('utf-8')).digest()).decode('ascii')}'"


def _data_file(name: str) -> str:
    return files("discs").joinpath("pictures", "data", name).read_text(encoding="utf-8")


def _data(run: Solution, title: str, about: int, size: float) -> dict[str, Any]:
    """The data of a run for the page; arrays (F, n) of the n drawn discs, axles as unwrapped angles."""
    for name in ("t", "x", "y", "theta", "omega", "energy", "phi"):
        values = getattr(run, name)
        if values is not None and not np.isfinite(values).all():
            frame = int(np.argwhere(~np.isfinite(values))[0, 0])
            raise ValueError(f"a page needs finite values; {name} is not at frame {frame} of {title!r}: view the frames before it")
    shown, frames, drift = geometry.picked(run.s, about), run.t.size, float(np.abs(run.energy - run.energy[0]).max())
    run = geometry.thinned(run, shown.size)
    axle, slope = geometry.axles(run), geometry.slopes(run)
    arrays = {
        "x": run.x,
        "y": run.y,
        "theta": run.theta,
        "omega": run.omega,
        "axle": np.unwrap(np.arctan2(axle[:, 1], axle[:, 0]), axis=0),
        "stretch": np.hypot(slope[:, 0], slope[:, 1]),
    }
    if run.contact_force is not None:
        arrays["force"] = np.hypot(run.contact_force[:, 0], run.contact_force[:, 1])
    return {
        "title": title,
        "n": int(shown.size),
        "ring": geometry.is_ring(run),
        "held": geometry.off_between_frames(run, size) > geometry.TOO_FAR,
        "t": run.t.tolist(),
        "energy": run.energy.tolist(),
        "drift": drift,
        "frames": frames,
        "arrays": {name: _packed(values[:, shown]) for name, values in arrays.items()},
    }


def _packed(values: ArrayLike) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")
