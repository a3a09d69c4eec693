"""How kernels are compiled: `kernel` for those called from Python, `part` for their parts, `fill` for the parts that differ by
chain. With NUMBA_DISABLE_JIT=1 all run as plain Python, for a debugger and to see which lines are reached.

Kernels are cached on disc, so compiling is paid once per machine. numba knows a cached kernel by the file it stands in, not by
those it calls; the cache is therefore kept in a folder named by the content of all kernels.
"""

import hashlib
import inspect
from collections.abc import Callable
from functools import cache, partial, singledispatch, wraps
from pathlib import Path
from typing import Any

import numba
from numba.extending import overload

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}
# Parts of a kernel: no counting of references, as what they are given is held by the kernel and they make no arrays; no way in
# from Python.
PART: dict[str, Any] = OPTIONS | {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


@cache
def _cache(folder: Path) -> str:
    """Where compiled kernels of a folder are kept: they may call all that is in it, and all that is here."""
    here = Path(__file__).parent
    sources = sorted(here.glob("*.py")) + sorted(folder.glob("*.py")) * (folder != here)
    content = hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:16]
    base = Path(numba.config.CACHE_DIR) if numba.config.CACHE_DIR else here / "__pycache__"
    return str(base / f"kernels-{content}")


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile a function at its first call; where the cache cannot be written numba keeps it with the user's."""
    if function is None:
        return partial(kernel, **options)
    folder = Path(inspect.getfile(function)).parent
    own, numba.config.CACHE_DIR = numba.config.CACHE_DIR, _cache(folder)
    try:
        return numba.njit(cache=True, **OPTIONS | options)(function)
    finally:
        numba.config.CACHE_DIR = own


def part(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile a function that only kernels call, and that makes no arrays."""
    return partial(part, **options) if function is None else numba.njit(**PART | options)(function)


def stub(function: Callable[..., Any]) -> Any:
    """A function that every chain has its form for, told by the type of its first argument; see `fill`."""

    @wraps(function)
    def missing(chain: Any, *rest: Any) -> Any:
        raise NotImplementedError(f"{type(chain).__name__} has no {function.__name__}")

    return singledispatch(missing)


def fill(of: Any, chain: type, **options: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a stub its form for one `chain`."""

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        def choose(first: Any, *rest: Any) -> Any:
            return function if getattr(first, "instance_class", None) is chain else None

        choose.__signature__ = inspect.signature(function)  # type: ignore[attr-defined]  # numba asks for the same one
        overload(of, jit_options=PART | options)(choose)
        return of.register(chain, function)

    return register
