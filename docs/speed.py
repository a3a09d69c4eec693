"""Prints the figures of docs/performance.md: kernels, call, many discs, rounding. Takes some minutes on a quiet machine."""

import resource
import time as clock
from collections.abc import Callable

import numpy as np

from compare import lump
from continuum import breathing_ring, steered_rod, untwisting_rod
from discs import Midpoint, Problem, SimulationError, simulate
from discs.integrators import Work
from discs.kernels.background import wait_for_kernels
from discs.skew import Phase


def spent(run: Callable[[], object], times: int) -> list[float]:
    """Times of several runs, s, the least first, after one to warm up."""
    run()
    found = []
    for _ in range(times):
        begun = clock.perf_counter()
        run()
        found.append(clock.perf_counter() - begun)
    return sorted(found)


def fastest(run: Callable[[], object], times: int) -> float:
    """Least time of several runs, s."""
    return spent(run, times)[0]


def sweeps() -> None:
    """ns per disc and sweep: 100 steps of six sweeps less 100 of one, so that what a step costs besides does not count."""
    kinds = {
        "free ends": lambda n: lump(untwisting_rod(), n),
        "consistent ends": lambda n: lump(untwisting_rod(), n, "consistent"),
        "ring": lambda n: lump(breathing_ring(), n),
        "own headings": lambda n: lump(steered_rod(), n),
    }
    for name, make in kinds.items():
        for n in (128, 512, 2048, 8192):
            problem = make(n)

            def run(count: int, problem: Problem = problem) -> None:
                short = Problem(problem.chain, problem.initial, 0.1)
                simulate(short, Midpoint(sweeps=count, tolerance=0), 0.001, frames=1, progress=False)

            six, one = (fastest(lambda count=count: run(count), 15) for count in (6, 1))
            print(f"{name}, N = {n}: {1e9 * (six - one) / (500 * n):.1f} ns per disc and sweep; "
                  f"with all else {1e9 * six / (600 * n):.1f}")  # fmt: skip


def call() -> None:
    """What a call costs besides its steps."""
    for scene in (untwisting_rod(duration=0.01), steered_rod(duration=0.01)):
        problem = lump(scene, 32)
        calls = spent(lambda p=problem: simulate(p, dt=p.duration, frames=1, progress=False), 3000)
        many = fastest(lambda p=problem: simulate(p, dt=p.duration / 100, frames=101, progress=False), 50)
        print(f"a call with one step: {1e6 * calls[0]:.0f} µs, median {1e6 * calls[1500]:.0f} µs; "
              f"each of 100 steps with a frame: {1e4 * (many - calls[0]):.0f} µs")  # fmt: skip


def many_discs() -> None:
    """N = 100 000 to t = 4.5."""
    for ends in ("springs", "consistent"):
        begun = clock.perf_counter()
        run = simulate(lump(untwisting_rod(), 100_000, ends), Midpoint(tolerance=1e-9), 0.01, frames=1, progress=False)
        end = ", ".join(f"{getattr(run, name)[-1, 0]:.6f}" for name in ("x", "y", "theta"))
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
        print(f"100 000 discs, {ends}: {clock.perf_counter() - begun:.1f} s, end disc at {end}, {memory:.0f} MiB")


def rounding() -> None:
    """Against extended precision; and where sweeps stop converging."""
    for n in (1025, 4097, 16385):
        problem = lump(untwisting_rod(), n)
        z, method = Phase(*(part.astype(np.longdouble) for part in problem.start())), Midpoint(tolerance=1e-15)
        for _ in range(150):
            z = method.step(problem.system, z, 0.03, Work())
        run = simulate(problem, "midpoint", 0.03, frames=1, progress=False)
        far = np.abs(np.array([run.x[-1], run.y[-1], run.theta[-1]]) - (z.hi + z.lo)).max()
        print(f"N = {n}: {far:.1e} from extended precision, energy off by {run.energy[-1] - problem.energy():.1e}")
    for n in (16385, 65537, 131073, 262145):
        for h in (0.01, 0.03, 0.1):
            problem = lump(untwisting_rod(duration=0.3), n)
            try:
                run = simulate(problem, Midpoint(sweeps=25), h, frames=1, progress=False)
            except SimulationError as error:
                print(f"N = {n}, h = {h}: {error}")
                continue
            s = run.stats
            print(f"N = {n}, h = {h}: {s['solves'] / s['steps']:.1f} sweeps, {s['unconverged']} of {s['steps']} unconverged, "
                  f"energy off by {run.energy[-1] - problem.energy():.0e}")  # fmt: skip


if __name__ == "__main__":
    wait_for_kernels()
    sweeps()
    call()
    many_discs()
    rounding()
