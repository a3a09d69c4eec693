"""N discs against the field under loads: orders at small N, and the command."""

import numpy as np
import pytest

from compare.__main__ import main
from compare.load_limits import LOADS, ON_A_RING, scenes, study

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", [*LOADS, *ON_A_RING])
def test_loaded_discs_tend_to_the_loaded_field(name):
    """Rings at order 2; consistent ends at 1.8 to 2.3 here, and at 1.97 to 2.1 from 513 to 1025 discs."""
    scene = scenes()[name]
    for found in study(scene, (65, 129, 257), 1e-6):
        worst = found.error.max(axis=1)
        order = np.log(worst[1] / worst[2]) / np.log(found.k[1] / found.k[2])
        least, most = {"ring": (1.95, 2.05), "consistent": (1.75, 2.3), "springs": (0.7, 1.05)}[found.ends]
        assert least < order < most, (found.ends, found.error, order)


def test_command_line(tmp_path, capsys):
    assert main(["loads", "--n", "17", "33", "--tol", "1e-4", "--out", str(tmp_path), "--quiet"]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"loads.csv", "loads.png"}
    told = capsys.readouterr().out
    assert "driven end" in told
    assert len((tmp_path / "loads.csv").read_text().splitlines()) == 1 + 2 * (2 * len(LOADS) + len(ON_A_RING))
