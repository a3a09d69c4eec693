import subprocess
import sys

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from discs import simulate
from discs.pictures import figures, geometry
from discs.pictures.style import ORANGE
from tests.conftest import Model, uneven


def run_of(ends="springs", law="field", frames=5, want=(), n=9):
    return simulate(uneven(n, Model(ends, law)), dt=0.05, frames=frames, want=want, progress=False)


@pytest.mark.slow
def test_imports_are_light_and_open_no_window():
    code = """
import sys
import discs, continuum
assert not {"matplotlib", "PIL", "imageio_ffmpeg"} & set(sys.modules)
import discs.pictures.figures, discs.pictures.animation, discs.pictures.view
assert "matplotlib.pyplot" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True)


# ---- poses


@pytest.mark.filterwarnings("ignore:.* is too long for this motion")
def test_slopes_from_positions_are_those_of_the_chain(ends, rolling):
    recorded, bare = run_of(ends, rolling, want=("slope",)), run_of(ends, rolling)
    inner = slice(None) if ends in ("springs", "paper", "ring") else slice(1, -1)  # a ghost disc is not known here
    np.testing.assert_allclose(geometry.slopes(bare)[..., inner], geometry.slopes(recorded)[..., inner], rtol=0, atol=1e-12)


@pytest.mark.filterwarnings("ignore:.* is too long for this motion")
def test_axles_are_across_the_velocity(ends, rolling):
    run = run_of(ends, rolling, want=("slope", "velocity"))
    axle, rate = geometry.axles(run), np.stack([run.x_rate, run.y_rate], axis=1)
    np.testing.assert_allclose(np.hypot(axle[:, 0], axle[:, 1]), 1, rtol=1e-14)
    np.testing.assert_allclose((axle * rate).sum(axis=1), 0, atol=1e-12)
    # a positive rate rolls along J d_1
    assert (np.sign((geometry.turn(axle) * rate).sum(axis=1)) == np.sign(run.omega)).all()


@pytest.mark.filterwarnings("ignore:.* is too long for this motion")
def test_axles_of_own_headings():
    run = run_of(law="steered")
    np.testing.assert_array_equal(geometry.axles(run), np.stack([np.cos(run.phi), np.sin(run.phi)], axis=1))


def test_rings_are_known_from_their_positions(ends):
    assert geometry.is_ring(run_of(ends)) == (ends == "ring")


def test_picked_discs_are_spread_over_the_rod():
    s = np.sort(np.random.default_rng(3).uniform(0, 2, 200))
    picked = geometry.picked(s, 11)
    assert picked[0] == 0
    assert picked[-1] == 199
    np.testing.assert_allclose(s[picked], np.linspace(s[0], s[-1], 11), atol=np.diff(s).max())
    np.testing.assert_array_equal(geometry.picked(s, 101), np.arange(200))


# ---- figures


def test_first_look(tmp_path):
    run = run_of()
    axes = run.plot()
    assert len(axes) == len(figures.PANELS)
    assert all(ax.get_xlabel() and ax.get_ylabel() for ax in axes)
    axes[0].figure.savefig(tmp_path / "run.png")


def test_panels_into_axes_of_ones_own():
    run, ax = run_of(), Figure().subplots()
    assert run.plot("end", ax=ax) == [ax]
    x, y, theta = ax.lines
    np.testing.assert_array_equal(x.get_ydata(), run.x[:, 0])
    np.testing.assert_array_equal(y.get_ydata(), run.y[:, 0])
    np.testing.assert_array_equal(theta.get_ydata(), run.theta[:, 0])


def test_motion_shows_discs_and_spokes():
    run = run_of(law="unit")
    ax = run.plot_motion(instants=3, discs=9, radius=0.25)
    assert isinstance(ax, Axes)
    assert [line.get_label() for line in ax.lines if not line.get_label().startswith("_")] == ["t = 0", "t = 0.5", "t = 1"]
    # spokes up, then spokes down, of the last frame: R sin(theta) J d_1 from the discs, d_1 = r'/|r'|
    up = np.cos(run.theta[-1]) >= 0
    tips = np.empty((9, 2))
    tips[up], tips[~up] = (line.get_xydata() for line in [line for line in ax.lines if line.get_color() == ORANGE][-2:])
    out = tips - np.stack([run.x[-1], run.y[-1]], axis=1)
    slope = np.gradient(np.stack([run.x[-1], run.y[-1]]), run.s, axis=1, edge_order=2)
    expected = 0.25 * np.sin(run.theta[-1]) * [-slope[1], slope[0]] / np.hypot(*slope)
    np.testing.assert_allclose(out, expected.T, atol=1e-12)


def test_a_ring_is_drawn_closed():
    line = run_of("ring").plot_motion(instants=1).lines[0].get_xydata()
    np.testing.assert_array_equal(line[0], line[-1])


def test_spacetime_is_what_was_simulated():
    run = run_of()
    mesh = figures.spacetime(run, "omega").collections[0]
    np.testing.assert_array_equal(np.ravel(mesh.get_array()), run.omega.ravel())
    assert mesh.norm.vmin == -mesh.norm.vmax == -np.abs(run.omega).max()
    assert mesh.cmap(0.5)[:3] == pytest.approx((0.97, 0.97, 0.97), abs=0.01)


def test_any_quantity_over_place_and_time():
    run = run_of(want=("contact_force", "velocity"))
    force, rate, phase = run.plot("contact_force", "x_rate", "phase")
    size = np.hypot(run.contact_force[:, 0], run.contact_force[:, 1])
    np.testing.assert_array_equal(np.ravel(force.collections[0].get_array()), size.ravel())
    assert force.collections[0].norm.vmin == 0
    np.testing.assert_array_equal(np.ravel(rate.collections[0].get_array()), run.x_rate.ravel())
    np.testing.assert_array_equal(phase.lines[-2].get_xydata(), np.stack([run.theta[:, -1], run.omega[:, -1]], axis=1))


def test_energy_is_relative_to_the_start():
    run = run_of()
    (line,) = figures.energy_error(run).lines
    np.testing.assert_allclose(line.get_ydata(), (run.energy - run.energy[0]) / run.energy[0])


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (
            lambda run: run.plot("speed"),
            "panel must be one of 'motion', 'theta', 'omega', 'end', 'profiles', 'energy', 'phase', 'x', .*; got 'speed'",
        ),
        (lambda run: run.plot("end", "energy", ax=Figure().subplots()), "one axes for each of the 2 panels; got 1"),
        (
            lambda run: figures.spacetime(run, "contact_force"),
            "name must be one of 'x', 'y', 'theta', 'omega'; got 'contact_force'",
        ),
        (lambda run: run.plot_motion(instants=0), "instants must be a whole number of at least 1; got 0"),
        (lambda run: run.plot_motion(radius=-1), "radius must be a positive finite number; got -1"),
    ],
)
def test_bad_input(draw, message):
    with pytest.raises(ValueError, match=message):
        draw(run_of(frames=2))


@pytest.mark.slow
def test_one_frame_has_no_first_look():
    with pytest.raises(ValueError, match="needs at least two frames; got 1"):
        run_of(frames=1).plot()
