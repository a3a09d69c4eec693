"""The time loop: advances a run to each output time, plain or compiled, and stops it on failure."""

from typing import Any

import numpy as np

from discs.integrators import FixedStep, Work
from discs.integrators.work import NO_LOOKS, NO_STOPS, Cut, Frame, Memory, Tally
from discs.kernels import driver
from discs.loads.motor import Held
from discs.loads.shares import Shares
from discs.running.album import Album
from discs.running.calls import heed_halt
from discs.running.failure import SimulationError, blown_up, lost_heading
from discs.running.plan import Plan
from discs.running.rounding import warn_of_growth, warn_of_lost_digits
from discs.running.step_error import SUSPECTED, Watch, converging
from discs.skew import Phase, Placed
from discs.stats import Stats
from discs.warn import warn

WATCHED = ("looks", "passed", "doubted", "defects", "places")  # attributes of a `Watch` that a restart needs
CHUNK = 4_000_000  # discs times steps of one compiled call; progress is shown between calls, Ctrl-C is polled in every sweep
TABLED = 20_000  # steps of one compiled call whose loads have tables of their signals


def quiet() -> Any:
    """Within it NumPy does not warn of what is not finite, as of a run that blows up, which is told by an error."""
    return np.errstate(over="ignore", invalid="ignore", divide="ignore")


class March:
    """The state of a run, advanced step by step.

    Parameters
    ----------
    plan : the problem, the method and the engine. h : the step.
    watch : the estimate of the error of the steps; None for none.
    album : the frames that compiled steps record; None if each frame is asked for.

    Attributes
    ----------
    step : number of steps taken.
    stuck : some states before steps that did not converge, with their times and the number of steps taken from each.
    work : the cost of the steps.
    memory : the memory of the integrator.
    """

    def __init__(self, plan: Plan, h: float, watch: Watch | None = None, album: Album | None = None) -> None:
        self.plan, self.h, self.watch, self.album = plan, h, watch, album
        self.problem, self.integrator, self.system = plan.problem, plan.integrator, plan.system
        self.parameters, self.twin = plan.parameters, plan.twin
        self.stuck: list[tuple[Memory, float, int]] = []
        self.work, self.step = Work(), 0
        if "work_by_load" in plan.want:
            shares = Shares(self.problem.bound, self.system.load)
            self.work = Work(spent=shares.nothing, shares=shares)
        if self.problem.ill_posed:
            warn(self.problem.ill_posed)
        if plan.implicit:
            warn_of_lost_digits(self.system, h)
        if self.integrator.back:
            warn_of_growth(self.problem, self.integrator.name, self.integrator.back, h)
        self.memory: Memory = None
        if album is None or not self.integrator.runs_whole:  # otherwise only if that fails
            self._begin()

    def _begin(self) -> None:
        self.memory = self.integrator.begin(self.system, self.problem.start(), self.h, self.work, self.parameters)

    def prepare(self) -> None:
        """Call the kernels of the run once, which compiles them (once per machine) or reads them from disc (once per process)."""
        if self.twin is not None:
            self.twin.march(self.system, self.parameters, self.memory, 0.0, self.h, 0, self.plan.bound)
        elif self.album is not None:
            nothing = Album(self.system, self.album.times[:0], self.h)
            self.integrator.whole(self.system, self.parameters, self.problem.start(), self.h, self.plan.bound, nothing)
        if self.album is None:  # frames are asked for, by a kernel of its own
            self.observe(0.0, self.integrator.at(self.system, self.memory, 0.0, 0.0, self.h, self.work, self.parameters))

    def whole(self) -> bool:
        """Take the whole run at once; False if the method cannot or the run fails, which then goes step by step."""
        assert self.album is not None
        work = self.integrator.whole(self.system, self.parameters, self.problem.start(), self.h, self.plan.bound, self.album)
        if work is None:
            self._begin()
            return False
        self.work, self.step, self.album.done = work, int(self.album.steps[-1]), self.album.steps.size
        return True

    def keep(self) -> dict[str, Any]:
        """All that a restart needs, as arrays and numbers by name."""
        work = {f"work.{name}": value for name, value in vars(self.work).items() if name != "shares"}
        seen = {f"watch.{name}": getattr(self.watch, name) for name in WATCHED} if self.watch else {}
        return {"step": self.step} | work | seen | {f"memory.{k}": v for k, v in self.integrator.keep(self.memory).items()}

    def recall(self, kept: dict[str, Any]) -> None:
        """Restore what `keep` returned for the same run."""
        self.step = int(kept["step"])
        for name in vars(self.work).keys() - {"shares"}:
            value = kept[f"work.{name}"]
            setattr(self.work, name, value if value.ndim else int(value))
        if self.watch:
            for name in WATCHED:
                value = kept[f"watch.{name}"]
                setattr(self.watch, name, value if value.ndim else value.item())
        of_memory = {name.removeprefix("memory."): value for name, value in kept.items() if name.startswith("memory.")}
        self.memory = self.integrator.recall(self.memory, of_memory)

    def on(self, step: int) -> None:
        """Advance towards a step, not beyond it; not at all if Ctrl-C was pressed and its handler did not raise."""
        heed_halt()
        before, stuck = self.memory, self.work.unconverged
        try:
            taken = self._plain() if self.twin is None else self._compiled(self.twin, step - self.step)
        except Cut:  # drop this call
            self.memory = before
            if self.watch is not None:
                self.watch.put_off(self.step)
            return
        if self.work.unconverged > stuck:
            self._remember(before, taken, stuck)
        self.step += taken

    def _compiled(self, twin: FixedStep, steps: int) -> int:
        """Take at most so many steps by the compiled twin, and its frames on the way; returns how many were taken."""
        before, watch, album, looks, stops = self.memory, self.watch, self.album, NO_LOOKS, NO_STOPS
        if steps * self.system.n > CHUNK or steps > TABLED:
            steps = min(CHUNK // self.system.n or 1, steps, CHUNK if self.system.load is None else TABLED)
        if watch is not None:
            steps, looks = (1, NO_LOOKS) if watch.doubted else (steps, watch.arguments(self.step))
        if album is not None:
            stops = album.arguments(self.step, self.work.unconverged)
        t, h, bound = self.step * self.h, self.h, self.plan.bound
        self.memory, tally = twin.march(self.system, self.parameters, before, t, h, steps, bound, looks, stops)
        if tally.lost >= 0 or tally.blown:
            self.work.add(tally)
            self._fail(twin, before, tally)
        if watch is not None:
            if watch.doubted:
                self._compare(watch, before)
            else:
                watch.passed, watch.doubted = watch.passed + tally.passed, tally.doubted
        self.work.add(tally)  # after what Ctrl-C may interrupt
        if album is not None:
            album.done = tally.framed
        return tally.steps

    def _compare(self, watch: Watch, before: Memory) -> None:
        """Compare the last step with a more accurate one."""
        with quiet():
            finer = self.integrator.finer(self.system, before, self.step * self.h, self.h, self.parameters)
            watch.compare(self.memory.hi, self.memory.hi if finer is None else finer)

    def step_error(self, rest: float) -> float:
        """The estimated error of a run that ends a time `rest` after its last step."""
        watch, integrator = self.watch, self.integrator
        if watch is None:
            return 0.0
        if rest and not watch.steps:
            self._compare_rest(watch, rest)
        found = watch.estimate()
        if watch.short and SUSPECTED[0] < found < SUSPECTED[1] and not self.stuck and isinstance(integrator, FixedStep):
            with quiet():
                again = watch.again(self.system, self.problem.start(), integrator, self.memory.hi, self.h, self.parameters)
            return found if again is None else again
        return found

    def _compare_rest(self, watch: Watch, rest: float) -> None:
        """Compare the only step of a run, to its last frame, with a more accurate one."""
        integrator = self.integrator
        with quiet():
            memory = integrator.begin(self.system, self.problem.start(), rest, Work(), self.parameters)
            finer = integrator.finer(self.system, memory, 0.0, rest, self.parameters)
            one = integrator.at(self.system, memory, 0.0, rest, rest, Work(), self.parameters)
            watch.compare(one.hi, one.hi if finer is None else finer)

    def _remember(self, before: Memory, steps: int, stuck: int) -> None:
        """Keep the state before unconverged steps whenever their number has doubled: the first one and the last three."""
        if not stuck or stuck.bit_length() < self.work.unconverged.bit_length():
            self.stuck = [*self.stuck[:1], *self.stuck[1:][-2:], (before, self.step * self.h, steps)]

    def remedy(self) -> Stats:
        """The entry `converging_dt` of stats, a time step with which the run's steps converge; empty if there is none to find."""
        if not self.stuck or not isinstance(self.integrator, FixedStep):
            return {}
        with quiet():
            tried = (converging(self.system, self.integrator, *place, self.h, self.parameters) for place in self.stuck)
            return {"converging_dt": min(tried)}

    def frame(self, tau: float) -> Frame:
        """The discs a time 0 <= tau < h after the last step; raises `Cut` if Ctrl-C was pressed and its handler did not raise."""
        stuck = self.work.unconverged
        try:
            frame = self.integrator.at(self.system, self.memory, self.step * self.h, tau, self.h, self.work, self.parameters)
        except ArithmeticError as error:
            raise SimulationError(f"the run failed: {error}", self.step, self.step * self.h, 0) from None
        if tau:
            if self.work.unconverged > stuck:
                self._remember(self.memory, 1, stuck)
            time = self.step * self.h + tau
            if self.parameters is not None and self.system.load is not None and not np.isfinite(frame.rate).all():
                self.integrator.at(self.system, self.memory, self.step * self.h, tau, self.h, Work())  # as in `_fail`
            by_velocity = self.plan.explicit or self.work.unconverged > stuck
            lost = frame.lost if frame.lost >= 0 else self._lost(self.memory, frame, tau, by_velocity)
            self._check_heading(lost, self.step, time, self.memory)
            self._check_energy(self.system.kinetic(frame.rate), frame, self.step, time)
        return frame

    def observe(self, t: float, frame: Frame) -> dict[str, Any]:
        """The quantities that every frame records, by their names in `Solution`; t is its time."""
        system = self.system
        if frame.seen is not None:
            q, energy, slip = frame.seen
        elif self.parameters is not None:
            q = np.empty_like(frame.hi)
            energy, slip = driver.observe(self.parameters, frame.hi, frame.lo, frame.rate, q)
        else:
            shape = system.shape(frame.hi, frame.lo)
            q, energy = frame.hi + frame.lo, system.kinetic(frame.rate) + system.potential(shape)
            slip = np.hypot(*(frame.rate[:2] - system.contact(shape) * frame.rate[2])).max()
        found = dict(zip(system.rows, q, strict=True)) | dict(zip(system.rates[2:], frame.rate[2:], strict=True))
        if (load := system.load) is not None:
            energy += load.potential(t, q)
            if not load.conservative:
                spent, start = self.work.spent[::2] + self.work.spent[1::2] + frame.spent, self.problem.start().hi
                work, dissipated = spent if (shares := self.work.shares) is None else spent[:, 0]
                work += load.driven(t, q) - load.driven(0.0, start)
                found["balance"] = np.array([work, dissipated])
                if shares is not None:
                    spent[0, 1:] += shares.driven(t, q) - shares.driven(0.0, start)
                    found["balance_by_load"] = spent[:, 1:]
            if isinstance(load, Held):
                f = load.applied(t, q, frame.rate)
                shape = system.shape(frame.hi, frame.lo)
                found["reaction"] = system.motor_torques(shape, frame.rate, f, load.changes(t, self.problem.duration))
        return found | {"energy": energy, "rolling_residual": slip}

    def _plain(self) -> int:
        previous, stuck = self.memory, self.work.unconverged
        try:
            self.memory = self.integrator.advance(self.system, previous, self.step * self.h, self.h, self.work)
        except ArithmeticError as error:
            raise SimulationError(f"the run failed: {error}", self.step, self.step * self.h, 0) from None
        # not leapfrog, whose memory is no `Phase`: its moves are its velocities
        by_velocity = self.work.unconverged > stuck or (self.plan.explicit and isinstance(previous, Phase))
        self._check(self._lost(previous, self.memory, self.h, by_velocity), self.step + 1, previous)
        if self.watch is not None and self.watch.look(self.step + 1, previous.hi, self.memory.hi):
            self._compare(self.watch, previous)
        return 1

    def _lost(self, before: Memory, after: Placed, h: float, by_velocity: bool) -> int | None:
        """A disc whose heading vanishes on the straight line from `before` to `after`, or along its initial velocity; None if none.

        The velocity is used after a step that did not converge, whose end is undefined, and after an explicit step, whose stages
        may jump across r' = 0. (It is no guide for converged steps, which may be longer than the period of a wave.)
        """
        lost = self.system.lost_heading(before, after)
        if lost is None and by_velocity and self.system.vanishing:
            start = self.integrator.at(self.system, before, self.step * self.h, 0.0, self.h, self.work)
            lost = self.system.lost_heading(before, start._replace(hi=start.hi + h * start.rate))
        return lost

    def _fail(self, twin: FixedStep, previous: Memory, tally: Tally) -> None:
        """Raise the error of compiled steps from the memory `previous`, the last of which failed."""
        done, start = tally.steps - 1, self.step * self.h
        with quiet():
            previous, _ = twin.march(self.system, self.parameters, previous, start, self.h, done, self.plan.bound)
            if self.system.load is not None:  # a bad value of a user's function is NaN in compiled steps; plain ones raise
                self.integrator.advance(self.system, previous, start + done * self.h, self.h, Work())
            self._check(tally.lost if tally.lost >= 0 else None, self.step + tally.steps, previous)

    def _check(self, lost: int | None, step: int, before: Memory) -> None:
        self._check_heading(lost, step, step * self.h, before)
        self._check_energy(self.integrator.kinetic(self.system, self.memory, self.h), None, step, step * self.h)

    def _check_heading(self, lost: int | None, step: int, time: float, before: Memory) -> None:
        if lost is not None:
            slope = float(np.hypot(*self.system.slope(self.system.shape(before.hi, before.lo)))[lost])
            raise lost_heading(getattr(self.problem.chain, "rolling", None), step, time, lost, slope)

    def _check_energy(self, kinetic: float, frame: Frame | None, step: int, time: float) -> None:
        if kinetic <= self.plan.bound:
            return
        frame = frame or self.integrator.at(self.system, self.memory, time, 0.0, self.h, self.work, None)
        raise blown_up(self.integrator, self.h, kinetic, frame, self.work.unconverged, step, time)
