"""Runs to a tolerance: the true error is below it, and stats name method and step."""

import pickle
import warnings
from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from compare.hardcases.problems import rough
from continuum import breathing_ring, rolling_rod, steered_rod, untwisting_rod
from discs import Gauss6, Gauss8, SimulationError, State, checks, load, simulate
from discs.integrators import DOP853
from discs.running.failure import NotReached
from discs.running.held import AGAIN, PART, Looks
from discs.running.once import run_fixed
from discs.running.tolerance import ATTEMPTS, answered, to_tolerance
from tests.conftest import SLAVED, STEERED, TRUE, Model, models, uneven

pytestmark = pytest.mark.slow


def true_error(problem, run):
    dt = min(problem.duration / 500, run.stats["dt"] / (2 if run.stats["method"] == "midpoint" else 8))
    exact = simulate(problem, Gauss8(tolerance=1e-14), dt, run.t, progress=False)
    rows = [(getattr(run, row), getattr(exact, row)) for row in problem.system.rows]
    return max(np.abs(a - b).max() / np.abs(b).max() for a, b in rows)


@pytest.mark.parametrize("tol", [3e-3, 1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize(
    "problem",
    [
        lump(untwisting_rod(), 65),
        lump(untwisting_rod(rolling="unit"), 200, "consistent"),
        lump(steered_rod(), 33),
        lump(breathing_ring(duration=2.0), 40),
    ],
    ids=["field", "unit", "steered", "ring"],
)
def test_the_true_error_is_within_the_tolerance(problem, tol):
    run = simulate(problem, "auto", tol=tol, frames=12, progress=False)
    assert true_error(problem, run) <= tol
    loose = 3e-3 if problem.chain.n == 33 else 3e-4  # own headings gain nothing by the midpoint method at 1e-3
    implicit = "midpoint" if tol >= loose else "gauss6" if tol > 1e-6 else "gauss8"
    assert run.stats["method"] in (implicit, "DOP853" if problem.chain.n == 33 else implicit)
    assert run.stats["attempts"] >= 2
    assert run.stats["dt"] > 0
    assert set(run.error_estimate) >= {*problem.system.rows, "omega", "energy"}
    assert run.t.size == 12


@models([Model("springs", "true"), Model("ring", "field")])
@pytest.mark.parametrize("method", ["midpoint", "suzuki4", "gauss4", "rk4", Gauss6(tolerance=1e-11)])
def test_a_method_of_one_s_own_choice(method, model):
    problem = uneven(7, model)
    run = simulate(problem, method, tol=1e-4, frames=3, progress=False)
    assert true_error(problem, run) <= 1e-4
    assert run.stats["method"] == getattr(method, "name", method)


@pytest.mark.parametrize(
    ("tol", "bound"),
    [(1e-3, {"x": 1e-3, "y": 1e-3}), ({"omega": 1e-4}, {"omega": 1e-4}), ({"x": 1, "omega": 2e-5}, {"x": 1.0, "omega": 2e-5})],
)
def test_tolerances_of_quantities(tol, bound):
    assert checks.tolerances(tol, ("x", "y", "omega"), ("x", "y"), 1e-12) == bound


@pytest.mark.parametrize(
    ("tol", "message"),
    [
        ({"spin": 1e-3}, "tol must be one of 'x', 'y', 'omega'; got 'spin'"),
        ({"omega": -1.0}, "tol of 'omega' must be a positive finite number; got -1.0"),
        ({}, "tol must name at least one of 'x', 'y', 'omega'; got {}"),
        (1e-300, "tol must be at least 1e-12, as positions are rounded; got 1e-300"),
        ({"omega": 1e-13}, "tol of 'omega' must be at least 1e-12"),
        ("small", "tol must be a positive finite number; got 'small'"),
    ],
)
def test_tolerances_that_are_none(tol, message):
    with pytest.raises(ValueError, match=message):
        checks.tolerances(tol, ("x", "y", "omega"), ("x", "y"), 1e-12)


def test_what_cannot_be_reached_is_said():
    with pytest.raises(ValueError, match="tol must be at least 1e-12"):
        simulate(uneven(5, Model("springs", "field")), tol=1e-300, progress=False)
    with pytest.raises(SimulationError, match="lost its heading"):
        simulate(lump(breathing_ring("unit", duration=4.0, omega=0.4), 24), "auto", frames=1, progress=False)


def test_long_runs_find_their_step():
    """The first step is a twentieth of the duration, here 150 times too long: runs fail, at ever other times, before one goes."""
    problem = lump(untwisting_rod(duration=60.0, radius=0.7, torsion_stiffness=0.8), 17)
    run = simulate(problem, "auto", tol=1e-3, frames=5, progress=False)
    truth = simulate(problem, "gauss8", dt=0.005, frames=5, progress=False)
    for name in ("x", "y", "theta"):
        exact = getattr(truth, name)
        assert np.abs(getattr(run, name) - exact).max() <= 1e-3 * np.abs(exact).max()


@pytest.mark.parametrize(
    ("heading_inertia", "stiffness", "n"), [(0.05, 10.0, 65), (0.02, 5.0, 65), (0.25, 75.0, 33), (0.05, 25.0, 33)]
)
def test_own_headings_that_swing_fast_are_followed(heading_inertia, stiffness, n):
    """Fast swings of little size: the error stalls until steps resolve them; the search must neither give up nor be content."""
    problem = lump(steered_rod(stiffness, stiffness, heading_inertia), n)
    run = simulate(problem, "auto", tol=1e-3, frames=11, progress=False)
    assert true_error(problem, run) <= 1e-3


def test_a_method_that_stalls_is_followed_by_one_of_higher_order():
    """White noise on every disc: the midpoint rule converges only once it resolves the shortest wave."""
    problem = rough(65, 4.5)
    run = simulate(problem, "auto", tol=1e-3, frames=5, progress=False)
    assert run.stats["method"] == "gauss6"
    assert run.stats["steps"] < 20_000
    assert true_error(problem, run) <= 1e-3


def test_rounding_is_shown_where_it_is_the_limit():
    """Rolling sideways all waves grow: a unit in the last place is far more than 1e-11 at the end."""
    problem = lump(rolling_rod(omega=3.0, amplitude=0.01, duration=6.0), 33)
    words = r"tol = 1e-11 was not reached: .* rounding of positions and sweeps changes a run by .*, so rounding is the limit"
    with pytest.raises(SimulationError, match=words) as caught:
        simulate(problem, "gauss8", tol=1e-11, frames=3, progress=False)
    assert caught.value.best.stats["attempts"] < ATTEMPTS
    assert pickle.loads(pickle.dumps(caught.value)).message == caught.value.message


def test_without_any_setting_a_run_is_to_a_thousandth():
    problem = lump(untwisting_rod(twist=2.0), 33, "consistent")
    run = simulate(problem, progress=False)
    assert run.stats["tol"] == 1e-3
    assert run.stats["unconverged"] == 0
    assert true_error(problem, run) <= 1e-3
    assert simulate(problem, dt=0.01, frames=1, progress=False).stats["method"] == "midpoint"
    assert simulate(problem, frames=[0.0], progress=False).theta[0].tolist() == np.asarray(problem.initial.theta).tolist()


def test_where_a_thousandth_is_out_of_reach_that_is_a_warning(monkeypatch):
    monkeypatch.setattr("discs.running.tolerance.ATTEMPTS", 4)
    problem = lump(untwisting_rod(twist=3.0), 33, "consistent")
    with pytest.warns(UserWarning, match=r"tol = 0.001 was not reached: the error is estimated at .*: this is the last run"):
        run = simulate(problem, progress=False)
    assert run.error_estimate["theta"] > 1e-3
    with pytest.raises(SimulationError, match=r"tol = 0.001 was not reached"):
        simulate(problem, tol=1e-3, progress=False)


@pytest.mark.parametrize("tol", [{"omega": 1e-4}, {"contact_force": 1e-3, "y": 1e-4}, {"phi_rate": 1e-3}])
def test_tolerances_bind_what_they_name(tol):
    problem = lump(steered_rod(), 17) if "phi_rate" in tol else lump(untwisting_rod(), 33, "consistent")
    run = simulate(problem, tol=tol, frames=12, want=("contact_force",), progress=False)
    exact = simulate(problem, "gauss8", run.stats["dt"] / 8, run.t, want=("contact_force",), progress=False)
    for name, bound in tol.items():
        there = getattr(exact, name)
        assert np.abs(getattr(run, name) - there).max() <= bound * np.abs(there).max()
    with pytest.raises(ValueError, match=r"tol must be one of 'x', .*'omega'.*; got 'contact_force'"):
        simulate(problem, tol={"contact_force": 1e-3}, progress=False)


def test_an_estimate_covers_every_frame():
    """The error peaks in a few of 2001 frames: the estimate is of all, whatever the search looked at."""
    problem = lump(untwisting_rod(), 17)
    run = simulate(problem, tol=1e-4, frames=2001, progress=False)
    exact = simulate(problem, "gauss8", 0.01, run.t, progress=False)
    for name in ("x", "y", "theta", "omega"):
        assert np.abs(getattr(run, name) - getattr(exact, name)).max() <= run.error_estimate[name]


def test_runs_with_steps_that_did_not_converge_are_never_taken():
    """Fifty sweeps are not enough at first; with steps so few the runs would agree by what they have in common."""
    problem = lump(untwisting_rod(twist=2.0), 65, "consistent")
    seen = []

    def run(problem, integrator, dt, times):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            seen.append(simulate(problem, integrator, dt, times, progress=False))
        return replace(seen[-1], x=0 * seen[-1].x, y=0 * seen[-1].y, theta=0 * seen[-1].theta)  # all agree

    found = to_tolerance(problem, "midpoint", 1e-3, np.linspace(0.0, 4.5, 3), run)
    assert seen[0].stats["unconverged"] > 0
    assert found.stats["unconverged"] == 0
    assert not any(made.stats["unconverged"] for made in seen[-2:])


def test_an_estimate_is_a_few_times_the_error():
    """Two methods, from smooth motions to stiff ones: the run is the one whose error the last run measured."""
    smooth, stiff = lump(breathing_ring(duration=2.0), 40), lump(steered_rod(10.0, 10.0, 0.05), 33)
    for problem, tol in [(smooth, 1e-10), (stiff, 1e-3), (stiff, 1e-6), (lump(untwisting_rod(), 65), 1e-5)]:
        run = simulate(problem, "auto", tol=tol, frames=6, progress=False)
        exact = simulate(problem, Gauss8(tolerance=1e-14), run.stats["dt"] / 8, run.t, progress=False)
        parts = [(run.error_estimate[row], getattr(run, row), getattr(exact, row)) for row in problem.system.rows]
        error = max(np.abs(a - b).max() / np.abs(b).max() for _, a, b in parts)
        assert error <= max(estimate / np.abs(b).max() for estimate, _, b in parts) <= 5 * error


@pytest.mark.parametrize("tol", [1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize(
    "scene", [untwisting_rod(), untwisting_rod(rolling="unit"), steered_rod()], ids=["field", "unit", "steered"]
)
def test_a_search_costs_a_few_times_its_result(scene, tol):
    """All runs together solve at most six times as many systems as the result, and none is made twice."""
    made = []

    def run(problem, integrator, dt, times):
        made.append(simulate(problem, integrator, dt, times, progress=False))
        return made[-1]

    found = to_tolerance(lump(scene, 33), "auto", tol, np.array([4.5]), run)
    assert sum(each.stats["solves"] for each in made) <= 6 * found.stats["solves"]
    steps = [each.stats["steps"] for each in made]
    assert max(steps) <= 4 * found.stats["steps"]
    assert len(set(steps)) == len(steps)


def test_what_limits_a_run_is_said_and_kept(tmp_path):
    problem = lump(untwisting_rod(duration=0.5), 17)
    for more in ({}, {"checkpoint": tmp_path / "run.nc"}, {"checkpoint": tmp_path / "run.nc"}):
        run = simulate(problem, "auto", tol=1e-2, frames=6, progress=False, **more)
        assert (run.stats["limited_by"], run.stats["steps"]) == ("fewest steps", 12)
    assert load(tmp_path / "run.nc").stats["limited_by"] == "fewest steps"


STEERED_LATER = pytest.param(steered_rod(), marks=pytest.mark.long, id="steered")  # a kernel that the short suite does not compile


@pytest.mark.parametrize("scene", [pytest.param(untwisting_rod(radius=0.7), id="field"), STEERED_LATER])
@pytest.mark.parametrize("tol", [1e-4, 1e-6, 1e-8])
def test_few_discs_go_by_dop853(scene, tol):
    """The error of the run, not of its steps, is within the tolerance and its estimate; `want` is left to others."""
    problem = lump(scene, 8)
    run = simulate(problem, "auto", tol=tol, frames=5, progress=False, engine="compiled")
    exact = simulate(problem, Gauss8(tolerance=1e-14), problem.duration / 800, run.t, progress=False)
    assert run.stats["method"] == "DOP853"
    for row in problem.system.rows:
        error, size = np.abs(getattr(run, row) - getattr(exact, row)).max(), np.abs(getattr(exact, row)).max()
        assert error <= tol * size
        assert error <= run.error_estimate[row]
    assert simulate(problem, "auto", tol=tol, frames=5, want=("slope",), progress=False).stats["method"] != "DOP853"


def test_what_hardly_moves_is_no_larger_than_it_is():
    """Discs that miss the bump but for 1e-13: where steps have a larger absolute tolerance, an unresolved run grows to 1e-11."""
    s = np.linspace(0.0, 3.0, 6)
    start = State(s, 0 * s, np.array([0.0, 0.0, 2e-13, 0.0, 0.0, 0.0]))
    problem = replace(lump(untwisting_rod(length=3.0, duration=3.2, radius=0.73), 6), initial=start)
    run = simulate(problem, tol=8e-8, frames=6, progress=False, engine="compiled")
    assert run.stats["method"] == "DOP853"
    assert max(np.abs(run.y).max(), np.abs(run.theta).max()) <= 3e-13


def test_coordinates_that_hardly_move_are_resolved():
    """Discs that miss the bump: y moves by a millionth, and its sweeps converge to a part of that."""
    s = np.linspace(0.0, 4.0, 5)
    start = State(s, 0 * s, 1e-6 * np.cos(np.pi * s / 4), 1e-6 * s)
    problem = replace(lump(untwisting_rod(duration=2.0), 5), initial=start)
    run = simulate(problem, tol=1e-7, frames=6, progress=False)
    assert np.abs(run.y).max() < 1e-5
    assert true_error(problem, run) <= 1e-7


def test_tolerances_below_rounding_are_refused_after_a_look(monkeypatch):
    """One unit in the last place makes more than 1e-12 of y: nothing finer than the runs that resolve the motion is tried."""
    problem = lump(rolling_rod(omega=3.0, amplitude=0.01, duration=3.0), 33)
    with pytest.raises(NotReached, match=r"rounding is the limit.*, or end the run earlier, before t = ") as caught:
        simulate(problem, tol=1e-12, frames=31, progress=False)
    assert 0 < caught.value.held_until < 3.0
    assert caught.value.best.error_estimate["y"] > 1e-8
    assert caught.value.best.stats["steps"] < 500


def rolling_at_random(n, duration):
    """A twisted rod that rolls as a whole: its motion is chaotic, that of the rod at rest is not."""
    problem = lump(untwisting_rod(duration=duration), n)
    return replace(problem, initial=replace(problem.initial, omega=np.ones(n)))


def test_a_chaotic_motion_is_followed_as_long_as_rounding_allows():
    """Its time is named: until shortly before it a run holds the tolerance, after it two fine runs of another method differ.

    Looking for it takes less than a tenth of the search.
    """
    problem, gradients = rolling_at_random(17, 1500.0), {"search": 0, "look": 0}

    def run(of, method, dt, times):
        made = run_fixed(of, method, dt, times)
        gradients["look" if times[-1] < 1500.0 else "search"] += made.stats["gradients"]
        return made

    with pytest.raises(NotReached, match=r"tol = 0.001 can be held until about t = .* only, .*; end the run earlier") as caught:
        to_tolerance(problem, "auto", 1e-3, np.array([750.0, 1500.0]), run)
    assert 0 < gradients["look"] < 0.1 * gradients["search"]
    until = caught.value.held_until
    times = np.array([0.6, 1.6]) * until
    one, other = (simulate(problem, "gauss6", dt, times, progress=False, engine="compiled") for dt in (0.02, 0.016))
    near, late = np.abs(one.theta - other.theta).max(axis=1) / np.abs(one.theta).max()
    assert near < 1e-3 < late
    early = simulate(problem, tol=1e-3, frames=[0.6 * until], progress=False)
    assert np.abs(early.theta - one.theta[0]).max() <= 1e-3 * np.abs(early.theta).max()
    assert pickle.loads(pickle.dumps(caught.value)).held_until == until


def looked(problem, used, part=PART):
    """What a look finds after so many gradients, and the looks."""
    looks = Looks(problem, problem.duration)
    looks.used, looks._part = used, part
    search = looks.look(dict.fromkeys(("x", "y", "theta"), 1e-3))
    return answered(search, run_fixed), looks


def test_a_regular_motion_is_looked_at_once():
    found, looks = looked(lump(untwisting_rod(duration=60.0), 9), 10_000_000)
    assert (found, looks.due) == (np.inf, np.inf)


def test_steps_that_do_not_resolve_the_motion_show_nothing():
    """Runs with long steps part at random: this growth is not shown to be that of the motion."""
    found, looks = looked(rolling_at_random(9, 300.0), 10_000_000, part=2.0)
    assert (found, looks._part) == (np.inf, 1.0)


def test_a_look_that_ends_too_early_is_repeated():
    found, looks = looked(rolling_at_random(9, 1500.0), 100_000)
    assert (found, looks.due) == (np.inf, AGAIN * 100_000)


def problem_of(seed):
    """A chain of any kind with a bent, twisted, rolling start, and a tolerance."""
    rng = np.random.default_rng(seed)
    model = (*SLAVED, *TRUE, *STEERED, *STEERED, *STEERED)[seed % 17]
    n = int(np.exp(rng.uniform(np.log(5), np.log(12 if model.law == "true" else 60))))
    problem = uneven(n, model, seed, equal=model.ends == "consistent")
    duration = 0.3 if model == Model("ring", "unit") else np.exp(rng.uniform(np.log(0.5), np.log(3.0)))  # before it collapses
    return replace(problem, duration=float(duration)), float(10 ** -rng.uniform(2, 4 if model.law == "true" else 8))


@pytest.mark.parametrize("seed", range(25))
def test_random_problems_are_within_their_tolerance(seed):
    """No failure, no error above the tolerance; the reference is of another kind, or of steps eight times shorter."""
    problem, tol = problem_of(seed)
    run = simulate(problem, "auto", tol=tol, frames=4, progress=False)
    small = problem.chain.n <= 12 and problem.system.parameters is not None
    if small:
        exact = simulate(problem, DOP853(rtol=1e-11, atol=1e-13), problem.duration, run.t, progress=False)
    else:
        exact = simulate(problem, Gauss8(tolerance=1e-13), run.stats["dt"] / 8, run.t, progress=False)
    for row in problem.system.rows:
        there = getattr(exact, row)
        error = np.abs(getattr(run, row) - there).max()
        assert error <= tol * np.abs(there).max()
        assert error <= run.error_estimate[row]
