"""`python -m tests.benchmarks.long_runs`: long runs, as a table, and the memory of many.

    python -m tests.benchmarks.long_runs --scale 0.01      # a hundredth of each duration
    python -m tests.benchmarks.long_runs --only paper ring

Each run is made in a process of its own, compiled, with a checkpoint. That process is killed (SIGKILL) when half of the frames are
written, and another one continues. A third one makes the run in memory: all frames must have the same bits.

The drift is the largest |H/H(0) - 1|. Its exponent p is that of the mean square difference of the energy over a time tau, which
goes like tau^(2p): p = 1/2 is a random walk, p = 0 noise that does not accumulate, p = 1 a trend.
"""

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from compare import lump
from continuum import rolling_rod, steered_rod, untwisting_rod
from discs import Problem, Solution, load, simulate
from discs.arrays import Float

FRAMES = 1001
TRUE: dict[str, Any] = {"rolling": "unit", "curvature": "true", "stretch_stiffness": 10.0}
MILLION = "million"
MANY = "many"


class Case(NamedTuple):
    """A long run. problem : of a duration."""

    what: str
    problem: Callable[[float], Problem]
    duration: float
    dt: float
    method: str = "midpoint"


CASES = {
    "paper": Case("the paper's scene, plain springs", lambda t: lump(untwisting_rod(duration=t), 33), 1e5, 0.05),
    "unit": Case("unit law", lambda t: lump(untwisting_rod(rolling="unit", duration=t), 33), 2e4, 0.05),
    "consistent": Case("consistent ends", lambda t: lump(untwisting_rod(duration=t), 33, "consistent"), 2e4, 0.05),
    "ring": Case("ring, unit law", lambda t: lump(rolling_rod(rolling="unit", amplitude=0.1, duration=t), 33), 2e4, 0.05),
    "own": Case("own headings", lambda t: lump(steered_rod(duration=t), 33), 1e4, 0.05),
    "true": Case("true curvature", lambda t: lump(untwisting_rod(duration=t, **TRUE), 33), 2e3, 0.05),
    "gauss4": Case("the paper's scene, gauss4", lambda t: lump(untwisting_rod(duration=t), 33), 5e3, 0.05, "gauss4"),
}


def exponent(t: Float, energy: Float) -> float:
    """p of rms |H(t + tau) - H(t)| ~ tau^p, from tau of a frame to a quarter of the run."""
    lags = np.unique(np.geomspace(1, t.size // 4, 12).astype(int))
    spread = [np.sqrt(np.mean((energy[lag:] - energy[:-lag]) ** 2)) for lag in lags]
    return float(np.polyfit(np.log(t[lags]), np.log(spread), 1)[0])


def run(case: Case, scale: float, checkpoint: Path | None) -> Solution:
    problem = case.problem(scale * case.duration)
    return simulate(problem, case.method, case.dt, FRAMES, progress=False, engine="compiled", checkpoint=checkpoint)


def child(*words: str) -> "subprocess.Popen[bytes]":
    return subprocess.Popen([sys.executable, "-m", "tests.benchmarks.long_runs", *words], stdout=subprocess.PIPE)


def answer(process: "subprocess.Popen[bytes]") -> dict[str, Any]:
    out, _ = process.communicate()
    if process.returncode:
        raise SystemExit(f"a run failed, exit code {process.returncode}")
    found: dict[str, Any] = json.loads(out.splitlines()[-1])
    return found


def frames_of(path: Path) -> int:
    """How many frames are in the file of a run on its way."""
    try:
        found = load(path)
    except (ValueError, OSError):
        return 0
    return 0 if not isinstance(found, Solution) else found.t.size


def killed(name: str, scale: str, path: Path) -> int:
    """Start a run and kill it when half of its frames are written; how many it had then."""
    process = child("--child", name, "--scale", scale, "--checkpoint", str(path))
    while process.poll() is None and frames_of(path) < FRAMES // 2:
        time.sleep(0.2)
    if process.poll() is None:
        os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    return frames_of(path)


def row(name: str, scale: float) -> str:
    """A line of the table."""
    case = CASES[name]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "run.nc")
        whole = answer(child("--child", name, "--scale", str(scale), "--out", str(Path(folder, "whole.nc"))))
        had = killed(name, str(scale), path)
        answer(child("--child", name, "--scale", str(scale), "--checkpoint", str(path)))
        one, other = load(Path(folder, "whole.nc")), load(path)
        names = ("t", "x", "y", "theta", "omega", "energy", *(("phi",) if getattr(one, "phi", None) is not None else ()))
        same = all(getattr(one, n).tobytes() == getattr(other, n).tobytes() for n in names)
    assert isinstance(one, Solution)
    residual = 0.0 if one.rolling_residual is None else float(one.rolling_residual.max())
    cells = [
        case.what,
        f"{case.method}, dt = {case.dt:g}",
        f"{one.t[-1]:.3g}",
        f"{one.stats['steps']:.3g}",
        f"{whole['seconds']:.1f}",
        f"{np.abs(one.energy / one.energy[0] - 1).max():.1e}",
        f"{exponent(one.t, one.energy):.2f}",
        f"{residual:.1e}",
        f"yes, from frame {had}" if same and 0 < had < FRAMES else "yes, but was not interrupted" if same else "NO",
    ]
    return f"| {' | '.join(cells)} |"


def a_million() -> dict[str, float]:
    """10^6 discs to t = 0.1: processor time, memory, energy."""
    problem = lump(untwisting_rod(duration=0.1), 10**6, "consistent")
    begun = time.process_time()
    found = simulate(problem, "midpoint", dt=0.01, frames=3, progress=False, engine="compiled")
    return {
        "seconds": time.process_time() - begun,
        "drift": float(np.abs(found.energy / found.energy[0] - 1).max()),
        "residual": float(np.max(found.rolling_residual if found.rolling_residual is not None else 0.0)),
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
        "moved": float(np.abs(found.y[-1]).max()),
    }


def resident() -> float:
    """Memory of this process now, MiB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 2**20


def many(count: int) -> dict[str, float]:
    """The memory after a tenth of many runs of one process and after all of them, MiB."""
    kinds = [case.problem(0.5) for case in CASES.values()]

    def runs(times: int) -> None:
        for i in range(times):
            simulate(kinds[i % len(kinds)], "midpoint", dt=0.05, frames=6, progress=False, engine="compiled")
            if i % 10 == 0:
                simulate(lump(untwisting_rod(duration=0.2), 9 + i % 5), tol=1e-3, frames=3, progress=False, engine="compiled")

    runs(count // 10)
    before = resident()
    runs(count - count // 10)
    return {"before": before, "after": resident(), "count": count}


def of_child(chosen: argparse.Namespace) -> dict[str, float]:
    """What a process of its own does."""
    if chosen.child == MILLION:
        return a_million()
    if chosen.child == MANY:
        return many(max(100, int(chosen.scale * 10_000)))
    begun = time.process_time()
    found = run(CASES[chosen.child], chosen.scale, chosen.checkpoint)
    seconds = time.process_time() - begun
    if chosen.out:
        found.save(chosen.out)
    return {"seconds": seconds}


def rows(names: list[str], scale: float) -> Iterator[str]:
    yield "| discs | method | t | steps | s | energy drift | exponent | rolling residual | same bits after a kill |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    for name in (name for name in CASES if name in names):
        yield row(name, scale)
    if MILLION in names:
        found = answer(child("--child", MILLION))
        yield "\n10^6 discs to t = 0.1, dt = 0.01: {seconds:.1f} s, {memory:.2f} GiB at most, ".format(**found) + (
            "energy drift {drift:.1e}, rolling residual {residual:.1e}".format(**found)
        )
    if MANY in names:
        found = answer(child("--child", MANY, "--scale", str(scale)))
        yield "\n{count} runs in one process: {before:.1f} MiB after a tenth of them, {after:.1f} MiB after all".format(**found)


def main() -> None:
    p = argparse.ArgumentParser(prog="python -m tests.benchmarks.long_runs", description="Long runs, as a table.")
    known = (*CASES, MILLION, MANY)
    p.add_argument("--only", nargs="+", choices=known, default=list(known))
    p.add_argument("--scale", type=float, default=1.0, help="of the durations")
    p.add_argument("--child", choices=known, help=argparse.SUPPRESS)
    p.add_argument("--checkpoint", type=Path, help=argparse.SUPPRESS)
    p.add_argument("--out", type=Path, help=argparse.SUPPRESS)
    chosen = p.parse_args()
    if chosen.child:
        print(json.dumps(of_child(chosen)))
        return
    for line in rows(chosen.only, chosen.scale):
        print(line, flush=True)


if __name__ == "__main__":
    main()
