"""Writing results so that nothing half-written is ever left behind."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def fresh_files(out: str | Path) -> Iterator[Path]:
    """A folder to write into; its files move to `out` when the block ends well, and vanish when it does not.

    Raises ValueError at once if `out` cannot be written to.
    """
    target = Path(out)
    made = [p for p in (target, *target.parents) if not p.exists()]
    try:
        target.mkdir(parents=True, exist_ok=True)
        workshop = tempfile.TemporaryDirectory(dir=target, prefix=".partial-")
    except OSError as error:
        raise ValueError(f"--out must be a folder that can be written to; {target} is not: {error.strerror}") from None
    try:
        with workshop as folder:
            yield Path(folder)
            files = sorted(Path(folder).iterdir())
            for file in files:
                if (target / file.name).is_dir():
                    raise ValueError(f"--out holds a folder where a file is to be written: {target / file.name}")
            for file in files:
                os.replace(file, target / file.name)
    except BaseException:
        for folder_made in made:
            if not any(folder_made.iterdir()):
                folder_made.rmdir()
        raise
