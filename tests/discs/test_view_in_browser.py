"""Pages as a browser shows them."""

import io

import numpy as np
import pytest
from PIL import Image

from continuum import solve, untwisting_rod
from continuum.mesh import semidiscretise
from discs import simulate
from discs.pictures.view import View
from tests.conftest import Model, uneven
from tests.discs.test_view import TITLES, pair, simulated, single

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run():
    return simulated("field", want=("contact_force",))


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
    assert [e.text for e in browser.find_elements("class name", "name")] == ["field law", "a ring <b>&"]
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


@pytest.mark.parametrize("title", TITLES, ids=["comment", "script", "quotes", "unicode", "long"])
def test_a_title_is_shown_and_not_run(browser, folder, run, title):
    opened(browser, run.view(folder / "run.html", titles=[title]))
    shown = browser.execute_script("return Array.from(document.querySelector('.name').textContent, (c) => c.codePointAt(0))")
    assert shown == [ord(c) for c in title]
    assert browser.execute_script("return discs.panels.length") == 1
    name, stage = (browser.find_element("css selector", part).rect for part in (".name", "#stage"))
    assert name["height"] < 100 < stage["height"]
    assert browser.get_log("browser") == []


def test_only_the_pages_own_scripts_run(browser, folder, run):
    """A script, an event handler and an external picture are put into the page, as if data had become markup."""
    page = run.view().page
    more = "<script>globalThis.hacked = 1</script><img src='data:,' onerror='globalThis.hacked = 2'><img src='https://localhost/a.png'>"
    (folder / "more.html").write_text(page.replace("</body>", more + "</body>"), encoding="ascii")
    browser.get((folder / "more.html").as_uri())
    settle(browser)
    assert time_of(browser) == "t = 0.00"
    assert browser.execute_script("return globalThis.hacked ?? null") is None
    refused = [entry["message"] for entry in browser.get_log("browser")]
    assert len(refused) >= 3
    assert all("Content Security Policy" in message for message in refused)


def test_frames_too_far_apart_are_shown_one_by_one(browser, folder):
    """The rod turns by half a radian more than a straight line between its two frames says: nothing is drawn between them."""
    scene = untwisting_rod()
    field = solve(scene, 1e-2, frames=2, progress=False)
    fine = solve(scene, 1e-2, frames=46, progress=False)
    opened(browser, fine.view(folder / "far.html", beside=field))
    scrub(browser, 2.25)
    assert [e.text for e in browser.find_elements("class name", "when")] == ["", "shown at t = 0.00"]
    place = "return Array.from(discs.panels[arguments[0]].parts.disc.instanceMatrix.array.slice(0, 14))"
    between, first = (np.array(browser.execute_script(place, panel))[[12, 13]] for panel in (0, 1))
    assert first == pytest.approx([field.x[0, 0], field.y[0, 0]], abs=1e-6)
    middle = simulate(semidiscretise(scene, 65, "consistent"), dt=0.01, frames=[2.25], progress=False)
    assert between == pytest.approx([middle.x[0, 0], middle.y[0, 0]], abs=0.02)
    assert "its 2 frames are too far apart" in browser.find_element("id", "note").text
    scrub(browser, 4.5)
    assert [e.text for e in browser.find_elements("class name", "when")] == ["", ""]
    last = np.array(browser.execute_script(place, 1))[[12, 13]]
    assert last == pytest.approx([field.x[1, 0], field.y[1, 0]], abs=1e-6)


def test_a_run_that_ends_before_the_other_says_so(browser, folder, run):
    longer = simulate(uneven(6, Model("springs", "unit")), dt=0.05, frames=21, progress=False)
    early = simulate(uneven(6, Model("springs", "field")), dt=0.05, frames=[0.0, 0.1, 0.2], progress=False)
    opened(browser, longer.view(folder / "run.html", beside=early))
    scrub(browser, 0.75)
    assert [e.text for e in browser.find_elements("class name", "when")] == ["", "shown at t = 0.20"]


@pytest.mark.parametrize("kind", ["two", "one"])
def test_one_and_two_discs_can_be_seen(browser, folder, kind):
    run = pair() if kind == "two" else single()
    opened(browser, run.view(folder / "few.html", radius=0.4))
    scrub(browser, float(run.t[1]))
    got = browser.execute_script("return Array.from(discs.panels[0].parts.disc.instanceMatrix.array)")
    d1, _, d3, at = np.moveaxis(np.reshape(got, (run.s.size, 4, 4))[..., :3], 1, 0)
    phi, theta = run.phi[1], run.theta[1]
    np.testing.assert_allclose(at[:, :2], np.stack([run.x[1], run.y[1]], axis=1), atol=2e-6)
    np.testing.assert_allclose(d1[:, :2], np.stack([np.cos(phi), np.sin(phi)], axis=1), atol=2e-6)
    np.testing.assert_allclose(d3[:, 2], np.cos(theta), atol=2e-6)
    empty = np.asarray([252, 252, 250])
    assert (abs(pixels(browser) - empty).max(axis=-1) > 30).mean() > 0.002
    assert browser.get_log("browser") == []
