"""What a run of fixed steps says of its own error, and what that costs."""

import numpy as np
import pytest

from compare import lump
from compare.hardcases.problems import rough
from continuum import rolling_rod, untwisting_rod
from discs import Problem, State, SteeredChain, simulate
from discs.chains.twist import untwisting_chain
from discs.command_line import summary
from discs.integrators import METHODS, OneStep
from discs.running.step_error import DOUBTFUL
from tests.conftest import Model, uneven

FIXED = [name for name, cls in METHODS.items() if not cls.adaptive]
TOO_LONG = [
    (lump(untwisting_rod(twist=2.0), n=65, ends="consistent"), {"method": "midpoint"}, r"38 of 100 steps did not converge"),
    (
        lump(untwisting_rod(), 33),
        {"dt": 4.5},
        r"did not converge; dt = 4.5 is too long for this motion.*by 100 % or more.*take dt = ",
    ),
    (lump(rolling_rod(omega=100.0, duration=1.0, amplitude=1e-2), 33), {"dt": 0.05}, "did not converge.*off by 100 % or more"),
    (untwisting_chain(4097, duration=4.0), {"dt": 1.0}, r"did not converge.*off by 100 % or more"),
    (rough(65, 4.5), {"method": "midpoint"}, "dt = 0.045 is too long for this motion.*off by 100 % or more"),
    (lump(untwisting_rod(duration=9.0), 65), {"method": "leapfrog"}, "energy is conserved.*too long for this motion"),
]


@pytest.mark.parametrize(("problem", "settled", "message"), TOO_LONG, ids=["twist", "one", "rolling", "many", "rough", "leapfrog"])
@pytest.mark.slow
def test_a_step_that_is_too_long_is_said(problem, settled, message):
    with pytest.warns(UserWarning, match=message) as heard:
        run = simulate(problem, **settled, progress=False)
    assert len(heard) == 1
    assert heard[0].filename == __file__
    assert "may not be trusted" in str(heard[0].message)
    for told in (repr(run), summary(run)):
        assert "did not converge" in told or "too long" in told


def test_a_step_that_converges_is_named():
    """With the step that `stats` names all steps converge."""
    problem = lump(untwisting_rod(twist=2.0), n=65, ends="consistent")
    with pytest.warns(UserWarning, match=r"steps did not converge.*take dt = 0\.00"):
        run = simulate(problem, "midpoint", progress=False)
    assert run.stats["converging_dt"] == run.stats["dt"] / 4
    finer = simulate(problem, "midpoint", run.stats["converging_dt"], progress=False)
    assert finer.stats["unconverged"] == 0


@pytest.mark.parametrize("name", FIXED)
def test_the_error_of_steps_is_that_of_the_run(name):
    """Steps long enough for errors to show. Above order 2 the estimate may be a bound, as long as that is below 1 %."""
    problem = uneven(7, Model("springs", "field"))
    dt = (
        {2: 0.02, 3: 0.04, 4: 0.1, 5: 0.15, 6: 0.2, 8: 0.25}[METHODS[name].order]
        if np.isinf(METHODS[name]().stability_limit)
        else None
    )
    run = simulate(problem, name, dt, progress=False)
    exact = simulate(problem, "gauss8", 0.02, progress=False)
    error = max(np.abs(getattr(run, q) - getattr(exact, q)).max() / np.abs(getattr(exact, q)).max() for q in ("x", "y", "theta"))
    found = run.stats["step_error"]
    assert error / 5 < found < max(10 * error, DOUBTFUL if METHODS[name].order > 2 else 0.0)


@pytest.mark.parametrize("engine", ["compiled", "plain"])
@pytest.mark.parametrize(("dt", "compared"), [(0.0025, 0), (0.02, 0), (0.2, 1), (0.5, 1), (1.0, 1)])
def test_only_doubtful_steps_are_compared(dt, compared, engine, monkeypatch):
    """Runs of 400, 50, 5, 2 and 1 steps; the plain form always compares where there are no third differences."""
    done, finer = [], OneStep.finer
    monkeypatch.setattr(OneStep, "finer", lambda self, *rest: done.append(1) or finer(self, *rest))
    with np.errstate(all="raise"):
        simulate(uneven(7, Model("springs", "field")), dt=dt, frames=1, progress=False, engine=engine)
    assert bool(done) == compared


@pytest.mark.parametrize("dt", [0.0025, 0.02, 0.2])
def test_looks_do_not_change_with_frames_or_engine(dt):
    """A look goes on over the ends of compiled calls, one for each frame."""
    problem = uneven(7, Model("springs", "field"))
    told = [simulate(problem, dt=dt, frames=f, progress=False).stats["step_error"] for f in (1, 2, 57)]
    assert told[0] == told[1] == told[2] > 0
    assert simulate(problem, dt=dt, frames=1, progress=False, engine="plain").stats["step_error"] == pytest.approx(
        told[0], rel=1e-6
    )


@pytest.mark.parametrize("engine", ["compiled", "plain"])
def test_whole_turns_are_not_missed(engine):
    """Loose discs turn once in each step: they roll on circles, and the steps, all alike, lead straight on."""
    loose = {"stretch_stiffness": 1e-9, "shear_stiffness": 1e-9, "torsion_stiffness": 1e-9, "bending_stiffness": 1.0}
    chain = SteeredChain(n=3, length=2.0, density=1.0, spin_inertia=1.0, radius=1.0, heading_inertia=1.0, **loose)
    start = State(chain.s, 0 * chain.s, 0 * chain.s, omega=[1.0] * 3, phi=[0.0] * 3, phi_rate=[2 * np.pi / 0.01] * 3)
    with pytest.warns(UserWarning, match="dt = 0.01 is too long for this motion"):
        simulate(Problem(chain, start, 0.5), dt=0.01, frames=2, progress=False, engine=engine)
