"""`python -m continuum` as a user meets it."""

import subprocess
import sys

import pytest

from continuum import breathing_ring, solve
from continuum.__main__ import main
from discs import load
from tests.discs.test_archive import same

pytestmark = pytest.mark.slow


@pytest.fixture
def ring(tmp_path):
    path = tmp_path / "ring.toml"
    path.write_text('scene = "breathing_ring"\nomega = -0.3\nduration = 0.4\nradius = 0.7\n')
    return path


def test_solve_and_info(ring, tmp_path, capsys):
    path = tmp_path / "field.nc"
    asked = ["--tol", "1e-3", "--frames", "3", "--want", "slope", "contact_force"]
    assert main(["solve", "--scene", str(ring), *asked, "--save", str(path), "--quiet"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("field of the breathing ring on ")
    assert "estimated error: x " in printed
    field = solve(
        breathing_ring(omega=-0.3, duration=0.4, radius=0.7), 1e-3, frames=3, want=("slope", "contact_force"), progress=False
    )
    found = load(path)
    found.stats["seconds"] = field.stats.get("seconds")
    if field.stats.get("seconds") is None:
        del found.stats["seconds"]
    same(field, found)
    assert main(["info", str(path)]) == 0
    told = capsys.readouterr().out
    assert "name = breathing ring" in told
    assert "radius = 0.7" in told
    assert main(["solve", "--scene", str(ring), "--tol", "1e-3", "--save", str(path), "--quiet"]) == 2
    assert "exists; give --overwrite" in capsys.readouterr().err


def test_the_papers_scheme(capsys):
    assert main(["solve", "--method", "leapfrog", "--n", "12", "--dt", "0.01", "--quiet"]) == 0
    assert "method leapfrog: dt = 0.01, 450 steps" in capsys.readouterr().out


def test_discs_of_a_scene(ring, tmp_path, capsys):
    path = tmp_path / "run.nc"
    command = ["discs", "--scene", str(ring), "--n", "8", "--dt", "0.05", "--frames", "3", "--save", str(path), "--quiet"]
    assert main(command) == 0
    assert capsys.readouterr().out.startswith("8 discs, 3 frames, t = 0 to 0.4")
    assert load(path).problem.chain.ends == "ring"
    assert main([*command[:4], "9", *command[5:]]) == 2
    assert "n differs: 8 there, 9 here" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["solve", "--scene", "missing.toml"], "cannot be read"),
        (["solve", "--tol", "-1"], "tol must be a positive"),
        (["solve", "--n", "12"], "belong to method='leapfrog'"),
        (["solve", "--frames", "0"], "frames must be a whole number"),
        (["solve", "--method", "magic"], "method must be one of"),
        (["discs", "--n", "1"], "at least 3"),
        (["info", "missing.nc"], "cannot be read"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(arguments, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.startswith("error: ")
    assert printed.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_motion_that_cannot_go_on(tmp_path, capsys):
    (tmp_path / "ring.toml").write_text('scene = "breathing_ring"\nrolling = "unit"\nduration = 2.0\n')
    assert main(["discs", "--scene", str(tmp_path / "ring.toml"), "--n", "8", "--quiet"]) == 1
    assert "lost its heading" in capsys.readouterr().err


def test_help():
    run = subprocess.run([sys.executable, "-m", "continuum", "--help"], capture_output=True, text=True, check=True)
    assert "solve" in run.stdout
