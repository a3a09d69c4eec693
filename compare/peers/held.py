"""The reduced equations of one chain, compiled with its parameters as constants, and kept in the cache of kernels.

The cache grows by some hundred kilobytes with each chain: this is for the few of the main job, which then start without compiling.
"""

from collections.abc import Callable
from typing import Any

from discs.arrays import Float
from discs.kernels import driver
from discs.kernels.compiled import compiled, formed, jit

equations = jit(driver.reduced.__wrapped__)  # type: ignore[attr-defined]


def held(chain: Any) -> Callable[[float, Float, Float], None]:
    """f(t, y, out) for a compiled chain without loads."""

    def f(t, y, out):  # type: ignore[no-untyped-def]
        equations(chain, t, y, out)

    return compiled(f, *formed((type(chain), *map(type, chain))))
