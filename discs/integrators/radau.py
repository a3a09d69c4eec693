"""Radau IIA methods: `discs.integrators.collocated` has the step."""

from abc import ABC
from typing import ClassVar

from discs.integrators.collocated import Collocated
from discs.integrators.tableaux import Tableau, radau


class RadauIIA(Collocated, ABC):
    """Collocation whose last stage is the end of the step, for stiff damping.

    L-stable: what decays at a rate a >> 1/h is gone after a step, where the midpoint rule and Gauss methods multiply it by +-1.
    Oscillations that are not resolved are damped too, and the energy falls, also without dampers. That of an oscillation of rate
    Omega falls by the factor 1 - (h Omega)^4/36 (two stages) or 1 - (h Omega)^6/3600 (three) in a step, to leading order.
    """

    damps: ClassVar[bool] = True
    preserves: ClassVar[str] = "the rolling constraint; not the energy: oscillations are damped, fast ones most"
    reference: ClassVar[str] = "Hairer, Wanner, Solving Ordinary Differential Equations II, IV.5, IV.8"

    @property
    def rule(self) -> Tableau:
        return radau(self.stages)


class Radau3(RadauIIA):
    """Two stages."""

    name: ClassVar[str] = "radau3"
    order: ClassVar[int] = 3
    stages: ClassVar[int] = 2


class Radau5(RadauIIA):
    """Three stages."""

    name: ClassVar[str] = "radau5"
    order: ClassVar[int] = 5
    stages: ClassVar[int] = 3
