r"""Discs that may slide: the ground as viscous slip.

Instead of the constraint r. = e omega the ground resists sliding, per length of the rod,

    lambda = -(r. - e omega)/epsilon,        epsilon > 0: length**2 per force and time,

so that, for disc i with its share w of the length, u = r. - e omega and free x, y, theta,

    rho w r.. = -grad_r V - w u/epsilon,    alpha w theta.. = -grad_theta V + w e . u/epsilon,

and the energy falls by w |u|**2/epsilon. For epsilon -> 0 these are the equations of rolling discs, with lambda as their multiplier
(realisation of nonholonomic constraints by viscous friction: Brendelev 1981, Karapetian 1981).

The equations are stiff, with rates 1/(rho epsilon) and those of the bending waves: SciPy's Radau with the exact sparse Jacobian.
The discs start without slip.
"""

import time as clock
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.chains import stencils
from discs.chains.chain import Chain
from discs.chains.slaved import SlavedSystem
from discs.problem import Problem
from discs.running.failure import SimulationError
from discs.running.frames import frame_times
from discs.solution import Solution


def slide(problem: Problem, epsilon: float, frames: int | ArrayLike = 101, rtol: float = 1e-7) -> Solution:
    """The motion of discs on ground with viscous slip.

    Parameters
    ----------
    problem : discs whose headings follow the line, with quadratic springs and without loads.
    epsilon : slip, length**2 per force and time. frames : their number or times, as for `simulate`. rtol : SciPy's tolerance.

    Returns
    -------
    Solution with velocities, slopes and the ground's forces; `dissipated` is what sliding took, `rolling_residual` the largest
    slip.

    Raises
    ------
    ValueError : for other discs, for loads, and for bad numbers. SimulationError : if the solver gives up.
    """
    chain = problem.chain
    if not isinstance(chain, Chain) or not problem.system.quadratic or problem.loads:
        need = "slide takes discs whose headings follow the line, with linear curvature and without loads"
        cure = "take replace(problem, loads=())" if problem.loads else 'take a Chain with curvature="linear"'
        raise ValueError(f"{need}; got {checks.shown(problem.loads or chain)}: {cure}")
    epsilon, rtol = checks.number("epsilon", epsilon, positive=True), checks.number("rtol", rtol, positive=True)
    times, started = frame_times(frames, problem.duration), clock.perf_counter()
    ground, n = Ground(problem, epsilon), chain.n
    start = problem.initial
    q = np.array([start.x, start.y, start.theta], dtype=float)
    omega = np.zeros(n) + np.asarray(start.omega)
    state = np.concatenate([q.ravel(), *(ground.arm(q)[0] * omega), omega, [0.0]])
    with np.errstate(over="ignore", invalid="ignore"):
        found = scipy.integrate.solve_ivp(
            ground.rates, (0.0, problem.duration), state, "Radau", times, rtol=rtol, atol=1e-2 * rtol, jac=ground.jacobian
        )
    if not found.success or not np.isfinite(found.y).all():
        raise SimulationError(f"sliding discs: {found.message}", found.t.size, float(found.t[-1]) if found.t.size else 0.0, 0)
    q, v, took = found.y[: 3 * n].T.reshape(-1, 3, n), found.y[3 * n : 6 * n].T.reshape(-1, 3, n), found.y[-1]
    system = problem.system
    slips = np.array([w[:2] - ground.arm(p)[0] * w[2] for p, w in zip(q, v, strict=True)])
    slope = np.array([system.slope(system.shape(p)) for p in q])
    energy = np.array([system.kinetic(w) + system.potential(system.shape(p)) for p, w in zip(q, v, strict=True)])
    return Solution(
        t=times,
        s=chain.s,
        x=q[:, 0],
        y=q[:, 1],
        theta=q[:, 2],
        omega=v[:, 2],
        x_rate=v[:, 0],
        y_rate=v[:, 1],
        slope_x=slope[:, 0],
        slope_y=slope[:, 1],
        contact_force=-chain.w / epsilon * slips,
        energy=energy,
        balance=np.stack([0 * took, took], axis=1),
        rolling_residual=np.hypot(slips[:, 0], slips[:, 1]).max(axis=1),
        stats={
            "method": "Radau",
            "order": 5,
            "settings": f"slide(epsilon={epsilon!r}, rtol={rtol!r})",
            "engine": "plain",
            "gradients": int(found.nfev),
            "seconds": clock.perf_counter() - started,
        },
        problem=problem,
    )


class Ground:
    """The rates of (x, y, theta, their rates, dissipated energy), (6 n + 1,), and their sparse Jacobian."""

    def __init__(self, problem: Problem, epsilon: float) -> None:
        system, chain = problem.system, problem.chain
        assert isinstance(system, SlavedSystem)
        assert isinstance(chain, Chain)
        self._system, self._chain, self._n = system, chain, chain.n
        self._law, self._radius, self._drag = chain.rolling_law, np.zeros(chain.n) + np.asarray(chain.radius), chain.w / epsilon
        self._stiffness = stiffness(problem)
        slopes = stencils.slopes(stencils.links(np.eye(chain.n), chain.ends), chain.k, chain.ends).T
        self._slopes = scipy.sparse.csr_array(slopes)

    def arm(self, q: Float) -> tuple[Float, Float]:
        """e and r' at positions (3, n), both (2, n)."""
        slope = self._system.slope(self._system.shape(q))
        arm = self._law.arm(self._radius, slope)
        return np.array([-slope[1] * arm, slope[0] * arm]), slope

    def rates(self, t: float, y: Float) -> Float:
        """dy/dt."""
        n = self._n
        q, v = y[: 3 * n].reshape(3, n), y[3 * n : 6 * n].reshape(3, n)
        e, _ = self.arm(q)
        slip = v[:2] - e * v[2]
        force = -self._system.gradient(self._system.shape(q))
        force[:2] -= self._drag * slip
        force[2] += self._drag * (e * slip).sum(axis=0)
        lost = float(self._drag @ (slip**2).sum(axis=0))
        return np.concatenate([y[3 * n : 6 * n], (force / self._system.weights).ravel(), [lost]])

    def jacobian(self, t: float, y: Float) -> Any:
        """d(rates)/dy, sparse."""
        n, diag = self._n, scipy.sparse.diags_array
        q, v = y[: 3 * n].reshape(3, n), y[3 * n : 6 * n].reshape(3, n)
        e, slope = self.arm(q)
        c, omega, slip = self._drag, v[2], v[:2] - e * v[2]
        unit = np.eye(2)[:, :, None] + np.zeros(n)
        turns = [self._radius * self._law.rate(slope, unit[j]) for j in range(2)]  # of R h with r'_x, r'_y
        arms = [[diag(-h[1]) @ self._slopes, diag(h[0]) @ self._slopes] for h in turns]  # d e_i/d r_j = arms[j][i]
        none = scipy.sparse.csr_array((n, n))
        by_place = [[diag(c * omega) @ arms[j][i] for j in range(2)] + [none] for i in range(2)]
        across = [sum(diag(c * (slip[i] - e[i] * omega)) @ arms[j][i] for i in range(2)) for j in range(2)]
        of_place = scipy.sparse.block_array([*by_place, [*across, none]]) - self._stiffness
        square = (e * e).sum(axis=0)
        of_rate = scipy.sparse.block_array(
            [
                [diag(-c), None, diag(c * e[0])],
                [None, diag(-c), diag(c * e[1])],
                [diag(c * e[0]), diag(c * e[1]), diag(-c * square)],
            ]
        )
        inverse = diag(1 / self._system.weights.ravel())
        last = scipy.sparse.csr_array(
            (1, 1)
        )  # the dissipated energy follows, and its own gradient does not matter for Newton's method
        return scipy.sparse.block_diag(
            [scipy.sparse.block_array([[None, scipy.sparse.eye_array(3 * n)], [inverse @ of_place, inverse @ of_rate]]), last],
            "csc",
        )


def stiffness(problem: Problem) -> Any:
    """grad^2 V of quadratic springs for x, y and theta, sparse (3 n, 3 n)."""
    chain = problem.chain
    assert isinstance(chain, Chain)
    of_line, of_roll = chain.link_law(chain).hessians()  # type: ignore[attr-defined]  # linear springs have them
    return scipy.sparse.block_diag([of_line, of_line, of_roll], "csr")
