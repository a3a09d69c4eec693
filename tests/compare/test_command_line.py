"""`python -m compare` as a user meets it."""

import re
import subprocess
import sys
from dataclasses import replace

import pytest

from compare import lump, overview
from compare.__main__ import main
from compare.main_job import quick
from compare.outputs import fresh_files
from continuum import breathing_ring, untwisting_rod
from discs import Gauss8, simulate

pytestmark = pytest.mark.slow

FILES = ["convergence.csv", "convergence.png", "energy.png", "limits-of-all.png", "motion.png"]
PAGE = sorted([*FILES, "index.html"])


def test_main_job(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("compare.main_job.LONG", 1.0)
    out = tmp_path / "new" / "out"
    assert main(["--out", str(out), "--n", "9", "17", "--tol", "1e-3", "--no-limits", "--no-speed", "--quiet"]) == 0
    assert sorted(p.name for p in out.iterdir()) == PAGE
    printed = capsys.readouterr().out
    assert "  17  0.250000  " in printed
    assert printed.splitlines()[-1].endswith(str(out / "index.html"))
    assert (out / "convergence.csv").read_text().startswith("ends,N,k,error x")


def test_limits_are_part_of_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("compare.main_job.LONG", 1.0)
    monkeypatch.setattr("compare.__main__.limits", lambda out, *_, **__: f"limits of {out}")
    monkeypatch.setattr("compare.main_page._own_headings", lambda page: None)
    assert main(["--out", str(tmp_path), "--n", "9", "17", "--tol", "1e-3", "--no-speed", "--quiet"]) == 0
    assert f"limits of {tmp_path}" in capsys.readouterr().out


def test_speed_against_error_is_part_of_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("compare.__main__.overview", lambda *_, **__: [])
    monkeypatch.setattr("compare.__main__.summary", lambda studies: "")
    monkeypatch.setattr("compare.main_page.write", lambda *_, **__: "page")
    for name, few in (("SIZES", (9,)), ("OURS", ("midpoint",)), ("OTHERS", ("SciPy LSODA",)), ("COMPILED", ("midpoint",))):
        monkeypatch.setattr(f"compare.speed.{name}", few)
    monkeypatch.setattr("discs.kernels.background.USUAL", ["compiled"])
    assert main(["--no-limits", "--out", str(tmp_path), "--quiet"]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["speed.csv", "speed.png"]
    assert re.search(r"9 \| 1e-03 \| midpoint \| [\d.]+ ms \| SciPy LSODA \|", capsys.readouterr().out)
    monkeypatch.setattr("discs.kernels.background.USUAL", ["plain"])
    assert main(["--no-limits", "--out", str(tmp_path / "plain"), "--quiet"]) == 0
    assert "a run was plain: it was asked for" in capsys.readouterr().out


def test_another_process_starts_only_where_it_pays(monkeypatch):
    """Not for few discs whose kernels are there."""
    monkeypatch.setattr("discs.kernels.background.USUAL", ["compiled"])
    scene = untwisting_rod()
    simulate(lump(scene, 17), Gauss8(), 0.1, 1, progress=False)  # compiled by now
    assert quick(scene, (17, 33))
    assert not quick(scene, (17, 1025))
    monkeypatch.setattr("discs.kernels.background.USUAL", ["plain"])
    assert not quick(scene, (17, 33))
    monkeypatch.setattr("discs.kernels.background.USUAL", ["auto"])
    monkeypatch.setattr("compare.main_job.kernels", lambda *_: False)
    assert not quick(scene, (17, 33))


@pytest.mark.long  # the paper's scheme with own headings has a kernel of its own
def test_steered_scene(tmp_path, capsys):
    (tmp_path / "steered.toml").write_text('scene = "steered_rod"\nduration = 0.5\nshear_stiffness = 6.0\nradius = 0.7\n')
    out = tmp_path / "out"
    arguments = ["--scene", str(tmp_path / "steered.toml"), "--out", str(out), "--n", "9", "17", "--tol", "1e-5", "--degree", "2"]
    assert main([*arguments, "--no-speed", "--quiet"]) == 0
    assert sorted(p.name for p in out.iterdir()) == PAGE
    text = capsys.readouterr().out
    assert "error phi" in text
    for kind in ("own", "elements"):
        assert re.search(rf"^ *{kind} +17 ", text, re.MULTILINE)


@pytest.mark.long
def test_closed_scene(tmp_path, monkeypatch, capsys):
    (tmp_path / "ring.toml").write_text('scene = "breathing_ring"\nomega = -0.3\nduration = 0.4\nradius = 0.7\n')
    out = tmp_path / "out"
    arguments = ["--scene", str(tmp_path / "ring.toml"), "--out", str(out), "--n", "8", "16", "--tol", "1e-4"]
    assert main([*arguments, "--no-speed", "--quiet"]) == 0
    assert sorted(p.name for p in out.iterdir()) == PAGE
    assert "breathing ring, field law" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--n", "2"], "at least 3"),
        (["--degree", "2"], "degree=2 needs discs with headings of their own"),
        (["--n", "33", "17"], "increasing whole numbers"),
        (["--tol", "-1"], "tol must be a positive"),
        (["--scene", "missing.toml"], "cannot be read"),
        (["--scene", "a.toml", "--rolling", "unit"], "--rolling is for the default scene"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(arguments, message, tmp_path, capsys):
    out = tmp_path / "out"
    assert main([*arguments, "--out", str(out), "--quiet"]) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.startswith("error: ")
    assert printed.err.count("\n") == 1
    assert not out.exists()


def test_motion_that_cannot_go_on(tmp_path, capsys):
    """The ring of the unit law becomes a point: exit code 1, whichever process met it, and nothing written."""
    (tmp_path / "ring.toml").write_text('scene = "breathing_ring"\nrolling = "unit"\nduration = 2.0\n')
    out = tmp_path / "a" / "out"
    assert main(["--scene", str(tmp_path / "ring.toml"), "--out", str(out), "--n", "8", "16", "--quiet"]) == 1
    assert "lost its heading" in capsys.readouterr().err
    assert not out.parent.exists()


def test_overview_without_a_second_process(tmp_path):
    """As a plain function, also of a scene that no process could be sent."""
    scene = replace(breathing_ring(duration=0.2), initial=lambda s: breathing_ring().initial(s))
    overview(scene, tmp_path, (8, 16), 1e-3, progress=False)
    assert sorted(p.name for p in tmp_path.iterdir()) == FILES


@pytest.mark.long
def test_scene_without_motion(tmp_path, capsys):
    (tmp_path / "still.toml").write_text('scene = "untwisting_rod"\ntwist = 0.0\nduration = 0.5\n')
    assert main(["--scene", str(tmp_path / "still.toml"), "--out", str(tmp_path / "out"), "--n", "9", "17", "--quiet"]) == 0
    assert "-" in capsys.readouterr().out


def test_unwritable_out(tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    assert main(["--out", str(tmp_path / "file" / "out"), "--quiet"]) == 2
    assert "--out must be a folder that can be written to" in capsys.readouterr().err
    assert main(["--out", str(tmp_path / "file"), "--quiet"]) == 2
    (tmp_path / "energy.png").mkdir()
    with pytest.raises(ValueError, match="--out contains a folder in place of the file"), fresh_files(tmp_path) as folder:
        (folder / "energy.png").write_text("")


def test_failure_leaves_old_results(tmp_path):
    (tmp_path / "table.csv").write_text("old")

    def write(fail):
        with fresh_files(tmp_path) as folder:
            (folder / "table.csv").write_text("new")
            if fail:
                raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        write(fail=True)
    assert [p.name for p in tmp_path.iterdir()] == ["table.csv"]
    assert (tmp_path / "table.csv").read_text() == "old"
    write(fail=False)
    assert (tmp_path / "table.csv").read_text() == "new"


def test_help():
    run = subprocess.run([sys.executable, "-m", "compare", "--help"], capture_output=True, text=True, check=True)
    assert "--scene FILE.toml" in run.stdout
