"""Checks of input; each error says what is required and what was given.

Numbers are finite and real: ints, floats, fractions, decimals, NumPy's numbers, and arrays of them. Truth values, text, dates,
times, complex numbers (even with imaginary part 0) and arrays with masked entries are refused, although NumPy could convert them.
"""

import math
import operator
import os
import reprlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from discs.arrays import Float

MOST = 2**53  # the largest count; above it not every whole number is a double
MEMORY = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else math.inf  # bytes
TEXTS = (str, bytes, bytearray, memoryview)
Kind = TypeVar("Kind")


class _Short(reprlib.Repr):
    """A short text for a value of any size."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlist = self.maxtuple = self.maxarray = self.maxdict = self.maxset = 6
        self.maxstring = self.maxother = self.maxlong = 60
        self.maxlevel = 3

    def repr_int(self, x: int, level: int) -> str:
        size = abs(x).bit_length()
        return repr(x) if size < 100 else f"a {'negative ' * (x < 0)}whole number of {int(size * 0.30103) + 1} digits"

    def repr_ndarray(self, x: Float, level: int) -> str:
        return super().repr_instance(x, level) if x.size < 4 else f"an array of shape {x.shape} and type {x.dtype}"

    repr_MaskedArray = repr_ndarray


_SHORT = _Short()


def shown(value: object) -> str:
    """One short line for a value of any size."""
    return " ".join(_SHORT.repr(value).split())


def choice(name: str, value: object, known: Iterable[str]) -> str:
    """Return `value` if it is one of the `known` names, else raise ValueError listing them."""
    known = tuple(known)
    if not isinstance(value, str) or value not in known:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, known))}; got {shown(value)}")
    return str(value)


def whole(name: str, value: object, least: int | None = None, why: str = "") -> int:
    """Return `value` as an int, not below `least` and not beyond 2**53, else raise ValueError."""
    given = value if type(value) is int else _index(value)
    if given is None or (least is not None and given < least):
        need = "" if least is None else f" of at least {least}"
        raise ValueError(f"{name} must be a whole number{need}{f' ({why})' * bool(why)}; got {shown(value)}")
    if abs(given) > MOST:
        raise ValueError(f"{name} must be at most 2**53 in size; got {shown(value)}")
    return int(given)


def flag(name: str, value: object) -> bool:
    """Return `value` if it is a truth value, else raise ValueError."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} must be True or False; got {shown(value)}")
    return bool(value)


def instance(name: str, value: object, kind: type[Kind], need: str) -> Kind:
    """Return `value` if it is of this class, else raise ValueError that says what is needed."""
    if not isinstance(value, kind):
        raise ValueError(f"{name} must be {need}; got {shown(value)}")
    return value


def several(name: str, value: object, need: str) -> tuple[Any, ...]:
    """Return the entries of `value`, a text being one entry, else raise ValueError that says what is needed."""
    if isinstance(value, str):
        return (value,)
    return tuple(instance(name, value, Iterable, need))  # type: ignore[type-abstract]


def path(name: str, value: object) -> Path:
    """Return `value` as a path if it is a text or a path, else raise ValueError."""
    if not isinstance(value, str | Path) or not str(value):
        raise ValueError(f"{name} must be the path of a file, a text or a Path; got {shown(value)}")
    return Path(value)


def number(name: str, value: object, *, positive: bool = False) -> float:
    """Return `value` as a finite float, positive if asked for, else raise ValueError."""
    if type(value) is float and math.isfinite(value) and (value > 0 or not positive):
        return value
    found = _doubles(value)  # type: ignore[arg-type]
    given = found if isinstance(found, str) else np.nan if found.ndim else float(found)
    if isinstance(given, str) or not math.isfinite(given) or (positive and given <= 0):
        why = f" ({given})" if isinstance(given, str) and given else ""
        raise ValueError(f"{name} must be a {'positive ' * positive}finite number; got {shown(value)}{why}")
    return float(given)


def fits(name: str, doubles: float) -> None:
    """Raise ValueError if so many doubles need more memory than the machine has, if the system tells how much that is."""
    if 8 * doubles > MEMORY:
        raise ValueError(f"{name}: {8e-9 * doubles:.3g} GB are needed, and this machine has {1e-9 * MEMORY:.3g} GB of memory")


def array(name: str, value: ArrayLike, need: str = "finite numbers") -> Float:
    """Return `value` as a new float array, entries may be infinite or NaN; else raise ValueError that says what is needed."""
    given = _doubles(value)
    if isinstance(given, str):
        raise ValueError(f"{name} must be {need}; got {shown(value)}{f' ({given})' * bool(given)}")
    return given


def called(name: str, function: Callable[..., Any], *arguments: Any, where: str = "") -> Any:
    """What a user's function returns. If it raises, ValueError with its name, the error, and `where` it was called."""
    try:
        return function(*arguments)
    except Exception as error:
        raise ValueError(f"{name} raised {type(error).__name__}: {error}{where}") from error


def field(
    name: str, value: ArrayLike, size: int, *, least: float | None = None, strict: bool = False, places: Float | None = None
) -> Float:
    """Return `value` as a read-only float array (size,), a single number being repeated but stored once, else raise ValueError.

    With `least`, every entry must be at least that, or larger if `strict`. `places` (size,) along a rod are for messages.
    """
    given = array(name, value, f"a number or {size} numbers")
    if given.shape not in ((), (size,)):
        raise ValueError(f"{name} must be a number or an array of shape ({size},); got shape {given.shape}")
    bad = ~np.isfinite(given)
    need = "finite"
    if least is not None:
        bad |= given <= least if strict else given < least
        need = f"finite and {'greater than' if strict else 'at least'} {least:g}"
    given = given if given.ndim else np.broadcast_to(given, (size,))
    given.flags.writeable = False
    if bad.any():
        i = int(np.argmax(bad))
        raise ValueError(f"{name} must be {need}; got {given[i]} at {f'place {i}' if places is None else f's = {places[i]:g}'}")
    return given


def vector(name: str, value: ArrayLike, size: int) -> Float:
    """Return `value` as a finite float array (size,), else raise ValueError."""
    given = array(name, value, f"{size} finite numbers")
    if given.shape != (size,) or not np.isfinite(given).all():
        raise ValueError(
            f"{name} must be {size} finite numbers; got shape {given.shape}, {np.isfinite(given).sum()} of them finite"
        )
    return given


def iteration(sweeps: object, tolerance: object) -> None:
    """ValueError unless an iteration has at least one sweep, and a tolerance that is not negative."""
    whole("sweeps", sweeps, 1)
    if number("tolerance", tolerance) < 0:
        raise ValueError(f"tolerance must be at least 0; got {shown(tolerance)}")


def tolerances(tol: object, known: Iterable[str], usual: Iterable[str], least: float) -> dict[str, float]:
    """The tolerance of each quantity that `tol` binds, else raise ValueError.

    A number binds the `usual` quantities; a mapping {"omega": 1e-4} binds those that it names, of the `known` ones. None may be
    below `least`, what doubles can reach.
    """
    known = tuple(known)
    if isinstance(tol, Mapping):
        if not tol:
            raise ValueError(f"tol must name at least one of {', '.join(map(repr, known))}; got {shown(tol)}")
        bound = {choice("tol", name, known): number(f"tol of {name!r}", value, positive=True) for name, value in tol.items()}
    else:
        bound = dict.fromkeys(usual, number("tol", tol, positive=True))
    for name, value in bound.items():
        if value < least:
            of = f" of {name!r}" if isinstance(tol, Mapping) else ""
            raise ValueError(f"tol{of} must be at least {least:g}, as positions are rounded; got {value:g}")
    return bound


def _index(value: Any) -> int | None:
    """A whole number as an int; None if it is something else."""
    try:
        return None if isinstance(value, bool) or np.ma.is_masked(value) else operator.index(value)
    except TypeError:
        return None


def _doubles(value: ArrayLike) -> Float | str:
    """`value` as a new float array, or the reason why it is none ("" if it is obvious)."""
    if type(value) is float or (type(value) is np.ndarray and value.dtype == np.float64):  # most are: nothing can be wrong
        return np.array(value)
    if isinstance(value, (list, tuple)) and set(map(type, value)) == {float}:
        return np.array(value)
    if isinstance(value, TEXTS):
        return ""
    try:
        if _masked(value):
            return "with masked entries: fill or leave them out"
        # entries of lists are checked one by one: NumPy would convert a truth value among numbers to a number
        given = np.asarray(value) if hasattr(value, "dtype") or hasattr(value, "__array__") else np.array(value, dtype=object)
    except (TypeError, ValueError):
        return ""
    kind = given.dtype.kind
    if kind == "O":
        if (why := next((why for entry in given.flat if (why := _odd(entry)) is not None), None)) is not None:
            return why
    elif kind not in "iuf":
        return KINDS.get(kind, "")
    try:
        with np.errstate(over="ignore"):
            return np.array(given, dtype=float)
    except OverflowError:
        return "too large for a double"
    except (TypeError, ValueError):
        return ""


KINDS = {"b": "truth values", "c": "complex numbers", "M": "dates", "m": "times", "U": "text", "S": "text"}


def _masked(value: object) -> bool:
    return bool(np.ma.is_masked(value)) or (isinstance(value, (list, tuple)) and any(map(_masked, value)))


def _odd(entry: object) -> str | None:
    """The reason why an entry is no number ("" if it is obvious); None if it is one."""
    if isinstance(entry, (float, int)) and not isinstance(entry, bool):
        return None
    if hasattr(entry, "dtype"):
        kind = np.asarray(entry).dtype.kind
        if kind == "O":  # an array without dimensions
            inner = np.asarray(entry).item()
            return "" if inner is entry else _odd(inner)
        return None if kind in "iuf" else KINDS.get(kind, "")
    if isinstance(entry, (bool, complex)):
        return KINDS["b" if isinstance(entry, bool) else "c"]
    return None if hasattr(entry, "__float__") else ""
