"""The packages `continuum` and `compare` are the project's own, not files or distributions of these names."""

import warnings
from importlib.machinery import PathFinder
from pathlib import Path

OTHERS = "continuum", "compare"


def warn_of_others() -> None:
    """Warn if `import continuum` or `import compare` would find something else, as a file `compare.py` beside the user's script."""
    for name in OTHERS:
        spec = PathFinder.find_spec(name)
        found = spec.origin if spec else None
        if found and Path(found).parent.parent != Path(__file__).parent.parent:
            cure = "rename it" if Path(found).name != "__init__.py" else "install rolling-discs into an environment of its own"
            warnings.warn(f"`import {name}` finds {found}, not the package {name} of rolling-discs: {cure}", stacklevel=3)
