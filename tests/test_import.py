"""Imports are fast and load no unused packages."""

import subprocess
import sys

import pytest

IDLE = [
    "PIL",
    "distributed",
    "h5netcdf",
    "h5py",
    "imageio_ffmpeg",
    "markdown_it",
    "matplotlib",
    "numba",
    "pymunk",
    "sympy",
    "xarray",
]
SLOW = ["scipy.linalg", "scipy.sparse", "scipy.integrate", "scipy.interpolate", "scipy.optimize"]


def ask(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize(
    ("package", "idle"),
    [
        ("discs", [*IDLE, *SLOW, "tqdm"]),
        ("continuum", [*IDLE, *SLOW]),
        ("compare", [*IDLE, *SLOW, "exudyn", "jax", "mujoco", "sksundae"]),
    ],
)
def test_import_brings_nothing_idle(package, idle):
    assert ask(f"import sys, {package}; print(*[m for m in {idle} if m in sys.modules])").split() == []


def test_import_of_discs_is_quick():
    """0.2 s alone, most of it NumPy, 0.4 s on a crowded machine; seconds of the processor, the best of three, 0.75 allowed."""
    code = "import time; start = time.process_time(); import discs; print(time.process_time() - start)"
    assert min(float(ask(code)) for _ in range(3)) < 0.75
