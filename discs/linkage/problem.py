"""A linkage, its initial state and the time to run."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.linkage import starting
from discs.linkage.equations import Equations
from discs.linkage.linkage import Linkage, LinkageState


@dataclass(frozen=True, eq=False)
class LinkageProblem:
    """A linkage, its initial state and the time to run.

    Attributes
    ----------
    linkage : the nodes and their links.
    initial : state at t = 0.
    duration : time to simulate, > 0.

    Raises
    ------
    ValueError : if the duration is not positive; if the state has another number of nodes, is off a rigid link, or moves against a
        constraint, naming the node or link; if constraints are redundant (a rigid loop), or a velocity that they allow has no
        inertia, naming its node.
    """

    linkage: Linkage
    initial: LinkageState
    duration: float

    def __post_init__(self) -> None:
        if not isinstance(self.linkage, Linkage) or not isinstance(self.initial, LinkageState):
            raise ValueError(
                f"a LinkageProblem takes a Linkage, a LinkageState and a duration; got {checks.shown(self.linkage)} and "
                f"{checks.shown(self.initial)}"
            )
        object.__setattr__(self, "duration", checks.number("duration", self.duration, positive=True))
        if np.size(self.initial.x) != self.linkage.n:
            raise ValueError(f"initial state must have the linkage's {self.linkage.n} nodes; got {np.size(self.initial.x)}")
        with np.errstate(all="ignore"):  # what overflows is refused
            starting.check(self.equations, *self.start())
            if not np.isfinite(self.energy()):
                raise ValueError("the initial energy is too large for a double: change units, or the places, rates and parameters")

    @cached_property
    def equations(self) -> Equations:
        """The equations of motion."""
        return Equations(self.linkage)

    def start(self) -> tuple[Float, Float]:
        """Coordinates (4, n), rows x, y, theta, phi, and velocities (3, n) of `discs.linkage.equations`."""
        z, of = self.initial, self.equations
        q = np.array([z.x, z.y, z.theta, z.phi], dtype=float)
        rates = np.array([z.x_rate, z.y_rate, z.phi_rate], dtype=float)
        return q, starting.speeds(of, q, rates)

    def energy(self) -> float:
        """Kinetic and potential energy of the initial state, that of the dead loads included."""
        q, w = self.start()
        return self.equations.energy(q, w, 0.0)
