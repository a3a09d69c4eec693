"""How kernels are compiled: `kernel` for those called from Python, `part` for their parts, `fill` for the parts that differ by
chain.

Kernels are cached on disc, so compiling is paid once per machine. numba knows a cached kernel by the file it stands in, not by
those it calls; the cache is therefore kept in a folder named by the content of all kernels.
"""

import hashlib
import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numba
from numba.extending import overload

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}
# Parts of a kernel: no counting of references, as what they are given is held by the kernel and they make no arrays; no way in
# from Python.
PART: dict[str, Any] = OPTIONS | {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def _cache() -> str:
    sources = sorted(Path(__file__).parent.glob("*.py"))
    content = hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:16]
    base = Path(numba.config.CACHE_DIR) if numba.config.CACHE_DIR else Path(__file__).parent / "__pycache__"
    return str(base / f"kernels-{content}")


CACHE = _cache()


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile a function at its first call; where CACHE cannot be written numba keeps its cache with the user's."""
    if function is None:
        return partial(kernel, **options)
    own, numba.config.CACHE_DIR = numba.config.CACHE_DIR, CACHE
    try:
        return numba.njit(cache=True, **OPTIONS | options)(function)
    finally:
        numba.config.CACHE_DIR = own


def part(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile a function that only kernels call, and that makes no arrays."""
    return partial(part, **options) if function is None else numba.njit(**PART | options)(function)


def fill(stub: Callable[..., Any], chain: type, **options: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a function that every chain has its form for one `chain`, the type of its first argument."""

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        def choose(first: Any, *rest: Any) -> Any:
            return function if getattr(first, "instance_class", None) is chain else None

        choose.__signature__ = inspect.signature(function)  # type: ignore[attr-defined]  # numba asks for the same one
        overload(stub, jit_options=PART | options)(choose)
        return function

    return register
