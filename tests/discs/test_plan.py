"""What runs of a problem have in common is kept from one to the next, and never taken for another run."""

from dataclasses import replace

import numpy as np
import pytest

from discs import Midpoint, simulate
from discs.loads import Damping
from tests.discs.conftest import Model, uneven

PROBLEM = replace(uneven(9, Model("springs", "field"), seed=5), duration=0.3)


def test_the_plan_of_the_last_run_is_kept(tmp_path):
    problem, settled = replace(PROBLEM), {"dt": 0.1, "frames": 2, "progress": False}
    simulate(problem, engine="compiled", **settled)
    plan = problem.kept["plan"][0]
    simulate(problem, "midpoint", engine="compiled", **settled | {"dt": 0.05})
    assert problem.kept["plan"][0] is plan
    for other in ({"method": Midpoint(sweeps=9)}, {"engine": "plain"}, {"want": "slope"}, {"checkpoint": tmp_path / "run.nc"}):
        simulate(problem, **{"engine": "compiled"} | settled | other)
        assert problem.kept["plan"][0] is not plan
        simulate(problem, engine="compiled", **settled)
        plan = problem.kept["plan"][0]
    assert (tmp_path / "run.nc").exists()


def test_runs_in_turns_are_those_of_new_problems(tmp_path):
    """Methods, engines, quantities, files and loads one after the other."""
    braked = replace(PROBLEM, loads=(Damping(rolling=0.3),))
    kept = {False: replace(PROBLEM), True: replace(braked)}
    several = [
        {"engine": "compiled"},
        {"engine": "plain"},
        {"engine": "compiled", "want": ("velocity", "contact_force")},
        {"engine": "compiled", "method": Midpoint(tolerance=1e-5)},
        {"engine": "compiled", "checkpoint": tmp_path / "run.nc"},
        {"engine": "compiled", "method": "leapfrog", "want": "modified_energy"},
        {"engine": "compiled"},
    ]
    for turn, asked in enumerate(several):
        for loaded in (False, True) if "checkpoint" not in asked and asked.get("method") != "leapfrog" else (False,):
            settled = {"dt": 0.1, "frames": 4, "progress": False} | asked
            run = simulate(kept[loaded], **settled)
            alone = {name: value for name, value in settled.items() if name != "checkpoint"}
            new = simulate(replace(braked if loaded else PROBLEM), **alone)
            for name in ("x", "theta", "omega", "energy", "x_rate", "contact_force", "modified_energy", "balance"):
                one, other = getattr(run, name), getattr(new, name)
                assert (one is None) == (other is None), (turn, name)
                np.testing.assert_array_equal(one, other, err_msg=f"{turn} {name}")
            assert run.stats["engine"] == asked["engine"]


def test_a_plan_does_not_let_through_what_is_refused():
    problem = replace(PROBLEM, loads=(Damping(rolling=0.3),))
    simulate(problem, dt=0.1, frames=1, progress=False)
    for _ in range(2):
        with pytest.raises(ValueError, match="takes loads that are part of the energy only"):
            simulate(problem, "leapfrog", dt=0.01, progress=False)
        with pytest.raises(ValueError, match="engine must be one of"):
            simulate(problem, dt=0.1, engine="fast", progress=False)
