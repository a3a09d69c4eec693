"""Many runs at once: each is what `simulate` makes of its problem."""

import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest

from discs import Midpoint, SimulationError, State, simulate, simulate_many
from discs.chains.twist import untwisting_chain
from discs.running import ensemble, part
from tests.conftest import Model, uneven

PLAIN = {"engine": "plain", "progress": False}


def cloud(count, n=7, model=None, seed=1):
    """Different chains of one kind, with different twists."""
    rng = np.random.default_rng(seed)
    found = []
    for i in range(count):
        problem = uneven(n, model or Model("springs", "field"), seed=i)
        start = problem.initial
        theta = start.theta * rng.uniform(0.3, 1.0) + rng.uniform(-1.0, 1.0)
        found.append(replace(problem, initial=State(start.x, start.y, theta, start.omega, start.phi, start.phi_rate)))
    return found


def stiff(problem):
    """A problem with springs so stiff that explicit steps of 0.01 fail."""
    return replace(problem, chain=replace(problem.chain, bending_stiffness=1e6))


@pytest.mark.parametrize("how", [{"dt": 0.1, "method": "gauss4", "want": "slope"}, {"tol": 1e-2}, {"dt": 0.07}])
def test_each_run_is_that_of_simulate(how):
    problems = cloud(11)
    runs = simulate_many(problems, frames=[0.0, 0.33], **how, **PLAIN)
    assert len(runs) == 11
    assert not runs.failed
    for i, problem in enumerate(problems):
        run = simulate(problem, frames=[0.0, 0.33], **how, **PLAIN)
        for name in ("t", "x", "y", "theta", "omega", "energy"):
            np.testing.assert_array_equal(getattr(runs[i], name), getattr(run, name))
            assert name == "t" or (getattr(runs, name)[i] == getattr(run, name)).all()
        assert runs[i].stats["steps"] == run.stats["steps"]
        assert runs[i].error_estimate == run.error_estimate
        assert runs[i].problem is problem
    assert runs.x.shape == (11, 2, 7)
    assert runs[-1].x[1, 3] == runs.x[10, 1, 3]
    assert len(runs[2:9:3]) == 3


@pytest.mark.slow
def test_a_failed_run_is_its_own_and_warnings_come_once():
    problems = cloud(6)
    problems[2], problems[4] = stiff(problems[2]), replace(problems[4], duration=0.005)
    with pytest.warns(UserWarning, match=r"2 of 6 runs failed, as run 2: the run blew up.*see runs.failed") as warned:
        runs = simulate_many(problems, "rk4", dt=0.01, frames=[0.005], **PLAIN)
    (message,) = warned
    assert message.filename == __file__
    assert list(runs.failed) == [2, 4]
    with pytest.raises(SimulationError, match="blew up"):
        runs[2]
    with pytest.raises(ValueError, match="dt must be at most the duration"):
        runs[4]
    assert np.isnan(runs.x[[2, 4]]).all()
    assert np.isfinite(runs.x[[0, 1, 3, 5]]).all()
    data = runs.to_xarray()
    assert data.x.dims == ("run", "time", "disc")
    assert data.x.attrs["units"] == "length"
    assert [bool(text) for text in data.error.values] == [i in (2, 4) for i in range(6)]
    assert data.error.values[2].startswith("SimulationError: the run blew up")
    with pytest.warns(UserWarning, match=r"^6 of 6 runs have warnings, as run 0: midpoint: 1 of 1 steps did not converge"):
        runs = simulate_many(problems, Midpoint(sweeps=2), dt=0.005, frames=[0.005], **PLAIN)
    assert len(runs.warned) == 6
    assert "did not converge" in runs.to_xarray().warning.values[5]


def test_what_no_run_can_take_is_an_error():
    problems = cloud(2)
    for arguments, said in (
        ({"dt": -1.0}, "dt must be a positive finite number"),
        ({"dt": 5.0}, "dt must be at most the duration"),
        ({"dt": 0.1, "tol": 1e-3}, "give dt or tol, not both"),
        ({"method": "euler"}, "method must be one of"),
        ({"dt": 0.1, "frames": [2.0]}, "frames must be increasing times within"),
        ({"dt": 0.1, "want": "speed"}, "want must be one of"),
        ({"dt": 0.1, "threads": 0}, "threads must be a whole number of at least 1"),
        ({"dt": 0.1, "engine": "gpu"}, "engine must be one of 'compiled', 'plain'; got 'gpu'"),
    ):
        with pytest.raises(ValueError, match=said):
            simulate_many(problems, **PLAIN | arguments)
    with pytest.raises(ValueError, match="takes at least one problem; got none"):
        simulate_many([])
    with pytest.raises(ValueError, match=r"takes Problems, as .* makes; got State"):
        simulate_many([problems[0].initial])


def test_runs_that_differ_have_no_common_arrays():
    short, other = replace(cloud(1)[0], duration=0.5), cloud(1, 8)[0]
    runs = simulate_many([*cloud(2), short], dt=0.1, **PLAIN)
    assert [run.t[-1] for run in runs] == [1.0, 1.0, 0.5]
    with pytest.raises(ValueError, match="runs 0 and 2 have frames at different times"):
        _ = runs.t
    with pytest.raises(ValueError, match="runs 0 and 1 differ in the number of discs"):
        simulate_many([cloud(1)[0], other], dt=0.1, **PLAIN).to_xarray()
    with pytest.raises(AttributeError, match="did not record 'slope_x'; they have x, y"):
        _ = simulate_many(cloud(2), dt=0.1, **PLAIN).slope_x
    chains = [replace(problem, chain=replace(problem.chain, length=3.1 + i)) for i, problem in enumerate(cloud(2))]
    data = simulate_many(chains, dt=0.1, **PLAIN).to_xarray()
    np.testing.assert_array_equal(data.s.values, [problem.chain.s for problem in chains])


@pytest.mark.slow
def test_a_checkpoint_goes_on_to_the_same_bits(tmp_path, monkeypatch):
    problems, file = cloud(19), tmp_path / "runs.jsonl"
    problems[3] = stiff(problems[3])
    arguments = {"method": "rk4", "dt": 0.01, "frames": 2, "checkpoint": file} | PLAIN
    with pytest.warns(UserWarning, match="1 of 19 runs failed"):
        whole = simulate_many(problems, **arguments)
    lines = file.read_text().splitlines(keepends=True)
    assert len(lines) == 1 + 3
    for kept in (4, 3, 2, 1):
        file.write_text("".join(lines[:kept]) + lines[-1][:30] * (kept < 4))
        called = []
        monkeypatch.setattr(
            ensemble, "run_part", lambda *args, called=called: [called.append(args[0].numbers), part.run_part(*args)][1]
        )
        with pytest.warns(UserWarning, match="1 of 19 runs failed, as run 3: the run blew up"):
            again = simulate_many(problems, **arguments)
        assert len(called) == 4 - kept
        for name in ("x", "omega", "energy"):
            np.testing.assert_array_equal(getattr(again, name), getattr(whole, name))
        assert again[7].stats["steps"] == 100
        assert str(again.failed[3]) == str(whole.failed[3])
        assert (again.failed[3].step, again.failed[3].disc) == (whole.failed[3].step, whole.failed[3].disc)
    for other, changed in ((problems[1:], {}), (problems, {"dt": 0.02}), (problems, {"frames": 3})):
        with pytest.raises(ValueError, match="which are not of these problems or arguments; take another file"):
            simulate_many(other, **arguments | changed)
    (tmp_path / "mine").write_text("{}")
    with pytest.raises(ValueError, match="checkpoint must be a file that a simulate_many has written, or a new one"):
        simulate_many(problems, **arguments | {"checkpoint": tmp_path / "mine"})


@pytest.mark.slow
def test_processes_and_a_cluster():
    problems = cloud(10)
    expected = simulate_many(problems, dt=0.1, threads=1, **PLAIN)
    distributed = pytest.importorskip("distributed")
    with ProcessPoolExecutor(1, get_context("spawn")) as executor, ThreadPoolExecutor(2) as local:
        for given in (executor, local):
            runs = simulate_many(problems, dt=0.1, executor=given, **PLAIN)
            np.testing.assert_array_equal(runs.x, expected.x)
    options = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        runs = simulate_many(problems, dt=0.1, executor=client.get_executor(), **PLAIN)
    np.testing.assert_array_equal(runs.x, expected.x)


INTERRUPTED = """
import sys
from discs import simulate_many
from discs.chains.twist import untwisting_chain
print("begun", flush=True)
try:
    simulate_many([untwisting_chain(9)] * 32, dt=1e-5, engine="plain", threads=3, progress=False)
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.slow
def test_ctrl_c_ends_the_threads():
    with subprocess.Popen([sys.executable, "-c", INTERRUPTED], stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=20)
    assert said == "interrupted\n"


def test_the_same_problem_many_times():
    runs = simulate_many([untwisting_chain(9)] * 3, dt=0.5, **PLAIN)
    assert (runs.x == runs.x[0]).all()
    assert repr(runs) == "Runs(3 runs, 0 failed, 0 with warnings)"
