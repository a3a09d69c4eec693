"""The file of a run on disc: a NetCDF-4 file of fixed size whose frames are written in place.

All variables are contiguous and have their room from the start, so the file is whole before the first frame is written, and a
frame is written by the operating system at a known place, past the HDF5 library: nothing that kills the process can harm the file.
A frame's checksum is written last; until then the frame does not count.
"""

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discs import archive, checks
from discs.archive import CHECKSUM, COORDINATES, PARAMETERS, QUANTITIES, Header, attributes, dimensions
from discs.problem import Problem
from discs.solution import Solution

NUMBER, COUNT = np.dtype("<f8"), np.dtype("<i8")
DAMAGE = (OSError, KeyError, TypeError, RuntimeError, ValueError, AttributeError, RecursionError, OverflowError)
NEEDED = ("time", "s", "checksum", "x", "y", "theta", "omega", "energy")


def check_writable(path: Path) -> None:
    """Raise ValueError if no file can be made at `path`."""
    try:
        if path.is_dir():
            raise IsADirectoryError(0, "it is a folder")
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except (OSError, ValueError) as error:
        raise ValueError(f"{path} cannot be written: {getattr(error, 'strerror', error)}") from None


@contextmanager
def fresh(path: str | Path) -> Iterator[str]:
    """A file to write beside `path`, which takes its place when the block ends well and vanishes when it does not."""
    path = Path(path)
    check_writable(path)
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
    os.close(handle)
    try:
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)  # as any other new file
        yield temporary
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


class FrameFile:
    """An open file of frames.

    Attributes
    ----------
    path : where it is.
    attrs : its attributes, checked, JSON as what it says.
    frames : how many there is room for.
    """

    def __init__(self, path: str | Path, writable: bool) -> None:
        self.path = Path(path)
        try:
            self._fd = os.open(path, (os.O_RDWR if writable else os.O_RDONLY) | getattr(os, "O_BINARY", 0))
        except (OSError, ValueError, TypeError) as error:
            raise ValueError(f"{path} cannot be read: {getattr(error, 'strerror', error)}") from None
        if self.path.is_dir():
            os.close(self._fd)
            raise ValueError(f"{path} cannot be read: it is a folder")
        try:
            self._size = os.fstat(self._fd).st_size
            self._places = self._find()
            self.frames = self._places["time"][1][0]
            self.static = {name: self._read(name) for name in self._places if name in PARAMETERS | COORDINATES}
            self._check()
        except DAMAGE as error:
            os.close(self._fd)
            raise self._refusal(error) from None

    @classmethod
    def create(cls, path: str | Path, header: Header, shapes: dict[str, tuple[int, ...]]) -> "FrameFile":
        """A new file with room for all frames, what one of them records having the `shapes`."""
        import h5netcdf

        attrs, static = header
        sizes = {"time": static["time"].size}
        for name, shape in (*((name, value.shape) for name, value in static.items()), *((n, (0, *shapes[n])) for n in shapes)):
            sizes |= {d: size for d, size in zip(dimensions(name), shape, strict=True) if d != "time"}
        with h5netcdf.File(path, "w", alignment_threshold=1, alignment_interval=64) as file:
            file.dimensions = sizes
            for name in (*static, *shapes):
                dims = dimensions(name)
                variable = file.create_variable(name, dims, NUMBER, fillvalue=np.nan)
                variable.attrs.update(attributes(name, dims))
                if name in static:
                    variable[...] = static[name]
                else:  # the first number written makes HDF5 fill the whole room, with NaN
                    variable[(0,) * len(dims)] = np.nan
            marks = file.create_variable("checksum", ("time",), COUNT, data=np.zeros(sizes["time"], COUNT))
            marks.attrs["long_name"] = CHECKSUM
            file.attrs.update({key: archive.fixed(value) for key, value in attrs.items()})
        return cls(path, writable=True)

    @classmethod
    def open(cls, path: str | Path, writable: bool = False) -> "FrameFile":
        """An existing file; ValueError if it cannot be read or is not whole."""
        return cls(path, writable)

    def __enter__(self) -> "FrameFile":
        return self

    def __exit__(self, *error: object) -> None:
        os.close(self._fd)

    @cached_property
    def problem(self) -> Problem | None:
        """The problem, made again from what the file says of it."""
        told = self.attrs["problem"]
        try:
            if told is None:
                return None
            if checks.whole("n", told.get("n"), 1) != self._places["s"][1][0]:
                raise ValueError(f"n = {told['n']} of {self._places['s'][1][0]} discs")
            return archive.rebuild(told, {name: value for name, value in self.static.items() if name in PARAMETERS})
        except DAMAGE as error:
            raise self._refusal(error) from None

    def _refusal(self, error: BaseException) -> ValueError:
        return ValueError(f"{self.path} is not a run that was saved, or it is cut off or damaged: {_line(error)}")

    # Frames

    def __contains__(self, name: str) -> bool:
        """Whether frames record a quantity."""
        return name in self._places

    def write(self, f: int, rows: dict[str, Any]) -> None:
        """Write frame f, its checksum last."""
        data = {name: np.ascontiguousarray(value, NUMBER) for name, value in rows.items()}
        for name, value in data.items():
            self._write(name, f, value)
        self._write("checksum", f, np.array(archive.frame_checksum(data), COUNT))

    def flush(self) -> None:
        """Have everything on the disc, in case the power fails."""
        os.fsync(self._fd)

    def whole(self) -> int:
        """How many frames from the first on are there."""
        marks, names = self._read("checksum"), [name for name in QUANTITIES if name in self._places]
        for f in range(self.frames):
            if marks[f] == 0 or archive.frame_checksum({name: self._read(name, f) for name in names}) != marks[f]:
                return f
        return self.frames

    def solution(self, problem: Problem | None = None) -> Solution:
        """The frames that are there; ValueError if there are none, or too few in a complete file. A known `problem` is not read."""
        count, missing = self.whole(), {}
        if count < self.frames:
            if self.attrs["complete"]:
                raise ValueError(f"{self.path} is damaged: frame {count} is not what was written")
            if not count:
                raise ValueError(f"{self.path} holds no frame yet")
            missing = {"frames_missing": self.frames - count}
        rows = {name: self._rows(name, count) for name in QUANTITIES if name in self._places}
        return Solution(
            t=self.static["time"][:count],
            s=self.static["s"],
            stats=self.attrs["stats"] | missing,
            error_estimate=self.attrs["error_estimate"],
            problem=problem or self.problem,
            **rows,
        )

    def _write(self, name: str, f: int, value: NDArray) -> None:
        offset, left = self._places[name][0] + f * value.nbytes, value.reshape(-1).view(np.uint8).data
        while left:
            done = os.pwrite(self._fd, left, offset)
            offset, left = offset + done, left[done:]

    def _read(self, name: str, f: int | None = None) -> NDArray:
        """A variable, or its frame f, read from the file."""
        offset, shape = self._places[name]
        if f is not None:
            shape = shape[1:]
            offset += f * 8 * int(np.prod(shape, dtype=int))
        data, left = bytearray(), 8 * int(np.prod(shape, dtype=int))
        while left:
            part = os.pread(self._fd, left, offset)
            if not part:
                raise ValueError(f"{self.path} is cut off")
            data, offset, left = data + part, offset + len(part), left - len(part)
        return np.frombuffer(data, COUNT if name == "checksum" else NUMBER).reshape(shape)

    def _rows(self, name: str, count: int) -> NDArray:
        offset, (_, *rest) = self._places[name]
        if self._size > archive.MAPPED:
            return np.memmap(self.path, NUMBER, "c", offset, (count, *rest))
        return self._read(name)[:count]

    # What is in the file

    def _find(self) -> dict[str, tuple[int, tuple[int, ...]]]:
        """Place in the file and shape of each variable; sets `attrs`. HDF5 is asked for names, shapes, places and attributes."""
        import h5py

        places = {}
        with h5py.File(self.path, "r") as file:
            if "format" not in file.attrs or self._attribute(file, "format") != archive.FORMAT:
                raise ValueError(f"its attribute 'format' is not {archive.FORMAT!r}")
            self.attrs: dict[str, Any] = {name: self._attribute(file, name) for name in (*TEXTS, "complete", "checksum")}
            for name in (*QUANTITIES, *PARAMETERS, *COORDINATES, "checksum"):
                if name not in file:
                    continue
                if not isinstance(file.get(name, getlink=True), h5py.HardLink) or not isinstance(found := file[name], h5py.Dataset):
                    raise ValueError(f"{name} is not a variable of this file")
                offset, need = found.id.get_offset(), COUNT if name == "checksum" else NUMBER
                if found.dtype != need or offset is None or not 0 < offset <= self._size - 8 * found.size:
                    raise ValueError(f"{name} is not stored as {need} in one piece")
                places[name] = offset, found.shape
        return places

    def _attribute(self, file: Any, name: str) -> str | int:
        """An attribute that is a text of fixed length or a whole number. What it is is asked before it is read: in a changed file
        texts of any length, which stand in a heap, can keep HDF5 busy for ever."""
        kind = file.attrs.get_id(name)
        if kind.shape not in ((), (1,)) or kind.dtype.kind not in "Si" or kind.dtype.itemsize > self._size:
            raise ValueError(f"attribute {name!r} is not a text of fixed length or a whole number")
        value = np.asarray(file.attrs[name]).item()
        return value.decode() if isinstance(value, bytes) else value

    def _check(self) -> None:
        """Check shapes and header; sets `attrs` to what they say."""
        for name in NEEDED:
            if name not in self._places:
                raise ValueError(f"{name} is missing")
        sizes = {"axis": (2,), "disc": self._places["s"][1], "time": self._places["time"][1]}
        for name, (_, shape) in self._places.items():
            need = tuple(
                sizes.get(d, shape[i : i + 1])[0] for i, d in enumerate(("time",) if name == "checksum" else dimensions(name))
            )
            if shape != need or not np.prod(shape):
                raise ValueError(f"{name} has the shape {shape}, not {need}")
        if archive.header_checksum(self.attrs, self.static) != self.attrs["checksum"]:
            raise ValueError("parameters, times or places are not what was written")
        self.attrs |= {name: json.loads(self.attrs[name]) for name in TEXTS}
        for name, kind in TEXTS.items():
            if not isinstance(self.attrs[name], kind):
                raise ValueError(f"attribute {name!r} is {type(self.attrs[name]).__name__}")


TEXTS: dict[str, Any] = {"problem": (dict, type(None)), "stats": dict, "error_estimate": (dict, type(None)), "versions": dict}


def _line(error: BaseException) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
