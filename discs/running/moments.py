"""Runs step by step: the moments after each step, and the times at which events happen within a step.

**The time of an event.** An event is a zero of a function g of the moment. It is found where g changes its sign from one step to
the next, so two zeros within one step are missed. Within that step the state a time tau after the last one is computed by a step of
length tau, as frames between steps are. Its error is that of one step, h^{p+1} for a method of order p, so g(tau) is known as well
as the run itself is, and its zero, found by Brent's method to rounding, has the order p of the method.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy

from discs import checks
from discs.arrays import Float
from discs.integrators import Integrator, Work, find
from discs.integrators.work import Frame
from discs.kernels.background import usual
from discs.problem import Problem, State
from discs.running.engine import WAITING, plain_because, refuse_loads
from discs.running.frames import ROUNDING, asked
from discs.running.plan import Plan
from discs.running.ready import kernels
from discs.running.suggest import suggest_dt
from discs.running.time_loop import March
from discs.running.whole_steps import check_steps, steps_before
from discs.solution import Occurrence
from discs.warn import kept, warn

Event = Callable[["Moment"], float]


class Moment:
    """The discs at a time of a run.

    Attributes
    ----------
    t : time.
    x, y, theta, omega, x_rate, y_rate : (n,), as in `Solution`. phi, phi_rate : (n,), own headings; None of other discs.
    energy : kinetic and potential energy.
    work, dissipated : work of loads that are not part of the energy, and energy that dampers took, both since the start.
    slope : (2, n), headings r' of the centre line, no unit, or (cos phi, sin phi).
    contact_force : (2, n), force of the ground on each disc.
    problem : of the run.
    state : a `State` from which another run can start.
    """

    def __init__(self, march: March, frame: Frame, t: float) -> None:
        """The moment t of the run `march`, whose positions and rates are those of `frame`."""
        self._march, self._frame, self.t, self.problem = march, frame, t, march.problem
        self.x_rate, self.y_rate = frame.rate[0], frame.rate[1]
        if (load := march.system.load) is not None and not load.conservative:
            self._seen  # noqa: B018  # now, as work and dissipation are sums over the steps up to now

    @cached_property
    def _seen(self) -> dict[str, Any]:
        return self._march.observe(self.t, self._frame)

    @property
    def x(self) -> Float:
        return np.asarray(self._seen["x"])

    @property
    def y(self) -> Float:
        return np.asarray(self._seen["y"])

    @property
    def theta(self) -> Float:
        return np.asarray(self._seen["theta"])

    @property
    def omega(self) -> Float:
        return np.asarray(self._seen["omega"])

    @property
    def phi(self) -> Float | None:
        return self._seen.get("phi")

    @property
    def phi_rate(self) -> Float | None:
        return self._seen.get("phi_rate")

    @property
    def energy(self) -> float:
        return float(self._seen["energy"])

    @property
    def work(self) -> float:
        return float(self._seen.get("balance", (0.0, 0.0))[0])

    @property
    def dissipated(self) -> float:
        return float(self._seen.get("balance", (0.0, 0.0))[1])

    @property
    def slope(self) -> Float:
        system = self._march.system
        return np.asarray(system.slope(system.shape(self._frame.hi, self._frame.lo)))

    @cached_property
    def contact_force(self) -> Float:
        return np.asarray(asked(self._march, self._frame, self.t, ("contact_force",), self._seen)["contact_force"])

    @property
    def state(self) -> State:
        own = {} if self.phi is None or self.phi_rate is None else {"phi": self.phi, "phi_rate": self.phi_rate}
        return State(self.x, self.y, self.theta, self.omega, **own)

    def __repr__(self) -> str:
        return f"Moment(t = {self.t:g}, {self.x.size} discs)"


class _Step(NamedTuple):
    """A step: the moments at its ends, its length, and the moment a time tau after its start, 0 < tau < length."""

    start: Moment
    end: Moment
    length: float
    within: Callable[[float], Moment]


def by_steps(problem: Problem, integrator: Integrator, dt: float | None, engine: str | None, end: float) -> Iterator[_Step]:
    """The steps of a run to a time `end`; the last one is shorter if `end` lies between two steps.

    ValueError as of `steps`.
    """
    if integrator.adaptive:
        raise ValueError(
            f"a run by steps, or with events, needs a method with fixed steps, as 'midpoint' or 'gauss6'; {integrator.name!r} "
            "chooses its own"
        )
    refuse_loads(problem, integrator)
    because = plain_because(problem, integrator, engine := usual() if engine is None else engine, ())
    h = suggest_dt(problem, integrator) if dt is None else checks.number("dt", dt, positive=True)
    if h > (1 + ROUNDING) * problem.duration:
        raise ValueError(f"dt must be at most the duration, {problem.duration:g}; got {h:g}")
    if not because and not kernels(engine, problem, integrator, h, True, True):
        because = WAITING
    check_steps(end, h)
    march = March(Plan(problem, integrator, because), h)
    steps, rest = steps_before(end, h)
    last = Moment(march, march.frame(0.0), 0.0)
    while march.step < steps or rest:
        memory, t, whole = march.memory, march.step * h, march.step < steps
        length = h if whole else rest

        def within(tau: float, memory: Any = memory, t: float = t) -> Moment:
            frame = integrator.at(march.system, memory, t, tau, h, Work(), march.parameters)
            return Moment(march, frame, t + tau)

        stuck, step = march.work.unconverged, march.step
        if whole:
            while march.step == step:  # Ctrl-C without an exception takes no step
                march.on(step + 1)
            now = Moment(march, march.frame(0.0), march.step * h)
        else:
            now, rest = Moment(march, march.frame(rest), end), 0.0
        if march.work.unconverged and not stuck:
            warn(f"{integrator.name}: the step to t = {now.t:g} did not converge: take dt < {h:.3g}")
        yield _Step(last, now, length, within)
        last = now


def steps(
    problem: Problem, method: str | Integrator = "midpoint", dt: float | None = None, engine: str | None = None
) -> Iterator[Moment]:
    """The moments of a run, the initial one and that after each step, for those who step by hand; `break` ends it.

    A step in Python costs some hundredths of a millisecond more than one within `simulate`.

    Parameters
    ----------
    problem : the chain, its initial state, loads and duration.
    method : a method with fixed steps, by name or with settings, as for `simulate`.
    dt : time step; None is `suggest_dt(problem, method)`.
    engine : as for `simulate`.

    Yields
    ------
    Moment, see `discs.running.moments`: t, x, y, theta, omega, energy, contact_force, state and more.

    Raises
    ------
    ValueError : as `simulate`, and for a method that chooses its own steps.
    SimulationError : as `simulate`.
    """
    if not isinstance(problem, Problem):
        raise ValueError(f"steps takes a Problem, as `compare.lump(scene, n)` makes; got {type(problem).__name__}")
    for step in by_steps(problem, find(method), dt, engine, problem.duration):
        if step.start.t == 0:
            yield step.start
        yield step.end


def look_ahead(
    problem: Problem, integrator: Integrator, dt: float, times: Float, events: Sequence[Event], engine: str
) -> tuple[tuple[Occurrence, ...], Float]:
    """The events of a run until the last of the times (F,), or until one that stops it, and the times of the frames up to there.

    The last frame is at the event that stops the run.
    """
    found: list[Occurrence] = []
    with kept():  # the run itself warns
        values: list[float] = []
        for step in by_steps(problem, integrator, dt, engine, float(times[-1])):
            values = values or [_value(i, event, step.start) for i, event in enumerate(events)]
            after = [_value(i, event, step.end) for i, event in enumerate(events)]
            ends = zip(values, after, strict=True)
            here = [_root(i, events[i], step, a, b) for i, (a, b) in enumerate(ends) if _happens(events[i], a, b)]
            for i, moment in sorted(here, key=lambda pair: pair[1].t):
                found.append(Occurrence(i, _name(events[i]), moment.t, moment.state))
                if getattr(events[i], "terminal", False):
                    return tuple(found), np.append(times[times < moment.t], moment.t)
            values = after
    return tuple(found), times


def _happens(event: Event, before: float, after: float) -> bool:
    """Whether an event happens in a step at whose ends its function has these values."""
    direction = getattr(event, "direction", 0)
    return before != 0 and before * after <= 0 and direction * (after - before) >= 0


def _root(i: int, event: Event, step: _Step, before: float, after: float) -> tuple[int, Moment]:
    """The event, by number, and the moment within a step at which it happens."""
    ends = {0.0: before, step.length: after}

    def value(tau: float) -> float:
        return ends[tau] if tau in ends else _value(i, event, step.within(tau))

    tau = step.length if after == 0 else float(scipy.optimize.brentq(value, *ends, xtol=1e-15 * max(step.end.t, step.length)))
    return i, step.start if tau == 0 else step.end if tau == step.length else step.within(tau)


def _value(i: int, event: Event, moment: Moment) -> float:
    where = f", at t = {moment.t:g}"
    value = checks.called(f"events[{i}]", event, moment, where=where)
    try:
        return checks.number(f"events[{i}]", value)
    except ValueError as error:
        raise ValueError(f"{error}{where}: an event is a function of a Moment, zero when it happens") from None


def _name(event: Event) -> str:
    return getattr(event, "__name__", None) or repr(event)


def checked_events(events: object) -> tuple[Event, ...]:
    """Events as a tuple; ValueError if they are no functions."""
    given = tuple(events) if isinstance(events, list | tuple) else (events,)
    if not all(callable(event) for event in given):
        raise ValueError(
            f"events must be functions of a Moment, or those of discs.events, as events=[Line((1, 0), (1, 0))]; got "
            f"{checks.shown(events)}"
        )
    return given
