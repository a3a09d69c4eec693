"""Ctrl-C within compiled calls."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest

from discs import Gauss6, Midpoint, simulate
from discs.integrators import METHODS
from discs.running import recording, time_loop
from tests.conftest import Model, uneven

pytestmark = pytest.mark.slow


def pressing(seconds: float):
    """Another process that presses Ctrl-C: a thread of this one could not, while a compiled call keeps Python to itself."""
    return subprocess.Popen([sys.executable, "-c", f"import os, time; time.sleep({seconds}); os.kill({os.getpid()}, 2)"])


SWEPT = [Midpoint(sweeps=300_000, tolerance=0), Gauss6(sweeps=100_000, tolerance=0)]
EACH = [METHODS[name]() for name in ("midpoint", "suzuki4", "gauss6", "mclachlan-perlmutter", "rk4", "leapfrog")]


@pytest.mark.parametrize(
    ("method", "h", "frame"),
    [*((method, 1e-8, 2e-3) for method in EACH), *((method, 1e-3, 1e-3) for method in SWEPT), (SWEPT[0], 2e-3, 1e-3)],
    ids=lambda value: getattr(value, "name", value),
)
def test_ctrl_c_is_heard_within_a_compiled_call(method, h, frame, monkeypatch):
    """A call of many steps, a step of many sweeps and a frame between steps would all take some ten seconds of the processor."""
    monkeypatch.setattr(time_loop, "CHUNK", 10**12)
    problem = uneven(1000, Model("springs", "field"))
    simulate(problem, type(method)(), 1e-8, [1e-8, 1.5e-8], progress=False)  # compiled
    press, started = pressing(0.3), time.process_time()
    with pytest.raises(KeyboardInterrupt):
        simulate(problem, method, h, [frame], progress=False)
    press.wait()
    assert time.process_time() - started < 3


@pytest.mark.parametrize(("sweeps", "steps"), [(3_000, 400), (500_000, 2.5)], ids=["many-steps", "a-frame-between-steps"])
def test_ctrl_c_within_a_call_keeps_a_checkpoint(sweeps, steps, tmp_path, monkeypatch):
    """The call is dropped, the memory is that of before, and the run goes on from there to the same bits."""
    monkeypatch.setattr(time_loop, "CHUNK", 10**12)
    problem, h, path = uneven(100, Model("springs", "field")), 1e-3, tmp_path / "run.nc"
    settled = {"method": Midpoint(sweeps=sweeps, tolerance=0), "dt": h, "frames": np.array([0, h, steps * h]), "progress": False}
    simulate(problem, Midpoint(), h, [h, 1.5 * h], progress=False)  # compiled
    whole = simulate(problem, **settled)
    press = []

    original = recording.Recording.begin

    def begin(self, *arguments):
        press.append(pressing(0.2))
        return original(self, *arguments)

    with monkeypatch.context() as patched:
        patched.setattr(recording.Recording, "begin", begin)
        patched.setattr(recording, "SECONDS", np.inf)  # no restart file but the last
        with pytest.raises(KeyboardInterrupt, match=r"holds [12] of 3 frames, and the same call goes on from there"):
            simulate(problem, **settled, checkpoint=path)
    press[0].wait()
    assert (tmp_path / "run.nc.restart").exists()
    run = simulate(problem, **settled, checkpoint=path)
    for name in ("x", "y", "theta", "omega", "energy"):
        assert getattr(run, name).tobytes() == getattr(whole, name).tobytes()
    assert run.stats["solves"] == whole.stats["solves"]
