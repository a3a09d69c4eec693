"""Error estimates of the ground's force, of velocities, slopes and energies of a field; unequal parameters."""

from dataclasses import replace

import numpy as np
import pytest

from continuum import Rod, Scene, breathing_ring, solve, steered_rod, untwisting_rod
from discs.mechanics.ground import inner_places
from tests.continuum.test_ground import ROD, VARIES, field, uneven


def wavy(s):
    """Near to a circle, rolling unevenly."""
    turn, a = 2 * np.pi * s / 3.7, 3.7 / (2 * np.pi)
    return a * np.cos(turn) * (1 + 0.03 * np.cos(turn)), a * np.sin(turn), 0.2 * np.sin(turn), -0.2 + 0.1 * np.cos(turn)


SCENES = {
    "field": untwisting_rod("field", duration=3.0),
    "unit": untwisting_rod("unit", duration=3.0),
    "stretched field": Scene(rod=Rod(**ROD), initial=uneven, duration=1.5),
    "ring": replace(breathing_ring("field", duration=0.6, **ROD), initial=wavy),
    "own": steered_rod(duration=1.5, **ROD),
    "varying": replace(VARIES, duration=1.5),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_estimates_are_within_five_of_the_errors(name):
    scene = SCENES[name]
    truth = field(scene, 1e-8, frames=12)
    for tol in (1e-3, 1e-4, 1e-5):
        found = field(scene, tol, frames=12)
        for key, estimate in found.error_estimate.items():
            if key == "energy" or (name, key) == ("own", "end_couple"):  # no couple with own headings
                continue
            whole, inside, _ = key.partition("_inside")
            error = np.abs(getattr(found, whole) - getattr(truth, whole))
            if inside:
                error = error[..., inner_places(found.s, scene.rod.length)]
            error = error.max()
            assert error / 5 < estimate < 5 * error or error < 10 * truth.error_estimate[key], (key, tol, error, estimate)
    assert ("contact_force_inside" in truth.error_estimate) == (not scene.closed)


def gentle(s):
    """A circle of discs with little twist."""
    turn, a = 2 * np.pi * s / 3.7, 3.7 / (2 * np.pi)
    return a * np.cos(turn), a * np.sin(turn), 0.02 * np.sin(turn), -0.2 + 0 * s


def waves(s):
    """A straight line that is twisted and rolls unevenly, periodic up to its length."""
    q = 2 * np.pi * s / 3.7
    return s, 0 * s, 0.4 * np.sin(q), 0.2 + 0.1 * np.cos(q)


@pytest.mark.parametrize(
    ("rolling", "initial", "shift"), [("field", wavy, 0.0), ("unit", wavy, 0.0), ("unit", gentle, 0.0), ("field", waves, 3.7)]
)
def test_estimates_of_rings_are_within_five_of_small_errors(rolling, initial, shift):
    """Where functions and steps leave so little that sweeps count, too; steps of truth and field have 12 and 8 stages."""
    scene = replace(breathing_ring(rolling, duration=0.6, **ROD), initial=initial, shift=(shift, 0.0))
    truth, found = field(scene, 1e-9, frames=12), field(scene, 1e-6, frames=12)
    for key, estimate in found.error_estimate.items():
        if key != "energy":
            error = np.abs(getattr(found, key) - getattr(truth, key)).max()
            least = error if key == "contact_force" else error / 1.5
            assert least < estimate < 5 * error or error < 5 * truth.error_estimate[key], (key, error, estimate)
    assert found.error_estimate["contact_force"] < 1e-3


@pytest.mark.slow
def test_frames_within_steps_are_as_accurate_as_steps():
    """Rates at frames within steps at the limit of stability: the polynomial of a step is less accurate there."""
    scene, frames = SCENES["own"], 31
    truth = solve(scene, 1e-8, frames=frames, progress=False)
    for tol in (1e-5, 1e-6):
        found = solve(scene, tol, frames=frames, progress=False)
        for key in ("omega", "phi_rate", "theta"):
            error = np.abs(getattr(found, key) - getattr(truth, key)).max()
            assert error / 5 < found.error_estimate[key] < 5 * error, (key, tol, error, found.error_estimate[key])


@pytest.mark.parametrize("own", [False, True])
@pytest.mark.slow
def test_tolerances_bind_wanted_quantities(own):
    make = steered_rod if own else untwisting_rod
    scene, name = make(duration=1.0, **ROD), "end_force"
    truth = field(scene, 1e-8, "contact_force", frames=3)
    found = field(scene, {name: 2e-4}, "contact_force", frames=3)
    assert np.abs(getattr(found, name) - getattr(truth, name)).max() < found.error_estimate[name] <= 2e-4
    assert np.abs(getattr(truth, name)).max() > 0.05
