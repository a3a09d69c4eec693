"""The chain of discs with own headings in Exudyn: rigid wheels on a plane, with Exudyn's rolling joint and beam.

The motion uses nothing of `discs.chains.steered`. A disc is a rigid body with six coordinates. `ObjectJointRollingDisc` lets it
roll on the plane, by three Lagrange multipliers at velocity level; a fourth multiplier holds it upright. On each axle is a massless
fork, a planar body (x, y, phi) that follows the wheel and does not roll. Between forks `ObjectBeamGeometricallyExact2D`, a planar
Simo-Reissner beam of two nodes and one point of integration, has exactly the stretch, shear and bending of a link; a linear spring
between rolls is its torsion. Exudyn's implicit trapezoidal rule or generalised alpha integrates: 9 coordinates and 7 multipliers a
disc, all compiled.

Axes: Exudyn's X is up, its (Y, Z) are our (x, y). Then Rot_X Rot_Y Rot_Z, the angles of `NodeRigidBodyRxyz`, are heading, lean and
roll, each a coordinate of its own: the roll never wraps, and the angles are singular only at a lean of 90 degrees.
"""

import time as clock
from itertools import pairwise
from typing import Any

import exudyn as exu
import numpy as np
from exudyn import itemInterface as items

from compare.peers.peer import Outcome, Peer
from discs import Problem, Solution, State, SteeredChain

UP, X, Y, HEADING, LEAN, ROLL = range(6)
QUARTER = np.pi / 2


def exudyn_steered(problem: Problem, dt: float, frames: int = 2, spectral_radius: float | None = None) -> Solution:
    """Run a chain of discs with their own headings and free ends in Exudyn.

    Parameters
    ----------
    problem : a `SteeredChain` with ends "springs".
    dt : longest time step; it is shortened so that frames fall on steps.
    frames : how many frames, at least 2, equally spaced over the duration.
    spectral_radius : None for the trapezoidal rule with all constraints at velocity level (index 2); a number in [0, 1] for
        generalised alpha with that spectral radius at infinity and the upright wheel and fork at position level (index 3).

    Returns
    -------
    Solution with phi, x_rate, y_rate and phi_rate, and Exudyn's own velocities in `energy` and `rolling_residual`. `stats` has the
    iterations of Newton's method, and `lean`, the largest lean angle or lift of a wheel at a frame.

    Raises
    ------
    ValueError : for another chain, or a step or number of frames out of range.
    RuntimeError : if Newton's method fails.
    """
    chain = problem.chain
    if not isinstance(chain, SteeredChain) or (chain.ends, chain.degree) != ("springs", 1):
        raise ValueError("exudyn_steered takes a SteeredChain of degree 1 with ends='springs'")
    if not dt > 0 or frames < 2:
        raise ValueError(f"dt must be positive and frames at least 2; got {dt!r} and {frames!r}")
    apart = max(1, int(np.ceil(problem.duration / (frames - 1) / dt - 1e-9)))
    steps = apart * (frames - 1)

    started = clock.process_time()
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    sensors = _build(mbs, chain, problem.initial)
    mbs.Assemble()
    # not mbs.SolveDynamic, which prints errors; Any, as the stub of SolveSystem lacks self
    solver: Any = exu.MainSolverImplicitSecondOrder()
    if not solver.SolveSystem(mbs, _settings(problem.duration, steps, frames, spectral_radius)):
        raise RuntimeError(f"Exudyn's solver failed at time {solver.it.currentTime:g}; take a smaller dt")
    records = np.array([[mbs.GetSensorStoredData(sensor) for sensor in pair] for pair in sensors])
    seconds = clock.process_time() - started

    # (disc, value or rate, frame, time and coordinates) -> (coordinates, frame, disc)
    q, rate = records[:, 0, :, 1:].transpose(2, 1, 0), records[:, 1, :, 1:].transpose(2, 1, 0)
    # Exudyn counts coordinates from its reference
    x, y, theta, phi = np.asarray(problem.initial.x) + q[X], np.asarray(problem.initial.y) + q[Y], -q[ROLL], q[HEADING]
    radius = np.asarray(chain.radius)
    slip = rate[X] - radius * rate[ROLL] * np.sin(phi), rate[Y] + radius * rate[ROLL] * np.cos(phi)
    weights = {X: chain.density, Y: chain.density, ROLL: chain.spin_inertia, HEADING: chain.heading_inertia}
    kinetic = sum((0.5 * chain.w * np.asarray(share) * rate[row] ** 2).sum(axis=1) for row, share in weights.items())
    stored = [problem.energy(State(x[f], y[f], theta[f], phi=phi[f])) for f in range(frames)]
    return Solution(
        t=records[0, 0, :, 0],
        s=chain.s,
        x=x,
        y=y,
        theta=theta,
        omega=-rate[ROLL],
        energy=kinetic + np.array(stored),
        rolling_residual=np.hypot(*slip).max(axis=1),
        stats={
            "method": "exudyn, trapezoidal" if spectral_radius is None else f"exudyn, generalised alpha {spectral_radius:g}",
            "order": 2,
            "dt": problem.duration / steps,
            "steps": steps,
            "iterations": solver.it.newtonStepsCount,
            "lean": float(np.abs(q[[UP, LEAN]]).max()),
            "seconds": seconds,
        },
        phi=phi,
        x_rate=rate[X],
        y_rate=rate[Y],
        phi_rate=rate[HEADING],
    )


def exudyn_steered_peer(problem: Problem) -> Peer:
    """The chain as a peer in speed against error: `exudyn_steered` with increasing numbers of steps."""

    def run(setting: float, seconds: float) -> Outcome:
        found = exudyn_steered(problem, problem.duration / setting)
        q = np.array([getattr(found, row)[-1] for row in problem.system.rows])
        return Outcome(q, int(found.stats["steps"]), 0, found.stats["iterations"], found.stats["seconds"])

    differs = "rigid wheels on its rolling joint, its own beam between them; 9 coordinates and 7 multipliers a disc"
    return Peer("Exudyn, wheels and beams", (45.0, 90.0, 180.0, 360.0), run, differs)


def _build(mbs: exu.MainSystem, chain: SteeredChain, initial: State) -> list[tuple[int, int]]:
    """Put the chain into a system; returns the sensors of every wheel's coordinates and their rates."""
    plane = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=mbs.AddObject(items.ObjectGround())))
    zero = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    radius = np.asarray(chain.radius)
    x, y, theta, omega, phi, phi_rate = (
        np.asarray(v) for v in (initial.x, initial.y, initial.theta, initial.omega, initial.phi, initial.phi_rate)
    )
    x_rate, y_rate = -radius * omega * np.sin(phi), radius * omega * np.cos(phi)
    mass, spin, turn = (chain.w * np.asarray(p) for p in (chain.density, chain.spin_inertia, chain.heading_inertia))

    forks, rolls, sensors = [], [], []
    for i in range(chain.n):
        # The axle is the body's z axis, which a quarter turn of reference lays along our x at heading 0. A disc that rolls along
        # +90 degrees of its axle turns about the axle by -theta.
        wheel = mbs.AddNode(
            items.NodeRigidBodyRxyz(
                referenceCoordinates=[radius[i], x[i], y[i], -QUARTER, 0, 0],
                initialCoordinates=[0, 0, 0, phi[i], 0, -theta[i]],
                initialVelocities=[0, x_rate[i], y_rate[i], phi_rate[i], 0, -omega[i]],
            )
        )
        # symmetric about the axle, so that the heading inertia does not depend on the roll
        body = mbs.AddObject(items.ObjectRigidBody(mass=mass[i], inertia=[turn[i], turn[i], spin[i], 0, 0, 0], nodeNumber=wheel))
        touch = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body))
        mbs.AddObject(
            items.ObjectJointRollingDisc(
                markerNumbers=[plane, touch], discRadius=radius[i], discAxis=[0, 0, 1], planeNormal=[1, 0, 0]
            )
        )
        at = [mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=wheel, coordinate=c)) for c in range(6)]
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[zero, at[LEAN]]))
        fork = mbs.AddNode(
            items.NodeRigidBody2D(
                referenceCoordinates=[x[i], y[i], 0],
                initialCoordinates=[0, 0, phi[i]],
                initialVelocities=[x_rate[i], y_rate[i], phi_rate[i]],
            )
        )
        for own, shared in enumerate((X, Y, HEADING)):
            marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=fork, coordinate=own))
            mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[at[shared], marker]))
        forks.append(fork)
        rolls.append(at[ROLL])
        kinds = exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t
        value, rate = (
            mbs.AddSensor(items.SensorNode(nodeNumber=wheel, outputVariableType=kind, storeInternal=True, writeToFile=False))
            for kind in kinds
        )
        sensors.append((value, rate))
    stretch, shear, bending, torsion = (
        np.asarray(v) for v in (chain.stretch_stiffness, chain.shear_stiffness, chain.bending_stiffness, chain.torsion_stiffness)
    )
    for i, (nodes, ends) in enumerate(zip(pairwise(forks), pairwise(rolls), strict=True)):
        mbs.AddObject(
            items.ObjectBeamGeometricallyExact2D(
                nodeNumbers=list(nodes),
                length=chain.k,
                axialStiffness=stretch[i],
                shearStiffness=shear[i],
                bendingStiffness=bending[i],
                includeReferenceRotations=True,  # headings count from 0, not from where the discs start
            )
        )
        mbs.AddObject(items.ObjectConnectorCoordinateSpringDamper(markerNumbers=list(ends), stiffness=torsion[i] / chain.k))
    return sensors


def _settings(duration: float, steps: int, frames: int, spectral_radius: float | None) -> exu.SimulationSettings:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = duration / (frames - 1)
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = True  # the sparsity is constant; a fifth faster
    integration = settings.timeIntegration
    integration.endTime = duration
    integration.numberOfSteps = steps
    integration.adaptiveStep = False
    integration.automaticStepSize = False
    alpha = integration.generalizedAlpha
    if spectral_radius is None:
        integration.solverType = exu.DynamicSolverType.TrapezoidalIndex2
        alpha.useNewmark = True
        alpha.useIndex2Constraints = True
    else:
        alpha.spectralRadius = spectral_radius
    return settings
