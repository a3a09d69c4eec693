"""Runs of the free rod: checks of the steps by their energy, and error estimates from a coarser run."""

from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from continuum.free_start import Given, through
from continuum.free_system import FreeRod, State
from continuum.rod import Rod
from discs import Chain, SimulationError
from discs.arrays import Float
from discs.chains.chain import FEWEST
from discs.running.doubt import ENERGY_DRIFT_WARNING

TURN = 0.08  # rad per step of the fastest link; it kept the energy to 1 % in all 43 random cases that had been inaccurate
BLOWN_UP = 10.0  # times the initial energy
SAID = 0.05  # relative; estimates above it give a warning
ROUNDING = 1e-9  # relative
APART = 8  # steps of the coarser run between compared frames

Start = tuple[Given, Given, Given, Given]  # r, v, theta, omega
Errors = dict[str, float]


class Run(NamedTuple):
    """A run at F frames.

    fields : x, y, theta, omega, x_rate, y_rate (F, n) and tension (F, n_links).
    energy : (F,).
    steps : number of whole steps taken.
    off : warning if the energy was not conserved; empty otherwise.
    """

    fields: dict[str, Float]
    energy: Float
    steps: int
    off: str


def nodes(rod: Rod, n: int, ring: bool) -> Chain:
    """The nodes of the free rod, as a chain."""
    names = ("length", "density", "spin_inertia", "torsion_stiffness", "bending_stiffness")
    return Chain(n=n, radius=0.0, ends="ring" if ring else "springs", **{name: getattr(rod, name) for name in names})


class Watch:
    """Checks that steps are short enough.

    The motion conserves three energies: that of the centre line about its centre of mass, that of the centre of mass, and that of
    theta. Steps conserve the last two to rounding, so the first one is checked. A link of fixed length can be solved for in two
    directions. A link that turns by more than a right angle in a step may have taken the wrong one.
    """

    def __init__(self, system: FreeRod, chain: Chain, z: State, h: float) -> None:
        self._system, self._h = system, h
        self._energy = self._worst = system.line_energy(z)
        self._when, self._off, self._rate = 0.0, 0.0, system.rate(z)
        if not np.isfinite(system.energy(z)):
            raise ValueError("r0, v0, theta0 and omega0 are too large: their energy is not a finite number")
        self._stiff, self._heavy = (0.5 * chain.length * float(np.max(c)) for c in (chain.bending_stiffness, chain.density))
        self._k = chain.k

    def _noise(self, z: State, step: int) -> float:
        """The energy due to rounding of positions (whose second differences bend) and velocities, in all steps so far."""
        r, v = (100 * np.finfo(float).eps * float(np.abs(values).max()) for values in (z.r, z.v))
        return step * (self._stiff * (r / self._k**2) ** 2 + self._heavy * v**2)

    def __call__(self, before: State, after: State, step: int, time: float) -> None:
        """Raise SimulationError if the step from one state to the next, at a time, is wrong."""
        turns = np.abs(self._system.turns(before.r, after.r))
        link = int(np.argmax(turns))
        if not turns[link] <= np.pi / 2:
            raise SimulationError(
                f"the step turns the link after node {link} by {turns[link]:.2g} rad, over a right angle; take a smaller dt than "
                f"{self._h:g}",
                step,
                time,
                link,
            )
        energy = self._system.line_energy(after)
        noise = self._noise(after, step)
        if not energy <= BLOWN_UP * self._energy + noise:
            fastest = int(np.argmax(np.hypot(*after.v)))
            raise SimulationError(
                f"the run blew up: the energy of the centre line is conserved, but rose from {self._energy:.3g} to {energy:.3g}; "
                f"take a smaller dt than {self._h:g}",
                step,
                time,
                fastest,
            )
        self._rate = max(self._rate, self._system.rate(after))
        off = abs(energy - self._energy) - noise
        if off > self._off:
            self._off, self._worst, self._when = off, energy, time

    def warning(self) -> str:
        """The warning about the energy; empty if it was conserved."""
        if self._off <= ENERGY_DRIFT_WARNING * self._energy:
            return ""
        enough = min(self._h / 2, self._h * np.sqrt(0.5 * ENERGY_DRIFT_WARNING * self._energy / self._off), TURN / self._rate)
        return (
            f"free_rod: the energy of the centre line is conserved, but at t = {self._when:g} it is {self._worst:.4g} and not "
            f"{self._energy:.4g}: dt = {self._h:g} is too long and the run may not be trusted; dt = {enough:.2g} should do"
        )


def run(chain: Chain, start: Start, h: float, times: Float, bar: tqdm) -> Run:
    """The motion at the given times, in steps h. ValueError or SimulationError for a step that cannot be taken."""
    r, v, theta, omega = (given.at(chain.s) if given.nodes.shape[1] != chain.n else given.nodes for given in start)
    system = FreeRod(chain, r)
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            z = State(r, system.admissible(r, v), theta[0], omega[0])
            watch = Watch(system, chain, z, h)
    except np.linalg.LinAlgError:
        raise ValueError("r0 or v0 is too large: numbers overflow") from None
    found, step = [], 0

    def moved(z: State, h: float, time: float) -> State:
        try:
            after = system.advance(z, h)
        except np.linalg.LinAlgError as error:
            fastest = int(np.argmax(np.hypot(*z.v)))
            raise SimulationError(f"{error}; take a smaller dt than {h:g}", step, step * h, fastest) from None
        watch(z, after, step + 1, time)
        return after

    with np.errstate(over="ignore", invalid="ignore"):
        for time in times:
            while (step + 1) * h <= time * (1 + 1e-12):
                z, step = moved(z, h, (step + 1) * h), step + 1
                bar.update()
            rest = time - step * h
            found.append(moved(z, rest, time) if rest > 1e-9 * h else z)
    r, v, theta, omega = (np.array([z[i] for z in found]) for i in range(4))
    tension = np.array([system.tension(z.r, z.v) for z in found])
    names = ("x", "y", "theta", "omega", "x_rate", "y_rate", "tension")
    fields = (r[:, 0], r[:, 1], theta, omega, v[:, 0], v[:, 1], tension)
    return Run(dict(zip(names, fields, strict=True)), np.array([system.energy(z) for z in found]), step, watch.warning())


def compare(rod: Rod, chain: Chain, start: Start, h: float, times: Float, fine: Run, bar: tqdm) -> tuple[Errors | None, str]:
    """Estimated errors of a run by name, and a warning (empty if there is none).

    Both orders are two, so a run with half the nodes and twice the step has four times the error, and the error of the finer run is
    a third of the difference |u_{2k,2h} - u_{k,h}|. For safety half of the difference is taken. If the difference is a tenth of the
    quantity or more, the orders are not reached, and all of the difference is taken; below a tenth the factor is interpolated. The
    estimate is the largest over the coarser nodes and over the frames that are steps of the coarser run, or that are at least
    `APART` of its steps after the last frame compared. A run of less than two steps is compared with one of half the step; the part
    of the difference due to time is then 3/4 of the error.
    """
    ring = chain.ends == "ring"
    half = chain.n // 2 if ring else (chain.n + 1) // 2
    if half < FEWEST[chain.ends]:
        return None, f"free_rod: no estimate of the error: half of n = {chain.n} nodes are too few for a run; take more"
    coarse = nodes(rod, half, ring)
    short = bool(times[-1] < 2 * h * (1 - 1e-12))
    step = min(h, times[-1] or h) / 2 if short else 2 * h
    at: list[int] = []
    last = -np.inf
    for f, time in enumerate(times):
        if abs(time - step * round(time / step)) <= 1e-9 * step or time - last >= APART * step or f == times.size - 1:
            at, last = [*at, f], time
    try:
        other = run(coarse, start, step, times[at], bar)
    except SimulationError as error:
        return (
            None,
            f"free_rod: no estimate of the error: the run on {half} nodes with dt = {step:g} stopped ({error}); take a smaller dt",
        )
    errors, bad = {}, []
    scales, rounding = _scales(rod, chain, fine.fields)
    for name, values in other.fields.items():
        half_link = 0.5 * (name == "tension")
        places = coarse.s[: values.shape[1]] + half_link * coarse.k
        finer = through(chain, fine.fields[name][at], offset=half_link * chain.k)(places)
        apart, scale = float(np.abs(values - finer).max()), scales[name]
        unresolved = min(1.0, apart / max(0.1 * scale, 1e-300))
        errors[name] = apart * (4 / 3 if short else (1 + unresolved) / 2)
        if errors[name] > SAID * scale + rounding[name]:
            bad.append(f"{name} {errors[name]:.2g}" + (f" ({100 * errors[name] / scale:.0f} %)" if scale else ""))
    if not bad:
        return errors, ""
    advice = f"take more nodes and a smaller dt, to begin with n = {2 * chain.n} and dt = {h / 2:g}"
    return errors, f"free_rod: estimated errors: {', '.join(bad)}; {advice}"


def _scales(rod: Rod, chain: Chain, fields: dict[str, Float]) -> tuple[dict[str, float], dict[str, float]]:
    """The scales that errors are compared with, by name, and the errors that rounding may cause.

    The scales are the length, the largest speed relative to the mean, the ranges of theta and of omega along the rod, and the
    largest tension.
    """
    large = {name: float(np.abs(values).max()) for name, values in fields.items()}
    place, speed = max(large["x"], large["y"]), max(large["x_rate"], large["y_rate"])
    about = float(np.hypot(*(fields[v] - fields[v].mean(axis=1, keepdims=True) for v in ("x_rate", "y_rate"))).max())
    scales = dict.fromkeys(("x", "y"), rod.length) | dict.fromkeys(("x_rate", "y_rate"), about) | {"tension": large["tension"]}
    scales |= {name: float(np.ptp(fields[name], axis=1).max()) for name in ("theta", "omega")}
    p = rod.uniform("free_rod")
    swings = speed + place * np.sqrt(p.bending_stiffness / p.density) / rod.length**2
    twists = large["omega"] + large["theta"] * np.sqrt(p.torsion_stiffness / p.spin_inertia) / rod.length
    pulls = p.bending_stiffness * (1 / rod.length**2 + 1e-5 * place / chain.k**3)  # from third differences
    rounding = {
        "x": place,
        "y": place,
        "theta": large["theta"],
        "omega": twists,
        "x_rate": swings,
        "y_rate": swings,
        "tension": pulls,
    }
    return scales, {name: ROUNDING * value for name, value in rounding.items()}
