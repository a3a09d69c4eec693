"""A live run as a `discs.Solution`, and as the bytes of a file that a page offers to keep."""

import tempfile
from pathlib import Path

from compare.lab.history import History
from compare.lab.settings import Settings
from discs import Problem, Solution
from discs.arrays import Float
from discs.integrators import find
from discs.stats import Stats

CHANGED = "sliders or discs were moved during the run: it is not the run of one problem"


def run_of(history: History, problem: Problem | None, settings: Settings, s: Float) -> Solution:
    """The run so far. problem : if it is the run of one, otherwise None."""
    integrator = find(settings.method)
    stats: Stats = {
        "method": settings.method,
        "order": integrator.order,
        "settings": integrator.settings,
        "dt": settings.dt,
        "want": [],
    }
    return history.run(s, stats, problem)


def content(run: Solution, ending: str) -> bytes:
    """The run as a file of this ending, ".nc" or ".csv"."""
    with tempfile.TemporaryDirectory(prefix="discs-lab-") as folder:
        path = Path(folder) / f"lab{ending}"
        run.save(path)
        return path.read_bytes()
