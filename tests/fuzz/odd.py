"""Odd values: what a user may give by mistake where a number, an array, a name, a function or a file is asked for."""

import datetime
import random
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np

NUMBERS = (
    0,
    -1,
    1,
    2,
    3.7,
    -0.0,
    1e-300,
    1e-12,
    1e12,
    1e154,
    1e300,
    -1e300,
    np.inf,
    -np.inf,
    np.nan,
    2**70,
    -(2**70),
    10**400,
    2**40,
)
WORDS = ("", "x", "midpoint", "consistent", "roll", "../x", "\x00", "1.0", "é\x1b[31m")


def _raises(*_: Any, **__: Any) -> Any:
    raise ZeroDivisionError("of the user")


def _array(rng: random.Random) -> Any:
    shape = rng.choice([(0,), (1,), (2,), (5,), (6,), (7,), (2, 6), (6, 2), (1, 6), (0, 0), (3, 3, 3)])
    kind = rng.choice(["nan", "zeros", "normal", "huge", "bool", "complex", "text", "object", "int", "inf", "masked", "date"])
    values = np.random.default_rng(rng.randrange(2**32)).normal(size=shape)
    made: dict[str, Callable[[], Any]] = {
        "nan": lambda: np.where(values > 0, np.nan, values),
        "zeros": lambda: np.zeros(shape),
        "normal": lambda: values,
        "huge": lambda: 1e200 * values,
        "bool": lambda: values > 0,
        "complex": lambda: values + 1j,
        "text": lambda: values.astype(str),
        "object": lambda: np.array([None] * int(np.prod(shape)), dtype=object).reshape(shape),
        "int": lambda: values.astype(int),
        "inf": lambda: np.full(shape, np.inf),
        "masked": lambda: np.ma.masked_greater(values, 0),
        "date": lambda: np.zeros(shape, "datetime64[s]"),
    }
    array = made[kind]()
    return array if rng.random() < 0.6 else array.tolist()


def _function(rng: random.Random) -> Any:
    """A function that fails, or returns something else than it should."""
    if rng.random() < 0.2:
        return _raises
    value = rng.choice([None, "x", np.nan, np.inf, 1j, [], [1.0, 2.0], True, np.zeros((2, 3)), 1e300, 0.5])
    if rng.random() < 0.2:
        return lambda: value
    return lambda *_, **__: value


def _other(rng: random.Random) -> Any:
    return rng.choice(
        [
            None, True, False, 1j, b"x", {}, {1: "x"}, (), (1,), (1, 2), ((0, "x"),), set(), {1, 2}, object(), int, range(3),
            Fraction(1, 3), Decimal("NaN"), Decimal("0.1"), datetime.timedelta(1), datetime.date(2020, 1, 1), np.float64("nan"),
            np.int8(3), np.bool_(True), [[1.0], [2.0, 3.0]], [None], ["x", 1.0], iter([1.0, 2.0]), ..., np, [[[]]], bytearray(8),
        ]
    )  # fmt: skip


def value(rng: random.Random) -> Any:
    """One odd value."""
    kind = rng.random()
    if kind < 0.35:
        return rng.choice(NUMBERS)
    if kind < 0.45:
        return rng.choice(WORDS)
    if kind < 0.65:
        return _array(rng)
    return _function(rng) if kind < 0.75 else _other(rng)


def time(rng: random.Random) -> Any:
    """An odd value where a step or a duration is asked for, but none that is right and makes a run very long."""
    given = value(rng)
    try:
        size = float(given)
    except (TypeError, ValueError, OverflowError):
        return given
    return given if size <= 0 or not 1e-200 < size < 1e200 or 1e-3 < size < 4 else 0.05
