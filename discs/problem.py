"""What is to be computed: a chain, where it starts, and for how long."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from discs import checks
from discs.chain import Chain
from discs.system import Phase, RollingSystem


@dataclass(frozen=True, eq=False)
class State:
    """Where the discs are and how fast they roll; velocities follow from rolling.

    Attributes
    ----------
    x, y : contact points, (n,), length.
    theta : roll angles, (n,), rad.
    omega : rates of roll, (n,), rad per time; a number stands for all.
    """

    x: ArrayLike
    y: ArrayLike
    theta: ArrayLike
    omega: ArrayLike = 0.0

    def __post_init__(self) -> None:
        n = np.size(self.x)
        for name in ("x", "y", "theta", "omega"):
            object.__setattr__(self, name, checks.field(f"initial {name}", getattr(self, name), n))


@dataclass(frozen=True, eq=False)
class Problem:
    """A chain, its initial state and the time to run.

    Attributes
    ----------
    chain : the discs and springs.
    initial : state at t = 0.
    duration : time to simulate, > 0.

    Raises
    ------
    ValueError : if the state has another number of discs, the duration is not positive, or a disc has neither
        inertia nor a heading to roll along (something would be divided by zero).
    """

    chain: Chain
    initial: State
    duration: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "duration", checks.number("duration", self.duration, positive=True))
        if np.size(self.initial.x) != self.chain.n:
            raise ValueError(f"initial state must have the chain's {self.chain.n} discs; got {np.size(self.initial.x)}")
        slope = np.hypot(*self.system.slope(self.system.links(*self._positions())))
        if self.chain.rolling == "unit" and not slope.all():
            i = int(np.argmin(slope))
            raise ValueError(f"rolling='unit' needs a heading: r' = 0 at disc {i}; move its neighbours apart")
        inertia = np.asarray(self.chain.spin_inertia) + (slope > 0)
        if not inertia.all():
            i = int(np.argmin(inertia))
            raise ValueError(f"spin_inertia must be positive where r' = 0, as at disc {i}; got 0")

    @cached_property
    def system(self) -> RollingSystem:
        """The equations of motion."""
        return RollingSystem(self.chain)

    def _positions(self) -> tuple[NDArray, NDArray]:
        q = np.array([self.initial.x, self.initial.y, self.initial.theta])
        return q, np.zeros_like(q)

    def start(self) -> Phase:
        """The initial state in the variables (q, pi) of the skew-gradient form."""
        hi, lo = self._positions()
        return Phase(hi, lo, self.system.momentum(self.system.links(hi, lo), np.asarray(self.initial.omega)))

    def energy(self, state: State | None = None) -> float:
        """Kinetic and potential energy of a state, the initial one by default."""
        if state is not None:
            return Problem(self.chain, state, self.duration).energy()
        z = self.start()
        return 0.5 * float(z.pi @ z.pi) + self.system.potential(self.system.links(z.hi, z.lo))
