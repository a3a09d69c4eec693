"""Resistance to rolling and turning, and viscosity of the rod."""

from dataclasses import dataclass

import numpy as np

from discs.chains.chain import SteeredChain
from discs.loads.binding import Discs, OnRod, Pattern, spread
from discs.loads.linear import Linear


@dataclass(frozen=True, eq=False)
class Damping(OnRod):
    r"""Linear damping, which dissipates

        sum w (rolling omega^2 + turning phi.^2) + sum_links k (torsion omega'^2 + bending (phi.')^2)

    per time, with differences of neighbours over k for the derivatives by s: Kelvin-Voigt moments beta theta' + torsion omega'.

    Parameters
    ----------
    rolling : torque per rate and length, >= 0; a number, an array (n,) or a function of s.
    turning : the same about the vertical, for discs with their own headings.
    torsion : >= 0, in units of the torsion stiffness times time; a number, an array over the links or a function of s.
    bending : the same for the bending stiffness, for discs with their own headings.
    """

    rolling: Pattern = 0.0
    turning: Pattern = 0.0
    torsion: Pattern = 0.0
    bending: Pattern = 0.0

    def on(self, chain: Discs) -> Linear:
        steered = isinstance(chain, SteeredChain)
        names = ("rolling", "turning")[: 1 + steered]
        rates = [self._sampled(name, getattr(self, name), chain.s, 0.0) * chain.w for name in names]
        links = [self._sampled(name, getattr(self, name), chain.middles, 0.0) for name in ("torsion", "bending")[: 1 + steered]]
        if not steered:
            for name in ("turning", "bending"):
                if callable(given := getattr(self, name)) or np.any(given):
                    self._needs_headings(chain, name)
        viscosity = np.zeros((len(links), chain.n + 1))
        viscosity[:, 1 : 1 + links[0].size] = np.array(links) / chain.k
        viscosity[:, 0] = viscosity[:, -1]
        damping = spread(chain, dict(enumerate(rates, start=2)))
        return Linear(damping=damping, viscosity=viscosity if viscosity.any() else None)
