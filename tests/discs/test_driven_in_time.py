"""Integration in time of systems with forces and drives: stiff ones, late and short pushes, kinks, back in time, every method."""

import numpy as np
import pytest

from tests.conftest import longer
from tests.discs.test_driven import BOOKS, balance, one

pytestmark = pytest.mark.slow  # each motion is integrated to a small tolerance

OTHERS = ("RK23", 1e-3), ("BDF", 1e-3), ("LSODA", 1e-4)


@pytest.mark.parametrize(("method", "bound"), [("auto", 1e-9), ("Radau", 1e-4), *(longer(*other) for other in OTHERS)])
def test_a_driven_and_damped_oscillator(method, bound):
    """m x.. + c x. + k x = F cos w t from rest at 0: the steady swing and a decaying free one."""
    m, c, k, f, w = 1.3, 0.4, 2.1, 0.8, 1.1
    system = one(lambda t, q, v: f * np.cos(w * t) - c * v[0], mass=m, stiffness=k)
    path = system.integrate([0], [0], np.linspace(0, 20, 11), 1e-11 if method == "auto" else 1e-5, method=method, progress=False)
    steady, sigma = f / (k - m * w**2 + 1j * c * w), np.roots([m, c, k])[0]
    a = -steady.real  # x = Re(steady e^{iwt} + (a + i b) e^{sigma t}) is 0 at 0, and so is its rate
    b = ((1j * w * steady).real + a * sigma.real) / sigma.imag
    exact = (steady * np.exp(1j * w * path.t) + (a + 1j * b) * np.exp(sigma * path.t)).real
    np.testing.assert_allclose(path.q[:, 0], exact, atol=bound)
    assert balance(path) < bound


def test_a_stiff_damper_is_found_stiff():
    """x. relaxes to sin(t) at the rate 1e5."""
    path = one(lambda t, q, v: -1e5 * (v - np.sin(t))).integrate([0], [0], [0, 2.0, 4.0], 1e-8, progress=False)
    assert path.stats["method"] == "Radau"
    np.testing.assert_allclose(path.v[1:, 0], np.sin(path.t[1:]) - 1e-5 * np.cos(path.t[1:]), atol=1e-7)
    assert balance(path) < 1e-6


@pytest.mark.long
def test_a_push_that_starts_late_from_rest():
    """int (t - 5)^2 (6 - t)^2 dt = 1/30; at rest before, no tolerance is relative to anything."""
    system = one(lambda t, q, v: ((t - 5) * (6 - t)) ** 2 if 5 < t < 6 else 0.0)
    path = system.integrate([0], [0], [0, 4.0, 10.0], progress=False)
    np.testing.assert_allclose(path.v[:, 0], [0, 0, 1 / 30], atol=1e-11)
    assert path.work[-1] == pytest.approx(0.5 / 30**2, rel=1e-8)


@pytest.mark.long
def test_a_short_push_is_found_with_a_shorter_step():
    def push(t, q, v):
        return np.exp(-(((t - 5.3) / 0.01) ** 2))

    path = one(push).integrate([0], [0], [0, 10.0], 1e-8, max_step=0.02, progress=False)
    assert path.v[-1, 0] == pytest.approx(0.01 * np.sqrt(np.pi), rel=1e-6)


@pytest.mark.long
def test_back_in_time():
    book = BOOKS["bead on a wire"]
    there = book.integrate([0.0, 2.0], progress=False)
    back = book.system.integrate(there.q[-1], there.v[-1], [2.0, 0.0], progress=False)
    np.testing.assert_allclose(back.q[-1], book.q, atol=1e-10)
    assert back.reaction_work[-1] == pytest.approx(-there.reaction_work[-1], abs=1e-10)


TABLE = np.array([0.0, 0.8, 0.9, 0.1])


@pytest.mark.parametrize(
    ("drive", "way"),
    [
        longer(lambda t, q: np.clip(t, 0, 1), 2.5),
        longer(lambda t, q: np.interp(t, np.arange(4), TABLE), TABLE[:-1].sum() + (TABLE[-1] - TABLE[0]) / 2),
    ],
)
def test_a_drive_with_kinks(drive, way):
    """A ramp from the start on, and a table with a kink at frames: the way is the integral."""
    path = one(drive=drive).integrate([0], [0], [0, 1.0, 2.0, 3.0], 1e-7, progress=False)
    assert path.q[-1, 0] == pytest.approx(way, abs=1e-7)
    assert balance(path) < 1e-6


@pytest.mark.parametrize("method", ["RK45", longer("Radau"), longer("BDF"), "LSODA"])
def test_every_method_takes_drives(method):
    book = BOOKS["ball on a turntable"]
    path = book.integrate([0, 1.0, 2.0], 1e-7, method=method, progress=False)
    np.testing.assert_allclose(path.q[-1], book.exact(2.0)[0], atol=1e-4)
    assert balance(path) < 1e-4
