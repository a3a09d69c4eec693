"""Loads of one's own: a potential in the plane, and any force.

Runs with functions in NumPy take the plain engine. Functions that numba compiles (`numba.njit`) run on the compiled engine too; the
first run of a process compiles them (some seconds), and the kernels of such loads are kept on disc as all others are.
"""

import sys
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float, Matrix
from discs.differences import slope
from discs.loads.binding import Discs, OnRod, spread
from discs.skew import Load


@dataclass(frozen=True)
class Potential(OnRod):
    """A potential energy per length, V(x, y): a disc with the share w of the length has w V and feels -w grad V.

    Parameters
    ----------
    V : function of the contact points x, y (n,) that returns (n,).
    gradient : function of the same that returns (dV/dx, dV/dy), each (n,). One that numba compiles runs on the compiled engine.
    """

    V: Callable[[Float, Float], Float]
    gradient: Callable[[Float, Float], tuple[Float, Float]]

    def on(self, chain: Discs) -> "OwnLoad":
        return self.over(chain.w, len(spread(chain, {})))

    def over(self, w: Float, rows: int) -> "OwnLoad":
        """The load at places with the shares w (n,) of the length, for coordinates (rows, n).

        Raises
        ------
        ValueError : if V or gradient is no function.
        """
        for name in ("V", "gradient"):
            if not callable(given := getattr(self, name)):
                raise ValueError(f"{name} of Potential must be a function of x and y; got {checks.shown(given)}")
        return _Field(self, w, rows)


def for_kernels(make: str, functions: tuple[Any, ...], *options: Any) -> tuple[Any, Any] | None:
    """Force and power by the function of this name in `discs.kernels.functions`; None unless all functions are numba's."""
    given = [function for function in functions if function is not None]
    if "numba" not in sys.modules:
        return None
    from numba.core.dispatcher import Dispatcher

    if not all(isinstance(function, Dispatcher) for function in given):
        return None
    from discs.kernels import functions as kernels

    pair: tuple[Any, Any] = getattr(kernels, make)(*functions, *options)
    return pair


class OwnLoad(Load):
    """A load whose force is a user's function, bound to discs. w : (n,), their shares of the length."""

    def __init__(self, of: Any, w: Float, rows: int) -> None:
        self._of, self.w = of, w
        self.damping = self.stiffness = np.zeros((rows, w.size))

    @property
    @abstractmethod
    def functions(self) -> tuple[Any, Any] | None:
        """Force and power for compiled code, or None."""

    @property
    def compiles(self) -> bool:
        """Whether numba compiles its functions, which takes seconds; in runs they are compiled with those of other loads."""
        functions = self.functions
        if functions is None:
            return False
        from discs.kernels import functions as kernels

        return kernels.addresses((functions,)) is not None


class _Field(OwnLoad):
    conservative = True

    @property
    def functions(self) -> tuple[Any, Any] | None:
        return for_kernels("of_gradient", (self._of.gradient,))

    def potential(self, t: float, q: Float) -> float:
        values = checks.called("V of Potential", self._of.V, q[0], q[1], where=f" at t = {t:g}")
        return float(self.w @ self._checked("V", values, q, t))

    def force(self, t: float, q: Float, v: Float) -> Float:
        f = np.zeros_like(q)
        found = checks.called("gradient of Potential", self._of.gradient, q[0], q[1], where=f" at t = {t:g}")
        if not isinstance(found, tuple | list | np.ndarray) or len(found) != 2:
            raise ValueError(f"gradient of Potential must return dV/dx and dV/dy; got {checks.shown(found)} at t = {t:g}")
        f[0], f[1] = (-self.w * self._checked("gradient", part, q, t) for part in found)
        return f

    def derivatives(self, t: float, q: Float, v: Float) -> tuple[Matrix, Matrix]:
        """The force on a disc depends on its place only, so all discs are moved at once."""
        rows, n = q.shape

        def along(row: int) -> Float:
            unit = np.zeros_like(q)
            unit[row] = 1.0
            return slope(lambda step: self.force(t, q + step * unit, v), float(np.abs(q[row]).max()) or 1.0)

        parts = [along(row) for row in (0, 1)]
        none = scipy.sparse.csr_array((rows * n, rows * n))
        blocks = [[scipy.sparse.diags_array(part[a]) for part in parts] for a in (0, 1)]
        corner = scipy.sparse.block_array(blocks)
        return scipy.sparse.block_diag([corner, scipy.sparse.csr_array(((rows - 2) * n,) * 2)], format="csr"), none

    def _checked(self, name: str, values: ArrayLike, q: Float, t: float) -> Float:
        """Values (n,), finite where the positions are."""
        found = checks.array(f"{name} of Potential", values, f"{self.w.size} numbers")
        if found.shape not in ((), self.w.shape) or (np.isfinite(q).all() and not np.isfinite(found).all()):
            need = f"{name} of Potential must be finite numbers of shape {self.w.shape}"
            raise ValueError(f"{need}; got {checks.shown(values)} at t = {t:g}")
        return np.broadcast_to(found, self.w.shape)


@dataclass(frozen=True)
class Custom(OnRod):
    """Any force on the discs: all that it does is work.

    Parameters
    ----------
    force : function of t, q and v, positions and velocities (rows, n) with rows x, y, theta (and phi), that returns the generalised
        forces (rows, n) on the discs, or per length.
    power : function of the same that returns the rate of its work; None for the sum of force times v.
    per_length : whether the force is per length, as fields need it: a disc with the share w of the length then takes w times it.
        The power is per length too, (n,).

    If numba compiles both, a run is compiled, by kernels that are the same for all functions and cached on disc; the functions are
    compiled once in each process. A force that raises, or is not finite, stops the run.
    """

    force: Callable[[float, Float, Float], Float]
    power: Callable[[float, Float, Float], Any] | None = None
    per_length: bool = False

    def on(self, chain: Discs) -> "OwnLoad":
        return self.over(chain.w, len(spread(chain, {})))

    def over(self, w: Float, rows: int) -> "OwnLoad":
        """The load at places with the shares w (n,) of the length, for coordinates (rows, n).

        Raises
        ------
        ValueError : if force is no function, or power neither a function nor None.
        """
        if not callable(self.force) or not (self.power is None or callable(self.power)):
            raise ValueError(f"force and power of Custom must be functions of t, q and v; got {checks.shown(self)}")
        checks.flag("per_length of Custom", self.per_length)
        return _Own(self, w, rows)


class _Own(OwnLoad):
    @property
    def functions(self) -> tuple[Any, Any] | None:
        return for_kernels("of_force", (self._of.force, self._of.power), bool(self._of.per_length))

    def force(self, t: float, q: Float, v: Float) -> Float:
        given = checks.called("force of Custom", self._of.force, t, q, v, where=f" at t = {t:g}")
        found = checks.array("force of Custom", given, f"numbers of shape {q.shape}")
        if found.shape != q.shape or not np.isfinite(found).all():
            got = f"shape {found.shape}" if found.shape != q.shape else "values that are not finite"
            raise ValueError(f"Custom: the force must be finite numbers of shape {q.shape}; got {got} at t = {t:g}")
        return self.w * found if self._of.per_length else found

    def power(self, t: float, q: Float, v: Float) -> tuple[float, float]:
        if self._of.power is None:
            return super().power(t, q, v)
        power = checks.called("power of Custom", self._of.power, t, q, v, where=f" at t = {t:g}")
        if self._of.per_length:
            power = self.w @ checks.field(f"power of Custom at t = {t:g}", power, self.w.size)
        return checks.number(f"power of Custom at t = {t:g}", power), 0.0
