"""The page of the main job, from files and studies made by hand."""

import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from compare import main_page
from compare.results import Study
from continuum import untwisting_rod

PICTURES = ["convergence.png", "energy.png", "limits-of-all.png", "motion.png"]


def study(ends, order):
    """Errors of 9, 17 and 33 discs that fall with an order exactly."""
    scene, n = replace(untwisting_rod(), duration=2.5), np.array([9, 17, 33])
    k = 4.0 / (n - 1)
    error = k[:, None] ** order * np.array([0.1, 0.2, 0.3, 0.7])
    return Study(scene, ends, n, k, error, 1e-9, 0.01, ("velocity",), (1e-9,))


@pytest.fixture
def folder(tmp_path):
    """The pictures of the main job, white pixels."""
    for name in PICTURES:
        Image.new("RGB", (1, 1), "white").save(tmp_path / name)
    return tmp_path


def test_page_shows_every_picture_and_table(folder):
    """With all parts: each picture is inside, the links lead to the data, tables have the numbers of studies and files."""
    for name in ("limits.png", "speed.png"):
        Image.new("RGB", (1, 1), "white").save(folder / name)
    for name, text in (("headings", "own,9\nown,0.0371"), ("limits", "G,J\n40,0.0252"), ("locking", "A,reach\n10,1.7173")):
        (folder / f"{name}.csv").write_text(text)
    speeds = "| N | ms |\n| - | - |\n| 33 | 7.25 |"
    path = main_page.write(folder, [study("springs", 1), study("consistent", 2)], True, speeds, timed=True)
    assert path == folder / "index.html"
    text = path.read_text(encoding="utf-8")
    assert text.count('src="data:image/png;base64,') == text.count("<img") == 6
    links = set(re.findall(r'<a href="([^"]+)"', text))
    assert links == {"convergence.csv", "speed.csv", "headings.csv", "limits.csv", "locking.csv"}
    for cell in ("consistent", "33", "2.00", f"{0.3 / 8:.3e}", f"{0.7 / 64:.2e}", "0.0371", "0.0252", "1.7173", "7.25"):
        assert f"<td>{cell}</td>" in text
    assert "t = 0 to 2.5" in text


def test_page_has_only_what_was_made(folder):
    text = main_page.write(folder, [study("springs", 1)], speeds="none, as nothing moves").read_text(encoding="utf-8")
    assert "none, as nothing moves" in text
    assert "own headings" not in text
    assert text.count("<img") == 4


def test_missing_picture_leaves_no_page(folder):
    (folder / "energy.png").unlink()
    with pytest.raises(FileNotFoundError, match=r"energy\.png"):
        main_page.write(folder, [study("springs", 1)])
    assert not (folder / "index.html").exists()
