"""Do the tests notice a wrong formula? Mutants of the packages, each run against the tests of its place.

    python -m tests.mutants --seed 1 --each 10        # ten of every place of PLACES, drawn by the seed
    python -m tests.mutants --only loads --each 30

Not part of the tests: a mutant takes some seconds. Files are changed in place, one line at a time, and restored; the checkout must
be clean. Where kernels would be compiled again for a mutant, they run as plain Python (NUMBA_DISABLE_JIT=1). A mutant is killed
when a test fails, or the tests take four times as long as without it. Survivors are printed when they are found, to be examined
with more tests, explained, or killed by a new test: docs/mutants.md has the results.
"""

import argparse
import os
import random
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.mutants.changes import Change, applied, changes

ROOT = Path(__file__).parents[2]


class Place(NamedTuple):
    """A part of the packages, and the tests that are to notice its faults."""

    files: str  # patterns, apart by spaces
    tests: str  # so are these
    more: str = ""  # tests for what survives those; slow ones of both are then run too
    plain: bool = False  # numba switched off
    only: str = ""  # names of tests, as for `pytest -k`


KERNELS = (
    "twins and (midpoint or gauss4 or elements) or elimination or reduced or balance or sweeps_solve or compiled_gradients"
    " or in_lanes and (gauss4 or loads) or lanes_and or belongs"
)
D, C = "tests/discs/test_", "tests/continuum/test_"
PLACES = {
    "mechanics": Place(
        "discs/mechanics/*.py discs/skew.py",
        f"{D}mechanics.py {D}system.py {D}textbook.py {D}momentum.py {D}friction.py {D}sliding.py {D}contact.py",
        f"{D}motion.py {D}vakonomic.py {D}driven.py {D}trajectory.py tests/compare/test_quantities.py",
    ),
    "chains": Place(
        "discs/chains/*.py discs/chains/rolling/*.py discs/chains/links/*.py",
        f"{D}stencils.py {D}laws.py {D}linear.py {D}motion.py {D}elements.py {D}true_curvature.py",
        f"{D}kernels.py {D}modes.py {D}tangent.py {D}gradient.py {D}kinds_of_loads.py",
        plain=True,
    ),
    "integrators": Place(
        "discs/integrators/*.py",
        f"{D}integrators.py {D}radau.py {D}dop853.py {D}step.py",
        f"{D}kernels.py {D}simulate.py {D}restart.py {D}tolerance.py {D}kinds_of_loads.py {D}work_by_load.py {D}own_integrator.py",
        plain=True,
    ),
    "kernels": Place(
        "discs/kernels/slaved*.py discs/kernels/steered*.py discs/kernels/banded.py",
        f"{D}elements.py",
        f"{D}kernels.py {D}lanes.py {D}steered_lanes.py {D}loads_in_lanes.py {D}gradient.py {D}tangent.py",
        plain=True,
        only=KERNELS,
    ),
    "solver": Place("continuum/*.py", "tests/continuum/test_*.py", "tests/compare/test_convergence.py"),
    "archives": Place(
        "discs/files/*.py",
        f"{D}archive.py {D}exports.py {D}files.py {D}untrusted.py {D}finishing.py {D}load_files.py",
        f"{D}restart.py {D}trajectory.py tests/compare/test_sweep_archive.py",
    ),
    "sweeps": Place(
        "compare/sweeps.py compare/lump.py compare/study.py",
        "tests/compare/test_sweeps.py tests/compare/test_convergence.py tests/compare/test_sweep_archive.py",
    ),
    "loads": Place(
        "discs/loads/*.py",
        f"{D}loads.py {D}loads_known.py {D}loads_at_limits.py {D}nonlinear.py {D}signals.py {D}bends.py",
        f"{D}linear.py {D}motors.py {D}kinds_of_loads.py {D}work_by_load.py {D}load_files.py",
    ),
}


class Mutant(NamedTuple):
    """A changed line of a file."""

    place: str
    file: Path
    change: Change

    def line(self) -> str:
        return self.file.read_text(encoding="utf-8").splitlines()[self.change.line - 1]

    def row(self) -> str:
        old = self.line().strip()
        new = applied(self.file.read_text(encoding="utf-8"), self.change).splitlines()[self.change.line - 1].strip()
        return f"| {self.file.relative_to(ROOT)}:{self.change.line} | `{old}` | `{new}` |"


def drawn(place: str, count: int, rng: random.Random) -> list[Mutant]:
    """`count` mutants of a place, all lines of its files alike."""
    files = sorted({file for pattern in PLACES[place].files.split() for file in ROOT.glob(pattern)})
    found = [Mutant(place, file, change) for file in files for change in changes(file.read_text(encoding="utf-8"))]
    return rng.sample(found, min(count, len(found)))


def passes(tests: str, marked: str, place: Place, limit: float | None = None, first: str = "") -> bool:
    """Whether tests pass; those whose files have the word `first` in their names go first.

    limit : seconds, after which they are stopped: subprocess.TimeoutExpired.
    """
    environment = os.environ | ({"NUMBA_DISABLE_JIT": "1"} if place.plain else {}) | {"PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", "-o", "addopts="]
    files = [str(file) for pattern in tests.split() for file in sorted(ROOT.glob(pattern))]
    command += ["-m", marked, "-k", place.only, *sorted(files, key=lambda file: first not in Path(file).name)]
    code = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, timeout=limit, check=False).returncode
    return code in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)


class Trial:
    """The tests of a place, and how long they take without a mutant."""

    def __init__(self, name: str) -> None:
        self.place, self.seconds = PLACES[name], [0.0, 0.0]
        self.tests = (self.place.tests, "not slow and not long"), (f"{self.place.tests} {self.place.more}", "not long")

    def noticed(self, first: str = "") -> bool:
        """Whether the quick tests fail, or else all of them, or take too long."""
        for i, (tests, marked) in enumerate(self.tests):
            begun = time.monotonic()
            try:
                if not passes(tests, marked, self.place, 4 * self.seconds[i] + 20 if self.seconds[i] else None, first):
                    return True
            except subprocess.TimeoutExpired:
                return True
            self.seconds[i] = self.seconds[i] or time.monotonic() - begun
        return False

    def kills(self, mutant: Mutant) -> bool:
        """Whether a mutant is noticed. The file is restored, also after Ctrl-C."""
        source = mutant.file.read_text(encoding="utf-8")
        try:
            mutant.file.write_text(applied(source, mutant.change), encoding="utf-8")
            return self.noticed(mutant.file.stem.partition("_")[0])
        finally:
            mutant.file.write_text(source, encoding="utf-8")


def main() -> None:
    p = argparse.ArgumentParser(
        prog="python -m tests.mutants", description="Mutants of the packages, and whether the tests notice them."
    )
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--each", type=int, default=10, help="mutants of a place")
    p.add_argument("--only", nargs="+", choices=tuple(PLACES), default=list(PLACES), help="places")
    chosen = p.parse_args()
    if subprocess.run(["git", "status", "--porcelain", "*.py"], cwd=ROOT, capture_output=True, text=True, check=True).stdout:
        raise SystemExit("commit or stash first: files are changed in place")
    for name in chosen.only:
        trial = Trial(name)
        if trial.noticed():
            raise SystemExit(f"the tests of {name} fail without a mutant")
        mutants = drawn(name, chosen.each, random.Random(f"{name} {chosen.seed}"))
        alive = 0
        for mutant in mutants:
            if not trial.kills(mutant):
                alive += 1
                print(mutant.row(), flush=True)
        print(f"{name}: {len(mutants)} mutants, {len(mutants) - alive} killed", flush=True)


if __name__ == "__main__":
    main()
