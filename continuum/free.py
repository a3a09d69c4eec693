r"""The free rod: the planar Cosserat rod before it rolls, inextensible, (freeFE) and (constrinext).

    rho r.. + K r'''' = (p r')',   alpha theta.. = beta theta'',   |r'| = 1;

the tension p is the multiplier of |r'| = 1. Free ends: p r' - K r''' = 0 and r'' = theta' = 0, hence also p = K r''' . r' = 0.

**In s.** Nodes of share w, links d = r_{i+1} - r_i = (L r)_i, each with the length l that it has at the start, k up to the k^2
of a chord. The Lagrangian (roddensity) becomes

    sum_nodes w (rho |v|^2 + alpha omega^2)/2 - r.S r/2 - theta.S_t theta/2 - sum_links k p/2 (|d|^2 - l^2)/k^2,

S and S_t of plain springs, whose ends are natural here. With M = rho w and the force L^T (p d/k) of the tension,

    M r.. = -S r - L^T (p d/k),   |d| = l,   and d.L r.. + |L v|^2 = 0 gives p, one tridiagonal system:

    d . L M^{-1} L^T (p d/k) = |L v|^2 - d . L M^{-1} S r.                                                                 (tension)

**In t.** The variational integrator of L_h = h T(u/h) - h V((r_n + r_{n+1})/2), u = r_{n+1} - r_n, under the constraint at every
step: the midpoint rule in bending, RATTLE in the constraint,

    M u/h = M v_n - h/2 S (r_n + u/2) - L^T (mu d_n)/h,               |L (r_n + u)| = l,
    M v_{n+1} = M u/h - h/2 S (r_n + u/2) - L^T (nu d_{n+1}),         d_{n+1} . L v_{n+1} = 0.

Newton's method on the first line, in u and mu at once, is banded; nu is tridiagonal. The step is symplectic and reversible, of
order 2, and bending does not limit it. Momentum and angular momentum are kept to rounding, as L_h has their symmetries, and so
are the lengths, which are solved for; the energy swings by O(h^2) without drift, and is exact for theta and for small waves.
"""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, solve_banded
from tqdm import tqdm

from continuum.rod import Rod
from discs import Chain, SimulationError, Solution, checks, stencils
from discs.simulation import frame_times
from discs.springs import LinearCurvature
from discs.system import folded

Given = Callable[[NDArray], ArrayLike] | ArrayLike
MOST_SWEEPS = 30


class Banded:
    """Solves systems whose entries stand at fixed places, few places from the diagonal in a given order of the unknowns."""

    def __init__(self, places: list[tuple[NDArray, NDArray]], order: NDArray) -> None:
        place = np.argsort(order)
        row, column = (place[np.concatenate(index)] for index in zip(*places, strict=True))
        self._width, self._order, self._back = int(abs(row - column).max()), order, place
        self._slots = (self._width + row - column) * order.size + column

    def __call__(self, entries: NDArray, right: NDArray) -> NDArray:
        """The solution, (size,). Entries at one place add up."""
        shape = 2 * self._width + 1, right.size
        matrix = np.bincount(self._slots, entries, shape[0] * shape[1]).reshape(shape)
        both = self._width, self._width
        return solve_banded(both, matrix, right[self._order], overwrite_ab=True, check_finite=False)[self._back]


class FreeRod:
    """The semidiscrete free rod and its step. Places and velocities are (2, n), tensions (n_links,).

    Parameters
    ----------
    chain : plain springs or a ring; its rolling and its radius do not matter.
    """

    def __init__(self, chain: Chain) -> None:
        n, self._ends, self._k = chain.n, chain.ends, chain.k
        here = np.arange(n - (chain.ends != "ring"))  # links: the i-th joins nodes i and i + 1
        self._mass, self._spin = chain.w * np.asarray(chain.density), chain.w * np.asarray(chain.spin_inertia)
        self._first, self._second = here, (here + 1) % n
        self._springs = LinearCurvature(chain)
        bending, torsion = self._springs.hessians()
        order = folded(n) if chain.ends == "ring" else np.arange(n)
        # Newton's unknowns (x, y, mu), those of a node and its link beside each other
        bends, nodes = sp.coo_array(bending), np.arange(2 * n)
        self._bends = np.tile(bends.data, 2)
        tips = [(2 * n + here, tip + a * n) for a in (0, 1) for tip in (self._first, self._second)]
        places = [(bends.row + a * n, bends.col + a * n) for a in (0, 1)] + [(nodes, nodes)]
        places += [(node, link) for link, node in tips] + tips
        stacked = (order[:, None] + n * np.arange(3)).ravel()
        self._newton = Banded(places, stacked[stacked < 2 * n + here.size])
        # L M^{-1} L^T couples a link with the next one, which starts where it ends
        self._pairs = a, b = (here, (here + 1) % n) if chain.ends == "ring" else (here[:-1], here[1:])
        self._triangle = Banded([(here, here), (a, b), (b, a)], order[order < here.size])
        twists, nodes = sp.coo_array(torsion), np.arange(n)
        self._twists = twists.data
        self._roll = Banded([(twists.row, twists.col), (nodes, nodes)], order)

    def links(self, values: NDArray) -> NDArray:
        """L, differences of neighbours, (..., n_links)."""
        return stencils.links(values, self._ends)

    def pull(self, d: NDArray, multiplier: NDArray) -> NDArray:
        """L^T (multiplier d), (2, n)."""
        return stencils.pull(multiplier * d, self._ends)

    def gradient(self, x: NDArray, y: NDArray, theta: NDArray) -> NDArray:
        """S r and S_t theta, rows (3, n)."""
        return stencils.pull(self._springs.tension(self.links(np.array([x, y, theta]))), self._ends)

    def bent(self, r: NDArray) -> NDArray:
        """S r, (2, n)."""
        return self.gradient(r[0], r[1], np.zeros_like(r[0]))[:2]

    def _constrain(self, d: NDArray, right: NDArray) -> NDArray:
        """The multiplier of d . L M^{-1} L^T (multiplier d) = right."""
        a, b = self._pairs
        own = (d * d).sum(axis=0) * (1 / self._mass[self._first] + 1 / self._mass[self._second])
        next_ = -(d[:, a] * d[:, b]).sum(axis=0) / self._mass[self._second[a]]
        return self._triangle(np.concatenate([own, next_, next_]), right)

    def admissible(self, r: NDArray, v: NDArray) -> NDArray:
        """The velocity nearest to v, weighed by mass, that changes no link's length."""
        d = self.links(r)
        return v - self.pull(d, self._constrain(d, (d * self.links(v)).sum(axis=0))) / self._mass

    def tension(self, r: NDArray, v: NDArray) -> NDArray:
        """(tension): p in the links, (n_links,)."""
        d, rate = self.links(r), self.links(v)
        push = self.links(self.bent(r) / self._mass)
        return self._k * self._constrain(d, (rate * rate).sum(axis=0) - (d * push).sum(axis=0))

    def energy(self, r: NDArray, v: NDArray, theta: NDArray, omega: NDArray) -> float:
        """Kinetic and potential energy."""
        kinetic = (self._mass * v**2).sum() + self._spin @ omega**2
        return 0.5 * float(kinetic) + self._springs.potential(self.links(np.array([*r, theta])))

    def step(self, r: NDArray, v: NDArray, h: float, length: NDArray) -> tuple[NDArray, NDArray]:
        """Places and velocities after a step h; LinAlgError if Newton's method does not converge."""
        n, d, bent = r.shape[1], self.links(r), self.bent(r)
        u, mu = h * v, np.zeros(length.size)
        for _ in range(MOST_SWEEPS):
            after = d + self.links(u)
            push = self._mass * (u - h * v) + 0.5 * h * h * (bent + 0.5 * self.bent(u)) + self.pull(d, mu)
            stretch = 0.5 * ((after * after).sum(axis=0) - length**2)
            tips = [sign * row for links in (d, after) for row in links for sign in (-1, 1)]
            entries = [0.25 * h * h * self._bends, np.tile(self._mass, 2), *tips]
            change = self._newton(np.concatenate(entries), -np.concatenate([push.ravel(), stretch]))
            u, mu = u + change[: 2 * n].reshape(2, n), mu + change[2 * n :]
            if np.abs(change[: 2 * n]).max() <= 1e-9 * self._k:  # the next change would be its square
                moved = r + u
                return moved, self.admissible(moved, u / h - 0.5 * h * (bent + 0.5 * self.bent(u)) / self._mass)
        raise LinAlgError("Newton's method does not converge")

    def twist(self, theta: NDArray, omega: NDArray, h: float) -> tuple[NDArray, NDArray]:
        """theta and omega after a step h of the midpoint rule, which owes nothing to the centre line."""
        still, entries = np.zeros_like(theta), np.concatenate([0.25 * h * h * self._twists, self._spin])
        mean = self._roll(entries, self._spin * omega - 0.5 * h * self.gradient(still, still, theta)[2])
        return theta + h * mean, 2 * mean - omega


def free_rod(
    rod: Rod,
    r0: Given,
    v0: Given,
    theta0: Given,
    omega0: Given,
    duration: float,
    n: int,
    dt: float,
    closed: bool = False,
    frames: int | ArrayLike = 101,
    progress: bool = True,
) -> Solution:
    """The motion of the free inextensible rod, on n nodes.

    Parameters
    ----------
    rod : the rod; its radius does not matter, as nothing rolls. Linear curvature, which is the true one while |r'| = 1.
    r0, v0 : places and velocities of the centre line with |r0'| = 1 and r0' . v0' = 0: functions of s (n,) that return (2, n), or
        (2, n).
    theta0, omega0 : torsion and its rate, functions of s that return (n,), or (n,), or a number.
    duration : time to move, > 0.
    n : nodes, at least 3, both ends counted; at least 5 around a ring.
    dt : time step, > 0. Bending does not limit it; accuracy asks for a part of the shortest period that matters.
    closed : a ring rather than free ends.
    frames : how many frames, equally spaced, or their times. One between two steps is reached by a shorter step of its own.
    progress : show progress on anything that takes over a second.

    Returns
    -------
    Solution with x_rate, y_rate and `tension`, p in the links, (F, n - 1), or (F, n) around a ring.

    Raises
    ------
    ValueError : for bad input, a centre line or velocity that stretches the rod.
    SimulationError : when a step cannot be solved: it turns links by too much; take a smaller one.
    """
    if not isinstance(rod, Rod) or rod.curvature != "linear":
        raise ValueError(f"free_rod needs a Rod with curvature='linear'; got {rod!r}")
    if not rod.spin_inertia:
        raise ValueError("the free rod needs a positive spin_inertia: without rolling, theta has no other inertia; got 0")
    if not isinstance(closed, bool):
        raise ValueError(f"closed must be True or False; got {closed!r}")
    names = ("length", "density", "spin_inertia", "torsion_stiffness", "bending_stiffness")
    chain = Chain(n=n, radius=0.0, ends="ring" if closed else "springs", **{name: getattr(rod, name) for name in names})
    system, duration = FreeRod(chain), checks.number("duration", duration, positive=True)
    h, times = checks.number("dt", dt, positive=True), frame_times(frames, duration)
    r, v = _values("r0", r0, chain.s, 2), _values("v0", v0, chain.s, 2)
    theta, omega = _values("theta0", theta0, chain.s, 1)[0], _values("omega0", omega0, chain.s, 1)[0]
    length = _unstretched(system, chain.k, r, v)
    v = system.admissible(r, v)

    def moved(state: tuple[NDArray, ...], h: float) -> tuple[NDArray, ...]:
        r, v, theta, omega = state
        return *system.step(r, v, h, length), *system.twist(theta, omega, h)

    found: list[tuple[NDArray, ...]] = []
    state: tuple[NDArray, ...] = r, v, theta, omega
    step = 0
    with tqdm(total=int(times[-1] / h), desc="free rod", unit="step", delay=1, disable=not progress) as bar:
        try:
            for time in times:
                while (step + 1) * h <= time * (1 + 1e-12):
                    state, step = moved(state, h), step + 1
                    bar.update()
                rest = time - step * h
                found.append(moved(state, rest) if rest > 1e-9 * h else state)
        except LinAlgError as error:
            fastest = int(np.argmax(np.hypot(*state[1])))
            raise SimulationError(f"{error}; take a smaller dt than {h:g}", step, step * h, fastest) from None
    r, v, theta, omega = (np.array([z[i] for z in found]) for i in range(4))
    return Solution(
        t=times,
        s=chain.s,
        x=r[:, 0],
        y=r[:, 1],
        theta=theta,
        omega=omega,
        x_rate=v[:, 0],
        y_rate=v[:, 1],
        tension=np.array([system.tension(z[0], z[1]) for z in found]),
        energy=np.array([system.energy(*z) for z in found]),
        stats={"method": "midpoint and RATTLE", "order": 2, "dt": h, "steps": step},
    )


def _values(name: str, given: Given, s: NDArray, rows: int) -> NDArray:
    """Initial values, (rows, n), from a function of s or themselves."""
    values = given(s) if callable(given) else given
    if rows == 1:
        return checks.field(name, values, s.size)[None]
    if np.shape(values) != (rows, s.size):
        raise ValueError(f"{name} must give x and y, an array of shape {(rows, s.size)}; got shape {np.shape(values)}")
    return np.array([checks.field(name, row, s.size) for row in np.asarray(values)])


def _unstretched(system: FreeRod, k: float, r: NDArray, v: NDArray) -> NDArray:
    """The lengths of the links; ValueError if |r'| = 1 and r'.v' = 0 fail by more than twice what nodes of a smooth line leave.

    The chord of an arc that turns by psi lacks psi^2/24 of it. Over a link r'.v' misses k^2 r''.v''/12, the product of the changes
    of r' and of v' over it.
    """
    d, rate = system.links(r) / k, system.links(v) / k
    length = np.hypot(d[0], d[1])

    def change(links: NDArray) -> float:
        return float(np.hypot(*np.diff(links, axis=1)).max())

    worst = int(np.argmax(np.abs(length - 1)))
    if abs(length[worst] - 1) > change(d) ** 2 / 12 + 1e-6:
        raise ValueError(f"r0 must have |r0'| = 1; got {length[worst]:.6g} between nodes {worst} and {worst + 1}")
    stretch = np.abs((d * rate).sum(axis=0))
    worst = int(np.argmax(stretch))
    if stretch[worst] > change(d) * change(rate) / 6 + 1e-6 * np.abs(rate).max():
        raise ValueError(
            f"v0 must not stretch the rod, r0'.v0' = 0; got {stretch[worst]:.3g} between nodes {worst} and {worst + 1}"
        )
    return k * length
