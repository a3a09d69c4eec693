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

from tests.mutants.changes import Change, applied, changes

ROOT = Path(__file__).parents[2]


class Place(NamedTuple):
    """A part of the packages, and the tests that are to notice its faults."""

    files: str  # patterns, apart by spaces
    tests: str  # so are these
    plain: bool = False  # numba switched off
    slow: bool = False  # slow tests too, as there are few others
    only: str = ""  # names of tests, as for `pytest -k`


KERNELS = (
    "twins and (midpoint or gauss4 or elements) or elimination or reduced or balance or sweeps_solve or compiled_gradients"
    " or in_lanes and (gauss4 or loads) or lanes_and or belongs"
)
D, C = "tests/discs/test_", "tests/continuum/test_"
PLACES = {
    "mechanics": Place(
        "discs/mechanics/*.py discs/skew.py",
        f"{D}mechanics.py {D}system.py {D}textbook.py {D}momentum.py {D}vakonomic.py {D}friction.py {D}sliding.py {D}driven.py",
    ),
    "chains": Place(
        "discs/chains/*.py discs/chains/rolling/*.py discs/chains/links/*.py",
        f"{D}stencils.py {D}laws.py {D}linear.py {D}motion.py",
        plain=True,
    ),
    "integrators": Place("discs/integrators/*.py", f"{D}integrators.py {D}radau.py {D}dop853.py {D}step.py", plain=True),
    "kernels": Place(
        "discs/kernels/slaved*.py discs/kernels/steered*.py discs/kernels/banded.py",
        f"{D}kernels.py {D}elements.py {D}lanes.py {D}steered_lanes.py {D}loads_in_lanes.py {D}gradient.py {D}tangent.py",
        plain=True,
        slow=True,
        only=KERNELS,
    ),
    "solver": Place("continuum/*.py", "tests/continuum/test_*.py"),
    "archives": Place("discs/files/*.py", f"{D}archive.py {D}files.py {D}untrusted.py {D}restart.py {D}finishing.py"),
    "sweeps": Place(
        "compare/sweeps.py compare/lump.py compare/study.py",
        "tests/compare/test_sweeps.py tests/compare/test_convergence.py",
        slow=True,
    ),
    "loads": Place("discs/loads/*.py", f"{D}loads.py {D}loads_known.py {D}nonlinear.py {D}motors.py {D}signals.py {D}bends.py"),
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


def passes(place: Place, limit: float | None = None, first: str = "") -> bool:
    """Whether the tests of a place pass; those whose files have the word `first` in their names go first.

    limit : seconds, after which they are stopped: subprocess.TimeoutExpired.
    """
    environment = os.environ | ({"NUMBA_DISABLE_JIT": "1"} if place.plain else {}) | {"PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", "-o", "addopts="]
    command += ["-m", "not long" if place.slow else "not slow and not long", "-k", place.only]
    files = [str(file) for tests in place.tests.split() for file in sorted(ROOT.glob(tests))]
    command += sorted(files, key=lambda file: first not in file.rpartition("/")[2])
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, timeout=limit, check=False).returncode == 0


def killed(mutant: Mutant, limit: float) -> bool:
    """Whether the tests notice the mutant. The file is restored, also after Ctrl-C."""
    source = mutant.file.read_text(encoding="utf-8")
    try:
        mutant.file.write_text(applied(source, mutant.change), encoding="utf-8")
        return not passes(PLACES[mutant.place], limit, mutant.file.stem.partition("_")[0])
    except subprocess.TimeoutExpired:
        print(f"more than {limit:.0f} s:", end=" ")
        return True
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
        begun = time.monotonic()
        if not passes(PLACES[name]):
            raise SystemExit(f"the tests of {name} fail without a mutant")
        limit = 4 * (time.monotonic() - begun) + 20
        mutants = drawn(name, chosen.each, random.Random(f"{name} {chosen.seed}"))
        alive = 0
        for i, mutant in enumerate(mutants):
            dead = killed(mutant, limit)
            alive += not dead
            print(f"{name} {i + 1} {'killed' if dead else 'SURVIVED'}", mutant.row(), flush=True)
        print(f"{name}: {len(mutants)} mutants, {len(mutants) - alive} killed", flush=True)


if __name__ == "__main__":
    main()
