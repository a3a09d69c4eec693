"""How kernels are compiled: `kernel` for those called from Python, `part` for their parts, `fill` for the parts that differ by
chain. With NUMBA_DISABLE_JIT=1 all run as plain Python, for a debugger and to see which lines are reached.

Kernels are cached on disc, so compiling is paid once per machine. numba knows a cached kernel by the file it stands in, not by
those it calls; the cache is therefore kept in a folder named by the content of all kernels: NUMBA_CACHE_DIR if it is set, otherwise
`__pycache__` beside the kernels, otherwise the user's cache. Where none can be written every process compiles, and warns of it.
"""

import hashlib
import inspect
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial, singledispatch, wraps
from pathlib import Path
from typing import Any

import numba
from numba.core import event, types
from numba.extending import overload
from numba.misc.appdirs import user_cache_dir

from discs.warn import warn

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}
# Parts of a kernel: no counting of references, as what they are given is held by the kernel and they make no arrays; no way in
# from Python.
PART: dict[str, Any] = OPTIONS | {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}

ROOM = 2**20  # bytes that a kernel may take on disc


def _content(folder: Path) -> str:
    """What tells kernels of a folder from all others: they may call all that is in it, and all that is here."""
    here = Path(__file__).parent
    sources = sorted(here.glob("*.py")) + sorted(folder.glob("*.py")) * (folder != here)
    return hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:16]


@cache
def _cache(folder: Path) -> str:
    """Where compiled kernels of a folder are kept; "" if nothing can be written anywhere."""
    users = user_cache_dir("rolling-discs")  # relative if XDG_CACHE_HOME is empty, which stands for unset
    bases = numba.config.CACHE_DIR, Path(__file__).parent / "__pycache__", users if Path(users).is_absolute() else ""
    for base in filter(None, bases):
        kept = Path(base) / f"kernels-{_content(folder)}"
        try:
            kept.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=kept) as file:
                file.write(bytes(ROOM))
                file.flush()
                return str(kept)
        except OSError:
            continue
    return ""


uncached: list[Path] = []  # folders of kernels that cannot be kept


def _warn_of_no_cache(folder: Path) -> None:
    uncached.append(folder)
    if len(uncached) > 1:
        return
    warn(
        "compiled kernels cannot be kept, as neither the package's folder nor the user's cache can be written: every process "
        "compiles them again, which takes some tens of seconds; set NUMBA_CACHE_DIR to a folder that can be written"
    )


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile a function at its first call."""
    if function is None:
        return partial(kernel, **options)
    folder = Path(inspect.getfile(function)).parent
    kept = _cache(folder)
    if not kept:
        _warn_of_no_cache(folder)
        return numba.njit(**OPTIONS | options)(function)
    own, numba.config.CACHE_DIR = numba.config.CACHE_DIR, kept
    try:
        return numba.njit(cache=True, **OPTIONS | options)(function)
    finally:
        numba.config.CACHE_DIR = own


@contextmanager
def compiling(say: Callable[[], None], after: float) -> Iterator[None]:
    """Call `say` once numba has compiled for so many seconds; kernels that it reads from the cache do not count."""
    notice = threading.Timer(after, say)
    notice.daemon = True

    class Compiles(event.Listener):
        def on_start(self, event: Any) -> None:
            if notice.ident is None:
                notice.start()

        def on_end(self, event: Any) -> None:
            pass

    try:
        with event.install_listener("numba:compile", Compiles()):
            yield
    finally:
        notice.cancel()


def part(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile a function that only kernels call, and that makes no arrays."""
    return partial(part, **options) if function is None else numba.njit(**PART | options)(function)


_interrupt_occurred = types.ExternalFunction("PyOS_InterruptOccurred", types.int32())
COMPILED = not numba.config.DISABLE_JIT  # plain Python hears Ctrl-C by itself


@part
def interrupted():
    """Whether Ctrl-C was pressed since the call began; a kernel that hears it ends at once with -1 steps.

    Asking clears it: the caller has to press again, see `discs.integrators.base.tally`.
    """
    return COMPILED and _interrupt_occurred() != 0


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
