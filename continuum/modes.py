"""The matrices of the sweeps of a step: C^T (grad^2 V) C and C^T D C at one configuration, for every length of step."""

from typing import Any, NamedTuple

import numpy as np

from discs.arrays import Complex, Float


class Modes(NamedTuple):
    """The eigenvectors of C^T (grad^2 V) C at a configuration: values (n,), vectors (n, n) as columns, back their transpose.

    inverses : (pairs, n, n), of a damped rod, see `Pencil`; otherwise without entries.
    """

    values: Float
    vectors: Float
    back: Float
    inverses: Complex = np.empty((0, 0, 0), complex)

    def at(self, h: float, pairs: Complex) -> "Modes":
        """The matrices for steps of length h, as compiled code takes them."""
        return self

    def solve(self, d: complex, g: complex, rest: Float) -> Float:
        """Solve (I + d C^T D C + g C^T (grad^2 V) C) p = rest; here D = 0."""
        return self.vectors @ ((self.back @ rest) / (1 + g * self.values))


class Pencil(NamedTuple):
    """The matrices C^T (grad^2 V) C and C^T D C of a damped rod at a configuration, both (n, n).

    They have no common eigenvectors, so each step has one inverse matrix for each pair of stages.
    """

    stiffness: Float
    damping: Float

    def at(self, h: float, pairs: Complex) -> Modes:
        none = np.empty((0, 0))
        inverses = np.linalg.inv(np.stack([self._matrix(h * value, h * h * value * value) for value in pairs]))
        return Modes(np.empty(0), none, none, inverses.astype(np.complex128, copy=False))

    def solve(self, d: complex, g: complex, rest: Float) -> Float:
        found: Float = np.linalg.solve(self._matrix(d, g), rest)
        return found

    def _matrix(self, d: complex, g: complex) -> Any:
        return np.eye(len(self.damping)) + d * self.damping + g * self.stiffness
