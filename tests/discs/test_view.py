import base64
import io
import json
import re
import shutil
from importlib.resources import files

import numpy as np
import pytest
from PIL import Image

from discs import simulate
from discs.view import View, view
from tests.conftest import Model, uneven

FLAGS = """--headless=new --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --window-size=700,600
    --disable-quic --no-first-run --disable-background-networking --disable-component-update
    --disable-sync --disable-dev-shm-usage"""
TIMES = [0.0, 0.1, 0.35, 0.6, 1.0]


def simulated(law, want=(), ends="springs"):
    return simulate(uneven(6, Model(ends, law)), dt=0.05, frames=TIMES, want=want, progress=False)


@pytest.fixture(scope="module")
def run():
    return simulated("field", want=("contact_force",))


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    webdriver = pytest.importorskip("selenium.webdriver", reason="needs selenium")
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    driver = shutil.which("chromedriver")
    if not program or not driver:
        pytest.skip("needs chromium and chromedriver, as Debian's chromium-driver brings")
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for flag in (*FLAGS.split(), f"--user-data-dir={tmp_path_factory.mktemp('chromium')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    started = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=driver))
    yield started
    started.quit()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("pages")


def opened(browser, page: View):
    browser.get(page.path.as_uri())
    settle(browser)
    return browser


def settle(browser):
    """Wait until the page has drawn two frames."""
    browser.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => done()))")


def wait(browser, condition):
    """Wait until a condition of the page, JavaScript, holds."""
    browser.execute_async_script(f"const done = arguments[0], look = () => {condition} ? done() : setTimeout(look, 20); look()")
    settle(browser)


def key(browser, name):
    """A key with nothing in focus."""
    browser.execute_script("document.activeElement.blur()")
    browser.execute_script("document.body.dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0], bubbles: true}))", name)
    settle(browser)


def scrub(browser, time):
    browser.execute_script(
        "const s = document.getElementById('scrub'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))", time
    )
    settle(browser)


def time_of(browser) -> str:
    return browser.find_element("id", "time").text


def pixels(browser):
    """The stage, (height, width, 3)."""
    image = browser.find_element("css selector", "#stage > canvas").screenshot_as_png
    return np.asarray(Image.open(io.BytesIO(image)).convert("RGB")).astype(int)


def changed(a, b) -> float:
    """Share of pixels that are plainly different."""
    return (abs(a - b).max(axis=-1) > 30).mean()


def test_plays_pauses_and_scrubs(browser, folder, run):
    opened(browser, run.view(folder / "run.html"))
    assert time_of(browser) == "t = 0.00"
    first, play = pixels(browser), browser.find_element("id", "play")
    assert (abs(first - [252, 252, 250]).max(axis=-1) > 30).mean() > 0.01  # discs are there
    browser.execute_script("document.getElementById('speed').value = '0.25'")  # takes 4 s: busy machines draw few frames
    play.click()
    wait(browser, "document.getElementById('time').value > 't = 0.20'")
    assert play.text == "Pause"
    play.click()
    settle(browser)
    assert play.text == "Play"
    stopped = time_of(browser)
    assert changed(first, pixels(browser)) > 0.003
    settle(browser)
    assert time_of(browser) == stopped
    scrub(browser, 0.75)
    assert time_of(browser) == "t = 0.75"
    assert changed(first, pixels(browser)) > 0.003
    scrub(browser, 0)
    assert time_of(browser) == "t = 0.00"
    assert changed(first, pixels(browser)) == 0
    assert browser.get_log("browser") == []
    assert browser.execute_script("return performance.getEntriesByType('resource').length") == 0  # nothing was loaded


def test_plays_to_the_end_and_again(browser, folder, run):
    opened(browser, run.view(folder / "run.html"))
    scrub(browser, 0.95)
    key(browser, " ")
    wait(browser, "document.getElementById('play').textContent === 'Play'")
    assert time_of(browser) == "t = 1.00"
    browser.execute_script("document.getElementById('speed').value = '0.25'")
    key(browser, " ")
    assert browser.find_element("id", "play").text == "Pause"
    assert time_of(browser) < "t = 0.50"
    key(browser, " ")


def test_arrows_go_from_frame_to_frame(browser, folder, run):
    opened(browser, run.view(folder / "run.html"))
    seen = []
    for name in ["ArrowRight"] * 5 + ["ArrowLeft"] * 2 + ["Home", "End"]:
        key(browser, name)
        seen.append(float(time_of(browser)[4:]))
    assert seen == [0.1, 0.35, 0.6, 1.0, 1.0, 0.6, 0.35, 0.0, 1.0]


@pytest.mark.parametrize("law", ["field", "steered"])
def test_discs_stand_and_roll_where_they_should(browser, folder, law):
    """The matrices of discs (columns d_1, d_2, d_3 and place), at a frame and half way between two."""
    run = simulated(law)
    opened(browser, run.view(folder / "run.html", radius=0.3))
    for time, shares in ((0.35, (0, 0, 1, 0, 0)), (0.8, (0, 0, 0, 0.5, 0.5))):
        scrub(browser, time)
        got = browser.execute_script("return Array.from(discs.panels[0].parts.disc.instanceMatrix.array)")
        d1, _, d3, at = np.moveaxis(np.reshape(got, (6, 4, 4))[..., :3], 1, 0)
        x, y, theta = (np.array(shares) @ values for values in (run.x, run.y, run.theta))
        if law == "steered":
            heading = np.array(shares) @ run.phi
        else:
            slope = np.gradient(np.stack([run.x, run.y]), run.s, axis=2, edge_order=2)
            heading = np.array(shares) @ np.unwrap(np.arctan2(slope[1], slope[0]), axis=0)
        axle = np.stack([np.cos(heading), np.sin(heading), 0 * heading], axis=1)
        ahead = np.stack([-axle[:, 1], axle[:, 0], 0 * heading], axis=1)
        np.testing.assert_allclose(at, np.stack([x, y, 0 * x + 0.3], axis=1), atol=2e-6)
        np.testing.assert_allclose(d1, axle, atol=2e-6)
        np.testing.assert_allclose(d3, np.sin(theta)[:, None] * ahead + np.cos(theta)[:, None] * [0, 0, 1], atol=2e-6)


def test_colours(browser, folder, run):
    opened(browser, run.view(folder / "run.html"))
    menu, seen = browser.find_element("id", "colour"), {}
    for name in ("theta", "omega", "stretch", "force"):
        browser.execute_script("arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('change'))", menu, name)
        settle(browser)
        seen[name] = pixels(browser)
        ends = [float(text) for text in browser.find_element("id", "ends").text.split()]
        if name in ("theta", "omega"):
            largest = abs(getattr(run, name)).max()
            assert ends == pytest.approx([-largest, 0, largest], rel=6e-3)
        elif name == "force":
            size = np.hypot(run.contact_force[:, 0], run.contact_force[:, 1])
            assert [ends[0], ends[2]] == pytest.approx([size.min(), size.max()], rel=6e-3)
    assert all(changed(seen["omega"], seen[name]) > 0.003 for name in ("theta", "stretch", "force"))
    assert browser.get_log("browser") == []


def test_two_runs_beside_each_other(browser, folder, run):
    unit = simulated("unit", ends="ring")
    page = run.view(folder / "both.html", beside=unit, titles=("field law", "a ring <b>&"))
    opened(browser, page)
    assert [e.text for e in browser.find_elements("class name", "title")] == ["field law", "a ring <b>&"]
    assert [o.get_attribute("value") for o in browser.find_elements("css selector", "#colour option")] == [
        "theta",
        "omega",
        "stretch",
    ]
    assert browser.execute_script("return discs.panels.map((p) => p.parts.rod.count)") == [5, 6]  # a ring is closed
    first = pixels(browser)
    scrub(browser, 1.0)
    last = pixels(browser)
    half = first.shape[1] // 2
    assert changed(first[:, :half], last[:, :half]) > 0.003
    assert changed(first[:, half:], last[:, half:]) > 0.003
    assert browser.get_log("browser") == []


def test_camera_orbits_and_comes_back(browser, folder, run):
    opened(browser, run.view(folder / "run.html"))
    first = pixels(browser)
    chains = pytest.importorskip("selenium.webdriver").ActionChains(browser)
    chains.drag_and_drop_by_offset(browser.find_element("css selector", "#stage > canvas"), 120, -30).perform()
    settle(browser)
    assert changed(first, pixels(browser)) > 0.01
    browser.find_element("id", "home").click()
    settle(browser)
    assert changed(first, pixels(browser)) < 0.001


def test_notebooks_show_it(browser, folder, run):
    (folder / "notebook.html").write_text(f"<p>cell</p>{run.view()._repr_html_()}", encoding="utf-8")
    browser.get((folder / "notebook.html").as_uri())
    browser.switch_to.frame(0)
    settle(browser)
    assert time_of(browser) == "t = 0.00"
    assert browser.execute_script("return discs.panels.length") == 1
    browser.switch_to.default_content()


# ---- without a browser


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


def test_page_is_small_and_takes_nothing_from_outside(run):
    page = run.view().page
    assert len(page.encode()) < 1.2e6
    ours = page.replace(files("discs").joinpath("data", "three.min.js").read_text(encoding="utf-8"), "")
    assert not re.search(r"https?:|src=|@import|<link|url\(", ours)


def test_titles_cannot_break_the_page(run):
    title = "</script><script>throw 1</script> @THREE@"
    page = run.view(titles=[title])
    assert page.page.count("</script>") == run.view().page.count("</script>")
    assert data_of(page)["runs"][0]["title"] == title


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path": "rod.pdf"}, "the page's ending must be one of '.html'; got '.pdf'"),
        ({"path": "no/such/folder/rod.html"}, "path must be in a folder that exists; got 'no/such/folder/rod.html'"),
        ({"beside": "field"}, "beside must be another Solution; got str"),
        ({"titles": ["a", "b"]}, "titles must be one for each of the 1 runs; got 2"),
        ({"radius": -0.1}, "radius must be a positive finite number; got -0.1"),
        ({"discs": 1}, "discs must be a whole number of at least 2; got 1"),
    ],
)
def test_bad_input(run, change, message):
    with pytest.raises(ValueError, match=message):
        view(run, **change)
