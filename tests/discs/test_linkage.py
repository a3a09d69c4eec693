"""Linkages against other models of ours, textbooks' equations with multipliers, exact motions, and their own balances."""

from dataclasses import replace

import numpy as np
import pytest

from discs import (
    Linkage,
    LinkageProblem,
    LinkageState,
    MechanicalSystem,
    Problem,
    SimulationError,
    State,
    SteeredChain,
    load,
    simulate,
)
from discs.linkage import nearest
from discs.linkage.midpoint import Moment, Stepper
from discs.linkage.starting import response
from discs.loads import Rest

ROWS = ("x", "y", "theta", "phi", "omega", "phi_rate", "energy")


@pytest.mark.parametrize(("ends", "psi"), [("springs", 0.0), ("ring", 0.0), ("springs", 0.6)])
def test_flexible_links_are_those_of_steered_chains(ends, psi):
    """Where axles are turned against the line, stretch and shear are along axles there and along bodies here: equal stiffness."""
    rng, n, k = np.random.default_rng(3), 7, 0.4
    closed = ends == "ring"
    links = n - (not closed)
    shift = (k * links, 0.0) if closed else (0.0, 0.0)
    w = np.full(n, k)
    if not closed:
        w[[0, -1]] /= 2
    rho, alpha, turn, radius = (rng.uniform(0.5, 1.5, n) for _ in range(4))
    stretch, shear, torsion, bending = (rng.uniform(1.0, 4.0, links) for _ in range(4))
    shear = shear if psi == 0 else stretch
    both = {"torsion_stiffness": torsion, "bending_stiffness": bending, "radius": radius, "shift": shift, "n": n}
    chain = SteeredChain(
        **both, length=k * links, density=rho, spin_inertia=alpha, heading_inertia=turn, stretch_stiffness=stretch,
        shear_stiffness=shear, ends=ends,
    )  # fmt: skip
    linkage = Linkage(
        **both, link_length=k, mass=w * rho, spin_inertia=w * alpha, heading_inertia=w * turn, stretch_compliance=1 / stretch,
        shear_compliance=1 / shear, closed=closed, mounting_angle=psi,
    )  # fmt: skip
    x, y, theta, phi, omega, rate = 0.1 * rng.normal(size=(6, n))
    x, phi, speed = x + k * np.arange(n), phi + psi, radius * omega
    loads = (Rest(mounting_angle=psi),) if psi else ()
    one = Problem(chain, State(x, y, theta, omega, phi, rate), 0.3, loads)
    two = LinkageProblem(linkage, LinkageState(x, y, phi, theta, -np.sin(phi) * speed, np.cos(phi) * speed, rate), 0.3)
    runs = simulate(one, "midpoint", 0.01, frames=4, engine="plain"), simulate(two, dt=0.01, frames=4)
    for name in ROWS:
        assert np.allclose(*(getattr(run, name) for run in runs), rtol=0, atol=1e-11), name
    assert np.ptp(runs[1].theta, axis=0).max() > 0.05


def test_rigid_links_and_free_nodes_obey_lagrange_and_dalembert():
    """Two nodes, a free one and a disc, and a rigid link between, by equations with multipliers that share no code."""
    k, share, psi, radius, bend, px, py, drag = 0.7, 0.3, 0.5, 0.4, 1.2, 0.3, -0.2, 0.15
    mass, turn, spin = np.array([1.3, 0.8]), np.array([0.2, 0.35]), 0.11

    def rows(q):
        m = (1 - share) * q[2] + share * (q[5] - psi)
        u, across = k * np.sin(m), k * np.cos(m)
        return np.array(
            [
                [-1, 0, u * (1 - share), 1, 0, u * share, 0],
                [0, -1, -across * (1 - share), 0, 1, -across * share, 0],
                [0, 0, 0, 1, 0, 0, radius * np.sin(q[5])],
                [0, 0, 0, 0, 1, 0, -radius * np.cos(q[5])],
            ]
        )

    names = ("x0", "y0", "phi0", "x1", "y1", "phi1", "theta1")
    book = MechanicalSystem.from_lagrangian(
        names,
        np.diag([mass[0], mass[0], turn[0], mass[1], mass[1], turn[1], spin]),
        lambda q: bend / (2 * k) * (q[5] - psi - q[2]) ** 2 - px * q[0] - py * q[4],
        rows,
        ("link", "link", "wheel", "wheel"),
        force=lambda t, q, v: np.append(np.zeros(6), -drag * v[6]),
    )
    linkage = Linkage(
        n=2, link_length=k, mass=mass, heading_inertia=turn, bending_stiffness=bend, wheel=[False, True], mounting_angle=[0, psi],
        spin_inertia=spin, radius=radius, rolling_drag=drag, second_share=share, force_x=[px, 0], force_y=[0, py],
    )  # fmt: skip
    begin = nearest(linkage, LinkageState([0, 0.7], [0, 0.1], [0.2, 1.1], 0, [0.3, 0.1], [0.2, 0.5], [0.4, -0.3]))
    problem = LinkageProblem(linkage, begin, 3.0)
    runs = [simulate(problem, dt=dt, frames=4) for dt in (0.1, 0.05, 0.025)]
    q = [begin.x[0], begin.y[0], begin.phi[0], begin.x[1], begin.y[1], begin.phi[1], begin.theta[1]]
    v = [
        begin.x_rate[0],
        begin.y_rate[0],
        begin.phi_rate[0],
        begin.x_rate[1],
        begin.y_rate[1],
        begin.phi_rate[1],
        runs[0].omega[0, 1],
    ]
    exact = book.integrate(q, book.consistent_velocity(np.array(q), np.array(v), 0.0), runs[0].t, progress=False)
    assert np.allclose(exact.v[0], v, atol=1e-12)
    freely = replace(book, applied=None).accelerations(np.array(q), np.array(v)).acceleration
    across, cos, sin = -v[6] * radius * v[5], np.cos(q[5]), np.sin(q[5])
    still = replace(linkage, rolling_drag=0.0)
    change = response(LinkageProblem(still, begin, 3.0).equations, *problem.start(), 0.0)[0]
    u = change[0, 1]
    found = [*change[:, 0], across * cos - u * sin, across * sin + u * cos, change[2, 1], u / radius]
    assert np.allclose(found, freely, rtol=0, atol=1e-11)
    off = []
    for run in runs:
        found = np.stack(
            [run.x[:, 0], run.y[:, 0], run.phi[:, 0], run.x[:, 1], run.y[:, 1], run.phi[:, 1], run.theta[:, 1]], axis=1
        )
        off.append(np.abs(found - exact.q).max())
        assert np.ptp(run.energy + run.dissipated) < 1e-13
    order = np.log2(np.divide(off[:-1], off[1:]))
    assert off[-1] < 2e-3
    assert (np.abs(order - 2) < 0.05).all(), order


def test_trailers_keep_the_heads_rate_and_the_energy_and_end_on_circles():
    """Hinges on the axles pull at the centres of mass: nothing turns the head. Each trailer ends at R_i^2 = R_{i-1}^2 - k_i^2."""
    k = np.array([0.5, 0.4, 0.3])
    rng = np.random.default_rng(5)
    linkage = Linkage(
        n=4, link_length=k, mass=rng.uniform(0.5, 2, 4), heading_inertia=rng.uniform(0.01, 0.05, 4), bending_stiffness=0,
        mounting_angle=np.pi / 2, second_share=1.0, spin_inertia=0.02, radius=0.2,
    )  # fmt: skip
    body = np.array([0.3, 0.9, 0.1, -0.6])  # backwards from the head
    r = np.cumsum([[0, 0], *(k[:, None] * np.stack([np.cos(body[1:]), np.sin(body[1:])], axis=1))], axis=0)
    phi, (speed, turn) = body + np.pi / 2, (-0.8, 0.7)
    roll = [speed]  # a trailer's wheels take the part of the hinge's velocity along them
    rate = [turn]
    for i in range(1, 4):
        behind = body[i] - body[i - 1]
        hinge = -roll[-1]
        roll.append(-hinge * np.cos(behind))
        rate.append(hinge * np.sin(behind) / k[i - 1])
    roll = np.array(roll)
    begin = LinkageState(r[:, 0], r[:, 1], phi, 0, -np.sin(phi) * roll, np.cos(phi) * roll, rate)
    begin = LinkageState(*(getattr(begin, name) for name in ("x", "y", "phi", "theta", "x_rate", "y_rate", "phi_rate")))
    run = simulate(LinkageProblem(linkage, begin, 25.0), dt=0.01, frames=26)
    assert np.ptp(run.energy) < 1e-12 * run.energy[0] * 2500
    assert np.ptp(run.phi_rate[:, 0]) < 1e-11
    assert np.abs(np.hypot(np.diff(run.x), np.diff(run.y)) - k).max() < 1e-13
    head = np.hypot(run.x_rate[-1, 0], run.y_rate[-1, 0]) / turn
    centre = run.x[-1, 0] - run.y_rate[-1, 0] / turn, run.y[-1, 0] + run.x_rate[-1, 0] / turn
    radii = np.hypot(run.x[-1] - centre[0], run.y[-1] - centre[1])
    assert np.allclose(radii**2, head**2 - np.append(0, np.cumsum(k**2)), atol=2e-4)
    assert np.ptp(run.omega[0]) > 0.1


def test_frames_do_not_change_a_run_and_a_tolerance_is_kept():
    linkage = Linkage(n=3, link_length=0.5, mass=1.0, heading_inertia=0.1, bending_stiffness=2.0, wheel=[True, False, False])
    problem = LinkageProblem(linkage, nearest(linkage, LinkageState([0, 0.5, 1.0], 0, 0.1, 0, 0, [0.3, -0.1, -0.5], -0.8)), 2.0)
    one, many = simulate(problem, dt=0.02, frames=1), simulate(problem, dt=0.02, frames=[0.013, 0.5, 1.111, 2.0])
    assert all((getattr(one, name)[-1] == getattr(many, name)[-1]).all() for name in ROWS)
    fine = simulate(problem, dt=0.004, frames=3)
    found = simulate(problem, tol=1e-3, frames=3)
    assert found.stats["tol"] == 1e-3
    assert max(np.abs(found.x - fine.x).max(), np.abs(found.y - fine.y).max(), np.abs(found.phi - fine.phi).max()) < 2e-3


def test_steps_are_reversible():
    linkage = Linkage(
        n=4, link_length=[0.5, 0.3, 0.4], mass=1.0, heading_inertia=0.1, bending_stiffness=2.0, wheel=[True, False, True, False]
    )
    begin = nearest(linkage, LinkageState([0, 0.5, 0.8, 1.2], 0, [0, 0.1, 0.3, 0.2], 0, 0, [0.3, -0.1, -0.5, 0.2], 0.4))
    problem = LinkageProblem(linkage, begin, 1.0)
    q, w = problem.start()
    z = Moment(q, w, np.zeros((2, 3)))
    stepper = Stepper(problem.equations)
    for _ in range(50):
        z, _ = stepper.step(z, 0.0, 0.02)
    assert np.abs(z.q - q).max() > 0.05
    z = z._replace(w=-z.w)
    for _ in range(50):
        z, _ = stepper.step(z, 0.0, 0.02)
    assert np.abs(z.q - q).max() < 1e-11


def test_files_and_pictures(tmp_path):
    linkage = Linkage(n=2, link_length=1.0, mass=1.0, heading_inertia=0.1, bending_stiffness=1.0, mounting_angle=np.pi / 2)
    run = simulate(LinkageProblem(linkage, LinkageState([0, 1], 0, np.pi / 2, 0, 1.0), 1.0), dt=0.1, frames=3)
    run.save(tmp_path / "run.nc")
    again = load(tmp_path / "run.nc")
    assert (again.x == run.x).all()
    assert again.stats["method"] == "midpoint"
    assert len(run.plot()) > 2
    with pytest.raises(ValueError, match="whose state is a LinkageState"):
        again.state()


def test_a_motion_that_ends_says_when():
    """Without mass at its base, the column that flutters takes the base away in finite time."""
    with pytest.raises(SimulationError, match="has no solution that Newton's method finds"):
        simulate(LinkageProblem(column(2.5), bent(0.5, 0.8), 40.0), dt=0.02)


def column(load, base=0.0):
    """Ziegler's column: two rigid bars, a skate across the second at its tip, a clamp that slides under a dead load."""
    return Linkage(
        n=3, link_length=1.0, mass=[base, 2.0, 1.0], heading_inertia=0.0, bending_stiffness=1.0, wheel=[False, False, True],
        second_share=1.0, force_x=[load, 0, 0], held=((0, "y"), (0, "phi")),
    )  # fmt: skip


def bent(a, b):
    return LinkageState([0, np.cos(a), np.cos(a) + np.cos(b)], [0, np.sin(a), np.sin(a) + np.sin(b)], [0, a, b])


def test_energy_is_flat_while_flutter_grows():
    run = simulate(LinkageProblem(column(2.1), bent(1e-3, 2e-3), 84.0), dt=0.05, frames=85)
    assert np.abs(run.phi[-20:]).max() > 0.1
    assert np.ptp(run.energy) < 1e-13
    below = simulate(LinkageProblem(column(2.07), bent(1e-3, 2e-3), 84.0), dt=0.05, frames=85)
    assert np.abs(below.phi).max() < 0.02
