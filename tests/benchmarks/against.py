"""`python -m tests.benchmarks.against OLD`: this version against another one, a wheel or a revision of git.

Two processes, one for each version, run every case in turns, so that a slow machine, or a slow minute, does not matter: the ratio
of neighbouring runs counts, its median over the turns and its quartiles. Both must have the kernels compiled, which the first turn
does. With `--instructions` the instructions of one run of each case are counted by valgrind instead, which no other program
disturbs: those of several runs less those of one. Code is compiled without AVX-512 then, which valgrind does not know.
"""

import argparse
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parents[2]
PACKAGES = ("discs", "continuum", "compare")
LONG = 1.0  # s: cases that take longer are run three times only
SEVERAL = 5  # runs whose instructions are counted


def serve(repeats: int | None, only: str = "") -> None:
    """Run the cases whose names are read, and print their processor times; with `repeats`, one of them so often."""
    from tests.benchmarks.cases import CASES

    warnings.simplefilter("ignore")
    if repeats is not None:
        run = CASES[only]()
        for _ in range(1 + repeats):  # one to warm up
            run()
        return
    ready = {}
    for line in sys.stdin:
        name = line.strip()
        try:
            if name not in ready:
                ready[name] = CASES[name]()
                ready[name]()
            begun = time.process_time()
            ready[name]()
            print(time.process_time() - begun, flush=True)
        except Exception as error:  # a version may lack what a case needs
            print(f"failed: {type(error).__name__}: {error}".replace("\n", " "), flush=True)


def unpack(old: str, folder: Path) -> None:
    """The three packages of a wheel or of a revision of git, in a folder, with the cases of this version."""
    if old.endswith(".whl"):
        with zipfile.ZipFile(old) as wheel:
            wheel.extractall(folder)
    else:
        archive = subprocess.run(["git", "archive", old, *PACKAGES], cwd=HERE, capture_output=True, check=True).stdout
        subprocess.run(["tar", "-x", "-C", str(folder)], input=archive, check=True)
    shutil.copytree(HERE / "tests" / "benchmarks", folder / "tests" / "benchmarks")
    (folder / "tests" / "__init__.py").touch()


def surroundings(folder: Path, **more: str) -> dict[str, str]:
    one = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
    return os.environ | one | {"PYTHONPATH": str(folder), "DISCS_ENGINE": "compiled"} | more


class Versions:
    """Both versions, old first, each in a process that waits for names of cases."""

    def __init__(self, places: list[Path]) -> None:
        command = [sys.executable, "-m", "tests.benchmarks.against", "--serve"]
        self.running = [
            subprocess.Popen(command, cwd=p, env=surroundings(p), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            for p in places
        ]

    def ask(self, which: int, case: str) -> float:
        """The processor time of a case, s; RuntimeError if a version cannot run it."""
        version = self.running[which]
        assert version.stdin
        assert version.stdout
        version.stdin.write(case + "\n")
        version.stdin.flush()
        said = version.stdout.readline().strip()
        if not said or said.startswith("failed"):
            raise RuntimeError(said or "the process ended")
        return float(said)

    def compare(self, case: str, turns: int) -> tuple[float, float, float, str]:
        """Median times, ms, the median ratio, and its quartiles in words."""
        slow = max(self.ask(which, case) for which in (0, 1)) > LONG
        times = []
        for turn in range(3 if slow else turns):
            order = (0, 1) if turn % 2 else (1, 0)
            found = {which: self.ask(which, case) for which in order}
            times.append((found[0], found[1]))
        ratios = [new / old for old, new in times]
        low, _, high = statistics.quantiles(ratios, n=4)
        old, new = (1e3 * statistics.median(each) for each in zip(*times, strict=True))
        return old, new, statistics.median(ratios), f"{low:.3f} to {high:.3f}"

    def end(self) -> None:
        for version in self.running:
            version.kill()


def counted(folder: Path, name: str) -> float:
    """Instructions of one run of a case, from those of processes with one run and with several."""
    plain = {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(folder / "counted")}
    where = surroundings(folder, PYTHONHASHSEED="0", **plain)
    serving = [sys.executable, "-m", "tests.benchmarks.against", "--serve", "--case", name, "--repeats"]
    subprocess.run([*serving, "0"], cwd=folder, env=where, check=True, capture_output=True)  # compiled
    found = []
    for repeats in (1, 1 + SEVERAL):
        command = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null", *serving, str(repeats)]
        told = subprocess.run(command, cwd=folder, env=where, check=True, capture_output=True, text=True).stderr
        found.append(int(re.findall(r"I\s+refs:\s+([\d,]+)", told)[0].replace(",", "")))
    return (found[1] - found[0]) / SEVERAL


def table(places: list[Path], cases: list[str], turns: int, instructions: bool) -> dict[str, float]:
    """Print a row for each case; returns the ratios, new over old."""
    unit = "instructions" if instructions else "ms"
    print(f"| case | old, {unit} | new, {unit} | new / old | quartiles |\n{'| --- ' * 5}|", flush=True)
    versions, ratios = None if instructions else Versions(places), {}
    try:
        for case in cases:
            try:
                if versions:
                    old, new, ratio, spread = versions.compare(case, turns)
                else:
                    old, new = (counted(place, case) for place in places)
                    ratio, spread = new / old, ""
            except (RuntimeError, subprocess.CalledProcessError) as error:
                print(f"| {case} | | | {error} | |", flush=True)
                continue
            print(f"| {case} | {old:.4g} | {new:.4g} | {ratio:.3f} | {spread} |", flush=True)
            ratios[case] = ratio
    finally:
        if versions:
            versions.end()
    return ratios


def main() -> int:
    asked = argparse.ArgumentParser(prog="python -m tests.benchmarks.against", description="This version against another one.")
    asked.add_argument("old", nargs="?", metavar="OLD", help="a wheel, or a revision of git")
    asked.add_argument("--turns", type=int, default=21, help="of each case (default: 21)")
    asked.add_argument("--cases", default="", metavar="WORDS", help="only cases whose names contain this")
    asked.add_argument("--most", type=float, default=1.1, help="fail where the ratio, new over old, exceeds this (default: 1.1)")
    asked.add_argument("--instructions", action="store_true", help="count instructions by valgrind instead; minutes a case")
    asked.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    asked.add_argument("--case", default="", help=argparse.SUPPRESS)
    asked.add_argument("--repeats", type=int, help=argparse.SUPPRESS)
    given = asked.parse_args()
    if given.serve:
        serve(given.repeats, given.case)
        return 0
    if given.old is None:
        asked.error("OLD is missing: a wheel, or a revision of git")
    if given.instructions and not shutil.which("valgrind"):
        asked.error("instructions are counted by valgrind, which is not installed")
    from tests.benchmarks.cases import CASES

    with tempfile.TemporaryDirectory() as name:
        try:
            unpack(given.old, Path(name))
        except (OSError, subprocess.CalledProcessError, zipfile.BadZipFile) as error:
            asked.error(f"OLD must be a wheel, or a revision of git; {given.old!r} cannot be unpacked: {error}")
        ratios = table([Path(name), HERE], [c for c in CASES if given.cases in c], given.turns, given.instructions)
    slower = [f"{case}: {ratio:.2f}" for case, ratio in ratios.items() if ratio > given.most]
    if slower:
        print(f"slower than {given.most:g} times the old version: {'; '.join(slower)}", file=sys.stderr)
    return bool(slower)


if __name__ == "__main__":
    sys.exit(main())
