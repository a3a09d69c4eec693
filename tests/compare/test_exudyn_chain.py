"""The chain of discs with their own headings against Exudyn's rigid wheels, rolling joints and beams."""

import numpy as np
import pytest

from discs import Chain, Problem, Solution, State, SteeredChain, simulate

pytest.importorskip("exudyn", reason="the peer exudyn is not installed (extra [peers])")

from compare.peers.exudyn_chain import exudyn_steered

pytestmark = pytest.mark.slow

PAPER = {
    "density": 1.0,
    "spin_inertia": 1.0,
    "heading_inertia": 0.25,
    "torsion_stiffness": 0.8,
    "bending_stiffness": 0.7,
    "radius": 1.0,
    "stretch_stiffness": 10.0,
    "shear_stiffness": 10.0,
}
UNEQUAL = {
    "density": 1.3,
    "spin_inertia": 0.6,
    "heading_inertia": 0.3,
    "torsion_stiffness": 0.9,
    "bending_stiffness": 0.8,
    "radius": 0.7,
    "stretch_stiffness": 9.0,
    "shear_stiffness": 7.0,
}
ROWS = ("x", "y", "theta", "phi")


def twisted(n: int, parameters: dict[str, float]) -> Problem:
    """The paper's twist of a straight chain at rest."""
    chain = SteeredChain(n=n, length=4.0, **parameters)
    return Problem(chain, State(chain.s, 0 * chain.s, -np.pi / 2 * np.cos(np.pi * chain.s / 4), phi=0 * chain.s), 4.5)


def moving(n: int) -> Problem:
    """A bent, rolling, turning chain; every disc and link different, headings far from 0, over half a turn of roll."""
    rng = np.random.default_rng(3)
    links = ("torsion_stiffness", "bending_stiffness", "stretch_stiffness", "shear_stiffness")
    chain = SteeredChain(
        n=n,
        length=3.1,
        **{name: mean * rng.uniform(0.7, 1.4, n - (name in links)) for name, mean in UNEQUAL.items()},
    )
    s = chain.s / chain.length
    phi = 2.6 + 0.3 * s**2 - 0.1 * s
    x, y = 3.1 * (np.cos(2.6) * s - np.sin(2.6) * 0.1 * s**2), 3.1 * (np.sin(2.6) * s + np.cos(2.6) * 0.1 * s**2)
    return Problem(chain, State(x, y, 0.8 * s**2, omega=4 - 0.7 * s, phi=phi, phi_rate=1.5 + 0.4 * s), 3.0)


def rows(run: Solution) -> np.ndarray:
    return np.array([getattr(run, row) for row in ROWS])


def largest(difference: np.ndarray) -> np.ndarray:
    """Largest of x, y, theta, phi over frames and discs."""
    return np.abs(difference).max(axis=(1, 2))


# largest differences of x, y, theta, phi at the step 0.01 and t = 4.5 as measured, and what two steps extrapolated leave of them
MEASURED = [
    pytest.param(2, PAPER, (1.3e-6, 2.5e-6, 1.4e-6, 1.2e-5), 3.2e-7, id="2-paper"),
    pytest.param(2, UNEQUAL, (1.8e-7, 4.1e-6, 4.6e-6, 3.1e-6), 1.6e-7, id="2-unequal"),
    pytest.param(8, PAPER, (1.8e-6, 9.6e-7, 1.4e-6, 8.1e-5), 3.8e-7, id="8-paper"),
    pytest.param(8, UNEQUAL, (7.3e-6, 7.1e-6, 1.4e-5, 5.7e-5), 4.9e-7, id="8-unequal"),
    pytest.param(32, PAPER, (6.9e-6, 2.4e-6, 6.9e-6, 5.7e-5), 1.5e-6, id="32-paper"),
]


@pytest.mark.parametrize(("n", "parameters", "measured", "extrapolated"), MEASURED)
def test_exudyn_agrees_at_second_order(n, parameters, measured, extrapolated):
    problem = twisted(n, parameters)
    ours = rows(simulate(problem, "suzuki4", 0.02, frames=2, progress=False))
    coarse, fine = (rows(exudyn_steered(problem, dt)) for dt in (0.02, 0.01))
    assert (largest(fine - ours) < 1.2 * np.array(measured)).all()
    np.testing.assert_allclose(np.log2(largest(coarse - ours) / largest(fine - ours)), 2, atol=0.1)
    # the rest of a symmetric method's second order is its fourth
    assert largest((4 * fine - coarse) / 3 - ours).max() < 1.5 * extrapolated


@pytest.mark.parametrize("spectral_radius", [None, 0.9])
def test_exudyn_agrees_when_every_disc_differs(spectral_radius):
    problem = moving(6)
    ours = rows(simulate(problem, "suzuki4", 0.01, frames=4, progress=False))
    runs = [exudyn_steered(problem, dt, frames=4, spectral_radius=spectral_radius) for dt in (0.01, 0.005)]
    coarse, fine = (rows(run) for run in runs)
    assert np.abs(ours[2]).max() > np.pi, "the roll is to pass half a turn, where an angle that wraps would show"
    assert (largest(fine - ours) < 1.2 * np.array([3.2e-4, 1.9e-4, 4.7e-4, 8.3e-4])).all()
    np.testing.assert_allclose(np.log2(largest(coarse - ours) / largest(fine - ours)), 2, atol=0.1)
    assert largest((4 * fine - coarse) / 3 - ours).max() < 3e-6
    np.testing.assert_allclose(runs[-1].energy, problem.energy(), rtol=7e-5)
    assert runs[-1].rolling_residual.max() < 1e-7
    assert runs[-1].stats["lean"] < 1e-12


def test_exudyn_prints_and_leaves_nothing(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = exudyn_steered(twisted(2, PAPER), 0.1)
    np.testing.assert_allclose(run.t, [0, 4.5])
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


def test_exudyn_refuses_other_chains():
    slaved = Chain(n=4, length=3.0, density=1, spin_inertia=1, torsion_stiffness=1, bending_stiffness=1, radius=1)
    with pytest.raises(ValueError, match="SteeredChain"):
        exudyn_steered(Problem(slaved, State(slaved.s, 0 * slaved.s, 0 * slaved.s), 1.0), 0.1)
    with pytest.raises(ValueError, match="dt must be positive"):
        exudyn_steered(twisted(2, PAPER), 0.0)
