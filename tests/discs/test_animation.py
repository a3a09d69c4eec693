import re
import subprocess

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from discs import Chain, Problem, Solution, State, simulate
from discs.pictures.animation import Stage, animate
from tests.conftest import Model, uneven


@pytest.fixture(scope="module")
def run():
    return simulate(uneven(6, Model("springs", "field")), dt=0.05, frames=7, progress=False)


def rolling(turn: float) -> Solution:
    """Three discs of radius 0.7 on a straight line along x that have all rolled by the angle `turn`, unit law; two frames."""
    chain = Chain(
        n=3,
        length=2.0,
        density=1.3,
        spin_inertia=0.6,
        torsion_stiffness=0.9,
        bending_stiffness=0.8,
        radius=0.7,
        rolling="unit",
    )
    return simulate(Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s, omega=turn), 1.0), dt=0.1, frames=2, progress=False)


def test_mp4_has_every_frame(run, tmp_path):
    path = run.animate(tmp_path / "rod.mp4", fps=10, size=(320, 180))
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    read = subprocess.run(command, capture_output=True, check=True)
    assert re.search(r"Video: h264 .*yuv420p.* 320x180.* 10 fps", read.stderr.decode())
    pictures = np.frombuffer(read.stdout, np.uint8).reshape(-1, 180, 320, 3).astype(int)
    assert len(pictures) == run.t.size
    # what was drawn, up to what the codec loses; and another frame is further away
    stage = Stage(run, size=(320, 180))
    for f in (0, 6):
        drawn = stage.picture(f)[..., :3].astype(int)
        assert abs(pictures[f] - drawn).mean() < 0.5 * abs(pictures[6 - f] - drawn).mean()
    assert [p.name for p in tmp_path.iterdir()] == ["rod.mp4"]


def test_gif_has_every_frame(run, tmp_path):
    path = run.animate(str(tmp_path / "rod.gif"), fps=20, size=(320, 180))
    with Image.open(path) as picture:
        assert picture.n_frames == run.t.size
        assert picture.size == (320, 180)
        assert picture.info["duration"] == 50
        assert picture.info["loop"] == 0
        corners = []
        for f in range(picture.n_frames):
            picture.seek(f)
            corners.append(picture.convert("RGB").getpixel((2, 2)))
    assert len(set(corners)) == 1  # what does not move keeps its colour


def test_discs_stand_and_roll_where_they_should():
    """Seen from the end of the rod (azimuth 0, level), x is depth, y to the right and z up: one disc hides all others."""
    turn = 0.4
    stage = Stage(rolling(turn), radius=0.7, azimuth=0, elevation=0, size=(640, 360))
    stage.picture(1)
    outlines = [path.vertices for path in stage._things.get_paths()]
    rims = np.array([o for o in outlines if len(o) == 33])
    centre = np.array([0.7 * turn, 0.7])  # has rolled by R theta to +y = J d_1, and its centre is at height R
    np.testing.assert_allclose(np.hypot(*np.moveaxis(rims - centre, -1, 0)), 0.7, rtol=1e-9)
    marks = [o for o in outlines if len(o) == 2 and np.ptp(o, axis=0).max() > 0.1]
    assert len(marks) == 3
    for hub, tip in marks:  # d_3 = cos(theta) e_z + sin(theta) J d_1: the top of a disc runs ahead
        np.testing.assert_allclose(hub, centre, atol=1e-9)
        np.testing.assert_allclose(tip - hub, 0.7 * np.array([np.sin(turn), np.cos(turn)]), atol=1e-9)


def test_a_disc_of_true_radius_rolls_without_sliding():
    """The spoke that points down at theta = pi touches the plane at the contact point, which has moved by R pi."""
    stage = Stage(rolling(np.pi), radius=0.7, azimuth=0, elevation=0, size=(640, 360))
    stage.picture(1)
    tips = [o[1] for o in (p.vertices for p in stage._things.get_paths()) if len(o) == 2 and np.ptp(o, axis=0).max() > 0.1]
    np.testing.assert_allclose(tips, [(0.7 * np.pi, 0)] * 3, atol=1e-9)
    np.testing.assert_allclose([track[-1] for track in stage._tracked.get_segments()], [(0.7 * np.pi, 0)] * 3, atol=1e-9)


def test_nearer_discs_are_drawn_later():
    stage = Stage(rolling(0.4), azimuth=60, elevation=30, size=(640, 360))
    stage.picture(1)
    rims = [p.vertices.mean(axis=0) for p in stage._things.get_paths() if len(p.vertices) == 33]
    toward = [stage.run.x[1, i] for i in range(3)]  # seen from +x, +y: disc 2, at the largest x, is the nearest
    assert toward == sorted(toward)
    assert np.all(np.diff([rim[0] for rim in rims]) < 0)  # u = (-sin a, cos a, 0): nearer discs are further left
    assert np.all(np.diff([rim[1] for rim in rims]) < 0)  # and lower


@pytest.mark.filterwarnings("ignore:.* is too long for this motion")
def test_a_ring_is_closed_and_few_of_many_discs_are_drawn():
    ring = simulate(uneven(40, Model("ring", "field")), dt=0.05, frames=2, progress=False)
    stage = Stage(ring, discs=8, size=(320, 180))
    stage.picture(0)
    counts = [len(p.vertices) for p in stage._things.get_paths()]
    assert counts.count(33) == 8
    assert counts.count(2) == 8 + 40  # spokes, and the rod in 40 pieces


def test_pictures_show_the_motion(run):
    stage = Stage(run, size=(320, 180))
    first, last = stage.picture(0), stage.picture(6)
    assert first.shape == (180, 320, 4)
    assert (abs(first.astype(int) - last) > 60).any(axis=-1).mean() > 0.005
    np.testing.assert_array_equal(stage.picture(0), first)
    np.testing.assert_array_equal(stage.picture(-1), last)  # tracks too
    with pytest.raises(IndexError):
        stage.picture(7)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path": "rod.avi"}, "the movie's ending must be one of '.mp4', '.gif'; got '.avi'"),
        ({"path": "no/such/folder/rod.mp4"}, "path must be in a folder that exists; got 'no/such/folder/rod.mp4'"),
        ({"fps": 0}, "fps must be a positive finite number; got 0"),
        ({"radius": 0}, "radius must be a positive finite number; got 0"),
        ({"discs": 0}, "discs must be a whole number of at least 1; got 0"),
        ({"size": (321, 180)}, r"size must be even numbers of pixels, as video formats require; got \(321, 180\)"),
        ({"azimuth": np.nan}, "azimuth must be a finite number; got nan"),
    ],
)
def test_bad_input(run, tmp_path, monkeypatch, change, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=message):
        animate(run, **{"path": "rod.mp4"} | change)
    assert not list(tmp_path.iterdir())


def test_nothing_half_written_is_left(run, tmp_path, monkeypatch):
    def stops(self, f):
        raise KeyboardInterrupt

    monkeypatch.setattr(Stage, "picture", stops)
    for name in ("rod.mp4", "rod.gif"):
        with pytest.raises(KeyboardInterrupt):
            animate(run, tmp_path / name)
    assert not list(tmp_path.iterdir())
