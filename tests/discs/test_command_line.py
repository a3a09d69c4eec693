"""`python -m discs` as a user meets it."""

import argparse
import os
import re
import shlex
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from compare.__main__ import parser as parser_of_compare
from continuum.__main__ import parser as parser_of_continuum
from discs import Solution, load, simulate
from discs.__main__ import main, parser
from discs.chains.twist import untwisting_chain
from tests.discs.test_archive import same

pytestmark = pytest.mark.slow


def test_run_saves_what_simulate_gives(tmp_path, capsys):
    path = tmp_path / "run.nc"
    options = ["--n", "9", "--t", "0.5", "--rolling", "unit", "--ends", "consistent", "--radius", "0.7", "--twist", "0.3"]
    options += ["--dt", "0.05", "--frames", "3", "--want", "slope", "contact_force", "--save", str(path), "--quiet"]
    assert main(["run", *options]) == 0
    problem = untwisting_chain(9, "unit", "consistent", 0.5, 0.3, radius=0.7)
    run, expected = load(path), simulate(problem, dt=0.05, frames=3, want=("slope", "contact_force"), progress=False)
    assert run.contact_force.tobytes() == expected.contact_force.tobytes()
    printed = capsys.readouterr().out
    assert printed.startswith("9 discs, 3 frames, t = 0 to 0.5\nmethod midpoint: dt = 0.05, 10 steps")
    assert printed.endswith(f"written to {path}\n")
    assert main(["run", *options]) == 0  # finished: nothing to do
    same(load(path), run)
    capsys.readouterr()
    assert main(["info", str(path)]) == 0
    told = capsys.readouterr().out
    for word in ("radius = 0.7", "rolling = unit", "recorded: x, y, theta, omega, slope_x", "initial_theta: 9 numbers", "numpy"):
        assert word in told


def test_tolerance_own_headings_and_overwrite(tmp_path, capsys):
    path = tmp_path / "run.nc"
    options = [
        "run",
        "--n",
        "5",
        "--t",
        "0.2",
        "--rolling",
        "own",
        "--tol",
        "1e-3",
        "--frames",
        "2",
        "--save",
        str(path),
        "--quiet",
    ]
    assert main(options) == 0
    assert "estimated error: x" in capsys.readouterr().out
    assert main(options) == 0  # read again
    assert "estimated error: x" in capsys.readouterr().out
    assert main([*options, "--tol", "1e-4"]) == 2
    assert "holds another run, whose tol differs: 0.001 there, 0.0001 here" in capsys.readouterr().err
    assert main([*options, "--shear-stiffness", "7.5", "--overwrite"]) == 0
    assert load(path).problem.chain.shear_stiffness[0] == 7.5
    (tmp_path / "mine.nc").write_text("mine")
    assert main([*options[:-2], str(tmp_path / "mine.nc"), "--quiet", "--overwrite"]) == 2
    assert (tmp_path / "mine.nc").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "--n", "2"], "at least 3"),
        (["run", "--t", "-1"], "duration must be a positive finite number"),
        (["run", "--dt", "0.1", "--tol", "0.1"], "give dt or tol, not both"),
        (["run", "--length", "1e-290"], "length gives the discs a spacing of 1.5873e-292; it must be between"),
        (["run", "--dt", "1e-300"], "more than can be counted"),
        (["run", "--shear-stiffness", "1"], "parameter of the chain must be one of"),
        (["run", "--rolling", "own", "--ends", "consistent"], "must be one of 'springs'"),
        (["run", "--want", "colour"], "want must be one of"),
        (["run", "--overwrite"], "--overwrite goes with --save FILE"),
        (["run", "--save", "missing/run.nc"], "cannot be written"),
        (["run", "--n", str(10**14)], "GB are needed, and this machine has"),
        (["info", "missing.nc"], "cannot be read"),
        (["plot", "missing.nc"], "cannot be read"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(arguments, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.startswith("error: ")
    assert printed.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "arguments", [[], ["walk"], ["run", "--n", "many"], ["run", "--ends", "ring"], ["run", "--method", "euler"], ["info"]]
)
def test_unknown_words_are_refused_by_usage(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 2
    assert "usage: python -m discs" in capsys.readouterr().err


def test_motion_that_cannot_go_on(tmp_path, capsys):
    path = tmp_path / "run.nc"
    options = ["--n", "33", "--method", "leapfrog", "--dt", "0.05", "--save", str(path), "--quiet", "--engine", "plain"]
    assert main(["run", *options]) == 1
    assert "blew up" in capsys.readouterr().err
    assert main(["info", str(path)]) == 0
    assert "unfinished: " in capsys.readouterr().out


def test_interrupted(tmp_path):
    path = tmp_path / "run.nc"
    command = [sys.executable, "-m", "discs", "run", "--n", "40", "--dt", "1e-3", "--frames", "4501", "--save", str(path)]
    process = subprocess.Popen([*command, "--engine", "plain", "--quiet"], stderr=subprocess.PIPE, text=True)
    while not path.exists():
        time.sleep(0.02)
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert re.fullmatch(r"interrupted at step \d+; .*run.nc holds \d+ of 4501 frames, and the same call goes on from there\n", said)
    assert 0 < load(path).t.size < 4501


def test_pictures_are_those_of_solution(tmp_path, capsys, monkeypatch):
    path = tmp_path / "run.nc"
    simulate(untwisting_chain(5), dt=0.05, frames=2, progress=False, engine="plain").save(path)
    from matplotlib.figure import Figure

    monkeypatch.setattr(Solution, "plot", lambda self: [Figure().subplots()], raising=False)
    monkeypatch.setattr(Solution, "animate", lambda self, out, fps: out.write_text(f"animate {self.s.size} {fps:g}"))
    monkeypatch.setattr(
        Solution, "view", lambda self, out, beside: out.write_text(f"view {self.s.size} {beside and beside.s.size}")
    )
    assert main(["plot", str(path), "--out", str(tmp_path / "a.png")]) == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert main(["animate", str(path), "--out", str(tmp_path / "a.mp4"), "--fps", "12"]) == 0
    assert main(["view", str(path), "--out", str(tmp_path / "a.html")]) == 0
    assert ((tmp_path / "a.mp4").read_text(), (tmp_path / "a.html").read_text()) == ("animate 5 12", "view 5 None")
    assert capsys.readouterr().out.count("written to") == 3
    assert main(["plot", str(path), "--out", str(tmp_path / "a.xyz")]) == 2
    assert "error: Format 'xyz' is not supported" in capsys.readouterr().err
    other = tmp_path / "other.nc"
    simulate(untwisting_chain(7), dt=0.05, frames=2, progress=False, engine="plain").save(other)
    assert main(["view", str(path), "--beside", str(other), "--out", str(tmp_path / "b.html")]) == 0
    assert (tmp_path / "b.html").read_text() == "view 5 7"
    assert main(["view", str(path), "--beside", str(tmp_path / "none.nc"), "--out", str(tmp_path / "c.html")]) == 2
    assert "none.nc cannot be read: No such file" in capsys.readouterr().err


def subparsers(p):
    yield p
    for action in p._actions:
        if isinstance(action, argparse._SubParsersAction):
            for child in action.choices.values():
                yield from subparsers(child)


@pytest.mark.parametrize("make", [parser, parser_of_continuum], ids=["discs", "continuum"])
def test_every_option_says_what_it_is_and_its_default(make):
    switches = (argparse._StoreTrueAction, argparse._HelpAction, argparse._SubParsersAction)
    for p in subparsers(make()):
        assert p.format_help()
        for action in p._actions:
            assert action.help or isinstance(action, argparse._SubParsersAction), action
            if action.option_strings and not isinstance(action, switches):
                assert "(default: " in action.help, action
                assert np.isscalar(action.default) or action.default in (None, []), action


@pytest.mark.parametrize("make", [parser, parser_of_continuum, parser_of_compare], ids=["discs", "continuum", "compare"])
def test_every_command_has_an_example(make):
    """Its help says what it does in sentences, and ends with an example that the command line accepts."""
    for p in subparsers(make()):
        assert p.description.endswith("."), p.prog
        assert "`" not in p.description, p.prog
        *_, last = p.format_help().strip().partition("example: ")
        called, *arguments = shlex.split(last)
        assert called == "python", p.prog
        assert " ".join([called, *arguments]).startswith(p.prog)
        make().parse_args(arguments[2:])


@pytest.mark.parametrize("law", ["field", "own"])
def test_a_rolling_circle(law, tmp_path, capsys):
    """It stays a circle, and begins to shrink at the rate R omega."""
    path, fields = tmp_path / "ring.nc", ["--rolling", law, "--radius", "0.7", "--length", "3.1", "--engine", "plain"]
    run_of = ["run", "--ring", "0.3", "--n", "12", "--t", "0.0002", "--frames", "3", "--method", "midpoint", "--dt", "0.0001"]
    assert main([*run_of, *fields, "--save", str(path), "--quiet"]) == 0
    run = load(path)
    assert run.problem.chain.ends == "ring"
    r = np.hypot(run.x, run.y)
    np.testing.assert_allclose(r, r[:, :1] + 0 * r, atol=1e-12)
    assert r[0, 0] == pytest.approx(3.1 / (2 * np.pi))
    stretched = np.sinc(2 / 12) if law == "field" else 1.0  # r' of the discs on a circle, by central differences
    assert (r[-1, 0] - r[0, 0]) / 0.0002 == pytest.approx(-0.7 * 0.3 * stretched, rel=2e-3)
    assert main(["run", "--ring", "0.3", "--twist", "1"]) == 2
    assert "--ring takes no --twist and no --ends" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(("line", "offered"), [("python -m discs mo", ["modes"]), ("python -m continuum solve --to", ["--tol"])])
def test_shells_complete(tmp_path, line, offered):
    pytest.importorskip("argcomplete", reason="needs argcomplete, of the extra completion")
    asks = {"_ARGCOMPLETE": "3", "_ARGCOMPLETE_STDOUT_FILENAME": str(tmp_path / "offered"), "_ARGCOMPLETE_IFS": "\n"}
    asks |= {"COMP_LINE": line, "COMP_POINT": str(len(line)), "COMP_TYPE": "9"}
    subprocess.run([sys.executable, *line.split()[1:3]], env=os.environ | asks, check=True)
    assert (tmp_path / "offered").read_text().split() == offered
