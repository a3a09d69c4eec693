"""The lab in JupyterLab, as a browser shows it."""

import json
import re
import subprocess
import sys

import pytest

from tests.compare.test_lab_in_browser import ask, until
from tests.discs.test_view_for_readers import CONTRAST, device

for needed in ("jupyterlab", "anywidget", "ipywidgets"):
    pytest.importorskip(needed, reason="needs the extra notebooks")
pytestmark = pytest.mark.long

CELL = "from compare import lab\nfrom continuum import untwisting_rod\npage = lab(untwisting_rod(twist=0.75), n=9)\npage"


@pytest.fixture
def address(tmp_path, monkeypatch):
    """Of a server for notebooks, with one notebook of two cells."""
    cells = [
        {"cell_type": "code", "id": f"cell{i}", "execution_count": None, "metadata": {}, "outputs": [], "source": source}
        for i, source in enumerate((CELL, "print(page.run)"))
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    (tmp_path / "lab.ipynb").write_text(json.dumps(notebook), encoding="utf-8")
    for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))
    options = [
        "--no-browser",
        "--allow-root",
        "--ip=127.0.0.1",
        "--port=0",
        "--IdentityProvider.token=abc",
        f"--ServerApp.root_dir={tmp_path}",
    ]
    command = [sys.executable, "-m", "jupyterlab", *options]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        port = next(found[1] for line in process.stderr if (found := re.search(r"http://127.0.0.1:(\d+)/lab", line)))
        yield f"http://127.0.0.1:{port}/lab/tree/lab.ipynb?token=abc"
        process.terminate()
        process.communicate(timeout=60)


def test_a_cell_shows_discs_that_move(browser, address):
    webdriver = pytest.importorskip("selenium.webdriver")
    keys = webdriver.Keys

    def run(cell):
        browser.find_elements("css selector", ".jp-Cell .cm-content")[cell].click()
        webdriver.ActionChains(browser).key_down(keys.SHIFT).send_keys(keys.ENTER).key_up(keys.SHIFT).perform()

    browser.set_script_timeout(120)
    browser.set_window_size(1400, 1000)
    browser.get(address)
    until(browser, "document.querySelectorAll('.jp-Cell .cm-content').length === 2")
    until(browser, "document.body.innerText.includes('Idle')")
    run(0)
    until(browser, "document.querySelector('.discs-lab .title')?.textContent.includes('9 discs')")
    with device(browser, 1400, 1000, prefers_color_scheme="dark", prefers_reduced_motion="reduce"):
        ratios = browser.execute_script(CONTRAST.replace("body *", ".discs-lab *"))
        assert min(ratio for _, ratio in ratios) >= 4.5, ratios
        assert (
            ask(browser, "getComputedStyle(document.querySelector('.discs-lab')).backgroundColor") == "rgb(252, 252, 250)"
        )  # as JupyterLab is
    time, energy = (f"document.querySelector('.discs-lab .{name}').textContent" for name in ("time", "numbers"))
    browser.find_element("xpath", "//button[.='Step']").click()  # less motion is asked for, so the discs wait
    until(browser, f"{time} === 't = 0.01'")
    before = ask(browser, energy)
    slider = browser.find_element("css selector", ".discs-lab [aria-label^=torsion]")
    slider.send_keys(keys.ARROW_RIGHT * 5)  # keys of the lab that the notebook leaves alone
    until(browser, f"{energy} !== {before!r}")
    browser.find_element("css selector", ".discs-lab .stage").send_keys(" ")
    until(browser, f"{time} > 't = 0.10'")
    assert ask(browser, "document.querySelectorAll('.jp-Notebook .jp-Cell').length") == 2
    run(1)
    until(browser, "/Solution\\(\\d+ frames of 9 discs/.test(document.querySelector('.jp-Notebook').innerText)")
