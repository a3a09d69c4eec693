"""Local refinement: a coordinate xi in [-1, 1] in which narrow features of the initial data are wide."""

from dataclasses import dataclass

import numpy as np

from continuum.initial import Resolved
from discs.arrays import Float

REACH = 2.5  # w_c, in widths of the feature
CROWD = 0.3  # share of xi that a centre adds, relative to the rest of the rod
EVEN = 1.2  # a: with 0 functions are densest at the ends, with pi/2 they are evenly spaced


@dataclass(frozen=True)
class Density:
    """xi = sin(a u)/sin(a), u' proportional to 1 + sum_c A_c/(1 + ((s - s_c)/w_c)^2) on [0, length], from -1 to 1.

    Without centres xi is linear in s. The sine (Kosloff and Tal-Ezer, J. Comput. Phys. 104, 1993) moves functions from the ends,
    where polynomials are dense, to the interior, because narrow features send out short waves to everywhere.

    Parameters
    ----------
    centres : (s_c, w_c, A_c) for each feature: place, width and height.
    """

    length: float
    centres: tuple[tuple[float, float, float], ...] = ()

    @classmethod
    def of(cls, initial: Resolved) -> "Density":
        """The density for the narrow features of a scene. Each gets functions for a fixed share of the rod, however narrow it is.

        xi is linear if the scene is closed, and if the fields vary over short distances everywhere, so that no places are
        preferred.
        """
        scene, widths = initial.scene, np.diff(initial.pieces)
        length, middle = scene.rod.length, initial.pieces[:-1] + widths / 2
        centres, far = [], np.ones_like(widths, bool)
        for place, width in initial.features:
            reach = REACH * width
            centres.append((place, reach, CROWD * length / (np.pi * reach)))
            far &= np.abs(middle - place) > 4 * reach
        if scene.closed or not far.any() or widths[far].min() < 3 * widths.min():
            return cls(length)
        return cls(length, tuple(centres))

    def _grown(self, s: Float | float) -> Float:
        """int xi' ds, up to a factor and a constant."""
        total = np.array(s, dtype=float)
        for place, reach, height in self.centres:
            total += height * reach * np.arctan((s - place) / reach)
        return total

    @property
    def _scale(self) -> float:
        return 2 / float(self._grown(self.length) - self._grown(0.0))

    def _even(self, s: Float) -> tuple[Float, Float, Float]:
        """u, u', u'' at places s (S,)."""
        u = np.clip(self._scale * (self._grown(s) - self._grown(0.0)) - 1, -1.0, 1.0)
        rate, change = np.ones_like(s), np.zeros_like(s)
        for place, reach, height in self.centres:
            x = (s - place) / reach
            rate += height / (1 + x * x)
            change -= 2 * height * x / reach / (1 + x * x) ** 2
        return u, self._scale * rate, self._scale * change

    def coordinate(self, s: Float) -> Float:
        """xi at places s (S,)."""
        u, _, _ = self._even(s)
        return np.sin(EVEN * u) / np.sin(EVEN) if self.centres else u

    def rate(self, s: Float) -> Float:
        """xi' at places s (S,), 1/length."""
        u, rate, _ = self._even(s)
        return EVEN * np.cos(EVEN * u) / np.sin(EVEN) * rate if self.centres else rate

    def change(self, s: Float) -> Float:
        """xi'' at places s (S,), 1/length^2."""
        u, rate, change = self._even(s)
        if not self.centres:
            return change
        second: Float = EVEN / np.sin(EVEN) * (np.cos(EVEN * u) * change - EVEN * np.sin(EVEN * u) * rate**2)
        return second

    def place(self, xi: Float) -> Float:
        """s at xi (S,), by bisection and then Newton's method to round-off."""
        if not self.centres:
            return (xi + 1) * (self.length / 2)
        low, high = np.zeros_like(xi), np.full_like(xi, self.length)
        for _ in range(40):
            middle = 0.5 * (low + high)
            above = self.coordinate(middle) > xi
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        s = 0.5 * (low + high)
        for _ in range(3):
            s = np.clip(s - (self.coordinate(s) - xi) / self.rate(s), 0.0, self.length)
        return s
