"""Runs that tests of files share, and the browser of those of pages."""

import shutil

import pytest

from discs import simulate
from tests.conftest import Model, uneven

FLAGS = """--headless=new --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --window-size=700,600
    --disable-quic --no-first-run --disable-background-networking --disable-component-update
    --disable-sync --disable-dev-shm-usage --force-prefers-reduced-motion"""


@pytest.fixture(scope="module")
def run():
    every = ("velocity", "slope", "contact_force", "modified_energy")
    return simulate(uneven(7, Model("springs", "field")), "leapfrog", 0.004, 6, every, progress=False)


@pytest.fixture
def saved(run, tmp_path):
    run.save(tmp_path / "run.nc")
    return tmp_path / "run.nc"


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
