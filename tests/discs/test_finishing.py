"""The end of a run into a file, full discs, and what has reached the disc when."""

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from discs import load, simulate
from discs.files import finishing, safe
from discs.running import recording
from tests.discs.test_files import PROBLEM, SETTLED
from tests.discs.test_restart import Stop, equal

# The end of a run, and full discs


def test_a_kill_in_the_middle_of_the_end_is_put_right(tmp_path, monkeypatch):
    """HDF5 may have written any part of its changes: here half of each byte range."""
    path, whole = tmp_path / "run.nc", simulate(PROBLEM, **SETTLED)

    def torn(file, stats):
        before = path.read_bytes()
        finish(file, stats)
        after = path.read_bytes()
        changed = [i for i in range(len(before)) if before[i] != after[i]]
        half = bytearray(before)
        for i in changed[: len(changed) // 2]:
            half[i] = after[i]
        path.write_bytes(half + b"more")
        raise Stop

    finish = finishing.finish
    with monkeypatch.context() as patched:
        patched.setattr(recording, "finish", torn)
        patched.setattr(recording.Recording, "_close", lambda self: self.file.__exit__() or self.restart.close())  # as a kill does
        with pytest.raises(Stop):
            simulate(PROBLEM, **SETTLED, checkpoint=path)
    with pytest.raises(ValueError, match="damaged"):
        load(path)
    equal(simulate(PROBLEM, **SETTLED, checkpoint=path), whole)
    equal(load(path), whole)
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]


FULL = """
import sys, warnings
from discs import load, simulate
from discs.chains.twist import untwisting_chain
problem = untwisting_chain(64)
settled = dict(dt=0.05, engine="plain", progress=False)
said = lambda error: print(str(error).replace(sys.argv[1], "DISC"))
try:
    simulate(problem, frames=2000, checkpoint=sys.argv[1] + "/big.nc", **settled)
except ValueError as error:
    said(error)
simulate(problem, frames=101, checkpoint=sys.argv[1] + "/run.nc", **settled)  # takes more than half of it
filler = open(sys.argv[1] + "/filler", "wb", buffering=0)
try:
    while True:
        filler.write(bytes(512))
except OSError as error:
    print(error.strerror)
run = simulate(problem, frames=101, **settled)
try:
    run.save(sys.argv[1] + "/run.nc")
except ValueError as error:
    said(error)
assert load(sys.argv[1] + "/run.nc").x.tobytes() == run.x.tobytes()
"""
MOUNT = 'mount -t tmpfs -o size=600k tmpfs "$1" && exec "$2" -c "$3" "$1"'


@pytest.mark.slow
def test_a_disc_with_room_for_the_file_once(tmp_path):
    """On a file system of 600 kB the end of a run needs no further space, and a file that does not fit is refused at the start."""
    unshare = shutil.which("unshare")
    if not unshare or subprocess.run([unshare, "-rm", "true"], capture_output=True, check=False).returncode:
        pytest.skip("needs a file system of its own, by unshare -rm")
    command = [unshare, "-rm", "sh", "-c", MOUNT, "sh", str(tmp_path), sys.executable, FULL]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    big, full, saved = done.stdout.splitlines()
    assert big == "DISC/big.nc cannot be written: it needs 4.16 MB, and 0.614 MB are free on its disc"
    assert full == "No space left on device"
    assert saved.startswith("DISC/run.nc cannot be written: it needs 0.")


def test_a_disc_that_fills_up_on_the_way(tmp_path, monkeypatch):
    """The frames have their space. Without restart files the run continues, warns, and ends normally."""
    path, whole = tmp_path / "run.nc", simulate(PROBLEM, **SETTLED)

    def full(*arguments, **named):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(recording, "SECONDS", -np.inf)
        patched.setattr(np, "savez", full)
        with pytest.warns(
            UserWarning,
            match=r"run\.nc\.restart cannot be written: No space left on device; make room, .* goes on from the beginning",
        ):
            found = simulate(PROBLEM, **SETTLED, checkpoint=path)
    equal(found, whole)
    path.unlink()
    with monkeypatch.context() as patched:
        patched.setattr(safe, "write_all", full)
        message = r"frame 0 of .*run\.nc cannot be written: No space left on device; the same call goes on from the beginning"
        with pytest.raises(OSError, match=message):
            simulate(PROBLEM, **SETTLED, checkpoint=path)
    equal(simulate(PROBLEM, **SETTLED, checkpoint=path), whole)


# What has reached the disc when


def test_everything_is_on_the_disc_before_it_counts(tmp_path, monkeypatch):
    """A new file's content before its name, its name before anything rests on it; frames before a restart file that skips them."""
    path, happened, real = tmp_path / "run.nc", [], {name: getattr(os, name) for name in ("fsync", "replace")}

    def fsync(fd):
        found = Path(os.readlink(f"/proc/self/fd/{fd}")).name
        happened.append(("disc", "new" if found.startswith(safe.PARTIAL) else found))
        real["fsync"](fd)

    def replace(old, new):
        happened.append(("name", Path(new).name))
        real["replace"](old, new)

    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(os, "replace", replace)
    folder = tmp_path.name

    def whole(name):
        return [("disc", "new"), ("name", name), ("disc", folder)]

    run = simulate(PROBLEM, **SETTLED)
    run.save(path)
    assert happened == whole("run.nc")
    path.unlink()
    happened.clear()
    monkeypatch.setattr(recording, "SECONDS", -np.inf)
    simulate(PROBLEM, **SETTLED, checkpoint=path)
    assert happened[:3] == whole("run.nc")
    pause = [("disc", "run.nc"), *whole("run.nc.restart")]
    steps, end = happened[3:-1], happened[-1]
    assert len(steps) >= 2 * len(pause)
    assert steps == pause * (len(steps) // len(pause))  # the last of them keeps what the end changes
    assert end == ("disc", "run.nc")
