"""Where compiled kernels are kept, under which name, and when they go."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from discs.integrators.rk4 import Explicit
from discs.kernels import __main__ as ahead
from discs.kernels import cache, compiled, driver
from discs.kernels.slaved import Slaved
from discs.skew import Phase
from tests.conftest import longer

TINY = """
from discs.kernels.compiled import kernel

@kernel
def twice(x):
    return 2 * x

@kernel
def thrice(x):
    return 3 * x
"""
NO_CACHE = """
import warnings
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    warnings.filterwarnings("ignore", "`import")  # the other packages are not copied
    from discs.kernels import tiny
    tiny.twice(1)  # line 7
print([(w.filename, w.lineno, str(w.message)[:31]) for w in told], tiny.twice(21), tiny.thrice(14))
"""


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["", *map(longer, ("cache", "nowhere/cache"))])
def test_without_a_folder_for_the_cache(folder, tmp_path):
    """A read-only package and no home: __pycache__ is a file, which stops root too."""
    shutil.copytree(Path(compiled.__file__).parents[1], tmp_path / "discs", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "discs" / "kernels" / "__pycache__").touch()
    (tmp_path / "discs" / "kernels" / "tiny.py").write_text(TINY)
    (tmp_path / "nowhere").touch()
    outside = {"PYTHONPATH": str(tmp_path), "HOME": "/dev/null", "XDG_CACHE_HOME": "", "PYTHONDONTWRITEBYTECODE": "1"}
    outside |= {"NUMBA_CACHE_DIR": str(tmp_path / folder)} if folder else {}
    before = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    (tmp_path / "empty").mkdir()
    done = subprocess.run(
        [sys.executable, "-c", NO_CACHE], env=before | outside, cwd=tmp_path / "empty", capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    kept = folder == "cache"
    told = [] if kept else [("<string>", 7, "compiled kernels cannot be kept")]
    assert done.stdout.strip() == f"{told} 42 42"
    assert bool(list(tmp_path.glob("cache/kernels-*/**/*.nbc"))) == kept
    assert not list((tmp_path / "empty").iterdir())


def test_compiled_kernels_are_kept_by_all_that_they_may_call(tmp_path):
    kept, rod = cache.folder.__wrapped__, tmp_path / "rod.py"
    rod.write_text("one = 1")
    before = kept((rod,))
    assert before == kept((rod,)) != kept((Path(compiled.__file__),))
    rod.write_text("one = 2")
    assert kept((rod,)) != before
    (tmp_path / "__init__.py").touch()  # in a package, what stands beside it may be called too
    before = kept((rod,))
    (tmp_path / "beside.py").write_text("two = 2")
    assert kept((rod,)) != before


def test_a_kernel_is_kept_by_the_files_that_it_may_call():
    """A change of one method leaves the kernels of the others, and one of own headings those of slaved ones."""
    names = {path.name for path in compiled._files(driver.march.__wrapped__, Explicit, Slaved, Phase)}
    assert names >= {"driver.py", "protocol.py", "shared.py", "rk4.py", "slaved.py", "slaved_matrix.py", "banded.py", "load.py"}
    assert not names & {"midpoint.py", "collocation.py", "steered.py", "steered_links.py", "checks.py", "base.py"}


def test_earlier_kernels_go_when_nothing_uses_them(tmp_path, monkeypatch):
    """Not those that another process may use, of another name, or that are no kernels."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path))
    rod = tmp_path / "rod.py"
    rod.write_text("one = 1")
    first, other = Path(cache.folder.__wrapped__((rod,), "march-A")), Path(cache.folder.__wrapped__((rod,), "march-A-B"))
    (first / "kernel.nbc").touch()
    rod.write_text("one = 2")
    second = Path(cache.folder.__wrapped__((rod,), "march-A"))
    assert first.exists()
    long_ago = time.time() - 1.5 * cache.UNUSED
    for folder in (first, second, other):
        os.utime(folder, (long_ago, long_ago))
    rod.write_text("one = 3")
    third = Path(cache.folder.__wrapped__((rod,), "march-A"))
    assert sorted(tmp_path.glob("kernels-*")) == sorted([other, third])


@pytest.mark.parametrize(("law", "names"), [("field", ["midpoint", "gauss4"]), ("own", ["gauss4"])])  # own headings: a secant
def test_kernels_of_gradients_are_compiled_ahead(monkeypatch, law, names):
    prepared = []
    monkeypatch.setattr(ahead, "simulate", lambda *given, **options: None)
    monkeypatch.setattr(ahead, "simulate_many", lambda *given, **options: None)
    monkeypatch.setattr(ahead, "prepare", lambda problem, method: prepared.append(method.name))
    ahead.compile_for(law, "few", tested=True)
    assert not prepared
    ahead.compile_for(law, "few", tested=False)
    assert sorted(prepared, reverse=True) == names


STARTS_AT_ONCE = """
import threading
import time

from discs.kernels.lean import lean

failed = []


def start(number):
    time.sleep(0.05 * number)
    try:
        with lean():
            pass
    except BaseException as error:
        failed.append(repr(error))


threads = [threading.Thread(target=start, args=(number,)) for number in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert not failed, failed
"""


@pytest.mark.slow
def test_threads_may_be_the_first_to_import_numba():
    done = subprocess.run([sys.executable, "-c", STARTS_AT_ONCE], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
