"""What is hard for a rolling rod, and what is expected of a run: the cases of `compare.stability`."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from importlib.util import find_spec
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from compare.lump import lump
from compare.peers import reduced
from compare.precision import reference
from continuum import breathing_ring, rolling_rod, untwisting_rod
from continuum.dispersion import frequency, growth, symbols
from continuum.exact import ring
from continuum.scenes import SCENES
from discs import Leapfrog, Problem, SimulationError, Solution, State, simulate
from discs.marching import March

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
    may_refuse : a refusal at the start will do as well.
    """

    kind: str
    words: str
    energy: float = LOOSE
    error: float = np.inf
    must: tuple[str, ...] = ()
    may_refuse: bool = False

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
        if verdict == "refused":
            return self.may_refuse
        return verdict == "holds" if method in self.must else verdict != "lost"


@dataclass(frozen=True)
class Case:
    """One hard case.

    name : what is hard. setting : at which size. what : why. expectation : see there. run : (method, seconds it may take) -> Found.
    """

    name: str
    setting: str
    what: str
    expectation: Expectation
    run: Callable[[str, float], Found]
    methods: tuple[str, ...] = (*OURS, *PEERS)

    @property
    def key(self) -> str:
        """Its name and setting."""
        return f"{self.name}, {self.setting}"


# Running


@lru_cache(2)
def _posed(make: Callable[[], Problem]) -> Problem:
    return make()


@lru_cache(2)
def _known(make: Callable[[], Problem], exact: Callable[[Problem], NDArray] | None) -> NDArray | None:
    """Positions at the end: exact ones, or by short steps of "gauss8" where these agree."""
    problem = _posed(make)
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
        problem = _posed(make)
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


# Problems, exact ends and notes; functions of arguments that can be sent to other processes


def twisted(n: int, ends: str = "springs", **keywords: Any) -> Problem:
    """The paper's twist, lumped."""
    return lump(untwisting_rod(**keywords), n, ends)


def lumped(scene: str, n: int, **keywords: Any) -> Problem:
    """A named scene, lumped."""
    return lump(SCENES[scene](**keywords), n)


def rough(n: int, duration: float) -> Problem:
    """A straight chain whose discs are turned and rolling at random (seed 1), each on its own."""
    problem, rng = twisted(n, duration=duration), np.random.default_rng(1)
    start = State(problem.chain.s, 0.0 * problem.chain.s, 0.5 * rng.standard_normal(n), 0.5 * rng.standard_normal(n))
    return replace(problem, initial=start)


def turned(problem: Problem, angle: float, move: tuple[float, float]) -> Problem:
    """The same motion started elsewhere, in another direction."""
    s, c, d = problem.initial, np.cos(angle), np.sin(angle)
    x, y = np.asarray(s.x), np.asarray(s.y)
    return replace(problem, initial=State(c * x - d * y + move[0], d * x + c * y + move[1], s.theta, s.omega))


def torsion_wave(problem: Problem) -> NDArray:
    """R = 0: nothing moves, and the twist, an eigenvector of the chain with half shares at its ends, is a standing wave of
    frequency^2 beta/alpha (4/k^2) sin^2(pi k/2 length)."""
    chain, start = problem.chain, problem.initial
    rate = 2 / chain.k * np.sin(np.pi * chain.k / (2 * chain.length))
    rate *= np.sqrt(np.max(chain.torsion_stiffness) / np.max(chain.spin_inertia))
    return np.array([start.x, start.y, np.asarray(start.theta) * np.cos(rate * problem.duration)])


def folding(problem: Problem, run: Solution) -> str:
    """The largest R |kappa| of the line, and when it first exceeds 1."""
    dx, dy = (np.gradient(v, problem.chain.k, axis=1) for v in (run.x, run.y))
    ddx, ddy = (np.diff(v, 2, axis=1) / problem.chain.k**2 for v in (run.x, run.y))
    cross = dx[:, 1:-1] * ddy - dy[:, 1:-1] * ddx
    bent = np.max(problem.chain.radius) * np.abs(cross) / np.hypot(dx, dy)[:, 1:-1] ** 3
    worst = bent.max(axis=1)
    when = f", above 1 from t = {run.t[np.argmax(worst > 1)]:.2g}" if (worst > 1).any() else ""
    return f"R|κ| up to {worst.max():.2g}{when}"


# Cases that are no plain motion


def rounding(make: Callable[[], Problem], dt: float, method: str, seconds: float) -> Found:
    """Two runs that differ by a rigid motion of the plane, so by rounding only: the error is their largest difference, in length
    or rad."""
    angle, move, problem = 0.7, (1 / 3, -0.2), _posed(make)
    step = None if method in EXPLICIT else dt
    found, run = march(problem, method, step, seconds / 2)
    if run is None:
        return found
    _, other = march(turned(problem, angle, move), method, step, seconds)
    if other is None:
        return found._replace(outcome="failed", says="the turned run did not end")
    c, d, x, y = np.cos(angle), np.sin(angle), other.x[-1] - move[0], other.y[-1] - move[1]
    back = np.array([c * x + d * y - run.x[-1], c * y - d * x - run.y[-1], other.theta[-1] - run.theta[-1]])
    return found._replace(error=float(np.abs(back).max()))


class Growth(NamedTuple):
    """Growth rates of waves on a rolling rod: wave numbers q (modes,), measured and by the dispersion relation of the discs."""

    q: NDArray
    measured: NDArray
    relation: NDArray


def rolling_waves(
    n: int, rolling: str, stiffness: float, duration: float, method: str, seconds: float, multiple: float = 0.5
) -> tuple[Found, Growth | None]:
    r"""All waves of a straight rod rolling at the rate omega, measured in one run.

    With perturbations xi, eta, vartheta of x, y, theta, each times e^{iqs + sigma t}, and c for q in slopes, the field law's linear
    equations are sigma xi = -i R omega c eta and sigma eta = R sigma vartheta + i R omega c xi, so

        xi = -i (R omega c/sigma) eta,   R vartheta = (1 - (R omega c/sigma)^2) eta:

    started so, a wave only grows. (Under the unit law eta = R vartheta, and it only oscillates, at the rate Omega.) Its amplitude
    is A^2 = |xi|^2 + |eta|^2 + R^2 |vartheta|^2 + R^2 |vartheta.|^2/Omega^2, which an oscillation keeps; the rate is the logarithm
    of the ratio of the largest A in the two halves of the run, over half its time. Waves of 1e-9 feel neither each other nor
    rounding.
    """
    scene = rolling_rod(rolling=rolling, duration=duration, bending_stiffness=stiffness, radius=0.7, density=1.3, spin_inertia=0.6)
    problem, rod = lump(scene, n), scene.rod
    k, modes = problem.chain.k, np.arange(1, (n + 1) // 2)
    q = 2 * np.pi * modes / rod.length
    push = rod.radius * symbols(q, k)[1] / growth(rod, q, 1.0, "field", k) if rolling == "field" else 0 * q
    vartheta = (1 - push**2) / rod.radius
    rate = growth(rod, q, 1.0, rolling, k)
    parts = np.array([-1j * push, np.ones_like(q), vartheta, rate * vartheta])
    parts *= 1e-9 / np.abs(parts).max(axis=0) * np.exp(2j * np.pi * np.random.default_rng(2).random(q.size))
    waves = (parts @ np.exp(1j * np.outer(q, problem.chain.s))).real
    start = problem.initial
    straight = np.array([start.x, 0 * problem.chain.s, 0 * problem.chain.s, start.omega])
    problem = replace(problem, initial=State(*(straight + waves)))
    found, run = march(problem, method, None if method in EXPLICIT else multiple * k, seconds)
    if run is None:
        return found, None
    turn = rod.radius / frequency(rod, q, k)
    rows = (run.x - problem.chain.s, run.y, rod.radius * run.theta)
    parts = np.array([np.fft.rfft(row, axis=1)[:, modes] for row in (*rows, run.omega)])
    parts[3] *= turn
    size = np.linalg.norm(parts, axis=0)
    half = FRAMES // 2
    measured = np.log(size[half:].max(axis=0) / size[: half + 1].max(axis=0)) / (duration / 2)
    error = float(np.abs(measured - rate).max())
    note = f"rates {measured.min():.3g} to {measured.max():.3g}, by the relation {rate.min():.3g} to {rate.max():.3g}"
    return found._replace(error=error, note=note), Growth(q, measured, rate)


def waves(n: int, rolling: str, stiffness: float, duration: float, method: str, seconds: float, multiple: float = 0.5) -> Found:
    """The same as a case: the error is the largest of the rates."""
    return rolling_waves(n, rolling, stiffness, duration, method, seconds, multiple)[0]


def parasite(n: int, duration: float, method: str, seconds: float) -> Found:
    r"""The paper's scheme at h = k^2/8 with its ends: the share of its half-step velocity v that rolling does not allow.

    Leapfrog asks A(q_n)(q_{n+1} - q_{n-1}) = 0 of central differences only; v = (q_{n+1} - q_n)/h has a part v - C C^T M v off the
    constraint, of the size of h for a smooth motion. It flips sign every step, and when it grows it takes energy from the motion.
    The indicator is the root of its kinetic energy over the total; the onset is where it exceeds 0.1.
    """
    problem = _posed(partial(twisted, n, "paper", duration=duration))
    k, system, begun = problem.chain.k, problem.system, perf_counter()
    h = k**2 / 8
    run = March(problem, Leapfrog(), h, True, True)
    share, onset, energy = 0.0, np.nan, []
    for t in np.linspace(0, duration, 401)[1:]:
        for _ in run.to(round(t / h)):
            pass
        z = run.memory
        c, v = system.frame(system.shape(z.hi, z.lo)), z.next / h
        off = v - system.forward(c, system.back(c, system.weights * v))
        share = max(share, float(np.sqrt(system.kinetic(off) / problem.energy())))
        onset = t if np.isnan(onset) and share > 0.1 else onset
        energy.append(run.observe(run.frame(0.0))["energy"])
        if perf_counter() - begun > seconds:
            return Found("cut off", t, h, steps=run.step, seconds=perf_counter() - begun)
    drift = float(np.abs(np.array(energy) / problem.energy() - 1).max())
    note = f"off-constraint share up to {share:.2g}" + ("" if np.isnan(onset) else f", above 0.1 from t = {onset:.3g}")
    return Found("done", duration, h, share, drift, steps=run.step, seconds=perf_counter() - begun, note=note)


def collapse(n: int, method: str, seconds: float) -> Found:
    """The ring of the unit law past its end: where it stops, and by how much it misses the exact time, in time."""
    duration = 1.5
    found = motion(partial(lumped, "breathing_ring", n, rolling="unit", duration=duration), method, seconds, compared=False)
    rod, omega = breathing_ring().rod, 0.4
    early, late = 0.0, duration
    while late - early > 1e-12:  # the ring exists before its end, and `ring` refuses to give it afterwards
        middle = 0.5 * (early + late)
        try:
            ring(rod, [middle], omega, "unit", n)
            early = middle
        except ValueError:
            late = middle
    miss = abs(found.t - early) if found.outcome == "stopped" else np.nan
    return found._replace(error=miss, note=f"the ring ends at t = {early:.6g}")


# The list


def cases(quick: bool = False) -> list[Case]:
    """All cases; the quick ones are small and few."""
    found: list[Case] = []

    def add(name: str, setting: str, what: str, expectation: Expectation, run: Callable[..., Found], **more: Any) -> None:
        found.append(Case(name, setting, what, expectation, run, **more))

    exactly = partial(Expectation, "exact", must=CONSERVING)
    bound = partial(Expectation, "bound", error=0.1)

    energy = exactly("midpoint and its compositions keep the energy to 1e-10 at every step; explicit methods stop", energy=1e-10)
    for n in (33, 129) if quick else (33, 129, 513, 1025):
        for multiple in (1, 8, 64) if quick else (1, 2, 4, 8, 16, 32, 64):
            end = (10.0 if quick else 40.0) * multiple * 4 / (n - 1)
            run = partial(motion, partial(twisted, n, duration=end), step=partial(_times_k, multiple), compared=False)
            what = "explicit methods need h < 0.6 k²; what is left of an implicit one's promise when h is far above k?"
            add("step above the explicit limit", f"N = {n}, h = {multiple} k", what, energy, run, methods=FIXED)

    for time, n in ((150, 33),) if quick else ((150, 33), (150, 129), (150, 513), (1500, 33), (1500, 129), (1500, 513)):
        words = "energy to 1e-10 where steps converge, and never lost silently"
        run = partial(motion, partial(twisted, n, duration=float(time)), compared=False)
        what = "small errors of every step add up, and the motion amplifies differences"
        add("long time", f"N = {n}, t = {time}", what, exactly(words, energy=1e-10, must=(*CONSERVING, *GAUSS)), run)

    for n, t in ((17, 45.0), (33, 45.0), (65, 10.0)) if quick else ((17, 60.0), (33, 60.0), (65, 20.0), (129, 10.0), (257, 5.0)):
        words = "the part of the velocity off the constraint stays below 0.1"
        what = "the two-step scheme rolls in the mean of two steps only; a mode that flips sign every step is free"
        add("parasitic mode", f"N = {n}, t = {t:g}", what, bound(words), partial(parasite, n, t), methods=("leapfrog",))

    for rolling in ("field", "unit"):
        for n in (33,) if quick else (33, 129):
            words = "growth of every wave, to the shortest, within 0.05 of the dispersion relation" + "; none" * (rolling == "unit")
            what = "under the field law all waves grow, up to ω√(β/K); under the unit law none does"
            run = partial(waves, n, rolling, 0.7, 4.0)
            add(
                f"rolling straight rod, {rolling} law",
                f"N = {n}",
                what,
                bound(words, error=0.05, must=(*CONSERVING, *GAUSS)),
                run,
                methods=FIXED,
            )
    for n in (17, 33) if quick else (17, 33, 65, 129, 257):
        words = "said to be ill posed at the start; until then growth as in the dispersion relation, proportional to N"
        run = partial(waves, n, "field", 0.0, 20 / n, multiple=0.1)
        what = "without bending stiffness the rates have no limit for short waves: no method can help"
        add(
            "limp rolling rod, field law",
            f"N = {n}",
            what,
            bound(words, error=0.02 * n, must=(*CONSERVING, *GAUSS)),
            run,
            methods=FIXED,
        )

    for n in (32,) if quick else (32, 128):
        words = "stops with time and disc before anything is undefined"
        what = "the ring of the unit law becomes a point, where r' = 0 has no direction"
        add("collapsing ring, unit law", f"N = {n}", what, Expectation("must refuse", words), partial(collapse, n))

    for turns in (4, 16):
        run = partial(motion, partial(twisted, 65 if quick else 129, twist=float(turns)), note=folding)
        what = "64 and 1024 times the paper's energy: fast, strongly folded"
        words = "energy to 1e-10; an error above 10 % not without a word"
        add("strong twist", f"{turns} turns, N = {65 if quick else 129}", what, bound(words, energy=1e-10, must=()), run)
    for n in (65,) if quick else (65, 513):
        what = "every wave the chain holds is excited, most far above what a step resolves"
        words = "energy to 1e-10"
        run = partial(motion, partial(rough, n, 4.5), compared=False)
        add("rough random roll", f"N = {n}", what, exactly(words, energy=1e-10), run)

    for setting, (scene, keywords) in EXTREMES.items():
        what = "parameters at their limits: no spin inertia, no torsion, hardly bent or hardly bending, tiny or huge discs"
        exact = torsion_wave if keywords.get("radius") == 0 else None
        words = "the exact standing wave, or a refusal" if exact else "energy to 1e-9; an error above 10 % not without a word"
        expectation = bound(words, energy=1e-9, may_refuse=exact is not None)
        run = partial(motion, partial(lumped, scene, 33, **keywords), exact=exact)
        add("extreme parameters", setting, what, expectation, run)

    few = "few discs", "a chain still makes sense as long as there is something to bend"
    add(few[0], "N = 3", few[1], exactly("energy to 1e-12", energy=1e-12, error=0.1), partial(motion, partial(twisted, 3)))
    two = partial(motion, partial(lumped, "steered_rod", 2), compared=True)
    add(few[0], "own headings, N = 2", few[1], exactly("energy to 1e-10", energy=1e-10, error=0.1), two, methods=(*STEERED, *PEERS))
    refused = Expectation("must refuse", "a ValueError that says how many discs are needed")
    add(few[0], "N = 2", few[1], refused, partial(motion, partial(twisted, 2)))
    add(few[0], "own headings, N = 1", few[1], refused, partial(motion, partial(lumped, "steered_rod", 1)))

    for n in (1025,) if quick else (1025, 4097, 16_385):
        what = "forces are fourth differences: plain doubles lose 1e-3 at N = 4097"
        words = "the same motion from elsewhere agrees to 1e-6"
        run = partial(rounding, partial(twisted, n, duration=0.5 if quick else 4.5), 0.01)
        add("rounding", f"N = {n}", what, exactly(words, energy=1e-9, error=1e-6), run, methods=FIXED)

    run = partial(motion, partial(twisted, 65, duration=9.0, twist=1.0), note=folding)
    words = "the equations go on: energy to 1e-10 (real discs would touch, see discs.contact)"
    add(
        "folded line",
        "N = 65, 1 turn, t = 9",
        "R|κ| exceeds 1: neighbouring discs would cut into each other",
        exactly(words, energy=1e-10),
        run,
    )
    return found


STEERED = tuple(method for method in OURS if method not in ("leapfrog", "auto"))
EXTREMES: dict[str, tuple[str, dict[str, Any]]] = {
    "α = 1e-9": ("untwisting_rod", {"spin_inertia": 1e-9}),
    "α = 0": ("untwisting_rod", {"spin_inertia": 0.0}),
    "β = 0, a ring": ("breathing_ring", {"torsion_stiffness": 0.0}),
    "K = 1e-6": ("untwisting_rod", {"bending_stiffness": 1e-6}),
    "K = 1e6": ("untwisting_rod", {"bending_stiffness": 1e6}),
    "R = 0": ("untwisting_rod", {"radius": 0.0}),
    "R = 100": ("untwisting_rod", {"radius": 100.0}),
}


def _times_k(multiple: float, problem: Problem) -> float:
    return multiple * problem.chain.k
