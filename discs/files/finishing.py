"""Completing the file of a run: its attributes are changed in place, so that no further space is needed.

HDF5 does this in several writes, and a process that is killed between them leaves a file that HDF5 refuses. Therefore all bytes
outside the variables, some kilobytes, are first copied to the restart file; a run that continues restores them.
"""

import os
from pathlib import Path

import numpy as np

from discs.arrays import Float
from discs.files import safe, schema, untrusted
from discs.files.framefile import FrameFile
from discs.stats import Stats


def outside(file: FrameFile) -> dict[str, Float]:
    """The bytes of a file outside its variables: "bytes" (m,), and "ends" (k, 2), begin and end of each piece."""
    taken = sorted((offset, offset + 8 * int(np.prod(shape, dtype=int))) for offset, shape in file.places.values())
    begins, ends = [0, *(end for _, end in taken)], [*(begin for begin, _ in taken), file.size]
    data = b"".join(file.read_bytes(a, b - a) for a, b in zip(begins, ends, strict=True))
    return {"bytes": np.frombuffer(data, np.uint8), "ends": np.array([begins, ends]).T}


def put_back(path: Path, kept: dict[str, Float]) -> None:
    """Restore a file to its state when `outside` returned `kept`; its variables have not changed since."""
    fd, data, place = safe.opened(path, os.O_RDWR), kept["bytes"].tobytes(), 0
    try:
        for a, b in kept["ends"].tolist():
            safe.write_all(fd, data[place : place + b - a], a)
            place += b - a
        os.ftruncate(fd, int(kept["ends"][-1, 1]))
        os.fsync(fd)
    finally:
        os.close(fd)


def finish(file: FrameFile, stats: Stats) -> None:
    """Mark a file as complete and write its stats."""
    import h5py

    text = schema.as_text(stats)
    with h5py.File(file.path, "r+", locking=False) as header:
        kept = header.attrs.get_id("stats").dtype.itemsize
        if len(text) <= kept:
            header.attrs.modify("stats", schema.fixed(text.ljust(kept)))
        else:
            header.attrs["stats"] = schema.fixed(text)
        header.attrs.modify("complete", 1)
    file.flush()
    file.attrs |= {"stats": untrusted.decoded("stats", text), "complete": 1}
