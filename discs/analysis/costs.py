"""How a cost changes with the frames of a run."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import scipy

from discs import checks
from discs.analysis.duals import Dual
from discs.arrays import Float

RATES = {"omega": 2, "phi_rate": 3}  # and their rows of C


def _like(name: str, given: Any, shape: tuple[int, ...]) -> Float:
    """Derivatives as an array of a shape; ValueError for other shapes, and for values that are not finite."""
    found = checks.array(name, given)
    fits = len(found.shape) <= len(shape) and all(a in (1, b) for a, b in zip(found.shape[::-1], shape[::-1], strict=False))
    if fits and np.isfinite(found).all():
        return np.broadcast_to(found, shape)
    raise ValueError(f"{name} must be finite numbers of shape {shape}; got {checks.shown(given)}")


def cost_by_frame(
    times: Float,
    values: dict[str, Float],
    cost: Callable[[Any], Any],
    cost_gradient: Callable[[Any], dict[str, Any]] | None,
) -> list[dict[str, Float]]:
    """The derivatives of the cost by the quantities of each frame, whose values at `times` (F,) are (F, n)."""
    if cost_gradient is not None:
        given = checks.called("cost_gradient", cost_gradient, SimpleNamespace(t=times, **values))
        if not isinstance(given, dict) or not given.keys() <= values.keys():
            raise ValueError(f"cost_gradient must return arrays by names among {', '.join(values)}; got {checks.shown(given)}")
        made = {name: _like(f"{name} of cost_gradient", each, values[name].shape) for name, each in given.items()}
        return [{name: each[i] for name, each in made.items()} for i in range(times.size)]
    total = len(values) * next(iter(values.values())).size
    whole = scipy.sparse.eye_array(total, format="csr")
    starts = np.arange(0, total, total // len(values))
    duals = {name: Dual(v, whole[a : a + v.size]) for (name, v), a in zip(values.items(), starts, strict=True)}
    try:
        found = cost(SimpleNamespace(t=times, **duals))
    except AttributeError as error:
        raise ValueError(f"a cost may use t, {', '.join(values)} of the run; it said: {error}") from None
    except ArithmeticError as error:
        raise ValueError(f"the cost raised {type(error).__name__}: {error}") from error
    except TypeError as error:
        raise ValueError(f"the cost cannot be differentiated: {error}") from None
    if not isinstance(found, Dual) or found.size != 1:
        got = f"an array of shape {found.shape}" if isinstance(found, Dual) else checks.shown(found)
        raise ValueError(f"the cost must be one number made of the frames; got {got}")
    slopes = found.slope.toarray().ravel()
    each = {name: slopes[a : a + v.size].reshape(v.shape) for (name, v), a in zip(values.items(), starts, strict=True)}
    return [{name: slope[i] for name, slope in each.items()} for i in range(times.size)]
