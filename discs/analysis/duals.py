"""Numbers that carry their derivatives: arrays with the sparse matrix of their derivatives with respect to given numbers.

A function of frames written in NumPy is differentiated by calling it with them. A ufunc is differentiated by the complex step, so
all that are analytic are known, and three more.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from discs.arrays import Float, Matrix

TINY = 1e-30  # the complex step: no digits are lost, as nothing is subtracted
SLOPES: dict[Any, Callable[..., tuple[Float, ...]]] = {  # of ufuncs that have no complex form
    np.absolute: lambda x: (np.sign(x),),
    np.hypot: lambda x, y: (x / np.hypot(x, y), y / np.hypot(x, y)),
    np.arctan2: lambda y, x: (x / (x * x + y * y), -y / (x * x + y * y)),
    np.maximum: lambda x, y: (1.0 * (x >= y), 1.0 * (x < y)),
    np.minimum: lambda x, y: (1.0 * (x <= y), 1.0 * (x > y)),
}
COMPARISONS = (np.less, np.less_equal, np.greater, np.greater_equal, np.equal, np.not_equal, np.sign, np.isfinite, np.floor)


class Dual(np.lib.mixins.NDArrayOperatorsMixin):
    """An array and its derivatives.

    Attributes
    ----------
    value : of any shape. slope : sparse (value.size, inputs), entries of the value in C order.
    """

    def __init__(self, value: Any, slope: Matrix) -> None:
        self.value, self.slope = np.asarray(value, float), slope

    shape = property(lambda self: self.value.shape)
    size = property(lambda self: self.value.size)
    ndim = property(lambda self: self.value.ndim)
    T = property(lambda self: self._taken(lambda places: places.T))

    def __len__(self) -> int:
        return len(self.value)

    def __getitem__(self, key: Any) -> "Dual":
        return self._taken(lambda places: places[key])

    def reshape(self, *shape: Any) -> "Dual":
        return self._taken(lambda places: places.reshape(*shape))

    def ravel(self) -> "Dual":
        return self.reshape(-1)

    def sum(self, axis: Any = None, **options: Any) -> "Dual":
        places = np.arange(self.size).reshape(self.shape)
        kept = self.value.sum(axis, keepdims=True)
        into = np.broadcast_to(np.arange(kept.size).reshape(kept.shape), self.shape).ravel()
        adder = scipy.sparse.csr_array((np.ones(self.size), (into, places.ravel())), shape=(kept.size, self.size))
        return Dual(self.value.sum(axis, **options), adder @ self.slope)

    def mean(self, axis: Any = None, **options: Any) -> "Dual":
        total = self.sum(axis, **options)
        return total * (total.size / self.size)  # type: ignore[no-any-return]

    def __float__(self) -> float:
        raise TypeError("a cost must keep its derivatives: leave out float(...), .item() and functions that need plain numbers")

    def _taken(self, take: Callable[[Any], Any]) -> "Dual":
        places = take(np.arange(self.size).reshape(self.shape))
        return Dual(self.value.ravel()[places], self.slope[np.ravel(places)])

    def __array_ufunc__(self, ufunc: Any, how: str, *given: Any, **options: Any) -> Any:
        if how == "reduce" and ufunc is np.add:
            return given[0].sum(**{name: value for name, value in options.items() if name in ("axis", "keepdims")})
        values = [x.value if isinstance(x, Dual) else x for x in given]
        if how != "__call__" or options.get("out") is not None:
            return NotImplemented
        if ufunc in COMPARISONS:
            return ufunc(*values)
        if ufunc is np.matmul:
            return _product(*given)
        found = ufunc(*values)
        total: Any = scipy.sparse.csr_array((np.size(found), next(x for x in given if isinstance(x, Dual)).slope.shape[1]))
        for k, x in enumerate(given):
            if isinstance(x, Dual):
                if ufunc in SLOPES:
                    slope = SLOPES[ufunc](*values)[k]
                else:
                    slope = ufunc(*[v + TINY * 1j if j == k else v for j, v in enumerate(values)]).imag / TINY
                places = np.broadcast_to(np.arange(x.size).reshape(x.shape), np.shape(found)).ravel()
                factor = np.broadcast_to(slope, np.shape(found)).ravel()
                total = total + scipy.sparse.diags_array(factor) @ x.slope[places]
        return Dual(found, total.tocsr())

    def __array_function__(self, function: Any, types: Any, given: Any, options: Any) -> Any:
        if function not in FUNCTIONS:
            known = "arithmetic, ufuncs, indices, sum, mean, diff, dot and @"
            raise TypeError(f"np.{function.__name__} is not followed: write the cost by {known}, or give cost_gradient")
        return FUNCTIONS[function](*given, **options)


def _product(a: Any, b: Any) -> Any:
    """a @ b of vectors and matrices."""
    if np.ndim(a) > 2 or np.ndim(b) > 2 or not np.ndim(a) or not np.ndim(b):
        raise TypeError("a cost cannot be differentiated through products of arrays with more than two dimensions, or none")
    if np.ndim(b) == 1:
        return (a * b).sum(axis=-1)
    if np.ndim(a) == 1:
        return (a[:, None] * b).sum(axis=0)
    return (a[:, :, None] * b[None]).sum(axis=1)


FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.sum: lambda x, axis=None, **options: x.sum(axis, **options),
    np.mean: lambda x, axis=None, **options: x.mean(axis, **options),
    np.dot: _product,
    np.diff: lambda x, n=1, axis=-1: _differences(x, n, axis),
    np.ravel: lambda x: x.ravel(),
    np.reshape: lambda x, shape: x.reshape(shape),
    np.shape: lambda x: x.shape,
    np.ndim: lambda x: x.ndim,
    np.size: lambda x: x.size,
    np.real: lambda x: x,
}


def _differences(x: Dual, n: int, axis: int) -> Dual:
    for _ in range(n):
        after, before = ([slice(None)] * x.ndim for _ in range(2))
        after[axis], before[axis] = slice(1, None), slice(None, -1)
        x = x[tuple(after)] - x[tuple(before)]
    return x
