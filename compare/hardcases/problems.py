"""The problems of hard cases, their exact solutions, and quantities measured besides energy and positions."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from time import thread_time as processor
from typing import Any

import numpy as np

from compare.hardcases.runs import EXPLICIT, FRAMES, PEERS, Found, march, motion, peer, posed, reference_of
from compare.lump import lump
from compare.reference import distance
from compare.results import Growth
from continuum import breathing_ring, rolling_rod, untwisting_rod
from continuum.dispersion import frequency, growth, symbols
from continuum.exact import ring, standing_wave
from continuum.scenes import SCENES
from discs import Leapfrog, Problem, Solution, State, simulate
from discs.arrays import Float
from discs.loads import Damping, OnRod
from discs.running.doubt import lost_energy
from discs.running.plan import Plan
from discs.running.time_loop import March

# Functions of arguments that can be sent to other processes


def twisted(n: int, ends: str = "springs", **keywords: Any) -> Problem:
    """The paper's twist, lumped."""
    return lump(untwisting_rod(**keywords), n, ends)


def lumped(scene: str, n: int, **keywords: Any) -> Problem:
    """A named scene, lumped."""
    return lump(SCENES[scene](**keywords), n)


def loaded(n: int, *loads: OnRod, ends: str = "springs", **keywords: Any) -> Problem:
    """The paper's twist with loads, lumped."""
    return lump(replace(untwisting_rod(**keywords), loads=loads), n, ends)


def every_other(s: Float, k: float) -> Float:
    """1 and -1 in turns at the middles s of links of length k."""
    return np.cos(np.pi * (s / k - 0.5))


def rough(n: int, duration: float) -> Problem:
    """A straight chain whose discs have independent random roll angles and rates (seed 1)."""
    problem, rng = twisted(n, duration=duration), np.random.default_rng(1)
    start = State(problem.chain.s, 0.0 * problem.chain.s, 0.5 * rng.standard_normal(n), 0.5 * rng.standard_normal(n))
    return replace(problem, initial=start)


def restless(n: int, viscosity: float) -> Problem:
    """`rough` with viscous torsion and rolling resistance."""
    return replace(rough(n, 4.5), loads=(Damping(rolling=0.3, torsion=viscosity),))


def turned(problem: Problem, angle: float, move: tuple[float, float]) -> Problem:
    """The same problem, turned and moved in the plane."""
    s, c, d = problem.initial, np.cos(angle), np.sin(angle)
    x, y = np.asarray(s.x), np.asarray(s.y)
    return replace(problem, initial=State(c * x - d * y + move[0], d * x + c * y + move[1], s.theta, s.omega))


def torsion_wave(problem: Problem) -> Float:
    """R = 0: nothing moves, and the paper's twist is a standing wave of the discs."""
    s, start = problem.chain.s, problem.initial
    wave = standing_wave(untwisting_rod(radius=0.0).rod, s, [problem.duration], 1, float(np.asarray(start.theta)[0]), n=s.size)
    return np.array([wave.x[0], wave.y[0], wave.theta[0]])


def folding(problem: Problem, run: Solution) -> str:
    """The largest R |kappa| of the line, and the time when it first exceeds 1."""
    dx, dy = (np.gradient(v, problem.chain.k, axis=1) for v in (run.x, run.y))
    ddx, ddy = (np.diff(v, 2, axis=1) / problem.chain.k**2 for v in (run.x, run.y))
    cross = dx[:, 1:-1] * ddy - dy[:, 1:-1] * ddx
    bent = np.max(problem.chain.radius) * np.abs(cross) / np.hypot(dx, dy)[:, 1:-1] ** 3
    worst = bent.max(axis=1)
    when = f", above 1 from t = {run.t[np.argmax(worst > 1)]:.2g}" if (worst > 1).any() else ""
    return f"R|κ| up to {worst.max():.2g}{when}"


# Cases with a measurement of their own


def decay(n: int, viscosity: float, dt: float, method: str, seconds: float) -> Found:
    """Random rates under viscous torsion and resistance. The error is that of omega at the end, of the largest at the start."""
    problem = posed(partial(restless, n, viscosity))
    found, run = march(problem, method, dt, seconds)
    if run is None:
        return found
    exact = simulate(problem, "gauss8", problem.duration / 4000, frames=1, progress=False)
    return found._replace(error=float(np.abs(run.omega[-1] - exact.omega[-1]).max() / np.abs(problem.initial.omega).max()))


def rounding(make: Callable[[], Problem], dt: float, method: str, seconds: float) -> Found:
    """Two runs that differ by a rigid motion of the plane, so by rounding only: the error is their largest difference, in length
    or rad. (For peers it shows their tolerance.)"""
    angle, move, problem = 0.7, (1 / 3, -0.2), posed(make)

    def end(problem: Problem, seconds: float) -> tuple[Found, Float | None]:
        if method in PEERS:
            return peer(problem, method, seconds)
        found, run = march(problem, method, None if method in EXPLICIT else dt, seconds)
        return found, None if run is None else np.array([run.x[-1], run.y[-1], run.theta[-1]])

    found, q = end(problem, seconds / 2)
    if q is None:
        return found
    again, other = end(turned(problem, angle, move), seconds)
    if other is None:
        return again._replace(says=f"started elsewhere: {again.says}")
    c, d, x, y = np.cos(angle), np.sin(angle), other[0] - move[0], other[1] - move[1]
    back = np.array([c * x + d * y, c * y - d * x, other[2]])
    known = reference_of(make)
    off = np.nan if known is None else distance(q, known)
    return found._replace(error=float(np.abs(back - q).max()), off=off)


def rolling_waves(
    n: int, rolling: str, stiffness: float, duration: float, method: str, seconds: float, multiple: float = 0.5
) -> tuple[Found, Growth | None]:
    r"""All waves of a straight rod rolling at the rate omega, measured in one run.

    With perturbations xi, eta, vartheta of x, y, theta, each times e^{iqs + sigma t}, and c for q in slopes, the field law's linear
    equations are sigma xi = -i R omega c eta and sigma eta = R sigma vartheta + i R omega c xi, so

        xi = -i (R omega c/sigma) eta,   R vartheta = (1 - (R omega c/sigma)^2) eta:

    a wave with this start only grows. (Under the unit law eta = R vartheta, and it only oscillates, at the rate Omega.) Its
    amplitude is A^2 = |xi|^2 + |eta|^2 + R^2 |vartheta|^2 + 2 R^2 |vartheta.|^2/Omega^2, which an oscillation conserves; the rate
    is the logarithm of the ratio of the largest A in the two halves of the run, over half its time. Waves of size 1e-9 are affected
    neither by each other nor by rounding.
    """
    scene = rolling_rod(rolling=rolling, duration=duration, bending_stiffness=stiffness, radius=0.7, density=1.3, spin_inertia=0.6)
    problem, rod, radius = lump(scene, n), scene.rod, scene.rod.uniform("waves").radius
    k, modes = problem.chain.k, np.arange(1, (n + 1) // 2)
    q = np.asarray(2 * np.pi * modes / rod.length, dtype=float)
    push = radius * symbols(q, k)[1] / growth(rod, q, 1.0, "field", k) if rolling == "field" else 0 * q
    vartheta = (1 - push**2) / radius
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
    turn = 2**0.5 * radius / frequency(rod, q, k)
    rows = (run.x - problem.chain.s, run.y, radius * run.theta)
    parts = np.array([np.fft.rfft(row, axis=1)[:, modes] for row in (*rows, run.omega)])
    parts[3] *= turn
    size = np.linalg.norm(parts, axis=0)
    half = FRAMES // 2
    measured = np.log(size[half:].max(axis=0) / size[: half + 1].max(axis=0)) / (duration / 2)
    error = float(np.abs(measured - rate).max())
    note = f"rates {measured.min():.3g} to {measured.max():.3g}, by the relation {rate.min():.3g} to {rate.max():.3g}"
    rolled = straight[3] * duration  # the waves stay far below what counts as off
    off = distance(np.array([run.x[-1], run.y[-1], run.theta[-1]]), np.array([straight[0], rod.radius * rolled, rolled]))
    return found._replace(error=error, note=note, off=off), Growth(q, np.asarray(measured, dtype=float), rate)


def waves(n: int, rolling: str, stiffness: float, duration: float, method: str, seconds: float, multiple: float = 0.5) -> Found:
    """The same as a case: the error is the largest error of a rate."""
    return rolling_waves(n, rolling, stiffness, duration, method, seconds, multiple)[0]


def parasite(n: int, duration: float, method: str, seconds: float) -> Found:
    r"""The paper's scheme at h = k^2/8 with its ends: the part of its half-step velocity v that violates rolling.

    Leapfrog requires A(q_n)(q_{n+1} - q_{n-1}) = 0 of central differences only; v = (q_{n+1} - q_n)/h has a part v - C C^T M v off
    the constraint, of the size of h for a smooth motion. It flips sign every step, and when it grows it takes energy from the
    motion. The indicator is the root of its kinetic energy over the total; the onset is where it exceeds 0.1.
    """
    problem = posed(partial(twisted, n, "paper", duration=duration))
    k, system, begun = problem.chain.k, problem.system, processor()
    h = k**2 / 8
    run = March(Plan(problem, Leapfrog()), h)
    share, onset, energy, times = 0.0, np.nan, [], np.linspace(0, duration, 401)[1:]
    for t in times:
        while run.step < round(t / h):
            run.on(round(t / h))
        z = run.memory
        c, v = system.basis(system.shape(z.hi, z.lo)), z.next / h
        off = v - system.forward(c, system.back(c, system.weights * v))
        share = max(share, float(np.sqrt(system.kinetic(off) / problem.energy())))
        onset = t if np.isnan(onset) and share > 0.1 else onset
        energy.append(run.observe(t, run.frame(0.0))["energy"])
        if processor() - begun > seconds:
            return Found("cut off", t, h, steps=run.step, seconds=processor() - begun)
    drift = float(np.abs(np.array(energy) / problem.energy() - 1).max())
    note = f"off-constraint share up to {share:.2g}" + ("" if np.isnan(onset) else f", above 0.1 from t = {onset:.3g}")
    says = lost_energy(problem, method, times, np.array(energy))
    return Found("done", duration, h, share, drift, steps=run.step, seconds=processor() - begun, says=says, note=note)


def collapse(n: int, method: str, seconds: float) -> Found:
    """The ring of the unit law beyond its collapse: the time at which the run stops; its error is that of this time."""
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
