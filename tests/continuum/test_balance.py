"""Local balances of the free and of the rolling rod; unequal, non-unit parameters."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from compare import lump
from continuum import Rod, Scene, breathing_ring, exact, free_rod, rolling_rod, solve, steered_rod, untwisting_rod
from continuum.balance import LAWS, balances, noether
from discs import Suzuki4, simulate

ROD = {"length": 3.7, "density": 1.3, "spin_inertia": 0.6, "torsion_stiffness": 0.9, "bending_stiffness": 0.5, "radius": 0.7}
A = 3.7 / (2 * np.pi)
NEAR = np.arange(-3, 4)  # frames, in steps


@cache
def free(n, closed):
    """The free rod about t = 0.3, seven frames one step apart."""
    dt = 0.64 / n if closed else 0.32 / n

    def circle(s):
        return A * np.array([np.cos(s / A), np.sin(s / A)])

    def ringing(s):
        out, along = 0.2 * np.cos(2 * s / A), -0.1 * np.sin(2 * s / A)
        cos, sin = np.cos(s / A), np.sin(s / A)
        return np.array([out * cos - along * sin, out * sin + along * cos])

    def straight(s):
        return np.array([s, 0 * s])

    def whip(s):
        return np.array([0 * s, 1.2 * np.exp(-(((s - 1.7) / 0.4) ** 2))])

    def theta(s):
        return 0.5 * np.cos(2 * np.pi * s / 3.7)

    start = (circle, ringing) if closed else (straight, whip)
    frames = 0.32 + dt * NEAR
    options = {"progress": False, "estimate": False}  # its errors are what is measured here
    return free_rod(Rod(**ROD), *start, theta, 0.3, 1.0, n + (not closed), dt, closed, frames, **options)


def scene_of_ring(law):
    """A ring near to a circle that rolls unevenly."""

    def initial(s):
        turn = s / A
        return A * np.cos(turn) * (1 + 0.03 * np.cos(turn)), A * np.sin(turn), 0.2 * np.sin(turn), -0.2 + 0.1 * np.cos(turn)

    return replace(breathing_ring(law, duration=1.0, **ROD), initial=initial)


@cache
def ring(n, law):
    """The ring about t = 0.3."""
    dt = 0.16 / n
    return simulate(lump(scene_of_ring(law), n), Suzuki4(), dt, 0.32 + 2 * dt * NEAR, ("contact_force",), progress=False)


def rms(values):
    """Without the outermost nodes, beyond which a free rod's splines see nothing."""
    return np.sqrt(np.mean(values[:, 2:-2] ** 2))


def orders(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.parametrize("closed", [False, True])
def test_every_law_of_the_free_rod_holds_locally_at_order_two(closed):
    found = [balances(Rod(**ROD), free(n, closed), None, closed) for n in (64, 128, 256)]
    for name in LAWS:
        errors = [rms(b[name].residual) for b in found]
        assert orders(errors) == pytest.approx(2.0, abs=0.3), (name, errors)
        np.testing.assert_array_equal(found[-1][name].residual, found[-1][name].unforced)
    assert set(found[0]) == set(LAWS)
    assert not any(noether(found[0]).values())


def test_angular_momentum_as_printed_is_not_a_law():
    """The paper's flux has x''y' + y''x' for x''y' - y''x'; the difference, 2 K x'y'', is not constant in s."""
    found, rests = [], []
    for n in (64, 128):
        run = free(n, True)
        found.append(balances(Rod(**ROD), run, None, True)["angular_momentum"])
        k = run.s[1]
        x1 = (np.roll(run.x, -1, axis=1) - np.roll(run.x, 1, axis=1)) / (2 * k)
        y2 = (np.roll(run.y, -1, axis=1) - 2 * run.y + np.roll(run.y, 1, axis=1)) / k**2
        extra = 2 * 0.5 * x1 * y2
        extra_s = (np.roll(extra, -1, axis=1) - np.roll(extra, 1, axis=1)) / (2 * k)
        rests.append(rms(found[-1].residual + extra_s[1:-1]))
    assert rests == pytest.approx([rests[0]] * 2, rel=0.05)
    assert rests[-1] > 50 * rms(found[-1].residual)


@pytest.mark.parametrize("law", ["field", "unit"])
def test_rolling_rod_keeps_energy_and_balances_the_rest(law):
    """Residuals fall at order 2: energy's without a source, those of the momenta with the ground's force and not without."""
    found = [balances(Rod(**ROD), ring(n, law), law, closed=True) for n in (32, 64, 128)]
    for name in LAWS:
        errors = [rms(b[name].residual) for b in found]
        # angular momentum's residual is small, and its leading terms cancel on the coarsest mesh
        tail = orders(errors)[1:] if name == "angular_momentum" else orders(errors)
        assert tail == pytest.approx(np.full_like(tail, 2.0), abs=0.25), (name, errors)
        unforced = [rms(b[name].unforced) for b in found]
        if name == "energy":
            assert orders(unforced) == pytest.approx(2.0, abs=0.3), unforced
        else:
            assert unforced[-1] > 0.25
            assert unforced == pytest.approx([unforced[-1]] * 3, rel=0.15), name


Q = 2 * np.pi / 3.7
WAVY = {
    "density": lambda s: 1.3 * (1 + 0.4 * np.sin(Q * s)),
    "spin_inertia": lambda s: 0.6 * (1 - 0.4 * np.cos(Q * s)),
    "torsion_stiffness": lambda s: 0.9 * (1 + 0.4 * np.cos(Q * s)),
    "bending_stiffness": lambda s: 0.5 * (1 + 0.4 * np.sin(Q * s)),
    "radius": lambda s: 0.7 * (1 + 0.3 * np.cos(Q * s)),
}


@pytest.mark.parametrize("law", ["field", "unit"])
def test_laws_of_a_rod_that_varies_along_its_length(law):
    """Residuals fall at order 2; that of material momentum needs the parameters' slopes in its source."""
    rod, found = Rod(length=3.7, **WAVY), []
    for n in (64, 128, 256):
        scene = replace(scene_of_ring(law), rod=rod)
        dt = 0.08 / n
        run = simulate(lump(scene, n), Suzuki4(), dt, 0.16 + 2 * dt * NEAR, ("contact_force",), progress=False)
        found.append(balances(rod, run, law, closed=True))
    for name in LAWS:
        errors = [rms(b[name].residual) for b in found]
        assert orders(errors)[-1] == pytest.approx(2.0, abs=0.25), (name, errors)
    assert orders([rms(b["energy"].unforced) for b in found])[-1] == pytest.approx(2.0, abs=0.3)
    force = np.stack([found[-1]["momentum_x"].source, found[-1]["momentum_y"].source], axis=1)
    assert np.abs(force - run.contact_force * 256 / 3.7).max() < 0.02 * np.abs(force).max()


@pytest.mark.parametrize("law", ["field", "unit"])
def test_noether_s_condition_holds_for_the_passing_of_time_alone(law):
    found = [noether(balances(Rod(**ROD), ring(n, law), law, closed=True)) for n in (32, 64, 128)]
    assert orders([b["energy"] for b in found]) == pytest.approx(2.0, abs=0.3)
    last = found[-1]
    assert (last["momentum_x"], last["momentum_y"]) == (1.0, 1.0)
    assert last["theta_momentum"] == pytest.approx(0.7, rel=0.1 if law == "field" else 1e-12)  # |e| = R |r'|, or R
    assert last["angular_momentum"] == pytest.approx(A, rel=0.1)  # |r|
    assert last["material_momentum"] > 0.5


@pytest.mark.parametrize("law", ["field", "unit"])
def test_force_of_the_ground_is_that_of_the_discs(law):
    """lambda of the fields against the multiplier of the chain, per length."""
    errors = []
    for n in (32, 64, 128):
        run = ring(n, law)
        b = balances(Rod(**ROD), run, law, closed=True)
        force = np.stack([b["momentum_x"].source, b["momentum_y"].source], axis=1)
        errors.append(np.abs(force - run.contact_force * n / 3.7).max())
    assert orders(errors) == pytest.approx(2.0, abs=0.25), errors


def test_density_adds_up_to_the_energy():
    for closed in (False, True):
        run = free(128, closed)
        density = balances(Rod(**ROD), run, None, closed)["energy"].density
        total = density.sum(axis=1) * run.s[1] if closed else np.trapezoid(density, run.s, axis=1)
        np.testing.assert_allclose(total, run.energy, rtol=2e-3)


def test_standing_wave_s_energy_flux():
    """Small waves at rest, y = R theta = R a(t) cos(q s): the flux of bending cancels, beta q a a. sin(q s) cos(q s) is left."""
    rod, q = Rod(**ROD), 2 * np.pi / 3.7

    def initial(s):
        return tuple(field[0] for field in exact.standing_wave(rod, s, 0.0, 1, 1e-5, closed=True))

    scene = Scene(rod=rod, initial=initial, duration=1.0, closed=True, shift=(3.7, 0.0))
    run = simulate(lump(scene, 64), Suzuki4(), 0.01, frames=[0.3, 0.31, 0.32], progress=False)
    b = balances(rod, run, "field", closed=True, shift=scene.shift)
    expected = 0.9 * q * run.theta[:, :1] * run.omega[:, :1] * np.sin(q * run.s) * np.cos(q * run.s)
    np.testing.assert_allclose(b["energy"].flux, expected, atol=1e-4 * np.abs(expected).max())


def test_no_energy_passes_a_free_end(rolling):
    """Natural conditions: -theta. (e.n + beta theta') - K r''.r.' = 0. Splines know nothing of them, nor of the layer: order 1."""
    flux = []
    for n in (129, 257, 513):
        scene = untwisting_rod(rolling, duration=2.0)
        run = simulate(lump(scene, n, "consistent"), Suzuki4(), 0.02, [1.98, 1.99, 2.0], progress=False)
        law = balances(scene.rod, run, rolling)["energy"]
        flux.append(np.abs(law.flux[1, [0, -1]]).max())
    assert np.abs(law.flux[1]).max() > 0.1
    assert orders(flux) == pytest.approx(1.0, abs=0.25), flux


def test_fields_of_solve_balance():
    scene = rolling_rod("unit", duration=0.5, omega=0.7, amplitude=0.05, **ROD)
    field = solve(scene, 1e-6, frames=[0.48, 0.485, 0.49, 0.495, 0.5], progress=False)
    b = balances(scene.rod, field, "unit", closed=True, shift=scene.shift)
    for name in LAWS:
        assert np.abs(b[name].residual).max() < 1e-3 * max(np.abs(b[name].unforced).max(), 0.1), name


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rod": steered_rod().rod}, "balances need a Rod with curvature='linear'; got SteeredRod"),
        ({"rolling": "sliding"}, "rolling must be one of 'field', 'unit'; got 'sliding'"),
        ({"rolling": None}, "rolling=None needs a motion of the free rod, with x_rate, y_rate and tension"),
        ({"frames": 2}, "balances need at least 3 frames and 8 nodes; got 2 and 9"),
        ({"n": 7}, "balances need at least 3 frames and 8 nodes; got 5 and 7"),
    ],
)
def test_bad_input_is_refused(change, message):
    given = {"rod": Rod(**ROD), "rolling": "field", "frames": 5, "n": 9} | change
    run = simulate(lump(untwisting_rod(duration=0.1, **ROD), given.pop("n")), frames=given.pop("frames"), progress=False)
    with pytest.raises(ValueError, match=message):
        balances(run=run, **given)


@pytest.mark.parametrize("law", ["field", "unit"])
def test_the_field_s_own_force_is_the_source(law):
    """That of the ground in `solve` and that of splines are two evaluations; both close the balances away from the ends."""
    scene = untwisting_rod(law, duration=1.2, **ROD)
    field = solve(scene, 1e-7, frames=1.0 + 1e-3 * NEAR, want="contact_force", progress=False)
    own, splines = (balances(scene.rod, run, law) for run in (field, replace(field, contact_force=None)))
    inside, off = slice(100, -100), {}
    for name in LAWS[1:]:
        np.testing.assert_allclose(own[name].source[:, inside], splines[name].source[:, inside], atol=5e-4)
        off[name] = [np.abs(found[name].residual[:, inside]).max() for found in (own, splines)]
        assert max(off[name]) < 5e-4 < np.abs(own[name].unforced).max() / 100, (name, off)
    np.testing.assert_array_equal(own["momentum_x"].source, field.contact_force[:, 0])
