"""Steps of variable length: their error, frames, the end of a motion told from steps that are too long, both engines."""

import numpy as np
import pytest
from tqdm import tqdm

from continuum import Rod, Scene, breathing_ring, exact, solve, stepping, untwisting_rod
from continuum.galerkin import SpectralRod
from continuum.spectral import Runner, Search
from continuum.stepping import Steps, stages_for
from discs import SimulationError
from discs.kernels import limits
from discs.skew import Phase
from tests.conftest import longer

pytestmark = pytest.mark.slow


def largest(a, b):
    return max(np.abs(a[name] - b[name]).max() for name in ("x", "y", "theta"))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7, 1e-9])
def test_a_motion_errs_by_about_the_tolerance_of_its_steps(rolling, tolerance):
    """The paper's scene on 37 functions against steps of a far smaller tolerance; every number of stages."""
    runner = Runner(untwisting_rod(rolling), np.array([2.0, 4.5]), stages_for(3 * tolerance))
    error = largest(runner.run(37, tolerance).fields, runner.run(37, 1e-3 * tolerance).fields)
    assert 0.03 * tolerance < error < 20 * tolerance


def test_frames_do_not_change_the_motion(monkeypatch):
    """Nor cost steps: those within one are states of its polynomials. Energy is exact at ends of steps."""
    taken = []
    monkeypatch.setattr(Steps, "_sweep", lambda self, t, z, h, sweep=Steps._sweep: taken.append(h) or sweep(self, t, z, h))
    monkeypatch.setattr(stepping, "TOGETHER", 3)
    rod = SpectralRod(untwisting_rod(), 27)
    few, many = (Steps(rod, 4.5, 1e-4, 4, 0.3) for _ in range(2))
    (end,) = few.at(np.array([4.5]))
    alone = len(taken)
    times = np.linspace(0, 4.5, 101)
    states = Phase(*(np.concatenate(parts) for parts in zip(*many.at(times), strict=True)))
    assert few.lengths == many.lengths
    assert len(taken) == 2 * alone
    np.testing.assert_array_equal(states.hi[0], rod.start.hi)
    np.testing.assert_array_equal(states.hi[-1], end.hi[0])
    assert states.hi.shape == (101, 3, 27)
    drift = np.abs(rod.energies(states) / (np.pi**4 / 80) - 1)
    assert drift[[0, -1]].max() < 1e-8
    assert 1e-8 < drift.max() < 1e-4  # of the order of the steps' tolerance


@pytest.mark.parametrize("tolerance", [1e-3, longer(1e-5), 1e-7, longer(1e-9)])
def test_frames_within_steps_are_as_accurate_as_ends(rolling, tolerance):
    """Positions and omega at frames within steps and at the steps' ends, against far smaller steps."""
    scene, stages = untwisting_rod(rolling), stages_for(3 * tolerance)
    steps = Steps(SpectralRod(scene, 27), scene.duration, tolerance, stages, scene.duration / 16)
    list(steps.at(np.array([scene.duration])))
    ends = np.cumsum(steps.lengths)[:-1]
    middles = np.concatenate([(ends[1:] + ends[:-1]) / 2, 0.1 * ends[1:] + 0.9 * ends[:-1], 0.8 * ends[1:] + 0.2 * ends[:-1]])
    errors = []
    for times in (ends, np.sort(middles)):
        a, b = (Runner(scene, times, *rest[:1]).run(27, rest[1]).fields for rest in ((stages, tolerance), (12, 1e-4 * tolerance)))
        errors.append((largest(a, b), np.abs(a["omega"] - b["omega"]).max()))
    assert errors[1][0] < 2 * errors[0][0] < 40 * tolerance
    assert errors[1][1] < 2 * errors[0][1]


def test_the_estimate_covers_all_frames(rolling):
    """Largest errors of every field over 101 frames against 97 functions in small steps."""
    times = np.linspace(0, 4.5, 101)
    truth = Runner(untwisting_rod(rolling), times, 12).run(71, 1e-10).fields
    for tol in (1e-3, 1e-4, 1e-5, 1e-6):
        field = solve(untwisting_rod(rolling), tol, progress=False)
        for name, value in truth.items():
            error = np.abs(getattr(field, name) - value).max()
            assert error < field.error_estimate[name] < 5 * error, (tol, name)
        assert np.abs(field.energy - np.pi**4 / 80).max() == pytest.approx(field.error_estimate["energy"], rel=0.1)


def test_both_engines_agree(rolling):
    times = np.array([0.0, 1.3, 4.5])
    a, b = (Runner(untwisting_rod(rolling, length=3.0, radius=0.8), times, 4, compiled).run(15, 1e-4) for compiled in (True, False))
    assert a.steps == b.steps
    for name, value in a.fields.items():
        np.testing.assert_allclose(value, b.fields[name], atol=1e-6, err_msg=name)


@pytest.mark.parametrize("duration", [16, 20, 22, 31, 47, 52, 55, 59])
def test_long_motions_are_followed_to_their_end(rolling, duration):
    """Whole durations that were taken for the end of the motion, where steps had only been too long."""
    field = solve(untwisting_rod(rolling, duration=float(duration)), 1e-3, frames=2, progress=False)
    if (rolling, duration) == ("field", 20):  # on 71 functions, 2048 steps
        for name, value in (("x", 0.0380256), ("y", 0.4516638), ("theta", -1.1169991)):
            assert abs(getattr(field, name)[-1, 0] - value) < field.error_estimate[name] < 1e-3


@pytest.mark.parametrize("omega", [0.4, 1.0, 2.0])
def test_a_ring_s_collapse_is_told_from_steps_that_are_too_long(omega):
    """By |r'|, at the time that is known, however long the steps: they must not jump over it."""
    scene = breathing_ring("unit", omega=omega, duration=30.0)
    radius = 2 / np.pi  # a0; M a.. = -K R^2 a/a0^4, a(0) = a0, a.(0) = -R omega
    frequency = np.sqrt(0.7 / 2) / radius**2
    collapse = np.arctan(radius * frequency / omega) / frequency
    before = solve(breathing_ring("unit", omega=omega, duration=0.98 * collapse), 1e-5, frames=2, progress=False)
    truth = exact.ring(scene.rod, before.t, omega, "unit").radius
    assert np.abs(np.hypot(before.x, before.y) - truth[:, None]).max() < 1e-5
    for tol, early in ((1e-2, 2e-3), (1e-6, 2e-2)):  # rounding grows as r' vanishes, the more the more functions there are
        with pytest.raises(SimulationError, match="the rod lost its heading: r' = 0") as caught:
            solve(scene, tol, frames=2, progress=False)
        assert 0 < collapse - caught.value.time < early * collapse


def test_a_heading_lost_between_two_nodes():
    """A line bent by 190 degrees whose r' vanishes at one place: found there by every number of functions, and soon."""
    length = 5.6

    def bent(s):
        u, w = np.polynomial.legendre.leggauss(30)
        places = np.outer(s, (u + 1) / 2)
        z = np.exp(0.59j * (places - length / (2 * np.pi) * np.sin(2 * np.pi * places / length))) @ w * s / 2
        return z.real, z.imag, -0.11 * np.cos(np.pi * s / length), 0.07 * np.cos(np.pi * s / length)

    rod = Rod(length=length, density=1.66, spin_inertia=0.68, torsion_stiffness=0.66, bending_stiffness=1.35, radius=0.31)
    for tol in (1e-3, 1e-6):
        with pytest.raises(SimulationError, match="lost its heading") as caught:
            solve(Scene(rod=rod, initial=bent, duration=9.0, rolling="unit"), tol, frames=2, progress=False)
        assert 6.0 < caught.value.time < 6.5
        assert caught.value.step < 500


def test_headings_are_lost_at_the_discs_threshold():
    assert stepping.LOST_HEADING is limits.LOST_HEADING
    scene = breathing_ring("unit", duration=30.0)
    rod = SpectralRod(scene, 19)
    states = Steps(rod, 30.0, 1e-5, 6, 2.0).at(np.linspace(0.7, 0.9, 4001))
    seen: list[float] = []
    with pytest.raises(SimulationError, match="lost its heading"):
        seen.extend(least for some in states for least in np.abs(rod.slopes(some)).min(axis=-1))
    assert 0 < seen[-1] < 2 * limits.LOST_HEADING
    assert min(seen[:-10]) > limits.LOST_HEADING


@pytest.mark.parametrize("duration", [1e5, 1e9, 1e300])
def test_a_motion_that_is_too_long_is_named_soon(rolling, duration, monkeypatch):
    """From the length of the first steps, not after all that are allowed; the first one may have to be far shorter than it."""
    taken = []
    monkeypatch.setattr(Steps, "_sweep", lambda self, t, z, h, sweep=Steps._sweep: taken.append(h) or sweep(self, t, z, h))
    with pytest.raises(ValueError, match=r"would be needed; the motion is too long for this tol.*shorter duration, well below \d"):
        solve(untwisting_rod(rolling, duration=duration), 1e-3, frames=2, progress=False)
    assert len(taken) < 400


def test_a_motion_that_is_too_fast_is_named():
    """Another omega at every node: no step is short enough."""

    def fast(s):
        return s, 0 * s, 0 * s, 1e12 * np.cos(np.pi * s / 4)

    scene = Scene(rod=untwisting_rod().rod, initial=fast, duration=1.0)
    with pytest.raises((SimulationError, ValueError), match="too fast"):
        solve(scene, 1e-3, progress=False)


@pytest.mark.parametrize("stages", [4, 12])
def test_a_step_s_error_is_its_highest_coefficient(stages):
    """Rates g P_{s-1} in theta give the coefficient h g/(2 (2s - 1)) of degree s."""
    steps = Steps(SpectralRod(untwisting_rod(), 19), 4.5, 1e-4, stages, 0.3)
    v = np.zeros((stages, 3, 19))
    x, _ = np.polynomial.legendre.leggauss(stages)
    v[:, 2] = 0.7 * np.polynomial.legendre.Legendre.basis(stages - 1)(x)[:, None]
    assert steps._error(v, 0.3) == pytest.approx(0.3 * 0.7 / (2 * (2 * stages - 1)), rel=1e-9)


def test_what_functions_miss_of_the_start_is_estimated():
    """Though two motions do not differ, the finer one having more steps."""
    search = Search(untwisting_rod(), {"theta": 1e-3}, np.array([4.5]), tqdm(disable=True))
    found = search.runner.run(19, 1e-3)
    missed = found._replace(start=found.start | {"omega": 0.7})
    assert search._reached(missed, found._replace(tolerance=1e-4, steps=found.steps + 1))
    assert search.estimate["omega"] == pytest.approx(0.7, rel=1e-6)
