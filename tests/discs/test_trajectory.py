"""The motion of a mechanical system has pictures and files as a run has: plot, view, animate, save, load, to_xarray."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from discs import MechanicalSystem, Problem, State, load, simulate
from discs.command_line import about
from discs.loads import Linear
from discs.mechanics import Trajectory, driven, textbook
from discs.mechanics.lagrange import frames, lagrange_dalembert
from tests.conftest import SLAVED, STEERED, uneven

pytestmark = pytest.mark.slow  # every kind of system, saved, drawn and loaded

TIMES = np.linspace(0, 1, 5)


def disc():
    return textbook.rolling_disc(1.3, 0.6, 0.4, 0.7, roll_rate=1.1, turn_rate=0.8).integrate(TIMES, progress=False)


def ball():
    book = driven.ball_on_turntable(1.3, 0.7, 0.25, table_rate=1.7, place=(0.4, -0.3), velocity=(0.2, 0.5))
    return book.integrate(TIMES, progress=False)


def sleigh():
    return textbook.chaplygin_sleigh(1.3, 0.4, 0.35, speed=0.9, turn_rate=1.7).integrate(TIMES, progress=False)


def free():
    """No constraints, no discs."""
    return MechanicalSystem.from_lagrangian(("a", "b"), np.eye(2), lambda q: 0.5 * q @ q).integrate([1, 0], [0, 1], TIMES)


def chain(n, model):
    problem = replace(uneven(n, model), duration=0.3)
    system, (q, v) = lagrange_dalembert(problem, dense=True), frames(problem)
    return problem, system.integrate(q, v, np.linspace(0, 0.3, 4), progress=False)


# Discs


def test_one_disc_as_a_run():
    path = disc()
    run = path.discs
    for i, name in enumerate(("x", "y", "theta", "phi")):
        np.testing.assert_array_equal(getattr(run, name)[:, 0], path.q[:, i])
    for i, name in enumerate(("x_rate", "y_rate", "omega", "phi_rate")):
        np.testing.assert_allclose(getattr(run, name)[:, 0], path.v[:, i], atol=1e-15)
    assert run.stats == {"method": "DOP853", "radius": 0.7}


def test_a_blade_is_a_disc_that_does_not_turn_and_runs_along_itself():
    run = sleigh().discs
    assert not run.theta.any()
    forward = np.array([-np.sin(run.phi[:, 0]), np.cos(run.phi[:, 0])])
    speed = np.array([run.x_rate[:, 0], run.y_rate[:, 0]])
    np.testing.assert_allclose(speed - forward * (speed * forward).sum(axis=0), 0, atol=1e-12)


@pytest.mark.parametrize("model", [SLAVED[0], STEERED[0]], ids=str)
def test_two_discs_as_the_run_that_they_are(model):
    problem, path = chain(2 if model in STEERED else 3, model)
    run, known = path.discs, simulate(problem, "gauss8", 0.01, frames=4, want=("velocity",), engine="plain", progress=False)
    for name in ("x", "y", "theta", "omega", "x_rate", "y_rate", *(("phi", "phi_rate") if model in STEERED else ())):
        np.testing.assert_allclose(getattr(run, name), getattr(known, name), atol=1e-7)
    assert run.problem is problem
    np.testing.assert_array_equal(run.s, problem.chain.s)


def test_a_damped_chain_is_the_run_with_that_load():
    """The load in q. = C pi, pi. = -C^T (grad V - f), against the same forces in the saddle point, with their work."""
    problem = replace(uneven(3, STEERED[0]), duration=0.3)
    damping = np.array([[0.3] * 3, [0.2] * 3, [0.5, 0.1, 0.4], [0.2] * 3])
    system, (q, v) = lagrange_dalembert(problem, dense=True), frames(problem)
    system = replace(system, applied=lambda t, q, v: -damping.ravel() * v)
    path = system.integrate(q, v, np.linspace(0, 0.3, 4), 1e-10, progress=False)
    loaded = replace(problem, loads=(Linear(damping=damping),))
    known = simulate(loaded, "gauss8", 0.01, frames=4, engine="plain", progress=False)
    for name in ("x", "y", "theta", "phi", "omega", "energy"):
        np.testing.assert_allclose(getattr(path.discs, name), getattr(known, name), atol=1e-8)
    np.testing.assert_allclose(path.energy - path.energy[0], path.work, atol=1e-9)
    assert path.work[-1] < -1e-3
    np.testing.assert_allclose(path.discs.work, known.work - known.dissipated, atol=1e-8)


def test_discs_of_a_system_of_ones_own():
    """Two wheels on an axle of length 1 about its middle: x, y, angle, and both roll angles; axles along the axle."""

    def places(q):
        away = 0.5 * np.array([-1, 1])
        return [q[0] + away * np.cos(q[2]), q[1] + away * np.sin(q[2]), q[3:], q[2] + 0 * q[3:]]

    system = MechanicalSystem.from_lagrangian(
        ("x", "y", "phi", "left", "right"), np.diag([1.0, 1, 0.2, 0.1, 0.1]), lambda q: 0.0, bodies=places
    )
    path = system.integrate(np.zeros(5), [0, 0, 1.0, -0.5, 0.5], TIMES, progress=False)
    run = path.discs
    np.testing.assert_allclose(run.x, [[-0.5 * np.cos(t), 0.5 * np.cos(t)] for t in TIMES], atol=1e-10)
    np.testing.assert_allclose(run.y_rate, [[-0.5 * np.cos(t), 0.5 * np.cos(t)] for t in TIMES], atol=1e-10)
    np.testing.assert_allclose(run.omega, [[-0.5, 0.5]] * 5, atol=1e-12)
    np.testing.assert_allclose(run.s, [0, 1])
    assert '"n": 2' in path.view().page


def test_two_discs_have_a_line_that_they_follow():
    """Places without directions, as of discs whose headings follow the line; one disc needs its direction, see below."""
    system = MechanicalSystem.from_lagrangian(
        ("x", "y"), np.eye(2), lambda q: 0.0, bodies=lambda q: [q[0] + np.arange(2), q[1] + np.zeros(2), np.zeros(2)]
    )
    run = system.integrate([0.0, 0.0], [0.3, 0.4], TIMES, progress=False).discs
    np.testing.assert_allclose(run.x, np.add.outer(0.3 * TIMES, [0.0, 1.0]), atol=1e-12)
    assert run.phi is None


@pytest.mark.parametrize(
    ("bodies", "shape"), [(lambda q: q[:3], r"\(3,\)"), (lambda q: np.ones((2, 2)), r"\(2, 2\)"), (lambda q: 1.0, r"\(\)")]
)
def test_places_of_a_wrong_shape_are_refused_before_the_run(bodies, shape):
    system = replace(textbook.rolling_disc(1.3, 0.6, 0.4, 0.7, roll_rate=1.1, turn_rate=0.8).system, bodies=bodies)
    with pytest.raises(ValueError, match=r"bodies must be q -> \(x, y, theta, phi\).*; got shape " + shape):
        system.integrate(np.zeros(4), np.zeros(4), TIMES)


def test_in_one_line():
    path = ball()
    told = repr(replace(path, work=path.work + 0.25))
    assert told.startswith("Trajectory(5 frames of 5 coordinates, t = 0 to 1, method 'DOP853', energy ")
    assert told.endswith(" and works to within 2.5e-01)")


# Pictures


def test_coordinates_against_time():
    path = ball()
    axes = path.plot()
    assert [ax.get_ylabel() for ax in axes] == ["coordinates q", "velocities v", "multipliers λ", "energy", "y (length)"]
    for ax, values in zip(axes, (path.q, path.v, path.multipliers), strict=False):
        assert [line.get_xdata().tolist() for line in ax.lines] == [path.t.tolist()] * values.shape[1]
        np.testing.assert_array_equal([line.get_ydata() for line in ax.lines], values.T)
    assert [text.get_text() for text in axes[0].get_legend().get_texts()] == ["x", "y", "a", "b", "c"]
    assert [text.get_text() for text in axes[2].get_legend().get_texts()] == ["ball, row 0", "ball, row 1"]
    change, forces, reactions = (line.get_ydata() for line in axes[3].lines)
    np.testing.assert_allclose(change, forces + reactions, atol=1e-9)
    np.testing.assert_array_equal(axes[4].lines[0].get_xydata(), path.q[:, :2])


def test_panels_that_a_motion_has():
    assert len(free().plot()) == 3  # no multipliers, no path
    _, path = chain(2, STEERED[0])
    (above,) = path.plot("above")
    np.testing.assert_array_equal(above.lines[2].get_xydata(), path.q[:, [1, 3]])
    with pytest.raises(ValueError, match="panel must be one of 'coordinates', 'velocities', 'energy'; got 'above'"):
        free().plot("above")


def test_pages_and_movies(tmp_path):
    path = disc()
    page = path.view(tmp_path / "disc.html", beside=sleigh()).page
    assert page.count('"n": 1') == 2
    assert page == path.discs.view(beside=sleigh().discs).page
    assert path.animate(tmp_path / "disc.gif", size=(64, 48), progress=False).stat().st_size > 500


def test_without_discs_there_is_no_page(tmp_path):
    for draw in (free().view, lambda: free().animate(tmp_path / "no.gif"), lambda: disc().view(beside=free())):
        with pytest.raises(ValueError, match=r"the system does not say where its discs are: give it bodies.*plot\(\)"):
            draw()
    with pytest.raises(ValueError, match="beside must be another Solution; got str"):
        disc().view(beside="disc")


# Files

MADE = {
    "disc": disc,
    "ball": ball,
    "free": free,
    "sleigh": sleigh,
    "slaved": lambda: chain(3, SLAVED[0])[1],
    "steered": lambda: chain(2, STEERED[0])[1],
}


@pytest.mark.parametrize("name", MADE)
def test_what_is_saved_is_loaded(name, tmp_path):
    path = MADE[name]()
    path.save(tmp_path / "path.nc")
    found = load(tmp_path / "path.nc")
    assert isinstance(found, Trajectory)
    for array in ("t", "q", "v", "multipliers", "energy", "residual", "mu", "work", "reaction_work"):
        np.testing.assert_array_equal(getattr(found, array), getattr(path, array))
    assert (found.names, found.owners) == (path.names, path.owners)
    assert found.stats["steps"] == path.stats["steps"]
    assert (found.bodies is None) == (path.bodies is None)
    if path.bodies is not None:
        assert found.view().page == path.view().page
        for array in ("x", "y", "theta", "omega", "phi", "x_rate", "phi_rate"):
            np.testing.assert_array_equal(getattr(found.discs, array), getattr(path.discs, array))
        assert (found.discs.problem is None) == (path.discs.problem is None)
    if name == "slaved":
        np.testing.assert_array_equal(found.discs.problem.chain.density, path.discs.problem.chain.density)
    again = load(tmp_path / "path.nc")
    again.save(tmp_path / "again.nc")
    assert found.to_xarray().identical(load(tmp_path / "again.nc").to_xarray())
    assert len(found.plot()) == len(path.plot())
    assert f"recorded: {'x, y, theta' if path.bodies else 'energy, q, v'}" in about(tmp_path / "path.nc")


def test_a_vakonomic_motion_has_its_charges(tmp_path):
    problem = uneven(2, STEERED[0])
    system, (q, v) = lagrange_dalembert(problem, dense=True), frames(problem)
    path = system.integrate(q, v, [0, 0.1], 1e-8, mu=[0.1, -0.2, 0.3, 0.0], progress=False)
    path.save(tmp_path / "path.nc")
    np.testing.assert_array_equal(load(tmp_path / "path.nc").mu, path.mu)


def test_a_dataset_has_names():
    path = ball()
    data = path.to_xarray()
    np.testing.assert_array_equal(data.v.sel(coordinate="y"), path.v[:, 1])
    assert data.multipliers.dims == ("time", "constraint")
    assert data.constraint.values.tolist() == ["ball", "ball"]
    assert data.work.attrs["long_name"] == "work of applied forces"


def test_files_that_are_not_what_was_written_are_refused(tmp_path):
    path = tmp_path / "path.nc"
    ball().save(path)
    with h5py.File(path, "a") as file:
        place = file["q"].id.get_offset()
    data = bytearray(path.read_bytes())
    data[place + 9] ^= 1
    (tmp_path / "changed.nc").write_bytes(data)
    with pytest.raises(ValueError, match=r"changed\.nc is damaged: frame 0 is not what was written"):
        load(tmp_path / "changed.nc")
    replace(ball(), names=("x", "y")).save(path)
    with pytest.raises(ValueError, match=r"path\.nc is damaged: names must be one text for each of 5 columns of q"):
        load(path)


def test_frames_that_go_back_are_not_saved(tmp_path):
    path = replace(free(), t=-TIMES)
    with pytest.raises(ValueError, match="a file holds frames in order of time; those of this motion go back"):
        path.save(tmp_path / "path.nc")
    assert not list(tmp_path.iterdir())


def test_runs_are_as_before(tmp_path):
    problem = Problem(uneven(3, STEERED[0]).chain, State(np.arange(3.0), 0.0, 0.0, 0.5, 0.1), 0.1)
    run = simulate(problem, dt=0.05, engine="plain", progress=False)
    assert run.discs is run
    run.save(tmp_path / "run.nc")
    assert type(load(tmp_path / "run.nc")) is type(run)
