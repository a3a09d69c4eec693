"""numba compiles a kernel in about half the time, to the same results.

A kernel calls some 130 parts. By itself numba optimises each of them twice and makes machine code of it, as if Python called
it. But a part is only copied into the kernel, which is optimised again as a whole and has all the machine code that runs. So
here a part is optimised once and makes no machine code. And an overloaded function that did not fit some types is not tried
again for them: with numba each `a[i]` tries some 30 such functions, again and again.

numba has no options for this. So methods of its own are replaced while a kernel compiles, in its thread only. With a version of
numba that does not have them, it compiles as it always does. The plain twin is `discs.kernels.compiled.jit`, without any of this.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

ALONE = threading.RLock()  # one thread at a time compiles, as with numba itself, and sets where a kernel is kept


def is_part(library: Any) -> bool:
    """Whether a library of functions is only to be copied into others: Python and C have no way to call it."""
    names = [function.name for function in library._final_module.functions if not function.is_declaration]
    return any(name.startswith("_ZN") for name in names) and not any(name.startswith(("_ZN7cpython", "cfunc.")) for name in names)


@contextmanager
def lean() -> Iterator[None]:
    """Within it numba compiles in this way, in this thread."""
    import numba  # noqa: F401  # whole: its parts are unfinished while another thread imports it
    from numba.core import codegen, targetconfig
    from numba.core.typing import templates

    here = threading.get_ident()
    tried: dict[Any, tuple[Any, Any]] = {}

    def optimise(library: Any) -> None:
        """The first of the two passes of numba's own method, for parts."""
        of = library._codegen
        passes, built = of._module_pass_manager(loop_vectorize=of._loopvect, slp_vectorize=False, opt=of._opt_level, cost="cheap")
        passes.run(library._final_module, built)

    def finish(library: Any) -> None:
        """numba's own method without machine code, for parts."""
        library._finalize_dynamic_globals()
        library._verify_declare_only_symbols()
        library._finalized = True

    def try_once(own: Callable[..., Any], template: Any, arguments: Any, named: Any) -> Any:
        flags = targetconfig.ConfigStack.top_or_none()
        key = type(template), tuple(arguments), tuple(named.items()), id(flags)
        if key not in tried:
            tried[key] = own(template, arguments, named), flags  # the flags are kept, so that no others get their id
        return tried[key][0]

    def set_environment(own: Callable[..., Any], code: Any, name: str, environment: Any) -> None:
        if code._engine._ee.get_global_value_address(name):  # none without machine code
            own(code, name, environment)

    def for_parts(ours: Callable[[Any], None]) -> Callable[..., None]:
        return lambda own, library: ours(library) if is_part(library) else own(library)

    replaced: list[tuple[Any, str, Callable[..., Any]]] = [
        (codegen.CPUCodeLibrary, "_optimize_final_module", for_parts(optimise)),
        (codegen.CPUCodeLibrary, "_finalize_final_module", for_parts(finish)),
        (codegen.JITCPUCodegen, "set_env", set_environment),
        (templates._OverloadFunctionTemplate, "_get_impl", try_once),
    ]

    def here_only(own: Callable[..., Any], ours: Callable[..., Any]) -> Callable[..., Any]:
        return lambda self, *rest: ours(own, self, *rest) if threading.get_ident() == here else own(self, *rest)

    known = all(hasattr(kind, name) for kind, name, _ in replaced)
    with ALONE:
        owned = [(kind, name, getattr(kind, name), ours) for kind, name, ours in replaced] if known else []
        for kind, name, own, ours in owned:
            setattr(kind, name, here_only(own, ours))
        try:
            yield
        finally:
            for kind, name, own, _ in owned:
                setattr(kind, name, own)
