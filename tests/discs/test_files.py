"""Whose a file is, what is on the disc when, and what is left behind."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from discs import load, simulate
from discs.__main__ import main
from discs.chains.twist import untwisting_chain
from discs.files import safe, schema
from discs.running import recording
from tests.conftest import Model, uneven
from tests.discs.test_archive import same
from tests.discs.test_restart import equal, stopped

PROBLEM = uneven(7, Model("springs", "field"))
SETTLED = {"dt": 0.05, "frames": 5, "engine": "plain", "progress": False}


def stopped_at(monkeypatch, after, path, problem=PROBLEM, **options):
    stopped(monkeypatch, after, problem, **{k: v for k, v in (SETTLED | options).items() if k != "progress"}, checkpoint=path)


def until(condition, process):
    """Wait until a condition holds in another process."""
    while not condition():
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)


# One run, one file


RUN = ["run", "--n", "40", "--t", "2", "--engine", "plain", "--quiet", "--save"]
LONG, OTHER, OVERWRITE = ["--dt", "1e-3", "--frames", "401"], ["--dt", "0.5", "--radius", "0.5"], ["--overwrite"]


def begun(path, *code):
    """A long run of another process, which writes to a file."""
    command = [sys.executable, *(code or ("-m", "discs"))]
    process = subprocess.Popen([*command, *RUN, str(path), *LONG], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until(path.exists, process)
    return process


@pytest.mark.slow
def test_the_second_of_two_runs_on_a_path_is_refused(tmp_path, capsys):
    path = tmp_path / "run.nc"
    first = begun(path)
    for others in (LONG, OTHER, [*OTHER, *OVERWRITE], ["--tol", "0.5", *OVERWRITE]):
        assert main([*RUN, str(path), *others]) == 2
        assert "run.nc is being written by another run: wait for its end, or give another path" in capsys.readouterr().err
    with pytest.raises(ValueError, match="is being written by another run"):
        simulate(PROBLEM, **SETTLED).save(path)
    first.communicate()
    assert first.returncode == 0
    problem = untwisting_chain(40, duration=2)
    equal(load(path), simulate(problem, dt=1e-3, frames=401, engine="plain", progress=False))
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]


WITHOUT_LOCKS = (
    "import sys; from discs.files import safe; from discs.__main__ import main; safe.fcntl = None; sys.exit(main(sys.argv[1:]))"
)


@pytest.mark.slow
@pytest.mark.long
def test_without_locks_the_first_run_stops_and_reports_nothing_of_the_second(tmp_path):
    """On a file system without locks, another run may take the path."""
    path = tmp_path / "run.nc"
    first = begun(path, "-c", WITHOUT_LOCKS)
    command = [sys.executable, "-c", WITHOUT_LOCKS, *RUN, str(path), *OTHER, *OVERWRITE]
    second = subprocess.run(command, capture_output=True, text=True, check=False)
    assert second.returncode == 0, second.stderr
    said, error = first.communicate(timeout=60)
    assert first.returncode == 2
    assert "run.nc was deleted or replaced while a run wrote to it, and the run stops" in error
    assert not said
    assert load(path).problem.chain.radius[0] == 0.5


def test_a_file_that_is_deleted_meanwhile(tmp_path, monkeypatch):
    path, solution = tmp_path / "run.nc", recording.Recording.solution

    def deleted(self, *arguments):
        path.unlink()
        simulate(PROBLEM, **SETTLED | {"dt": 0.1}).save(tmp_path / "other.nc")
        os.rename(tmp_path / "other.nc", path)
        return solution(self, *arguments)

    monkeypatch.setattr(recording.Recording, "solution", deleted)
    with pytest.raises(OSError, match="was deleted or replaced while a run wrote to it"):
        simulate(PROBLEM, **SETTLED, checkpoint=path)
    assert load(path).stats["dt"] == 0.1


def test_the_restart_file_of_another_run_is_refused(tmp_path, monkeypatch):
    a, b = tmp_path / "a.nc", tmp_path / "b.nc"
    stopped_at(monkeypatch, 9, a)
    before = a.read_bytes()
    for other in (
        {"problem": uneven(7, Model("springs", "field"), seed=2)},
        {"dt": 0.04},
        {"frames": [0, 0.3, 0.8]},
        {"method": "gauss4"},
    ):
        b.unlink(missing_ok=True)
        stopped_at(monkeypatch, 9, b, **other)
        shutil.copy(f"{b}.restart", f"{a}.restart")
        with pytest.raises(ValueError, match=r"a\.nc\.restart is of another run, or of an earlier version; .* so delete it"):
            simulate(PROBLEM, **SETTLED, checkpoint=a)
        assert a.read_bytes() == before
    (tmp_path / "a.nc.restart").unlink()
    equal(simulate(PROBLEM, **SETTLED, checkpoint=a), simulate(PROBLEM, **SETTLED))


def test_an_archive_older_than_its_restart_file_is_refused_at_the_beginning(tmp_path, monkeypatch):
    path = tmp_path / "run.nc"
    stopped_at(monkeypatch, 9, path)
    with np.load(f"{path}.restart") as file:
        kept = dict(file)
    with open(f"{path}.restart", "wb") as new:
        np.savez(new, **kept | {"frame": 4})
    there = load(path).t.size
    assert 0 < there < 4
    monkeypatch.setattr("discs.running.time_loop.March.on", None)  # not a step
    message = (
        rf"run\.nc is older than run\.nc\.restart, which goes on at frame 4: frame {there} is not there; without it the run starts"
    )
    with pytest.raises(ValueError, match=message):
        simulate(PROBLEM, **SETTLED, checkpoint=path)


def test_a_run_goes_on_before_its_first_frame(tmp_path, monkeypatch):
    """It has its file from the start: its end alone takes long, too."""
    path, options = tmp_path / "run.nc", {"frames": 1}
    stopped_at(monkeypatch, 9, path, **options)
    assert path.with_name("run.nc.restart").stat().st_size
    monkeypatch.setattr("discs.integrators.base.FixedStep.begin", None, raising=False)
    found = simulate(PROBLEM, **SETTLED | options, checkpoint=path)
    assert found.stats["steps"] == 20
    equal(found, simulate(PROBLEM, **SETTLED | options))


# Where a file may be


def test_links_are_followed(tmp_path, monkeypatch):
    run = simulate(PROBLEM, **SETTLED)
    (tmp_path / "far").mkdir()
    link, real = tmp_path / "link.nc", tmp_path / "far" / "real.nc"
    link.symlink_to(real)
    run.save(link)  # a link to nothing yet
    run.save(link)
    assert link.is_symlink()
    same(load(real), run)
    real.unlink()
    stopped_at(monkeypatch, 9, link)
    assert (tmp_path / "far" / "real.nc.restart").exists()
    equal(simulate(PROBLEM, **SETTLED, checkpoint=real), run)
    assert (
        main(["run", "--n", "5", "--t", "0.1", "--dt", "0.1", "--engine", "plain", "--quiet", "--overwrite", "--save", str(link)])
        == 0
    )
    assert link.is_symlink()
    assert load(link).s.size == 5
    (tmp_path / "loop.nc").symlink_to(tmp_path / "loop.nc")
    with pytest.raises(ValueError, match=r"loop\.nc cannot be written"):
        run.save(tmp_path / "loop.nc")


def test_what_is_no_file_is_refused_at_once(tmp_path):
    run = simulate(PROBLEM, **SETTLED)
    os.mkfifo(tmp_path / "pipe.nc")
    (tmp_path / "null.nc").symlink_to("/dev/null")
    for name in ("pipe.nc", "null.nc"):
        with pytest.raises(ValueError, match=f"{name} cannot be written: it is no regular file"):
            run.save(tmp_path / name)
        with pytest.raises(ValueError, match=f"{name} cannot be written: it is no regular file"):
            simulate(PROBLEM, **SETTLED, checkpoint=tmp_path / name)
        with pytest.raises(ValueError, match=f"{name} cannot be read: it is no regular file"):
            load(tmp_path / name)
    for device in ("/dev/null", "/dev/zero"):
        with pytest.raises(ValueError, match="cannot be written: it is no regular file"):
            run.save(device)
        with pytest.raises(ValueError, match="cannot be read: it is no regular file"):
            load(device)


@pytest.mark.parametrize("name", ["a.xyz", "a.nc.gz", "a", "a.npz"])
def test_other_endings_are_refused(name, tmp_path, capsys):
    run = simulate(PROBLEM, **SETTLED)
    known = r"names end in .nc, .nc4, .h5, .hdf5 \(.*\), .csv \(.*\), .glb \(.*\), .vtkhdf \(.*\); got "
    with pytest.raises(ValueError, match=known):
        run.save(tmp_path / name)
    message = f"{name} would be a NetCDF-4 file: its name must end in .nc, .nc4, .h5, .hdf5"
    with pytest.raises(ValueError, match=message):
        simulate(PROBLEM, **SETTLED, checkpoint=tmp_path / name)
    assert main([*RUN, str(tmp_path / name), *OTHER]) == 2
    assert "a run is saved in files whose names end in" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
    run.save(tmp_path / "A.NC4")
    same(load(tmp_path / "A.NC4"), run)


@pytest.mark.slow
def test_what_a_kill_leaves_of_a_save_is_removed_by_the_next(tmp_path):
    code = (
        "import os, sys, signal; from discs import simulate; from discs.files import framefile;"
        "from discs.chains.twist import untwisting_chain;"
        "run = simulate(untwisting_chain(5), dt=0.5, frames=2, engine='plain', progress=False);"
        "framefile.FrameFile.write = lambda *a: os.kill(os.getpid(), signal.SIGKILL); run.save(sys.argv[1])"
    )
    killed = subprocess.run([sys.executable, "-c", code, str(tmp_path / "a.nc")], check=False)
    assert killed.returncode == -signal.SIGKILL
    left = list(tmp_path.iterdir())
    assert len(left) == 1
    assert left[0].name.startswith(".discs-partial-")
    with safe.fresh(tmp_path / "other.txt"):  # not what another one writes at the time
        simulate(PROBLEM, **SETTLED).save(tmp_path / "b.nc")
        assert len(list(tmp_path.iterdir())) == 2
    assert sorted(p.name for p in tmp_path.iterdir()) == ["b.nc", "other.txt"]


# Files of earlier versions


OLD = Path(__file__).parent / "data"


def test_archives_of_earlier_versions_open(tmp_path):
    run = load(OLD / "version-0.1.nc")
    here = simulate(run.problem, "leapfrog", 0.01, 3, engine="plain", progress=False)
    np.testing.assert_allclose(run.x, here.x, rtol=0, atol=1e-14)
    assert run.stats["settings"] == "Leapfrog()"
    shutil.copy(OLD / "version-0.1.nc", tmp_path / "run.nc")
    again = simulate(run.problem, "leapfrog", 0.01, 3, engine="plain", progress=False, checkpoint=tmp_path / "run.nc")
    same(again, run)


def test_frames_of_earlier_versions_are_gone_on_with(tmp_path, monkeypatch):
    """An archive without space for its stats, and a restart file that does not name its run."""
    path = tmp_path / "run.nc"
    monkeypatch.setattr(schema, "STATS_ROOM", 0)
    stopped_at(monkeypatch, 9, path)
    with np.load(f"{path}.restart") as file:
        kept = {name: file[name] for name in file.files if name != "run"}
    with open(f"{path}.restart", "wb") as new:
        np.savez(new, **kept)
    with pytest.raises(
        ValueError, match="is of another run, or of an earlier version; without it the run starts from the beginning"
    ):
        simulate(PROBLEM, **SETTLED, checkpoint=path)
    os.unlink(f"{path}.restart")
    whole = simulate(PROBLEM, **SETTLED)
    equal(simulate(PROBLEM, **SETTLED, checkpoint=path), whole)
    equal(load(path), whole)
