"""The integrators, one file each: every class in these files with a `name` is a method."""

import ast
import pkgutil
from functools import cache
from importlib import import_module
from typing import Any

from discs import checks
from discs.integrators.base import FixedStep, Integrator, OneStep
from discs.integrators.composition import KahanLi6, Suzuki4
from discs.integrators.gauss import Gauss, Gauss4, Gauss6, Gauss8
from discs.integrators.ivp import BDF, DOP853, LSODA, RK45, Radau
from discs.integrators.leapfrog import Leapfrog
from discs.integrators.midpoint import Midpoint
from discs.integrators.perlmutter import McLachlanPerlmutter
from discs.integrators.radau import Radau3, Radau5
from discs.integrators.rk4 import RK4
from discs.integrators.work import Work


def _methods() -> dict[str, type[Integrator]]:
    """The classes with a name in the files beside this one."""
    modules = [import_module(f"{__name__}.{file.name}") for file in pkgutil.iter_modules(__path__)]
    classes = [cls for module in modules for cls in vars(module).values() if isinstance(cls, type) and issubclass(cls, Integrator)]
    return {cls.name: cls for cls in classes if hasattr(cls, "name")}


METHODS = _methods()


def find(method: str | Integrator) -> Integrator:
    """The integrator of a name, with default settings; an integrator is returned unchanged."""
    if isinstance(method, str) and method in METHODS:
        return _standard(method)
    return method if isinstance(method, Integrator) else _standard(checks.choice("method", method, METHODS))


@cache
def _standard(name: str) -> Integrator:
    """The integrator of a name: one object for all runs, as it is frozen."""
    return METHODS[name]()


def from_settings(text: str) -> Integrator:
    """The integrator of a run, from the entry `settings` of its stats; ValueError if the text is no integrator."""

    def build(node: ast.expr) -> Any:
        known = {cls.__name__: cls for cls in METHODS.values()}
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in known and not node.args:
            return known[node.func.id](**{str(word.arg): build(word.value) for word in node.keywords})
        return ast.literal_eval(node)

    try:
        found = build(ast.parse(text, mode="eval").body)
    except (SyntaxError, TypeError, ValueError, RecursionError, MemoryError):
        found = None
    if not isinstance(found, Integrator):
        raise ValueError(f"not the settings of an integrator: {text[:80]!r}")
    return found


__all__ = [
    "BDF",
    "DOP853",
    "LSODA",
    "METHODS",
    "RK4",
    "RK45",
    "FixedStep",
    "Gauss",
    "Gauss4",
    "Gauss6",
    "Gauss8",
    "Integrator",
    "KahanLi6",
    "Leapfrog",
    "McLachlanPerlmutter",
    "Midpoint",
    "OneStep",
    "Radau",
    "Radau3",
    "Radau5",
    "Suzuki4",
    "Work",
    "find",
    "from_settings",
]
