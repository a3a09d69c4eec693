"""What each of several loads does: its share of the work, and of the energy that dampers take."""

import numpy as np

from discs.arrays import Float
from discs.loads.linear import Linear
from discs.loads.motor import Held
from discs.loads.sums import Total
from discs.skew import Load


class Shares:
    """The loads of a problem one by one, at the places and times of their sum.

    Rest shapes that signals drive have an energy in common, of which each has half. What they share with constant ones is theirs.

    Parameters
    ----------
    loads : (L,), the loads for the discs. whole : their sum.

    Attributes
    ----------
    motors : the places of motors among the loads.
    """

    def __init__(self, loads: tuple[Load, ...], whole: Load | None) -> None:
        self._loads, whole = loads, whole.other if isinstance(whole, Held) else whole
        self._linear = whole.linear if isinstance(whole, Total) else whole  # rest shapes of several loads are one strain
        self._drives = [i for i, load in enumerate(loads) if isinstance(load, Linear) for _ in load.drives]
        self.motors = [i for i, load in enumerate(loads) if isinstance(load, Held)]

    @property
    def nothing(self) -> Float:
        """As `Work.spent` at the start."""
        return np.zeros((4, 1 + len(self._loads)))

    def power(self, t: float, q: Float, v: Float) -> Float:
        """The rates of work and dissipation of each load, (2, L), without those of motors."""
        found = np.array([load.power(t, q, v) for load in self._loads]).T
        if self._drives and isinstance(self._linear, Linear):
            found[0, self._drives] = 0.0
            np.add.at(found[0], self._drives, self._linear.powers(t, q, v))
        return found

    def driven(self, t: float, q: Float) -> Float:
        """The part of each load in `driven` of their sum, (L,)."""
        found = np.array([load.driven(t, q) for load in self._loads])
        if self._drives and isinstance(self._linear, Linear):
            found[self._drives] = 0.0
            np.add.at(found, self._drives, self._linear.energies(t, q))
        return found
