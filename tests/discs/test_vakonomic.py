"""Both mechanics against their variational principles, without the equations of the module."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Chebyshev
from scipy.integrate import solve_ivp
from scipy.linalg import null_space

from discs import MechanicalSystem, simulate
from discs.mechanics.vakonomic import agreeing_multipliers, of_chain, rolling_disc, solve
from discs.pictures import figures
from tests.conftest import Model, models, uneven
from tests.discs.test_system import contact_from_the_definition, potential_from_the_definition

pytestmark = pytest.mark.slow  # each motion is a boundary-value problem or many of them

M, SPIN, TURN, R = 1.3, 0.4, 0.25, 0.7
PULL, SPRING = np.array([0.9, -0.4]), 0.5
INERTIA = SPIN + M * R**2
DISC = rolling_disc(mass=M, spin_inertia=SPIN, heading_inertia=TURN, radius=R, pull=tuple(PULL), spring=SPRING)
PHI, OMEGA, TURNING = 0.4, 1.1, 0.8
CHAINS = [Model("springs", "field"), Model("springs", "unit"), Model("springs", "steered"), Model("ring", "steered")]


def axle(phi):
    """d_1 and J d_1."""
    return np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])


Q = np.array([0.2, -0.3, 0.1, PHI])
V = np.array([*(R * OMEGA * axle(PHI)[1]), OMEGA, TURNING])
CHARGES = {"none": np.zeros(2), "momentum": -M * V[:2], "other": np.array([0.5, 0.2])}
charges = pytest.mark.parametrize("mu", CHARGES.values(), ids=CHARGES)


def force(r, pull=PULL, spring=SPRING):
    return pull - spring * r


def spectral(times, values):
    """The polynomial through values at Chebyshev points of a span."""
    return Chebyshev.fit(times, values, len(times) - 1, domain=SPAN)


SPAN = (0.0, 3.0)
POINTS = 1.5 * (1 - np.cos(np.pi * np.arange(49) / 48))  # of the second kind, the ends are two of them


class ActionOfRolling:
    """S and r(T) of the curves that roll: theta(t), phi(t) are free, r is the integral of e theta. ."""

    def __init__(self, run):
        self.theta, self.phi = (spectral(run.t, run.q[:, j]) for j in (2, 3))
        rng = np.random.default_rng(7)
        bump = Chebyshev.fit(SPAN, [0, 0], 1, domain=SPAN) + Chebyshev([0.5, 0, -0.5], domain=SPAN)  # zero at both ends
        self.variations = [[bump * Chebyshev(rng.standard_normal(4), domain=SPAN) for _ in range(2)] for _ in range(8)]

    def __call__(self, variation, eps):
        theta, phi = (c + eps * eta for c, eta in zip((self.theta, self.phi), variation, strict=True))
        omega = theta.deriv()(POINTS)
        turned = np.array([-np.sin(phi(POINTS)), np.cos(phi(POINTS))])
        r = [spectral(POINTS, R * omega * turned[j]).integ(lbnd=0) + Q[j] for j in range(2)]
        x, y = (c(POINTS) for c in r)
        kinetic = 0.5 * INERTIA * omega**2 + 0.5 * TURN * phi.deriv()(POINTS) ** 2
        potential = 0.5 * SPRING * (x**2 + y**2) - PULL[0] * x - PULL[1] * y
        return np.array([spectral(POINTS, kinetic - potential).integ(lbnd=0)(SPAN[1]), *(c(SPAN[1]) for c in r)])

    def slopes(self):
        """dS (8,) and dr(T) (8, 2) of the eight variations, central differences."""
        eps = 1e-4
        found = np.array([(self(v, eps) - self(v, -eps)) / (2 * eps) for v in self.variations])
        return found[:, 0], found[:, 1:]


@charges
def test_vakonomic_motion_makes_the_action_stationary(mu):
    """dS = p.dr(T) for variations that roll and leave theta, phi at both ends: zero for fixed ends, and p = m r. + mu."""
    run = solve(DISC, Q, V, POINTS, mu)
    action, end = ActionOfRolling(run).slopes()
    np.testing.assert_allclose(action, end @ (M * run.v[-1, :2] + run.mu[-1]), atol=1e-7 * np.abs(action).max())


def test_nonholonomic_motion_does_not():
    action, end = ActionOfRolling(solve(DISC, Q, V, POINTS)).slopes()
    fixed = null_space(end.T)  # to first order r(T) is fixed too
    assert np.abs(fixed.T @ action).max() > 1e-2 * np.abs(action).max()


def virtual_work(run):
    """(M q.. + grad V).dq for the admissible dq = (e, 1, 0) and (0, 0, 1) with q.. of the interpolating polynomial, (2, F)."""
    second = np.array([spectral(run.t, column).deriv(2)(run.t) for column in run.q.T])
    e = R * axle(run.q[:, 3])[1]
    pulled = M * second[:2] - force(run.q[:, :2].T, PULL[:, None])
    return np.array([(e * pulled).sum(axis=0) + SPIN * second[2], TURN * second[3]])


def test_dalembert_holds_for_the_nonholonomic_motion_alone():
    inner = slice(4, -4)  # second derivatives lose digits at the ends
    assert np.abs(virtual_work(solve(DISC, Q, V, POINTS))[:, inner]).max() < 1e-6
    for mu in CHARGES.values():
        assert np.abs(virtual_work(solve(DISC, Q, V, POINTS, mu))[:, inner]).max() > 1e-1


@charges
def test_reduced_equations_of_one_disc(mu):
    """(I + m R^2) omega. = e.F - R p.d_1 phi., J phi.. = R p.d_1 omega, p. = F from p = m r. + mu."""

    def rate(_, z):
        r, phi, omega, turning, p = z[:2], z[3], z[4], z[5], z[6:]
        along, across = axle(phi)
        spin = (R * across @ force(r) - R * (p @ along) * turning) / INERTIA
        return [*(R * omega * across), omega, turning, spin, R * (p @ along) * omega / TURN, *force(r)]

    times = np.linspace(0, 5, 11)
    run = solve(DISC, Q, V, times, mu)
    reduced = solve_ivp(rate, (0, 5), [*Q, OMEGA, TURNING, *(M * V[:2] + mu)], "DOP853", times, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(run.q, reduced.y[:4].T, atol=1e-7)
    np.testing.assert_allclose(M * run.v[:, :2] + run.mu, reduced.y[6:].T, atol=1e-7)


@pytest.mark.parametrize("mu", [None, *CHARGES.values()], ids=["nonholonomic", *CHARGES])
def test_both_roll_and_conserve_energy(mu):
    run = solve(DISC, Q, V, np.linspace(0, 8, 33), mu)
    rolling = run.v[:, :2] - R * run.v[:, 2:3] * axle(run.q[:, 3])[1].T
    assert np.abs(rolling).max() < 1e-9
    r = run.q[:, :2]
    energy = 0.5 * run.v**2 @ [M, M, SPIN, TURN] + 0.5 * SPRING * (r**2).sum(axis=1) - r @ PULL
    np.testing.assert_allclose(energy, energy[0], atol=1e-9)
    np.testing.assert_allclose(run.energy, energy, atol=1e-12)


# mu_0 with p = m r. + mu: p.d_1 = 0 makes accelerations agree, and (p.d_1). = F.d_1 + phi. p.J d_1 = 0 their rates
ALONG, ACROSS = axle(PHI)
FITTED = {
    2: -M * V[:2] + 0.6 * ALONG,
    3: -M * V[:2],
    4: -M * V[:2] - (force(Q[:2]) @ ALONG) / TURNING * ACROSS,
}


@pytest.mark.parametrize("order", FITTED)
def test_they_part_by_a_power_of_time(order):
    times = np.array([0.0, 0.01, 0.02, 0.04])
    parted = np.abs(solve(DISC, Q, V, times, FITTED[order], 1e-13).q - solve(DISC, Q, V, times, tol=1e-13).q)[1:, 2:]
    slopes = np.diff(np.log2(parted), axis=0)
    # the next power adds order t of it: 0.04 of an order at the larger steps
    np.testing.assert_allclose(slopes, order, atol=0.06)


def test_no_charge_and_charges_across_the_axle_agree_in_acceleration():
    family = agreeing_multipliers(DISC, Q, V)
    np.testing.assert_allclose(np.abs(family.T), np.abs(ACROSS)[None], atol=1e-12)
    own = DISC.accelerations(Q, V)[0]
    for mu in (np.zeros(2), 1.7 * family[:, 0]):
        np.testing.assert_allclose(DISC.accelerations(Q, V, mu)[0], own, atol=1e-12)
    assert np.abs(DISC.accelerations(Q, V, ALONG)[0] - own)[2:].min() > 0.1


def test_free_disc_without_momentum_rolls_the_same_way():
    free = rolling_disc(mass=M, spin_inertia=SPIN, heading_inertia=TURN, radius=R)
    times = np.linspace(0, 10, 21)
    circle = solve(free, Q, V, times)
    phi = PHI + TURNING * times
    centre = Q[:2] - R * OMEGA / TURNING * ALONG
    np.testing.assert_allclose(circle.q[:, :2].T, centre[:, None] + R * OMEGA / TURNING * axle(phi)[0], atol=1e-9)
    np.testing.assert_allclose(solve(free, Q, V, times, -M * V[:2]).q, circle.q, atol=1e-8)
    assert np.abs(solve(free, Q, V, times, np.zeros(2)).q - circle.q)[-1].min() > 0.1


@pytest.mark.long
def test_on_an_incline_the_nonholonomic_disc_does_not_descend():
    """A cycloid: phi. is constant, (I + m R^2) omega. = R F.J d_1, and a whole turn moves the disc across F alone."""
    incline = rolling_disc(mass=M, spin_inertia=SPIN, heading_inertia=TURN, radius=R, pull=tuple(PULL))
    times = np.linspace(0, 2 * np.pi / TURNING, 9)
    cycloid = solve(incline, Q, V, times)
    along = axle(PHI + TURNING * times)[0]
    np.testing.assert_allclose(cycloid.v[:, 2], OMEGA + R / INERTIA / TURNING * (PULL @ along - PULL @ ALONG), atol=1e-9)
    step = cycloid.q[-1, :2] - Q[:2]
    np.testing.assert_allclose(step, np.pi * R**2 / INERTIA / TURNING**2 * np.array([-PULL[1], PULL[0]]), atol=1e-8)
    for mu in CHARGES.values():  # the vakonomic ones go down and down
        fall = solve(incline, Q, V, [0, 6, 9, 12], mu, tol=1e-8).q[1:, :2] @ PULL
        assert (np.diff(fall) > 0.03).all()


def test_an_integrable_constraint_cannot_tell():
    """A pendulum, r.r. = 0: dA = 0, so the motion does not depend on mu(0)."""
    weight = np.array([0.3, -1.1])
    pendulum = MechanicalSystem.from_lagrangian(("x", "y"), M * np.eye(2), lambda q: -weight @ q, lambda q: q[None], ("rod",))
    q, v, times = np.array([0.6, 0.8]), np.array([-0.8, 0.6]), np.linspace(0, 4, 9)
    swing = solve(pendulum, q, v, times)
    np.testing.assert_allclose(solve(pendulum, q, v, times, [2.0]).q, swing.q, atol=1e-8)
    assert agreeing_multipliers(pendulum, q, v).shape == (1, 1)


@models(CHAINS)
def test_nonholonomic_chain_is_that_of_simulate(model):
    n = 5 if model.ends == "ring" else 3
    problem = uneven(n, model)
    system, q, v = of_chain(problem)
    times = np.linspace(0, 0.6, 4)
    run = solve(system, q, v, times)
    known = simulate(problem, "gauss8", dt=0.02, frames=times, want=("contact_force",), engine="plain", progress=False)
    np.testing.assert_allclose(run.q[:, : 3 * n], np.hstack([known.x, known.y, known.theta]), atol=1e-8)
    np.testing.assert_allclose(run.multipliers, known.contact_force.reshape(4, -1), atol=1e-6)
    np.testing.assert_allclose(run.energy, known.energy, atol=1e-9)


def stationarity(problem, run, h):
    """d/dq_1 of sum h (L + mu.(r. - e theta.)) at two midpoints, over h: q at the times 0, 2, 4 and mu at 1, 3 of a run."""
    system = problem.system
    rows, n = len(system.rows), system.n
    q = run.q.reshape(len(run.t), rows, n)

    def action(middle):
        total = 0.0
        for a, b, mu in ((q[0], middle, run.mu[1]), (middle, q[4], run.mu[3])):
            v, mean = (b - a) / h, (a + b) / 2
            slip = v[:2] - contact_from_the_definition(problem, mean) * v[2]
            lagrangian = 0.5 * (system.weights * v**2).sum() - potential_from_the_definition(problem, mean)
            total += h * (lagrangian + (mu.reshape(2, n) * slip).sum())
        return total

    eps = 1e-4
    units = np.eye(rows * n).reshape(-1, rows, n)
    return np.array([action(q[2] + eps * u) - action(q[2] - eps * u) for u in units]) / (2 * eps * h)


@models(CHAINS)
def test_vakonomic_chain_makes_the_augmented_action_stationary(model):
    """The residual of the discretised action falls like h^2; with the nonholonomic q in place of the vakonomic it stays."""
    problem = uneven(5 if model.ends == "ring" else 3, model)
    system, q, v = of_chain(problem)
    mu = 0.4 * np.random.default_rng(2).standard_normal(2 * problem.chain.n)
    steps = [0.04, 0.02, 0.01]
    residual, control = [], []
    for h in steps:
        times = 0.5 + h * np.array([-1, -0.5, 0, 0.5, 1])
        run, other = (solve(system, q, v, [0, *times], charge) for charge in (mu, None))
        for motion, found in ((run, residual), (other, control)):
            window = replace(motion, t=times, q=motion.q[1:], mu=run.mu[1:])
            found.append(np.linalg.norm(stationarity(problem, window, h)))
    np.testing.assert_allclose(np.diff(np.log2(residual)), -2, atol=0.03)
    assert min(control) > 100 * residual[-1]
    assert np.ptp(run.energy) < 1e-9
    rate = run.v[-1].reshape(-1, problem.chain.n)
    rolled = contact_from_the_definition(problem, run.q[-1].reshape(rate.shape)) * rate[2]
    np.testing.assert_allclose(rate[:2], rolled, atol=1e-9)


@pytest.mark.long
def test_picture(tmp_path):
    figure = figures.vakonomic()
    assert len(figure.axes) == 3
    figure.savefig(tmp_path / "vakonomic.png")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"v": [1.0, 0.0, 0.0, 0.0]}, "v must obey the constraints; that of disc is off by 1: take consistent_velocity"),
        ({"q": [0.0, 1.0]}, r"q must be 4 finite numbers; got shape \(2,\)"),
        ({"mu": [0.0, 1.0, 2.0]}, r"mu must be 2 finite numbers; got shape \(3,\)"),
        ({"times": [0.0, 0.0]}, "times must be at least two, all increasing"),
        ({"times": [0.0]}, "times must be at least two, all increasing"),
        ({"tol": 0.0}, "rtol must be a positive finite number; got 0"),
    ],
)
def test_bad_input(change, message):
    with pytest.raises(ValueError, match=message):
        solve(DISC, **{"q": Q, "v": V, "times": [0.0, 1.0]} | change)


def test_bad_disc():
    with pytest.raises(ValueError, match="radius must be a positive finite number; got 0"):
        rolling_disc(mass=1.3, spin_inertia=0.4, heading_inertia=0.2, radius=0)


def test_motion_that_cannot_go_on():
    system = MechanicalSystem.from_lagrangian(("x", "y"), np.eye(2), lambda q: -(q[0] ** 4), lambda q: [[0.0, 1.0]], ("rail",))
    with pytest.raises(RuntimeError, match="cannot be continued beyond t = "), np.errstate(all="ignore"):
        solve(system, [2.0, 0.0], [3.0, 0.0], [0.0, 5.0], tol=1e-4)
