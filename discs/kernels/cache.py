"""The folders in which compiled kernels are kept, named by the content of the files that a kernel may call.

A folder is in NUMBA_CACHE_DIR if that is set, otherwise in `__pycache__` beside the kernels, otherwise in the user's cache. If none
can be written, every process compiles, with a warning. A new folder replaces folders of earlier content that no process has used
for a day.
"""

import hashlib
import os
import shutil
import tempfile
import time
from contextlib import suppress
from functools import cache
from pathlib import Path

from discs.warn import warn

HERE = Path(__file__).parent
CALLED = HERE / "compiled.py", HERE / "interrupts.py", HERE / "limits.py"  # files that every kernel depends on
ROOM = 2**20  # bytes on disc that a kernel may need
UNUSED = 86_400.0  # seconds without use after which kernels of earlier content are removed


def there(files: tuple[Path, ...], name: str) -> bool | None:
    """Whether the cache has a kernel of a name that calls these files; None if only numba can tell."""
    base = Path(os.environ.get("NUMBA_CACHE_DIR") or HERE / "__pycache__")
    if Path(".numba_config.yaml").exists() or not os.access(base if base.exists() else base.parent, os.W_OK):
        return None
    return any((base / f"kernels-{name}-{content(files)}").rglob("*.nbi"))


def content(files: tuple[Path, ...]) -> str:
    """A hash of these files, and of the whole folder of those in other packages: it identifies the kernels that call them."""
    folders = {path.parent for path in files if HERE.parent not in path.parents and (path.parent / "__init__.py").exists()}
    sources = sorted({*files, *CALLED, *(source for folder in folders for source in folder.glob("*.py"))})
    return hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:16]


@cache
def folder(files: tuple[Path, ...], name: str = "") -> str:
    """The cache folder of the kernels of a name that call these files; "" if none can be written."""
    import numba
    from numba.misc.appdirs import user_cache_dir

    users = user_cache_dir("rolling-discs")  # relative if XDG_CACHE_HOME is empty, which stands for unset
    bases = numba.config.CACHE_DIR, HERE / "__pycache__", users if Path(users).is_absolute() else ""
    for base in filter(None, bases):
        kept = Path(base) / f"kernels-{name}-{content(files)}"
        try:
            kept.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=kept) as file:
                file.write(bytes(ROOM))
                file.flush()
            os.utime(kept)
        except OSError:
            continue
        _remove_earlier(kept)
        return str(kept)
    return ""


def _remove_earlier(kept: Path) -> None:
    """Remove folders of the same kernel and earlier content that no process has used for a day."""
    for other in kept.parent.glob("kernels-*"):
        name = other.name.rpartition("-")[0]
        if other != kept and name in ("kernels", kept.name.rpartition("-")[0]):  # an older version named them by content alone
            with suppress(OSError):
                if time.time() - other.stat().st_mtime > UNUSED:
                    shutil.rmtree(other)


uncached: list[bool] = []  # not empty if kernels could not be cached


def warn_of_no_cache() -> None:
    """Warn, once, that kernels cannot be kept."""
    if not uncached:
        uncached.append(True)
        warn(
            "compiled kernels cannot be kept, as neither the package's folder nor the user's cache can be written: every process "
            "compiles them again, which takes a minute or more; set NUMBA_CACHE_DIR to a folder that can be written"
        )
