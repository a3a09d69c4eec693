"""What generalised forces change by with the parameters of loads and their signals, for `discs.analysis.adjoint`.

A linear load is f = constant - damping v - stiffness q - B^T (viscosity) B v + sum_k signal_k(t) pattern_k. With w = C nu its
parameters change M . df only by the sums over the states of w, w v, w q, (B w)(B v) and signal_k w, which one pass adds up. The
arrays are affine in each parameter of a load, so their derivatives are differences. Those of signals are differences of order 4.
"""

import re
from dataclasses import fields, is_dataclass, replace
from typing import Any

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


class LoadParameter:
    """A parameter of a load, "loads[0].pattern", or of its signal, "loads[0].signal.rate".

    Raises ValueError where there is none, or where its derivative is not known here.
    """

    def __init__(self, problem: Problem, name: str) -> None:
        found = PATH.fullmatch(name)
        if not found or int(found[1]) >= len(problem.loads):
            raise ValueError(
                "a parameter of a load is 'loads[i].name' or 'loads[i].signal.name' with i below "
                f"{len(problem.loads)}, the number of loads; got {name!r}"
            )
        load = problem.loads[int(found[1])]
        bound = problem.bound[int(found[1])]
        owner = getattr(load, "signal", None) if found[2] else load
        names = [field.name for field in fields(owner)] if is_dataclass(owner) else []
        if found[3] not in names:
            raise ValueError(f"{name!r}: {type(owner).__name__} has the parameters {', '.join(names) or 'none'}")
        if not isinstance(bound, Linear) or bound.bends is not None or bound.section is not None or bound.degree == 2:
            raise ValueError(
                f"{name!r}: derivatives are known for loads that are linear in positions and velocities; not for "
                f"{type(load).__name__} here"
            )
        value = getattr(owner, found[3])
        if callable(value):
            raise ValueError(f"{name!r} is a function: give its values, as an array, to differentiate by them")
        try:
            self.value = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            raise ValueError(f"{name!r} is no number and no array: {checks.shown(value)}") from None
        self.name, self._problem, self._load, self._bound = name, problem, load, bound
        self._signal, self._attribute = owner if found[2] else None, found[3]
        if self._signal is None and (other := self._other((0,) * self.value.ndim)) and (other.bends or other.section is not None):
            raise ValueError(f"{name!r}: its force is not linear in positions; derivatives by it are not known here")
        self._sums = {part: np.zeros_like(bound.constant) for part in ("constant", "damping", "stiffness")}
        self._viscous = np.zeros((len(bound.constant) - 2, problem.chain.n + 1))
        self._driven = np.zeros((len(bound.drives), *bound.constant.shape))
        self._by_signal = np.zeros(self.value.shape)

    def add(self, at: Passed) -> None:
        """Add what these states contribute."""
        w = at.w
        if self._signal is not None:
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

    def _changed(self, place: tuple[int, ...], by: float) -> Any:
        value = self.value.copy()
        value[place] += by
        owner: Any = self._load if self._signal is None else self._signal
        return replace(owner, **{self._attribute: value if value.ndim else float(value)})

    def _slope(self, place: tuple[int, ...], t: Float) -> Float:
        """The derivative of the signal at times (M,)."""
        size = abs(float(self.value[place])) or 1.0
        return slope(lambda by: signals.values(self._changed(place, by), t, self.name), size)

    def total(self) -> Float:
        """The derivative, of the shape of the parameter."""
        if self._signal is not None:
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
