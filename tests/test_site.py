"""The documentation site builds without a warning and needs no other server."""

import importlib
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.discs.conftest import browser  # noqa: F401

pytest.importorskip("mkdocs", reason="needs the group docs")
pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site, built as `make docs` does, but for the lessons' pictures."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    return folder


@pytest.mark.long
def test_nothing_is_fetched_from_other_servers(site):
    pages = list(site.rglob("*.html"))
    assert pages
    for page in pages:
        for tag in re.findall(r"<(?:script|link|img|iframe)\b[^>]*>", page.read_text(encoding="utf-8")):
            assert not re.search(r"""(?:src|href)=["']?(?:https?:)?//""", tag) or "canonical" in tag, f"{page.name}: {tag}"


@pytest.mark.long
def test_reference_has_everything_that_is_exported(site):
    for package in ("discs", "continuum", "compare"):
        index = (site / "reference" / f"{package}.html").read_text(encoding="utf-8")
        module = importlib.import_module(package)
        for name in module.__all__:
            thing = getattr(module, name)
            target = f"{thing.__module__}.html#{thing.__module__}.{thing.__name__}"
            assert f'href="{target}"' in index
            page, anchor = target.split("#")
            assert f'id="{anchor}"' in (site / "reference" / page).read_text(encoding="utf-8")


@pytest.mark.long
def test_reference_tells_parameters_shapes_and_errors(site):
    page = (site / "reference" / "discs.simulation.html").read_text(encoding="utf-8")
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", "", page))
    assert "Parameters:" in text
    assert "show a progress bar for runs of more than a second" in text
    assert "for an unknown method or quantity" in text
    page = (site / "reference" / "discs.solution.html").read_text(encoding="utf-8")
    assert "(F, N), contact points, length." in re.sub(r"<[^>]+>", "", page)


@pytest.mark.long
def test_lessons_are_pages_with_formulas_and_notebooks_to_take_away(site):
    for path in (ROOT / "notebooks").glob("*.ipynb"):
        page = (site / "lessons" / f"{path.stem}.html").read_text(encoding="utf-8")
        assert 'class="arithmatex"' in page
        assert "$$" not in page
        assert (site / "lessons" / path.name).read_bytes() == path.read_bytes()


@pytest.mark.long
@pytest.mark.parametrize("width", [390, 1280])
def test_formulas_are_drawn_on_pages_that_fit(site, browser, width):  # noqa: F811
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride", {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width < 500}
    )
    drawn = 0
    for page in [*site.glob("*.html"), *site.glob("lessons/*.html")]:
        if page.name == "404.html":  # has addresses of a server
            continue
        browser.get(page.as_uri())
        formulas, done, errors, across = browser.execute_script(
            "const all = s => [...document.querySelectorAll(s)];"
            "return [all('.arithmatex').length, all('.arithmatex .katex-html').length, all('.katex-error').map(e => e.title),"
            "document.documentElement.scrollWidth]"
        )
        assert (errors, done, browser.get_log("browser")) == ([], formulas, []), page.name
        assert across <= width, page.name
        drawn += formulas
    assert drawn > 1000


@pytest.mark.long
def test_search_finds_pages_that_are_opened_as_files(site, browser):  # noqa: F811
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    browser.set_window_size(1280, 900)
    browser.get((site / "index.html").as_uri())
    browser.find_element("css selector", ".md-search__form").click()
    browser.find_element("css selector", ".md-search__input").send_keys("vakonomic")
    browser.set_script_timeout(30)
    found = browser.execute_async_script(
        "const done = arguments[0]; const look = () => {"
        "const hits = [...document.querySelectorAll('.md-search-result__link')].map(a => a.href);"
        "hits.length ? done(hits) : setTimeout(look, 50)}; look()"
    )
    assert any("/vakonomic.html" in hit for hit in found)


@pytest.fixture(scope="module")
def docstrings():
    """docs/docstrings.py, which is no package's module."""
    spec = importlib.util.spec_from_file_location("docstrings", ROOT / "docs" / "docstrings.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_house_docstrings_in_the_form_that_griffe_takes(docstrings):
    house = """Run it.

Parameters
----------
n, m : numbers of discs,
    at least 3.

Any units.

Returns
-------
(n,) : energies.
"""
    assert docstrings.translate(house).splitlines() == [
        *("Run it.", "", "Any units.", ""),
        *("Parameters", "----------", "n, m", "    numbers of discs,", "    at least 3.", ""),
        *("Returns", "-------", ":", "    (n,) : energies."),
    ]


def test_powers_are_not_emphasis_and_code_is_left_alone(docstrings):
    text = "K r**2 and **Rolling.** and `a**b`\n\n    r**2 + q**2\n"
    assert docstrings.literal(text) == "K r\\*\\*2 and **Rolling.** and `a**b`\n\n    r**2 + q**2\n"


@pytest.mark.parametrize(
    ("house", "tex"),
    [
        ("rho w r.. = -K r'''' + lambda,   r. = e theta.", r"\rho w \ddot{r} = -K r'''' + \lambda ,\qquad \dot{r} = e \theta ."),
        (
            "M q.. = A^T mu. + e.F - R (p.d_1) q._k/2,",
            r"M \ddot{q} = A ^{\mathsf{T}} \dot{\mu} + e \cdot F - R (p \cdot d_{1}) \dot{q}_{k}/2,",
        ),
        ("c_i = (e_i, 1)/sqrt(m (1 + q_{i+1})**2)", r"c_{i} = (e_{i}, 1)/\sqrt{m (1 + q_{i +1})^2}"),
        ("sum_links beta theta'^2 + int_0^tau dpi,", r"\sum_{\text{links}} \beta \theta '^{2} + \int_{0}^{\tau} d\pi ,"),
        ("<p, xi_Q> = 2 for the end,", r"\langle p , \xi_{Q}\rangle{} = 2 \;\text{for} \;\text{the} \;\text{end} ,"),
        ("a = b,\n        + c.", r"\begin{aligned} & a = b , \\ & \qquad + c. \end{aligned}"),
    ],
)
def test_formulas_become_tex(docstrings, house, tex):
    found = docstrings.formulas(f"Text:\n\n    {house}\n\nMore text.")
    assert re.sub(" ", "", found) == re.sub(" ", "", f"Text:\n\n$$\n{tex}\n$$\n\nMore text.")


@pytest.mark.parametrize("block", ["[a   M^T] [x]", 'scene = "untwisting_rod"', "torque tau    tau psi", "n : number, a = b"])
def test_other_blocks_stay(docstrings, block):
    text = f"Text:\n\n    {block}\n"
    assert docstrings.formulas(text) == text
