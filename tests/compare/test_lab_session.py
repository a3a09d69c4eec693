"""The lab's simulation, without a browser."""

import json
import re
import sys
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from compare.lab.history import History, Kept
from compare.lab.messages import checked, parsed
from compare.lab.session import SEGMENT, Session
from compare.lab.settings import FIXED, Settings
from compare.lab.shifted import later
from continuum import steered_rod, untwisting_rod
from continuum.files import read_scene
from discs import State, load, simulate
from discs.loads import Custom, Motor, Torque, signals
from discs.warn import kept

SCENES = ["untwisting_rod", "steered_rod", "rolling_rod", "breathing_ring"]


def session(**choices):
    """A session whose clock stands still: it always has time for all steps."""
    return Session(Settings(**({"n": 9, "dt": 0.02} | choices)), clock=lambda: 0.0)


def ask(lab, kind, **given):
    """The replies by kind."""
    return {reply.content["kind"]: reply for reply in lab.handle({"kind": kind, **given})}


def frame(lab, kind, **given):
    replies = ask(lab, kind, **given)
    assert "refused" not in replies, replies["refused"].content
    return replies["frame"].content


def rows(reply):
    values = np.frombuffer(reply.data, "<f4").reshape(-1, reply.content["n"])
    return dict(zip(reply.content["rows"], values, strict=True))


@pytest.mark.parametrize("scene", SCENES)
def test_moves_as_a_run_does(scene):
    lab = session(scene=scene, values={"radius": 0.7, "bending_stiffness": 0.9})
    shown = ask(lab, "advance", time=0.2)["frame"]
    problem = replace(lump(lab.settings.make_scene(), 9), duration=0.2)
    with kept():  # that the step is long
        run = simulate(problem, "midpoint", dt=0.02, frames=1, engine="plain", progress=False)
    assert shown.content["t"] == pytest.approx(0.2)
    for name in ("x", "y", "theta", "omega"):
        np.testing.assert_allclose(rows(shown)[name], getattr(run, name)[-1], atol=1e-6)
    assert shown.content["energy"] == pytest.approx(run.energy[-1], rel=1e-12)


@pytest.mark.parametrize("scene", ["untwisting_rod", "steered_rod"])
def test_the_balance_holds_whatever_the_hand_does(scene):
    """Energy - work + dissipated stays to rounding through pulls, kicks, holds, sliders and going back."""
    lab = session(scene=scene)
    frame(lab, "advance", time=0.2)
    start = lab.moment.energy
    done = [
        ("set", {"name": "damping", "value": 0.4}),
        ("pull", {"disc": 2, "x": 0.7, "y": 0.6}),
        ("pull", {"disc": 2, "x": 0.7, "y": 0.9}),
        ("kick", {"disc": 5, "change": 1.5}),
        ("hold", {"disc": 7, "on": True}),
        ("set", {"name": "bending_stiffness", "value": 1.4}),
        ("set", {"name": "slope", "value": -0.6}),
        ("release", {}),
        ("seek", {"time": 0.5}),
        ("hold", {"disc": 7, "on": False}),
        ("set", {"name": "rest_curvature", "value": 0.5}),
    ]
    for kind, given in done:
        frame(lab, kind, **given)
        now = frame(lab, "advance", time=0.1)
        assert abs(now["off"]) < 1e-11 * start, kind
        assert now["energy"] - now["work"] + now["dissipated"] == pytest.approx(start, rel=1e-11)
    assert now["dissipated"] > 1e-3
    assert abs(now["work"]) > 0.1


def test_a_pulled_disc_goes_where_it_is_pulled():
    lab = session()
    far = lab.moment.y[4]
    for _ in range(10):
        frame(lab, "pull", disc=4, x=float(lab.moment.x[4]), y=0.8)
        frame(lab, "advance", time=0.2)
    assert lab.moment.y[4] > far + 0.3
    assert ask(lab, "advance", time=0.0)["frame"].content["pulled"][0] == 4


@pytest.mark.parametrize("scene", ["untwisting_rod", "steered_rod"])
def test_a_held_disc_rests(scene):
    lab = session(scene=scene)
    frame(lab, "advance", time=0.3)
    assert frame(lab, "hold", disc=3, on=True)["held"] == [3]
    at = lab.moment.x[3], lab.moment.y[3], lab.moment.theta[3]
    frame(lab, "advance", time=0.5)
    np.testing.assert_allclose((lab.moment.x[3], lab.moment.y[3], lab.moment.theta[3]), at, atol=1e-12)
    assert abs(lab.moment.omega[4]) > 0.01
    assert ask(lab, "kick", disc=3, change=1.0)["refused"].content["text"] == "disc 3 is held: let it go before you kick it"


def test_a_kick_changes_the_rate_of_one_disc():
    lab = session()
    frame(lab, "advance", time=0.1)
    before = lab.moment.omega.copy()
    frame(lab, "kick", disc=6, change=-1.25)
    np.testing.assert_allclose(lab.moment.omega - before, -1.25 * (np.arange(9) == 6), atol=1e-12)


def test_goes_back_and_on_from_there():
    lab = session()
    times = [frame(lab, "advance", time=0.1)["t"] for _ in range(5)]
    there = lab.history.at(times[1])
    shown = frame(lab, "seek", time=times[1] + 1e-9)
    assert shown["t"] == times[1]
    assert shown["last"] == times[-1]  # what came later is there until it is replaced
    np.testing.assert_array_equal(lab.moment.theta, there.state.theta)
    assert frame(lab, "step", by="back")["t"] == pytest.approx(times[1] - 0.02)
    assert frame(lab, "step", by="forward")["last"] == pytest.approx(times[1])
    assert frame(lab, "reset")["t"] == 0
    assert lab.run.t.size == 1


def test_long_runs_keep_bounded_frames():
    history = History(20_000)
    state = State(np.zeros(3), np.zeros(3), np.zeros(3))
    for i in range(5000):
        history.add(Kept(0.01 * i, state, 1.0, 0.0, 0.0, False))
    assert 32 <= len(history.frames) <= 65
    t = np.array([each.t for each in history.frames])
    assert t[0] == 0
    assert t[-1] > 48
    assert np.ptp(np.diff(t)) < 1e-9  # equally spaced


def test_steps_go_on_after_a_segment(monkeypatch):
    monkeypatch.setattr(sys.modules[Session.__module__], "SEGMENT", 0.1)
    lab = session()
    now = frame(lab, "advance", time=0.35)
    monkeypatch.undo()
    whole = session()
    same = frame(whole, "advance", time=0.35)
    assert SEGMENT > 0.35
    assert now["t"] == pytest.approx(same["t"])
    np.testing.assert_allclose(lab.moment.theta, whole.moment.theta, atol=1e-12)


def test_the_run_can_be_kept(tmp_path):
    lab = session(scene="steered_rod")
    frame(lab, "advance", time=0.1)
    for ending in (".nc", ".csv"):
        reply = ask(lab, "save", ending=ending)["file"]
        assert reply.content["name"] == f"lab{ending}"
        (tmp_path / f"run{ending}").write_bytes(reply.data)
    read = load(tmp_path / "run.nc")
    np.testing.assert_array_equal(read.theta, lab.run.theta)
    assert read.problem is not None
    assert (tmp_path / "run.csv").read_text().startswith("t (time),")
    frame(lab, "kick", disc=1, change=1.0)
    (tmp_path / "kicked.nc").write_bytes(ask(lab, "save", ending=".nc")["file"].data)
    assert load(tmp_path / "kicked.nc").problem is None  # it is not the run of one problem


MOVED = [
    ("untwisting_rod", "unit", {"twist": 0.75, "radius": 0.7, "damping": 0.2, "slope": -0.1, "rest_curvature": 0.3}),
    ("steered_rod", "field", {"mounting_angle": 0.5, "shear_stiffness": 12.0, "damping": 0.1}),
    ("rolling_rod", "field", {"omega": 0.5, "bending_stiffness": 1.1}),
    ("breathing_ring", "unit", {"omega": 0.3}),
]


@pytest.mark.parametrize(("scene", "rolling", "values"), MOVED)
def test_the_scene_as_python_and_as_toml(tmp_path, scene, rolling, values):
    lab = session(scene=scene, rolling=rolling, values=values, ends="consistent")
    made = {}
    program = ask(lab, "code", language="python")["code"].content["text"]
    assert program.endswith("run = simulate(problem, 'midpoint', dt=0.02)\nprint(run)\n")
    exec(compile(program.partition("run = ")[0], "copy", "exec"), made)
    (tmp_path / "scene.toml").write_text(text := ask(lab, "code", language="toml")["code"].content["text"], encoding="utf-8")
    assert tomllib.loads(text)["scene"] == scene
    for other in (made["scene"], read_scene(tmp_path / "scene.toml")):
        assert other.description() == lab.settings.make_scene().description()
    assert made["problem"].energy() == lab._base.energy()


def test_an_own_scene(tmp_path):
    scene = replace(untwisting_rod(density=1.3), loads=(Torque(0.3, signal=signals.sine(1.0, 2.0), at=0.0),))
    lab = Session(Settings.of(scene, 9), clock=lambda: 0.0)
    assert lab.settings.scene == "own scene"
    frame(lab, "advance", time=0.1)
    frame(lab, "set", name="radius", value=0.8)
    frame(lab, "advance", time=0.1)
    assert lab.problem.loads[0].signal(0.0) == pytest.approx(np.sin(0.2))  # the signal goes on
    assert "scene of your own" in ask(lab, "code", language="toml")["refused"].content["text"]
    assert "replace(scene, rolling='field', rod=replace(scene.rod, radius=0.8))" in lab.settings.python()
    assert "steered_rod" in ask(lab, "choose", scene="steered_rod")["scene"].content["choices"]["scene"]
    assert ask(lab, "choose", scene="own scene")["scene"].content["chosen"]["scene"] == "own scene"


def test_signals_go_on():
    motor = later(Motor(signals.ramp(0.0, 1.0), 0.5), 0.25)
    assert motor.rate(0.5) == 0.75
    assert motor.rate.breaks == (-0.25, 0.75)
    assert later(Torque(1.0, signal=lambda t: 2 * t), 1.5).signal(1.0) == 5.0


def test_what_cannot_be_is_refused_and_changes_nothing():
    lab = session()
    frame(lab, "advance", time=0.1)
    before = lab.settings, lab.moment
    for given, reason in [
        ({"kind": "choose", "scene": "rod"}, "scene must be one of 'untwisting_rod'"),
        ({"kind": "choose", "n": 2}, r"n \(discs, ends='springs'\) must be a whole number of at least 3"),
        ({"kind": "choose", "method": "RK45"}, "method must be one of 'midpoint'"),
        ({"kind": "set", "name": "mounting_angle", "value": 0.1}, "slider must be one of"),
        ({"kind": "set", "name": "radius", "value": -1.0}, "radius R must be from 0 to 2; got -1"),
        ({"kind": "kick", "disc": 9, "change": 1.0}, "there are 9 discs, from 0 on; got disc 9"),
    ]:
        refused, scene, now = lab.handle(given)[:3]
        assert refused.content["kind"] == "refused"
        assert re.search(reason, refused.content["text"]), refused.content["text"]
        assert scene.content["kind"] == "scene"
        assert now.content["t"] == pytest.approx(0.1)
    assert (lab.settings, lab.moment) == before


def test_methods_that_take_no_load_say_so():
    lab = session(method="leapfrog")
    said = ask(lab, "set", name="damping", value=0.1)["refused"].content["text"]
    assert "'leapfrog' takes loads that are part of the energy only" in said
    assert lab.settings.values == {}


def test_explicit_methods_get_a_stable_step():
    lab = session(n=33)
    replies = ask(lab, "choose", method="rk4")
    assert "the step is now" in replies["note"].content["text"]
    assert lab.settings.dt < 0.02
    assert "leapfrog" in FIXED


def test_a_motion_that_ends_says_why():
    """The ring of the unit law collapses at t = a/(R omega) at the latest."""
    lab = session(scene="breathing_ring", rolling="unit", values={"omega": 2.0})
    for _ in range(20):
        now = frame(lab, "advance", time=0.1)
    assert now["stopped"]
    assert now["t"] < 0.5
    assert frame(lab, "seek", time=0.1)["stopped"] == ""


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (None, 'a message is an object with a "kind"; got None'),
        ({"kind": "eval"}, "kind must be one of 'advance'"),
        ({"kind": ["advance"]}, "kind must be one of 'advance'"),
        ({"kind": "advance"}, "a message 'advance' needs time"),
        ({"kind": "advance", "time": "1"}, "time must be a number from 0 to 1; got '1'"),
        ({"kind": "advance", "time": True}, "time must be a number from 0 to 1; got True"),
        ({"kind": "advance", "time": float("nan")}, "time must be a number from 0 to 1; got nan"),
        ({"kind": "advance", "time": 0.1, "code": "1"}, "a message 'advance' has the fields"),
        ({"kind": "choose", "n": 10**9}, "n must be a whole number from 2 to 1025"),
        ({"kind": "choose", "n": 9.0}, "n must be a whole number from 2 to 1025; got 9.0"),
        ({"kind": "save", "ending": "/etc/passwd"}, "ending must be one of '.nc', '.csv'"),
        ({"kind": "hold", "disc": 1, "on": 1}, "on must be true or false; got 1"),
        ({"kind": "set", "name": "a" * 65, "value": 1.0}, "name must be a word of at most 64 characters"),
        ({"kind": "step", "by": "forward", "__class__": 1}, "a message 'step' has the fields"),
    ],
)
def test_the_schema_refuses(message, reason):
    with pytest.raises(ValueError, match=reason):
        checked(message)
    (refused, *_) = session().handle(message)
    assert refused.content["kind"] == "refused"


@pytest.mark.parametrize("text", [b"{}", "{", "[" * 4000, "x" * 5000])
def test_text_that_is_no_message(text):
    with pytest.raises(ValueError, match="a message"):
        parsed(text)


def test_replies_are_json():
    for reply in session().opening():
        json.dumps(reply.content, allow_nan=False)


def test_scenes_that_the_lab_does_not_take():
    with pytest.raises(ValueError, match=r"lab takes a Scene, such as untwisting_rod\(\); got 'rod'"):
        Settings.of("rod")
    with pytest.raises(ValueError, match="the lab takes no Custom load"):
        Settings.of(replace(steered_rod(), loads=(Custom(lambda t, q, v: 0 * q),)))
