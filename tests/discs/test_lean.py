"""Kernels compile in less time than numba takes by itself, to the same results."""

import threading

import numba
import numpy as np
from numba.core import codegen

from discs.kernels import compiled
from discs.kernels.compiled import kernel, part
from discs.kernels.lean import is_part, lean


@part
def turned(x, angle):
    c, s = np.cos(angle), np.sin(angle)
    for i in range(x.shape[1]):
        x[0, i], x[1, i] = c * x[0, i] - s * x[1, i], s * x[0, i] + c * x[1, i]


def twice(x, angle):
    y = x.copy()
    turned(y, angle)
    turned(y, angle / 3)
    return y


def test_a_kernel_is_the_same_bits_as_numbas_own():
    x = np.random.default_rng(2).standard_normal((2, 7))
    np.testing.assert_array_equal(kernel(twice)(x, 0.7), compiled.jit(twice)(x, 0.7))


def test_parts_make_no_machine_code_and_other_code_does(monkeypatch):
    made = {}
    finish = codegen.CPUCodeLibrary._finalize_final_module

    def count(library):
        made[library.name] = is_part(library)
        finish(library)

    monkeypatch.setattr(codegen.CPUCodeLibrary, "_finalize_final_module", count)
    with lean():
        compiled.jit(twice)(np.ones((2, 3)), 0.1)
    assert "twice" in made
    assert "turned" not in made
    assert not any(made.values())
    assert codegen.CPUCodeLibrary._finalize_final_module is count


def test_other_threads_compile_as_always():
    own = numba.njit(lambda x: 2 * x)
    called = []
    with lean():
        other = threading.Thread(target=lambda: called.append(own(3)))
        other.start()
        other.join()
    assert called == [6]
    assert own(3.5) == 7.0  # parts compiled within serve code compiled without


def test_another_version_of_numba_compiles_as_always(monkeypatch):
    monkeypatch.delattr(codegen.JITCPUCodegen, "set_env")
    before = codegen.CPUCodeLibrary._optimize_final_module
    with lean():
        assert codegen.CPUCodeLibrary._optimize_final_module is before
