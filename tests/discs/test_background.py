"""Kernels that are compiled in the background: what runs do until they are there."""

import multiprocessing
import os
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from continuum import motion as fields
from continuum import solve, untwisting_rod
from discs import simulate
from discs.kernels import background, cache
from discs.kernels.background import Kernels, missing
from discs.kernels.compiled import NotReady, kernel, readily
from discs.running import ready
from tests.conftest import Model, uneven


@kernel
def doubled(x):
    return 2 * x


def prepare(x):
    doubled(x)


def prepare_slowly(x, ballast):
    """Long in the process that compiles, as there a kernel is not refused."""
    doubled(x)
    time.sleep(3.0)


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    """No kernels, and no process that compiles them."""
    numba = pytest.importorskip("numba")
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    cache.folder.cache_clear()
    doubled.known.clear()
    compiler = background._Compiler()
    monkeypatch.setattr(background, "COMPILER", compiler)
    yield compiler
    cache.folder.cache_clear()
    if compiler.process is not None:
        with compiler.turn, suppress(OSError):  # all jobs are written
            compiler.process.stdin.close()
        compiler.process.wait(60)


@pytest.mark.slow
def test_a_kernel_that_is_not_there_is_compiled_in_the_background(empty_cache, capfd):
    with readily(), pytest.raises(NotReady):
        doubled(1.5)
    there = Kernels("auto", prepare, 1.5)
    assert not there
    assert "compiling kernels in the background" in capfd.readouterr().err
    until = time.monotonic() + 60
    while not there:
        assert time.monotonic() < until
        time.sleep(0.1)
    assert doubled(1.5) == 3.0
    assert empty_cache.asked


def test_ready_compiles_nothing(empty_cache):
    assert not Kernels("ready", prepare, 1.5)
    assert empty_cache.process is None
    doubled(1.5)
    assert Kernels("ready", prepare, 1.5)


def test_a_worker_process_waits(empty_cache, monkeypatch):
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: "a process")
    assert not missing(prepare, 1.5)
    assert empty_cache.process is None


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "getpriority"), reason="no priorities on this system")
def test_aside_a_worker_does_not_wait_and_kernels_are_compiled_at_the_lowest_priority(empty_cache, monkeypatch):
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: "a process")
    with background.compiling_aside():
        assert missing(prepare_slowly, 1.5, "")
    until = time.monotonic() + 60
    while os.getpriority(os.PRIO_PROCESS, empty_cache.process.pid) < 19:
        assert time.monotonic() < until
        time.sleep(0.1)
    group = Path(f"/proc/{empty_cache.process.pid}/autogroup")
    while group.exists() and not group.read_text().endswith("nice 19\n"):
        assert time.monotonic() < until
        time.sleep(0.1)
    empty_cache.process.kill()  # it might wait for long
    assert background.ASIDE not in os.environ


def test_what_cannot_be_sent_is_waited_for(empty_cache):
    assert not missing(lambda x: doubled(x), 1.5)
    assert empty_cache.process is None


def test_kernels_of_a_process_that_failed_are_waited_for(empty_cache):
    assert missing(prepare, 1.5)
    empty_cache.process.kill()
    empty_cache.process.wait()
    assert not missing(prepare, 1.5)


class After:
    """Kernels that are there after some questions."""

    def __init__(self, questions):
        self.left = questions

    def __bool__(self):
        self.left -= 1
        return self.left < 0


@pytest.fixture
def kernels_come(monkeypatch):
    def come(after):
        there = After(after)
        monkeypatch.setattr("discs.running.once.kernels", lambda *rest, **more: there)
        monkeypatch.setattr(fields, "Kernels", lambda *rest: there)
        monkeypatch.setattr(fields, "_PREPARED", set())

    monkeypatch.setattr(background, "USUAL", ["auto"])
    return come


def test_a_run_is_plain_until_kernels_are_there_and_then_compiled(kernels_come):
    problem = uneven(9, Model("springs", "field"), seed=4)
    kernels_come(10**6)
    run, plain = (simulate(problem, dt=0.05, engine=engine) for engine in (None, "plain"))
    np.testing.assert_array_equal(run.x, plain.x)
    assert run.stats["engine"] == "plain"
    assert "not compiled yet" in run.stats["plain_because"]
    kernels_come(3)
    overtaken, waited = (simulate(problem, dt=0.05, want=iter(["velocity"]), engine=engine) for engine in ("auto", "compiled"))
    np.testing.assert_array_equal(overtaken.x, waited.x)
    np.testing.assert_array_equal(overtaken.x_rate, waited.x_rate)
    assert overtaken.stats["engine"] == "compiled"


@pytest.mark.slow
def test_a_field_goes_on_with_its_kernels(kernels_come):
    scene = untwisting_rod(duration=0.5)
    kernels_come(3)
    mixed = solve(scene, 1e-3, progress=False)
    kernels_come(0)
    np.testing.assert_allclose(mixed.x, solve(scene, 1e-3, progress=False).x, atol=1e-11)


def test_prepared_kernels_are_not_looked_for_again(monkeypatch):
    problem = uneven(9, Model("springs", "field"), seed=4)
    simulate(problem, dt=0.05, engine="compiled")
    monkeypatch.setattr(ready, "Kernels", None)
    assert simulate(problem, dt=0.05, engine="auto").stats["engine"] == "compiled"


def test_the_default_engine_is_checked(monkeypatch):
    monkeypatch.setattr(background, "USUAL", ["fast"])
    with pytest.raises(ValueError, match="engine must be one of 'auto', 'ready', 'compiled', 'plain'; got 'fast'"):
        simulate(uneven(9, Model("springs", "field"), seed=4), dt=0.05)
    with pytest.raises(ValueError, match="DISCS_ENGINE must be one of 'auto', 'ready', 'compiled', 'plain'; got 'fast'"):
        solve(untwisting_rod(duration=0.5), 1e-3, progress=False)


def test_a_large_job_does_not_keep_its_run_waiting(empty_cache):
    """Two of a megabyte: the second one waits in the pipe until the first is done."""
    begun = time.monotonic()
    assert missing(prepare_slowly, 1.5, bytes(2**20))
    assert missing(prepare_slowly, 2, bytes(2**20))
    assert time.monotonic() - begun < 3.0


def test_a_missing_kernel_is_found_without_importing_numba(tmp_path):
    code = (
        "import sys; from discs import simulate; from discs.chains.twist import untwisting_chain;"
        "run = simulate(untwisting_chain(9, duration=0.1), dt=0.05, frames=1, progress=False, engine='ready');"
        "print(run.stats['engine'], 'numba' in sys.modules)"
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    told = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True).stdout
    assert told == "plain False\n"


def test_processes_that_compile_take_turns(monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    order = []

    def other():
        with background._turn("soon"):
            order.append("other")

    with background._turn("soon"), background._turn("aside"):  # each has a turn of its own
        thread = threading.Thread(target=other)
        thread.start()
        time.sleep(0.2)
        order.append("first")
    thread.join(10)
    assert order == ["first", "other"]


def test_a_process_whose_run_has_ended_does_not_wait_for_its_turn(monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    with background._turn("soon"):
        monkeypatch.setattr(background, "ASKING", -1)
        with pytest.raises(SystemExit), background._turn("soon"):
            pass
    with background._turn("soon"):  # nobody is there: it compiles
        pass
