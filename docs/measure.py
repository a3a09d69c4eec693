"""Prints the figures of docs/accuracy.md that no test asserts and `make run` does not show. Takes some minutes."""

import time as clock
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from compare import convergence, lump
from compare.load_limits import fitting_twist
from compare.quantities import WANTS, simpson
from continuum import breathing_ring, exact, solve, steered_rod, untwisting_rod
from continuum.mesh import semidiscretise
from continuum.solver import spline
from discs import Gauss8, Midpoint, Solution, Suzuki4, simulate
from discs.mechanics.ground import inner

FINE = Suzuki4(Midpoint(tolerance=1e-11))
EXACT = Gauss8(tolerance=1e-13)
FIELDS = ("x", "y", "theta")


def last(run: Solution, cells: int) -> np.ndarray:
    """Last frame on a mesh of `cells` cells, (3, cells + 1)."""
    return np.stack([getattr(run, name)[-1, :: (run.s.size - 1) // cells] for name in FIELDS])


def chains(ends: str, sizes: tuple[int, ...]) -> list[np.ndarray]:
    """Paper's scene at t = 4.5 on the discs that the coarsest chain has."""
    runs = (simulate(semidiscretise(untwisting_rod(), n, ends), FINE, 0.0225, frames=1, progress=False) for n in sizes)
    return [last(run, sizes[0] - 1) for run in runs]


def orders() -> None:
    """Orders with consistent ends on the paper's twist, and on one that fits the free ends."""
    sizes = (129, 257, 513, 1025, 2049, 4097)
    for law in ("field", "unit"):
        scene = untwisting_rod(law)
        for name, each, n in (("paper's", scene, sizes), ("fitting", replace(scene, initial=fitting_twist), sizes[:4])):
            field = solve(each, 1e-9, frames=1, progress=False, want=WANTS)
            study = convergence(each, n, "consistent", field, progress=False, want=WANTS)
            print(f"orders, {law} law, {name} twist, N = {n}")
            for quantity, order, spread in zip(study.fields, study.order.T, study.order_spread, strict=True):
                print(f"{quantity:14s}", *(f"{o:.2f}" for o in order), f"± {spread:.2f}")


def against(field: Solution, run: Solution, names: tuple[str, str]) -> np.ndarray:
    """Errors of two components at the last frame of discs, (2, n)."""
    return np.stack([getattr(run, a)[-1] - spline(untwisting_rod(), field.s, getattr(field, a)[-1:])(run.s)[:, 0] for a in names])


def places() -> None:
    """Where r' of the unit law is off most, and velocities disc by disc of elements of three."""
    scene = untwisting_rod("unit")
    field = solve(scene, 1e-9, frames=1, progress=False, want="slope")
    for n in (129, 257, 513, 1025):
        run = simulate(lump(scene, n, "consistent"), EXACT, 0.015, frames=1, want=("slope",), progress=False)
        off = np.abs(against(field, run, ("slope_x", "slope_y"))).max(axis=0)
        most = int(off.argmax())
        print(f"unit law, N = {n}, r': {off[most]:.1e} at disc {min(most, n - 1 - most)} from an end, "
              f"{off[0]:.1e} at the end, {off[inner(run)].max():.1e} inside")  # fmt: skip
    scene = replace(steered_rod(), initial=partial(fitting_twist, fields=6))
    field = solve(scene, 1e-9, frames=1, progress=False, want="velocity")
    for n in (33, 65, 129, 257):
        run = simulate(lump(scene, n, degree=2), EXACT, 0.015, frames=1, want=("velocity",), progress=False)
        off = against(field, run, ("x_rate", "y_rate"))
        print(f"elements, fitting twist, N = {n}, velocity of discs: {np.abs(off).max():.2e}, "
              f"without the second branch of waves {np.abs(simpson(off, False)).max():.2e}")  # fmt: skip


def main() -> None:
    """All of them."""
    orders()
    places()
    sizes = (257, 513, 1025, 2049, 4097)
    u = chains("consistent", sizes)
    change = [np.abs(b - a).max(axis=1) for a, b in pairwise(u)]
    print("consistent ends, orders from the changes between", sizes)
    print(np.log2(np.array(change[:-1]) / np.array(change[1:])))
    t = [b + (b - a) / 3 for a, b in pairwise(u)]
    print("changes of the extrapolated fields\n", np.array([np.abs(b - a).max(axis=1) for a, b in pairwise(t)]))

    field = solve(untwisting_rod(), 1e-5, frames=1, progress=False)
    a, b, c = chains("springs", (513, 1025, 2049))
    once = 2 * b - a, 2 * c - b
    truth = last(field, 512)
    print("plain springs at 2049, error", np.abs(c - truth).max(axis=1), "twice extrapolated",
          np.abs((4 * once[1] - once[0]) / 3 - truth).max(axis=1))  # fmt: skip

    for law in ("field", "unit"):
        scene = breathing_ring(law)
        ring = solve(scene, 1e-7, progress=False)
        error = np.abs(np.hypot(ring.x, ring.y) - exact.ring(scene.rod, ring.t, 0.4, law).radius[:, None]).max()
        print(f"ring, {law} law: radius off by {error:.1e}, estimated {ring.error_estimate}")

    for name, scene in (("slaved", untwisting_rod(duration=150.0)), ("steered", steered_rod(duration=150.0))):
        for multiple in (1, 2, 4, 8, 16):
            problem = lump(scene, 129, "springs" if scene.steered else "consistent")
            run = simulate(problem, "midpoint", multiple * problem.chain.k, frames=301, progress=False)
            s = run.stats
            print(f"{name}, N = 129, h = {multiple}k over [0, 150]: energy {np.abs(run.energy / run.energy[0] - 1).max():.1e}, "
                  f"{s['solves'] / s['steps']:.1f} sweeps, {s['unconverged']} of {s['steps']} steps unconverged")  # fmt: skip
    run = solve(untwisting_rod(duration=150.0), method="leapfrog", frames=1501, progress=False)
    print(f"leapfrog: modified energy {np.ptp(run.modified_energy) / run.energy[0]:.1e}, steps {run.stats['steps']}, "
          f"energy off by 1 % at t = {run.t[np.argmax(np.abs(run.energy / run.energy[0] - 1) > 0.01)]:.1f}, "
          f"least {run.energy.min():.2f} of {run.energy[0]:.2f}")  # fmt: skip


def peers() -> None:
    """Medians of five runs, after one to warm up, of Exudyn and of ours with the same step; skipped without exudyn."""
    try:
        from compare.peers.exudyn_chain import exudyn_steered
    except ImportError:
        print("exudyn is not installed (extra [peers])")
        return
    for n in (2, 8, 32, 128):
        problem = lump(steered_rod(), n)
        reference = simulate(problem, FINE, 0.005, frames=1, progress=False)
        found = []
        for run in (
            lambda p: simulate(p, "midpoint", 0.01, frames=2, progress=False),
            lambda p: exudyn_steered(p, 0.01),
        ):
            times = []
            for _ in range(6):
                start = clock.perf_counter()
                end = run(problem)
                times.append(clock.perf_counter() - start)
            error = max(np.abs(getattr(end, name)[-1] - getattr(reference, name)[-1]).max() for name in (*FIELDS, "phi"))
            found.append((np.median(times[1:]), error))
        (ours, a), (theirs, b) = found
        print(f"N = {n}, h = 0.01: ours {ours:.3f} s ({a:.1e}), Exudyn {theirs:.3f} s ({b:.1e}), Exudyn / ours {theirs / ours:.2f}")


if __name__ == "__main__":
    main()
    peers()
