"""How far runs of the free rod are off, and what they say of it."""

import re
import warnings
from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, make_interp_spline

from continuum import Rod
from continuum.free import free_rod
from continuum.free_run import Watch, nodes
from continuum.free_system import FreeRod, State
from discs import SimulationError
from tests.conftest import longer

ROD = Rod(length=2, density=1.3, spin_inertia=0.6, torsion_stiffness=0.9, bending_stiffness=0.5, radius=0.0)
A = 1 / np.pi  # of the ring
NAMES = ("x", "y", "theta", "omega", "x_rate", "y_rate", "tension")


def straight(s):
    return np.array([s, 0 * s])


def rest(s):
    return np.array([0 * s, 0 * s])


def circle(s):
    return A * np.array([np.cos(s / A), np.sin(s / A)])


def ringing(s):
    out, along = 0.4 * np.cos(2 * s / A), -0.2 * np.sin(2 * s / A)
    cos, sin = np.cos(s / A), np.sin(s / A)
    return np.array([out * cos - along * sin, out * sin + along * cos])


def directed(phi):
    """The line of direction phi(s)."""
    s = np.linspace(0, 2, 4001)
    line = CubicSpline(s, np.array([np.cos(phi(s)), np.sin(phi(s))]).T).antiderivative()
    return lambda s: line(s).T


bent = directed(lambda s: 0.8 * (np.pi * s / 2 - np.sin(np.pi * s) / 2))  # straight at its ends


def whip(width, size=1.2):
    return lambda s: np.array([0 * s, size * np.exp(-(((s - 1) / width) ** 2))])


def twist(s):
    return 0.7 * np.cos(np.pi * s / 2)


def go(r0, v0, n, dt, duration, closed=False, theta=0.0, rod=ROD, **options):
    return free_rod(rod, r0, v0, theta, 0.0, duration, n, dt, closed, progress=False, **{"frames": 11, "estimate": False} | options)


def said(run, *args, **options):
    """What a run returns, and its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = run(*args, **options)
    return found, [str(warning.message) for warning in caught]


def test_a_step_that_folds_a_link_stops_the_run():
    """It ended with 1e5 times the energy and no word."""
    with pytest.raises(
        SimulationError, match=r"turns the link after node \d+ by .* take a smaller dt than 5 .step [12], time"
    ) as caught:
        go(straight, whip(0.3), 21, 5.0, 10.0, frames=2)
    assert caught.value.step * 5.0 == caught.value.time


def test_energy_that_rises_tenfold_stops_the_run():
    chain = nodes(ROD, 9, False)
    r, v = straight(chain.s), whip(0.3)(chain.s)
    z = State(r, v, 0 * chain.s, 0 * chain.s)
    watch = Watch(FreeRod(chain, r), chain, z, 0.1)
    watch(z, z._replace(v=3.1 * v), 1, 0.1)
    with pytest.raises(SimulationError, match=r"blew up: the energy .* rose from .* take a smaller dt than 0.1 .step 7, time 0.7"):
        watch(z, z._replace(v=3.2 * v), 7, 0.7)
    with pytest.raises(SimulationError, match="blew up"):
        watch(z, z._replace(v=np.nan * v), 7, 0.7)


@pytest.mark.parametrize("hidden", ["", "drift", "twist"])
def test_energy_that_is_off_is_warned_of_with_a_step_that_does(hidden):
    """By the energy of the centre line about its centre of mass, which neither a fast drift nor a strong twist hides."""
    theta = (lambda s: 1e3 * twist(s)) if hidden == "twist" else 0.0

    def thrown(s):
        return whip(0.3)(s) + 30.0 * (hidden == "drift")

    run, words = said(go, straight, thrown, 21, 0.1, 10.0, theta=theta)
    assert len(words) == 1
    found = re.fullmatch(
        r"free_rod: the energy of the centre line is conserved, but at t = .* it is 0.\d+ and not 0.\d+: dt = 0.1 is too long and "
        r"the run may not be trusted; dt = (.*) should do",
        words[0],
    )
    assert found
    if not hidden:
        assert 0.01 < np.abs(run.energy / run.energy[0] - 1).max() < 0.05
        assert not said(go, straight, thrown, 21, float(found[1]), 10.0)[1]


SCENES = {
    "turn": (straight, lambda s: np.array([0 * s, 1.1 * s - 0.4]), False, twist, 2.0, 41),
    "whip": (straight, whip(0.5, 0.8), False, twist, 1.0, 61),
    "bent": (bent, rest, False, twist, 0.5, 40),
    "ring": (circle, ringing, True, lambda s: np.sin(np.pi * s), 1.0, 60),
    "odd ring": (circle, ringing, True, 0.3, 0.5, 61),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_estimates_are_of_the_size_of_the_errors(name):
    """All quantities, against four times the nodes and steps."""
    r0, v0, closed, theta, duration, n = SCENES[name]
    dt = duration / n
    run, _ = said(go, r0, v0, n, dt, duration, closed, theta, estimate=True)
    m = 4 * n if closed else 4 * n - 3
    truth = go(r0, v0, m, dt / 4, duration, closed, theta)
    assert set(run.error_estimate) == set(NAMES)
    for quantity in NAMES:
        a, b = getattr(run, quantity), getattr(truth, quantity)
        if quantity == "tension":
            k = truth.s[1]
            middle, at = k * (np.arange(b.shape[1]) + 0.5), 4 * k * (np.arange(a.shape[1]) + 0.5)
            b = make_interp_spline(middle, b, 5, axis=1)(at)
        else:
            b = b[:, ::4]
        error = np.abs(a - b).max()
        if error > 1e-9:
            assert 0.4 < run.error_estimate[quantity] / error < 5, (quantity, error)


@pytest.mark.slow
def test_tension_that_is_far_off_is_warned_of():
    """Places look right on 41 nodes; the tension is off by 40 %."""
    run, words = said(go, straight, whip(0.3), 41, 0.01, 1.0, estimate=True)
    truth = go(straight, whip(0.3), 321, 0.00125, 1.0)
    assert np.abs(run.y - truth.y[:, ::8]).max() < 0.02
    ends = np.abs(run.tension[:, 20] - truth.tension[:, 160:168].mean(axis=1)).max()
    assert ends > 0.2 * np.abs(truth.tension).max()
    assert re.fullmatch(r"free_rod: estimated errors: .*tension .* %\); take more nodes .* with n = 82 and dt = 0.005", words[0])
    assert not said(go, straight, whip(0.3), 41, 0.01, 1.0)[1]


@pytest.mark.parametrize(("duration", "dt"), [(4.0, 4.0), (4.0, 2.0), (4.0, 0.5), (9.0, 9.0)])
def test_energy_that_is_exact_does_not_hide_a_long_step(duration, dt):
    """Torsion and small bending are linear: the midpoint rule keeps their energy in steps of any length."""
    run, words = said(go, straight, rest, 33, dt, duration, theta=twist, estimate=True, frames=[2.0, 4.0])
    truth = np.cos(np.pi / 2 * np.sqrt(1.5) * run.t)[:, None] * twist(run.s)
    error = np.abs(run.theta - truth).max()
    assert np.ptp(run.energy) < 1e-13
    assert error > 0.1
    assert 0.3 < run.error_estimate["theta"] / error < 5
    assert "estimated errors: theta" in words[0]


def test_the_estimate_costs_at_most_half_of_the_run_and_leaves_it_as_it_is(monkeypatch):
    cost = []
    plain = FreeRod.step

    def counted(self, r, v, h):
        cost.append(r.shape[1])
        return plain(self, r, v, h)

    monkeypatch.setattr(FreeRod, "step", counted)
    for frames in (2, 101, 37):
        cost.clear()
        run = go(straight, whip(0.5, 0.3), 41, 0.01, 1.0, frames=frames)
        alone = len(cost)
        again, _ = said(go, straight, whip(0.5, 0.3), 41, 0.01, 1.0, frames=frames, estimate=True)
        assert len(cost) - 2 * alone <= 0.57 * alone
        assert set(cost[2 * alone :]) == {21}
        np.testing.assert_array_equal(run.y, again.y)
        assert run.error_estimate is None


def test_an_estimate_that_cannot_be_had_is_said():
    few, words = said(go, straight, whip(0.6), 4, 0.01, 0.1, estimate=True)
    assert words == ["free_rod: no estimate of the error: half of n = 4 nodes are too few for a run; take more"]
    long, words = said(go, **any_rod(7), estimate=True)
    assert re.match(r"free_rod: no estimate of the error: the run on 8 nodes .* stopped .*; take a smaller dt", words[-1])
    assert few.error_estimate is long.error_estimate is None


@pytest.mark.parametrize(
    ("phi", "word"),
    [
        (lambda s: s, "r0 has the curvature 1 at s = 0.*velocities and tension have no limit"),
        (lambda s: 0.8 * np.cos(np.pi * s / 2), "r0 has the rate of curvature kappa' = -1.97 at s = 0.*tension has no limit"),
    ],
)
def test_a_line_that_is_bent_at_a_free_end_is_warned_of(phi, word):
    line = directed(phi)
    places = line(np.linspace(0, 2, 41))
    for r0 in (line, places):
        _, words = said(go, r0, np.zeros((2, 41)), 41, 0.01, 0.02)
        assert len(words) == 1
        assert re.match(word, words[0])
    assert not said(go, bent, rest, 41, 0.01, 0.02)[1]


def test_velocities_of_an_arc_at_rest_have_no_limit():
    """Those of a line that is straight at its ends have: changes between meshes fall by four."""
    changes = {}
    for name, line in (("arc", directed(lambda s: s)), ("bent", bent)):
        runs = [said(go, line, rest, n, 0.3 / (n - 1), 0.3, frames=4)[0] for n in (41, 81, 161)]
        for quantity in ("y", "y_rate"):
            fine = [getattr(run, quantity)[:, :: 2**i] for i, run in enumerate(runs)]
            changes[name, quantity] = [np.abs(b - a).max() for a, b in pairwise(fine)]
    assert changes["bent", "y_rate"][1] < 0.4 * changes["bent", "y_rate"][0]
    assert changes["arc", "y_rate"][1] > 0.4 * changes["arc", "y_rate"][0] > 0.1
    assert changes["arc", "y"][1] < 3e-3


def any_rod(seed):
    """A rod, its start and a step, long or short: rods with a whip of a random smooth shape, rings of random waves."""
    rng = np.random.default_rng(seed)
    length, stiff, density = rng.uniform(0.5, 5), 10 ** rng.uniform(-1.5, 1), 10 ** rng.uniform(-1, 1)
    rod = Rod(length=length, density=density, spin_inertia=0.6, torsion_stiffness=0.9, bending_stiffness=stiff, radius=0.0)
    closed, n, speed = bool(rng.random() < 0.3), int(9 * 8 ** rng.random()), np.sqrt(stiff / density) / length
    duration = length / speed * 10 ** rng.uniform(-2.0, 0.3)
    dt, size, mode = duration * 10 ** rng.uniform(-2.5, 0), speed * 10 ** rng.uniform(-1, 1.3), int(rng.integers(2, 5))
    a, shape = length / 2 / np.pi, rng.normal(size=5) / np.arange(1, 6) ** 2

    def velocity(s):
        if closed:
            out, along = size * np.cos(mode * s / a), -size * np.sin(mode * s / a) / mode
            return np.array([out * np.cos(s / a) - along * np.sin(s / a), out * np.sin(s / a) + along * np.cos(s / a)])
        waves = sum(c * np.cos(j * np.pi * s / length) for j, c in enumerate(shape))
        return np.array([0 * s, size * waves * np.sin(np.pi * s / length) ** 4])

    r0 = (lambda s: a * np.array([np.cos(s / a), np.sin(s / a)])) if closed else straight
    return {"r0": r0, "v0": velocity, "n": n, "dt": dt, "duration": duration, "closed": closed, "rod": rod}


def judged(seed):
    """ "refused", or the words of a run and how far its energy and its places, beside the length, are off."""
    case = any_rod(seed)
    try:
        run, words = said(go, **case, estimate=True)
    except SimulationError:
        return "refused", 0.0, 0.0
    energy = float(np.abs(run.energy / run.energy[0] - 1).max())
    try:
        finer, _ = said(go, **case | {"dt": case["dt"] / 4})
    except SimulationError:
        return words, energy, np.inf
    return words, energy, max(float(np.abs(getattr(run, q) - getattr(finer, q)).max()) for q in ("x", "y")) / case["rod"].length


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*range(8), *map(longer, range(8, 25))])
def test_no_random_rod_is_off_without_a_word(seed):
    """Energy by 5 %, or places by 5 % of the length beside a quarter of the step. As a script, this file runs 300 of them."""
    words, energy, places = judged(seed)
    if words != "refused":
        assert energy < 0.0101 or any("is conserved, but" in word for word in words)
        assert (energy < 0.05 and places < 0.05) or words


if __name__ == "__main__":
    found = [judged(seed) for seed in range(300)]
    kept = [one for one in found if one[0] != "refused"]
    quiet = [one for one in kept if not one[0]]
    by_energy = [one for one in kept if not any("is conserved, but" in word for word in one[0])]
    print(f"{len(found) - len(kept)} refused, {len(kept) - len(quiet)} warned, {len(quiet)} without a word")
    for name, group in (("without a word", quiet), ("without one of energy", by_energy)):
        energy, places = (max((one[i] for one in group), default=0.0) for i in (1, 2))
        print(f"{name}: energy off by {energy:.1e}, places by {places:.1e} of the length")
