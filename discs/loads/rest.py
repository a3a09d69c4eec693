"""Rest shapes: springs whose energy is least at a given twist or curvature."""

from dataclasses import dataclass

import numpy as np

from discs.chains import stencils
from discs.chains.chain import SteeredChain
from discs.loads.binding import Discs, OnRod, Pattern, signal_of, spread
from discs.loads.linear import Drive, Linear
from discs.loads.signals import Signal


@dataclass(frozen=True, eq=False)
class Rest(OnRod):
    r"""Rest strains: torsion energy beta/2 (theta' - twist signal)^2, bending energy K/2 (phi' - curvature signal)^2.

    With the strain a of a link, its rest strain e and its stiffness S, S (a - e)^2/2 = S a^2/2 - S e a + S e^2/2: the rest shape
    adds the force B^T S e and an energy. Where e depends on time, the links do the work -int S (a - e) de. It is recorded as the
    work of B^T S e in the steps and the change of S e^2/2 - S e a, which balances the energy exactly.

    Parameters
    ----------
    twist : theta' at rest, rad per length; a number, an array over the links or a function of s.
    curvature : phi' at rest, the same, for discs with their own headings.
    signal : a function of t; None for 1. The energy is conserved then.
    """

    twist: Pattern = 0.0
    curvature: Pattern = 0.0
    signal: Signal | None = None

    def on(self, chain: Discs) -> Linear:
        turns = getattr(chain, "turns", 0)
        twist = self._sampled("twist", self.twist, chain.middles)
        rows, strain, closing = {2: np.asarray(chain.torsion_stiffness) * twist}, np.zeros((2, twist.size)), 0.0
        strain[0] = np.sqrt(np.asarray(chain.torsion_stiffness) * chain.k) * twist
        if isinstance(chain, SteeredChain):
            curvature = self._sampled("curvature", self.curvature, chain.middles)
            rows[3] = np.asarray(chain.bending_stiffness) * curvature
            strain[1] = np.sqrt(np.asarray(chain.bending_stiffness) * chain.k) * curvature
            closing = 2 * np.pi * turns * float(rows[3][-1])
        elif callable(self.curvature) or np.any(self.curvature):
            self._needs_headings(chain, "curvature")
        pattern = spread(chain, {row: stencils.pull(moment, chain.ends) for row, moment in rows.items()})
        if self.signal is None:
            return Linear(constant=pattern, offset=-closing, strain=strain, floor=0.0)
        return Linear(drives=(Drive(pattern, signal_of("Rest", self.signal), "Rest", strain, closing),))
