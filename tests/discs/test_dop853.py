"""Whole runs of DOP853 in compiled code; SciPy's are the plain twin."""

import numpy as np
import pytest

from discs import SimulationError, simulate
from discs.chains.twist import untwisting_chain
from discs.integrators import DOP853
from tests.conftest import Model, models, uneven

pytestmark = pytest.mark.filterwarnings("ignore:DOP853. energy is conserved")  # tolerances are large on purpose
NAMES = ("x", "y", "theta", "omega", "energy", "rolling_residual")


@models([Model("springs", "field"), Model("ring", "unit"), Model("springs", "steered")], [Model("springs", "field")])
def test_whole_runs_are_those_of_scipy(model):
    """Frames at the start, several in one step, one beyond a step; tolerances at which steps are repeated, too."""
    problem = uneven(7, model)
    times = np.array([0.0, 1e-4, 0.3, 0.31, 0.32, 1.0])
    for rtol in (1e-4, 1e-9):
        method = DOP853(rtol=rtol, atol=1e-2 * rtol)
        run, twin = (simulate(problem, method, frames=times, engine=engine, progress=False) for engine in ("compiled", "plain"))
        for name in NAMES:
            np.testing.assert_allclose(getattr(run, name), getattr(twin, name), atol=2e-12, rtol=0)
        if model.law == "steered":
            np.testing.assert_allclose(run.phi_rate, twin.phi_rate, atol=2e-12)
        assert run.stats["engine"] == "compiled"
        assert 0 < run.stats["gradients"] <= twin.stats["gradients"]  # SciPy makes an interpolant for each frame


def test_steps_are_at_most_dt():
    problem = uneven(7, Model("springs", "field"))
    loose = DOP853(rtol=1e-2, atol=1e-2)
    assert simulate(problem, loose, 0.01, progress=False).stats["gradients"] > 12 * problem.duration / 0.01
    assert simulate(problem, loose, problem.duration, progress=False).stats["gradients"] < 200


def test_runs_that_fail_do_so_step_by_step(monkeypatch):
    """With the time and the disc of the failure, as on the plain engine."""
    problem = uneven(7, Model("springs", "field"))
    monkeypatch.setattr(type(problem), "blown_up", 1e-6)
    said = []
    for engine in ("compiled", "plain"):
        with pytest.raises(SimulationError, match="blew up") as failure:
            simulate(problem, "DOP853", 0.1, engine=engine, progress=False)
        said.append(str(failure.value))
    assert said[0] == said[1]


@pytest.mark.parametrize("method", ["DOP853", "Radau"])
def test_steps_taken_are_counted(method):
    run = simulate(untwisting_chain(5, duration=2.0), method, dt=1.0, frames=3, engine="plain", progress=False)
    each = {"DOP853": 12, "Radau": 2}[method]  # evaluations a step, at least
    assert 2 < run.stats["steps"] <= run.stats["gradients"] / each


def test_both_engines_take_the_same_steps(kernels_as_python):
    runs = [
        simulate(untwisting_chain(5, duration=1.0), "DOP853", dt=1.0, frames=3, engine=e, progress=False)
        for e in ("plain", "compiled")
    ]
    assert runs[0].stats["steps"] == runs[1].stats["steps"] > 2
