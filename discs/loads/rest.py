"""Rest shapes: springs whose energy is least at a given twist or curvature."""

from dataclasses import dataclass, replace

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.chains import stencils
from discs.chains.chain import SteeredChain
from discs.loads.bends import bends_of
from discs.loads.binding import Discs, OnRod, Pattern, nonzero, signal_of, spread, within
from discs.loads.linear import Drive, Linear
from discs.loads.signals import Signal


@dataclass(frozen=True, eq=False)
class Rest(OnRod):
    r"""Rest strains: torsion energy beta/2 (theta' - twist signal)^2, and for discs with their own headings bending energy
    K/2 (phi' - curvature signal)^2 and A/2 (Gamma_1 - stretch)^2 + G/2 (Gamma_2 - shear)^2. Where headings follow the line, the
    bending energy is K/2 |r'' - curvature signal J r'|^2 (`discs.loads.bends`), or K/2 (phi' - curvature)^2 with the true
    curvature. Rest strains of several loads add up.

    With the strain a of a link, its rest strain e and its stiffness S, S (a - e)^2/2 = S a^2/2 - S e a + S e^2/2: the rest shape
    adds the force B^T S e and an energy. Where e depends on time, the links do the work -int S (a - e) de. It is recorded as the
    work of B^T S e in the steps and the change of S e^2/2 - S e a, which balances the energy exactly. For the curvature of a line
    the force depends on r too, but the energy stays quadratic and the balance exact.

    Parameters
    ----------
    twist : theta' at rest, rad per length; a number, an array over the links or a function of s.
    curvature : phi' at rest, the same; where headings follow the line an array is over the bends, as `Chain.bending_stiffness`. It
        takes no signal with the true curvature.
    stretch, shear : Gamma at rest, for discs with their own headings, as twist; they take no signal, and run on the plain engine.
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
        twist = self._sampled("twist", self.twist, chain.middles)
        rows, strain = {2: np.asarray(chain.torsion_stiffness) * twist}, np.zeros((2, twist.size))
        strain[0] = np.sqrt(np.asarray(chain.torsion_stiffness) * chain.k) * twist
        section, bends, closing = None, None, 0.0
        if isinstance(chain, SteeredChain):
            curvature = self._sampled("curvature", self.curvature, chain.middles)
            rows[3] = np.asarray(chain.bending_stiffness) * curvature
            strain[1] = np.sqrt(np.asarray(chain.bending_stiffness) * chain.k) * curvature
            section, closing = self._section(chain), 2 * np.pi * chain.turns * float(chain.tension(rows[3])[-1])
        else:
            for name in ("stretch", "shear", "mounting_angle"):
                if nonzero(getattr(self, name)):
                    self._needs_headings(chain, name)
            if nonzero(self.curvature):
                curvature = self._sampled("curvature", self.curvature, within(chain, chain.bends))
                if chain.link_law.quadratic:
                    bends = bends_of(chain, curvature=curvature)
                else:
                    section = curvature
        pattern = spread(chain, {row: stencils.pull(chain.tension(moment), chain.ends) for row, moment in rows.items()})
        if self.signal is None:
            return Linear(constant=pattern, offset=-closing, strain=strain, section=section, bends=bends, floor=0.0)
        if section is not None:
            if isinstance(chain, SteeredChain):
                raise ValueError("Rest: stretch, shear and mounting_angle take no signal; give them in a Rest of their own")
            raise ValueError("Rest: curvature takes no signal on a chain with curvature='true'; give it in a Rest of its own")
        curved = None if bends is None else bends.rest
        drive = Drive(pattern, signal_of("Rest", self.signal), "Rest", strain, closing, curved)
        return Linear(drives=(drive,), bends=None if bends is None else replace(bends, rest=0 * bends.rest))

    def _section(self, chain: Discs) -> Float | None:
        """Rest stretch and shear of the links, (2, n_links); None for zero."""
        psi = 0.0 if self.mounting_angle is None else checks.number("mounting_angle of Rest", self.mounting_angle)
        found = np.array([self._sampled(name, getattr(self, name), chain.middles) for name in ("stretch", "shear")])
        found += np.array([[np.cos(psi) - 1], [-np.sin(psi)]])
        return found if found.any() else None
