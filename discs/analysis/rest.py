r"""Static states: equilibria of the discs under their loads.

A state at rest is in equilibrium if C^T g = 0 with g = grad V - f: forces are balanced along the directions in which discs roll.
These are n equations (2 n with own headings) for 3 n (4 n) coordinates, so equilibria come in families; in which of them the discs
come to rest depends on where they start, and on the path. `equilibrium` rolls from the initial places along q' = -C C^T g, which
lowers the energy, by steps that are implicit in the linearised equations,

    (1/tau + J) psi = -C^T g,   q -> q + C(q + C psi/2) psi,   J psi = d(C^T g)[C psi],

and longer and longer: at last tau is so long that they are Newton's. Where a step fails to lower the imbalance, tau is cut.
"""

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.analysis.linear import Linearised, linearise
from discs.analysis.steady import Steady, accelerations, autonomous
from discs.arrays import Float
from discs.problem import Problem, State
from discs.skew import Phase

STEPS = 400
FARTHEST = 30.0  # lengths of the chain that the discs may roll, before they are taken to roll away
LONGEST = 1e10  # tau, over the square of the slowest period
FINE = 1e-11  # relative imbalance at which the search ends


def equilibrium(problem: Problem, at: State | None = None) -> State:
    """A static state under the loads, reached from the initial places by rolling.

    Parameters
    ----------
    problem : the chain and its loads, which must not depend on time; motors hold their discs, with rate 0.
    at : where to start; None for the initial state. Its rates do not matter.

    Returns
    -------
    The state, at rest. Forces are balanced to 1e-11 of the largest, or to rounding.

    Raises
    ------
    ValueError : if loads depend on time, a motor turns, or no equilibrium is found: as when a free chain rolls down a slope.
    """
    lin = linearise(problem, at)
    q, motors = lin.z.hi, () if lin.system.load is None else lin.system.load.axles
    for axle in motors:
        if lin.velocity[axle.row, axle.disc]:
            raise ValueError(f"Motor: the motor of disc {axle.disc} turns; in an equilibrium it must hold its disc, with rate 0")
    lin = Linearised(lin.problem, Phase(q, np.zeros_like(q), np.zeros_like(lin.z.pi)))
    autonomous(lin, problem.duration)
    slow = Steady(lin, np.zeros(2), 0.0).slow or 1 / problem.duration
    tau, start, length = 1 / slow**2, q, lin.system.scale[0]
    off, allowed, largest = _imbalance(lin, slow)
    for _ in range(STEPS):
        if off <= FINE * largest or tau < 1e-14 / slow**2:
            break
        after = _rolled(lin, tau)
        then, bound, size = _imbalance(after, slow)
        if not then < 2 * off:
            tau *= 0.1
            continue
        if off <= allowed and then > 0.5 * off:  # rounding
            break
        tau = min(LONGEST / slow**2, tau * min(10.0, max(0.5, 2 * off / max(then, 1e-300))))
        lin, off, allowed, largest = after, then, bound, size
        if np.abs(lin.z.hi[:2] - start[:2]).max() > FARTHEST * length:
            raise ValueError(
                f"no equilibrium: discs roll farther than {FARTHEST:g} lengths of the chain; hold it, by a Spring or a Motor of "
                "rate 0"
            )
    if off > allowed:
        raise ValueError(
            f"no equilibrium was found: discs still accelerate by {off:.3g} rad per time squared; hold it, by a Spring or a "
            "Motor of rate 0, or start nearer to an equilibrium"
        )
    return State(**dict(zip(lin.system.rows, lin.z.hi, strict=True)))


def _imbalance(lin: Linearised, slow: float) -> tuple[float, float, float]:
    """The largest acceleration, what `modes` allows of it, and that of the largest force."""
    if not np.isfinite(lin.unbalanced).all():
        return np.inf, 0.0, 0.0
    acceleration, allowed, largest = accelerations(lin, slow)
    if not acceleration.size:
        return 0.0, 0.0, 0.0
    worst = int(np.argmax(np.abs(acceleration) - allowed))
    return float(np.abs(acceleration[worst])), float(allowed[worst]), largest


def _rolled(lin: Linearised, tau: float) -> Linearised:
    """After a step of the flow."""
    _, own, push, _ = lin.parts
    b, stiffness = lin.strains.matrix, scipy.sparse.diags_array(lin.strains.stiffness)
    matrix = own.T @ (b.T @ stiffness @ b) @ own - push @ own + scipy.sparse.eye_array(own.shape[1]) / tau
    pull = -(own.T @ lin.unbalanced.ravel())
    system, psi = lin.system, np.zeros_like(lin.z.pi)
    psi.reshape(-1)[lin.free] = scipy.sparse.linalg.splu(matrix.tocsc()).solve(pull)
    half: Float = 0.5 * system.forward(lin.basis, psi)
    move = system.forward(system.basis(system.moved(lin.shape, half)), psi)
    return Linearised(lin.problem, Phase(lin.z.hi + move, np.zeros_like(move), lin.z.pi))
