"""One live simulation: it takes the messages of a page and gives replies. It knows no network and no clock but its budget.

**Going on.** Discs move by `discs.steps`. When a slider moves, a disc is pulled, kicked or held, the run goes on from the state of
that moment as a new problem. What the change adds to the energy, a jump, is booked as work of the hand, so

    energy - work + dissipated

stays the number that it was at the start, to rounding for the methods that keep the energy: the page shows by how much it is off.

**The field** is that of the scene from t = 0. Once a slider was moved or a disc touched, the discs are no longer those of the
scene: the field is hidden until the motion starts again, with the new values.

**Engine.** Steps are plain until the kernels are read or compiled, by a thread, and compiled from then on.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from compare.lab import drawing, files
from compare.lab.beside import Beside, Fields
from compare.lab.engine import Engines
from compare.lab.hand import Hand
from compare.lab.history import History, Kept
from compare.lab.messages import checked
from compare.lab.settings import Settings
from compare.lab.shifted import later
from discs import Problem, SimulationError, steps, suggest_dt
from discs.integrators import find
from discs.running.moments import Moment
from discs.warn import kept

BUDGET = 0.04  # seconds of computing for one message
SEGMENT = 1000.0  # time after which steps begin anew


class Reply(NamedTuple):
    """What a page is sent: an object for JSON and, for frames and files, bytes."""

    content: dict[str, Any]
    data: bytes = b""


class Session:
    """A live simulation.

    Parameters
    ----------
    settings : to begin with.
    fields : computes fields; None shows none.
    engines : prepares kernels; None takes the plain engine.
    clock : seconds, for the budget.
    """

    def __init__(
        self,
        settings: Settings | None = None,
        fields: Fields | None = None,
        engines: Engines | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.settings = settings or Settings()
        self._engines, self._clock = engines, clock
        self.beside = Beside(fields, clock)
        self.notes: list[str] = []
        with kept() as told:
            self._start(self.settings)
        self.notes += told

    _base: Problem
    _begun_with: Settings
    _moments: Iterator[Moment]
    _engine: str
    _debt: float  # time that the page asked for and no step was taken for yet
    _began: float  # time at which the present segment began, with work and dissipation so far
    _work_before: float
    _dissipated_before: float
    _invariant: float
    history: History
    hand: Hand
    moment: Moment
    problem: Problem
    stopped: str
    touched: bool

    # ---- messages

    def opening(self) -> list[Reply]:
        """What a page is sent when it opens: the choices and the first frame."""
        return [self._described(), self._frame(), *self._noted()]

    def handle(self, message: object) -> list[Reply]:
        """The replies to a message. One that is refused is answered by {"kind": "refused", "text": the reason}."""
        with kept() as told:
            try:
                given = checked(message)
                replies: list[Reply] = getattr(self, f"_on_{given.pop('kind')}")(**given)
            except ValueError as error:
                replies = [Reply({"kind": "refused", "text": str(error)}), self._described(), self._frame()]
            except SimulationError as error:
                self.stopped = str(error)
                replies = [self._frame()]
        self.notes += told
        return replies + self._noted()

    def _noted(self) -> list[Reply]:
        notes, self.notes = list(dict.fromkeys(self.notes)), []
        return [Reply({"kind": "note", "text": text}) for text in notes]

    def _on_advance(self, time: float) -> list[Reply]:
        self._debt += time
        end, late = self._clock() + BUDGET, False
        while self._debt >= 0.5 * self.settings.dt and not self.stopped:
            if late := self._clock() > end:
                self._debt = 0.0
                break
            self._step()
            self._debt -= self.settings.dt
        self._look()
        return [self._frame(late=late)]

    def _on_step(self, by: str) -> list[Reply]:
        if by == "back":
            return self._on_seek(self.t - 0.5 * self.settings.dt)
        if not self.stopped:
            self._step()
        return [self._frame()]

    def _on_seek(self, time: float) -> list[Reply]:
        back = self.history.at(time)
        self.hand, self.stopped, self._debt = Hand(), "", 0.0
        self.touched = back.touched or self.settings != self._begun_with
        self._continue(back)
        return [self._frame()]

    def _on_reset(self) -> list[Reply]:
        self._start(self.settings)
        return [self._described(), self._frame()]

    def _on_choose(self, **changes: Any) -> list[Reply]:
        settings = self.settings.chosen(**changes)
        if changes.keys() <= {"method", "dt"}:
            self._live(self._fitting(settings, "dt" in changes))
        else:
            self._start(self._fitting(settings, "dt" in changes))
        return [self._described(), self._frame()]

    def _on_set(self, name: str, value: float) -> list[Reply]:
        settings = self.settings.moved(name, value)
        if next(slider for slider in settings.sliders if slider.name == name).again:
            self._start(settings)
        else:
            self._live(settings)
        return [self._frame()]

    def _on_pull(self, disc: int, x: float, y: float) -> list[Reply]:
        self._touch(replace(self.hand, pulled=(self._disc(disc), x, y)))
        return [self._frame()]

    def _on_release(self) -> list[Reply]:
        if self.hand.pulled is not None:
            self._touch(replace(self.hand, pulled=None))
        return [self._frame()]

    def _on_kick(self, disc: int, change: float) -> list[Reply]:
        if self._disc(disc) in self.hand.held:
            raise ValueError(f"disc {disc} is held: let it go before you kick it")
        state = self.moment.state
        omega = np.array(state.omega)
        omega[disc] += change
        self._touch(self.hand, replace(self._kept(), state=replace(state, omega=omega)))
        return [self._frame()]

    def _on_hold(self, disc: int, on: bool) -> list[Reply]:
        held = self.hand.held | {self._disc(disc)} if on else self.hand.held - {disc}
        self._touch(replace(self.hand, held=held))
        return [self._frame()]

    def _on_compare(self, on: bool) -> list[Reply]:
        self.beside.show(on)
        self._look()
        return [self._frame()]

    def _on_code(self, language: str) -> list[Reply]:
        text = self.settings.python() if language == "python" else self.settings.toml()
        return [Reply({"kind": "code", "language": language, "text": text})]

    def _on_save(self, ending: str) -> list[Reply]:
        return [Reply({"kind": "file", "name": f"lab{ending}"}, files.content(self.run, ending))]

    # ---- the motion

    @contextmanager
    def _undone(self) -> Iterator[None]:
        """A change that is undone if it makes no problem."""
        before = self.__dict__.copy()
        try:
            yield
        except ValueError:
            self.__dict__.update(before)
            raise

    def _start(self, settings: Settings) -> None:
        """Start from t = 0."""
        with self._undone():
            self.settings = self._begun_with = settings
            self._base = settings.make_problem()
            self.hand, self.touched, self.stopped, self._debt = Hand(), False, "", 0.0
            self._continue(Kept(0.0, self._base.initial, self._base.energy(), 0.0, 0.0, False))
            self._invariant = self.moment.energy
            self.history = History(self._base.chain.n)
            self.history.add(self._kept())
        self.beside.change(again=True)

    def _live(self, settings: Settings) -> None:
        """Go on with other settings from where the discs are."""
        with self._undone():
            last = self._kept()
            if last.t > 0:
                self.touched = self.touched or settings.of_field != self._begun_with.of_field
            else:
                self._begun_with = settings
            self.settings, self._base, self.stopped = settings, settings.make_problem(), ""
            self._continue(last)
        self.beside.change(again=last.t == 0)

    def _touch(self, hand: Hand, last: Kept | None = None) -> None:
        """Go on with another hand, and perhaps from another state."""
        with self._undone():
            last = last or self._kept()
            self.hand, self.touched = hand, True
            self._continue(last)

    def _continue(self, last: Kept) -> None:
        """Go on from a frame as a new problem. The jump of the energy is work of the hand."""
        state = last.state
        if self.hand.held:
            held = list(self.hand.held)
            rates = {"omega": np.array(state.omega)} | ({} if state.phi is None else {"phi_rate": np.array(state.phi_rate)})
            for rate in rates.values():
                rate[held] = 0.0
            state = replace(state, **rates)
        loads = tuple(later(load, last.t) for load in self._base.loads)
        problem = replace(self._base, initial=state, duration=SEGMENT, loads=loads + self.hand.loads(self._base))
        engine = self._engine_now(problem)
        moments = steps(problem, self.settings.method, self.settings.dt, engine)
        first = next(moments)
        self.problem, self._moments, self.moment, self._engine = problem, moments, first, engine
        self._began, self._dissipated_before = last.t, last.dissipated
        self._work_before = last.work + (first.energy - last.energy)

    def _fitting(self, settings: Settings, dt_given: bool) -> Settings:
        """The settings with a step with which an explicit method is stable, unless the step was chosen."""
        integrator = find(settings.method)
        if dt_given or not np.isfinite(integrator.stability_limit):
            return settings
        stable = suggest_dt(settings.make_problem(), settings.method)
        if settings.dt <= stable:
            return settings
        found = float(f"{stable:.2g}")
        self.notes.append(f"{settings.method!r} is stable with short steps only: the step is now {found:g}")
        return replace(settings, dt=found)

    def _step(self) -> None:
        if self.history.frames[-1].t > self.t:  # after going back: what came later is replaced
            self.history.cut(self.t)
        if self._engine == "plain" and self._engine_now() != "plain":
            self._continue(self._kept())
        moment = next(self._moments, None)
        if moment is None:  # a new segment
            self._continue(self._kept())
            moment = next(self._moments)
        self.moment = moment
        self.history.add(self._kept())

    def _engine_now(self, problem: Problem | None = None) -> str:
        """The engine that a problem, by default the present one, can take."""
        if self._engines is None:
            return "plain"
        return self._engines.engine(problem or self.problem, self.settings.method, self.settings.dt)

    def _kept(self) -> Kept:
        return Kept(self.t, self.moment.state, self.moment.energy, self.work, self.dissipated, self.touched)

    def _disc(self, disc: int) -> int:
        if disc >= self.problem.chain.n:
            raise ValueError(f"there are {self.problem.chain.n} discs, from 0 on; got disc {disc}")
        return disc

    @property
    def t(self) -> float:
        """Time since the start."""
        return self._began + self.moment.t

    @property
    def work(self) -> float:
        """Work of loads and of the hand since the start."""
        return self._work_before + self.moment.work

    @property
    def dissipated(self) -> float:
        """Energy that dampers took since the start."""
        return self._dissipated_before + self.moment.dissipated

    @property
    def run(self) -> Any:
        """The run so far, a `discs.Solution`: the frames that are kept."""
        untouched = not self.touched and self.settings == self._begun_with
        return files.run_of(self.history, self._base if untouched else None, self.settings, self.problem.chain.s)

    def _look(self) -> None:
        if not self.touched:
            self.beside.look(self._begun_with, self.problem.chain.s)

    # ---- replies

    def _described(self) -> Reply:
        return Reply({"kind": "scene"} | drawing.description(self.settings, self.problem))

    def _frame(self, late: bool = False) -> Reply:
        about, beside = self.beside.told(self.touched)
        content, data = drawing.frame(self.moment, self.t, beside)
        if beside is not None and content["error"] is None:
            about = f"The field ends at t = {beside.t[-1]:g}, the duration of its scene."
        content |= {
            "kind": "frame",
            "work": self.work,
            "dissipated": self.dissipated,
            "off": self.moment.energy - self.work + self.dissipated - self._invariant,
            "late": late,
            "engine": self._engine,
            "beside": about
            if content["error"] is not None or about
            else "The field was computed up to here only." * self.beside.on,
            "held": sorted(self.hand.held),
            "pulled": None if self.hand.pulled is None else list(self.hand.pulled),
            "stopped": self.stopped,
            "first": self.history.frames[0].t,
            "last": self.history.frames[-1].t,
        }
        return Reply(content, data)
