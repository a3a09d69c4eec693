"""Runs as files: bit for bit, whole or refused, readable by others."""

import json
import subprocess
import sys
from dataclasses import fields, replace

import h5py
import numpy as np
import pytest
import xarray

from continuum import solve, steered_rod, untwisting_rod
from discs import Problem, Solution, load, simulate
from discs.__main__ import main
from discs.files import archive, framefile
from tests.conftest import ALL, Model, models, uneven


def same(a: Solution, b: Solution) -> None:
    """Every array and word of two runs alike, to the bit."""
    for field in fields(Solution):
        one, other = getattr(a, field.name), getattr(b, field.name)
        if isinstance(one, np.ndarray):
            assert one.dtype == other.dtype
            assert one.shape == other.shape, field.name
            assert one.tobytes() == other.tobytes(), field.name
        elif field.name == "problem":
            assert repr_of(one) == repr_of(other)
        else:
            assert json.loads(archive.as_text(one)) == other, field.name


def repr_of(problem: Problem | None) -> str:
    with np.printoptions(floatmode="unique", threshold=sys.maxsize):
        return "" if problem is None else repr((problem.chain, problem.initial, problem.duration))


@pytest.fixture(scope="module")
def run():
    every = ("velocity", "slope", "contact_force", "modified_energy")
    return simulate(uneven(7, Model("springs", "field")), "leapfrog", 0.004, 6, every, progress=False)


@pytest.fixture
def saved(run, tmp_path):
    run.save(tmp_path / "run.nc")
    return tmp_path / "run.nc"


@models(ALL)
def test_round_trip(model, tmp_path):
    engine = "plain" if model.law == "true" else "compiled"
    problem = uneven(6, model, equal=model.ends == "consistent")
    run = simulate(problem, dt=0.05, frames=4, want=("velocity", "contact_force"), progress=False, engine=engine)
    run.save(tmp_path / "run.nc")
    same(run, load(tmp_path / "run.nc"))
    again = simulate(load(tmp_path / "run.nc").problem, dt=0.05, frames=4, progress=False, engine=engine)
    assert again.x.tobytes() == run.x.tobytes()  # what is in the file is enough to repeat the run


@pytest.mark.parametrize(
    "scene", [untwisting_rod(duration=0.3), steered_rod(duration=0.3, radius=0.7)], ids=["richardson", "elements"]
)
def test_fields_too(scene, tmp_path):
    field = solve(scene, 1e-3, frames=3, progress=False)
    field.save(tmp_path / "field.nc")
    found = load(tmp_path / "field.nc")
    same(field, found)
    assert found.error_estimate == field.error_estimate
    assert found.stats["scene"]["radius"] == scene.rod.radius


def test_every_quantity_has_unit_and_name(run):
    arrays = {f.name for f in fields(Solution)} - {"t", "s", "stats", "error_estimate", "problem"}
    assert arrays == set(archive.QUANTITIES)
    dataset = run.to_xarray()
    assert all(variable.attrs["long_name"] for variable in dataset.variables.values())
    assert dataset.x.dims == ("time", "disc")
    assert dataset.x.units == "length"
    assert dataset.contact_force.dims == ("time", "axis", "disc")
    assert dataset.bending_stiffness.dims == ("bend",)


def test_opens_in_plain_xarray(run, saved):
    with xarray.open_dataset(saved, engine="h5netcdf") as dataset:
        xarray.testing.assert_identical(dataset.load(), run.to_xarray())
    told = json.loads(dataset.attrs["problem"])
    assert (told["chain"], told["n"], told["length"], told["rolling"]) == ("Chain", 7, 3.1, "field")
    assert json.loads(dataset.attrs["stats"])["settings"] == "Leapfrog()"
    assert dataset.attrs["method"] == "leapfrog"
    assert json.loads(dataset.attrs["versions"])["numpy"] == np.__version__
    assert json.loads(dataset.attrs["seeds"]) == {}


def test_a_dataset_that_xarray_wrote_is_not_trusted(run, tmp_path):
    """Its texts are of any length; see `FrameFile._attribute`."""
    run.to_xarray().to_netcdf(tmp_path / "by-xarray.nc", engine="h5netcdf")
    with pytest.raises(ValueError, match="attribute 'format' is not a text of fixed length"):
        load(tmp_path / "by-xarray.nc")


def test_large_files_are_mapped(run, saved, monkeypatch):
    monkeypatch.setattr(archive, "MAPPED", 0)
    mapped = load(saved)
    assert isinstance(mapped.x, np.memmap)
    same(run, mapped)
    mapped.x[0, 0] = 7.0  # stays in memory
    same(run, load(saved))


def test_a_crash_leaves_the_old_file(run, saved, monkeypatch):
    before = saved.read_bytes()

    def fails(self, f, rows):
        raise OSError("disc full")

    monkeypatch.setattr(framefile.FrameFile, "write", fails)
    with pytest.raises(OSError, match="disc full"):
        replace(run, x=run.x + 1).save(saved)
    assert saved.read_bytes() == before
    assert [p.name for p in saved.parent.iterdir()] == ["run.nc"]


def test_cut_off_files_are_refused(saved):
    whole = saved.read_bytes()
    for size in (0, 1, 7, 8, 100, 2000, len(whole) // 2, len(whole) - 9, len(whole) - 1):
        saved.write_bytes(whole[:size])
        with pytest.raises(ValueError, match="cut off or damaged"):
            load(saved)


def test_a_changed_byte_is_never_a_changed_run(run, saved):
    """Each byte that is changed is noticed or does not matter to the run."""
    whole = saved.read_bytes()
    noticed = 0
    for place in np.random.default_rng(3).integers(0, len(whole), 200):
        saved.write_bytes(whole[:place] + bytes([whole[place] ^ 0x41]) + whole[place + 1 :])
        try:
            found = load(saved)
        except ValueError:
            noticed += 1
        else:
            for name in ("t", "s", *archive.QUANTITIES):
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
    return lambda file: file.attrs.update({name: archive.fixed(value)})


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
    """In what `info` prints, and in messages."""
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
    """Make variables 10^10 long where they are `size` long, by numbers that take no room on the disc."""
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
        (9, [*"xys", "theta", "omega", "density", "radius", "spin_inertia", *archive.INITIAL], "s does not increase"),
        (7, ["bending_stiffness"], "bending_stiffness has the shape .*, more than one for each of 9 discs"),
        (4, ["time", "checksum", *"xy", "theta", "omega", "energy", "rolling_residual"], "time does not increase"),
    ],
    ids=["some", "discs", "bends", "frames"],
)
def test_a_sparse_giant_is_refused_at_once(size, names, message, tmp_path):
    """Whether or not its sizes fit: at the first numbers that are not there."""
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


def test_where_nothing_can_be_written(run, tmp_path):
    with pytest.raises(ValueError, match="cannot be written: No such file"):
        run.save(tmp_path / "missing" / "run.nc")
    with pytest.raises(ValueError, match="cannot be written: it is a folder"):
        run.save(tmp_path)


def test_import_is_lazy():
    code = "import discs, sys; assert not {'xarray', 'h5netcdf', 'h5py'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


MEMORY = """
import pathlib, re, sys, threading, time
from discs import simulate
from discs.chains.twist import untwisting_chain

def held(what):
    return 1024 * int(re.search(what + ":[^0-9]*([0-9]+) kB", pathlib.Path("/proc/self/status").read_text())[1])

def watch():
    while True:
        own.append(held("RssAnon"))
        time.sleep(0.002)

own = []
threading.Thread(target=watch, daemon=True).start()
problem = untwisting_chain(int(sys.argv[1]), duration=1e-6)
run = simulate(problem, dt=1e-6, frames=int(sys.argv[2]), checkpoint=sys.argv[3], engine=sys.argv[4], progress=False)
assert abs(run.x[-1, 0]) < 1e-3
print(held("VmHWM"), max(own))  # getrusage would tell of the process that started this one
"""


def memory(path, discs, frames, engine):
    """The most memory, bytes, that a process of its own held for a run into a file: all, and without the pages of files."""
    command = [sys.executable, "-c", MEMORY, str(discs), str(frames), str(path), engine]
    return map(int, subprocess.run(command, capture_output=True, text=True, check=True).stdout.split())


def test_memory_does_not_grow_with_frames(tmp_path):
    """A file of 130 MB, too large to be read whole, through a process that holds far less; a million discs: docs/archives.md."""
    (_, few), (_, many) = (memory(tmp_path / f"{frames}.nc", 20000, frames, "plain") for frames in (2, 202))
    size = (tmp_path / "202.nc").stat().st_size
    assert size > archive.MAPPED
    assert many - few < 0.1 * size


def test_a_million_discs_take_less_than_a_gibibyte(tmp_path):
    """0.64 GiB, reckoned here from a fifth of them, 0.9 allowed; 12 frames make a file that is mapped as that of the million is."""
    (fixed, _), (used, _) = (memory(tmp_path / f"{discs}.nc", discs, 12, "compiled") for discs in (1000, 200_000))
    assert fixed + 5 * (used - fixed) < 0.9 * 2**30
