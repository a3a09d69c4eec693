"""Files that are cut off, changed, foreign or hostile are refused."""

import json

import h5py
import numpy as np
import pytest
import xarray

from discs import load, simulate
from discs.__main__ import main
from discs.files import schema
from tests.conftest import Model, uneven
from tests.discs.test_archive import repr_of


def test_cut_off_files_are_refused(saved):
    whole = saved.read_bytes()
    for size in (0, 1, 7, 8, 100, 2000, len(whole) // 2, len(whole) - 9, len(whole) - 1):
        saved.write_bytes(whole[:size])
        with pytest.raises(ValueError, match="cut off or damaged"):
            load(saved)


@pytest.mark.slow
def test_a_changed_byte_is_never_a_changed_run(run, saved):
    """Every changed byte is detected or does not change the run."""
    whole = saved.read_bytes()
    noticed = 0
    for place in np.random.default_rng(3).integers(0, len(whole), 200):
        saved.write_bytes(whole[:place] + bytes([whole[place] ^ 0x41]) + whole[place + 1 :])
        try:
            found = load(saved)
        except ValueError:
            noticed += 1
        else:
            for name in ("t", "s", *schema.QUANTITIES):
                assert (getattr(found, name) is None) or getattr(found, name).tobytes() == getattr(run, name).tobytes(), (
                    place,
                    name,
                )
            assert repr_of(found.problem) == repr_of(run.problem)
    assert noticed > 20


def change(path, do):
    with h5py.File(path, "r+") as file:
        do(file)


def without(name):
    return lambda file: file.pop(name)


def attribute(name, value):
    return lambda file: file.attrs.update({name: schema.fixed(value)})


def elsewhere(file):
    del file["x"]
    file["x"] = h5py.ExternalLink("other.nc", "/x")


def packed(file):
    x = file.pop("x")[...]
    file.create_dataset("x", data=x, chunks=True, compression="gzip")


@pytest.mark.parametrize(
    ("do", "message"),
    [
        (without("theta"), "theta is missing"),
        (attribute("format", "another"), "'format' is not"),
        (attribute("stats", "{"), "damaged"),
        (attribute("stats", "[1]"), "attribute 'stats' is list"),
        (attribute("problem", '{"chain": "Chain", "n": 1e99}'), "not what was written"),
        (attribute("stats", 3.5), "attribute 'stats' is not a text"),
        (attribute("stats", ["a", "b"]), "attribute 'stats' is not a text"),
        (elsewhere, "x is not a variable of this file"),
        (packed, "x is not stored as float64 in one piece"),
    ],
)
def test_files_that_are_not_as_they_should_be(do, message, saved):
    change(saved, do)
    with pytest.raises(ValueError, match=message):
        load(saved)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("stats", {"dt": "fast"}, "attribute 'stats', 'dt' is str, not int or float or NoneType"),
        ("stats", {"dt": 10**400}, "attribute 'stats', 'dt' is int"),
        ("stats", {"method": ["a"]}, "attribute 'stats', 'method' is list, not str"),
        ("stats", {"steps": None}, "attribute 'stats', 'steps' is NoneType, not int"),
        ("stats", {"steps": True}, "attribute 'stats', 'steps' is bool, not int"),
        ("stats", {"scene": "rod"}, "attribute 'stats', 'scene' is str, not dict"),
        ("stats", {"scene": {}}, "attribute 'stats', name of the scene is NoneType, not str"),
        ("error_estimate", {"x": "small"}, "attribute 'error_estimate', 'x' is str"),
        ("error_estimate", [1], "attribute 'error_estimate' is list, not dict or NoneType"),
        ("versions", 3, "attribute 'versions' is int, not dict"),
    ],
)
def test_odd_words_are_refused(name, value, message, saved):
    change(saved, attribute(name, json.dumps(value)))
    with pytest.raises(ValueError, match=message):
        load(saved)


@pytest.mark.parametrize("text", ["[" * 50_000 + "]" * 50_000, "x" * 5_000_000, '{"a": ' * 50_000], ids=["nested", "long", "open"])
def test_endless_words_are_refused(text, saved):
    change(saved, attribute("stats", text))
    with pytest.raises(ValueError, match="is not a run that was saved, or it is cut off or damaged"):
        load(saved)


def test_words_of_a_file_cannot_steer_a_terminal(saved, tmp_path, capsys):
    """Control characters are escaped in the output of `info` and in messages."""
    evil = "\x1b[31m\x9b2J\u202e\r\nline"
    stats = {"method": evil, "scene": {"name": evil, evil: evil, "long": "x" * 10_000}}
    change(saved, attribute("stats", json.dumps(stats)))
    change(saved, attribute("versions", json.dumps({evil: evil})))
    change(saved, attribute("error_estimate", json.dumps({evil: 1.0})))
    assert main(["info", str(saved)]) == 0
    printed = capsys.readouterr().out
    assert all(c.isprintable() or c == "\n" for c in printed)
    assert len(printed) < 4000
    assert "\\x1b[31m\\x9b2J\\u202e\\r\\nline = " in printed
    other = tmp_path / f"{evil}.nc".replace("/", "")
    other.write_bytes(b"")
    assert main(["info", str(other)]) == 2
    assert main(["info", f"missing {evil}.nc"]) == 2
    printed = capsys.readouterr().err
    assert all(c.isprintable() or c == "\n" for c in printed)
    assert printed.count("\n") == 2


def sparse(file, size, names):
    """Change the length of variables from `size` to 10^10 without using space on the disc."""
    made = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    made.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    made.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    for name in names:
        shape = [10**10 if length == size else length for length in file[name].shape]
        kind = file[name].id.get_type()
        del file[name]
        h5py.h5d.create(file.id, name.encode(), kind, h5py.h5s.create_simple(tuple(shape)), made)


@pytest.mark.parametrize(
    ("size", "names", "message"),
    [
        (9, ["x", "y", "theta", "omega", "s"], "has the shape"),
        (9, [*"xys", "theta", "omega", "density", "radius", "spin_inertia", *schema.INITIAL], "s does not increase"),
        (7, ["bending_stiffness"], "bending_stiffness has the shape .*, more than one for each of 9 discs"),
        (4, ["time", "checksum", *"xy", "theta", "omega", "energy", "rolling_residual"], "time does not increase"),
    ],
    ids=["some", "discs", "bends", "frames"],
)
def test_a_sparse_giant_is_refused_at_once(size, names, message, tmp_path):
    """The first missing numbers are detected, whether or not the sizes agree."""
    path = tmp_path / "giant.nc"
    simulate(uneven(9, Model("springs", "field")), dt=0.05, frames=4, progress=False, engine="plain").save(path)
    with h5py.File(path, "r+") as file:
        sparse(file, size, [name for name in names if name in file])
    assert path.stat().st_size > 5e10
    with pytest.raises(ValueError, match=message):
        load(path)


def test_a_frame_that_was_changed_is_refused(saved):
    change(saved, lambda file: file["y"].write_direct(np.array([1.0]), dest_sel=np.s_[3, 2:3]))
    with pytest.raises(ValueError, match="damaged: frame 3 is not what was written"):
        load(saved)


@pytest.mark.slow
def test_foreign_files_are_refused(tmp_path):
    (tmp_path / "text.nc").write_text("no run")
    xarray.Dataset({"x": ("time", [1.0])}).to_netcdf(tmp_path / "foreign.nc", engine="h5netcdf")
    for name in ("text.nc", "foreign.nc"):
        with pytest.raises(ValueError, match=f"{name} is not a run that was saved"):
            load(tmp_path / name)
    with pytest.raises(ValueError, match=r"missing\.nc cannot be read: No such file"):
        load(tmp_path / "missing.nc")
    with pytest.raises(ValueError, match=r"cannot be read: (it is a folder|Permission denied)"):
        load(tmp_path)
