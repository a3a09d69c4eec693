"""Writing results completely or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def fresh_files(out: str | Path) -> Iterator[Path]:
    """A temporary folder whose files move to `out` if the block succeeds and are deleted if it fails.

    Raises ValueError if `out` cannot be written to.
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
                    raise ValueError(f"--out contains a folder in place of the file {target / file.name}")
            for file in files:
                os.replace(file, target / file.name)
    except BaseException:
        for folder_made in made:
            if not any(folder_made.iterdir()):
                folder_made.rmdir()
        raise
