"""The names that the project promises, and packages of other people that hide ours."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "public.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `([\w.]+)`: [^|]+ \| (.+) \|$", PAGE, re.MULTILINE)


@pytest.mark.parametrize(("module", "names"), ROWS, ids=[module for module, _ in ROWS])
def test_public_names_are_those_of_the_page(module, names):
    assert sorted(re.findall(r"`(\w+)`", names)) == sorted(importlib.import_module(module).__all__)


def test_the_page_lists_the_three_packages():
    assert {"discs", "continuum", "compare"} <= {module for module, _ in ROWS}


@pytest.mark.slow
@pytest.mark.parametrize(("path", "cure"), [("compare.py", "rename it"), ("continuum/__init__.py", "an environment of its own")])
def test_a_file_that_hides_a_package_is_named(tmp_path, path, cure):
    file = tmp_path / path
    file.parent.mkdir(exist_ok=True)
    file.touch()
    (tmp_path / "script.py").write_text("import discs")
    script = [sys.executable, "-W", "default", str(tmp_path / "script.py")]
    told = subprocess.run(script, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True).stderr
    assert str(file) in told
    assert cure in told
