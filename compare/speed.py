"""A small table of speed against error, which the main job writes: some of our methods beside SciPy's."""

from dataclasses import replace

from compare.entrants import ours
from compare.lump import lump
from compare.peers import loads, reduced
from compare.peers.peer import Peer
from compare.precision import work_precision
from compare.work_precision import WorkPrecision
from continuum import Scene
from discs import Problem, simulate
from discs.running.engine import WAITING

SIZES = 33, 129
OURS = "midpoint", "gauss6", "auto"
OTHERS = "SciPy DOP853", "SciPy LSODA", "SciPy Radau"
TOLERANCES = 1e-3, 1e-6  # loosest and tightest of SciPy's methods
COMPILED = "midpoint", "gauss6", "gauss8"  # methods that "auto" takes
SECONDS = 0.15  # the longest run; see `work_precision`


def speed(scene: Scene, progress: bool = True) -> tuple[WorkPrecision | None, str]:
    """Speed against error with 33 and 129 discs, plain springs, in some seconds; and its table, or why there is none.

    It needs compiled kernels: while they are being compiled, times would be those of the plain engine.
    """
    problems = [lump(scene, n) for n in SIZES]
    for problem in problems:
        try:
            loads.check(problem)
        except ValueError as error:
            return None, str(error)
        for method in COMPILED:
            first = simulate(replace(problem, duration=problem.duration / 100), method, problem.duration / 100, 1, progress=False)
            if first.stats["engine"] != "compiled":
                because = first.stats["plain_because"]
                again = "; run it again in some minutes" if because == WAITING else ""
                return None, f"none, as it needs compiled runs, and a run was plain: {because}{again}"
    if not problems[0].energy():
        return None, "none, as nothing moves"
    found = work_precision(scene, SIZES, _others, 1, SECONDS, progress, own=_own)
    return found, found.speedups(errors=(1e-3, 1e-4, 1e-5, 1e-6))


def _own(problem: Problem) -> list[Peer]:
    return [peer for peer in ours(problem) if peer.name in OURS]


def _others(problem: Problem) -> list[Peer]:
    """SciPy's methods, with tolerances from loose to tight and a right-hand side compiled for this chain."""
    loosest, tightest = TOLERANCES
    return [
        peer._replace(settings=tuple(setting for setting in peer.settings if tightest <= setting <= loosest))
        for peer in reduced.scipy_peers(problem, reduced.Bound(problem, keep=True))
        if peer.name in OTHERS
    ]
