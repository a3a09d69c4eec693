"""The code in the documents runs."""

import re
import runpy
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent


@pytest.mark.parametrize("path", sorted(ROOT.glob("*.md")) + sorted((ROOT / "docs").glob("*.md")), ids=lambda p: p.name)
def test_python_blocks_run(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for block in re.findall(r"```python\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL):
        exec(compile(block, str(path), "exec"), {})


@pytest.mark.parametrize("path", sorted(ROOT.glob("*.md")) + sorted((ROOT / "docs").glob("*.md")), ids=lambda p: p.name)
def test_links_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", path.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (path.parent / target).exists(), target


def test_readme_has_an_example():
    assert (ROOT / "README.md").read_text(encoding="utf-8").count("```python") == 1


def test_the_paper_has_the_length_sections_and_citations_that_are_asked_for():
    build = runpy.run_path(str(ROOT / "paper" / "build.py"))
    text, bibliography = ((ROOT / "paper" / name).read_text(encoding="utf-8") for name in ("paper.md", "paper.bib"))
    build["check"](text, bibliography)
    for changed, message in (
        (text.replace("[@Gazzola2018]", "[@Nobody2018]"), "not in paper.bib: .'Nobody2018'.; .* not cited: .'Gazzola2018'"),
        (text.replace("# State of the field", "# Others"), "lacks the sections State of the field"),
        (text[:4000], "must have 750 to 1750 words"),
    ):
        with pytest.raises(ValueError, match=message):
            build["check"](changed, bibliography)
