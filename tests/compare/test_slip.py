"""N -> infinity and epsilon -> 0: the control, the rod, and the command."""

import numpy as np
import pytest

from compare.__main__ import main
from compare.slip import slips
from continuum import breathing_ring, untwisting_rod

pytestmark = pytest.mark.slow


def test_rings_commute_and_free_ends_do_not():
    """From 17 to 65 discs the distance is the same on a ring, and six times as large and more on a rod."""
    ring = slips(breathing_ring(), (17, 65), (1e-3, 1e-4), progress=False)
    np.testing.assert_allclose(ring.rolling[0], ring.rolling[1], rtol=0.03)
    np.testing.assert_allclose(ring.rolling[:, 0] / ring.rolling[:, 1], 10, rtol=0.02)
    rod = slips(untwisting_rod(duration=2.0), (17, 65), (1e-3, 1e-4), progress=False)
    assert (rod.rolling[1] > 6 * rod.rolling[0]).all()
    orders = np.log10(rod.rolling[:, 0] / rod.rolling[:, 1])
    assert orders[0] == pytest.approx(1.0, abs=0.02)
    assert orders[1] < 0.8
    assert (rod.end[1] > 10 * rod.inside[1]).all()


def test_command_line(tmp_path, capsys):
    assert main(["slip", "--n", "9", "17", "--slips", "1e-2", "1e-3", "--out", str(tmp_path), "--quiet"]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"slip.csv", "slip.png"}
    assert ["breathing", "ring", "16", "1e-03"] in [line.split()[:4] for line in capsys.readouterr().out.splitlines()]
