"""Collocation at Gauss points: `discs.integrators.collocated` has the step."""

from abc import ABC
from typing import ClassVar

from discs.integrators.collocated import Collocated
from discs.integrators.tableaux import Tableau, tableau


class Gauss(Collocated, ABC):
    """Gauss methods conserve quadratic invariants, H with linear curvature among them, if the sweeps converge (a midpoint step
    conserves it with any number of sweeps)."""

    preserves: ClassVar[str] = "energy exactly where V is quadratic; the rolling constraint; reversible"
    reference: ClassVar[str] = "Hairer, Lubich, Wanner, Geometric Numerical Integration, II.1.3, IV.2, VIII.6"

    @property
    def rule(self) -> Tableau:
        return tableau(self.stages)


class Gauss4(Gauss):
    """Two stages."""

    name: ClassVar[str] = "gauss4"
    order: ClassVar[int] = 4
    stages: ClassVar[int] = 2


class Gauss6(Gauss):
    """Three stages."""

    name: ClassVar[str] = "gauss6"
    order: ClassVar[int] = 6
    stages: ClassVar[int] = 3


class Gauss8(Gauss):
    """Four stages."""

    name: ClassVar[str] = "gauss8"
    order: ClassVar[int] = 8
    stages: ClassVar[int] = 4
