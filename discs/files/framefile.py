"""The file of a run on disc: a NetCDF-4 file of fixed size whose frames are written in place.

All variables are contiguous and allocated from the start, so the file is valid before the first frame is written. A frame is
written at a known offset without the HDF5 library, so a process that is killed cannot damage the file. A frame's checksum is
written last; until then the frame does not count.
"""

import os
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.files import safe, schema, untrusted
from discs.files.schema import CHECKSUM, COORDINATES, MOTION, PARAMETERS, QUANTITIES, RECORDED, Header, attributes, dimensions
from discs.mechanics import Trajectory
from discs.problem import Problem
from discs.solution import Solution

NUMBER, COUNT = np.dtype("<f8"), np.dtype("<i8")
MAPPED = 64 * 2**20  # bytes; arrays of larger files are memory-mapped, not read
PART = 2**24  # bytes that are read at once
DAMAGE = (OSError, KeyError, TypeError, RuntimeError, ValueError, AttributeError, RecursionError, OverflowError)
NEEDED = ("time", "checksum", "energy")
OF_DISCS = ("s", "x", "y", "theta", "omega")
OF_SYSTEMS = ("q", "v", "residual")


def room(head: Header, shapes: dict[str, tuple[int, ...]]) -> int:
    """Bytes of a file with this header and frames of the given `shapes`: a lower bound, nearly exact."""
    frame = sum(int(np.prod(shape, dtype=int)) for shape in shapes.values())
    return 8 * (head.static["time"].size * (frame + 1) + sum(value.size for value in head.static.values()))


class FrameFile:
    """An open file of frames.

    Attributes
    ----------
    path : where it is.
    attrs : its checked attributes, JSON decoded.
    frames : number of frames that the file has space for.
    places : offset of each variable in the file, bytes, and its shape.
    size : of the file, bytes.
    """

    def __init__(self, path: str | Path, writable: bool) -> None:
        self._fd = safe.opened(path, os.O_RDWR if writable else os.O_RDONLY)
        self.path = Path(path)
        try:
            self.size = os.fstat(self._fd).st_size
            self.places = self._find()
            self._check_shapes()
            self.frames = self.places["time"][1][0]
            # these two must increase, so that wrong sizes are detected before anything else is read
            self.static = {name: self._increasing(name) for name in COORDINATES if name in self.places}
            self.static |= {name: self._read(name) for name in self.places if name in PARAMETERS}
            self._check_header()
        except (*DAMAGE, MemoryError) as error:
            os.close(self._fd)
            raise self._refusal(error) from None

    @classmethod
    def create(cls, path: str | Path, header: Header, shapes: dict[str, tuple[int, ...]]) -> "FrameFile":
        """A new file with space for all frames; `shapes` are those of the arrays of one frame."""
        import h5netcdf

        attrs, static = header
        sizes = {"time": static["time"].size}
        for name, shape in (*((name, value.shape) for name, value in static.items()), *((n, (0, *shapes[n])) for n in shapes)):
            sizes |= {d: size for d, size in zip(dimensions(name), shape, strict=True) if d != "time"}
        with h5netcdf.File(path, "w", locking=False, alignment_threshold=1, alignment_interval=64) as file:
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
            file.attrs.update({key: schema.fixed(value) for key, value in attrs.items()})
        return cls(path, writable=True)

    @classmethod
    def open(cls, path: str | Path, writable: bool = False) -> "FrameFile":
        """An existing file; ValueError if it cannot be read or is damaged."""
        return cls(path, writable)

    def __enter__(self) -> "FrameFile":
        return self

    def __exit__(self, *error: object) -> None:
        os.close(self._fd)

    @cached_property
    def problem(self) -> Problem | None:
        """The problem, rebuilt from the file; None if the file has none."""
        told = self.attrs["problem"]
        try:
            if "q" in self and told is not None:
                told = told.get("discs")
            if told is None:
                return None
            if checks.whole("n", told.get("n"), 1) != self.places["s"][1][0]:
                raise ValueError(f"n = {told['n']} of {self.places['s'][1][0]} discs")
            return schema.rebuild(told, {name: value for name, value in self.static.items() if name in PARAMETERS})
        except DAMAGE as error:
            raise self._refusal(error) from None

    def _refusal(self, error: BaseException) -> ValueError:
        if isinstance(error, MemoryError):
            return ValueError(f"{self.path} is too large for this machine's memory")
        return ValueError(f"{self.path} is not a run that was saved, or it is cut off or damaged: {_line(error)}")

    # Frames

    def __contains__(self, name: str) -> bool:
        """Whether frames record a quantity."""
        return name in self.places

    def write(self, f: int, rows: dict[str, ArrayLike]) -> None:
        """Write frame f, its checksum last."""
        data = {name: np.ascontiguousarray(value, NUMBER) for name, value in rows.items()}
        for name, value in data.items():
            self._write(name, f, value)
        self._write("checksum", f, np.array(schema.frame_checksum(data), COUNT))

    def flush(self) -> None:
        """Flush everything to the disc, in case the power fails."""
        os.fsync(self._fd)

    @property
    def recorded(self) -> list[str]:
        """Names of the recorded quantities."""
        return [name for name in RECORDED if name in self.places]

    def whole(self, most: int | None = None) -> int:
        """Number of valid frames from the first on, at most `most`."""
        marks, most = self._read("checksum"), self.frames if most is None else most
        for f in range(most):
            if marks[f] == 0 or schema.frame_checksum({name: self._read(name, f) for name in self.recorded}) != marks[f]:
                return f
        return most

    def _count(self) -> int:
        """Number of valid frames; ValueError if there are none, or too few in a complete file."""
        count = self.whole()
        if count < self.frames and self.attrs["complete"]:
            raise ValueError(f"{self.path} is damaged: frame {count} is not what was written")
        if not count:
            raise ValueError(f"{self.path} holds no frame yet")
        return count

    def solution(self, problem: Problem | None = None) -> Solution:
        """The valid frames; ValueError if there are none, or too few in a complete file. The problem is read unless given."""
        count = self._count()
        missing = {"frames_missing": self.frames - count} if count < self.frames else {}
        rows = {name: self._rows(name, count) for name in self.recorded if name in QUANTITIES}
        return Solution(
            t=self.static["time"][:count],
            s=self.static["s"],
            stats=self.attrs["stats"] | missing,
            error_estimate=self.attrs["error_estimate"],
            problem=problem or self.problem,
            events=(),
            **rows,
        )

    def trajectory(self) -> Trajectory:
        """The motion of a mechanical system; ValueError as for `solution`."""
        count, told = self._count(), self.attrs["problem"] or {}
        rows: dict[str, Any] = {name: self._rows(name, count) for name in (*MOTION, "energy") if name in self}
        rows.setdefault("multipliers", np.zeros((count, 0)))
        for name, of in (("names", "q"), ("owners", "multipliers")):
            given = told.get(name)
            if not isinstance(given, list) or len(given) != rows[of].shape[1] or not all(isinstance(text, str) for text in given):
                raise ValueError(f"{self.path} is damaged: {name} must be one text for each of {rows[of].shape[1]} columns of {of}")
            rows[name] = tuple(given)
        bodies = self.solution() if "x" in self else None
        return Trajectory(t=self.static["time"][:count], stats=self.attrs["stats"], bodies=bodies, **rows)

    def _write(self, name: str, f: int, value: Float) -> None:
        safe.write_all(self._fd, value.reshape(-1).view(np.uint8).data, self.places[name][0] + f * value.nbytes)

    def _read(self, name: str, f: int | None = None) -> Float:
        """A variable, or its frame f, read from the file."""
        offset, shape = self.places[name]
        if f is not None:
            shape = shape[1:]
            offset += f * 8 * int(np.prod(shape, dtype=int))
        return np.frombuffer(self.read_bytes(offset, 8 * int(np.prod(shape, dtype=int))), _kind(name)).reshape(shape)

    def read_bytes(self, offset: int, left: int) -> bytearray:
        """Bytes of the file from a place on."""
        data = bytearray()
        while left:
            part = os.pread(self._fd, min(left, PART), offset)
            if not part:
                raise ValueError(f"{self.path} is cut off")
            data += part
            offset, left = offset + len(part), left - len(part)
        return data

    def _increasing(self, name: str) -> Float:
        """A variable whose numbers increase, read in parts so that a large wrong file is refused early."""
        offset, (size,) = self.places[name]
        parts = [np.empty(0)]
        for first in range(0, size, PART // 8):
            parts.append(np.frombuffer(self.read_bytes(offset + 8 * first, min(PART, 8 * (size - first))), NUMBER))
            joined = np.concatenate([parts[-2][-1:], parts[-1]])
            if not (np.isfinite(joined).all() and (np.diff(joined) > 0).all()):
                raise ValueError(f"{name} does not increase")
        return np.concatenate(parts)

    def _rows(self, name: str, count: int) -> Float:
        offset, (_, *rest) = self.places[name]
        if self.size > MAPPED:
            with open(os.dup(self._fd), "rb") as file:
                return np.memmap(file, NUMBER, "c", offset, (count, *rest))
        return self._read(name)[:count]

    def same(self) -> bool:
        """Whether the file is still the one at its path."""
        return safe.same(self._fd, self.path)

    # What is in the file

    def _find(self) -> dict[str, tuple[int, tuple[int, ...]]]:
        """Place in the file and shape of each variable; sets `attrs`. HDF5 reads only names, shapes, places and attributes."""
        import h5py

        places = {}
        with h5py.File(self.path, "r", locking=False) as file:
            if "format" not in file.attrs or self._attribute(file, "format") != schema.FORMAT:
                raise ValueError(f"its attribute 'format' is not {schema.FORMAT!r}")
            self.attrs: dict[str, Any] = {name: self._attribute(file, name) for name in (*untrusted.TEXTS, "complete", "checksum")}
            for name in (*RECORDED, *PARAMETERS, *COORDINATES, "checksum"):
                if name not in file:
                    continue
                if not isinstance(file.get(name, getlink=True), h5py.HardLink) or not isinstance(found := file[name], h5py.Dataset):
                    raise ValueError(f"{name} is not a variable of this file")
                offset, need = found.id.get_offset(), _kind(name)
                if found.dtype != need or offset is None or not 0 < offset <= self.size - 8 * found.size:
                    raise ValueError(f"{name} is not stored as {need} in one piece")
                places[name] = offset, found.shape
        if not self.same():
            raise ValueError("it was replaced while it was read; read it again")
        return places

    def _attribute(self, file: Any, name: str) -> str | int:
        """An attribute that is a text of fixed length or a whole number. Its type is checked before it is read: in a changed file,
        text of variable length, which HDF5 stores in a heap, can make HDF5 loop for ever."""
        kind = file.attrs.get_id(name)
        if kind.shape not in ((), (1,)) or kind.dtype.kind not in "Si" or kind.dtype.itemsize > untrusted.LONGEST:
            raise ValueError(f"attribute {name!r} is not a text of fixed length or a whole number")
        value = np.asarray(file.attrs[name]).item()
        return value.decode() if isinstance(value, bytes) else value

    def _check_shapes(self) -> None:
        """Check the shapes of the variables, before any is read."""
        system = "q" in self.places
        discs = not system or "s" in self.places
        for name in (*NEEDED, *(OF_DISCS * discs), *(OF_SYSTEMS * system)):
            if name not in self.places:
                raise ValueError(f"{name} is missing")
        sizes = {"axis": (2,), "part": (2,), "time": self.places["time"][1]}
        for dim, name in (("disc", "s"), ("coordinate", "q"), ("constraint", "multipliers")):
            sizes |= {dim: self.places[name][1][-1:]} if name in self.places else {}
        for name, (_, shape) in self.places.items():
            dims = ("time",) if name == "checksum" else dimensions(name)
            need = tuple(sizes.get(d, shape[i : i + 1])[0] for i, d in enumerate(dims))
            if shape != need or not np.prod(shape):
                raise ValueError(f"{name} has the shape {shape}, not {need}")
            if dims[-1] in ("disc", "link", "bend") and not (discs and shape[-1] <= sizes["disc"][0]):
                raise ValueError(f"{name} has the shape {shape}, more than one for each of {sizes.get('disc', (0,))[0]} discs")

    def _check_header(self) -> None:
        """Check the header and decode its JSON in `attrs`."""
        if schema.header_checksum(self.attrs, self.static) != self.attrs["checksum"]:
            raise ValueError("parameters, times or places are not what was written")
        self.attrs |= {name: untrusted.decoded(name, self.attrs[name]) for name in untrusted.TEXTS}


def _kind(name: str) -> np.dtype:
    return COUNT if name == "checksum" else NUMBER


def _line(error: BaseException) -> str:
    return untrusted.printable(str(error).splitlines()[0] if str(error) else type(error).__name__)
