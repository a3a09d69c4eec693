"""The archive of a sweep: whose it is, and what a kill leaves."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

from compare import sweep
from compare.fingerprint import fingerprint
from compare.sweeps import _identity, read
from discs import simulate
from discs.chains.twist import untwisting_chain
from discs.files.results import Archive
from tests.compare.test_sweeps import deadly, noting, picky


def test_functions_that_differ_share_no_archive(tmp_path):
    file, k = tmp_path / "sweep.jsonl", 3
    with ThreadPoolExecutor(1) as executor:
        sweep(lambda n: n + k, [1], executor, file, progress=False)
        before = file.read_bytes()
        assert read(file)[0].value == 4
        k = 5
        for other in (lambda n: n + k, lambda n: n - 3, lambda n: n + 3):
            with pytest.raises(ValueError, match=r"has results of .*lambda>, which has changed since, or Python has; take another"):
                sweep(other, [1], executor, file, progress=False)
        stream = open(file)  # noqa: SIM115
        with pytest.raises(ValueError, match="an archive must identify its function, and cannot identify"):
            sweep(lambda n: stream.read(n), [1], executor, file, progress=False)
        stream.close()
    assert file.read_bytes() == before


def made(text):
    """A function of a module of its own."""
    module: dict = {"__name__": "users"}
    exec(text, module)
    return module["f"]


BASE = "import numpy as np\nK = {'a': np.arange(3)}\ndef g(x): return x + 1\nclass C:\n  def m(self): return 1\n"
F = "def f(n, scale=2.0):\n  def inner(): return [g(n) for _ in range(2)]\n  return K, C().m(), inner(), scale\n"


@pytest.mark.slow
def test_fingerprints():
    """The same for the same text, in another process too; another one for whatever a function is made of."""
    same = fingerprint(made(BASE + F))
    assert same == fingerprint(made(BASE + F)) == fingerprint(made(BASE + "unused = 3\n" + F))
    changes = [("x + 1", "x + 2"), ("arange(3)", "arange(4)"), ("'a'", "'b'"), ("return 1", "return 2"), ("scale=2.0", "scale=2")]
    changes += [("range(2)", "range(3)"), ("C().m()", "C().m"), ("g(n)", "g(g)")]
    others = [fingerprint(made((BASE + F).replace(*change))) for change in changes]
    assert len({same, *others}) == len(changes) + 1
    problem = untwisting_chain(5)
    told = fingerprint(partial(simulate, problem))
    assert problem.energy() > 0  # which keeps what it has computed
    assert fingerprint(partial(simulate, problem)) == told == fingerprint(partial(simulate, untwisting_chain(5)))
    assert fingerprint(partial(simulate, untwisting_chain(6))) != told
    code = "from tests.compare.test_sweep_archive import *; print(fingerprint(made(BASE + F)), fingerprint(deadly))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [same, fingerprint(deadly)]


@pytest.mark.parametrize(
    "content",
    [
        b'{"n": 64}',
        b'{"n": 64}\n',
        b"{",
        b'{"func',
        b"mine",
        b"[1]\n[2]",
        b'{"function": 3}\n',
        b'{"function": "a"}\n[]\n',
        b"\xff\n",
        b'{"function": "a", "x": 1}\n',
        b"[" * 100_000 + b"\n",
        b'{"function": "a"}\n{"case": 1}\n',
        b"\n\n",
    ],
    ids=range(13),
)
def test_a_file_that_is_no_archive_is_left_alone(content, tmp_path):
    file = tmp_path / "cfg.json"
    file.write_bytes(content)
    with (
        ThreadPoolExecutor(1) as executor,
        pytest.raises(ValueError, match="archive must be a file that a sweep has written, or a new"),
    ):
        sweep(picky, [1], executor, file, progress=False)
    with pytest.raises(ValueError, match="archive must be a file that a sweep has written"):
        read(file)
    assert file.read_bytes() == content


def test_an_archive_of_an_earlier_version_opens(tmp_path):
    """It does not say what its function was, so that it is read, and not gone on with."""
    file = tmp_path / "sweep.jsonl"
    named = f"{picky.__module__}.picky"
    file.write_text(f'{{"function": "{named}"}}\n{{"case": 2, "value": 4.0, "error": "", "trace": "", "seconds": 0.1}}\n')
    assert [r.value for r in read(file)] == [4.0]
    with pytest.raises(ValueError, match="which may have changed: an earlier version did not keep what it was; take another file"):
        sweep(picky, [1], archive=file, progress=False)


def test_two_sweeps_do_not_share_an_archive(tmp_path):
    file = tmp_path / "sweep.jsonl"
    with Archive(file, *_identity(picky, file)), pytest.raises(ValueError, match="is being written by another sweep"):
        sweep(picky, [1], archive=file, progress=False)
    with ThreadPoolExecutor(1) as executor:
        assert sweep(picky, [1], executor, file, progress=False)[0].value == 1


def test_what_is_no_file_is_no_archive(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/null", tmp_path):
        with pytest.raises(ValueError, match=r"archive must be a file that can be written; .* is not"):
            sweep(picky, [1], archive=path, progress=False)


def test_results_reach_the_disc(tmp_path, monkeypatch, noted):
    """Each one, and the archive's name before them."""
    happened, fsync = [], os.fsync

    def noting_fsync(fd):
        happened.append(Path(os.readlink(f"/proc/self/fd/{fd}")).name)
        fsync(fd)

    monkeypatch.setattr(os, "fsync", noting_fsync)
    with ThreadPoolExecutor(1) as executor:
        sweep(noting, [1, 2, 5], executor, tmp_path / "sweep.jsonl", progress=False)
    assert happened[0].startswith(".discs-partial-")
    assert happened[1:] == [tmp_path.name, *["sweep.jsonl"] * 3]


def test_half_a_line_is_dropped(tmp_path, noted):
    """A process killed while writing leaves half a line: the case is run again, on a new line."""
    file = tmp_path / "sweep.jsonl"
    with ThreadPoolExecutor(1) as executor:
        sweep(noting, [1, 2], executor, file, progress=False)
        for cut in (1, 5, None):  # or the whole line, whose length varies with the time that it tells
            content = file.read_bytes()
            file.write_bytes(content[: -(cut or len(content.splitlines()[-1]))])
            noted()
            sweep(noting, [1, 2], executor, file, progress=False)
            assert len(noted()) == 1
            assert len(file.read_text().splitlines()) == 3
        file.write_bytes(b"")  # the user's own, in which nothing is lost
        sweep(noting, [1, 2], executor, file, progress=False)
        assert [r.case for r in read(file)] == [1, 2]
