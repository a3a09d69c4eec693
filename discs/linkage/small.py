r"""Small motions of a linkage about equilibria and steady motions, from its linearised equations.

With residuals rho(q, w, w', n) of `Equations.balance`, d w' and d n follow from d q and d w by

    (d rho/d(w', n)) (d w', d n) = -(d rho/d(q, w)) (d q, d w),

where rigid links enter by gap'' = 0. All derivatives are exact (complex step). A rigid row lets d gap grow like t, which the
links do not: two zero eigenvalues for each, left out of the count. In axes that turn with the motion, dq' and dw' lose Omega J dq
and Omega J dw.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from discs.arrays import Array, Bool, Complex, Float
from discs.linkage import starting
from discs.linkage.equations import Equations, columns
from discs.linkage.linkage import LinkageState
from discs.linkage.problem import LinkageProblem

CLOSE = 1e-6  # relative; a state that is less steady than this is refused


@dataclass(frozen=True, eq=False)
class Small:
    """The linearised equations of a linkage about a steady motion.

    Attributes
    ----------
    problem : with the state as its initial one. q, w : its coordinates (4, n) and velocities (3, n).
    drift, turning : the velocity u at the origin, (2,), and the rate Omega of the rigid motion.
    """

    problem: LinkageProblem
    q: Float
    w: Float
    drift: Float
    turning: float

    @property
    def of(self) -> Equations:
        """The equations of motion."""
        return self.problem.equations

    @property
    def velocity(self) -> Float:
        """q', (4, n)."""
        return self.of.forward(self.q[3], self.w)

    @property
    def scale(self) -> Float:
        """Units of the coordinates, (4,)."""
        length = self.problem.linkage.length
        return np.array([length, length, 1.0, 1.0])

    @property
    def slow(self) -> float:
        """A guess of the slowest rate: the eigenvalue above the widest gap between sizes, below which rounding splits zeros."""
        sizes = np.sort(np.abs(np.linalg.eigvals(self.matrix)))
        sizes = np.maximum(sizes, 1e-12 * sizes[-1])
        return float(sizes[1 + np.argmax(sizes[1:] / sizes[:-1])])

    @cached_property
    def kept(self) -> Bool:
        """Which of (q, w), (7 n,), are unknowns: neither held, nor the roll of a node without a wheel."""
        of = self.of
        places = np.array([of.wheel | ~of.fixed[0], of.wheel | ~of.fixed[1], of.wheel, ~of.fixed[2]])
        return np.concatenate([places.ravel(), ~of.fixed.ravel()])

    @property
    def extra(self) -> int:
        """Zero eigenvalues that belong to changes which rigid links do not allow."""
        return 2 * int((self.of.compliance == 0).sum())

    @cached_property
    def matrix(self) -> Float:
        """The matrix of the linearised equations in axes that move along, for the unknowns `kept`."""
        of, n = self.of, self.of.n
        change, stress = starting.response(of, self.q, self.w, 0.0)
        rest, at = of.of.rest(0.0), of.pack(change, stress)

        def residual(y: Array, forces: Array) -> Array:
            q, w = y[..., : 4 * n].reshape(*y.shape[:-1], 4, n), y[..., 4 * n :].reshape(*y.shape[:-1], 3, n)
            both: Array = of.pack(*of.balance(q, w, *of.unpack(forces), rest))
            return both

        def moved(y: Array) -> Array:
            q, w = y[..., : 4 * n].reshape(*y.shape[:-1], 4, n), y[..., 4 * n :].reshape(*y.shape[:-1], 3, n)
            v: Array = of.forward(q[..., 3, :], w)
            return v.reshape(*y.shape[:-1], 4 * n)

        y, seeds = np.concatenate([self.q.ravel(), self.w.ravel()]), np.eye(7 * n)[self.kept]
        by_state = columns(lambda z: residual(z, np.broadcast_to(at, (len(z), at.size))), y, seeds)
        by_force = columns(lambda z: residual(np.broadcast_to(y, (len(z), y.size)), z), at, np.eye(of.size))
        accelerations = of.unpack(-np.linalg.solve(by_force.T, by_state.T).T)[0]
        found = np.concatenate([columns(moved, y, seeds), accelerations.reshape(-1, 3 * n)], axis=1)
        turned = np.zeros((7, n, 7, n))
        for x, nodes in ((0, np.ones(n, dtype=bool)), (4, ~of.wheel)):
            turned[x + 1, nodes, x, nodes] = self.turning
            turned[x, nodes, x + 1, nodes] = -self.turning
        matrix: Float = (found - (turned.reshape(7 * n, 7 * n) @ seeds.T).T)[:, self.kept].T
        return matrix

    def symmetries(self) -> tuple[str, ...]:
        """Not looked for: clamps and loads decide which displacements leave a linkage as it is."""
        return ()

    def positions(self, vectors: Complex) -> Complex:
        """Displacements (count, 4, n) from vectors of unknowns, as columns."""
        whole = np.zeros((self.kept.size, vectors.shape[1]), dtype=complex)
        whole[self.kept] = vectors
        return np.ascontiguousarray(whole[: 4 * self.of.n].T).reshape(-1, 4, self.of.n)

    def displaced(self, change: Complex, rate: complex) -> LinkageState:
        """The state displaced by the real part of `change` (4, n), with its rates; moved back onto rigid links."""
        rates = self.velocity + (rate * change).real
        x, y, theta, phi = self.q + change.real
        return starting.nearest(self.problem.linkage, LinkageState(x, y, phi, theta, rates[0], rates[1], rates[3]))


def steady(problem: LinkageProblem, at: LinkageState | None = None) -> Small:
    """The linearised equations about a steady motion; ValueError, with the reason, for a state whose motion is not steady."""
    problem = problem if at is None else replace(problem, initial=at)
    of, (q, w) = problem.equations, problem.start()
    times = np.linspace(0.0, problem.duration, 7)
    rests = np.array([problem.linkage.rest(t) for t in times])
    if np.ptp(rests, axis=0).max() > CLOSE * np.abs(rests).max():
        raise ValueError("rest_curvature depends on t: small motions about a state need constant ones")
    v, n, length = of.forward(q[3], w), of.n, problem.linkage.length
    one, none = np.ones(n), np.zeros(n)
    moves = [[one, none, -q[1]], [none, one, q[0]], [none, none, length * one]]
    matrix = np.concatenate([np.stack(rows, axis=1) for rows in moves])
    given = np.concatenate([v[0], v[1], length * v[3]])
    fit = np.linalg.lstsq(matrix, given, rcond=None)[0]
    off, fastest = np.abs(matrix @ fit - given), np.abs(given).max()
    if off.max() > CLOSE * fastest:
        node = int(np.argmax(off)) % n
        raise ValueError(
            "small motions are about an equilibrium or a steady motion, in which the linkage moves as a rigid body; in the state "
            f"given node {node} moves {off.max():.3g} per time away from that"
        )
    if abs(fit[2]) * length <= CLOSE * fastest:
        fit[2] = 0.0
    if fit[2] and of.load.any():
        raise ValueError("the motion is no steady one: it turns, and dead loads do not; take them out, or a state without turning")
    change = starting.response(of, q, w, 0.0)[0]
    expected = np.where(of.wheel, 0.0, fit[2] * np.array([-w[1], w[0], 0 * w[2]]))
    off = np.abs(change - expected)
    largest = max(float(np.abs(off).max()), 1e-300)
    slowest = (fastest / length) ** 2 + problem.duration**-2
    if largest > CLOSE * length * slowest and largest > CLOSE * _strongest(of, q, w):
        row, node = divmod(int(np.argmax(off)), n)
        raise ValueError(
            f"small motions are about an equilibrium or a steady motion; in the state given {of.names[row * n + node]} accelerates "
            f"by {largest:.3g} per time squared"
        )
    return Small(problem, q, w, np.asarray(fit[:2]), float(fit[2]))


def _strongest(of: Equations, q: Float, w: Float) -> float:
    """The largest acceleration that the forces of one link alone would make."""
    stress = starting.response(of, q, w, 0.0)[1]
    mass = np.where(of.inertia > 0, of.inertia, np.inf).min()
    return float(np.abs(stress).max(initial=0.0) / mass) if np.isfinite(mass) else 0.0
