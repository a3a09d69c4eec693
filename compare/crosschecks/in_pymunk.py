"""pymunk: a disc on the ground in its vertical plane, driven by a torsion spring; only dry friction makes it roll.

Two discs with own headings, joined by torsion only and twisted against each other, are two such discs: the middle of the spring
rests, so each hangs on half a spring. pymunk's step moves first and adds forces then: its motion is of order 1, and of order 2 if
it is read half a step late; the ground's force in a step is compared with lambda in the middle of it.
"""

from typing import Any

import numpy as np

from compare.crosschecks.both import timed
from compare.crosschecks.table import Row, order
from discs import Problem, Solution, State, SteeredChain, simulate
from discs.arrays import Float
from discs.mechanics.contact import rolling_in_pymunk

MASS, SPIN, RADIUS, SPRING, TWIST, DURATION = 1.3, 0.4, 0.7, 0.9, 1.4, 10.0


def two_discs(times: Float) -> Solution:
    """The chain; each disc stands for half of the length 2, so its inertia is MASS and SPIN."""
    inertia: dict[str, Any] = {"density": MASS, "spin_inertia": SPIN, "heading_inertia": 0.3, "radius": RADIUS}
    springs: dict[str, Any] = {
        "stretch_stiffness": 0.0,
        "shear_stiffness": 0.0,
        "bending_stiffness": 0.0,
        "torsion_stiffness": SPRING,
    }
    chain = SteeredChain(n=2, length=2.0, **inertia, **springs)  # beta/k = SPRING/2
    start = State([0.0, 2.0], [0.0, 0.0], [-TWIST, TWIST], phi=[0.0, 0.0])
    return simulate(
        Problem(chain, start, float(times[-1])), "gauss8", dt=0.05, frames=times, want=("contact_force",), progress=False
    )


def rows(steps: tuple[int, ...] = (500, 1000, 2000)) -> list[Row]:
    """Roll angle, and the ground's force."""
    errors, late, forces = [], [], []
    given = {
        "mass": MASS,
        "spin_inertia": SPIN,
        "radius": RADIUS,
        "stiffness": SPRING,
        "twist": TWIST,
        "gravity": 9.3,
        "friction": 0.5,
    }
    h = DURATION / np.array(steps)
    for dt, count in zip(h.tolist(), steps, strict=True):
        run, theirs = timed(rolling_in_pymunk, **given, dt=dt, steps=count)
        chain, ours = timed(two_discs, np.append(run.t[:-1] + dt / 2, DURATION))
        assert chain.contact_force is not None
        turned = run.theta - TWIST  # theta of the chain starts at -TWIST
        errors.append(float(np.abs(turned[-1] - chain.theta[-1, 0])))
        late.append(float(np.abs(turned[1:] - chain.theta[:-1, 0]).max()))
        forces.append(float(np.abs(run.friction - chain.contact_force[:-1, 1, 0]).max()))
        angle = "roll angle of disc 1"
        cases = [
            (angle, float(chain.theta[-1, 0]), float(turned[-1]), errors),
            (f"{angle}, half a step late; all steps", float(chain.theta[-2, 0]), float(turned[-1]), late),
            ("force of the ground; all steps", float(chain.contact_force[-2, 1, 0]), float(run.friction[-1]), forces),
        ]
    problem, differs = (
        f"2 discs, torsion only, t = {DURATION:g}",
        "rolls by dry friction; ours has 2000 frames",
    )
    return [
        Row("pymunk friction", problem, name, mine, their, found[-1], f"{order(h, found):.2f} in the step", ours, theirs, differs)
        for name, mine, their, found in cases
    ]
