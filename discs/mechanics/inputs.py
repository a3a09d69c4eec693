"""Functions that a user gives: forces f(t, q, v), drives b(t, q), constraints phi(q, v); their values are checked."""

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from discs.arrays import Float
from discs.mechanics.derivatives import Formula


def function_of(arguments: str, name: str, given: Any) -> Callable[..., Any]:
    """Return `given` if it is a function of the `arguments`, as "t, q", and of nothing else, else raise ValueError."""
    if not callable(given):
        raise ValueError(f"{name} must be a function of {arguments}; got {given!r}")
    names = arguments.split(", ")
    try:
        inspect.signature(given).bind(*names)
    except TypeError as error:
        alone = " alone" if len(names) == 1 else ""
        raise ValueError(f"{name} must be a function of {arguments}{alone}, {name}({arguments}); {error}") from None
    except ValueError:  # a builtin without a signature
        pass
    return given  # type: ignore[no-any-return]


class Given:
    """A user's function with `size` numbers as values, finite and of that number; errors name t if it is the first argument.

    Parameters
    ----------
    arguments : "t, q, v", "t, q" or "q, v"; t is a number, q and v have shape (m,).
    name : what messages call the function, as "b".
    call : the function; a single value may be a number.

    Attributes
    ----------
    call : as given.
    formula : the function of one vector, its arguments one after the other; it has verified derivatives.
    """

    def __init__(self, arguments: str, name: str, call: Any, size: int, m: int) -> None:
        self.call = function_of(arguments, name, call)
        self.timed, vectors = int(arguments[0] == "t"), arguments.count("q") + arguments.count("v")

        def of_one(z: Float) -> Any:
            return call(*z[: self.timed], *np.split(z[self.timed :], vectors))

        self.formula = Formula(name, of_one, (size,), self.timed + vectors * m, arguments, cancels=name == "phi")

    def __call__(self, *parts: Float | float) -> Float:
        """The values, (size,)."""
        when = f"at t = {parts[0]:g}" if self.timed else f"at q, v = {np.hstack(parts)}"
        try:
            value = self.formula(np.hstack(parts))
        except ValueError as error:
            raise ValueError(f"{error}, {when}") from None
        if not np.isfinite(value).all():
            raise ValueError(f"{self.formula.name}({self.formula.arguments}) must be finite; {when} it is {value}")
        return value

    def slopes(self, *parts: Float | float) -> Float:
        """Derivatives by all arguments, one after the other: (size, 1 + m) of b(t, q), (size, 2m) of phi(q, v)."""
        return self.formula.slopes(np.hstack(parts))

    def along(self, at: tuple[Float | float, ...], direction: tuple[Float | float, ...]) -> Float:
        """The derivative at these arguments along a direction, (size,)."""
        return self.formula.along(np.hstack(at), np.hstack(direction))


def as_given(arguments: str, name: str, call: Any, size: int, m: int) -> Given:
    """A user's function as `Given`, which may be one already."""
    return call if isinstance(call, Given) else Given(arguments, name, call, size, m)
