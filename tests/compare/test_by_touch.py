"""The lab and the page of a run on a phone, with fingers."""

import numpy as np
import pytest

from tests.compare.test_lab_in_browser import address, ask, control, until
from tests.discs.test_view import simulated
from tests.discs.test_view_for_readers import device
from tests.discs.test_view_in_browser import opened, settle

pytest.importorskip("tornado", reason="needs tornado, of the extra lab")
pytestmark = pytest.mark.slow

__all__ = ["address"]

CAMERA = "{0}.camera.position.toArray()"
DISTANCE = "{0}.camera.position.distanceTo({0}.orbit.target)"


@pytest.fixture(scope="module")
def phone(browser):
    """A browser of a phone: 390 x 844 pixels, and fingers."""
    browser.set_script_timeout(60)
    with device(browser, 390, 844, prefers_reduced_motion="reduce"):
        browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 5})
        yield browser


@pytest.fixture
def page(phone, address):
    """The lab at rest; at the end nothing has gone wrong on it."""
    phone.get(address)
    until(phone, "globalThis.discs?.stats.frames > 0")
    yield phone
    assert phone.get_log("browser") == []


def touch(browser, kind, *fingers):
    """The place (x, y) of each finger that is down, from the corner of the page."""
    points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(fingers)]
    browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def swipe(browser, start, end, *, lift=True):
    """Fingers go from their places to others in eight moves."""
    touch(browser, "touchStart", *start)
    for share in np.linspace(0, 1, 9)[1:]:
        touch(browser, "touchMove", *((1 - share) * np.array(start) + share * np.array(end)).tolist())
    if lift:
        touch(browser, "touchEnd")
    settle(browser)


def place(browser, disc):
    """Where the hub of a disc is seen."""
    corner = ask(browser, "document.querySelector('.stage').getBoundingClientRect().toJSON()")
    x, y, _ = ask(browser, f"discs.stage.seen(discs.frame.rows.x[{disc}], discs.frame.rows.y[{disc}])")
    return corner["x"] + x, corner["y"] + y


def test_a_finger_pulls_a_disc(page):
    x, y = place(page, 0)
    swipe(page, [(x, y)], [(x + 60, y + 40)], lift=False)
    until(page, "discs.frame.pulled?.[0] === 0 && discs.frame.work > 0")
    seen = np.array(ask(page, "discs.frame.pulled.slice(1)"))
    np.testing.assert_allclose(ask(page, f"discs.stage.under({x + 60}, {y + 40})"), seen, atol=1e-6)  # the stage is at the corner
    touch(page, "touchEnd")
    until(page, "discs.frame.pulled === null")


def test_a_finger_beside_the_discs_turns_the_view(page):
    first, far = ask(page, CAMERA.format("discs.stage")), ask(page, DISTANCE.format("discs.stage"))
    swipe(page, [(200, 280)], [(300, 270)])
    assert abs(np.array(ask(page, CAMERA.format("discs.stage"))) - first).max() > 0.1
    assert ask(page, DISTANCE.format("discs.stage")) == pytest.approx(far)
    assert ask(page, "discs.frame.pulled") is None


@pytest.mark.parametrize("on_a_disc", [False, True])
def test_two_fingers_zoom(page, on_a_disc):
    """Also where the first one is on a disc, which it pulls until the second one comes."""
    x, y = place(page, 16) if on_a_disc else (200, 285)
    far = ask(page, DISTANCE.format("discs.stage"))
    if on_a_disc:
        touch(page, "touchStart", (x, y))
        until(page, "discs.frame.pulled")
    swipe(page, [(x, y), (x + 60, y)], [(x - 30, y), (x + 90, y)])  # from 60 to 120 pixels
    assert ask(page, DISTANCE.format("discs.stage")) == pytest.approx(far / 2, rel=1e-3)
    until(page, "discs.frame.pulled === null && discs.idle")
    assert ask(page, "visualViewport.scale") == 1


def test_a_tap_kicks_a_disc_and_a_swipe_turns(page):
    control(page, "Kick").click()
    x, y = place(page, 16)
    first = ask(page, CAMERA.format("discs.stage"))
    swipe(page, [(x, y)], [(x + 60, y)])
    assert abs(np.array(ask(page, CAMERA.format("discs.stage"))) - first).max() > 0.1
    assert ask(page, "discs.idle && Math.max(...discs.frame.rows.omega)") < 1e-6
    disc = 32
    swipe(page, [place(page, disc)], [place(page, disc)])
    until(page, f"Math.abs(discs.frame.rows.omega[{disc}] - 2) < 1e-6")


def test_a_slider_and_the_list_of_controls_move(page):
    slider = control(page, "torsion")
    page.execute_script("arguments[0].scrollIntoView({block: 'center'})", slider)
    box = ask(page, "document.querySelector('[aria-label^=torsion]').getBoundingClientRect().toJSON()")
    before = float(slider.get_attribute("value"))
    x, y = box["x"] + 0.28 * box["width"], box["y"] + 22
    swipe(page, [(x, y)], [(x + 100, y)])
    assert float(slider.get_attribute("value")) > before + 0.3
    until(page, "discs.frame.work > 0.01")
    scrolled = ask(page, "document.querySelector('.all').scrollTop")
    swipe(page, [(200, 700)], [(200, 600)])
    until(page, f"document.querySelector('.all').scrollTop > {scrolled + 50}")


def test_the_page_of_a_run_is_turned_zoomed_and_moved_in_time(phone, tmp_path):
    opened(phone, simulated("field", want=("contact_force",)).view(tmp_path / "run.html"))
    first, far = ask(phone, CAMERA.format("discs")), ask(phone, DISTANCE.format("discs"))
    swipe(phone, [(200, 400)], [(280, 390)])
    assert abs(np.array(ask(phone, CAMERA.format("discs"))) - first).max() > 0.1
    swipe(phone, [(150, 300), (210, 300)], [(120, 300), (240, 300)])
    assert ask(phone, DISTANCE.format("discs")) == pytest.approx(far / 2, rel=1e-3)
    box = ask(phone, "document.getElementById('energy').getBoundingClientRect().toJSON()")
    swipe(phone, [(box["x"] + 20, box["y"] + 30)], [(box["x"] + 0.8 * box["width"], box["y"] + 30)])
    assert phone.find_element("id", "time").text > "t = 0.1"
