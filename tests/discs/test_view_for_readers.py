"""Pages for readers with phones, keyboards and dark rooms, as a browser shows them."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from discs import simulate
from discs.solution import Solution
from tests.conftest import Model, uneven
from tests.discs.test_view import simulated
from tests.discs.test_view_in_browser import changed, opened, pixels, settle, time_of, wait

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run():
    return simulated("field", want=("contact_force",))


@contextmanager
def device(browser, width, height, **features):
    """A window of this size, and media features as prefers_color_scheme="dark"."""
    media = [{"name": name.replace("_", "-"), "value": value} for name, value in features.items()]
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": media})
    try:
        yield
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_starts_to_play(browser, folder, run):
    page = run.view(folder / "run.html")
    with device(browser, 700, 600, prefers_reduced_motion="no-preference"):
        opened(browser, page)
        wait(browser, "document.getElementById('time').value > 't = 0.05'")
    opened(browser, page)  # less motion is asked for
    settle(browser)
    assert time_of(browser) == "t = 0.00"


def test_a_short_motion_is_slowed_down(browser, folder):
    run = simulate(uneven(6, Model("springs", "field")), dt=0.01, frames=np.linspace(0, 0.08, 5), progress=False)
    opened(browser, run.view(folder / "run.html"))
    assert [e.text for e in browser.find_elements("css selector", "#speed option")] == ["0.005", "0.01", "0.02", "0.04", "0.08"]


def test_on_a_phone(browser, folder, run):
    """Nothing is cut off, what is touched is large enough, and discs fill the stage: two runs one above the other."""
    page = run.view(folder / "both.html", beside=simulated("unit", want=("contact_force",)), titles=("field law", "unit law"))
    with device(browser, 390, 844):
        opened(browser, page)
        inside = "const r = arguments[0].getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom, r.height]"
        for name in ("stage", "legend", "note", "play", "scrub", "time", "speed", "colour", "home", "energies", "energy"):
            left, top, right, bottom, height = browser.execute_script(inside, browser.find_element("id", name))
            assert left >= 0, name
            assert top >= 0, name
            assert right <= 390, name
            assert bottom <= 844, name
            if name in ("play", "scrub", "speed", "colour", "home"):
                assert height >= 44, name
        assert browser.execute_script("return document.documentElement.scrollWidth") == 390
        stage = pixels(browser)
        half = stage.shape[0] // 2
        for panel in (stage[:half], stage[half:]):
            colourful = np.argwhere(np.ptp(panel, axis=-1) > 40)  # discs, of sand, blue and orange
            assert (np.ptp(colourful, axis=0) > 0.35 * np.array(panel.shape[:2])).any()
        tops = [e.rect["y"] for e in browser.find_elements("class name", "title")]
        assert tops[1] - tops[0] == pytest.approx(half, abs=2)


CONTRAST = """
const luminance = (rgb) => rgb.map((c) => c / 255).map((c) => c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
  .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
const rgb = (text) => text.match(/[0-9.]+/g).map(Number);
const behind = (e) => {
  const c = rgb(getComputedStyle(e).backgroundColor);
  return c.length === 4 && c[3] === 0 ? behind(e.parentElement) : c.slice(0, 3);
};
const shows = (e) => Array.from(e.childNodes).some((n) => n.nodeType === 3 && n.data.trim()) && e.checkVisibility();
const both = (e) => [luminance(rgb(getComputedStyle(e).color).slice(0, 3)), luminance(behind(e))];
return Array.from(document.querySelectorAll("body *")).filter(shows)
  .map((e) => [e.id || e.className || e.tagName, ...both(e).sort((a, b) => b - a)])
  .map(([name, light, dark]) => [name, (light + 0.05) / (dark + 0.05)]);
"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out(browser, folder, run, scheme):
    page = run.view(folder / "both.html", beside=simulated("unit"), titles=("field law", "unit law"))
    with device(browser, 1280, 800, prefers_color_scheme=scheme):
        opened(browser, page)
        ratios = browser.execute_script(CONTRAST)
        assert len(ratios) > 12
        assert min(ratio for _, ratio in ratios) >= 4.5, ratios
        back = pixels(browser)[5, -5]
        assert (back.mean() > 200) == (scheme == "light")


def test_discs_at_rest_have_a_colour(browser, folder):
    """Where omega = 0 a disc is not white; and a run from rest begins with the angles."""
    problem = uneven(6, Model("springs", "field"))
    still = replace(problem, initial=replace(problem.initial, omega=0.0))
    run = simulate(still, dt=0.05, frames=5, progress=False)
    opened(browser, run.view(folder / "run.html"))
    assert browser.find_element("id", "colour").get_attribute("value") == "theta"
    browser.execute_script("const c = document.getElementById('colour'); c.value = 'omega'; c.onchange()")
    settle(browser)
    colours = browser.execute_script("return Array.from(discs.panels[0].parts.disc.instanceColor.array)")
    assert np.ptp(np.reshape(colours, (6, 3)), axis=1).min() > 0.3


def test_by_keyboard(browser, folder, run):
    """Every control has a name; keys turn, zoom and leave the time alone, and "Reset view" comes back."""
    opened(browser, run.view(folder / "run.html"))
    every = "document.querySelectorAll('button, input, select, summary')"
    names = f"return Array.from({every}, (e) => e.ariaLabel || e.labels?.[0]?.textContent || e.textContent)"
    assert all(name.strip() for name in browser.execute_script(names))
    first = pixels(browser)
    keys = pytest.importorskip("selenium.webdriver.common.keys").Keys
    where = "return discs.camera.position.toArray()"
    start = np.array(browser.execute_script(where))
    browser.find_element("css selector", "body").send_keys(keys.TAB)  # to the stage
    assert browser.execute_script("return document.activeElement.id") == "stage"
    for name in (keys.ARROW_RIGHT, keys.ARROW_UP, "+"):
        before = np.array(browser.execute_script(where))
        browser.switch_to.active_element.send_keys(name)
        settle(browser)
        assert abs(np.array(browser.execute_script(where)) - before).max() > 0.05
    assert time_of(browser) == "t = 0.00"
    browser.find_element("id", "home").click()
    settle(browser)
    np.testing.assert_allclose(browser.execute_script(where), start, atol=1e-6)
    browser.execute_script("document.activeElement.blur()")
    settle(browser)
    assert changed(first, pixels(browser)) < 0.001


def test_a_long_run_says_that_frames_are_left_out(browser, folder, run):
    t = np.linspace(0, 1, 20_000)
    many = {name: np.repeat(getattr(run, name)[:1], t.size, axis=0) for name in ("x", "y", "theta", "omega", "energy")}
    opened(browser, Solution(t=t, s=run.s, **many).view(folder / "long.html", titles=["long"]))
    assert "long: 5000 of its 20000 frames are shown" in browser.find_element("id", "note").text
