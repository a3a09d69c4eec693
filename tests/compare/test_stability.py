"""Hard cases: every expectation is met at small size, failures are marked, and interrupted tables continue."""

import csv
import os
import signal
import time
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from compare import lump, stability
from compare.__main__ import main
from compare.hardcases import table as stability_table
from compare.hardcases.cases import cases
from compare.hardcases.problems import rolling_waves
from compare.hardcases.runs import CONSERVING, EXPLICIT, FIXED, GAUSS, OURS, PEERS, RADAU, USUAL_METHODS, Expectation, Found
from compare.hardcases.table import Row, Stability
from compare.sweeps import read
from continuum import untwisting_rod
from continuum.dispersion import growth
from continuum.scenes import rolling_rod
from discs import simulate

pytestmark = pytest.mark.slow

SMALL = cases(quick=True)
TABLED = (*FIXED, "auto")  # default runs are a test of their own
FAILS = {("rolling straight rod, unit law", "rk4")}  # Runge and Kutta's scheme damps the waves it does not resolve
# would take longer than they are given
SLOW = {("rounding", "N = 1025", method) for method in ("leapfrog", "mclachlan-perlmutter", "rk4")}


@pytest.fixture(scope="module")
def table():
    """Every case by every method of ours."""
    with ThreadPoolExecutor(1) as here:
        return stability(True, methods=(*TABLED, *RADAU), seconds=4.0, executor=here, progress=False)


def test_ours_do_as_expected_but_for_what_is_known(table):
    assert {(row.case, row.method) for row in table.failures} == FAILS
    assert len(table.rows) == sum(method in case.methods for case in SMALL for method in (*TABLED, *RADAU))
    assert {(row.case, row.setting, row.method) for row in table.rows if not row.expected} <= SLOW


def test_no_run_is_wrong_without_a_warning():
    """Steps of 64 k are far too long for the motion, which converged steps do not show; the default run is near."""
    with ThreadPoolExecutor(1) as here:
        names = ("step above the explicit limit", "strong twist")
        study = stability(True, names, ("midpoint", "default"), seconds=4.0, executor=here, progress=False)
    assert not study.unsaid
    assert " 0 gave no warning." in study.promise()
    at = {(row.setting, row.method): row for row in study.rows if row.method == "default" or row.case == names[0]}
    for n in (33, 129):
        short, long = (at[f"N = {n}, h = {multiple} k", "midpoint"] for multiple in (1, 64))
        assert short.found.off < 0.05
        assert long.wrong
        assert long.warned
    default = [row.found for row in study.rows if row.method == "default"]
    assert len(default) == 2
    assert all(found.off < 1e-3 and not found.says for found in default)


def test_a_run_that_is_wrong_without_a_warning_is_told():
    case = SMALL[0]
    quiet, loud = Found("done", off=0.06, energy=1e-9), Found("done", off=0.06, energy=1e-9, says="too long")
    right, lost, slow = Found("done", off=0.04, energy=1e-9), Found("done", energy=np.nan), Found("cut off", off=0.5)
    by = {"midpoint": quiet, "suzuki4": loud, "gauss4": right, "gauss6": lost, "gauss8": slow, "SciPy BDF": quiet}
    rows = [Row(case.name, case.setting, method, "holds", "yes", found) for method, found in by.items()]
    rows += [Row("long time", "", "default", "holds", "yes", Found("done", off=off, energy=0.0)) for off in (5e-4, 2e-3)]
    study = Stability(rows, SMALL)
    assert [row.method for row in study.unsaid] == ["midpoint", "gauss6", "default"]
    assert "3 have an error above 5 %" in study.promise()
    assert "3 gave no warning:\n* step above the explicit limit, N = 33, h = 1 k, `midpoint`" in study.promise()


def one(table, name, setting, method):
    (row,) = (r for r in table.rows if (r.case, r.method) == (name, method) and r.setting.startswith(setting))
    return row


def test_explicit_methods_above_their_limit_stop_and_name_time_and_disc(table):
    for row in (r for r in table.rows if r.case == "step above the explicit limit"):
        if row.method in EXPLICIT:
            assert row.verdict == "stopped"
            assert row.found.t > 0
            assert "above the stability limit" in row.found.says
            assert "disc" in row.found.says
        elif row.method in CONSERVING:
            assert row.found.energy < 1e-11


def test_the_parasitic_mode_comes_sooner_with_more_discs(table):
    onsets = [one(table, "parasitic mode", f"N = {n}", "leapfrog").found.note for n in (17, 33, 65)]
    assert "from" not in onsets[0]
    t33, t65 = (float(note.split("t = ")[1]) for note in onsets[1:])
    assert 30 < t33 < 45  # measured 37.5 and 8 by another sampling
    assert 7 < t65 < 9


def test_waves_grow_as_the_relation_says():
    for law, n, stiffness, time_, bound in (
        ("field", 33, 0.7, 4.0, 0.005),
        ("field", 17, 0.0, 20 / 17, 0.005),
        ("unit", 33, 0.7, 4.0, 1e-4),  # where none grows, amplitudes are kept
    ):
        _, waves = rolling_waves(n, law, stiffness, time_, "gauss6", np.inf, 0.1)
        rod = rolling_rod(bending_stiffness=stiffness, radius=0.7, density=1.3, spin_inertia=0.6).rod
        np.testing.assert_allclose(waves.relation, growth(rod, waves.q, 1.0, law, rod.length / n))
        np.testing.assert_allclose(waves.measured, waves.relation, atol=bound)
        assert waves.q[-1] > 0.9 * np.pi * n / rod.length


def test_the_limp_rod_is_said_to_be_ill_posed(table):
    limp = [row for row in table.rows if row.case == "limp rolling rod, field law"]
    assert {row.method for row in limp} == set(FIXED)
    assert all("ill posed" in row.found.says for row in limp)


@pytest.mark.parametrize("method", TABLED)
def test_the_ring_stops_in_time(table, method):
    assert one(table, "collapsing ring, unit law", "N = 32", method).found.error < 0.05  # some steps of 0.015


def test_points_turn_as_the_exact_wave_by_every_method(table):
    found = {row.method: row.found for row in table.rows if row.setting == "R = 0"}
    assert set(found) == set(TABLED)
    assert all(found[method].error < 1e-6 for method in ("suzuki4", "kahanli6", "gauss4", "gauss6", "gauss8", "rk4", "auto"))


def test_radau_methods_do_not_ring(table):
    """After 45 steps modes that decay in far less than one have half of their rates by the midpoint rule, none by Radau methods."""
    rates = {row.method: row.found.error for row in table.rows if row.case == "fast decay"}
    assert rates["midpoint"] > 0.3
    assert rates["gauss6"] > 0.1
    assert rates["radau3"] < 1e-4
    assert rates["radau5"] < 1e-5
    assert {row.method for row in table.rows if row.case == "loads"} >= set(RADAU)


def test_rounding(table):
    for method in (*CONSERVING, *GAUSS):
        assert one(table, "rounding", "N = 1025", method).found.error < 1e-9


@pytest.mark.long
def test_peers():
    """A peer computes the same motion; its energy is that at the end; a slow one reports the time it reached."""
    (case,) = (c for c in SMALL if c.setting == "N = 3")
    (turned,) = (c for c in SMALL if c.key == "rounding, N = 257")
    (long,) = (c for c in SMALL if c.name == "long time")
    for name in PEERS:
        found = case.run(name, 10.0)
        assert found.outcome in ("done", "-")
        if found.outcome == "done":
            assert found.error < 1e-3
            assert 1e-13 < found.energy < 1e-4
            slow = long.run(name, 0.2)
            assert slow.outcome == "cut off"
            assert 0 < slow.t < 150
            assert slow.seconds < 1
            assert "it would need over 0.2 s" in slow.says
    found = turned.run("SciPy Radau", 10.0)
    assert 1e-12 < found.error < 1e-4  # its tolerance, not rounding


@pytest.mark.parametrize(("name", "method", "limit"), [("long time", "leapfrog", 0.01), ("rough random roll", "auto", 0.05)])
def test_slow_runs_of_ours_are_not_begun(name, method, limit):
    """They take 0.03 and 0.5 s on a fast core."""
    (case,) = (c for c in SMALL if c.name == name)
    found = case.run(method, limit)
    assert found.outcome == "cut off"
    assert "predicted" in found.says
    assert found.seconds > 0.01


def test_verdicts():
    exact = Expectation("exact", "", energy=1e-10, error=0.1, must=("midpoint",))
    good, off = Found("done", energy=1e-12, error=0.01), Found("done", energy=0.5)
    assert exact.verdict("midpoint", good) == "passed"
    assert exact.met("midpoint", good) is True
    assert exact.met("midpoint", Found("done", energy=1e-9)) is False
    assert exact.met("rk4", Found("done", energy=1e-9)) is True
    assert exact.verdict("rk4", off) == "lost"
    assert exact.met("rk4", off) is False
    assert exact.met("rk4", off._replace(unconverged=1)) is True
    assert exact.verdict("rk4", Found("done", energy=np.nan)) == "lost"
    assert exact.verdict("rk4", good._replace(error=0.2)) == "lost"
    assert exact.met("rk4", Found("stopped")) is True
    assert exact.met("midpoint", Found("stopped")) is False
    assert exact.met("SciPy BDF", off) is None
    assert exact.met("midpoint", Found("cut off")) is None
    refuse = Expectation("must refuse", "")
    assert refuse.met("midpoint", good) is False
    assert refuse.met("midpoint", Found("stopped")) is True
    assert exact.met("rk4", Found("refused")) is False
    aloud = Expectation("bound", "", energy=1e-10, error=0.1, must=("midpoint",), aloud=True)
    wrong = good._replace(error=0.9)
    assert [aloud.met("midpoint", f) for f in (good, wrong, wrong._replace(unconverged=1))] == [True, False, True]
    assert aloud.met("midpoint", Found("done", energy=1e-9, error=0.9, unconverged=1)) is False
    assert exact.met("midpoint", wrong._replace(unconverged=1)) is False
    told = Expectation("must refuse", "", says="heading")
    assert told.met("rk4", Found("stopped", says="a disc lost its heading")) is True
    assert told.met("rk4", Found("stopped", says="values are not finite")) is False


def test_a_failing_method_is_shown_as_one(monkeypatch):
    """A kernel that loses energy: bold in the grid, and told in the summary."""

    def leaky(problem, *arguments, **keywords):
        with warnings.catch_warnings():  # the step is too long, which is said
            warnings.simplefilter("ignore")
            run = simulate(problem, *arguments, **keywords)
        run.stats["step_error"] = 0.0
        run.energy[-1] *= 1.5
        return run

    monkeypatch.setattr("compare.hardcases.runs.simulate", leaky)
    with ThreadPoolExecutor(1) as here:
        found = stability(True, names=("rough random roll",), methods=("midpoint",), seconds=9.0, executor=here, progress=False)
    assert found.failures
    assert "**LOST 0.5**" in found.grid()
    assert "1 not as expected:\n* rough random roll, N = 65, `midpoint`: lost" in found.summary()


def test_table_has_every_case_and_method():
    keys = [case.key for case in cases()]
    assert len(set(keys)) == len(keys)
    assert {case.name for case in cases()} == {case.name for case in SMALL}
    assert all(case.what and case.expectation.words for case in SMALL)
    everywhere = [case for case in SMALL if case.methods == (*USUAL_METHODS, *PEERS)]
    assert len(everywhere) > 12
    assert simulate(lump(untwisting_rod(duration=0.1), 9), "midpoint", progress=False).stats["method"] in OURS


@pytest.fixture
def few(monkeypatch):
    """Two sorts of cases only, run in this process, and once interrupted; the orders that are run."""
    found = [c for c in SMALL if c.name == "few discs" or c.setting == "N = 33, h = 1 k"]
    ran, run = [], stability_table._run
    # kept there, where the archive does not look: the function is the same all the time
    monkeypatch.setattr(stability_table, "ran", ran, raising=False)
    monkeypatch.setattr(stability_table, "interrupts", [signal.SIGINT], raising=False)

    def noted(order):
        stability_table.ran.append(order)
        if len(stability_table.ran) == 20 and stability_table.interrupts:
            os.kill(os.getpid(), stability_table.interrupts.pop())
            time.sleep(0.5)
        return run(order)

    monkeypatch.setattr(stability_table, "cases", lambda quick: found)
    monkeypatch.setattr(stability_table, "_listed", lambda quick: {c.key: c for c in found})
    monkeypatch.setattr(stability_table, "background", lambda: ThreadPoolExecutor(1))
    monkeypatch.setattr(stability_table, "_run", noted)
    return ran


@pytest.mark.long
def test_command_line_keeps_what_an_interrupt_leaves_and_goes_on(tmp_path, capsys, few):
    """An interrupt stops the processes of a sweep, see test_sweeps: here it comes during the 20th run."""
    command = ["stability", "--quick", "--quiet", "--seconds", "0.5", "--out", str(tmp_path)]
    assert main(command) == 130
    assert "has the results so far; the same command continues" in capsys.readouterr().err
    before = [result.case for result in read(tmp_path / "stability.jsonl")]
    assert 5 <= len(rows(tmp_path)) == len(before) <= 19
    few.clear()
    assert main(command) == 0
    assert few
    assert not any(order in before for order in few)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["stability.csv", "stability.md", "stability.png"]
    assert "refused" in capsys.readouterr().out
    assert {row["case"] for row in rows(tmp_path)} == {"few discs", "step above the explicit limit"}
    assert len(rows(tmp_path)) == len(before) + len(few)
    assert "## What is expected" in (tmp_path / "stability.md").read_text(encoding="utf-8")


def rows(folder):
    return list(csv.DictReader((folder / "stability.csv").read_text(encoding="utf-8").splitlines()))


def test_bad_input():
    with pytest.raises(ValueError, match="names must be one of 'step above"):
        stability(names=("easy",))
    with pytest.raises(ValueError, match="methods must be one of 'midpoint'"):
        stability(methods=("euler",))
    with pytest.raises(ValueError, match="seconds must be a positive finite number"):
        stability(seconds=0)
