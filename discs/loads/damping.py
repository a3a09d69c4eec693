"""Resistance to rolling and turning, and viscosity of the rod."""

from dataclasses import dataclass

import numpy as np

from discs.chains.chain import SteeredChain
from discs.loads.bends import bends_of
from discs.loads.binding import Discs, OnRod, Pattern, nonzero, spread, within
from discs.loads.linear import Linear


@dataclass(frozen=True, eq=False)
class Damping(OnRod):
    r"""Linear damping, which dissipates

        sum w (rolling omega^2 + turning phi.^2) + sum_links k (torsion omega'^2 + bending (phi.')^2)

    per time, with differences of neighbours over k for the derivatives by s: Kelvin-Voigt moments beta theta' + torsion omega'.
    Where headings follow the line, bending dissipates sum_bends w bending kappa.^2 with kappa = J r' . r'', or kappa = phi' with
    the true curvature (`discs.loads.bends`): a rod that turns without bending dissipates nothing.

    Parameters
    ----------
    rolling : torque per rate and length, >= 0; a number, an array (n,) or a function of s.
    turning : the same about the vertical, for discs with their own headings.
    torsion : >= 0, in units of the torsion stiffness times time; a number, an array over the links or a function of s.
    bending : the same for the bending stiffness; where headings follow the line an array is over the bends.
    """

    rolling: Pattern = 0.0
    turning: Pattern = 0.0
    torsion: Pattern = 0.0
    bending: Pattern = 0.0

    def on(self, chain: Discs) -> Linear:
        steered = isinstance(chain, SteeredChain)
        names = ("rolling", "turning")[: 1 + steered]
        rates = [self._sampled(name, getattr(self, name), within(chain, chain.s), 0.0) * chain.w for name in names]
        links = [self._sampled(name, getattr(self, name), chain.middles, 0.0) for name in ("torsion", "bending")[: 1 + steered]]
        bends = None
        if not isinstance(chain, SteeredChain):
            if nonzero(self.turning):
                self._needs_headings(chain, "turning")
            if nonzero(self.bending):
                bends = bends_of(chain, viscosity=self._sampled("bending", self.bending, within(chain, chain.bends), 0.0))
        viscosity = np.zeros((len(links), chain.n + 1))
        viscosity[:, 1 : 1 + links[0].size] = np.array(links) / chain.k
        viscosity[:, 0] = viscosity[:, -1]
        damping = spread(chain, dict(enumerate(rates, start=2)))
        return Linear(damping=damping, viscosity=viscosity if viscosity.any() else None, bends=bends, degree=chain.degree)
