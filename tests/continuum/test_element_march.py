"""Spectral elements: their rule of integration, and their motions in time, compiled and plain."""

from dataclasses import replace

import numpy as np
import pytest

from continuum import steered_rod
from continuum.element_grid import lobatto
from continuum.elements import Elements
from tests.continuum.test_steered import UNEVEN

pytestmark = pytest.mark.slow


def test_lobatto_rule_is_exact_on_polynomials():
    x, w, d = lobatto(7)
    for degree in range(14):  # 2p - 1
        exact = 2 / (degree + 1) if degree % 2 == 0 else 0.0
        assert w @ x**degree == pytest.approx(exact, abs=1e-14)
    np.testing.assert_allclose(d @ x**7, 7 * x**6, atol=1e-12)


@pytest.mark.parametrize("turns", [0, 1])
def test_compiled_motions_are_the_plain_ones(turns, monkeypatch):
    """Rods that vary, with free ends and closed, where the line and its heading turn once; most frames lie between two steps."""
    scene = steered_rod(14.0, 5.0, 0.6, twist=0.8, **UNEVEN)
    rod = replace(scene.rod, radius=lambda s: 1 + 0.3 * np.cos(2 * np.pi * s / 3.1), shear_stiffness=lambda s: 5 + s * (3.1 - s))
    elements = Elements(replace(scene, rod=rod, closed=bool(turns), turns=turns, shift=(0.4, -0.2) if turns else (0.0, 0.0)), 3)
    vars(elements)["start"] = elements.start + 0.1 * np.random.default_rng(1).standard_normal((6, elements.n))
    times, runs = np.array([0.0, 0.003, 0.01, 0.02, 0.05]), []
    for there in (True, False):
        monkeypatch.setattr("continuum.elements.ready", lambda there=there: there)
        runs.append(elements.run(times, 1e-9))
    compiled, plain = runs
    np.testing.assert_array_equal(compiled.q[0], elements.start)
    np.testing.assert_allclose(compiled.q, plain.q, atol=1e-10)
    assert np.abs(plain.q[-1] - plain.q[0]).max() > 0.1


def test_a_motion_of_too_many_steps_is_refused_by_both_engines(monkeypatch):
    elements = Elements(steered_rod(1e6, 1e6), 16)
    for there in (True, False):
        monkeypatch.setattr("continuum.elements.ready", lambda there=there: there)
        with pytest.raises(ValueError, match=r"not reached in 131072 time steps of 16 elements: ask for a larger tol"):
            elements.run(np.array([0.0, 4000.0]), 1e-9)
