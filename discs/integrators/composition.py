"""Symmetric compositions of midpoint steps: higher order, the same exact energy."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from discs.integrators.base import OneStep, Work
from discs.integrators.midpoint import Midpoint
from discs.system import Phase, SkewGradient

SUZUKI = 1 / (4 - 4 ** (1 / 3))


@dataclass(frozen=True)
class Suzuki4(OneStep):
    """Five midpoint steps of s h, s h, (1 - 4s) h, s h, s h with s = 1/(4 - 4^{1/3}); the fractions sum to 1 and their
    cubes to 0. On stiff modes, h much larger than their period, the order is lower.

    Parameters
    ----------
    base : the midpoint method that is composed.
    """

    base: Midpoint = field(default_factory=Midpoint)

    name: ClassVar[str] = "suzuki4"
    order: ClassVar[int] = 4
    preserves: ClassVar[str] = Midpoint.preserves
    reference: ClassVar[str] = "Suzuki, Phys. Lett. A 146 (1990) 319"
    stability_limit: ClassVar[float] = np.inf
    fractions: ClassVar[tuple[float, ...]] = (SUZUKI, SUZUKI, 1 - 4 * SUZUKI, SUZUKI, SUZUKI)

    def __post_init__(self) -> None:
        if not isinstance(self.base, Midpoint):
            raise ValueError(f"base must be a Midpoint; got {self.base!r}")

    def step(self, system: SkewGradient, z: Phase, h: float, work: Work) -> Phase:
        for fraction in self.fractions:
            z = self.base.step(system, z, fraction * h, work)
        return z
