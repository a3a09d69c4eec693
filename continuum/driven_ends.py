"""Work of the loads of a rod on n functions in a Gauss step, and torques of the motors at its ends; see `continuum.weak`."""

import numpy as np

from continuum.galerkin import SpectralRod
from discs.arrays import Float
from discs.integrators.tableaux import tableau
from discs.skew import Phase


def power(rod: SpectralRod, t: float, h: float, z: Phase, v: Float, p: Float) -> tuple[Float, Float]:
    """The rates of work and dissipation (s, 2), and torques of motors (s, motors), at the stages of a step h from z at t.

    v, p : the rates (s, 3, n) and momenta (s, n) of the stages. The rod must have loads.
    """
    assert rod.loads is not None
    rule, held = tableau(len(v)), rod.loads.held
    times = t + h * rule.nodes
    q = z.hi + z.lo + h * np.tensordot(rule.a, v, 1)
    spent = rod.loads.power(times, q, v)
    if not held.size:
        return spent, np.empty((len(v), 0))
    c = rod.basis(q)
    pull = rod.back(c, rod.mean_force(q) - rod.loads.applied(times, q, v)) + np.linalg.solve(h * rule.a, p - z.pi)
    torque = pull[:, held] / c.t[:, held]
    spent[:, 0] += (torque * v[:, 2, held]).sum(axis=1)
    return spent, torque


def reaction(rod: SpectralRod, t: float, z: Phase) -> Float:
    """The torques of motors (motors,) at a state, from the change of their rates: the inertia of an end is constant."""
    assert rod.loads is not None
    q, held, now = z.hi + z.lo, rod.loads.held, np.array([t])
    c = rod.basis(q)
    pull = rod.back(c, rod.mean_force(q) - rod.loads.applied(now, q[None], rod.forward(c, z.pi)[None])[0])
    found: Float = (rod.loads.motors.changes(now)[0] / c.t[held] + pull[held]) / c.t[held]
    return found


def hold(rod: SpectralRod, t: float, z: Phase) -> tuple[Phase, float]:
    """A state with the rates of motors at a time, and the kinetic energy that it gains.

    Steps have the rates at their stages; at their ends they are as accurate as a step.
    """
    assert rod.loads is not None
    held = rod.loads.held
    if not held.size:
        return z, 0.0
    pi = z.pi.copy()
    pi[held] = rod.loads.motors.rates(np.array([t]))[0] / rod.basis(z.hi + z.lo).t[held]
    return z._replace(pi=pi), 0.5 * float((pi[held] ** 2 - z.pi[held] ** 2).sum())
