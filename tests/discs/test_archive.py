"""Archives: exact to the bit, complete or refused, readable by xarray."""

import json
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest
import xarray

from continuum import solve, steered_rod, untwisting_rod
from discs import Problem, Solution, load, simulate
from discs.files import framefile, schema
from tests.conftest import ALL, models, uneven


def same(a: Solution, b: Solution) -> None:
    """Whether all arrays and texts of two runs are equal to the bit."""
    for field in fields(Solution):
        one, other = getattr(a, field.name), getattr(b, field.name)
        if isinstance(one, np.ndarray):
            assert one.dtype == other.dtype
            assert one.shape == other.shape, field.name
            assert one.tobytes() == other.tobytes(), field.name
        elif field.name == "events":
            assert one == other
        elif field.name == "problem":
            assert repr_of(one) == repr_of(other)
        else:
            assert json.loads(schema.as_text(one)) == other, field.name


def repr_of(problem: Problem | None) -> str:
    with np.printoptions(floatmode="unique", threshold=sys.maxsize):
        return "" if problem is None else repr((problem.chain, problem.initial, problem.duration))


@models(ALL)
def test_round_trip(model, tmp_path):
    problem = uneven(6, model, equal=model.ends == "consistent")
    run = simulate(problem, dt=0.05, frames=4, want=("velocity", "contact_force"), progress=False, engine="compiled")
    run.save(tmp_path / "run.nc")
    same(run, load(tmp_path / "run.nc"))
    again = simulate(load(tmp_path / "run.nc").problem, dt=0.05, frames=4, progress=False, engine="compiled")
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
    arrays = {f.name for f in fields(Solution)} - {"t", "s", "stats", "error_estimate", "problem", "events"}
    assert arrays == set(schema.QUANTITIES)
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
    """xarray writes text of variable length; see `FrameFile._attribute`."""
    run.to_xarray().to_netcdf(tmp_path / "by-xarray.nc", engine="h5netcdf")
    with pytest.raises(ValueError, match="attribute 'format' is not a text of fixed length"):
        load(tmp_path / "by-xarray.nc")


def test_large_files_are_mapped(run, saved, monkeypatch):
    monkeypatch.setattr(framefile, "MAPPED", 0)
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
    """Peak memory, bytes, of a separate process that runs into a file: in total, and without mapped pages of files."""
    command = [sys.executable, "-c", MEMORY, str(discs), str(frames), str(path), engine]
    return map(int, subprocess.run(command, capture_output=True, text=True, check=True).stdout.split())


@pytest.mark.long
def test_memory_does_not_grow_with_frames(tmp_path):
    """A file of 130 MB, too large to be read whole, through a process that holds far less; a million discs: docs/archives.md."""
    (_, few), (_, many) = (memory(tmp_path / f"{frames}.nc", 20000, frames, "plain") for frames in (2, 202))
    size = (tmp_path / "202.nc").stat().st_size
    assert size > framefile.MAPPED
    assert many - few < 0.1 * size


@pytest.mark.long
def test_a_million_discs_take_less_than_a_gibibyte(tmp_path):
    """0.79 GiB, reckoned here from a fifth of them, 0.9 allowed; 12 frames make a file that is mapped as that of the million is."""
    (fixed, _), (used, _) = (memory(tmp_path / f"{discs}.nc", discs, 12, "compiled") for discs in (1000, 200_000))
    assert fixed + 5 * (used - fixed) < 0.9 * 2**30
