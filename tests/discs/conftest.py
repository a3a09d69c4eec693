"""Runs that tests of files share."""

import pytest

from discs import simulate
from tests.conftest import Model, uneven


@pytest.fixture(scope="module")
def run():
    every = ("velocity", "slope", "contact_force", "modified_energy")
    return simulate(uneven(7, Model("springs", "field")), "leapfrog", 0.004, 6, every, progress=False)


@pytest.fixture
def saved(run, tmp_path):
    run.save(tmp_path / "run.nc")
    return tmp_path / "run.nc"
