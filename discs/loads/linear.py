"""Loads that are linear in positions and velocities, disc by disc."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from discs.arrays import Float
from discs.skew import Load


@dataclass(frozen=True, eq=False)
class Linear(Load):
    """f = constant - damping v - stiffness q, with rows x, y, theta (and phi) and a column for each disc.

    Its potential is the sum of stiffness q^2/2 - constant q, the least where stiffness q = constant.

    Attributes
    ----------
    constant : (rows, n), force in rows x and y, torque in the others; any shape that broadcasts with the other two.
    damping, stiffness : the same, >= 0, force per velocity and per length, torque per rate and per angle.

    Raises
    ------
    ValueError : for a negative damping or stiffness, values that are not finite, or shapes that do not fit each other.
    """

    constant: Any = 0.0
    damping: Any = 0.0
    stiffness: Any = 0.0

    def __post_init__(self) -> None:
        names = ("constant", "damping", "stiffness")
        given = [np.asarray(getattr(self, name), dtype=float) for name in names]
        try:
            values = np.broadcast_arrays(*given)
        except ValueError:
            shapes = ", ".join(str(value.shape) for value in given)
            raise ValueError(f"constant, damping and stiffness must have one shape, (rows, discs); got {shapes}") from None
        for name, value in zip(names, values, strict=True):
            if not np.isfinite(value).all() or (name != "constant" and (value < 0).any()):
                raise ValueError(f"{name} must be finite{'' if name == 'constant' else ' and at least 0'}; got {value}")
            object.__setattr__(self, name, np.array(value))
        object.__setattr__(self, "conservative", not self.damping.any())
        pushed = self.constant != 0
        push, spring = self.constant[pushed], self.stiffness[pushed]
        object.__setattr__(self, "least", -0.5 * float((push**2 / spring).sum()) if spring.all() else -np.inf)

    def potential(self, q: Float) -> float:
        return float(np.vdot(0.5 * self.stiffness * q - self.constant, q))

    def force(self, t: float, q: Float, v: Float) -> Float:
        found: Float = self.constant - self.damping * v - self.stiffness * q
        return found

    @cached_property
    def parameters(self) -> Any:
        from discs.kernels import load

        return load.Linear(self.constant, self.damping, self.stiffness)
