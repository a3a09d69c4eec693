"""Motions of a rod on n functions in Gauss steps of variable length.

**Length of steps.** The collocation polynomial of a step with s stages has degree s in time. The error of the step is taken to be
the size of its highest Legendre coefficient at the nodes, in x, y and theta. The length is chosen so that the error is the
tolerance of a step; `continuum.spectral` measures the resulting error of the motion. This bounds the error of the polynomial, not
only that of its end, which is more accurate if the motion is smooth; waves that a step does not resolve spoil its end, too. So
states within a step are those of the polynomial (`collocation.within`) and need no extra steps. Gauss steps conserve the energy
from end to end, but not within. If a step does not converge, or takes many sweeps, the next one is shorter.

**Loads.** Steps end where a signal jumps or has a corner, and are not longer than the pieces on which it is smooth
(`continuum.timing`), so none jumps over a pulse.

**Stiff dampers.** Gauss steps do not damp what is stiff: a rest of short waves, however small, stays in pi. Viscosity of bending
turns it into a large omega., and into a force that grows like n^4. Stages have no such rest, as they solve the stiff equations
themselves. So omega and omega. are taken from the polynomial through omega at the stages of a short step around the time asked for
(`collocation.rolling`); that of a whole step would be less accurate by its length to the power s - 1.

**End of a motion.** Long steps must not jump over the end of a motion: for the unit law a heading is lost where z = r' vanishes, at
a point or, when a ring collapses, everywhere. z is checked at each node, and where it is nearest to zero on the straight line
from a node to the next. If Re(conj(z_n) z_{n+1}) < |z_n|^2/2 at one of these, the step is repeated with half its length. So the
least |r'| at most halves in a step. If it is below `LOST_HEADING` before such a step, the heading is lost. No other motion ends:
if steps become too short for another reason, the motion is too fast for them.
"""

from collections.abc import Iterator

import numpy as np
from numpy.polynomial import legendre

from continuum import collocation, driven_ends
from continuum.end_identities import EndIdentities
from continuum.galerkin import SpectralRod
from continuum.gauss import gauss
from continuum.modes import Modes, Pencil
from discs import SimulationError
from discs.arrays import Complex, Float
from discs.kernels.background import Kernels
from discs.kernels.limits import LOST_HEADING
from discs.skew import Phase

STAGES = ((7e-5, 4), (1.4e-6, 6), (1.4e-8, 8), (0.0, 12))  # smallest tolerance of the fields for each number of stages
SWEEPS = 40
FEW_SWEEPS = 18  # after a step with more sweeps the next one is shorter
MODES = 0.4  # cost of new modes: this times functions over stages, in sweeps
ACCEPTED = 2.0  # largest error of a step, over the tolerance
SHORTEST = 1e-9  # shortest step, relative to the duration or to the time in which waves cross the rod
LONGEST = 1e3  # longest first step, relative to that time
MOST_STEPS = 2**14
FORETOLD = 256  # the number of steps still needed is predicted after every so many steps, from the last half of them
SHORT = 1 / 8  # of a step: the short step that settles omega
LONGER = 1.5  # ratio of predicted to remaining steps above which the run ends
TOGETHER = 256  # states evaluated at once


def stages_for(tol: float) -> int:
    """The number of stages for a tolerance of the fields. Tolerances of steps are comparable for equal numbers of stages only."""
    return next(number for least, number in STAGES if tol >= least)


def rounding(rod: SpectralRod, h: float) -> float:
    """What sweeps of a step of length h may leave by rounding, in units of the scale of the rod.

    The forces of the shortest waves, of about the wave number n/length, are rounded, and that moves the rod by eps n^4
    (h/crossing)^2. Sweeps were seen to leave 0.008 to 0.1 of it (71 to 259 functions, h = 0.02 and 0.08).
    """
    return float(0.1 * np.finfo(float).eps * rod.n**4 * (h / rod.crossing) ** 2)


def sweeps(tolerance: float) -> float:
    """The tolerance of sweeps for a tolerance of steps, in units of the scale of the rod."""
    return min(1e-8, 1e-2 * tolerance)


class TooFast(SimulationError):
    """Steps became too short or too many."""


class Steps:
    """A motion of a rod from its start, step by step.

    Parameters
    ----------
    duration : time at which the last step ends.
    tolerance, stages : of a step.
    first : length of the first step that is tried.
    compiled : whether to use `continuum.kernels` or the plain twin; asked before each step.
    watch : has rates at the stages of steps, which are integrated.
    settled : whether to find `rolling`, which takes a further step for each state.

    Attributes
    ----------
    lengths : lengths of the steps taken.
    integrals : those of `watch` since the start at the states that `at` gave, in groups (k, count); without it none.
    balance, reaction : work and dissipation since the start at the states that `at` gave, and torques of motors, in groups (k, 2)
        and (k, motors); without loads none.
    rolling : omega and omega. at these states without the rest of stiff waves, in groups (2, k, n), if `settled`; None at the
        start.
    """

    def __init__(
        self,
        rod: SpectralRod,
        duration: float,
        tolerance: float,
        stages: int,
        first: float,
        compiled: bool | Kernels = True,
        watch: EndIdentities | None = None,
        settled: bool = False,
    ) -> None:
        self.rod, self._duration, self._tolerance, self._compiled = rod, duration, tolerance, compiled
        self._stages = stages
        self._sweeps = sweeps(tolerance)
        nodes, _ = gauss(self._stages)
        self._series = np.linalg.inv(legendre.legvander(nodes, self._stages - 1))[-2:]  # rates of stages to last coefficients
        self._next = min(first, LONGEST * rod.crossing)
        self._modes: Modes | Pencil | None = None
        self._usual, self._excess = 0, 0  # sweeps of the step that computed the modes; additional sweeps of the steps since
        self.lengths: list[float] = []
        self.balance: list[Float] = []
        self.reaction: list[Float] = []
        self.integrals: list[Float] = []
        self.rolling: list[Float | None] = []
        self._watch, self._settles = watch, settled
        self._timing = rod.loads.timing if rod.loads else None

    def at(self, times: Float) -> Iterator[Phase]:
        """The states at times (F,), increasing, in groups: arrays have one more leading axis."""
        t, z, spent, loads = 0.0, self.rod.start, np.zeros(2), self.rod.loads
        torque = driven_ends.reaction(self.rod, t, z)[None] if loads else np.empty((1, 0))
        watch, total, rates = self._watch, np.zeros(self._watch.count if self._watch else 0), np.empty(0)
        last: tuple[float, float, Phase, Float, Float] | None = None
        while times.size:
            if times[0] <= t:
                if loads:
                    self.balance.append(spent[None])
                    self.reaction.append(torque)
                if watch:
                    self.integrals.append(total[None])
                if self._settles:
                    self.rolling.append(None if last is None else self._settled(*last, np.ones(1)))
                yield Phase(z.hi[None], z.lo[None], z.pi[None])
                times = times[1:]
                continue
            before, start = t, z
            t, z, v, p = self._advance(t, z)
            last = before, t - before, start, v, p
            inside = times[times < t]
            power = None
            if watch:
                rates = watch.rates(t - before, start, v)
            if loads:
                power, torques = driven_ends.power(self.rod, before, t - before, start, v, p)
                torque = collocation.between(torques, np.ones(1))
            for some in np.split(inside, range(TOGETHER, inside.size, TOGETHER)):
                if some.size:
                    parts = (some - before) / (t - before)
                    if power is not None:
                        self.balance.append(spent + collocation.spent(t - before, power, parts))
                        self.reaction.append(collocation.between(torques, parts))
                    if watch:
                        self.integrals.append(total + collocation.spent(t - before, rates, parts))
                    if self._settles:
                        self.rolling.append(self._settled(*last, parts))
                    yield collocation.within(start, t - before, v, p, parts)
            if watch:
                total = total + collocation.spent(t - before, rates, np.ones(1))[0]
            if power is not None:
                z, kick = driven_ends.hold(self.rod, t, z)
                spent = spent + collocation.spent(t - before, power, np.ones(1))[0] + (kick, 0.0)
            times = times[inside.size :]

    def _settled(self, t: float, h: float, z: Phase, v: Float, p: Float, parts: Float) -> Float:
        """omega and omega. at fractions `parts` (F,) of a step from z at t, (2, F, n), from a short step around each."""
        assert self._modes is not None
        found = []
        for part in parts:
            begin = max(part - SHORT, 0.0)
            first = Phase(*(values[0] for values in collocation.within(z, h, v, p, np.array([begin]))))
            _, rates, _, taken = self._sweep(t + begin * h, first, SHORT * h)
            short = (SHORT * h, rates, (part - begin) / SHORT) if taken else (h, v, part)
            found.append(collocation.rolling(*short))
        return np.stack(found, axis=1)

    def _step(self, t: float, z: Phase, h: float) -> tuple[Phase, Float, Float, int]:
        """As `collocation.step`. The modes of an earlier step are used as long as this saves time."""
        fresh = self._modes is None or self._excess > MODES * self.rod.n / self._stages
        while True:
            if fresh:
                c = self.rod.basis(z.hi + z.lo)
                middle = z.hi + z.lo + 0.5 * h * self.rod.forward(c, z.pi)
                self._modes = self.rod.modes(self.rod.basis(middle), t + 0.5 * h, middle)
            after, v, p, taken = self._sweep(t, z, h)
            if fresh:
                self._usual, self._excess = taken, 0
            else:
                self._excess += max(taken - self._usual, 0)
            if taken or fresh:
                return after, v, p, taken
            fresh = True

    def _sweep(self, t: float, z: Phase, h: float) -> tuple[Phase, Float, Float, int]:
        assert self._modes is not None
        tolerance = max(self._sweeps, min(rounding(self.rod, h), 0.1 * self._tolerance))
        return collocation.step(self.rod, z, self._modes, t, h, self._stages, SWEEPS, tolerance, bool(self._compiled))

    def _advance(self, t: float, z: Phase) -> tuple[float, Phase, Float, Float]:
        """One converged step from z at t within the tolerance, with the rates and momenta of its stages."""
        slopes = self._slopes(z)
        while True:
            end = self._duration if self._timing is None else self._timing.stop(t)
            left = end - t
            if self._timing is not None:
                self._next = min(self._next, self._timing.longest(t))
            h = left if self._next >= 0.9999 * left else min(self._next, left / 2)
            self._check_number(t)
            if h < SHORTEST * min(self._duration, self.rod.crossing):
                raise self._too_fast(t)
            after, v, p, taken = self._step(t, z, h)
            if not taken or self._turned(slopes, after):
                self._check_heading(slopes, t)
                self._next = h / 2
                continue
            error = self._error(v, h)
            growth = 0.9 * (self._tolerance / max(error, 1e-300)) ** (2 / self._stages)
            if not error <= ACCEPTED * self._tolerance:
                self._next = h * max(0.3, growth)
                continue
            self._next = h * min(1.8, max(0.5, growth)) * min(max(FEW_SWEEPS / taken, 0.6), 1.0)
            self.lengths.append(h)
            return (end if h == left else t + h), after, v, p

    def _turned(self, slopes: Complex, after: Phase) -> bool:
        """Whether a heading may have been lost within a step, given the slopes (n,) before it."""
        if not self.rod.law.vanishing:
            return False
        part = _nearest(slopes)
        now, then = (z[:-1] + part * np.diff(z) for z in (slopes, self._slopes(after)))
        return bool(((now.conj() * then).real < 0.5 * np.abs(now) ** 2).any())

    def _slopes(self, z: Phase) -> Complex:
        """r' at the nodes; for a closed rod the first is repeated at the end."""
        slopes = self.rod.slopes(z)
        return np.append(slopes, slopes[0]) if self.rod.closed else slopes

    def _error(self, v: Float, h: float) -> float:
        """Size of the highest coefficient in time of x, y, theta; of the last but one if that is far larger."""
        degrees = 2 * np.array([self._stages - 2, self._stages - 1]) + 1
        q = h / 2 * np.tensordot(self._series, v, 1) / degrees[:, None, None]
        sizes = np.maximum(np.abs(q[:, :2] @ self.rod.line.T).max(axis=(1, 2)), np.abs(q[:, 2]).max(axis=1))
        return float(max(sizes[1], 0.03 * sizes[0]))

    def _check_heading(self, slopes: Complex, t: float) -> None:
        least = np.abs(slopes[:-1] + _nearest(slopes) * np.diff(slopes))
        node = int(np.argmin(least))
        if self.rod.law.vanishing and not least[node] > LOST_HEADING:
            message = f"the rod lost its heading: r' = 0, and rolling={self.rod.law.name!r} has no direction there"
            raise SimulationError(message, len(self.lengths), t, node)

    def _check_number(self, t: float) -> None:
        """Raise ValueError if there are too many steps, or there will be."""
        taken, last = len(self.lengths), self.lengths[-FORETOLD // 2 :]
        enough = MOST_STEPS - taken
        foretold = taken and taken % FORETOLD == 0
        if enough > 0 and not (foretold and self._duration - t > LONGER * enough * np.mean(last)):
            return
        needed = taken + (self._duration - t) / np.mean(last)
        raise ValueError(
            f"tol is not reached in {MOST_STEPS} time steps: at t = {t:.3g} they are {np.mean(last):.2g} long, so {needed:.2g} "
            "would be needed; the motion is too long for this tol, or too sensitive or too fast: ask for a larger tol or a "
            f"shorter duration, well below {t + max(enough, 0) * np.mean(last):.2g}"
        )

    def _too_fast(self, t: float) -> TooFast:
        return TooFast("steps do not converge, however short: the motion is too fast for them", len(self.lengths), t, 0)


def _nearest(slopes: Complex) -> Float:
    """Where r' is nearest to zero on the straight line from each node to the next, in [0, 1], (n - 1,)."""
    move = np.diff(slopes)
    part: Float = -(slopes[:-1].conj() * move).real / np.maximum(np.abs(move) ** 2, 1e-300)
    return np.clip(part, 0.0, 1.0)
