"""What a run of an integrator costs and returns: `Work`, compiled steps' `Tally`, and `Frame`."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from discs.arrays import Float, Int
from discs.loads.shares import Shares
from discs.skew import Load, Phase, add

NOTHING = np.zeros(4)  # spent by a run without loads
NOTHING.flags.writeable = False


@dataclass
class Work:
    """The cost of a run so far.

    Attributes
    ----------
    gradients : evaluations of grad V.
    solves : banded linear systems.
    unconverged : implicit steps that reached their limit of sweeps.
    taken : steps that an adaptive method took; 0 for methods with fixed steps.
    spent : (4,), the work of loads and the energy that they dissipate, each with its lost digits. With `shares` (4, 1 + L): that
        of all loads, and that of each.
    shares : the loads one by one, if asked for.
    """

    gradients: int = 0
    solves: int = 0
    unconverged: int = 0
    taken: int = 0
    spent: Float = field(default_factory=lambda: NOTHING)
    shares: Shares | None = None

    def add(self, tally: "Tally") -> None:
        """Add the cost of compiled steps."""
        self.gradients += tally.gradients
        self.solves += tally.solves
        self.unconverged += tally.unconverged
        if tally.spent is not NOTHING:
            self.book(tally.spent[0], tally.spent[2])

    def book(self, work: float | Float, dissipated: float | Float) -> None:
        """Add the work of loads and the energy that they dissipate."""
        total, lost = add(self.spent[::2], self.spent[1::2], np.array([work, dissipated]))
        self.spent = np.array([total[0], lost[0], total[1], lost[1]])

    def power(self, load: Load, t: float, q: Float, v: Float) -> Float:
        """The rates of work and of dissipation, as they are booked: (2,), or (2, 1 + L)."""
        found = np.array(load.power(t, q, v))
        return found if self.shares is None else np.column_stack([found, self.shares.power(t, q, v)])

    def spend(self, load: Load | None, t: float, weight: float, z: Phase, move: Float, v: Float) -> None:
        """Book what a load does in a time `weight` around t, at the positions of z after a move, with velocities v (rows, n)."""
        if load is not None and not load.conservative:
            work, dissipated = self.power(load, t, z.hi + (z.lo + move), v)
            self.book(weight * work, weight * dissipated)

    def react(self, load: Load, gained: Float, p: Float) -> None:
        """Book the work of motors, whose torques changed the momenta by `gained` while the mean momenta were p, both like pi."""
        rows, discs = np.array([(axle.row, axle.disc) for axle in load.axles]).T
        gains, means = (np.atleast_2d(of)[rows - 2, discs] for of in (gained, p))
        if self.shares is None:
            self.book(float(gains @ means), 0.0)
            return
        work = np.zeros(self.spent.shape[1])
        work[0], work[1:][self.shares.motors] = gains @ means, gains * means
        self.book(work, 0.0 * work)


class Tally(NamedTuple):
    """The result of compiled steps.

    steps, gradients, solves, unconverged : steps taken, and their cost. lost : a disc that lost its heading, or -1.
    passed : looks done. doubted : whether a step to be compared comes next. blown : whether the kinetic energy exceeds the bound.
    framed : frames recorded so far. spent : (4,), as in `Work`.
    """

    steps: int
    gradients: int
    solves: int
    unconverged: int
    lost: int
    passed: int
    doubted: bool
    blown: bool
    framed: int = 0
    spent: Float = NOTHING


Memory: TypeAlias = Any  # a NamedTuple or an object: all that a method needs between steps, of a type of its own
Looks = tuple[int, Int, Float, Float, float]  # arguments of `discs.kernels.driver.march`
NO_LOOKS: Looks = 0, np.empty(0, np.int64), np.empty((1, 1, 0)), np.empty((1, 2, 1)), np.inf

Stops = tuple[int, int, int, Int, Float, Float, Float, Float]  # those about frames
NO_FRAMES = np.empty((1, 0, 1))
NO_STOPS: Stops = 2**62, 0, 0, np.empty(0, np.int64), np.empty(0), NO_FRAMES, NO_FRAMES, np.empty((2, 0))


class Cut(Exception):
    """Ctrl-C interrupted a compiled call. Its steps are dropped; the memory is the one before the call."""


class Frame(NamedTuple):
    """Positions q = hi + lo and their rates of change, all (rows, n).

    lost : a disc that lost its heading in the compiled step to the frame, or -1. If there is one, the rest is undefined.
    seen : q, energy and largest slip, if the compiled form computed them.
    spent : (2,), work of loads and dissipated energy since the last step; with `Work.shares` (2, 1 + L).
    """

    hi: Float
    lo: Float
    rate: Float
    lost: int = -1
    seen: tuple[Float, float, float] | None = None
    spent: Float = NOTHING[:2]
