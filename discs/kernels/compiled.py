"""How kernels are compiled: `kernel` for those called from Python, `part` for what they call, `stub` and `fill` for what differs by
chain or by method.

Parts are plain Python functions; numba is told of them, and imported, when the first kernel is. With NUMBA_DISABLE_JIT=1 all run as
plain Python, for a debugger and to see which lines are reached.

Compiled kernels are cached on disc, so compiling is paid once per machine. numba knows a cached kernel by the file it stands in,
not by those it calls. So each pair of a method and a chain has its kernel cached in a folder named by the content of the files that
it may call: those with its forms, and with what these import of parts and forms. It is in NUMBA_CACHE_DIR if that is set, otherwise
in `__pycache__` beside the kernels, otherwise in the user's cache. Where none can be written every process compiles, and warns of
it. A folder of earlier content goes when a new one is made, if nothing has used it for a day: another process may.
"""

import hashlib
import inspect
import os
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial, singledispatch, wraps
from pathlib import Path
from types import ModuleType
from typing import Any

from discs.warn import warn

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}
# Parts of a kernel: no counting of references, as what they are given is held by the kernel and they make no arrays; no way in
# from Python.
PART: dict[str, Any] = OPTIONS | {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
HERE = Path(__file__).parent
CALLED = HERE / "compiled.py", HERE / "limits.py"  # files that every kernel may call
ROOM = 2**20  # bytes that a kernel may take on disc
UNUSED = 86_400.0  # seconds after which kernels of earlier content are removed
CUT = -1, 0, 0  # in place of a step's cost, where Ctrl-C was pressed
Cost = tuple[int, int, int]  # of a step: gradients, solves, iterations that ended on their limit

_WAITING: list[Callable[[], object]] = []  # what numba is to be told of
_MODULES: dict[str, dict[str, Any]] = {}  # those with parts, forms or kernels, and what they hold
_FORMS: dict[type, set[str]] = {}  # modules with the forms for a chain or a method


def later(what: Callable[[], object]) -> None:
    """Tell numba now if it is imported, else when it is."""
    _WAITING.append(what)
    if "numba" in sys.modules:
        tell_numba()


def tell_numba() -> None:
    """Tell numba of all parts and forms."""
    while _WAITING:
        _WAITING.pop(0)()


def part(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """A function that kernels call, and that makes no arrays."""
    if function is None:
        return partial(part, **options)
    _MODULES[function.__module__] = function.__globals__

    def tell() -> None:
        from numba.extending import register_jitable

        register_jitable(**PART | options)(function)

    later(tell)
    return function


def stub(function: Callable[..., Any]) -> Any:
    """A function that every chain, or every method, has its form for, told by the type of its first argument; see `fill`."""

    @wraps(function)
    def missing(first: Any, *rest: Any) -> Any:
        raise NotImplementedError(f"{type(first).__name__} has no {function.__name__}")

    _MODULES[function.__module__] = function.__globals__
    return singledispatch(missing)


def fill(of: Any, kind: type, **options: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a stub its form for one kind of parameters, a NamedTuple."""

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        _MODULES[function.__module__] = function.__globals__
        _FORMS.setdefault(kind, set()).add(function.__module__)

        def tell() -> None:
            from numba.extending import overload

            def choose(first: Any, *rest: Any) -> Any:
                return function if getattr(first, "instance_class", None) is kind else None

            choose.__signature__ = inspect.signature(function)  # type: ignore[attr-defined]  # numba asks for the same one
            overload(of, jit_options=PART | options)(choose)

        later(tell)
        of.register(kind, function)
        return function

    return register


def jit(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that calls parts and forms, compiled for this process alone."""
    import numba

    tell_numba()
    return numba.njit(**OPTIONS)(function)


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function called from Python, whose arguments that are NamedTuples, of a chain or of a method, tell what it calls, as do
    those in them, of a chain's laws and load; compiled at its first call with each."""

    known: dict[tuple[type, ...], Callable[..., Any]] = {}

    @wraps(function)
    def call(*arguments: Any) -> Any:
        kinds = tuple(map(type, arguments))
        for argument in arguments:
            if isinstance(argument, tuple):
                kinds += tuple(map(type, argument))
        if kinds not in known:
            known[kinds] = compiled(function, *(kind for kind in kinds if kind in _FORMS))
        return known[kinds](*arguments)

    return call


def compiled(function: Callable[..., Any], *kinds: type) -> Callable[..., Any]:
    """A kernel for these kinds of parameters, as numba has it."""
    import numba

    tell_numba()
    files = _files(function, *kinds)
    if not all(path.is_file() for path in files):  # what is typed into a notebook is not kept
        return jit(function)
    kept = _cache(files, "-".join([function.__name__, *(kind.__name__ for kind in kinds)]))
    if not kept:
        _warn_of_no_cache()
        return jit(function)
    own, numba.config.CACHE_DIR = numba.config.CACHE_DIR, kept
    try:
        return numba.njit(cache=True, **OPTIONS)(function)
    finally:
        numba.config.CACHE_DIR = own


def _files(function: Callable[..., Any], *kinds: type) -> tuple[Path, ...]:
    """The files that a kernel may call with these kinds of parameters."""
    _MODULES[function.__module__] = function.__globals__
    found: set[str] = set()
    waiting = {function.__module__}.union(*(_FORMS[kind] for kind in kinds))
    while waiting:
        found |= waiting
        held = [value for name in waiting for value in _MODULES[name].values()]
        names = {value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", "") for value in held}
        waiting = (names & _MODULES.keys()) - found
    return tuple(sorted(Path(_MODULES[name].get("__file__", name)) for name in found))


def _content(files: tuple[Path, ...]) -> str:
    """What tells kernels that call what stands in these files from all others; in a package not ours, all beside them too."""
    folders = {path.parent for path in files if HERE.parent not in path.parents and (path.parent / "__init__.py").exists()}
    sources = sorted({*files, *CALLED, *(source for folder in folders for source in folder.glob("*.py"))})
    return hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:16]


@cache
def _cache(files: tuple[Path, ...], name: str = "") -> str:
    """Where kernels of a name that call what stands in these files are kept; "" if nothing can be written anywhere."""
    import numba
    from numba.misc.appdirs import user_cache_dir

    users = user_cache_dir("rolling-discs")  # relative if XDG_CACHE_HOME is empty, which stands for unset
    bases = numba.config.CACHE_DIR, HERE / "__pycache__", users if Path(users).is_absolute() else ""
    for base in filter(None, bases):
        kept = Path(base) / f"kernels-{name}-{_content(files)}"
        try:
            kept.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=kept) as file:
                file.write(bytes(ROOM))
                file.flush()
            os.utime(kept)
        except OSError:
            continue
        _remove_earlier(kept)
        return str(kept)
    return ""


def _remove_earlier(kept: Path) -> None:
    """Remove kernels of the same name and earlier content that no process has used for a day."""
    for other in kept.parent.glob("kernels-*"):
        name = other.name.rpartition("-")[0]
        if other != kept and name in ("kernels", kept.name.rpartition("-")[0]):  # once they were named by their content alone
            with suppress(OSError):
                if time.time() - other.stat().st_mtime > UNUSED:
                    shutil.rmtree(other)


uncached: list[bool] = []  # whether kernels could not be kept


def _warn_of_no_cache() -> None:
    if not uncached:
        uncached.append(True)
        warn(
            "compiled kernels cannot be kept, as neither the package's folder nor the user's cache can be written: every process "
            "compiles them again, which takes some tens of seconds; set NUMBA_CACHE_DIR to a folder that can be written"
        )


@contextmanager
def compiling(say: Callable[[], None], after: float) -> Iterator[None]:
    """Call `say` once numba has compiled for so many seconds; kernels that it reads from the cache do not count."""
    from numba.core import event

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


def interrupted() -> bool:
    """Whether Ctrl-C was pressed since the call began; a kernel that hears it ends at once with -1 steps.

    Asking clears it: the caller has to press again, see `discs.integrators.base.FixedStep`. Plain Python hears it by itself.
    """
    return False


def _tell_of_interrupts() -> None:
    from numba.core import types
    from numba.extending import overload

    occurred = types.ExternalFunction("PyOS_InterruptOccurred", types.int32())

    @overload(interrupted, jit_options=PART)
    def _interrupted() -> Callable[[], bool]:
        return lambda: occurred() != 0


later(_tell_of_interrupts)
