"""Chains of discs in MuJoCo, where only friction makes a disc roll.

A disc is a body with five joints, in this order: slides along x, y and z, a hinge about the vertical (heading phi) and a hinge
about the axle, which the heading turns (roll theta; its axis is -d_1, so that a positive roll goes along J d_1). It has no joint to
lean with, so it stays upright. Each disc is a tree of its own, and the only constraints in MuJoCo are N contacts with a plane.
Weight gives the normal force. Each disc starts at the depth where the soft contact carries it at rest, so that none bounces. Mass,
spin and heading inertia are `system.weights`; a rigid body has no axial moment above the sum of the other two, so the rest of the
spin inertia is the joint's `armature`. Both are exact for a body that turns about the vertical and its axle only. The springs are
generalised forces, `qfrc_applied` = -grad V at every step, by the compiled kernel of this repository; everything else in a step is
MuJoCo's.

The geom is a sphere about the middle of the axle. It touches at one point right below, as a thin disc does. A cylinder touches at
both rims, and friction at two points resists turning, which the model's disc is free to do. Contacts have dimension 3
(no friction against turning or rolling), elliptic cones, coefficient `MU`, so large that no disc slips, and friction stiffer than
the normal by `STIFFER` (impratio), so that creep, mobility R_t = (1 - d)/(d m STIFFER) at impedance d, is below other errors.

The law of contact: MuJoCo requires J v. = -b J v for the slip J v, with J and F at the start of a step and without J. v. Its Euler
method is v_{n+1} = v_n + h v., q_{n+1} = q_n + h v_{n+1}. The choice of b gives two methods:

* b = 1/h: J(q_n) v_{n+1} = 0. Slip is damped out in one step. First order.
* b = 2/h: J(q_n) (v_{n+1} + v_n) = 0, and with half a kick to start the rates are those of half steps: the leapfrog scheme with its
  constraint on the mean, q_{n+1} - 2 q_n + q_{n-1} = h^2 M^-1 (F + J^T lambda), J(q_n) (q_{n+1} - q_{n-1}) = 0. Second order,
  explicit. The damping is twice what MuJoCo accepts by default (its flag refsafe), and slip of a half step is reflected, not
  damped.

MuJoCo's Runge-Kutta is not better: b is bounded by about 1/h for it too, and the missing J. v gives a slip of J. v/b.

Headings that follow the line (`Chain` with rolling "unit") are no coordinates: each step first turns every disc along its line, at
rate 0. Friction right below the axle has no moment about the vertical, so nothing else turns a disc. A rolling direction that
depends on the neighbours puts no force on them, in Lagrange-d'Alembert's principle as here. Rolling "field" cannot be expressed:
its wheels have no fixed radius.
"""

import math
import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np

from compare.peers.peer import Cutoff, Outcome, Peer
from discs import Chain, Problem
from discs.arrays import Float
from discs.running.suggest import suggest_dt

X, Y, UP, HEADING, ROLL = range(5)
ORDER = [X, Y, ROLL, HEADING]  # as the rows of a system
GRAVITY, MU, STIFFER, IMPEDANCE = 10.0, 1e4, 1e4, 0.9999  # the last is the most that MuJoCo takes
OFTEN = 64


def mujoco_peer(problem: Problem, second_order: bool = True, stiffer: float = STIFFER) -> Peer:
    """MuJoCo on discs that roll by friction.

    Parameters
    ----------
    problem : a `SteeredChain`, or a `Chain` with rolling "unit" and linear curvature; any ends.
    second_order : slip reflected and half a kick to start, or slip damped out in a step; see the module's docstring.
    stiffer : how much stiffer friction is than the normal contact, > 0.

    Returns
    -------
    Peer whose settings are numbers of steps, doubling, from just within the stability limit. A run raises Cutoff if its
    time is up and ArithmeticError if it becomes unstable.

    Raises
    ------
    ValueError : for another chain, or a disc without spin inertia.
    """
    chain = problem.chain
    if isinstance(chain, Chain) and (chain.rolling != "unit" or chain.curvature != "linear"):
        raise ValueError(f"mujoco_peer takes rolling='unit' and linear curvature; got {chain.rolling!r} and {chain.curvature!r}")
    if not np.all(chain.spin_inertia):
        raise ValueError("mujoco_peer needs spin_inertia above 0: MuJoCo accepts no body without it")
    pull, n, rows = _pull(problem), chain.n, ORDER[: len(problem.system.rows)]

    def run(setting: float, seconds: float) -> Outcome:
        import mujoco

        steps = max(1, round(setting))
        model, data = _build(problem, problem.duration / steps, second_order, stiffer)
        q, force, step = data.qpos, data.qfrc_applied, mujoco.mj_step
        pull(q, force)
        if second_order:
            mujoco.mj_forward(model, data)
            data.qvel[:] -= 0.5 * model.opt.timestep * data.qacc
        warn = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(lambda text: None)  # otherwise MuJoCo writes warnings about an unstable run to a file
        try:
            begun = clock.process_time()
            for i in range(steps):
                pull(q, force)
                step(model, data)
                if not i % OFTEN:
                    _check(data, begun + seconds)
            spent = clock.process_time() - begun
            _check(data, np.inf)
        finally:
            mujoco.set_mju_user_warning(warn)
        return Outcome(q.reshape(n, 5).T[rows].copy(), steps, steps + second_order, None, spent)

    coarsest = int(np.ceil(problem.duration / suggest_dt(problem, "leapfrog")))
    name, order = ("MuJoCo, friction", "second") if second_order else ("MuJoCo, friction, damped", "first")
    tells = (
        "no rolling constraint: discs roll by friction at a regularised contact, so they creep and stand a little in the plane; "
        f"semi-implicit Euler with a fixed step, {order} order; springs from our kernel, called from Python every step"
    )
    return Peer(name, tuple(float(coarsest * 2**k) for k in range(10)), run, tells)


def _check(data: Any, until: float) -> None:
    """Stop a run whose time is up, or that MuJoCo reports as unstable."""
    if clock.process_time() > until:
        raise Cutoff
    if any(warning.number for warning in data.warning):
        raise ArithmeticError(f"MuJoCo is unstable at time {data.time:g}; take more steps")


def _build(problem: Problem, h: float, second_order: bool, stiffer: float) -> tuple[Any, Any]:
    """The discs at their start, for one step h."""
    import mujoco

    chain, initial = problem.chain, problem.initial
    radius = np.asarray(chain.radius)
    mass, spin = problem.system.weights[[0, 2]]
    turn = problem.system.weights[-1]  # any, where headings follow the line
    # K and B in MuJoCo's a = -B v - K d depth; given with a minus sign, and divided by powers of the impedance d
    stiffness, damping = 0.25 / h**2, 1 / h
    solref = -stiffness * IMPEDANCE**2, -damping * IMPEDANCE

    spec = mujoco.MjSpec()
    option = spec.option
    option.timestep, option.gravity = h, [0, 0, -GRAVITY]
    option.integrator, option.cone, option.impratio = mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtCone.mjCONE_ELLIPTIC, stiffer
    option.solver, option.tolerance = mujoco.mjtSolver.mjSOL_NEWTON, 1e-14
    flags = mujoco.mjtDisableBit
    # all contacts in one sparse system: faster than one a disc ("islands")
    for flag in (flags.mjDSBL_REFSAFE, flags.mjDSBL_EULERDAMP, flags.mjDSBL_AUTORESET, flags.mjDSBL_ISLAND):
        option.disableflags |= flag
    world = spec.worldbody
    world.add_geom(name="plane", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], contype=0, conaffinity=0)
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    for i in range(chain.n):
        held = min(spin[i], 1.9 * turn[i])
        body = world.add_body(pos=[0, 0, radius[i]], mass=mass[i], ipos=[0, 0, 0], inertia=[held, turn[i], turn[i]])
        body.explicitinertial = True  # not of the sphere
        for axis in np.eye(3):
            body.add_joint(type=slide, axis=axis)
        body.add_joint(type=hinge, axis=[0, 0, 1])
        body.add_joint(type=hinge, axis=[-1, 0, 0], armature=spin[i] - held)
        body.add_geom(name=f"disc {i}", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius[i], 0, 0], contype=0, conaffinity=0)
        spec.add_pair(
            geomname1="plane",
            geomname2=f"disc {i}",
            condim=3,
            friction=[MU, MU, 0, 0, 0],
            solref=solref,
            solreffriction=[0, solref[1] * (2 if second_order else 1)],
            solimp=[IMPEDANCE, IMPEDANCE, 1, 0.5, 2],
        )
    model = spec.compile()
    data = mujoco.MjData(model)

    q, v = data.qpos.reshape(-1, 5), data.qvel.reshape(-1, 5)
    omega = np.asarray(initial.omega)
    ex, ey = problem.system.contact(problem.system.shape(problem.start().hi)) / radius
    q[:, X], q[:, Y], q[:, ROLL] = initial.x, initial.y, initial.theta
    q[:, HEADING] = np.arctan2(-ex, ey) if initial.phi is None else initial.phi
    # at rest K d depth = R m g with R = (1 - d)/d times MuJoCo's mobility of the body
    mobility = (1 - IMPEDANCE) / IMPEDANCE * model.body_invweight0[1:, 0]
    q[:, UP] = -mobility * mass * GRAVITY / (stiffness * IMPEDANCE)
    v[:, X], v[:, Y], v[:, ROLL] = radius * ex * omega, radius * ey * omega, omega
    v[:, HEADING] = 0.0 if initial.phi is None else initial.phi_rate
    return model, data


def _pull(problem: Problem) -> Callable[[Float, Float], None]:
    """-grad V of MuJoCo's coordinates, into an array of its forces, and headings that follow the line; compiled for one chain."""
    from discs.kernels import protocol as do
    from discs.kernels.compiled import jit

    chain, n, rows = problem.system.parameters, problem.chain.n, len(problem.system.rows)
    order = np.array(ORDER)

    @jit
    def pull(position, force):  # type: ignore[no-untyped-def]
        work = do.workspace(chain)
        q, still, g, c = np.empty((rows, n)), np.zeros((rows, n)), np.empty((rows, n)), np.empty((rows, n))
        for i in range(n):
            for row in range(rows):
                q[row, i] = position[5 * i + order[row]]
        do.settle(chain, work, q, still)
        do.basis(chain, work, still, c)
        do.gradient(chain, work, still, g)
        for i in range(n):
            for row in range(rows):
                force[5 * i + order[row]] = -g[row, i]
            if rows == 3:
                position[5 * i + HEADING] = math.atan2(-c[0, i], c[1, i])

    pull(np.zeros(5 * n), np.empty(5 * n))
    return pull
