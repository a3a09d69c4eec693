"""Symmetric compositions of midpoint steps: higher order, the same exact energy."""

from abc import ABC
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from discs import checks
from discs.integrators.base import OneStep
from discs.integrators.midpoint import Composed, Midpoint
from discs.integrators.work import Work
from discs.skew import Phase, SkewGradient


@dataclass(frozen=True)
class Composition(OneStep, ABC):
    """Midpoint steps of symmetric fractions of h. The order is lower for stiff modes, whose period is much shorter than h.

    Parameters
    ----------
    base : the midpoint method of the substeps.

    Attributes
    ----------
    fractions : of h, one per midpoint step. Their sum is 1, the sum of their cubes 0; order 6 needs two more conditions, of which
        one is that the sum of their fifth powers is 0.
    """

    base: Midpoint = field(default_factory=Midpoint)

    fractions: ClassVar[tuple[float, ...]]
    preserves: ClassVar[str] = Midpoint.preserves
    stability_limit: ClassVar[float] = np.inf
    takes_motors: ClassVar[bool] = True
    in_lanes: ClassVar[bool] = True

    def __init_subclass__(cls) -> None:
        cls.back = -min(cls.fractions)

    def __post_init__(self) -> None:
        if not isinstance(self.base, Midpoint):
            raise ValueError(f"base must be a Midpoint; got {checks.shown(self.base)}")

    @property
    def sweep_tolerance(self) -> float:
        return self.base.tolerance

    def with_sweeps(self, tolerance: float) -> "Composition":
        return replace(self, base=self.base.with_sweeps(tolerance))

    def step(self, system: SkewGradient, z: Phase, t: float, h: float, work: Work) -> Phase:
        stuck = work.unconverged + 1
        for fraction in self.fractions:
            z = self.base.step(system, z, t, fraction * h, work)
            t += fraction * h
        work.unconverged = min(work.unconverged, stuck)  # one step, whatever number of substeps
        return z

    @cached_property
    def parameters(self) -> Composed:
        return self.base.parameters._replace(fractions=np.array(self.fractions))


SUZUKI = 1 / (4 - 4 ** (1 / 3))


class Suzuki4(Composition):
    """Five midpoint steps of s h, s h, (1 - 4s) h, s h, s h with s = 1/(4 - 4^{1/3})."""

    name: ClassVar[str] = "suzuki4"
    order: ClassVar[int] = 4
    reference: ClassVar[str] = "Suzuki, Phys. Lett. A 146 (1990) 319"
    fractions: ClassVar[tuple[float, ...]] = (SUZUKI, SUZUKI, 1 - 4 * SUZUKI, SUZUKI, SUZUKI)


KAHAN_LI = (0.39216144400731413928, 0.33259913678935943860, -0.70624617255763935981, 0.082213596293550800230)


class KahanLi6(Composition):
    """Nine midpoint steps, the longest fraction 0.80: the composition of order 6 with nine stages and the least error coefficient
    of those that Kahan and Li found."""

    name: ClassVar[str] = "kahanli6"
    order: ClassVar[int] = 6
    reference: ClassVar[str] = "Kahan, Li, Math. Comp. 66 (1997) 1089; Hairer, Lubich, Wanner, V.3.2"
    fractions: ClassVar[tuple[float, ...]] = (*KAHAN_LI, 1 - 2 * sum(KAHAN_LI), *KAHAN_LI[::-1])
