"""The names that the project promises, and packages of other people that hide ours."""

import importlib
import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import pytest

from discs import events
from discs.loads import signals

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "public.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `([\w.]+)`: [^|]+ \| (.+) \|$", PAGE, re.MULTILINE)
PACKAGES = {"discs", "continuum", "compare"}
CLEAR = {"self", "cls", "path", "ax", "progress"}  # arguments that need no words


@pytest.mark.parametrize(("module", "names"), ROWS, ids=[module for module, _ in ROWS])
def test_public_names_are_those_of_the_page(module, names):
    assert sorted(re.findall(r"`(\w+)`", names)) == sorted(importlib.import_module(module).__all__)


def test_the_page_lists_the_three_packages():
    assert {module for module, _ in ROWS} >= PACKAGES


def functions(thing: Any) -> Iterator[tuple[str, Any, str]]:
    """A function, or the methods of a class and its fields: name, function (or names of fields), docstrings that describe it."""
    if inspect.isfunction(thing):
        yield thing.__name__, thing, inspect.getdoc(thing) or ""
    elif inspect.isclass(thing):
        about = " ".join(inspect.getdoc(base) or "" for base in thing.__mro__ if base.__module__.split(".")[0] in PACKAGES)
        for name, found in vars(thing).items():
            method = getattr(found, "fget", None) or getattr(found, "func", None) or getattr(found, "__func__", found)
            written = inspect.isfunction(method) and not method.__code__.co_filename.startswith("<")  # not made by dataclass
            if written and (not name.startswith("_") or name in ("__init__", "__post_init__")):
                yield f"{thing.__name__}.{name}", method, f"{about} {inspect.getdoc(getattr(thing, name)) or ''}"
        if is_dataclass(thing) or hasattr(thing, "_fields"):
            names = [field.name for field in fields(thing)] if is_dataclass(thing) else thing._fields
            yield thing.__name__, names, about


def test_docstrings_name_all_arguments_and_the_errors():
    """Each argument and field is described, by its name, and each function that raises ValueError itself says so."""
    modules = [importlib.import_module(module) for module, _ in ROWS]
    things = [getattr(module, name) for module in (*modules, events) for name in module.__all__]
    missing, seen = [], 0
    for name, function, told in (row for thing in (*things, *signals.NAMES.values()) for row in functions(thing)):
        is_fields = isinstance(function, list | tuple)
        given = function if is_fields else inspect.signature(function).parameters
        words = set(re.findall(r"\w+", told.lower()))
        missing += [f"{name}: {word}" for word in given if word not in CLEAR and word.lower() not in words]
        if not is_fields and "raise ValueError" in inspect.getsource(function) and "ValueError" not in told:
            missing.append(f"{name}: ValueError")
        seen += 1
    assert seen > 100
    assert not missing


@pytest.mark.slow
@pytest.mark.parametrize(("path", "cure"), [("compare.py", "rename it"), ("continuum/__init__.py", "an environment of its own")])
def test_a_file_that_hides_a_package_is_named(tmp_path, path, cure):
    file = tmp_path / path
    file.parent.mkdir(exist_ok=True)
    file.touch()
    (tmp_path / "script.py").write_text("import discs")
    script = [sys.executable, "-W", "default", str(tmp_path / "script.py")]
    told = subprocess.run(script, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True).stderr
    assert str(file) in told
    assert cure in told
