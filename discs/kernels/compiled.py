"""Decorators for compiled code: `kernel` for functions called from Python, `part` for functions that kernels call, `stub` and
`fill` for functions that depend on the chain or the method.

Parts are plain Python functions. numba is imported, and parts are registered with it, when the first kernel is compiled. With
NUMBA_DISABLE_JIT=1 all run as plain Python, for debuggers and to measure coverage.

Compiled kernels are cached on disc (`discs.kernels.cache`), so each is compiled once per machine. numba identifies a cached kernel
by its own file, not by the files it calls. So each pair of a method and a chain has its own folder, named by the content of the
files that the kernel may call: those with its forms, and those of the parts and forms that they import.
"""

import inspect
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from functools import partial, singledispatch, wraps
from pathlib import Path
from types import ModuleType
from typing import Any

from discs.kernels import cache
from discs.kernels.lean import lean

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}
# Parts of a kernel count no references, as the kernel holds their arguments and they make no arrays. Python cannot call them.
PART: dict[str, Any] = OPTIONS | {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
CUT = -1, 0, 0  # the cost of a step that Ctrl-C interrupted
Cost = tuple[int, int, int]  # of a step: gradients, solves, unconverged iterations

_READILY = ContextVar("readily", default=False)
_KERNELS: set[Callable[..., Any]] = set()
_WAITING: list[Callable[[], object]] = []  # registrations to be made with numba
_MODULES: dict[str, dict[str, Any]] = {}  # modules with parts, forms or kernels, and their contents
_FORMS: dict[type, set[tuple[str, str]]] = {}  # modules of stubs, and of their forms for a chain or a method


def later(what: Callable[[], object]) -> None:
    """Make a registration with numba: now if numba is imported, otherwise when it is."""
    _WAITING.append(what)
    if "numba" in sys.modules:
        tell_numba()


def tell_numba() -> None:
    """Register all parts and forms with numba."""
    while _WAITING:
        _WAITING.pop(0)()


def part(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Decorator: a function that kernels call and that makes no arrays."""
    if function is None:
        return partial(part, **options)
    _MODULES[function.__module__] = function.__globals__

    def tell() -> None:
        from numba.extending import register_jitable

        register_jitable(**PART | options)(function)

    later(tell)
    return function


def stub(function: Callable[..., Any]) -> Any:
    """Decorator: a function with a form for each chain or method, chosen by the type of its first argument; see `fill`."""

    @wraps(function)
    def missing(first: Any, *rest: Any) -> Any:
        raise NotImplementedError(f"{type(first).__name__} has no {function.__name__}")

    _MODULES[function.__module__] = function.__globals__
    return singledispatch(missing)


def fill(of: Any, *kinds: type, **options: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a stub its form for some kinds of parameters, NamedTuples; with `object`, for all kinds that have none of their own."""

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        _MODULES[function.__module__] = function.__globals__

        def tell() -> None:
            from numba.extending import overload

            def choose(first: Any, *rest: Any) -> Any:
                given = getattr(first, "instance_class", None)
                return function if (given if given in of.registry else object) in kinds else None

            choose.__signature__ = inspect.signature(function)  # type: ignore[attr-defined]  # numba asks for the same one
            overload(of, jit_options=PART | options)(choose)

        later(tell)
        for kind in kinds:
            _FORMS.setdefault(kind, set()).add((of.__module__, function.__module__))
            of.register(kind, function)
        return function

    return register


def jit(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that calls parts and forms, compiled without a cache."""
    import numba

    tell_numba()
    return numba.njit(nogil=True, **OPTIONS)(function)


class NotReady(Exception):
    """A kernel is not in the cache."""


@contextmanager
def readily() -> Iterator[None]:
    """Within it a kernel that would have to be compiled raises `NotReady`."""
    token = _READILY.set(True)
    try:
        yield
    finally:
        _READILY.reset(token)


@contextmanager
def _refusing() -> Iterator[None]:
    """Within it numba compiles no kernel in this thread: it raises `NotReady`."""
    import numba  # noqa: F401  # whole: its parts are unfinished while another thread imports it
    from numba.core import event

    here = threading.get_ident()

    class Refuses(event.Listener):
        def on_start(self, event: Any) -> None:
            if event.data["dispatcher"].py_func in _KERNELS and threading.get_ident() == here:
                raise NotReady

        def on_end(self, event: Any) -> None:
            pass

    with event.install_listener("numba:compile", Refuses()):
        yield


def _surely_missing(function: Callable[..., Any], *kinds: type) -> bool:
    """Whether a kernel is not in the cache, as far as can be told without importing numba, which takes a second."""
    return "numba" not in sys.modules and cache.there(_files(function, *kinds), _name(function, *kinds)) is False


def _name(function: Callable[..., Any], *kinds: type) -> str:
    """The name of a kernel for these types of parameters."""
    return "-".join([function.__name__, *(kind.__name__ for kind in kinds)])


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator: a function called from Python, compiled at its first call for each combination of parameters.

    Other threads run meanwhile. The types of its arguments that are NamedTuples (a chain, a method), and of their entries (laws,
    load), select the forms.
    """

    known: dict[tuple[type, ...], Callable[..., Any]] = {}
    _KERNELS.add(function)

    @wraps(function)
    def call(*arguments: Any) -> Any:
        kinds = tuple(map(type, arguments))
        for argument in arguments[:2]:
            if isinstance(argument, tuple):
                kinds += tuple(map(type, argument))
        if kinds in known and not _READILY.get():
            return known[kinds](*arguments)
        forms = formed(kinds)
        with ExitStack() as stack:
            if _READILY.get():
                if kinds not in known and _surely_missing(function, *forms):
                    raise NotReady
                stack.enter_context(_refusing())
            stack.enter_context(lean())
            made = known.get(kinds) or compiled(function, *forms)
            result = made(*arguments)
            known[kinds] = made
        return result

    call.known = known  # type: ignore[attr-defined]  # for tests
    return call


def formed(kinds: Iterable[type]) -> list[type]:
    """Those kinds of parameters that have forms of stubs."""
    return [kind for kind in kinds if kind in _FORMS]


def compiled(function: Callable[..., Any], *kinds: type) -> Callable[..., Any]:
    """The kernel that numba compiles for these types of parameters."""
    import numba

    tell_numba()
    files = _files(function, *kinds)
    if not all(path.is_file() for path in files):  # code in a notebook is not cached
        return jit(function)
    kept = cache.folder(files, _name(function, *kinds))
    if not kept:
        cache.warn_of_no_cache()
        return jit(function)
    own, numba.config.CACHE_DIR = numba.config.CACHE_DIR, kept
    try:
        return numba.njit(cache=True, nogil=True, **OPTIONS)(function)
    finally:
        numba.config.CACHE_DIR = own


def _files(function: Callable[..., Any], *kinds: type) -> tuple[Path, ...]:
    """The files that a kernel may call with these types of parameters."""
    _MODULES[function.__module__] = function.__globals__
    found: set[str] = set()
    forms = {pair for kind in kinds for pair in _FORMS[kind]}
    waiting = {function.__module__}
    while waiting:
        found |= waiting
        held = [value for name in waiting for value in _MODULES[name].values()]
        names = {value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", "") for value in held}
        names |= {form for stub, form in forms if stub in found}  # not those of stubs that other kernels call
        waiting = (names & _MODULES.keys()) - found
    return tuple(sorted(Path(_MODULES[name].get("__file__", name)) for name in found))


@contextmanager
def compiling(say: Callable[[], None], after: float) -> Iterator[None]:
    """Call `say` after numba has compiled for `after` seconds; reading kernels from the cache does not count."""
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


def say_so(name: str) -> None:
    """Print that the kernels of a method are being compiled."""
    once = "" if cache.uncached else ", once on this machine"
    print(f"compiling {name!r}{once}: a minute or so ...", file=sys.stderr, flush=True)
