"""Running hard cases: expectations and results, of our methods and of peers."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.util import find_spec
from time import thread_time as processor  # other programs on the machine do not change it
from typing import NamedTuple

import numpy as np

from compare.peers import reduced
from compare.peers.peer import Cutoff
from compare.reference import distance, reference
from discs import Problem, SimulationError, Solution, simulate, suggest_dt
from discs.arrays import Float
from discs.integrators import Integrator
from discs.running.doubt import ENERGY_DRIFT_WARNING
from discs.running.failure import NotReached
from discs.running.tolerance import USUAL, to_tolerance

CONSERVING, GAUSS = ("midpoint", "suzuki4", "kahanli6"), ("gauss4", "gauss6", "gauss8")
EXPLICIT = ("leapfrog", "mclachlan-perlmutter", "rk4")
RADAU = ("radau3", "radau5")  # they do not keep the energy, and are for dampers: run with loads only
TAKE_LOADS = (*CONSERVING, *GAUSS, *RADAU, "rk4", "auto", "default")  # loads that do work
FIXED = (*CONSERVING, *GAUSS, *EXPLICIT)  # methods with a fixed step: a tolerance hides waves and rounding
USUAL_METHODS = (*FIXED, "auto", "default")
OURS = (*USUAL_METHODS, *RADAU)
PEERS = ("SciPy Radau", "SciPy BDF", "SciPy DOP853", "CVODE BDF-5")
TOL, RTOL = 1e-4, 1e-6  # of "auto", and of the peers
SEARCHED = {"auto": TOL, "default": USUAL}  # "default" is `simulate(problem)` with nothing set
WRONG = 0.05  # relative error of positions, angles or energy that needs a warning
LOOSE = ENERGY_DRIFT_WARNING  # a run is lost if its relative error of the energy exceeds this
FRAMES = 101
REFERENCES = 1000, 4000, 16_000  # steps of "gauss8", of which two runs must agree to KNOWN
KNOWN = 1e-3
MOST_WORK = 2e7  # steps times discs of a reference


class Found(NamedTuple):
    """The result of a run.

    outcome : "done"; "refused" at the start; "stopped" by a SimulationError; "failed", a peer; "cut off", too slow; "-", not
        installed.
    t : time reached. dt : step, NaN if the method chooses. error : largest, relative to the largest value of each of x, y, theta
    (or as the case defines it), NaN if unknown. energy : largest relative error over the frames, of peers at the end; with
    loads that of the balance energy - work + dissipated, relative to the largest of the three.
    residual : of rolling, length per time. says : its error or warnings. note : other measurements of the case.
    off : largest error of positions and angles at the end, relative to the largest of each in the motion, as tolerances are (at the
        end for peers); NaN without a reference.
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
    off: float = np.nan


@dataclass(frozen=True)
class Expectation:
    """The expected result.

    kind : "exact", "bound", or "must refuse".
    words : the expectation in words.
    energy : largest relative error of the energy of the methods in `must`; LOOSE for others.
    error : largest error of any method.
    must : methods of ours that must meet it. The others may stop, report unconverged steps, or warn, but may not be lost without
        a warning.
    says : text that a warning or error of every run of ours must contain.
    aloud : whether `must` concerns the energy only, and an error above the bound needs a warning from every method.
    """

    kind: str
    words: str
    energy: float = LOOSE
    error: float = np.inf
    must: tuple[str, ...] = ()
    says: str = ""
    aloud: bool = False

    def verdict(self, method: str, found: Found) -> str:
        """ "passed", "warned" (wrong, with a warning), "lost", or the outcome of a run that was not done."""
        if found.outcome != "done":
            return found.outcome
        energy = self.energy if method in self.must else LOOSE
        if self.kind != "must refuse" and found.energy <= energy and not found.error > self.error:
            return "passed"
        return "warned" if found.says or found.unconverged else "lost"

    def met(self, method: str, found: Found) -> bool | None:
        """Whether a method of ours meets the expectation; None for peers and runs without a result."""
        verdict = self.verdict(method, found)
        if method not in OURS or verdict in ("cut off", "-"):
            return None
        if self.says not in found.says:
            return False
        if self.kind == "must refuse":
            return verdict in ("refused", "stopped")
        if method in self.must:
            return verdict == "passed" or (self.aloud and verdict == "warned" and found.energy <= self.energy)
        return verdict not in ("lost", "refused")


@lru_cache(2)
def posed(make: Callable[[], Problem]) -> Problem:
    """The problem, made once for all methods."""
    return make()


@lru_cache(2)
def reference_of(make: Callable[[], Problem], exact: Callable[[Problem], Float] | None = None) -> Float | None:
    """Positions at the end: exact, or by short steps of "gauss8" if these agree, as they do not where a motion is sensitive."""
    problem = posed(make)
    if exact is not None:
        return exact(problem)
    for steps in (steps for steps in REFERENCES if steps * problem.chain.n <= MOST_WORK):
        try:
            with warnings.catch_warnings(action="ignore"):
                q, floor = reference(problem, steps)
        except SimulationError:
            continue
        if floor < KNOWN:
            return q
    return None


class Slow(Exception):
    """A run would exceed its time: `seconds`, as predicted."""

    def __init__(self, seconds: float) -> None:
        super().__init__(seconds)
        self.seconds = seconds


def march(problem: Problem, method: str, dt: float | None, seconds: float) -> tuple[Found, Solution | None]:
    """A run of ours; if it is predicted to take longer than `seconds`, it is not started, nor is a further one of "auto"."""
    begun, times = processor(), np.linspace(0.0, problem.duration, FRAMES)

    def spent() -> float:
        return processor() - begun

    def timed(problem: Problem, integrator: str | Integrator, h: float, frames: int | Float) -> tuple[Solution, float]:
        start = processor()
        return simulate(problem, integrator, h, frames, progress=False), processor() - start

    def predicted(integrator: str | Integrator, h: float) -> float:
        """The predicted time from 32 steps, or more until they take 1/20 s or are 1/100 of all."""
        steps, whole = 32, problem.duration / h
        for attempt in range(20):  # the first may compile kernels
            part = replace(problem, duration=min(steps * h, problem.duration))
            _, taken = timed(part, integrator, h, 1)
            if attempt and (taken > 0.05 or 100 * steps >= whole):
                break
            steps *= 4 if attempt else 1
        return taken * max(whole / steps, 1.0)

    def run(problem: Problem, integrator: str | Integrator, h: float, times: Float) -> Solution:
        if (expected := predicted(integrator, h)) > seconds - sum(cost):
            raise Slow(expected)
        heard.clear()  # the last run counts, not those that the search for a step began with
        found, taken = timed(problem, integrator, h, times)
        cost.append(taken)
        return found

    cost: list[float] = []
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            if method in SEARCHED:
                done = to_tolerance(problem, "auto", SEARCHED[method], times, run)
            else:
                dt = suggest_dt(problem, method) if dt is None else dt
                done = run(problem, method, dt, times)
        except ValueError as error:
            return Found("refused", 0.0, seconds=spent(), says=str(error)), None
        except (SimulationError, ArithmeticError) as error:
            if method == "default" and isinstance(error, NotReached):
                return _done(error.best, _messages([*heard, error]), sum(cost)), error.best
            says = _messages([*heard, error])
            return Found("stopped", getattr(error, "time", np.nan), dt or np.nan, seconds=spent(), says=says), None
        except Slow as error:
            return Found("cut off", dt=dt or np.nan, seconds=error.seconds, says="predicted from its first steps, not run"), None
    return _done(done, _messages(heard), sum(cost)), done


def _done(run: Solution, says: str, seconds: float) -> Found:
    kept, size = run.energy - run.work + run.dissipated, max(np.abs(part).max() for part in (run.energy, run.work, run.dissipated))
    drift = float(np.abs(kept - kept[0]).max() / (abs(run.energy[0]) if run.balance is None else size))
    slip = float(run.rolling_residual.max()) if run.rolling_residual is not None else np.nan
    stats = run.stats
    return Found("done", run.t[-1], stats["dt"], np.nan, drift, slip, stats["unconverged"], stats["steps"], seconds, says)


def _messages(heard: Sequence[warnings.WarningMessage | Exception]) -> str:
    """Warnings and errors, each once."""
    return " ".join(dict.fromkeys(str(w.message) if isinstance(w, warnings.WarningMessage) else str(w) for w in heard))


class Watched(reduced.Bound):
    """The right-hand side of a peer; it records the time t reached and stops a run that exceeds its time or is predicted to.

    The prediction allows an error of a factor 4 at first (after a tenth of a second, or a thirtieth of its time), and less later.
    """

    def __init__(self, problem: Problem, seconds: float) -> None:
        from discs.kernels import driver

        chain = problem.system.parameters
        super().__init__(problem, lambda t, y, out: driver.reduced(chain, t, np.ascontiguousarray(y), out))
        self.duration, self.seconds, self.t, self.gave_up, self.begun = problem.duration, seconds, 0.0, "", processor()

    def watch(self, t: float) -> None:
        spent = processor() - self.begun
        self.t, share = t, spent / self.seconds
        if spent > max(0.1, self.seconds / 30) and (4 - 3 * share) * t < share * self.duration:
            self.gave_up = f"after {spent:.2g} s, as it would need over {self.seconds:g} s"
            raise Cutoff


def peer(problem: Problem, name: str, seconds: float) -> tuple[Found, Float | None]:
    """A run of a peer at the tolerance RTOL with the compiled right-hand side; the energy is that at the end."""
    if name.startswith("CVODE") and not find_spec("sksundae"):
        return Found("-", says="scikit-sundae is not installed"), None
    system, f = problem.system, Watched(problem, seconds)
    found = reduced.sundials_peers(problem, f) if name.startswith("CVODE") else reduced.scipy_peers(problem, f)
    try:
        with warnings.catch_warnings(action="ignore"), np.errstate(all="ignore"):
            end = next(p for p in found if p.name == name).run(RTOL, np.inf)
    except (Cutoff, ArithmeticError, RuntimeError, ValueError) as error:
        outcome, says = ("cut off", f.gave_up) if f.gave_up else ("failed", str(error))
        return Found(outcome, f.t, seconds=processor() - f.begun, says=says), None
    spent = processor() - f.begun
    pi = np.zeros(1) if end.pi is None else end.pi
    energy = 0.5 * float(np.vdot(pi, pi)) + system.potential(system.shape(end.q))
    drift = abs(energy / problem.energy() - 1)
    return Found("done", problem.duration, energy=drift, residual=0.0, steps=end.steps, seconds=spent), end.q


def motion(
    make: Callable[[], Problem],
    method: str,
    seconds: float,
    step: Callable[[Problem], float] | None = None,
    exact: Callable[[Problem], Float] | None = None,
    compared: bool = True,
    note: Callable[[Problem, Solution], str] | None = None,
) -> Found:
    """A problem run to its end by a method; `step` is the step of our methods."""
    try:
        problem = posed(make)
    except ValueError as error:
        return Found("refused", 0.0, says=str(error))
    if method in PEERS:
        (found, q), sizes = peer(problem, method, seconds), None
    else:
        found, run = march(problem, method, step(problem) if step else None, seconds)
        q = None if run is None else np.array([getattr(run, row)[-1] for row in problem.system.rows])
        sizes = None if run is None else np.array([np.abs(getattr(run, row)).max() for row in problem.system.rows])
        if run is not None and note is not None:
            found = found._replace(note=note(problem, run))
    known = None if q is None else reference_of(make, exact)
    if q is None or known is None:
        return found
    at_the_end = distance(q, known) if compared or exact else np.nan
    return found._replace(off=distance(q, known, sizes), error=at_the_end)
