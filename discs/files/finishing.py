"""The end of a run into a file: it is said in the file itself, at the places where it stands, so that no room is needed for it.

HDF5 does that by some writes, and a process that is killed between them leaves a file that HDF5 refuses. So what the file is beside
its variables, some kilobytes, is kept in the restart file before, and put back by the run that goes on.
"""

import os
from pathlib import Path

import numpy as np

from discs.arrays import Float
from discs.files import safe, schema, untrusted
from discs.files.framefile import FrameFile
from discs.running.stats import Stats


def outside(file: FrameFile) -> dict[str, Float]:
    """What of a file is no variable: "bytes" (m,), and "ends" (k, 2), where its pieces begin and end, the last with the file."""
    taken = sorted((offset, offset + 8 * int(np.prod(shape, dtype=int))) for offset, shape in file.places.values())
    begins, ends = [0, *(end for _, end in taken)], [*(begin for begin, _ in taken), file.size]
    data = b"".join(file.read_bytes(a, b - a) for a, b in zip(begins, ends, strict=True))
    return {"bytes": np.frombuffer(data, np.uint8), "ends": np.array([begins, ends]).T}


def put_back(path: Path, kept: dict[str, Float]) -> None:
    """Make a file again what it was when `outside` gave `kept`; its variables have not changed since."""
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
    """Say in a file that it is complete, and its stats."""
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
    file.attrs |= {"stats": untrusted.told("stats", text), "complete": 1}
