r"""Verified derivatives of a user's formulas M(q), V(q), A(q).

The complex step f(q + i h v) = f(q) + i h df/dq.v + O(h^2), h = 1e-30, has no rounding error, but it needs an analytic formula that
keeps complex numbers: `abs`, `np.linalg.norm`, an array of real numbers that is filled in, or a branch drop the imaginary part.
Real differences always work, but have an error. Both are used:

* At the first q every partial derivative is computed both ways. The two must agree within the error of the differences.
* Later every complex step is compared with one real difference (order 4, four evaluations) along a direction that changes all
  coordinates. If they disagree, all partial derivatives are compared again.
* A formula whose complex step fails once is differentiated by real differences from then on: order 8, with the error estimated
  from order 6, about 1e-12 of the largest entry. `Formula.error` is the latest estimate.

Each coordinate has its own step h of real differences. The search starts at a very small h and multiplies it by ten: the rounding
error eps |f|/h falls, and h may grow as long as each derivative agrees with the best one so far within its error. A narrow feature
of f is resolved before h is too long for it, and the result does not depend on units.
"""

import importlib
import sys
import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float

STEP = 1e-30  # of the complex step
EPS = float(np.finfo(float).eps)
ENOUGH = 1e-12  # relative error at which the search for a step stops
USABLE = 1e-3  # relative error above which a real difference is no check: |q| is so large that rounding hides f's features
MOST_SLACK = 1e-6
ACCURATE = 1e-9  # a relative error above this, and twice that of the last search, starts a new search for the step
AGAIN = 20  # so many derivatives after the last search the error of it does not count: it may have been at a kink
# weights of f(q + j h) - f(q - j h), j = 1 ... 4
ORDER_8 = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
ORDER_6 = np.array([3 / 4, -3 / 20, 1 / 60, 0])
ORDER_4 = np.array([2 / 3, -1 / 12])
ORDER_2 = np.array([1 / 2, 0])


class Formula:
    """A function q -> array of a given shape, with checked values and verified derivatives.

    Parameters
    ----------
    name : what messages call it, "V".
    call : the function of q (m,).
    shape : of its values; () is a number.
    size : m.
    arguments : what messages call q; for a function of t and q that is given as one of the vector (t, q), "t, q".
    cancels : whether values are small differences of terms, as of a constraint phi(q, v) that is 0: rounding then is relative to
        the terms, which are judged by the change of f where one argument is set to 0.

    Attributes
    ----------
    how : "complex step" or "real differences", after the first derivative.
    error : estimated error of its last derivatives, relative to their largest entry; 0 for the complex step.
    """

    def __init__(
        self,
        name: str,
        call: Callable[[Float], Any],
        shape: tuple[int, ...],
        size: int,
        arguments: str = "q",
        cancels: bool = False,
    ) -> None:
        self.name, self.shape, self.size, self.arguments = name, shape, size, arguments
        self.how, self.error = "complex step", 0.0
        self._call = call
        self._searched, self._since = 0.0, 0  # error at the last search, derivatives since then
        self._cancels, self._terms = cancels, 0.0  # size of the terms of f where they cancel
        self._steps: Float | None = None  # (m,), of real differences
        self._verified = False  # whether the complex step agreed with real differences once
        self._slack = 0.0  # relative difference from real differences that rounding was found to explain
        self._mix = np.cos(1.0 + 3.7 * np.arange(size)) / 4 + 0.75 * (-1.0) ** np.arange(size)  # 1/2 ... 1 in size, both signs

    def __call__(self, q: Float) -> Float:
        """The value at q, finite or not."""
        with np.errstate(all="ignore"), _double():
            try:
                given = self._call(np.array(q, dtype=float))
            except ArithmeticError as error:
                raise ValueError(f"{self.name}({self.arguments}) raised {type(error).__name__}: {error}") from error
        value = self._array(given, None)
        kind = value.dtype.kind
        if kind not in "fiuO" or (kind == "f" and value.dtype.itemsize < 8):
            raise ValueError(f"{self.name}({self.arguments}) must be real numbers in double precision; got {value.dtype}")
        return self._array(value, float)

    def along(self, q: Float, v: Float) -> Float:
        """df/dq.v, of the formula's shape."""
        steps = self._ready(q)
        with np.errstate(all="ignore"):
            reach = float(np.max(np.abs(v) / steps))
        if reach < 1e-300:  # 1/reach would overflow
            return np.zeros(self.shape)
        return self._derivatives(q, v[:, None], np.array([1 / reach]), v)[..., 0]

    def slopes(self, q: Float) -> Float:
        """df/dq, (*shape, m)."""
        steps = self._ready(q)
        return self._derivatives(q, np.eye(self.size), self._mix * steps, None)

    def _derivatives(self, q: Float, directions: Float, weights: Float, v: Float | None) -> Float:
        """Derivatives along the columns of `directions` (m, k); the check is along directions @ weights."""
        assert self._steps is not None
        if self.how == "complex step":
            found = self._complex(q, directions)
            if found is not None and self._verified and (1e3 * EPS * np.abs(q) > self._steps).any():
                return found  # |q| is so large that differences cannot check f: a trial state of a step that will be rejected
            off = np.inf if found is None else self._off(q, found @ weights, directions @ weights)
            if found is not None and off <= self._slack:
                return found
            whole = self._examine(q)
            if self.how == "complex step" and found is not None:
                self._slack = min(2 * off, MOST_SLACK)  # the comparison was too strict: this formula has more rounding than most
                return found
            return whole if v is None else (whole @ v)[..., None]
        # one direction: the shortest step that its coordinates allow
        scales = weights if v is not None else self._steps
        taken = [self._difference(q, h * d, 1 / h) for h, d in zip(scales, directions.T, strict=True)]
        found, error = np.stack([d for d, _ in taken], axis=-1), max(e for _, e in taken)
        size = float(np.abs(found).max(initial=0.0))
        self._since += 1
        if not error <= max(ACCURATE, 2 * self._searched * (self._since < AGAIN)) * size:
            whole = self._examine(q)
            return whole if v is None else (whole @ v)[..., None]
        self.error = error / size if size else 0.0
        return found

    # The complex step

    def _complex(self, q: Float, directions: Float) -> Float | None:
        """Derivatives along the columns by the complex step; None where the formula does not take complex numbers."""
        found = []
        try:
            with np.errstate(all="ignore"), warnings.catch_warnings(), _double():
                warnings.simplefilter("ignore")  # about discarded imaginary parts, which the check detects
                for d in directions.T:
                    found.append(np.imag(self._array(self._call(q + 1j * STEP * d), complex)) / STEP)
        except Exception:  # a formula may raise anything for complex numbers
            return None
        return np.stack(found, axis=-1)

    def _off(self, q: Float, found: Float, d: Float) -> float:
        """Relative difference of `found`, a derivative along d, and a real one of order 4, beyond that one's error."""
        pairs = self._pairs(q, d, 2)
        if pairs is None or not np.isfinite(found).all():
            return np.inf
        differences, size = pairs
        fourth, second = (np.tensordot(w, differences, 1) for w in (ORDER_4, ORDER_2))
        allowed = 1e-2 * np.abs(fourth - second).max(initial=0.0) + 100 * EPS * size
        beyond = np.abs(found - fourth).max(initial=0.0) - allowed
        return float(beyond / np.abs(fourth).max()) if beyond > 0 else 0.0

    # Real differences

    def _ready(self, q: Float) -> Float:
        if self._steps is None:
            if not np.isfinite(self(q)).all():
                raise ValueError(f"{self.name} is not finite at {self.arguments} = {q}")
            self._refuse_single(q)
            self._examine(q)
        assert self._steps is not None
        return self._steps

    def _refuse_single(self, q: Float) -> None:
        """ValueError if all entries that change with q are numbers of single precision at several places."""
        base, changed, single = self(q), np.zeros(self.shape, dtype=bool), np.ones(self.shape, dtype=bool)
        for j in range(1, 4):
            try:
                value = self(q + 1e-3 * j * self._mix * np.maximum(np.abs(q), 1e-3))
            except (ArithmeticError, ValueError):
                return
            changed |= value != base
            with np.errstate(over="ignore"):
                single &= value.astype(np.float32) == value
        if changed.any() and single[changed].all():
            raise ValueError(
                f"{self.name}({self.arguments}) is computed in single precision, with 7 digits, too few for its derivatives; "
                "use float64"
            )

    def _examine(self, q: Float) -> Float:
        """df/dq by real differences with steps sought anew, and whether the complex step agrees with it."""
        if self._cancels:
            self._terms = max(self._terms, *(self._change(q, q * others) for others in 1 - np.eye(self.size)))
        found, errors, steps = zip(*(self._search(q, k) for k in range(self.size)), strict=True)
        self._steps, whole = np.array(steps), np.stack(found, axis=-1)
        size = float(np.abs(whole).max(initial=0.0))
        error = max(errors) / size if size else 0.0
        if self.how == "complex step":
            by_step = self._complex(q, np.eye(self.size))
            if by_step is not None and np.isfinite(by_step).all():
                agree = bool((np.abs(by_step - whole) <= 10 * np.array(errors) + 1e-3 * ENOUGH * size).all())
                if (agree and error < USABLE) or (self._verified and error >= USABLE):
                    self._verified = True
                    return by_step
            self.how = "real differences"
        self.error, self._searched, self._since = error, error, 0
        return whole

    def _search(self, q: Float, k: int) -> tuple[Float, float, float]:
        """Derivative along coordinate k, its error, and the step; see the module's docstring."""
        unit = np.eye(self.size)[k]
        step = max(1e-12 * abs(q[k]), 1e-12)
        longest = 1e-2 * max(abs(q[k]), 1.0)
        best: tuple[Float, float, float] | None = None
        while step <= longest:
            new, error = self._difference(q, step * unit, 1 / step)
            error += 4 * EPS * abs(q[k]) / step * float(np.abs(new).max(initial=0.0))  # the step itself is rounded
            if best is not None and not np.abs(new - best[0]).max(initial=0.0) <= 2 * (best[1] + error):
                break  # too long: it disagrees with a shorter step
            if not np.isfinite(error):
                if best is not None:
                    break
            elif best is None or error <= best[1]:
                best = new, error, step
                if 0 < error <= ENOUGH * np.abs(new).max():
                    break
            step *= 10
        if best is None:
            raise ValueError(f"{self.name} is not finite near {self.arguments} = {q}: it has no derivative there")
        return best

    def _difference(self, q: Float, d: Float, scale: float) -> tuple[Float, float]:
        """Derivative along d times `scale` by differences of order 8, and its error."""
        pairs = self._pairs(q, d, 4)
        if pairs is None:
            return np.full(self.shape, np.nan), np.inf
        differences, size = pairs
        eighth, sixth = (np.tensordot(w, differences, 1) for w in (ORDER_8, ORDER_6))
        return eighth * scale, float(4 * np.abs(eighth - sixth).max(initial=0.0) + 2 * EPS * size) * scale

    def _pairs(self, q: Float, d: Float, count: int) -> tuple[Float, float] | None:
        """f(q + j d) - f(q - j d), j = 1 ... count, and the largest |f|; None if one of them is not finite."""
        found, size = [], self._terms
        for j in range(1, count + 1):
            try:
                after, before = self(q + j * d), self(q - j * d)
            except ShapeError:
                raise
            except (ArithmeticError, ValueError):  # a root of a negative number, an exponential too large
                return None
            size = max(size, float(np.abs(after).max(initial=0.0)), float(np.abs(before).max(initial=0.0)))
            found.append(after - before)
        return (np.array(found), size) if np.isfinite(size) else None

    def _change(self, q: Float, other: Float) -> float:
        """The largest difference of values at q and another place; 0 where there are none."""
        try:
            change = np.abs(self(q) - self(other)).max(initial=0.0)
        except (ArithmeticError, ValueError):
            return 0.0
        return float(change) if np.isfinite(change) else 0.0

    def _array(self, given: Any, dtype: type | None) -> Float:
        """A formula's value as a new array of the right shape; one row may be given as a vector."""
        if scipy.sparse.issparse(given):
            given = given.toarray()
        try:
            value = np.array(given, dtype=dtype)
        except (TypeError, ValueError):
            if dtype is complex:
                raise
            raise ValueError(f"{self.name}({self.arguments}) must be numbers of shape {self.shape}; got {given!r}") from None
        wanted = int(np.prod(self.shape))
        if value.shape != self.shape and value.size == wanted and (wanted <= 1 or value.ndim < 2):
            return value.reshape(self.shape)
        if value.shape != self.shape:
            raise ShapeError(f"{self.name}({self.arguments})", self.shape, value.shape)
        return value


class ShapeError(ValueError):
    """A formula's value of a wrong shape."""

    def __init__(self, name: str, wanted: tuple[int, ...], given: tuple[int, ...]) -> None:
        super().__init__(f"{name} must be of shape {wanted}; got {given}")
        self.given = given


def _double() -> AbstractContextManager[object]:
    """A context in which JAX, if it is imported, uses double precision instead of its default, single precision."""
    jax = sys.modules.get("jax")
    if jax is None:
        return nullcontext()
    if hasattr(jax, "enable_x64"):
        double: AbstractContextManager[object] = jax.enable_x64(True)
    else:  # before jax 0.8
        double = importlib.import_module("jax.experimental").enable_x64()
    return double
