"""Types of arrays for annotations; shapes and units stand in the docstrings."""

from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

Float: TypeAlias = NDArray[np.float64]
Complex: TypeAlias = NDArray[np.complex128]
Int: TypeAlias = NDArray[np.intp]
Bool: TypeAlias = NDArray[np.bool_]
Array: TypeAlias = NDArray[Any]  # of any dtype, as an array of a file or of a user's formula
Matrix: TypeAlias = Any  # a Float of two dimensions or a SciPy sparse array, for which SciPy gives no types


class Spline(Protocol):
    """A SciPy spline, for which SciPy gives no types."""

    def __call__(self, x: Float, /) -> Float: ...

    def derivative(self, nu: int = 1, /) -> "Spline": ...

    def antiderivative(self, nu: int = 1, /) -> "Spline": ...
