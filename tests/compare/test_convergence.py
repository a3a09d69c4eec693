"""N discs converge to the field: the measured orders on the paper's scene."""

import csv
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from compare import convergence, lump
from compare.load_limits import fitting_twist
from compare.results import Study, write_studies
from compare.study import apart
from continuum import Scene, breathing_ring, rolling_rod, solve, steered_rod, untwisting_rod
from discs import Gauss8, simulate
from discs.loads import Damping, Rest, Slope

pytestmark = pytest.mark.slow


def test_consistent_ends_converge_at_order_two(paper_field):
    study = convergence(untwisting_rod(), (129, 257, 513), "consistent", field=paper_field, progress=False)
    assert study.order.shape == (2, 3)
    assert (study.order >= 1.9).all(), study.table()
    assert (study.order <= 2.4).all(), study.table()
    assert study.error[-1].max() < 5e-4


def test_order_is_two_where_the_twist_fits_the_free_ends(paper_field):
    """The paper's twist violates the second time derivative of an end condition; orders are above 2 up to thousands of discs."""
    scene = replace(untwisting_rod(), initial=fitting_twist)
    fitting = convergence(scene, (65, 129, 257, 513), "consistent", tol=1e-7, progress=False)
    assert np.abs(fitting.order[-1] - 2).max() < 0.02, fitting.table()
    assert fitting.order_spread.max() < 0.05
    papers = convergence(untwisting_rod(), (129, 257, 513), "consistent", field=paper_field, progress=False)
    assert papers.order[-1].min() > 2.1, papers.table()


def test_spread_of_orders_is_the_largest_change_of_the_last_one():
    k = 0.5 ** np.arange(5.0)
    error = np.cumprod(np.concatenate([[1.0], 0.5 ** np.array([9.0, 1.8, 2.1, 2.0])]))[:, None] * np.ones(3)
    study = Study(untwisting_rod(), "springs", 2 ** np.arange(4, 9) + 1, k, error, 0.0, 0.1)
    assert study.order_spread == pytest.approx([0.2] * 3)
    assert np.isnan(replace(study, n=study.n[:2], k=k[:2], error=error[:2]).order_spread).all()


def test_orders_that_are_those_of_the_field_are_not_shown():
    """Errors 4^-j + floor: at 129 discs the floor is a third of the error and more."""
    k, floor = 0.5 ** np.arange(4.0), 0.011
    error = np.tile((0.25 ** np.arange(4.0) + floor)[:, None], 4)
    study = Study(untwisting_rod(), "consistent", 2 ** np.arange(4, 8) + 1, k, error, 0.0, 0.1, ("velocity",), (floor,))
    assert study.wants_rows()[1][-2:] == ("1.83 ± 0.13 to 65", "1e-02")
    assert replace(study, floors=(1e-4,)).wants_rows()[1][-2] == "1.46 ± 0.49"
    assert replace(study, floors=(1.0,)).wants_rows()[1][-2] == "-"
    assert replace(study, n=study.n[:2], k=k[:2], error=error[:2]).wants_rows()[1][-2] == "1.95"


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


def test_elements_converge_at_order_four(tmp_path):
    scene = steered_rod()
    field = solve(scene, 1e-9, frames=1, progress=False)
    studies = [convergence(scene, (33, 65, 129), field=field, progress=False, degree=degree) for degree in (1, 2)]
    assert studies[1].order == pytest.approx(3.95, abs=0.07), studies[1].table()
    assert studies[1].error[-1].max() < 5e-7
    links, elements = (study.reaching(1e-6) for study in studies)
    assert 1100 < links < 1250
    assert 100 < elements < 115
    studies[0].plot(tmp_path / "orders.png", studies[1])
    assert (tmp_path / "orders.png").stat().st_size > 10_000


@pytest.mark.long
def test_elements_of_varying_loaded_rods_and_of_rings_have_order_four():
    """By what twice as many discs change. (A density with a slope at an end would make the initial twist rough there.)"""
    q = np.pi / 4
    varying = {
        "density": lambda s: 1 + 0.3 * np.cos(2 * q * s),
        "shear_stiffness": lambda s: 9 + 3 * np.cos(q * s),
        "torsion_stiffness": lambda s: 0.8 + 0.2 * np.cos(q * s),
        "radius": lambda s: 1 + 0.2 * np.cos(q * s),
    }
    loads = Rest(curvature=lambda s: 0.3 * np.sin(q * s), signal=lambda t: (t / 2) ** 6), Damping(rolling=0.1), Slope(0.2, 0.1)

    def circle(s):
        return np.sin(s), 1 - np.cos(s), 0.4 * np.sin(s), 0.5 + 0.2 * np.cos(s), s, 0 * s

    around = replace(steered_rod().rod, length=2 * np.pi)
    ring = Scene(rod=around, initial=circle, duration=1.0, rolling="unit", closed=True, turns=1)
    method = Gauss8(tolerance=1e-13)
    rod = replace(steered_rod(duration=2.0, **varying), loads=loads)
    for scene, sizes, back in ((rod, (65, 129, 257), 1), (ring, (32, 64, 128, 256), 2)):  # around a ring orders go up and down
        runs = [simulate(lump(scene, n, degree=2), method, scene.duration / 150, frames=1, progress=False) for n in sizes]
        for name in ("x", "y", "theta", "phi"):
            changes = [np.abs(a - b[::2]).max() for a, b in pairwise(getattr(run, name)[-1] for run in runs)]
            assert np.log2(changes[0] / changes[-1]) / back == pytest.approx(3.95, abs=0.2), (name, changes)


def test_rings_need_no_ends(rolling, tmp_path):
    study = convergence(breathing_ring(rolling), (16, 24, 48), tol=1e-6, progress=False)
    assert study.ends == "ring"
    assert study.order == pytest.approx(2.0, abs=0.05)
    study.plot(tmp_path / "ring.png")
    assert (tmp_path / "ring.png").stat().st_size > 10_000


def test_a_straight_rod_without_ends_is_compared_up_to_its_shift():
    """A period further along, x is greater by the length, and all else is the same: 20 discs are near 48, at the seam too."""
    scene = rolling_rod("unit", duration=0.2, amplitude=0.3, length=3.1)
    few, many = (simulate(lump(scene, n), dt=0.02, frames=1, engine="plain", progress=False) for n in (20, 48))
    assert np.abs(many.x[-1] - many.s).max() > 1e-4
    assert (apart(scene, few, many) < 0.003).all()


@pytest.mark.parametrize("progress", [False, True])
def test_a_study_of_own_headings_says_so_and_shows_a_bar_if_it_is_asked_to(monkeypatch, progress):
    bars = []
    monkeypatch.setattr("compare.study.tqdm", lambda chains, disable, **_: bars.append(disable) or chains)
    study = convergence(steered_rod(duration=0.2), (5, 9), tol=1e-2, dt=0.02, progress=progress)
    assert study.ends == "own"
    assert bars == [not progress]


def test_table_and_csv_hold_the_same(paper_field, tmp_path):
    scene = untwisting_rod()
    studies = [convergence(scene, (9, 17), ends, field=paper_field, progress=False) for ends in ("springs", "consistent")]
    write_studies(tmp_path / "table.csv", studies)
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
    for sizes in ((33, 17), (17.5, 33), ((9, 17),), ()):
        with pytest.raises(ValueError, match="increasing whole numbers of discs; got"):
            convergence(scene, sizes, progress=False)
    early = solve(scene, 1e-2, frames=[0.0, 1.0], progress=False)
    for field in (early, solve(scene, method="leapfrog", progress=False)):
        with pytest.raises(ValueError, match=r"field must be solve\(scene, tol\) of this scene up to t = 4.5, with an error"):
            convergence(scene, (9, 17), field=field, progress=False)
