"""Runs that are interrupted go on to the same bits; killed, they lose nothing but the frame in flight."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from discs import SimulationError, load, simulate
from discs.chains.twist import untwisting_chain
from discs.integrators import METHODS, solvers
from discs.running import recording
from tests.conftest import STEERED, Model, uneven
from tests.discs.test_archive import same

pytestmark = pytest.mark.slow

OPEN = Model("springs", "field")


class Stop(Exception):
    pass


def stopped(monkeypatch, after, *args, **options):
    """A run that ends at its `after`-th pause, its memory kept at each of them."""
    original, count = recording.Recording.pause, iter(range(after))

    def pause(self, f, march):
        original(self, f, march)
        if next(count, None) is None:
            raise Stop

    with monkeypatch.context() as patched:
        patched.setattr(recording, "SECONDS", -np.inf)
        patched.setattr(recording.Recording, "pause", pause)
        with pytest.raises(Stop):
            simulate(*args, **options, progress=False)


def equal(a, b):
    """Whether two runs are equal to the bit, except for their run time."""
    same(*(replace(run, stats={k: v for k, v in run.stats.items() if k != "seconds"}) for run in (a, b)))


@pytest.mark.parametrize(
    ("model", "engine"),
    [(OPEN, "compiled"), (Model("ring", "unit"), "plain"), (STEERED[0], "compiled")],
    ids=["open", "ring-plain", "own-headings"],
)
@pytest.mark.parametrize("name", METHODS)
def test_goes_on_to_the_same_bits(name, model, engine, tmp_path, monkeypatch):
    monkeypatch.setattr("discs.running.time_loop.CHUNK", 1)  # pauses after every step, whatever the engine
    problem, path = uneven(7, model), tmp_path / "run.nc"
    dt = 0.004 if np.isfinite(METHODS[name]().stability_limit) else 0.05
    frames = np.array([0.0, 0.013, 0.11, 0.2, 0.43, 0.431, 0.7])
    settled = {"method": name, "dt": dt, "frames": frames, "engine": engine}
    # a method that runs whole does so only without a checkpoint, and its last digits then differ
    by_steps = {"checkpoint": tmp_path / "whole.nc"} if METHODS[name].runs_whole else {}
    whole = simulate(problem, **settled, **by_steps, progress=False)
    for after in (2, 9):
        stopped(monkeypatch, after, problem, **settled, checkpoint=path)
    assert load(path).stats["frames_missing"] > 0
    equal(simulate(problem, **settled, checkpoint=path, progress=False), whole)
    assert {p.name for p in tmp_path.iterdir()} - {"whole.nc"} == {"run.nc"}


def test_lsoda_whose_memory_is_hidden_takes_its_steps_again(tmp_path, monkeypatch):
    """As under SciPy before 1.17."""
    problem, path = uneven(7, OPEN), tmp_path / "run.nc"
    settled = {"method": "LSODA", "dt": 0.05, "frames": 5, "engine": "plain"}
    whole = simulate(problem, **settled, progress=False)
    kept = solvers.keep
    monkeypatch.setattr(solvers, "keep", lambda solver: kept(solver) and {"replay": solver.t})
    stopped(monkeypatch, 9, problem, **settled, checkpoint=path)
    equal(simulate(problem, **settled, checkpoint=path, progress=False), whole)


def test_the_memory_matters(tmp_path, monkeypatch):
    """The control: the two-step scheme, restarted from the last frame without its memory, gives another motion."""
    problem, path = uneven(7, OPEN), tmp_path / "run.nc"
    settled = {"method": "leapfrog", "dt": 0.004, "frames": 5, "engine": "plain"}
    whole = simulate(problem, **settled, progress=False)
    stopped(monkeypatch, 120, problem, **settled, checkpoint=path)
    with np.load(tmp_path / "run.nc.restart") as file:
        kept = dict(file)
    kept["memory.next"] = np.nextafter(kept["memory.next"], np.inf)
    with open(tmp_path / "run.nc.restart", "wb") as file:
        np.savez(file, **kept)
    run = simulate(problem, **settled, checkpoint=path, progress=False)
    assert run.x[-1].tobytes() != whole.x[-1].tobytes()


def test_a_finished_run_is_read(tmp_path, monkeypatch):
    problem, path = uneven(7, OPEN), tmp_path / "run.nc"
    first = simulate(problem, dt=0.05, frames=5, checkpoint=path, progress=False)
    monkeypatch.setattr("discs.running.once.March", None)
    same(simulate(problem, dt=0.05, frames=5, checkpoint=path, progress=False), first)


@pytest.mark.parametrize(
    ("settled", "name"),
    [
        ({"dt": 0.04}, "dt"),
        ({"frames": 6}, "frames"),
        ({"method": "suzuki4"}, "settings"),
        ({"engine": "plain"}, "engine"),
        ({"want": "slope"}, "want"),
    ],
)
def test_another_run_is_refused(settled, name, tmp_path):
    problem, path = uneven(7, OPEN), tmp_path / "run.nc"
    standard = {"dt": 0.05, "frames": 5, "progress": False, "checkpoint": path}
    simulate(problem, **standard)
    before = path.read_bytes()
    with pytest.raises(ValueError, match=f"holds another run, whose {name} differs"):
        simulate(problem, **standard | settled)
    with pytest.raises(ValueError, match=r"holds another run, whose (density|initial_x) differs"):
        simulate(uneven(7, OPEN, seed=2), **standard)
    with pytest.raises(ValueError, match="holds another run, whose n differs: 7 there, 8 here"):
        simulate(uneven(8, OPEN), **standard)
    assert path.read_bytes() == before


@pytest.mark.parametrize("settled", [{}, {"tol": 1e-5}, {"method": "suzuki4", "tol": 1e-4}], ids=["nothing", "tol", "method"])
def test_a_run_to_a_tolerance_goes_on_with_the_step_that_was_found(settled, tmp_path, monkeypatch):
    problem, path = uneven(7, OPEN), tmp_path / "run.nc"
    settled = settled | {"frames": np.linspace(0.1, 0.9, 150)}
    stopped(monkeypatch, 9, problem, **settled, checkpoint=path)
    monkeypatch.setattr("discs.simulation.search_with_doubt", None)  # no search
    run = simulate(problem, **settled, checkpoint=path, progress=False)
    equal(run, simulate(problem, **settled, checkpoint=path, progress=False))
    monkeypatch.undo()
    again = simulate(problem, **settled | {"frames": 5}, progress=False)
    assert run.stats["tol"] == settled.get("tol", 1e-3)
    assert run.stats["dt"] <= again.stats["dt"] * 1.5
    assert set(run.error_estimate) >= {"x", "y", "theta", "omega", "energy"}
    with pytest.raises(ValueError, match=r"holds another run, whose tol differs: .* there, 1e-06 here"):
        simulate(problem, **settled | {"tol": 1e-6}, checkpoint=path, progress=False)


def test_other_things_in_the_way(tmp_path, monkeypatch):
    problem = uneven(7, OPEN)
    (tmp_path / "text.nc").write_text("mine")
    settled = {"dt": 0.05, "frames": 5, "engine": "plain"}
    with pytest.raises(ValueError, match="is not a run that was saved"):
        simulate(problem, **settled, checkpoint=tmp_path / "text.nc")
    assert (tmp_path / "text.nc").read_text() == "mine"
    with pytest.raises(ValueError, match="cannot be written"):
        simulate(problem, **settled, checkpoint=tmp_path / "missing" / "run.nc")
    with pytest.raises(ValueError, match="it is a folder"):
        simulate(problem, **settled, checkpoint=tmp_path)
    stopped(monkeypatch, 9, problem, **settled, checkpoint=tmp_path / "run.nc")
    good = (tmp_path / "run.nc.restart").read_bytes()
    locked = re.sub(rb"(PK\x01\x02....)..", lambda found: found[1] + b"\x01\x00", good, flags=re.DOTALL)  # a password is asked for
    for content in (b"PK nonsense", good[: len(good) // 2], locked):
        (tmp_path / "run.nc.restart").write_bytes(content)
        with pytest.raises(ValueError, match=r"run\.nc\.restart is damaged; without it the run starts from the beginning, so"):
            simulate(problem, **settled, checkpoint=tmp_path / "run.nc")
    (tmp_path / "run.nc.restart").unlink()
    equal(
        simulate(problem, **settled, checkpoint=tmp_path / "run.nc", progress=False), simulate(problem, **settled, progress=False)
    )


def test_an_old_restart_file_is_not_of_a_new_run(tmp_path, monkeypatch):
    problem, path = uneven(7, OPEN), tmp_path / "run.nc"
    stopped(monkeypatch, 9, problem, dt=0.05, frames=5, engine="plain", checkpoint=path)
    path.unlink()
    other = {"dt": 0.04, "frames": 3, "engine": "plain", "progress": False}
    equal(simulate(problem, **other, checkpoint=path), simulate(problem, **other))


def test_frames_before_a_breakdown_are_kept(tmp_path):
    problem = untwisting_chain(33)
    with pytest.raises(SimulationError, match="blew up"):
        simulate(problem, "leapfrog", 0.05, frames=46, engine="plain", checkpoint=tmp_path / "run.nc", progress=False)
    assert load(tmp_path / "run.nc").stats["frames_missing"] > 0


def test_ctrl_c(tmp_path):
    """The run stops between steps, its file whole, and goes on to the same bits."""
    problem, path = uneven(20, OPEN), tmp_path / "run.nc"
    settled = {"dt": 1e-3, "frames": 1001, "engine": "plain", "progress": False}

    def press():
        while not path.exists():
            time.sleep(0.01)
        time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGINT)

    finger = threading.Thread(target=press)
    finger.start()
    with pytest.raises(KeyboardInterrupt, match=r"run.nc holds \d+ of 1001 frames, and the same call goes on from there"):
        simulate(problem, **settled, checkpoint=path)
    finger.join()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    so_far = load(path)
    whole = simulate(problem, **settled)
    assert 0 < so_far.t.size < 1001
    assert so_far.x.tobytes() == whole.x[: so_far.t.size].tobytes()
    equal(simulate(problem, **settled, checkpoint=path), whole)


KILLS = """
import json, os, random, signal, sys, time
from discs import load, simulate
from discs.files import framefile
from discs.running import recording
from tests.conftest import Model, uneven

problem, path, kills = uneven(40, Model("springs", "field")), sys.argv[1], int(sys.argv[2])
settled = dict(dt=1e-3, frames=401, method="midpoint", engine="plain", progress=False)
recording.SECONDS = 0.02
write = framefile.FrameFile.write

def run(tell):
    def told(self, f, rows):
        write(self, f, rows)
        os.write(tell, f.to_bytes(4, "little"))
    framefile.FrameFile.write = told
    simulate(problem, **settled, checkpoint=path)

import h5netcdf
whole, draw, killed, most, report = simulate(problem, **settled), random.Random(5), 0, 0, []
while killed < kills:
    if killed and not os.path.exists(path + ".restart") and report[-1] == 401:
        os.unlink(path)  # it was finished: again
        most = 0
    hear, tell = os.pipe()
    child = os.fork()
    if not child:
        try:
            run(tell)
        finally:
            os._exit(0)
    os.close(tell)
    told = os.read(hear, 4) if draw.random() < 0.8 else b""  # most are killed after a frame, some while the file is made
    time.sleep(draw.uniform(0.0, 0.3))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    killed += 1
    while part := os.read(hear, 4096):
        told += part
    os.close(hear)
    last = int.from_bytes(told[-4:], "little") + 1 if told else 0
    there = 0
    if os.path.exists(path):
        try:
            found = load(path)
            there = found.t.size
            for name in ("t", "x", "y", "theta", "omega", "energy"):
                assert getattr(found, name).tobytes() == getattr(whole, name)[:there].tobytes(), name
        except ValueError as error:
            assert "holds no frame yet" in str(error), error
    assert there >= max(last, most), (there, last, most)
    most = there
    report.append(there)
final = simulate(problem, **settled, checkpoint=path)
assert final.x.tobytes() == whole.x.tobytes() and final.stats["solves"] == whole.stats["solves"]
print(json.dumps(report))
"""


def test_kill_loses_nothing_but_the_frame_in_flight(tmp_path):
    """A real process, killed at random times; DISCS_KILLS=50 for more of them."""
    kills = int(os.environ.get("DISCS_KILLS", "5"))
    command = [sys.executable, "-c", KILLS, str(tmp_path / "run.nc"), str(kills)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert len(report) == kills
    assert max(report) > 0
