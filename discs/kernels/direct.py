"""Direct calls of kernels: without numba's look at the types of all arguments in each call.

For a chain of few discs and one step, that look (6 microseconds) takes as long as everything else in a call of a kernel. So the
machine code is called directly once the kernel was called with the same chain and a method with the same arrays (the same objects).
Numbers are converted by the machine code. Of arrays it checks little, so the types and orders in memory of the other arguments
must be the same in every call. `discs.integrators` makes them so.
"""

from collections.abc import Callable
from typing import Any

Known = dict[Callable[..., Any], tuple[Any, Any, Callable[..., Any]]]

_CODES: dict[Any, Callable[..., Any] | None] = {}  # of numba's dispatchers that have one form


def direct(known: Known, kernel: Callable[..., Any], method: Any, chain: Any) -> Callable[..., Any]:
    """The machine code of a kernel for a method and a chain or, until it was called with them, what calls the kernel.

    known : of each kernel the last method, the last chain, and the machine code; filled in by that call.
    """
    kept = known.get(kernel)
    if kept is not None and kept[1] is chain and (kept[0] is method or alike(kept[0], method)):
        return kept[2]

    def first(*arguments: Any) -> Any:
        result = kernel(*arguments)
        if (code := machine_code(kernel, arguments)) is not None:
            known[kernel] = method, chain, code
        return result

    return first


def alike(method: Any, other: Any) -> bool:
    """Whether two methods differ in numbers only."""
    return type(method) is type(other) and all(
        a is b or type(a) is type(b) in (int, float) for a, b in zip(method, other, strict=True)
    )


def machine_code(kernel: Callable[..., Any], arguments: tuple[Any, ...]) -> Callable[..., Any] | None:
    """The machine code that a kernel just called for these arguments; None if it is plain Python or if there may be several."""
    kinds = tuple(map(type, (*arguments, *arguments[0], *arguments[1])))
    made: Any = getattr(kernel, "known", {}).get(kinds)
    if len(getattr(made, "overloads", ())) != 1:
        return None
    if made not in _CODES:  # to look it up in `overloads` takes 40 microseconds
        _CODES[made] = getattr(next(iter(made.overloads.values())), "entry_point", None)
    return _CODES[made]
