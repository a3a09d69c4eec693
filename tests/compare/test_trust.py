"""Random scenes: what they are, a small sample of them, and that errors, refusals and slow runs are seen."""

import signal
import time as clock
from dataclasses import replace

import numpy as np
import pytest

from compare import trust as module
from compare.__main__ import main
from compare.random_scenes import KINDS, PARAMETERS, random_scene
from compare.trust import at_most, examine, trust
from compare.trust_table import LEAST, MOST, Row, Trust

pytestmark = pytest.mark.slow

SAMPLE = (5, 7, 10, 14)  # own headings, both laws, free and closed; chosen for their time only


def rows_of(index, seconds=20.0):
    return [Row(*row) for row in examine([0, index, seconds])]


@pytest.mark.parametrize("index", range(2 * len(KINDS)))
def test_scenes_obey_their_ends(index):
    """By one-sided differences at free ends, and across the seam of closed rods."""
    drawn = random_scene(3, index)
    scene, rod = drawn.scene, drawn.scene.rod
    assert drawn.kind == KINDS[index % len(KINDS)]
    assert 0.5 <= scene.duration <= 60
    values = [getattr(rod, name) for name in PARAMETERS]
    assert len(set(values)) == 5
    assert not set(values) & set(PARAMETERS.values())  # none is the paper's
    d = 1e-3 * rod.length
    if scene.closed:
        first, last = (scene.fields(place + d * np.arange(3)) for place in (0.0, rod.length))
        shift = {"x": scene.shift[0], "y": scene.shift[1], "phi": 2 * np.pi * scene.turns}
        for name, value in last.items():
            assert value - shift.get(name, 0.0) == pytest.approx(first[name], abs=1e-9)
        return
    bent = []
    for side in (d * np.arange(8), rod.length - d * np.arange(8)):
        fields = scene.fields(side)
        r = np.polynomial.Polynomial.fit(side, fields["x"] + 1j * fields["y"], 7)
        slope, bend = r.deriv(1)(side[0]), r.deriv(2)(side[0])
        twist, rate = (np.polynomial.Polynomial.fit(side, fields[name], 7).deriv()(side[0]) for name in ("theta", "omega"))
        curvature = abs((slope.conjugate() * bend).imag) / abs(slope) ** 3
        assert abs(slope) == pytest.approx(1.0, abs=1e-6)
        bent.append(curvature * rod.length)
        assert abs(twist) < 1e-6
        assert abs(rate) < 1e-6
    assert (max(bent) < 1e-4) == (drawn.kind != "bent end")


def test_scenes_depend_on_seed_and_index_only():
    s = np.linspace(0, 1, 5)
    a, b, c, d = (random_scene(*numbers).scene.fields(s)["theta"] for numbers in ((5, 4), (5, 4), (5, 14), (6, 4)))
    assert (a == b).all()
    assert not np.allclose(a, c)
    assert not np.allclose(a, d)


@pytest.mark.parametrize("index", SAMPLE)
def test_tolerances_are_kept(index):
    for row in rows_of(index):
        assert row.outcome == "within", row
        assert row.reference_error <= row.tol / LEAST
        assert row.error <= row.tol * (1 + 1 / LEAST)
        assert not row.ratio > MOST, row
        assert not row.unlike > LEAST, row


def test_wrong_fields_are_found_out(monkeypatch):
    """A solver whose fields are off by twice the tolerance, and says that they are not; and one that solves another scene."""
    true = module.solve

    def off(scene, tol, **options):
        found = true(scene, tol, **options)
        return replace(found, theta=found.theta + 2 * tol)

    monkeypatch.setattr(module, "solve", off)
    row = rows_of(14)[0]
    assert row.reference == "chains"
    assert row.outcome == "ABOVE"
    assert row.error == pytest.approx(2 * row.tol, rel=0.2)

    def still(scene, tol, **options):
        found = true(scene, 1e-3, **options)
        return replace(found, theta=0 * found.theta, error_estimate=dict.fromkeys(found.error_estimate, tol))

    monkeypatch.setattr(module, "solve", still)
    row = rows_of(10)[0]
    assert row.reference == "finer"  # as wrong as the field
    assert row.unlike > 100
    assert "unlike the chains: 0:10" in Trust([row], []).summary()


def test_a_finer_field_is_another_run(monkeypatch):
    """A field that errs by far less than its tolerance is within a tenth of it too, and would be held against itself."""
    asked, true = [], module.solve

    def careful(scene, tol, **options):
        asked.append(tol)
        found = true(scene, 1e-5, **options)
        return replace(found, error_estimate=dict.fromkeys(found.error_estimate, tol / 50))

    monkeypatch.setattr(module, "solve", careful)
    assert rows_of(10)[0].reference == "finer"
    assert asked[1] == pytest.approx(asked[0] / 50 / LEAST)


def test_wrong_runs_are_found_out(monkeypatch):
    true = module.simulate

    def off(problem, method, *args, **options):
        found = true(problem, method, *args, **options)
        return found if method != "auto" else replace(found, x=found.x + 3 * options["tol"] * abs(found.x).max())

    monkeypatch.setattr(module, "simulate", off)
    row = rows_of(7)[1]
    assert row.outcome == "ABOVE"
    assert "above: 0:7" in Trust([row], []).summary()


def test_refusals_and_slow_runs_are_told(monkeypatch):
    def refuses(scene, tol, **options):
        raise ValueError("tol is | too small")

    def dawdles(scene, tol, **options):
        while True:
            pass

    monkeypatch.setattr(module, "solve", refuses)
    row = rows_of(7)[0]
    assert (row.outcome, row.says) == ("refused", "ValueError: tol is | too small")
    assert "N = 65 goes on to the end" in row.shown
    assert "tol is \\| too small" in Trust([row], []).table()
    monkeypatch.setattr(module, "solve", dawdles)
    begun = clock.process_time()
    row = rows_of(7, 0.5)[0]
    assert row.outcome == "cut off"
    assert clock.process_time() - begun < 10
    with at_most(50.0):
        pass
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)  # no alarm is left


def test_command_line(tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ["trust", "--scenes", "1", "--first", "7", "--seconds", "20", "--quiet", "--out", str(out)]
    assert main(arguments) == 0
    assert sorted(path.name for path in out.iterdir()) == ["trust.csv", "trust.md"]
    assert "| solve | 1 | 0 | 0 | 0 | 0 |" in capsys.readouterr().out
    assert (out / "trust.csv").read_text().startswith("scene,kind,law,words,duration,by,tol,outcome,error")
    assert main(["trust", "--scenes", "0", "--out", str(out)]) == 2
    assert "scenes must be a whole number of at least 1; got 0" in capsys.readouterr().err


@pytest.mark.long
def test_an_interrupted_run_keeps_what_it_has_found(tmp_path, capsys, monkeypatch):
    out = tmp_path / "out"
    trust(1, first=7, archive=out / "trust.jsonl", progress=False)

    def interrupted(*args, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("compare.commands.trust", interrupted)
    assert main(["trust", "--quiet", "--out", str(out)]) == 130
    assert "the same command continues" in capsys.readouterr().err
    assert (out / "trust.csv").read_text().count("0:7") == 2
    assert (out / "trust.jsonl").exists()
