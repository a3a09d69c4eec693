"""Limits of discs with own headings: the files, and the rates in them."""

import csv
import re

import numpy as np
import pytest

from compare.limits import limits

pytestmark = pytest.mark.slow

UNIT = "unit law, true curvature"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The folder and the text of one run, which every test reads."""
    folder = tmp_path_factory.mktemp("limits")
    return folder, limits(folder, progress=False, n=(9, 17), tol=1e-6)


def rows(folder, name):
    with (folder / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_they_write_their_files(written):
    folder, text = written
    assert sorted(p.name for p in folder.iterdir()) == ["headings.csv", "limits.csv", "limits.png", "locking.csv"]
    assert UNIT in text
    links, elements = ([row for row in text.splitlines() if re.match(rf" +{order}  +\d+ ", row)] for order in (2, 4))
    assert float(links[-1].split()[2]) <= 1.1e-6
    assert 4 * int(elements[-1].split()[1]) < int(links[-1].split()[1])


def test_they_tend_to_the_unit_law_with_true_curvature(written):
    """G -> infinity, J = 1/G: like 1/G."""
    found = [row for row in rows(written[0], "limits.csv") if row["against"] == UNIT and float(row["G"]) >= 40]
    distance = np.array([[float(row[f"distance {name}"]) for name in ("x", "y", "theta")] for row in found])
    assert [(row["A"], row["G"]) for row in found] == [("0", "40"), ("0", "160")]
    assert np.log(distance[1] / distance[0]) / np.log(4) == pytest.approx(-1.0, abs=0.15), distance
    assert distance[1].max() < 4e-3


def test_they_do_not_tend_to_the_paper_s_laws(written):
    """Where the distance to their own limit is 0.003, that to the paper's laws is 0.1 and 0.4."""
    apart = {row["against"]: float(row["distance theta"]) for row in rows(written[0], "limits.csv") if row["G"] == "160"}
    assert min(distance for against, distance in apart.items() if against != UNIT) > 20 * apart[UNIT]


def test_they_lock(written):
    """A = G -> infinity: the distance that any disc moves falls like A**(-1/5)."""
    reach = {float(row["A = G"]): float(row["largest motion"]) for row in rows(written[0], "locking.csv")}
    assert np.log(reach[1e4] / reach[1e2]) / np.log(100) == pytest.approx(-0.2, abs=0.02)
