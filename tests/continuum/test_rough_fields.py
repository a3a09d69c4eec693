"""Fields that loads make rough: refused in seconds, with the cause and the cure."""

from dataclasses import replace

import numpy as np
import pytest

from continuum import solve, untwisting_rod
from discs.loads import Torque
from tests.continuum.test_loaded_fields import SMOOTH


@pytest.mark.slow
def test_a_point_load_inside_the_rod_is_refused_at_once_and_spread_it_is_not():
    scene = untwisting_rod(duration=1.5)
    words = r"not reached.*the load at the point s = 1.3 makes r'' jump there.*: spread it over a width, .*exp\(-\(\(s - 1.3\)/0.1"
    with pytest.raises(ValueError, match=words) as refused:
        solve(replace(scene, loads=(Torque(0.5, SMOOTH, at=1.3),)), 1e-5, progress=False)
    assert int(str(refused.value).split(" functions")[0].split()[-1]) <= 51
    spread = Torque(lambda s: 0.5 / 0.1 / np.sqrt(np.pi) * np.exp(-(((s - 1.3) / 0.1) ** 2)), SMOOTH)
    assert solve(replace(scene, loads=(spread,)), 1e-5, progress=False).error_estimate["theta"] < 1e-5


@pytest.mark.long
@pytest.mark.slow
def test_a_motion_that_becomes_rough_says_when_and_why():
    """A torque folds the line: at t = 3.4 |r'| falls to a tenth, and more functions do not help; no slow size is tried."""
    scene = replace(untwisting_rod(), loads=(Torque(2.0, lambda t: 1.0 * (t > 1.234)),))
    words = r"not reached on 1\d\d functions.*; up to t = 3\.[1-4]\d* it is reached, then \|r'\| falls to 0\.\d+: .* rough"
    with pytest.raises(ValueError, match=words):
        solve(scene, 1e-4, progress=False)
    assert solve(replace(scene, duration=3.1), 1e-4, frames=3, progress=False).error_estimate["theta"] < 1e-4
