"""Refusing bad input: what is required, what was given, what to do."""

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray


def choice(name: str, value: object, known: Iterable[str]) -> str:
    """Return `value` if it is one of the `known` names, else raise ValueError listing them."""
    known = tuple(known)
    if not isinstance(value, str) or value not in known:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, known))}; got {value!r}")
    return value


def whole(name: str, value: object, least: int, why: str = "") -> int:
    """Return `value` as an int not below `least`, else raise ValueError."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        reason = f" ({why})" if why else ""
        raise ValueError(f"{name} must be a whole number of at least {least}{reason}; got {value!r}")
    return int(value)


def number(name: str, value: object, *, positive: bool = False) -> float:
    """Return `value` as a finite float, positive if asked for, else raise ValueError."""
    need = "a positive finite number" if positive else "a finite number"
    try:
        given = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be {need}; got {value!r}") from None
    if isinstance(value, (bool, str)) or not math.isfinite(given) or (positive and given <= 0):
        raise ValueError(f"{name} must be {need}; got {value!r}")
    return given


def field(name: str, value: ArrayLike, size: int, *, least: float | None = None, strict: bool = False) -> NDArray:
    """Return `value` as a read-only float array (size,), a number standing for all of them and stored once.

    With `least`, every entry must be at least that, or larger if `strict`.
    """
    try:
        given = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a number or {size} numbers; got {value!r}") from None
    if given.shape not in ((), (size,)):
        raise ValueError(f"{name} must be a number or an array of shape ({size},); got shape {given.shape}")
    given = np.broadcast_to(given, (size,))
    bad = ~np.isfinite(given)
    need = "finite"
    if least is not None:
        bad |= given <= least if strict else given < least
        need = f"finite and {'greater than' if strict else 'at least'} {least:g}"
    if bad.any():
        i = int(np.argmax(bad))
        raise ValueError(f"{name} must be {need}; got {given[i]} at place {i}")
    return given


def vector(name: str, value: ArrayLike, size: int) -> NDArray:
    """Return `value` as a finite float array (size,), else raise ValueError."""
    given = np.asarray(value, dtype=float)
    if given.shape != (size,) or not np.isfinite(given).all():
        raise ValueError(
            f"{name} must be {size} finite numbers; got shape {given.shape}, {np.isfinite(given).sum()} of them finite"
        )
    return given


def iteration(sweeps: object, tolerance: object) -> None:
    """Check the limits of an iteration: at least one sweep, a tolerance that is not negative."""
    whole("sweeps", sweeps, 1)
    if number("tolerance", tolerance) < 0:
        raise ValueError(f"tolerance must be at least 0; got {tolerance!r}")


def tolerances(tol: object, known: Iterable[str], usual: Iterable[str], least: float) -> dict[str, float]:
    """The tolerance of each quantity that `tol` binds, else raise ValueError.

    A number binds the `usual` quantities; a mapping {"omega": 1e-4} binds those that it names, of the `known` ones. None may be
    below `least`, what doubles can reach.
    """
    known = tuple(known)
    if isinstance(tol, Mapping):
        if not tol:
            raise ValueError(f"tol must name at least one of {', '.join(map(repr, known))}; got {tol!r}")
        bound = {choice("tol", name, known): number(f"tol of {name!r}", value, positive=True) for name, value in tol.items()}
    else:
        bound = dict.fromkeys(usual, number("tol", tol, positive=True))
    for name, value in bound.items():
        if value < least:
            of = f" of {name!r}" if isinstance(tol, Mapping) else ""
            raise ValueError(f"tol{of} must be at least {least:g}, as positions are rounded; got {value:g}")
    return bound
