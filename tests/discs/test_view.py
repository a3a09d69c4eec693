import base64
import json
import re
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

from discs import Problem, State, SteeredChain, simulate
from discs.mechanics import textbook
from discs.pictures import geometry
from discs.pictures.view import View, view
from discs.solution import Solution
from tests.conftest import Model, uneven

TIMES = [0.0, 0.1, 0.35, 0.6, 1.0]
TITLES = [
    "<!--<script>",
    "</script><script>throw 1</script>",
    "<!-- ' \" & &lt; @THREE@",
    "Ü 転 \u202e \u2028 \ud800 \0 \\u003c",
    "long " * 4000,
]


def simulated(law, want=(), ends="springs"):
    return simulate(uneven(6, Model(ends, law)), dt=0.05, frames=TIMES, want=want, progress=False)


@pytest.fixture(scope="module")
def run():
    return simulated("field", want=("contact_force",))


def pair():
    stiff = {"stretch_stiffness": 9.0, "shear_stiffness": 7.0, "torsion_stiffness": 0.9, "bending_stiffness": 0.8}
    chain = SteeredChain(n=2, length=1.0, density=1.3, spin_inertia=0.6, heading_inertia=0.3, radius=0.7, **stiff)
    problem = Problem(chain, State(chain.s, [0, 0], [0.4, -0.4], 0.5, [0.0, 0.3]), 1.0)
    return simulate(problem, dt=0.05, frames=11, progress=False)


def single():
    book = textbook.rolling_disc(1.3, 0.6, 0.4, 0.7, roll_rate=1.1, turn_rate=0.8, slope=2.1)
    return geometry.one_disc(book.integrate(np.linspace(0, 2, 21)), 0.7)


def data_of(page: View):
    return json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', page.page, re.DOTALL)[1])


def test_page_holds_the_run(run):
    page = run.view()
    (held,) = data_of(page)["runs"]
    assert held["t"] == run.t.tolist()
    assert held["energy"] == run.energy.tolist()
    for name in ("x", "y", "theta", "omega"):
        values = np.frombuffer(base64.b64decode(held["arrays"][name]), "<f4").reshape(5, 6)
        np.testing.assert_array_equal(values, getattr(run, name).astype("f4"))
    assert page.path is None


def test_of_many_frames_some_are_shown(run):
    """100 001 frames of six discs, made of one: the page would be 24 MB."""
    t = np.linspace(0, 1, 100_001)
    many = {name: np.repeat(getattr(run, name)[:1], t.size, axis=0) for name in ("x", "y", "theta", "omega", "energy")}
    long = Solution(t=t, s=run.s, **many)
    page = long.view()
    (held,) = data_of(page)["runs"]
    assert len(held["t"]) == 5000
    assert [held["t"][0], held["t"][-1], held["frames"]] == [0.0, 1.0, 100_001]
    assert np.ptp(np.diff(held["t"])) < 1.1e-5  # equally spaced, up to one frame
    assert len(page.page) < 3e6
    wide = {name: np.zeros((4000, 129)) for name in ("x", "y", "theta", "omega")}
    wide["x"] = wide["x"] + np.linspace(0, 1, 129)
    some = Solution(t=t[:4000], s=np.linspace(0, 1, 129), energy=np.zeros(4000), **wide)
    assert len(data_of(some.view())["runs"][0]["t"]) == 200_000 // 129


def test_page_is_small_and_takes_nothing_from_outside(run):
    page = run.view().page
    assert len(page.encode()) < 1.2e6
    assert page.isascii()  # the hashes of its policy hold in whatever encoding it is read
    ours = page.replace(files("discs").joinpath("pictures", "data", "three.min.js").read_text(encoding="utf-8"), "")
    assert not re.search(r"https?:|src=|@import|<link|url\(", ours)


@pytest.mark.parametrize("title", TITLES, ids=["comment", "script", "quotes", "unicode", "long"])
def test_titles_cannot_break_the_page(run, title):
    page = run.view(titles=[title])
    assert page.page.count("<") == run.view().page.count("<")
    assert data_of(page)["runs"][0]["title"] == title


def test_titles_from_what_a_file_says(run):
    """Whatever a foreign archive has as its method; a run to a tolerance is one of discs, though it has an error estimate."""
    for method, words in ((["<b>", 3], "['<b>', 3]"), (7, "7"), (None, "6 discs")):
        odd = replace(run, stats=run.stats | {"method": method}, error_estimate={"x": 1e-3})
        title = data_of(odd.view())["runs"][0]["title"]
        assert words in title
        assert title.startswith("6 discs")


def test_how_far_lines_between_frames_are_off():
    """A disc that rolls and turns evenly, theta = t and phi = t, on a circle of radius R: a chord is off by 1 - cos(h/2) of it, and
    an angle that grows like t^2 is off by h^2/4 half way."""
    t = np.linspace(0, 1.2, 4)
    column, none = t[:, None], np.zeros((4, 1))
    even = Solution(t=t, s=np.zeros(1), x=0.5 * np.cos(column), y=0.5 * np.sin(column), theta=column, omega=none + 1, energy=0 * t)
    even = replace(even, phi=column)
    h, radius = 0.4, 0.1
    sagitta = 0.5 * (1 - np.cos(h / 2)) / radius
    assert geometry.off_between_frames(even, radius) == pytest.approx(sagitta, rel=0.02)
    known = replace(even, stats={"radius": 0.5})
    assert sagitta < geometry.off_between_frames(known, radius) < 1.1 * sagitta
    faster = replace(even, theta=column**2, omega=2 * column, x=none, y=none)
    assert geometry.off_between_frames(faster, radius) == pytest.approx(h**2 / 4)
    assert geometry.off_between_frames(replace(faster, stats={"radius": 0.5}), radius) > h**2 / 4


@pytest.mark.slow
def test_one_disc_from_above():
    assert single().plot_motion() is not None
    assert len(single().plot()) == 3
    with pytest.raises(ValueError, match="panel must be one of 'motion', 'end', 'energy', 'phase'; got 'theta'"):
        single().plot("theta")
    assert geometry.drawn_radius(single(), None) == 0.7
    assert geometry.drawn_radius(pair(), None) == pytest.approx(1 / 3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path": "rod.pdf"}, "the page's ending must be one of '.html'; got '.pdf'"),
        ({"path": "no/such/folder/rod.html"}, "path must be in a folder that exists; got 'no/such/folder/rod.html'"),
        ({"beside": "field"}, "beside must be another Solution; got str"),
        ({"titles": ["a", "b"]}, "titles must be one for each of the 1 runs; got 2"),
        ({"titles": "a"}, "titles must be a list of strings, one for each run; got 'a'"),
        ({"titles": [3]}, r"titles must be a list of strings, one for each run; got \[3\]"),
        ({"radius": -0.1}, "radius must be a positive finite number; got -0.1"),
        ({"discs": 1}, "discs must be a whole number of at least 2; got 1"),
    ],
)
def test_bad_input(run, change, message):
    with pytest.raises(ValueError, match=message):
        view(run, **change)


def test_what_cannot_be_seen_is_refused(run):
    broken = run.x.copy()
    broken[3, 2] = np.nan
    with pytest.raises(ValueError, match="a page needs finite values; x is not at frame 3 of '6 discs, midpoint'"):
        replace(run, x=broken).view()
    with pytest.raises(ValueError, match="one disc has no centre line to follow: give its heading phi"):
        replace(single(), phi=None).view()
    with pytest.raises(ValueError, match="one disc has the coordinates x, y, theta, phi; got 3 of them"):
        geometry.one_disc(textbook.knife_edge(1.3, 0.4, slope=0.0, speed=1.0, turn_rate=0.5).integrate([0.0, 1.0]), 0.7)
