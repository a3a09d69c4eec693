"""The report in a real browser, from the file system and without a network."""

import importlib
import re
import shutil
import tempfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from urllib.parse import unquote

import pytest

from compare import report as module
from compare import stability
from compare.__main__ import main
from compare.hardcases.cases import cases
from compare.page import Page
from compare.report import report, under_each_law

pytestmark = pytest.mark.slow

FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --disable-dev-shm-usage --window-size=1200,1000"
)


@contextmanager
def here(processes=1):
    importlib.import_module("numba")  # two threads that import it at once may hang
    with ThreadPoolExecutor(1) as executor:
        yield executor


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A small report, whole, in this process; stability and speed have tests of their own, with all methods and peers."""
    out = tmp_path_factory.mktemp("report")
    few = [c for c in cases(True) if c.name == "few discs" or c.setting.startswith("N = 33, h =")]
    methods = ("midpoint", "gauss6", "leapfrog", "SciPy DOP853")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "background", here)
        patch.setattr(module, "speed_peers", lambda problem: [])
        patch.setattr(module, "stability", partial(stability, methods=methods))
        patch.setattr("compare.hardcases.table.cases", lambda quick: few)
        patch.setattr("compare.hardcases.table._listed", lambda quick: {c.key: c for c in few})
        report(out, n=(9, 17), tol=1e-2, timed=9, long=0.2, progress=False)
    return out


@pytest.fixture(scope="module")
def browser():
    webdriver = pytest.importorskip("selenium.webdriver")
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not chromium or not driver:
        pytest.skip("needs chromium and chromedriver: apt-get install chromium chromium-driver")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = webdriver.ChromeOptions()
        options.binary_location = chromium
        for flag in (*FLAGS.split(), f"--user-data-dir={profile}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        found = webdriver.Chrome(options, webdriver.ChromeService(driver))
        found.execute_cdp_cmd("Network.enable", {})
        found.execute_cdp_cmd("Network.setBlockedURLs", {"urls": ["http://*", "https://*"]})
        yield found
        found.quit()


def test_every_picture_has_its_data(written):
    names = {p.name for p in written.iterdir()}
    page = (written / "report.md").read_text(encoding="utf-8")
    pictures = re.findall(r"!\[[^\]]*\]\(([^)]*\.png)\)", page)
    assert len(pictures) == 9
    for picture in pictures:
        assert {picture, picture.replace(".png", ".csv")} <= names
        assert len((written / picture.replace(".png", ".csv")).read_text(encoding="utf-8").splitlines()) > 1
    headings = "The scene", "The motion", "N → ∞", "The force of the ground", "The paper's law", "Energy", "Speed", "Hard cases"
    for heading in (*headings, "Made with"):
        assert f"## {heading}" in page


def test_horizons_of_tolerances(written):
    """Errors grow; small tolerances last longer than ten durations."""
    page = (written / "report.md").read_text(encoding="utf-8").split("### How long a tolerance lasts")[1].split("## Hard")[0]
    assert float(re.search(r"are ([\d.]+) times as large at t = 4\.5, N = 9", page)[1]) > 5
    last = {tol: float(t) for tol, t in re.findall(r"\| (1e-\d+) \| (?:t =|after t =) ([\d.]+) \|", page)}
    assert list(last) == ["1e-01", "1e-02", "1e-03", "1e-04", "1e-06"]
    assert last["1e-01"] < last["1e-06"] == 45.0


def test_page_needs_nothing_beside_it(written, tmp_path, browser):
    """Alone in a folder: all pictures are shown, nothing is loaded from a network, and the console has no message."""
    alone = tmp_path / "report.html"
    shutil.copy(written / "report.html", alone)
    browser.get(alone.as_uri())
    assert browser.title == "N rolling discs and the rod they become"
    images = browser.execute_script("return [...document.images].map(i => [i.complete, i.naturalWidth, i.src.slice(0, 22)])")
    assert len(images) == 9
    assert all(complete and width > 300 and kind == "data:image/png;base64," for complete, width, kind in images)
    assert browser.execute_script("return performance.getEntriesByType('resource').filter(e => !e.name.startsWith('data:'))") == []
    assert browser.get_log("browser") == []
    assert browser.execute_script("return document.querySelectorAll('table').length") >= 6
    assert browser.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")


def test_links_lead_to_the_data(written, browser):
    browser.get((written / "report.html").as_uri())
    links = browser.execute_script("return [...document.querySelectorAll('a')].map(a => a.getAttribute('href'))")
    assert len(links) == 10
    assert all((written / unquote(link)).is_file() for link in links)


def test_a_missing_picture_is_noticed(tmp_path, browser):
    """The control: what the test above looks for, on a page that lacks it."""
    (tmp_path / "page.html").write_text('<img src="missing.png"><script>nothing()</script>')
    browser.get((tmp_path / "page.html").as_uri())
    assert browser.execute_script("return document.images[0].naturalWidth") == 0
    assert len(browser.get_log("browser")) >= 2


def test_text_is_escaped(tmp_path):
    page = Page(tmp_path)
    page.add("a < b & <script>alert(1)</script>")
    assert "<script>" not in page.html("title")


def test_command_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(module, "report", lambda out, n, tol, progress, scene: print(f"report of {n} to {tol} in {out}: {scene}"))
    assert main(["report", "--n", "9", "17", "--tol", "0.01", "--quiet", "--out", str(tmp_path)]) == 0
    assert f"report of [9, 17] to 0.01 in {tmp_path}: None" in capsys.readouterr().out


def test_bad_input_leaves_nothing(tmp_path, capsys):
    assert main(["report", "--tol", "-1", "--quiet", "--out", str(tmp_path / "new")]) == 2
    assert "tol must be a positive finite number" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_own_scene(tmp_path, capsys, monkeypatch):
    """The rod of the file, under each law, and on the page with its numbers."""
    (tmp_path / "mine.toml").write_text('scene = "untwisting_rod"\nradius = 0.7\nduration = 0.3\n')
    given = []
    with monkeypatch.context() as patch:
        patch.setattr(module, "report", lambda *_, scene, **__: given.append(scene))
        assert main(["report", "--scene", str(tmp_path / "mine.toml"), "--quiet", "--out", str(tmp_path)]) == 0
    scenes = under_each_law(*given)
    assert [(scene.rolling, scene.rod.radius, scene.duration) for scene in scenes.values()] == [
        ("field", 0.7, 0.3),
        ("unit", 0.7, 0.3),
    ]
    page = Page(tmp_path)
    module._scene(page, scenes["unit"])
    assert "| radius | 0.7 |" in page.markdown()
    assert "Time runs to 0.3" in page.markdown()
    (tmp_path / "ring.toml").write_text('scene = "breathing_ring"\n')
    assert main(["report", "--scene", str(tmp_path / "ring.toml"), "--quiet", "--out", str(tmp_path / "new")]) == 2
    assert "a rod with two free ends, linear curvature and no loads, which the breathing ring is not" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()
