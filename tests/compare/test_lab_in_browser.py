"""The lab as a browser shows it, with the mouse, fingers and keys of a reader."""

import re
import signal
import subprocess
import sys

import numpy as np
import pytest

from tests.conftest import longer
from tests.discs.test_view_for_readers import CONTRAST, device

pytest.importorskip("tornado", reason="needs tornado, of the extra lab")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def address():
    command = [sys.executable, "-m", "compare", "lab", "--no-browser", "--stay", "--n", "33"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        yield re.search(r"http://\S+", process.stdout.readline())[0]
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    assert process.returncode == 0


@pytest.fixture
def page(browser, address):
    """The page, at rest, as less motion is asked for; at the end nothing has gone wrong on it."""
    browser.set_script_timeout(60)
    browser.get(address)
    until(browser, "globalThis.discs?.stats.frames > 0")
    yield browser
    assert browser.get_log("browser") == []


def until(browser, condition):
    """Wait until a condition of the page, JavaScript, holds."""
    browser.execute_async_script(f"const done = arguments[0], look = () => ({condition}) ? done() : setTimeout(look, 20); look()")


def ask(browser, what):
    return browser.execute_script(f"return {what}")


def control(browser, name):
    """A button by its text, or what a label with this text names."""
    button = browser.find_elements("xpath", f"//button[normalize-space()='{name}']")
    return (
        button[0] if button else browser.find_element("xpath", f"//label[starts-with(., '{name}')]//*[self::input or self::select]")
    )


def hand(browser):
    return pytest.importorskip("selenium.webdriver").ActionChains(browser, duration=50)


def over(browser, disc):
    """Actions with the mouse over a disc."""
    stage = browser.find_element("css selector", ".stage")
    x, y, _ = ask(browser, f"discs.stage.seen(discs.frame.rows.x[{disc}], discs.frame.rows.y[{disc}])")
    size = stage.rect
    return hand(browser).move_to_element_with_offset(stage, int(x - size["width"] / 2), int(y - size["height"] / 2))


def test_plays_pauses_steps_goes_back_and_starts_again(page):
    keys = pytest.importorskip("selenium.webdriver.common.keys").Keys
    assert control(page, "Play").is_displayed()
    hand(page).send_keys(" ").perform()
    until(page, "discs.frame.t > 0.1")
    hand(page).send_keys(" ").perform()
    until(page, "document.querySelector('.play').textContent === 'Play' && discs.idle")
    stopped = ask(page, "discs.frame.t")
    control(page, "Step").click()
    until(page, f"Math.abs(discs.frame.t - {stopped} - 0.01) < 1e-9")
    hand(page).send_keys(keys.ARROW_RIGHT).perform()
    until(page, f"Math.abs(discs.frame.t - {stopped} - 0.02) < 1e-9")
    hand(page).send_keys(keys.ARROW_LEFT).send_keys(keys.ARROW_LEFT).perform()
    until(page, f"Math.abs(discs.frame.t - {stopped}) < 1e-9 && discs.idle")
    hand(page).send_keys("r").perform()
    until(page, "discs.frame.t === 0")
    until(page, "document.querySelector('.time').textContent === 't = 0.00'")


def test_a_disc_is_pulled_with_the_mouse(page):
    over(page, 0).click_and_hold().move_by_offset(30, 40).perform()  # at rest: a disc that moves may have gone before the click
    until(page, "discs.frame.pulled?.[0] === 0 && discs.frame.work > 0")
    place = ask(page, "[discs.frame.pulled, discs.frame.rows.x[0], discs.frame.rows.y[0]]")
    assert np.hypot(place[0][1] - place[1], place[0][2] - place[2]) > 0.1
    hand(page).send_keys(" ").perform()
    until(page, "discs.frame.t > 0.1 && discs.frame.pulled?.[0] === 0")
    assert "press Reset to compare" in ask(page, "discs.frame.beside")
    assert abs(ask(page, "discs.frame.off")) < 1e-10
    hand(page).release().perform()
    until(page, "discs.frame.pulled === null")


def test_discs_are_kicked_and_held(page):
    control(page, "Kick").click()
    over(page, 32).click().perform()
    until(page, "Math.abs(discs.frame.rows.omega[32] - 2) < 1e-6")
    control(page, "Hold").click()
    over(page, 5).click().perform()
    until(page, "discs.frame.held.includes(5) && document.querySelector('.side').textContent.includes('Let it go')")
    hand(page).send_keys("h").perform()  # the keys are for the disc that was clicked last
    until(page, "!discs.frame.held.length")
    hand(page).send_keys("k").perform()
    until(page, "Math.abs(discs.frame.rows.omega[5] - 2) < 1e-6")


def test_elsewhere_the_mouse_turns_the_view(page):
    where = "discs.stage.camera.position.toArray()"
    first = np.array(ask(page, where))
    stage = page.find_element("css selector", ".stage")
    corner = hand(page).move_to_element_with_offset(stage, 20 - int(stage.rect["width"] / 2), 60 - int(stage.rect["height"] / 2))
    corner.click_and_hold().move_by_offset(80, -10).release().perform()
    assert abs(np.array(ask(page, where)) - first).max() > 0.1
    assert ask(page, "discs.frame.pulled") is None
    control(page, "Reset view").click()
    np.testing.assert_allclose(ask(page, where), first, atol=0.05)


def test_sliders_change_the_discs_at_once(page):
    """By keys, in steps; a twist begins again, a stiffness does not."""
    keys = pytest.importorskip("selenium.webdriver.common.keys").Keys
    slider = control(page, "twist")
    slider.send_keys(keys.ARROW_RIGHT * 5)
    until(page, "discs.stats.slider.length > 0 && discs.frame.energy > 1.3")
    control(page, "Step").click()
    until(page, "discs.frame.t > 0")
    before = ask(page, "discs.frame.t")
    control(page, "torsion").send_keys(keys.ARROW_RIGHT * 5)
    until(page, "discs.frame.work > 0.01")
    assert ask(page, "discs.frame.t") == before


def test_chooses_and_says_what_cannot_be(page):
    control(page, "scene").find_element("xpath", "option[.='own headings']").click()
    until(page, "discs.scene.chosen.scene === 'steered_rod' && discs.frame")
    assert control(page, "mounting angle").is_displayed()
    assert not control(page, "rolling law").is_enabled()
    number = control(page, "discs N")
    number.clear()
    number.send_keys("5000\t")
    until(page, "!document.querySelector('.message').hidden")
    message = page.find_element("css selector", ".message")
    assert "n must be a whole number from 2 to 1025; got 5000" in message.text
    assert "Traceback" not in page.page_source
    message.find_element("css selector", "button").click()
    assert not message.is_displayed()
    assert number.get_attribute("value") == "33"
    number.clear()
    number.send_keys("2\t")
    until(page, "discs.scene.chosen.n === 2 && discs.frame?.n === 2")


def test_the_field_comes_beside(page):
    until(page, "discs.frame.t === 0")
    control(page, "Play").click()
    until(page, "discs.frame.error")
    assert ask(page, "discs.stage.count") == 2
    until(page, "document.querySelector('.plots').textContent.includes('distance from the field')")
    assert ask(page, "discs.frame.error.place") < 0.2
    control(page, "the field beside").click()
    until(page, "discs.stage.count === 1")


def test_copies_and_saves(page):
    control(page, "Copy as TOML").click()
    until(page, "!document.querySelector('pre').hidden")
    assert 'scene = "untwisting_rod"' in page.find_element("css selector", "pre").text
    control(page, "Copy as Python").click()
    until(page, "document.querySelector('pre').textContent.includes('import simulate')")


@pytest.mark.parametrize(
    ("width", "height", "scheme"), [(1280, 800, "dark"), (390, 844, "light"), longer(1280, 800, "light"), longer(390, 844, "dark")]
)
def test_can_be_read_and_touched(page, address, width, height, scheme):
    with device(page, width, height, prefers_color_scheme=scheme, prefers_reduced_motion="reduce"):
        page.get(address)
        until(page, "globalThis.discs?.stats.frames > 0")
        ratios = page.execute_script(CONTRAST)
        assert min(ratio for _, ratio in ratios) >= 4.5, ratios
        assert ask(page, "document.documentElement.scrollWidth") == width
        every = "Array.from(document.querySelectorAll('button, select, input')).filter((e) => e.checkVisibility())"
        box = "(e.closest('.check') ?? e).getBoundingClientRect().toJSON()"
        sizes = ask(page, f"{every}.map((e) => [e.textContent || e.type, {box}])")
        assert len(sizes) > 20
        for name, box in sizes:
            assert box["height"] >= 44, name
            assert box["left"] >= 0, name
            assert box["right"] <= width, name
        names = ask(page, f"{every}.map((e) => e.ariaLabel || e.labels?.[0]?.textContent || e.textContent)")
        assert all(name.strip() for name in names)


def test_the_page_says_that_the_lab_has_ended(browser):
    command = [sys.executable, "-m", "compare", "lab", "--no-browser", "--n", "9"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        browser.get(re.search(r"http://\S+", process.stdout.readline())[0])
        until(browser, "globalThis.discs?.stats.frames > 0")
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    until(browser, "document.querySelector('.message').textContent.includes('The lab has ended')")
    browser.get("about:blank")
    browser.get_log("browser")
