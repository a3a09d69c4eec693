"""Sweeps: every executor, failures reported, archives that survive kills, and resuming."""

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from compare import lump, sweep
from compare.sweeps import read
from continuum import untwisting_rod
from discs import simulate


def end_disc(case):
    """Where the end disc of a short motion is; importable, so that other processes can run it."""
    run = simulate(lump(untwisting_rod(duration=0.4), case["n"]), case["method"], 0.02, frames=1, engine="plain", progress=False)
    return {"x": run.x[-1, 0], "at": (run.t[-1],), "steps": np.int64(run.stats["steps"])}


def picky(n):
    if n == 3:
        raise ValueError("three is refused")
    if n == 5:
        os._exit(1)
    return object() if n == 4 else np.float64(n) ** 2


CASES = [{"n": n, "method": method} for n in (5, 9) for method in ("midpoint", "gauss4")]


@pytest.fixture(scope="module")
def one_by_one():
    return [json.loads(json.dumps(end_disc(case), default=lambda a: a.tolist())) for case in CASES]


def test_processes_are_the_default(one_by_one):
    found = sweep(end_disc, CASES, progress=False)
    assert [r.case for r in found] == CASES
    assert [r.value for r in found] == one_by_one
    assert all(r.seconds > 0 and not r.error for r in found)


def test_a_cluster(one_by_one, tmp_path):
    """A scheduler and two workers in processes of their own, by Dask."""
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        assert len(client.scheduler_info()["workers"]) == 2
        with client.get_executor() as executor:
            found = sweep(end_disc, CASES, executor, tmp_path / "sweep.jsonl", progress=False)
            failing = sweep(picky, [1, 3], executor, progress=False)
    assert [r.value for r in found] == one_by_one
    assert [r.value for r in failing] == [1.0, None]
    assert {r.case["n"] for r in read(tmp_path / "sweep.jsonl")} == {5, 9}


def test_failures_are_reported_and_tried_again(tmp_path):
    file = tmp_path / "new" / "sweep.jsonl"
    with ThreadPoolExecutor(1) as executor:
        found = sweep(picky, [1, 3, 4, 2], executor, file, progress=False)
        assert [r.value for r in found] == [1.0, None, None, 4.0]
        assert found[1].error == "ValueError: three is refused"
        assert "in picky" in found[1].trace
        assert found[2].error == "TypeError: object is not something JSON can hold"
        calls = []
        again = sweep(counted(calls), [1, 3, 4, 2], executor, file, progress=False)
    assert calls == [3, 4]
    assert [r.value for r in again] == [1.0, 3, 4, 4.0]
    assert [r.error for r in read(file)] == [""] * 4


def counted(calls, module=__name__, name="picky"):
    """A function with the name of another that notes what it is called with."""

    def function(case):
        calls.append(case)
        return case

    function.__module__, function.__qualname__ = module, name
    return function


def test_a_worker_that_dies_is_reported():
    (found,) = sweep(picky, [5], progress=False)
    assert found.error.startswith("BrokenProcessPool")


def test_half_a_line_is_dropped(tmp_path):
    """As a kill in the middle of writing leaves it: the case is run again, on a line of its own."""
    file, calls = tmp_path / "sweep.jsonl", []
    with ThreadPoolExecutor(1) as executor:
        sweep(counted(calls), [1, 2], executor, file, progress=False)
        for cut in (1, 5, len(file.read_bytes().splitlines()[-1])):
            file.write_bytes(file.read_bytes()[:-cut])
            calls.clear()
            sweep(counted(calls), [1, 2], executor, file, progress=False)
            assert len(calls) == 1
            assert len(file.read_text().splitlines()) == 3
        for header in (b"", b'{"func'):
            file.write_bytes(header)
            sweep(counted(calls), [1, 2], executor, file, progress=False)
            assert [r.case for r in read(file)] == [1, 2]


SLOW = """
import sys, time
from concurrent.futures import ThreadPoolExecutor
from compare import sweep
def slow(n):
    time.sleep(0.05)
    return n
if __name__ == "__main__":
    sweep(slow, range(int(sys.argv[2])), ThreadPoolExecutor(1) if "threads" in sys.argv else None, sys.argv[1], progress=False)
"""


def test_a_killed_sweep_resumes(tmp_path):
    script, file = tmp_path / "slow.py", tmp_path / "sweep.jsonl"
    script.write_text(SLOW)
    command = [sys.executable, str(script), str(file)]
    run = subprocess.Popen([*command, "200", "threads"])
    while not file.exists() or len(read(file)) < 3:
        time.sleep(0.02)
        assert run.poll() is None
    run.kill()
    run.wait()
    kept = read(file)
    assert 3 <= len(kept) < 200
    calls = []
    with ThreadPoolExecutor(1) as executor:  # here, under the name of the killed one's function
        sweep(counted(calls, "__main__", "slow"), range(len(kept) + 2), executor, file, progress=False)
    assert calls == [len(kept), len(kept) + 1]
    found = {r.case: r for r in read(file)}
    assert sorted(found) == list(range(len(kept) + 2))
    assert all(found[r.case] == r for r in kept)  # and not run again


def test_an_interrupt_stops_the_processes_at_once(tmp_path):
    script, file = tmp_path / "slow.py", tmp_path / "sweep.jsonl"
    script.write_text(SLOW)
    run = subprocess.Popen([sys.executable, str(script), str(file), "2000"], stderr=subprocess.PIPE, text=True)
    while not file.exists() or len(read(file)) < 3:
        time.sleep(0.02)
        assert run.poll() is None
    run.send_signal(signal.SIGINT)
    assert "KeyboardInterrupt" in run.communicate(timeout=20)[1]
    assert len(read(file)) >= 3


def test_bad_input(tmp_path):
    with pytest.raises(ValueError, match="cases of a sweep must differ; got 2 twice"):
        sweep(picky, [1, 2, 2])
    with pytest.raises(ValueError, match="case of a sweep must be what JSON can hold"):
        sweep(picky, [{1, 2}])
    file = tmp_path / "sweep.jsonl"
    with ThreadPoolExecutor(1) as executor:
        sweep(picky, [1], executor, file, progress=False)
    with pytest.raises(ValueError, match=r"holds results of .*picky, not of .*end_disc"):
        sweep(end_disc, CASES, archive=file)
    file.write_text("n,x\n3,4\n")
    with pytest.raises(ValueError, match="must be a file that a sweep has written"):
        sweep(picky, [1], archive=file)
    with pytest.raises(ValueError, match="archive must be a file that can be written"):
        sweep(picky, [1], archive=file / "below")
