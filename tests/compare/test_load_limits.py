"""N discs against the field under loads: orders at small N, and the command."""

import numpy as np
import pytest

from compare import load_limits, lump
from compare.__main__ import main
from compare.load_limits import AT_AN_END, LOADS, ON_A_RING, OWN_HEADINGS, scenes, study
from continuum import Rod, Scene, solve
from continuum.scenes import PAPER
from discs import simulate
from discs.loads import Damping, Force, Rest, Slope, Spring, Torque, signals

pytestmark = pytest.mark.slow


SHORT = "rolling resistance", "ring, torque", "own, actuated", "varying rod"  # run by `make test`


@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in SHORT else pytest.mark.long) for name in scenes()])
def test_loaded_discs_tend_to_the_loaded_field(name):
    """Rings and own headings at order 2; consistent ends at 1.8 to 2.3 here, and at 1.97 to 2.1 from 513 to 1025 discs.

    A held end, where the line starts straight: the part of first order of plain springs is small here.
    """
    scene = scenes()[name]
    for found in study(scene, (65, 129, 257), 1e-6):
        worst = found.error.max(axis=1)
        order = np.log(worst[1] / worst[2]) / np.log(found.k[1] / found.k[2])
        exact = 1.95, 2.05
        least, most = {"ring": exact, "own": exact, "consistent": (1.75, 2.3), "springs": (0.7, 1.05 + (name == "held end"))}[
            found.ends
        ]
        assert least < order < most, (found.ends, found.error, order)


@pytest.mark.parametrize("kept", [2, pytest.param(9, marks=pytest.mark.long)])
def test_command_line(tmp_path, capsys, monkeypatch, kept):
    few = [{name: of[name] for name in list(of)[-kept:]} for of in (LOADS, AT_AN_END, OWN_HEADINGS, ON_A_RING)]
    for name, found in zip(("LOADS", "AT_AN_END", "OWN_HEADINGS", "ON_A_RING"), few, strict=True):
        monkeypatch.setattr(load_limits, name, found)
    assert main(["loads", "--n", "17", "33", "--tol", "1e-4", "--out", str(tmp_path), "--quiet"]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"loads.csv", "loads.png"}
    told = capsys.readouterr().out
    assert "bending viscosity" in told
    free, at_an_end, own, ring = (len(found) for found in few)
    free, others = free + at_an_end + 3, ring + own + at_an_end + 2
    assert len((tmp_path / "loads.csv").read_text().splitlines()) == 1 + 2 * (2 * free + others)


# Initial fields that fit the free ends: clean orders at few discs

SMOOTH = signals.smooth(0.0, 1.0)  # a sudden start violates the conditions at free ends
SMOOTHLY = {
    "torque": Torque(lambda s: 0.5 * np.cos(s), SMOOTH),
    "end torque": Torque(0.3, SMOOTH, at=0.0),
    "force": Force(0.0, 0.2, SMOOTH),
    "resistance": Damping(rolling=0.3),
    "viscosity": Damping(torsion=0.3),
    "slope": Slope(0.1, -0.2),
    "spring": Spring(lambda s: s, 0.0, 0.5),
    "rest twist": Rest(twist=0.3, signal=SMOOTH),
}


def untwisting(s):
    """theta' is proportional to sin^5(pi s/4), which is compatible with the free ends."""
    c = np.cos(np.pi * s / 4)
    return s, 0 * s, -1.5 * (c - 2 * c**3 / 3 + c**5 / 5), 0 * s


@pytest.mark.parametrize("load", SMOOTHLY.values(), ids=list(SMOOTHLY))
def test_loaded_discs_converge_to_the_loaded_field(load):
    """Order 2 from 65 to 129 discs with consistent ends; measured 1.94 to 2.04, and 1.97 to 2.01 from 129 to 257."""
    scene = Scene(rod=Rod(**PAPER), initial=untwisting, duration=2.0, loads=(load,))
    field = solve(scene, 1e-6, frames=[2.0], progress=False)
    errors = []
    for n in (65, 129):
        run = simulate(lump(scene, n, ends="consistent"), "gauss6", dt=0.02, frames=[2.0], progress=False)
        every = (field.s.size - 1) // (n - 1)
        errors.append(max(np.abs(getattr(run, name) - getattr(field, name)[:, ::every]).max() for name in ("x", "y", "theta")))
    assert 1.85 < np.log2(errors[0] / errors[1]) < 2.15
    assert errors[1] < 3e-4
