"""How hard cases are run: what is expected of a method, what became of it, ours and peers'."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.util import find_spec
from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compare.peers import reduced
from compare.precision import reference
from discs import Problem, SimulationError, Solution, simulate

CONSERVING, GAUSS = ("midpoint", "suzuki4", "kahanli6"), ("gauss4", "gauss6", "gauss8")
EXPLICIT = ("leapfrog", "mclachlan-perlmutter", "rk4")
FIXED = (*CONSERVING, *GAUSS, *EXPLICIT)  # with steps and sweeps of their own: an error to a tolerance hides waves and rounding
OURS = (*FIXED, "auto")
PEERS = ("SciPy Radau", "SciPy BDF", "SciPy DOP853", "CVODE BDF-5")
TOL, RTOL = 1e-4, 1e-6  # of "auto", and of the peers
LOOSE = 0.01  # a run is lost when its energy is off by more than this part
FRAMES = 101


class Found(NamedTuple):
    """What became of a run.

    outcome : "done"; "refused" at the start; "stopped" by a SimulationError; "failed", a peer; "cut off", too slow; "-", not there.
    t : time reached. dt : step, NaN if the method chooses. error : largest, relative to the largest value of each of x, y, theta
    (or as the case says), NaN where nothing is known. energy : largest relative error over the frames, of peers at the end.
    residual : of rolling, length per time. says : its message, or warnings. note : what else the case measures.
    """

    outcome: str
    t: float = np.nan
    dt: float = np.nan
    error: float = np.nan
    energy: float = np.nan
    residual: float = np.nan
    unconverged: int = 0
    steps: int = 0
    seconds: float = np.nan
    says: str = ""
    note: str = ""


@dataclass(frozen=True)
class Expectation:
    """What must be seen.

    kind : "exact", "bound", or "must refuse".
    words : the same for readers.
    energy : largest relative error of the energy of the methods in `must`; LOOSE for others.
    error : largest error of any method.
    must : methods of ours that must keep to it. The others may stop, or say that steps did not converge or a warning: what no
        method may do is to be lost without a word.
    """

    kind: str
    words: str
    energy: float = LOOSE
    error: float = np.inf
    must: tuple[str, ...] = ()

    def verdict(self, method: str, found: Found) -> str:
        """ "holds", "says so" (off, and not silently), "lost", or the outcome of a run that was not done."""
        if found.outcome != "done":
            return found.outcome
        energy = self.energy if method in self.must else LOOSE
        if self.kind != "must refuse" and found.energy <= energy and not found.error > self.error:
            return "holds"
        return "says so" if found.says or found.unconverged else "lost"

    def met(self, method: str, found: Found) -> bool | None:
        """Whether a method of ours does as expected; None of peers, and where nothing was seen."""
        verdict = self.verdict(method, found)
        if method not in OURS or verdict in ("cut off", "-"):
            return None
        if self.kind == "must refuse":
            return verdict in ("refused", "stopped")
        return verdict == "holds" if method in self.must else verdict not in ("lost", "refused")


@lru_cache(2)
def posed(make: Callable[[], Problem]) -> Problem:
    """The problem, made once for all methods."""
    return make()


@lru_cache(2)
def _known(make: Callable[[], Problem], exact: Callable[[Problem], NDArray] | None) -> NDArray | None:
    """Positions at the end: exact ones, or by short steps of "gauss8" where these agree."""
    problem = posed(make)
    if exact is not None:
        return exact(problem)
    try:
        q, floor = reference(problem)
    except SimulationError:
        return None
    return q if floor < 1e-4 else None


def march(problem: Problem, method: str, dt: float | None, seconds: float) -> tuple[Found, Solution | None]:
    """A run of ours; one that is foretold to take longer than `seconds` is not begun."""
    begun = perf_counter()

    def spent() -> float:
        return perf_counter() - begun

    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            if method == "auto":
                run = simulate(problem, "auto", tol=TOL, frames=FRAMES, progress=False)
            else:
                # a hundredth foretells the whole: the faster of two, as kernels may be compiled, unless it is a few fast steps
                part = replace(problem, duration=problem.duration / 100)
                tried = [simulate(part, method, dt, frames=1, progress=False).stats for _ in range(2)]
                fastest = min(t["seconds"] for t in tried)
                if 100 * fastest > seconds and (fastest > 0.1 or tried[0]["steps"] > 20):
                    return Found("cut off", dt=tried[0]["dt"], seconds=100 * fastest, says="foretold, not run"), None
                run = simulate(problem, method, dt, frames=FRAMES, progress=False)
        except ValueError as error:
            return Found("refused", 0.0, seconds=spent(), says=str(error)), None
        except (SimulationError, ArithmeticError) as error:
            return Found("stopped", getattr(error, "time", np.nan), dt or np.nan, seconds=spent(), says=str(error)), None
    drift = float(np.abs(run.energy / run.energy[0] - 1).max())
    says = " ".join(dict.fromkeys(str(w.message) for w in heard))
    slip = float(run.rolling_residual.max()) if run.rolling_residual is not None else np.nan
    stats = run.stats
    found = Found("done", run.t[-1], stats["dt"], np.nan, drift, slip, stats["unconverged"], stats["steps"], stats["seconds"], says)
    return found, run


def _peer(problem: Problem, name: str, seconds: float) -> tuple[Found, NDArray | None]:
    """A run of a peer, at its tolerance RTOL; the right-hand side is the compiled one for all chains, energy is that at the end."""
    if name.startswith("CVODE") and not find_spec("sksundae"):
        return Found("-", says="scikit-sundae is not installed"), None
    from discs.kernels import methods

    chain, system, begun = problem.system.kernel, problem.system, perf_counter()
    f = reduced.Bound(problem, lambda t, y, out: methods.reduced(chain, np.ascontiguousarray(y), out))
    found = reduced.sundials_peers(problem, f) if name.startswith("CVODE") else reduced.scipy_peers(problem, f)
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            end = next(p for p in found if p.name == name).run(RTOL, seconds)
    except reduced.Cutoff:
        return Found("cut off", seconds=perf_counter() - begun), None
    except (ArithmeticError, RuntimeError, ValueError) as error:
        return Found("failed", seconds=perf_counter() - begun, says=str(error)), None
    pi = np.zeros(1) if end.pi is None else end.pi
    energy = 0.5 * float(np.vdot(pi, pi)) + system.potential(system.shape(end.q))
    drift = abs(energy / problem.energy() - 1)
    return Found("done", problem.duration, energy=drift, residual=0.0, steps=end.steps, seconds=end.seconds), end.q


def motion(
    make: Callable[[], Problem],
    method: str,
    seconds: float,
    step: Callable[[Problem], float] | None = None,
    exact: Callable[[Problem], NDArray] | None = None,
    compared: bool = True,
    note: Callable[[Problem, Solution], str] | None = None,
) -> Found:
    """A problem run to its end by a method; `step` is for ours, and for implicit ones only where explicit ones cannot take it."""
    try:
        problem = posed(make)
    except ValueError as error:
        return Found("refused", 0.0, says=str(error))
    if method in PEERS:
        found, q = _peer(problem, method, seconds)
    else:
        found, run = march(problem, method, step(problem) if step else None, seconds)
        q = None if run is None else np.array([getattr(run, row)[-1] for row in problem.system.rows])
        if run is not None and note is not None:
            found = found._replace(note=note(problem, run))
    known = _known(make, exact) if q is not None and (compared or exact) else None
    return found if q is None or known is None else found._replace(error=_off(q, known))


def _off(q: NDArray, known: NDArray) -> float:
    """Largest error, each row relative to its largest value; absolute where that is rounding."""
    size = np.abs(known).max(axis=1, keepdims=True)
    return float((np.abs(q - known) / np.where(size > 1e-12, size, 1.0)).max())
