"""The cases that are timed, by public functions alone, so that releases can be compared.

Each makes its problem and returns what is timed. Kernels of steps: 100 steps of N discs; calls: two steps of three discs; "auto"
and the field: a result to a tolerance.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from compare import lump
from continuum import breathing_ring, solve, steered_rod, untwisting_rod
from discs import Problem, simulate

Timed = Callable[[], Any]
DT = 0.002


def discs(kind: str, n: int) -> Problem:
    """The paper's rod as n discs: free "springs" or "consistent" ends, the unit law, a "ring", or "own" headings."""
    if kind == "own":
        return lump(steered_rod(stretch_stiffness=10, shear_stiffness=10, heading_inertia=0.25), n)
    if kind == "ring":
        return lump(breathing_ring(), n)
    return lump(untwisting_rod("unit" if kind == "unit" else "field"), n, ends="consistent" if kind == "consistent" else "springs")


def steps(kind: str, n: int, method: str, count: int = 100, dt: float = DT) -> Timed:
    problem = discs(kind, n)
    return partial(simulate, problem, method, dt, [count * dt], progress=False, engine="compiled")


def call(n: int = 3) -> Timed:
    problem = discs("springs", n)
    return partial(simulate, problem, "midpoint", DT, [2 * DT], progress=False, engine="compiled")


def auto(kind: str, n: int, tol: float) -> Timed:
    problem = discs(kind, n)
    return partial(simulate, problem, "auto", frames=1, tol=tol, progress=False, engine="compiled")


def field(law: str, tol: float) -> Timed:
    return partial(solve, untwisting_rod(law), tol, frames=2, progress=False)


CASES: dict[str, Callable[[], Timed]] = {
    **{
        f"{method}, {kind}, N = {n}": partial(steps, kind, n, method)
        for method, kind, n in (
            ("midpoint", "springs", 32),
            ("midpoint", "springs", 512),
            ("midpoint", "consistent", 512),
            ("midpoint", "unit", 512),
            ("midpoint", "ring", 512),
            ("midpoint", "own", 512),
            ("gauss6", "springs", 32),
            ("gauss6", "springs", 512),
            ("gauss6", "own", 512),
            ("midpoint", "springs", 8192),
        )
    },
    "DOP853, springs, N = 8": partial(steps, "springs", 8, "DOP853", 1, 1.0),
    "a call": call,
    "auto, springs, N = 32, 1e-4": partial(auto, "springs", 32, 1e-4),
    "auto, own, N = 128, 1e-6": partial(auto, "own", 128, 1e-6),
    "field, field law, 1e-6": partial(field, "field", 1e-6),
    "field, unit law, 1e-6": partial(field, "unit", 1e-6),
}
