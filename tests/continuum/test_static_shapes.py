"""Shapes at rest: a clamped rod on a slope against a boundary-value solver, and rods that relax to their rest curvature.

Where a rod comes to rest depends on its way there, as discs do not slide: C^T (grad V - f) = 0 is one equation for a disc with
three coordinates. Small motions have y = R theta, so their equilibrium is the solution of a boundary-value problem.
"""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from continuum import Rod, Scene, SteeredRod, solve
from discs import Chain, Midpoint, Problem, State, simulate
from discs.loads import Damping, Motor, Rest, Slope

pytestmark = pytest.mark.slow

LENGTH, SMALL = 3.0, 3e-4
UNEVEN = {"density": 1.3, "spin_inertia": 0.6, "torsion_stiffness": 0.9, "bending_stiffness": 0.5, "radius": 0.8, "length": LENGTH}
R, BETA, K, PULL = 0.8, 0.9, 0.5, 1.3 * 0.8 * SMALL


def at_rest(scene: Scene):
    """The end of a motion that has died down."""
    run = solve(scene, 1e-5 * SMALL, frames=[0.0, scene.duration], progress=False)
    assert np.abs(run.omega[-1]).max() < 1e-4 * np.abs(run.theta[-1]).max()
    return run


def by_boundary_values(equations, ends, unknowns: int, s):
    found = solve_bvp(equations, ends, np.linspace(0, LENGTH, 30), np.zeros((unknowns, 30)), tol=1e-9)
    assert found.success
    return found.sol(s)


def test_a_clamped_rod_on_a_slope_takes_its_static_shape(rolling):
    """beta theta'' - K R^2 theta'''' + rho g R = 0, no curvature at the ends; the clamp holds the weight rho g R length."""

    def straight(s):
        return s, 0 * s, 0 * s, 0 * s

    loads = (Slope(gy=SMALL), Motor(0.0, at=0.0), Damping(rolling=1.2, torsion=0.3))
    run = at_rest(Scene(rod=Rod(**UNEVEN), initial=straight, duration=40.0, rolling=rolling, loads=loads))
    theta = by_boundary_values(
        lambda s, u: np.array([u[1], u[2], u[3], (BETA * u[2] + PULL) / (K * R * R)]),
        lambda a, b: np.array([a[0], a[2], b[2], BETA * b[1] - K * R * R * b[3]]),
        4,
        run.s,
    )[0]
    assert np.abs(run.theta[-1] - theta).max() < 1e-5 * theta.max()
    assert np.abs(run.y[-1] - R * theta).max() < 1e-5 * theta.max()
    assert run.reaction[-1, 0] == pytest.approx(-PULL * LENGTH, rel=1e-4)


@pytest.mark.long
def test_a_clamped_rod_with_headings_of_its_own_takes_its_static_shape():
    """With the shear gamma = R theta' - phi: R G gamma' + beta theta'' + rho g R = 0 and K phi'' + G gamma = 0."""
    shear = 2.0

    def straight(s):
        return s, 0 * s, 0 * s, 0 * s, 0 * s, 0 * s

    rod = SteeredRod(**UNEVEN, stretch_stiffness=3.0, shear_stiffness=shear, heading_inertia=0.3)
    clamp = Motor(0.0, at=0.0), Motor(0.0, at=0.0, about="turn")
    loads = (Slope(gy=SMALL), *clamp, Damping(rolling=1.2, turning=0.5, torsion=0.3, bending=0.2))
    run = at_rest(Scene(rod=rod, initial=straight, duration=40.0, rolling="unit", loads=loads))

    def equations(s, u):
        theta1, phi, phi1 = u[1:]
        return np.array([theta1, (R * shear * phi1 - PULL) / (R * R * shear + BETA), phi1, -shear / K * (R * theta1 - phi)])

    theta, _, phi, _ = by_boundary_values(
        equations, lambda a, b: np.array([a[0], a[2], R * shear * (R * b[1] - b[2]) + BETA * b[1], b[3]]), 4, run.s
    )
    assert np.abs(run.theta[-1] - theta).max() < 1e-5 * theta.max()
    assert np.abs(run.phi[-1] - phi).max() < 1e-5 * theta.max()


def bent(turn: float, duration: float, **changes) -> Problem:
    """A straight rod without torsion that turns by `turn` over its length when it relaxes."""
    given = UNEVEN | {"torsion_stiffness": 0.0, "spin_inertia": 0.2, "radius": 0.3} | changes
    chain = Chain(n=17, rolling="unit", **given)
    loads = (Rest(curvature=turn / LENGTH), Damping(rolling=0.5))
    return Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), duration, loads)


def test_a_slightly_bent_rod_relaxes_to_a_circle():
    """y'' = kappa_0 in the limit of small turns; the circle has radius 1/kappa_0 to the square of the turn."""
    run = simulate(bent(0.1, 60.0), Midpoint(tolerance=1e-13), 0.05, 2, progress=False, engine="plain")
    r = run.x[-1] + 1j * run.y[-1]
    fit = np.linalg.lstsq(np.column_stack([2 * r.real, 2 * r.imag, np.ones(17)]), np.abs(r) ** 2, rcond=None)[0]
    radius = np.sqrt(fit[2] + fit[0] ** 2 + fit[1] ** 2)
    assert radius == pytest.approx(LENGTH / 0.1, rel=2e-3)
    assert np.abs(np.abs(r - fit[0] - 1j * fit[1]) - radius).max() < 1e-5
    assert run.energy[-1] < 1e-3 * run.energy[0]


@pytest.mark.long
def test_a_rod_with_the_true_curvature_turns_by_its_rest_value_everywhere():
    """However large: V = int K (phi' - kappa_0)^2/2, and e psi turns the line by R psi'/|r'|, so (m'/|r'|)' = 0 and m = 0.

    Half a turn is closed up to it: the ends are antiparallel. It is no circle, as the links have changed their lengths.
    """
    run = simulate(bent(np.pi, 25.0, curvature="true", bending_stiffness=1.0), Midpoint(tolerance=1e-12), 0.02, 2, progress=False)
    links = np.diff(run.x[-1] + 1j * run.y[-1])
    turns = np.angle(links[1:] / links[:-1])
    assert turns == pytest.approx(np.pi / 16, rel=1e-5)
    assert run.energy[-1] < 1e-9 * run.energy[0]
    assert np.ptp(np.abs(links)) > 0.05
