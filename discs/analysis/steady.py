r"""Steady motions: equilibria, and motions in which the chain moves as a rigid body while its discs roll at constant rates.

A motion is steady, a relative equilibrium, if q(t) = exp(t xi) q(0) for a rigid motion xi = (u, Omega) of the plane and constant
rates of roll,

    r' = u + Omega J r,   phi' = Omega,   theta_i' = constant,   pi' = 0.

Momenta belong to the discs, so they do not change. In axes that move along, q is constant and small changes obey dq' = (N - Omega
J) dq + C dpi instead of dq' = N dq + C dpi: linear equations with constant coefficients, if forces look the same along the motion.
"""

from dataclasses import dataclass

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.analysis.linear import Linearised, linearise
from discs.arrays import Complex, Float, Matrix
from discs.linkage.small import Small
from discs.loads import signals
from discs.problem import Problem, State
from discs.skew import Phase

CLOSE = 1e-6  # relative; a state that is less steady than this is refused
SAME = 1e-3  # of the slowest rate: changes that are slower are none
EPS = float(np.finfo(float).eps)
CURE = "take `equilibrium(problem)`, or a state whose motion is steady, as at="


@dataclass(frozen=True, eq=False)
class Steady:
    """The linearised equations about a steady motion.

    Attributes
    ----------
    equations : at the state. drift : (2,), the velocity u, of the point of the moving axes that is at the origin.
    turning : Omega, rad per time.
    """

    equations: Linearised
    drift: Float
    turning: float

    @property
    def turned(self) -> Matrix:
        """Omega J on the rows x and y of q, sparse (rows n, rows n)."""
        rows, n = self.equations.basis.shape
        j = scipy.sparse.csr_array(([-self.turning, self.turning], ([0, 1], [1, 0])), shape=(rows, rows))
        return scipy.sparse.kron(j, scipy.sparse.eye_array(n), format="csr")

    @property
    def slow(self) -> float:
        """Scale of the slowest rates: that of a wave as long as the chain, sqrt((beta + K R^2 q^2) q^2/M), q = pi/length."""
        chain, n = self.equations.problem.chain, self.equations.system.n
        q, radius = np.pi / chain.length, np.mean(np.asarray(chain.radius))
        inertia = np.sum(1 / self.equations.basis[2] ** 2) / (n * chain.k)
        torsion, bending = (np.mean(np.asarray(stiff)) for stiff in (chain.torsion_stiffness, chain.bending_stiffness))
        return float(np.sqrt((torsion + bending * (radius * q) ** 2) / inertia) * q)

    @property
    def problem(self) -> Problem:
        """The chain and its loads, with the state as its initial one."""
        return self.equations.problem

    @property
    def velocity(self) -> Float:
        """q', (rows, n)."""
        return self.equations.velocity

    @property
    def scale(self) -> Float:
        """Units of the coordinates, (rows,)."""
        return self.equations.system.scale

    def positions(self, vectors: Complex) -> Complex:
        """Displacements (count, rows, n) from vectors of unknowns, as columns."""
        shape = self.equations.basis.shape
        return vectors[: shape[0] * shape[1]].T.reshape(-1, *shape)

    def displaced(self, change: Complex, rate: complex) -> State:
        """The state displaced by the real part of `change` (rows, n), with the rates of a change that grows as e^{rate t}."""
        lin = self.equations
        values = dict(zip(lin.system.rows, lin.z.hi + change.real, strict=True))
        rates = dict(zip(("omega", "phi_rate"), lin.velocity[2:] + (rate * change[2:]).real, strict=False))
        return State(**values, **rates)

    def symmetries(self) -> tuple[str, ...]:
        """The rigid motions, and "roll", by which the state can be displaced without any change: each is a zero mode."""
        lin = self.equations
        q = lin.z.hi
        moves = {name: np.zeros_like(q) for name in ("x", "y", "roll", "turn")}
        for row, name in enumerate(("x", "y", "roll")):
            moves[name][row] = 1.0
        moves["turn"][:2] = -(q[1] - q[1].mean()), q[0] - q[0].mean()
        moves["turn"][3:] = 1.0
        moved, _, push, _ = lin.parts
        root = 1 / lin.basis[2:].ravel()[lin.free]
        found = []
        for name, move in moves.items():
            dq = move.ravel()
            accelerations = (push @ dq) / root
            strains = np.sqrt(lin.strains.stiffness) * (lin.strains.matrix @ dq)
            bounds = np.sqrt(lin.strains.stiffness) * (abs(lin.strains.matrix) @ np.abs(dq))
            drifts, least = np.abs((moved - self.turned) @ dq), SAME * np.abs(dq).max() * self.slow
            if (
                (np.abs(strains) <= CLOSE * bounds).all()
                and max(np.abs(accelerations)) <= least * self.slow
                and max(drifts) <= least
            ):
                found.append(name)
        return tuple(found)


def steady(problem: Problem, at: State | None = None) -> Steady:
    """The linearised equations about a steady motion, that of `problem` from the state `at`, by default its initial one.

    Raises
    ------
    ValueError : with the reason, for a state whose motion is not steady.
    """
    lin = linearise(problem, at)
    autonomous(lin, problem.duration)
    drift, turning = _rigid(lin)
    _balanced(lin, Steady(lin, drift, turning).slow)
    found = Steady(lin, drift, turning)
    if np.any(lin.velocity):
        _alike(found)
    return found


def autonomous(lin: Linearised, duration: float) -> None:
    """Refuse loads that depend on time."""
    load, q = lin.system.load, lin.z.hi
    if load is None:
        return
    times = np.linspace(0.0, duration, 7)
    for signal, name in load.signals:
        values = signals.values(signal, times, name)
        if np.ptp(values) > CLOSE * np.abs(values).max():
            raise ValueError(
                f"{name}: its signal changes, from {values.min():g} to {values.max():g} over the duration; small motions about a "
                "state need constant loads: leave the signal out, or give a constant one"
            )
    forces = np.array([load.applied(time, q, lin.velocity) for time in times])
    if np.ptp(forces, axis=0).max() > CLOSE * np.abs(forces).max():
        raise ValueError("a load depends on t: small motions about a state need constant loads")


def _rigid(lin: Linearised) -> tuple[Float, float]:
    """u and Omega of the rigid motion that the velocities are."""
    (x, y), v, n = lin.z.hi[:2], lin.velocity, lin.system.n
    one, none = np.ones(n), np.zeros(n)
    rows = [np.stack([one, none, -y], axis=1), np.stack([none, one, x], axis=1)]
    given = [v[0], v[1]]
    if len(v) == 4:
        length = lin.system.scale[0]
        rows.append(length * np.stack([none, none, one], axis=1))
        given.append(length * v[3])
    matrix, right = np.concatenate(rows), np.concatenate(given)
    fit: Float = np.linalg.lstsq(matrix, right, rcond=None)[0]
    off, fastest = np.abs(matrix @ fit - right), np.abs(right).max()
    if off.max() > CLOSE * fastest + EPS * lin.system.scale[0] / lin.problem.duration:
        disc = int(np.argmax(off)) % n
        raise ValueError(
            "small motions are about an equilibrium or a steady motion, in which the chain moves as a rigid body; in the state "
            f"given disc {disc} moves {off.max():.3g} per time away from that: {CURE}"
        )
    if abs(fit[2]) * lin.system.scale[0] <= CLOSE * fastest:
        fit[2] = 0.0
    return fit[:2], float(fit[2])


def accelerations(lin: Linearised, slow: float) -> tuple[Float, Float, float]:
    """Accelerations of the angles that no motor prescribes, what a steady motion allows, and that of the largest force.

    slow : the slowest rate; a displacement by `CLOSE` rad is allowed. To it comes the rounding of forces, which are differences.
    """
    system, c, strains = lin.system, lin.basis, lin.strains
    roots = c[2:].reshape(lin.z.pi.shape)  # 1/sqrt(m): accelerations are pi'/sqrt(m)
    found = -(roots * system.back(c, lin.unbalanced)).ravel()[lin.free]
    largest = float(np.max(roots * system.back(np.abs(c), np.abs(lin.unbalanced))))
    places = np.abs(lin.z.hi - lin.z.hi.mean(axis=1, keepdims=True) * (np.arange(len(c)) > 1)[:, None])
    sizes = strains.stiffness * (abs(strains.matrix) @ places.ravel())
    rounding = 8 * EPS * roots * system.back(np.abs(c), (abs(strains.matrix).T @ sizes).reshape(c.shape))
    return found, CLOSE * max(largest, slow**2) + rounding.ravel()[lin.free], largest


def _balanced(lin: Linearised, slow: float, when: str = "in the state given") -> None:
    """Refuse a state in which discs accelerate."""
    acceleration, allowed, _ = accelerations(lin, slow)
    if (excess := np.abs(acceleration) - allowed).max(initial=0.0) > 0:
        worst = int(np.argmax(excess))
        disc, column = int(np.flatnonzero(lin.free)[worst]) % lin.system.n, int(np.flatnonzero(lin.free)[worst]) // lin.system.n
        raise ValueError(
            f"small motions are about an equilibrium or a steady motion; {when} the {('roll', 'turning')[column]} of disc {disc} "
            f"accelerates by {np.abs(acceleration[worst]):.3g} rad per time squared: {CURE}"
        )


def _alike(found: Steady) -> None:
    """Refuse a motion that is another after a part of it: by its loads, or as neighbours roll at different rates."""
    lin = found.equations
    system, v, q = lin.system, lin.velocity, lin.z.hi.copy()
    fastest = max(np.abs(v[:2]).max() / system.scale[0], np.abs(v[2:]).max())
    time, turn = 1 / fastest, found.turning / fastest
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    if found.turning:
        centre = (np.array([-found.drift[1], found.drift[0]]) / found.turning)[:, None]
        q[:2] = centre + rotation @ (q[:2] - centre)
    else:
        q[:2] += time * found.drift[:, None]
    q[2:] += time * v[2:]
    after = Linearised(lin.problem, Phase(q, np.zeros_like(q), lin.z.pi), lin.t)
    _balanced(after, found.slow, f"after {time:.3g} of time")
    both = [one.parts for one in (lin, after)]
    turned = scipy.sparse.block_diag([scipy.sparse.csr_array(rotation), scipy.sparse.eye_array(len(q) - 2)])
    turned = scipy.sparse.kron(turned, scipy.sparse.eye_array(system.n), format="csr")
    moved, own, push, drag = both[0]
    before = (turned @ moved @ turned.T, turned @ own, push @ turned.T, drag)
    for one, other in zip(before, both[1], strict=True):
        if abs(one - other).max() > CLOSE * max(abs(one).max(), abs(moved).max()):
            raise ValueError(
                "the motion is no steady one: along it the loads, or the closing of a ring, are others; small motions then have no "
                "rates of their own: take loads that do not depend on the place, or a state at rest"
            )


def described(state: Steady | Small) -> str:
    """The motion in words."""
    fastest = float(np.abs(state.velocity[2]).max())
    if not np.any(state.velocity):
        return "at rest"
    return f"in steady motion: u = ({state.drift[0]:.4g}, {state.drift[1]:.4g}), Omega = {state.turning:.4g}, omega = {fastest:.4g}"
