"""N discs converge to the field: the measured orders on the paper's scene."""

import csv

import numpy as np
import pytest

from compare import convergence, lump
from compare.results import write_csv
from continuum import breathing_ring, solve, untwisting_rod

pytestmark = pytest.mark.slow


def test_consistent_ends_converge_at_order_two(paper_field):
    study = convergence(untwisting_rod(), (129, 257, 513), "consistent", field=paper_field, progress=False)
    assert study.order.shape == (2, 3)
    assert (study.order >= 1.9).all(), study.table()
    assert (study.order <= 2.4).all(), study.table()
    assert study.error[-1].max() < 5e-4


def test_plain_springs_tend_to_order_one(paper_field):
    study = convergence(untwisting_rod(), (65, 129, 257, 513), "springs", field=paper_field, progress=False)
    assert (study.order <= 1.0).all(), study.table()
    assert (np.diff(study.order, axis=0) > 0).all(), study.table()
    assert (study.order[-1] > 0.85).all(), study.table()
    assert (study.error[-1] > 1e-2).all()


def test_time_error_is_far_below_the_differences(paper_field):
    scene = untwisting_rod()
    a = convergence(scene, (129,), "consistent", field=paper_field, progress=False)
    b = convergence(scene, (129,), "consistent", field=paper_field, dt=a.dt / 2, progress=False)
    assert np.abs(a.error - b.error).max() < 1e-3 * a.error.min()


def test_rings_need_no_ends(rolling, tmp_path):
    study = convergence(breathing_ring(rolling), (16, 24, 48), tol=1e-6, progress=False)
    assert study.ends == "ring"
    assert study.order == pytest.approx(2.0, abs=0.05)
    study.plot(tmp_path / "ring.png")
    assert (tmp_path / "ring.png").stat().st_size > 10_000


def test_table_and_csv_hold_the_same(paper_field, tmp_path):
    scene = untwisting_rod()
    studies = [convergence(scene, (9, 17), ends, field=paper_field, progress=False) for ends in ("springs", "consistent")]
    write_csv(tmp_path / "table.csv", studies)
    with (tmp_path / "table.csv").open() as file:
        rows = list(csv.reader(file))
    assert tuple(rows[0]) == studies[0].columns
    assert len(rows) == 5
    assert float(rows[2][3]) == pytest.approx(studies[0].error[1, 0], rel=1e-3)
    for cell in rows[1]:
        assert cell in studies[0].table()


def test_lump():
    scene = untwisting_rod("unit", radius=0.7)
    problem = lump(scene, 64, "consistent")
    assert (problem.chain.n, problem.chain.rolling, problem.duration) == (64, "unit", 4.5)
    assert problem.chain.w.sum() == pytest.approx(4.0)
    with pytest.raises(ValueError, match="at least 3"):
        lump(scene, 2)
    with pytest.raises(ValueError, match="increasing whole numbers of discs; got"):
        convergence(scene, (33, 17), progress=False)
    with pytest.raises(ValueError, match="increasing whole numbers of discs; got"):
        convergence(scene, (17.5, 33), progress=False)
    early = solve(scene, 1e-2, frames=[0.0, 1.0], progress=False)
    for field in (early, solve(scene, method="leapfrog", progress=False)):
        with pytest.raises(ValueError, match=r"field must be solve\(scene, tol\) of this scene up to t = 4.5, with an error"):
            convergence(scene, (9, 17), field=field, progress=False)
