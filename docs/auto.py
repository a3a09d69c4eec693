"""Prints what "auto" costs beside the best fixed choice, for docs/performance.md; some minutes on a quiet machine.

For each chain and tolerance the best fixed choice is the method with the step (or tolerances) that has this error in the least
time, as one who knows the truth would choose: log of time against log of error, read off between runs whose steps differ by a
factor of root 2. "auto" counts with all its attempts. Both are medians in processor time, in turns, at the end of the motion.
"""

import argparse
import time as clock
import warnings
from statistics import median
from typing import NamedTuple

import numpy as np

from compare import lump
from compare.entrants import EXPLICIT, ours
from compare.peers.peer import Outcome, Peer
from compare.reference import distance, reference
from continuum import Scene, steered_rod, untwisting_rod
from discs import Problem, SimulationError, Solution, simulate
from discs.arrays import Float
from discs.integrators.ivp import DOP853

LAWS = {"field": untwisting_rod(), "unit": untwisting_rod(rolling="unit"), "own": steered_rod()}
SIZES = 8, 16, 32, 64, 128, 512, 2048
TOLERANCES = 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8
OMITTED = "radau3", "radau5", "auto"  # they damp; or are what is judged
TURNS = 5
SLOW = 3.0  # a method is dropped where a run takes this many times the time of the fastest one that is more accurate


class Run(NamedTuple):
    """A fixed choice: its peer and setting, error and time, s."""

    peer: Peer
    setting: float
    error: float
    seconds: float


def explicit(problem: Problem) -> Peer:
    """DOP853 with tolerances of half a decade."""

    def run(setting: float, seconds: float) -> Outcome:
        begun = clock.process_time()
        found = at_the_end(problem, DOP853(setting, setting))
        return Outcome(ends(found), found.stats["steps"], found.stats["gradients"], 0, clock.process_time() - begun)

    return Peer("DOP853", tuple(10 ** (-j / 3) for j in range(5, 31)), run)


def at_the_end(problem: Problem, method: DOP853 | str, tol: float | None = None) -> Solution:
    """A run with one frame."""
    dt = problem.duration if tol is None else None
    return simulate(problem, method, dt, 1, progress=False, engine="compiled", tol=tol)


def ends(run: Solution) -> Float:
    """Positions and angles at the end, (rows, n)."""
    assert run.problem is not None
    return np.array([getattr(run, row)[-1] for row in run.problem.system.rows])


def fixed(problem: Problem, exact: Float) -> list[Run]:
    """Runs of all methods, until their error is below the least tolerance."""
    found: list[Run] = []
    mine = [peer for peer in ours(problem) if peer.name not in OMITTED]
    for peer in [*reversed(mine), *([explicit(problem)] if problem.chain.n <= EXPLICIT else [])]:  # never the best for more
        for setting in peer.settings:
            try:
                times = [peer.run(setting, np.inf) for _ in range(2)]
            except (ArithmeticError, SimulationError):  # steps are too long
                continue
            run = Run(peer, setting, distance(times[0].q, exact), min(one.seconds for one in times))
            found.append(run)
            better = [other.seconds for other in found if other.error < run.error]
            if run.error < TOLERANCES[-1] or run.seconds > SLOW * min(better, default=np.inf):
                break
    return found


def best(runs: list[Run], tol: float) -> tuple[Run, float]:
    """The run nearest to the tolerance of the method that reaches it in the least time; and that time over the run's."""
    choices = []
    for name in dict.fromkeys(run.peer.name for run in runs):
        of = [run for run in runs if run.peer.name == name]
        for loose, tight in zip(of[:1] + of, of, strict=False):
            if tight.error > tol:
                continue
            fall = np.log(loose.error / tight.error)
            part = np.clip(np.log(loose.error / tol) / fall, 0, 1) if fall > 0 else 1.0
            choices.append((float(loose.seconds ** (1 - part) * tight.seconds**part), tight))
            break
    seconds, run = min(choices, key=lambda choice: choice[0])
    return run, seconds / run.seconds


def row(law: str, problem: Problem, exact: Float, runs: list[Run], tol: float) -> tuple[str, float, float]:
    """A line of the table, the ratio of times, and the true error of "auto" over the tolerance."""
    chosen, part = best(runs, tol)
    ours, theirs = [], []
    turns = TURNS if chosen.seconds < 0.2 else 2
    for _ in range(turns):
        theirs.append(chosen.peer.run(chosen.setting, np.inf).seconds * part)
        begun = clock.process_time()
        run = at_the_end(problem, "auto", tol)
        ours.append(clock.process_time() - begun)
    error, stats = distance(ends(run), exact) / tol, run.stats
    ratio = median(ours) / median(theirs)
    said = f"{law} {problem.chain.n} {tol:.0e}", f"{chosen.peer.name} {chosen.setting:.3g}", f"{1e3 * median(theirs):.2f}"
    more = f"{stats['method']} {stats['steps']}, {stats['attempts']}, {stats['limited_by']}", f"{1e3 * median(ours):.2f}"
    return "| " + " | ".join([*said, *more, f"{ratio:.2f}", f"{error:.2f}"]) + " |", ratio, error


def main(laws: list[str], sizes: list[int], tolerances: list[float]) -> None:
    """The table, and a summary."""
    print("| chain, tol | best fixed | ms | auto: method, steps, attempts | ms | ratio | error/tol |\n" + "| --- " * 7 + "|")
    found: list[tuple[float, float]] = []
    for law in laws:
        for n in sizes:
            scene: Scene = LAWS[law]
            problem = lump(scene, n)
            exact, off = reference(problem, 500 if n < 500 else 1500)
            runs = fixed(problem, exact)
            for tol in tolerances:
                line, *numbers = row(law, problem, exact, runs, tol)
                found.append((numbers[0], numbers[1]))
                print(line, f"reference {off:.0e}" if off > tol / 10 else "", flush=True)
    ratios, errors = np.array(found).T
    print(f"ratio: median {np.median(ratios):.2f}, 90 % {np.quantile(ratios, 0.9):.2f}, largest {ratios.max():.2f}")
    print(f"above 1.5 in {(ratios > 1.5).sum()} of {ratios.size}; error/tol: largest {errors.max():.2f}, "
          f"below 0.05 in {(errors < 0.05).sum()}")  # fmt: skip


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    asked.add_argument("--laws", nargs="+", default=list(LAWS), choices=LAWS)
    asked.add_argument("--sizes", nargs="+", type=int, default=SIZES)
    asked.add_argument("--tolerances", nargs="+", type=float, default=TOLERANCES)
    given = asked.parse_args()
    warnings.simplefilter("ignore")  # of the runs with long steps
    main(given.laws, given.sizes, given.tolerances)
