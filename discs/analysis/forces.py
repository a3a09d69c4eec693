"""What generalised forces change by with the parameters of loads and their signals, for `discs.analysis.adjoint`.

A linear load is f = constant - damping v - stiffness q - B^T (viscosity) B v + sum_k signal_k(t) pattern_k. With w = C nu its
parameters change M . df only by the sums over the states of w, w v, w q, (B w)(B v) and signal_k w, which one pass adds up. The
arrays are affine in each parameter of a load, so their derivatives are differences. Those of signals are differences of order 4.
For all other loads the whole force is taken by differences of order 4, at each state.
"""

import re
from abc import ABC, abstractmethod
from dataclasses import fields, is_dataclass, replace
from typing import Any, cast

import numpy as np

from discs import checks
from discs.analysis.stages import Passed
from discs.arrays import Float
from discs.differences import slope
from discs.loads import signals
from discs.loads.binding import OnRod
from discs.loads.linear import Linear
from discs.problem import Problem

PATH = re.compile(r"loads\[(\d+)\]\.(signal\.)?(\w+)")


class LoadParameter(ABC):
    """A parameter of a load, "loads[0].pattern", or of its signal, "loads[0].signal.rate".

    name : this name. value : the parameter, an array. place : of the load. owner, attribute : what has it.
    """

    def __init__(self, problem: Problem, name: str, place: int, owner: Any, attribute: str, value: Float) -> None:
        self.name, self.value = name, value
        self._problem, self._place, self._owner, self._attribute = problem, place, owner, attribute
        self._load, self._bound = problem.loads[place], cast(Any, problem.bound[place])
        self._of_signal = owner is not self._load

    @abstractmethod
    def add(self, at: Passed) -> None:
        """Add what these states contribute."""

    @abstractmethod
    def total(self) -> Float:
        """The derivative, of the shape of the parameter."""

    def _changed(self, place: tuple[int, ...], by: float) -> Any:
        """The owner with one entry of the parameter changed."""
        value = self.value.copy()
        value[place] += by
        return replace(self._owner, **{self._attribute: value if value.ndim else float(value)})

    def _size(self, place: tuple[int, ...]) -> float:
        return abs(float(self.value[place])) or 1.0


def load_parameter(problem: Problem, name: str) -> LoadParameter:
    """The parameter of this name. ValueError where there is none, or where it is no number."""
    found = PATH.fullmatch(name)
    if not found or int(found[1]) >= len(problem.loads):
        raise ValueError(
            "a parameter of a load is 'loads[i].name' or 'loads[i].signal.name' with i below "
            f"{len(problem.loads)}, the number of loads; got {name!r}"
        )
    place = int(found[1])
    load = problem.loads[place]
    owner = getattr(load, "signal", None) if found[2] else load
    names = [field.name for field in fields(owner)] if is_dataclass(owner) else []
    if found[3] not in names:
        raise ValueError(f"{name!r}: {type(owner).__name__} has the parameters {', '.join(names) or 'none'}")
    value = getattr(owner, found[3])
    if callable(value):
        raise ValueError(f"{name!r} is a function: give its values, as an array, to differentiate by them")
    try:
        values = np.asarray(np.nan if value is None or isinstance(value, bool) else value, dtype=float)
    except (TypeError, ValueError):
        values = np.array(np.nan)
    if np.isnan(values).any():
        raise ValueError(f"{name!r} is no number and no array: {checks.shown(value)}")
    given = problem, name, place, owner, found[3], values
    if _linear(problem.bound[place]):
        linear = LinearParameter(*given)
        if linear.fits():
            return linear
    return AnyParameter(*given)


def _linear(load: Any) -> bool:
    """Whether a load is linear in positions and velocities, with arrays of its own for both."""
    return isinstance(load, Linear) and load.bends is None and load.section is None and load.degree == 1


class AnyParameter(LoadParameter):
    """By differences of order 4 of the whole force at each state: rest curvature, viscosity of bending, loads of one's own.

    Rest strains of several loads add up, so the force of one depends on the others. Those that are part of V (`Load.section`)
    change the force of the springs.
    """

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self._found, self._problems = np.zeros(self.value.shape), dict[tuple[tuple[int, ...], float], Problem]()

    def add(self, at: Passed) -> None:
        for place in np.ndindex(self.value.shape):
            size, each = self._size(place), at.each or [None] * len(at.t)
            elastic = self._all(place, 0.1 * size)[1].section is not None
            for t, q, v, w, lin in zip(at.t.tolist(), at.q, at.velocity, at.w, each, strict=True):

                def force(
                    by: float, place: Any = place, t: float = t, q: Float = q, v: Float = v, lin: Any = lin, elastic: bool = elastic
                ) -> Float:
                    problem, load = self._all(place, by)
                    if elastic and lin is not None:  # the mean force, where steps take one
                        found: Float = -replace(lin, problem=problem).unbalanced
                        return found
                    found = load.applied(t, q, v)
                    return found - problem.system.gradient(problem.system.shape(q)) if elastic else found

                self._found[place] += np.vdot(w, slope(force, size))

    def total(self) -> Float:
        return self._found

    def _all(self, place: tuple[int, ...], by: float) -> tuple[Problem, Any]:
        """The problem with one entry of the parameter changed, and all of its loads together."""
        if (place, by) not in self._problems:
            owner, loads = self._changed(place, by), list(self._problem.loads)
            loads[self._place] = replace(self._load, signal=owner) if self._of_signal else owner  # type: ignore[type-var]
            self._problems[place, by] = replace(self._problem, loads=tuple(loads))
        problem = self._problems[place, by]
        return problem, problem.system.load


class LinearParameter(LoadParameter):
    """By sums over the states, for a load that is linear in positions and velocities."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        bound, problem = self._bound, self._problem
        self._sums = {part: np.zeros_like(bound.constant) for part in ("constant", "damping", "stiffness")}
        self._viscous = np.zeros((len(bound.constant) - 2, problem.chain.n + 1))
        self._driven = np.zeros((len(bound.drives), *bound.constant.shape))
        self._by_signal = np.zeros(self.value.shape)

    def fits(self) -> bool:
        """Whether the load stays of this kind if the parameter is changed."""
        return self._of_signal or _linear(self._other((0,) * self.value.ndim))

    def add(self, at: Passed) -> None:
        w = at.w
        if self._of_signal:
            power = np.array([(drive.pattern * w).sum(axis=(1, 2)) for drive in self._bound.drives]).sum(axis=0)
            for place in np.ndindex(self.value.shape):
                self._by_signal[place] += power @ self._slope(place, at.t)
            return
        self._sums["constant"] += w.sum(axis=0)
        self._sums["damping"] -= (w * at.velocity).sum(axis=0)
        self._sums["stiffness"] -= (w * at.q).sum(axis=0)
        apart = [np.diff(part[:, 2:], prepend=part[:, 2:, -1:], append=part[:, 2:, :1]) for part in (w, at.velocity)]
        self._viscous -= (apart[0] * apart[1]).sum(axis=0)
        for k, drive in enumerate(self._bound.drives):
            self._driven[k] += np.tensordot(signals.values(drive.signal, at.t, drive.name), w, 1)

    def _slope(self, place: tuple[int, ...], t: Float) -> Float:
        """The derivative of the signal at times (M,)."""
        return slope(lambda by: signals.values(self._changed(place, by), t, self.name), self._size(place))

    def total(self) -> Float:
        if self._of_signal:
            return self._by_signal
        found = np.zeros(self.value.shape)
        for place in np.ndindex(self.value.shape):
            found[place] = self._of(place)
        return found

    def _other(self, place: tuple[int, ...]) -> Any:
        """The load with one more of the parameter."""
        load = self._changed(place, 1.0)
        found: Any = load.on(self._problem.chain) if isinstance(load, OnRod) else load
        return found

    def _of(self, place: tuple[int, ...]) -> float:
        own, other, total = self._bound, self._other(place), 0.0
        for part, sums in self._sums.items():
            total += float(((getattr(other, part) - getattr(own, part)) * sums).sum())
        if other.viscosity is not None or own.viscosity is not None:
            after, before = (0.0 if load.viscosity is None else load.viscosity for load in (other, own))
            change = np.broadcast_to(after - before, self._viscous.shape)
            ring = self._problem.chain.ends == "ring"
            total += float((change * self._viscous)[:, 1 : None if ring else -1].sum())
        for k, (one, two) in enumerate(zip(own.drives, other.drives, strict=True)):
            total += float(((two.pattern - one.pattern) * self._driven[k]).sum())
        return total
