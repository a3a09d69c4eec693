"""Warnings point to the line of the user's program, from every public function."""

import subprocess
import sys
import warnings

import numpy as np
import pytest

from compare import convergence
from continuum import Rod, Scene, solve
from discs import Problem, State, simulate
from discs.__main__ import main
from discs.chains.twist import untwisting_chain

LIMP = untwisting_chain(5, duration=0.1, bending_stiffness=0.0)
ROLLING = Problem(LIMP.chain, State(LIMP.initial.x, LIMP.initial.y, LIMP.initial.theta, omega=1.0), 0.1)
ROD = {"length": 4.0, "density": 1.0, "spin_inertia": 1.0, "torsion_stiffness": 0.8, "bending_stiffness": 0.0, "radius": 1.0}
SCENE = Scene(rod=Rod(**ROD), initial=lambda s: (s, 0 * s, 0.1 * np.cos(s), 0 * s + 1), duration=0.1)
SMALL = untwisting_chain(5)
FINE = untwisting_chain(20_001, length=0.2, duration=0.05, twist=0.0)  # for doubles
QUIET = {"dt": 0.05, "frames": 2, "progress": False}


def doors():
    """Calls that warn, each with text of its warning."""
    yield "ill-posed", lambda: simulate(ROLLING, **QUIET), "ill posed"
    yield "ill-posed-plain", lambda: simulate(ROLLING, "gauss4", engine="plain", **QUIET), "ill posed"
    yield "auto", lambda: simulate(ROLLING, "auto", tol=0.1, frames=2, progress=False), "ill posed"
    yield "solve", lambda: solve(SCENE, method="leapfrog", n=5, progress=False), "ill posed"
    yield "convergence", lambda: convergence(SCENE, n=(5, 9), tol=1.0, progress=False), "ill posed"
    yield "command line", lambda: main(["run", "--n=5", "--t=0.1", "--bending-stiffness=0", "--quiet"]), "ill posed"
    yield (
        "lost energy",
        lambda: simulate(untwisting_chain(5), "rk4", 2.0, 3, engine="plain", progress=False),
        "energy is conserved, but",
    )


@pytest.mark.parametrize(("door", "words"), [pytest.param(door, words, id=name) for name, door, words in doors()])
def test_the_line_is_the_users(door, words):
    with pytest.warns(UserWarning, match=words) as told:
        door()
    places = {(warning.filename, warning.lineno) for warning in told if words in str(warning.message)}
    line = door.__code__.co_firstlineno
    assert places == {(__file__, line)}


def test_lost_digits_and_a_checkpoint(tmp_path):
    with pytest.warns(UserWarning, match="leaves .* of its error, due to rounding") as told:
        simulate(FINE, dt=0.05, frames=1, progress=False, checkpoint=tmp_path / "run.nc")
    assert {warning.filename for warning in told} == {__file__}


def test_a_warning_is_raised_where_asked():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserWarning, match="ill posed"):
            simulate(ROLLING, **QUIET)


@pytest.mark.slow
def test_on_the_command_line_there_is_no_line():
    command = [sys.executable, "-m", "discs", "run", "--n=5", "--t=0.1", "--dt=0.05", "--bending-stiffness=0", "--engine=plain"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr.startswith("warning: bending_stiffness is 0 under rolling='field'")
    assert ".py" not in done.stderr
