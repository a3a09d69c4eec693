"""What tests of sweeps share, and the browser of those of the lab."""

import pytest

from tests.discs.conftest import browser

__all__ = ["browser"]


@pytest.fixture
def noted(tmp_path, monkeypatch):
    """The calls of `noting` since it was last asked for them; "better" makes them all succeed from now on."""
    path = tmp_path / "noted"
    monkeypatch.setenv("NOTED", str(path))

    def calls(then=""):
        found = [int(line) for line in path.read_text().split()] if path.exists() else []
        path.write_text("")
        if then:
            monkeypatch.setenv("BETTER", "1")
        return found

    return calls
