"""Rest shapes: springs whose energy is least at a given twist or curvature."""

from dataclasses import dataclass

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.chains import stencils
from discs.chains.chain import SteeredChain
from discs.loads.binding import Discs, OnRod, Pattern, signal_of, spread
from discs.loads.linear import Drive, Linear
from discs.loads.signals import Signal


@dataclass(frozen=True, eq=False)
class Rest(OnRod):
    r"""Rest strains: torsion energy beta/2 (theta' - twist signal)^2, bending energy K/2 (phi' - curvature signal)^2, and for discs
    with their own headings A/2 (Gamma_1 - stretch)^2 + G/2 (Gamma_2 - shear)^2. Rest strains of several loads add up.

    With the strain a of a link, its rest strain e and its stiffness S, S (a - e)^2/2 = S a^2/2 - S e a + S e^2/2: the rest shape
    adds the force B^T S e and an energy. Where e depends on time, the links do the work -int S (a - e) de. It is recorded as the
    work of B^T S e in the steps and the change of S e^2/2 - S e a, which balances the energy exactly.

    Parameters
    ----------
    twist : theta' at rest, rad per length; a number, an array over the links or a function of s.
    curvature : phi' at rest, the same, for discs with their own headings.
    stretch, shear : Gamma at rest, the same; they take no signal, and run on the plain engine.
    mounting_angle : psi, the angle of the axles against the line at rest, rad: adds (cos psi - 1, -sin psi) to stretch and shear. 0
        is a rod; at +-pi/2 discs roll along the line, a wheeled snake. The initial state is not changed: phi = psi is at rest.
    signal : a function of t; None for 1. The energy is conserved then.
    """

    twist: Pattern = 0.0
    curvature: Pattern = 0.0
    stretch: Pattern = 0.0
    shear: Pattern = 0.0
    mounting_angle: float | None = None
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
            section = self._section(chain)
            closing = 2 * np.pi * turns * float(rows[3][-1])
        else:
            section = None
            for name in ("curvature", "stretch", "shear", "mounting_angle"):
                if callable(given := getattr(self, name)) or (given is not None and np.any(given)):
                    self._needs_headings(chain, name)
        pattern = spread(chain, {row: stencils.pull(moment, chain.ends) for row, moment in rows.items()})
        if self.signal is None:
            return Linear(constant=pattern, offset=-closing, strain=strain, section=section, floor=0.0)
        if section is not None:
            raise ValueError("Rest: stretch, shear and mounting_angle take no signal; give them in a Rest of their own")
        return Linear(drives=(Drive(pattern, signal_of("Rest", self.signal), "Rest", strain, closing),))

    def _section(self, chain: Discs) -> Float | None:
        """Rest stretch and shear of the links, (2, n_links); None for zero."""
        psi = 0.0 if self.mounting_angle is None else checks.number("mounting_angle of Rest", self.mounting_angle)
        found = np.array([self._sampled(name, getattr(self, name), chain.middles) for name in ("stretch", "shear")])
        found += np.array([[np.cos(psi) - 1], [-np.sin(psi)]])
        return found if found.any() else None
