"""A hash of a function: of its code, constants, defaults, closure, and the globals that it uses."""

import functools
import hashlib
import sys
import sysconfig
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, MappingProxyType, MethodType, ModuleType
from typing import Any

import numpy as np

INSTALLED = [Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib", "purelib", "platlib")]
IN_CLASSES = ("__dict__", "__weakref__", "__module__", "__doc__", "__firstlineno__", "__static_attributes__", "_abc_impl")
OURS = ("discs", "continuum", "compare")  # their functions, like installed ones, are identified by name


def fingerprint(function: Callable[..., Any]) -> str:
    """A hash of 32 hexadecimal digits, equal for two functions only if their own code and data are equal.

    It includes nested functions, the closure, and the globals that the code names: values, functions and classes of the user's own
    modules. Installed modules are identified by name. Another version of Python gives another hash.

    Raises
    ------
    ValueError : if the function contains something that cannot be identified, as an open file.
    """
    hashed = _Hashed()
    try:
        hashed.add(function)
    except RecursionError:
        raise ValueError("it contains too deeply nested values") from None
    return hashed.hash.hexdigest()


class _Hashed:
    """A hash of a sequence of values, each by its content."""

    def __init__(self) -> None:
        self.hash = hashlib.blake2b(digest_size=16)
        self.seen: dict[int, tuple[int, Any]] = {}  # values are kept, so that their ids stay unique

    def word(self, *words: object) -> None:
        for word in words:
            text = repr(word).encode("utf-8", "surrogatepass")
            self.hash.update(f"{len(text)}:".encode() + text)

    def add(self, value: object) -> None:
        """Add a value to the hash."""
        if value is None or value is ... or isinstance(value, (bool, int, float, complex, str, bytes)):
            self.word(type(value).__name__, value)
            return
        if id(value) in self.seen:
            self.word("again", self.seen[id(value)][0])
            return
        self.seen[id(value)] = len(self.seen), value
        self.word(type(value).__qualname__)
        if isinstance(value, CodeType):
            self.word(value.co_code, value.co_names, value.co_varnames, value.co_freevars, value.co_cellvars, value.co_flags)
            self.add(value.co_consts)
        elif isinstance(value, FunctionType):
            self._function(value)
        elif isinstance(value, (tuple, list)):
            self.word(len(value))
            for one in value:
                self.add(one)
        elif isinstance(value, (dict, MappingProxyType)):
            self.add([part for pair in value.items() for part in pair])
        elif isinstance(value, (set, frozenset)):
            self.add(sorted(value, key=repr))
        elif isinstance(value, np.ndarray) and value.dtype != object:
            self.word(value.shape, value.dtype.str, value.tobytes())
        elif isinstance(value, ModuleType):
            self.word(value.__name__)
            if _followed(value.__name__) and getattr(value, "__file__", None):
                self.word(Path(str(value.__file__)).read_bytes())
        elif isinstance(value, type):
            self._class(value)
        elif isinstance(value, BuiltinFunctionType):
            self.word(value.__module__, value.__qualname__)
            if not isinstance(value.__self__, (ModuleType, type(None))):
                self.add(value.__self__)
        elif isinstance(value, MethodType):
            self.add([value.__func__, value.__self__])
        elif isinstance(value, functools.partial):
            self.add([value.func, value.args, value.keywords])
        elif isinstance(value, property):
            self.add([value.fget, value.fset, value.fdel])
        elif is_dataclass(value):
            self.add([type(value), *(getattr(value, field.name, None) for field in fields(value))])
        elif hasattr(value, "__wrapped__"):  # as functools.cache makes
            self.add(value.__wrapped__)
        else:
            self._object(value)

    def _function(self, function: FunctionType) -> None:
        self.word(function.__module__, function.__qualname__)
        if not _followed(function.__module__) and len(self.seen) > 1:
            return
        self.add([function.__code__, function.__defaults__, function.__kwdefaults__])
        for cell in function.__closure__ or ():
            try:
                self.add(cell.cell_contents)
            except ValueError as error:
                if "empty" not in str(error):
                    raise
        for name in sorted(_names(function.__code__)):
            if name in function.__globals__:
                self.word(name)
                self.add(function.__globals__[name])

    def _class(self, kind: type) -> None:
        self.word(kind.__module__, kind.__qualname__)
        if _followed(kind.__module__):
            self.add([*kind.__bases__])
            for name, value in kind.__dict__.items():
                if name not in IN_CLASSES:
                    self.word(name)
                    with suppress(ValueError):  # a descriptor: its name is enough
                        self.add(value)

    def _object(self, value: object) -> None:
        try:
            parts = value.__reduce_ex__(4)
        except Exception as error:
            raise ValueError(f"it contains {value!r}, which cannot be identified: {error}") from None
        if isinstance(parts, str):
            self.word(parts)
            return
        state = parts[2] if len(parts) > 2 else None
        if isinstance(state, dict):  # values of cached properties make no difference
            state = {k: v for k, v in state.items() if not isinstance(getattr(type(value), k, None), functools.cached_property)}
        self.add([*parts[:2], state, *(list(more) if more is not None else None for more in parts[3:5])])


def _names(code: CodeType) -> set[str]:
    """Names that a code object, and those nested in it, may take from their module."""
    nested = [_names(constant) for constant in code.co_consts if isinstance(constant, CodeType)]
    return set(code.co_names).union(*nested)


@functools.cache
def _followed(module: str) -> bool:
    """Whether a module is the user's own."""
    if module.partition(".")[0] in (*OURS, "builtins"):
        return False
    file = getattr(sys.modules.get(module), "__file__", None)
    if file is None:
        return module not in sys.builtin_module_names and getattr(sys.modules.get(module), "__spec__", None) is None
    return not any(Path(file).resolve().is_relative_to(folder) for folder in INSTALLED)
