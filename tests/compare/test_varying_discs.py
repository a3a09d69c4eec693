"""Discs of rods whose parameters vary: places, equations with multipliers, energy, the limit of many discs."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from compare import convergence, lump
from continuum import Rod, solve, untwisting_rod
from discs import simulate
from discs.loads import Damping, Motor, Rest, Slope, Torque, signals
from tests.continuum.test_varying import AROUND, KINDS, LENGTH, OWN, VARYING, scene, untwisting


def by_multipliers(problem, kind):
    """The end of a motion of discs from the equations with multipliers, for springs: matrices written down disc by disc.

    Parameters are those of the functions: rho, alpha, R at s_i, beta at s_{i+1/2}, K at s_i of the bends, whatever the chain has.
    """
    chain, rod, n = problem.chain, Rod(length=LENGTH, **(AROUND if "ring" in kind else VARYING)), problem.chain.n
    ring, k = "ring" in kind, chain.k
    s = k * np.arange(n)
    share = np.full(n, k) if ring else k * np.array([0.5, *np.ones(n - 2), 0.5])
    torsion, bending, slope = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    for i in range(n if ring else n - 1):
        row = np.zeros(n)
        row[i], row[(i + 1) % n] = -1, 1
        torsion += rod.torsion_stiffness(k * (i + 0.5)) / k * np.outer(row, row)
    for i in range(n):
        slope[i, (i + 1) % n], slope[i, i - 1] = 0.5 / k, -0.5 / k
        if ring or 0 < i < n - 1:
            row = np.zeros(n)
            row[i - 1], row[i], row[(i + 1) % n] = 1, -2, 1
            bending += rod.bending_stiffness(s[i]) / k**3 * np.outer(row, row)
    if not ring:
        slope[0], slope[-1] = 0, 0
        slope[0, :3], slope[-1, -3:] = np.array([-3, 4, -1]) / (2 * k), np.array([1, -4, 3]) / (2 * k)
    mass = np.concatenate([rod.density(s) * share, rod.density(s) * share, rod.spin_inertia(s) * share])

    def forms(x, y, x_rate, y_rate):
        """A and A. in A v = 0: r. = R theta. J h(r')."""
        z, z_rate = slope @ (x + 1j * y), slope @ (x_rate + 1j * y_rate)
        e, e_rate = 1j * rod.radius(s) * z, 1j * rod.radius(s) * z_rate
        if "unit" in kind:
            turning = (z.conj() * z_rate).imag / np.abs(z) ** 2
            e, e_rate = e / np.abs(z), 1j * turning * e / np.abs(z)
        one, none = np.eye(n), np.zeros((n, n))
        a = np.block([[one, none, -np.diag(e.real)], [none, one, -np.diag(e.imag)]])
        return a, np.hstack([np.zeros((2 * n, 2 * n)), np.vstack([-np.diag(e_rate.real), -np.diag(e_rate.imag)])])

    def rate(_, state):
        q, v = state.reshape(2, 3, n)
        force = -np.concatenate([bending @ q[0], bending @ q[1], torsion @ q[2]])
        a, a_rate = forms(q[0], q[1], v[0], v[1])
        saddle = np.block([[np.diag(mass), -a.T], [a, np.zeros((2 * n, 2 * n))]])
        return np.concatenate([v.ravel(), np.linalg.solve(saddle, [*force, *(-a_rate @ v.ravel())])[: 3 * n]])

    given = problem.initial
    a, _ = forms(given.x, given.y, 0 * s, 0 * s)
    omega = np.broadcast_to(given.omega, n)
    v = np.concatenate([-a[:, 2 * n :] @ omega, omega])
    q = np.concatenate([given.x, given.y, given.theta])
    found = solve_ivp(rate, (0, problem.duration), np.concatenate([q, v]), "DOP853", rtol=1e-11, atol=1e-12)
    return found.y[: 3 * n, -1].reshape(3, n)


@pytest.mark.parametrize("kind", KINDS[:4])
def test_discs_move_as_the_multipliers_say(kind, kernels_as_python):
    problem = lump(scene(kind), 9)
    expected = by_multipliers(problem, kind)
    run = simulate(problem, "gauss6", problem.duration / 100, frames=[problem.duration], progress=False)
    np.testing.assert_allclose([run.x[-1], run.y[-1], run.theta[-1]], expected, rtol=0, atol=1e-8)


def test_parameters_are_taken_at_discs_links_and_bends():
    s, middles = np.arange(5.0), np.arange(4.0) + 0.5
    chain = lump(scene("field rod"), 5).chain
    for name, places in (("density", s), ("spin_inertia", s), ("radius", s), ("torsion_stiffness", middles)):
        np.testing.assert_array_equal(getattr(chain, name), VARYING[name](places))
    for ends, places in (("springs", s[1:-1]), ("paper", s[1:-1]), ("consistent", s)):
        np.testing.assert_array_equal(
            lump(scene("field rod"), 5, ends).chain.bending_stiffness, VARYING["bending_stiffness"](places)
        )
    true = untwisting_rod("unit", curvature="true", stretch_stiffness=lambda s: 2 + s, **VARYING)
    chain = lump(true, 5, "consistent").chain
    np.testing.assert_array_equal(chain.bending_stiffness, VARYING["bending_stiffness"](s[1:-1]))
    np.testing.assert_array_equal(chain.stretch_stiffness, 2 + middles)
    chain = lump(scene("steered"), 5).chain
    for name in ("bending_stiffness", "torsion_stiffness", "stretch_stiffness", "shear_stiffness"):
        np.testing.assert_array_equal(getattr(chain, name), (VARYING | OWN)[name](middles))
    np.testing.assert_array_equal(chain.heading_inertia, OWN["heading_inertia"](s))
    ring = lump(scene("field ring"), 8).chain
    np.testing.assert_array_equal(ring.bending_stiffness, AROUND["bending_stiffness"](0.5 * np.arange(8)))
    np.testing.assert_array_equal(ring.torsion_stiffness, AROUND["torsion_stiffness"](0.5 * np.arange(8) + 0.25))


@pytest.mark.parametrize(("kind", "ends"), [("field rod", "consistent"), ("unit ring", "springs")])
def test_midpoint_keeps_the_energy_to_rounding(kind, ends):
    problem = lump(scene(kind, 2.0 if "rod" in kind else 1.0), 17, ends)
    run = simulate(problem, "midpoint", dt=0.005, frames=11, progress=False, engine="plain")
    assert np.abs(run.energy / run.energy[0] - 1).max() < 1e-12


@pytest.mark.slow  # kernels of chains
@pytest.mark.parametrize(
    ("kind", "ends", "least", "most"),
    [
        ("field rod", "consistent", 1.9, 2.15),
        ("unit rod", "consistent", 1.9, 2.15),
        ("field ring", "springs", 1.95, 2.05),
        ("unit ring", "springs", 1.95, 2.05),
        ("steered", "springs", 1.85, 2.15),
    ],
)
def test_discs_tend_to_the_field(kind, ends, least, most):
    """Order 2 with consistent ends, on rings and with own headings; from 257 to 513 discs 1.98 to 2.00."""
    given = scene(kind, 1.0 if "ring" in kind else 2.0)
    found = convergence(given, (65, 129), ends, solve(given, 1e-6, frames=1, progress=False), progress=False)
    worst = found.error.max(axis=1)
    order = np.log(worst[0] / worst[1]) / np.log(found.k[0] / found.k[1])
    assert least < order < most, (found.error, order)


@pytest.mark.slow  # kernels of chains
def test_a_varying_rod_with_own_headings_has_order_two_under_loads():
    """Against the elements, with a slope, dampers, a torque, rest shapes and a motor, all from the start on in motion or smooth."""
    start = signals.smooth(0.0, 0.8)
    loads = (
        Slope(0.1, -0.2),
        Damping(rolling=lambda s: 0.2 + 0.05 * s, turning=0.1, torsion=0.1),
        Torque(lambda s: 0.3 * np.cos(s), start),
        Rest(twist=lambda s: 0.1 * s, curvature=lambda s: 0.4 * np.sin(np.pi * s / LENGTH) ** 2, signal=start),
        Motor(lambda t: 0.4 * float(start(t)), at=LENGTH),
    )
    loaded = replace(scene("steered"), loads=loads, initial=lambda s: (*untwisting(s), 0 * s, 0 * s))
    field = solve(loaded, 1e-6, frames=2, progress=False)
    off = []
    for n in (33, 65, 129):
        run = simulate(lump(loaded, n), "gauss6", 0.02, 2, progress=False)
        assert abs(run.energy - run.energy[0] - run.work + run.dissipated).max() < 1e-6 * abs(run.energy).max()
        places = np.abs(np.subtract.outer(run.s, field.s)).argmin(axis=1)
        np.testing.assert_allclose(field.s[places], run.s, atol=1e-9)
        off.append([abs(getattr(run, name)[-1] - getattr(field, name)[-1, places]).max() for name in ("x", "y", "theta", "phi")])
    np.testing.assert_allclose(np.log2(np.divide(off[1], off[2])), 2, atol=0.06)
    assert run.work[-1] > 0.01
    assert run.dissipated[-1] > 0.01
