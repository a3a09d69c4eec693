"""What the hand does in the lab: it pulls a disc by a spring and holds discs by motors."""

from dataclasses import dataclass, field

import numpy as np

from discs import Problem
from discs.loads import Motor, Spring
from discs.loads.binding import OnRod

PULL = 0.5  # stiffness of the spring of the hand: times the largest of beta, K and 1, over the length of a link, at most 20


@dataclass
class Hand:
    """What the hand does: pull a disc to a place, hold discs."""

    pulled: tuple[int, float, float] | None = None
    held: set[int] = field(default_factory=set)

    def loads(self, problem: Problem) -> tuple[OnRod, ...]:
        """Its loads."""
        chain = problem.chain
        found: list[OnRod] = []
        if self.pulled is not None:
            disc, x, y = self.pulled
            stiff = max(1.0, float(np.max(chain.torsion_stiffness)), float(np.max(chain.bending_stiffness)))
            found.append(Spring(x, y, min(PULL * stiff / chain.k, 20.0), at=float(chain.s[disc])))
        for disc in sorted(self.held):
            at = float(chain.s[disc])
            found.append(Motor(0.0, at))
            if problem.initial.phi is not None:
                found.append(Motor(0.0, at, about="turn"))
        return tuple(found)
