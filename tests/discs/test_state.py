"""The state at a frame starts another run; a selection of frames is a run."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import Rod, free_rod, solve, steered_rod
from discs import Problem, load, simulate
from discs.files.schema import QUANTITIES
from discs.running.time_loop import March
from tests.conftest import ALL, STEERED, Model, models, uneven
from tests.discs.test_archive import same
from tests.discs.test_restart import stopped

OPEN = Model("springs", "field")


@models(ALL)
def test_a_state_goes_on_with_the_motion(model):
    """Steps from a frame's state are those of the whole run, up to the rounding that frames leave out."""
    problem = uneven(6, model)
    whole = simulate(problem, "gauss4", 0.05, 5, engine="plain", progress=False)
    for frame, rest in ((2, 3), (-3, 3), (3, 2)):
        again = Problem(problem.chain, whole.state(frame), problem.duration * (rest - 1) / 4)
        assert again.energy() == pytest.approx(whole.energy[frame], rel=1e-13)
        run = simulate(again, "gauss4", 0.05, rest, engine="plain", progress=False)
        for name in (*problem.system.rows, "omega", "energy"):
            np.testing.assert_allclose(getattr(run, name), getattr(whole, name)[-rest:], atol=1e-11, err_msg=name)


def test_headings_keep_turning():
    """Without phi_rate a restart from frames would have the energy 0.0945 instead of 0.0989."""
    problem = lump(steered_rod(twist=0.143, heading_inertia=0.25, duration=3.0), 17)
    run = simulate(problem, dt=0.02, frames=4, progress=False)
    assert np.abs(run.phi_rate).max() > 0.01
    turning = Problem(problem.chain, run.state(), 1.0)
    assert turning.energy() == pytest.approx(run.energy[0], rel=1e-12)


def test_a_state_from_a_file(tmp_path):
    problem = uneven(6, STEERED[0])
    run = simulate(problem, dt=0.05, frames=3, progress=False, checkpoint=tmp_path / "run.nc")
    for name in ("x", "y", "theta", "omega", "phi", "phi_rate"):
        np.testing.assert_array_equal(getattr(load(tmp_path / "run.nc").state(1), name), getattr(run, name)[1], err_msg=name)
    replace(run, phi_rate=None).save(tmp_path / "old.nc")  # as an older version wrote it
    old = load(tmp_path / "old.nc")
    assert old.phi.tobytes() == run.phi.tobytes()
    with pytest.raises(ValueError, match="this run lacks phi_rate, the rates of its headings, as archives of an older version"):
        old.state()


def test_an_old_unfinished_file_is_not_gone_on_with(tmp_path, monkeypatch):
    problem, path = uneven(6, STEERED[0]), tmp_path / "run.nc"
    settled = {"dt": 0.05, "frames": 9, "engine": "plain"}
    observe = March.observe
    monkeypatch.setattr(March, "observe", lambda *a: {k: v for k, v in observe(*a).items() if k != "phi_rate"})
    stopped(monkeypatch, 9, problem, **settled, checkpoint=path)
    monkeypatch.undo()
    with pytest.raises(ValueError, match="was begun by an older version, which did not record phi_rate; give another path"):
        simulate(problem, **settled, checkpoint=path)


def test_states_that_there_are_not():
    run = simulate(uneven(5, OPEN), dt=0.1, frames=3, engine="plain", progress=False)
    for frame in (3, -4, 10**400):
        with pytest.raises(ValueError, match="frame must be"):
            run.state(frame)
    with pytest.raises(ValueError, match=r"frame must be a whole number of at least -3; got 1\.0"):
        run.state(1.0)
    rod = Rod(length=2, density=1, spin_inertia=1, torsion_stiffness=1, bending_stiffness=1, radius=0)
    free = free_rod(rod, lambda s: (s, 0 * s), lambda s: (0 * s, 0 * s), 0.0, 0.0, 0.1, 5, 0.05, frames=2, progress=False)
    with pytest.raises(ValueError, match="a free rod does not roll, and its state is more than a State: go on by free_rod"):
        free.state()


def test_a_field_gives_the_state_of_its_nodes():
    field = solve(steered_rod(duration=0.2), 1e-2, progress=False)
    state = field.state()
    assert np.shape(state.phi_rate) == field.s.shape
    np.testing.assert_array_equal(state.phi_rate, field.phi_rate[-1])


@pytest.mark.filterwarnings("ignore:.* is too long for this motion")
def test_slices_of_a_run(tmp_path):
    want = ("velocity", "slope", "contact_force")
    run = simulate(uneven(5, STEERED[0]), dt=0.1, frames=9, want=want, engine="plain", progress=False)
    for frames in (slice(2, 7), slice(None, None, 3), slice(-1, None), run.t > 0.4, [0, 3, 4]):
        part = run[frames]
        for name in ("t", *(name for name in QUANTITIES if getattr(run, name) is not None)):
            np.testing.assert_array_equal(getattr(part, name), getattr(run, name)[frames], err_msg=name)
        assert part.s is run.s
        assert part.problem is run.problem
    run[2:5].save(tmp_path / "part.nc")
    same(load(tmp_path / "part.nc"), run[2:5])
    np.testing.assert_array_equal(run[:4].state().phi_rate, run.state(3).phi_rate)


@pytest.mark.parametrize("frames", [-1, 2, slice(3, 3), slice(None, None, -1), [3, 1], [1, 1], [9], "x", 1.5, [True], (0, 1), None])
def test_other_slices_are_refused(frames):
    run = simulate(uneven(5, OPEN), dt=0.1, frames=9, engine="plain", progress=False)
    with pytest.raises(ValueError, match=r"picked by a slice, a mask or numbers of frames.* run\[i : i \+ 1\].* run\.state\(i\)"):
        run[frames]
    with pytest.raises(TypeError):
        iter(run)
