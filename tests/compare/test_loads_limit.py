"""N -> infinity with loads: discs with the loads of a scene approach the loaded field like 1/N^2."""

import numpy as np
import pytest

from compare import lump
from continuum import Rod, Scene, solve
from continuum.scenes import PAPER
from discs import simulate
from discs.loads import Damping, Force, Rest, Slope, Spring, Torque, signals

pytestmark = pytest.mark.slow

SMOOTH = signals.smooth(0.0, 1.0)  # a sudden start violates the conditions at free ends
LOADS = {
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


@pytest.mark.parametrize("load", LOADS.values(), ids=list(LOADS))
def test_loaded_discs_converge_to_the_loaded_field(load):
    """Order 2 from 65 to 129 discs with consistent ends; measured 1.94 to 2.04, and 1.97 to 2.01 from 129 to 257."""
    scene = Scene(rod=Rod(**PAPER), initial=untwisting, duration=2.0, loads=(load,))
    field = solve(scene, 1e-6, frames=[2.0], progress=False)
    errors = []
    for n in (65, 129):
        run = simulate(lump(scene, n, ends="consistent"), "suzuki4", dt=0.02, frames=[2.0], progress=False)
        every = (field.s.size - 1) // (n - 1)
        errors.append(max(np.abs(getattr(run, name) - getattr(field, name)[:, ::every]).max() for name in ("x", "y", "theta")))
    assert 1.85 < np.log2(errors[0] / errors[1]) < 2.15
    assert errors[1] < 3e-4
