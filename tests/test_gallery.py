"""The scripts of the gallery are short, run by themselves, and each draws its picture."""

import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image

SCRIPTS = sorted((Path(__file__).parent.parent / "docs" / "gallery").glob("*.py"))
names = pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)


def test_there_are_twenty():
    assert len(SCRIPTS) == 20


@names
def test_a_script_is_short_and_has_a_title(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    assert sum(bool(line.strip()) for line in lines) <= 15
    assert lines[0].startswith('"""')
    assert ": " in lines[0]


@pytest.mark.slow
@names
def test_a_script_draws_its_picture(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    with warnings.catch_warnings(action="error"):
        exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), {"__name__": "__main__"})
    plt.close("all")
    (drawn,) = tmp_path.glob(f"{path.stem}.*")
    with Image.open(drawn) as picture:
        assert np.unique(np.asarray(picture.convert("L"))).size > 20  # not blank
