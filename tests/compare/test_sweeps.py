"""Sweeps: every executor, failures reported, archives that survive kills, and resuming."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from compare import lump, sweep
from compare.background import Died, background
from compare.sweeps import read
from continuum import untwisting_rod
from discs import simulate

pytestmark = pytest.mark.slow


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
    begun = time.monotonic()
    found = sweep(end_disc, CASES, progress=False)
    assert [r.case for r in found] == CASES
    assert [r.value for r in found] == one_by_one
    assert all(0 < r.seconds < time.monotonic() - begun and not r.error for r in found)


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


def test_failures_are_reported_and_tried_again(tmp_path, noted):
    file = tmp_path / "new" / "sweep.jsonl"
    with ThreadPoolExecutor(1) as executor:
        found = sweep(noting, [1, 3, 4, 2], executor, file, progress=False)
        assert [r.value for r in found] == [1, None, None, 2]
        assert found[1].error == "ValueError: three is refused"
        assert "in noting" in found[1].trace
        assert found[2].error == "TypeError: object cannot be stored as JSON"
        assert noted("better") == [1, 3, 4, 2]
        again = sweep(noting, [1, 3, 4, 2], executor, file, progress=False)
    assert noted() == [3, 4]
    assert [r.value for r in again] == [1, 3, 4, 2]
    assert [r.error for r in read(file)] == [""] * 4


def noting(n):
    """Notes what it is called with, in a file, and is the same function all the time."""
    with open(os.environ["NOTED"], "a") as file:
        file.write(f"{n}\n")
    if n == 3 and "BETTER" not in os.environ:
        raise ValueError("three is refused")
    return object() if n == 4 and "BETTER" not in os.environ else n


DEATHS = {1: "SystemExit: 7", 2: "KeyboardInterrupt: ", 3: "Died: its process ended with exit code 3"}
DEATHS[4] = "Died: its process ended with signal SIGSEGV"


def deadly(n):
    with open(os.environ["NOTED"], "a") as file:
        file.write(f"{n}\n")
    if n == 1:
        sys.exit(7)
    if n == 2:
        raise KeyboardInterrupt
    if n == 3:
        os._exit(3)
    if n == 4:
        os.kill(os.getpid(), signal.SIGSEGV)
    return n


def test_the_death_of_a_case_is_its_own(tmp_path, noted):
    """A case may end its process in any way: the others have their results, and keep them when it is repeated."""
    cases, file = [7, 3, 8, 1, 2, 9, 4, 10], tmp_path / "sweep.jsonl"
    with background(1) as workers:
        found = sweep(deadly, cases, workers, file, progress=False)
    assert [r.value for r in found] == [7, None, 8, None, None, 9, None, 10]
    assert {r.case: r.error for r in found if r.error} == DEATHS
    calls = noted()
    assert all(calls.count(n) == 1 for n in (1, 2, 7, 8, 9, 10))
    assert all(calls.count(n) == 2 for n in (3, 4))  # once more in a process of their own
    again = sweep(deadly, [7, 3, 8, 9, 10], archive=file, progress=False)
    assert noted() == [3]
    assert [r.value for r in again] == [7, None, 8, 9, 10]


@pytest.mark.long
def test_a_case_that_breaks_an_executor_takes_no_other_with_it(noted):
    cases = [7, 3, 8, 9]
    with ProcessPoolExecutor(1, get_context("spawn")) as executor:
        found = sweep(deadly, cases, executor, progress=False)
    assert [r.value for r in found] == [7, None, 8, 9]
    assert found[1].error == DEATHS[3]


def leaves(n):
    """Case 1 leaves something behind that ends the process of the next case."""
    if n == 1:
        threading.Timer(0.05, os._exit, (9,)).start()
    else:
        time.sleep(0.3)
    return n


@pytest.mark.long
def test_what_a_case_leaves_behind_is_not_the_fault_of_the_next():
    with background(1) as workers:
        found = sweep(leaves, [1, 2, 3], workers, progress=False)
    assert [r.value for r in found] == [1, 2, 3]


@pytest.mark.long
def test_ours_hear_of_what_is_raised_in_another_process():
    with background() as workers:
        with pytest.raises(ValueError, match="three is refused") as raised:
            workers.submit(picky, 3).result()
        assert "in picky" in raised.value.__notes__[0]
        assert workers.submit(picky, 2).result() == 4.0
        with pytest.raises(Died, match="its process ended with exit code 1"):
            workers.submit(picky, 5).result()
        assert workers.submit(picky, 2).result() == 4.0


def test_functions_are_sent_by_value(tmp_path):
    """Lambdas, closures, and those of a notebook, whose main module is no file."""
    factor = np.array([2.0, 3.0])
    assert [r.value for r in sweep(lambda n: n * factor, [1, 2], progress=False)] == [[2, 3], [4, 6]]
    code = (
        "import numpy as np\nfrom compare import sweep\nK = np.arange(3)\ndef helper(n): return n + K[2]\n"
        f"def cell(n): return helper(n) ** 2\nprint([r.value for r in sweep(cell, [1, 2, 3], archive={str(tmp_path / 'a')!r})])"
    )
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout == "[9, 16, 25]\n", done.stderr
    lock = threading.Lock()
    with pytest.raises(ValueError, match="the function of a sweep cannot be sent to other processes: TypeError"):
        sweep(lambda n: (n, lock), [1], progress=False)


def test_a_script_without_its_guard_is_told(tmp_path):
    script = tmp_path / "bare.py"
    script.write_text("from compare import sweep\ndef f(n): return n\nprint(sweep(f, [1, 2, 3], progress=False))\n")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 1
    assert "NotStarted: a process ended with exit code 1 at its start; a script must begin this under if __name__" in done.stderr
    assert not done.stdout


SLOW = """
import sys, time
from concurrent.futures import ThreadPoolExecutor
from compare import sweep
def slow(n):
    time.sleep(0.05)
    print(n, flush=True)
    return n
if __name__ == "__main__":
    sweep(slow, range(int(sys.argv[2])), ThreadPoolExecutor(1) if "threads" in sys.argv else None, sys.argv[1], progress=False)
"""


def test_a_killed_sweep_resumes(tmp_path):
    script, file = tmp_path / "slow.py", tmp_path / "sweep.jsonl"
    script.write_text(SLOW)
    command = [sys.executable, str(script), str(file)]
    run = subprocess.Popen([*command, "200", "threads"], stdout=subprocess.DEVNULL)
    while not file.exists() or len(read(file)) < 3:
        time.sleep(0.02)
        assert run.poll() is None
    run.kill()
    run.wait()
    kept = read(file)
    assert 3 <= len(kept) < 200
    done = subprocess.run([*command, str(len(kept) + 2), "threads"], capture_output=True, text=True, check=True)
    assert [int(n) for n in done.stdout.split()] == [len(kept), len(kept) + 1]
    found = {r.case: r for r in read(file)}
    assert sorted(found) == list(range(len(kept) + 2))
    assert all(found[r.case] == r for r in kept)  # and not run again


def test_an_interrupt_stops_the_processes_at_once(tmp_path):
    script, file = tmp_path / "slow.py", tmp_path / "sweep.jsonl"
    script.write_text(SLOW)
    run = subprocess.Popen(
        [sys.executable, str(script), str(file), "2000"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    while not file.exists() or len(read(file)) < 3:
        time.sleep(0.02)
        assert run.poll() is None
    run.send_signal(signal.SIGINT)
    assert "KeyboardInterrupt" in run.communicate(timeout=20)[1]
    assert len(read(file)) >= 3


def test_bad_input(tmp_path):
    with pytest.raises(ValueError, match="cases of a sweep must differ; got 2 twice"):
        sweep(picky, [1, 2, 2])
    with pytest.raises(ValueError, match="case of a sweep must be what JSON can store"):
        sweep(picky, [{1, 2}])
    file = tmp_path / "sweep.jsonl"
    with ThreadPoolExecutor(1) as executor:
        sweep(picky, [1], executor, file, progress=False)
    with pytest.raises(ValueError, match=r"has results of .*picky, not of .*end_disc"):
        sweep(end_disc, CASES, archive=file)
    file.write_text("n,x\n3,4\n")
    with pytest.raises(ValueError, match="must be a file that a sweep has written"):
        sweep(picky, [1], archive=file)
    with pytest.raises(ValueError, match="archive must be a file that can be written"):
        sweep(picky, [1], archive=file / "below")
