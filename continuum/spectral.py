r"""The rod whose sections roll along the centre line, by Galerkin's method with polynomials, or Fourier series on a closed rod.

Admissible velocities and variations are (e psi, psi). With r = x + i y, z = r' and e = i R z (field law) or i R z/|z| (unit law),
d'Alembert's principle reads, for every psi,

    int (alpha + rho |e|^2) omega. psi + rho omega Re(conj(e) e.) psi = - int K Re(conj(r'') (e psi)'') + beta theta' psi'.

The ends need care. A free end asks that r'' do no work on (e psi)', which is kappa psi' = 0: the tangential part of r'' is
*not* zero there. If e psi is replaced by the polynomial through its values at nodes (collocation), their slopes differ at the
end, the tangential part of r'' works on the difference, and all fields are wrong by the first order of the end spacing. Here
instead r moves by the projection P(e omega) that keeps int Re(conj(r'') f'') for every r'' it is made of: (P f)'' is the L2
projection of f'', and the two numbers that r'' does not know are the values of f at the ends (on a closed rod one, the mean). So

    r. = P (e omega),   theta. = omega,   pi = sqrt(w (alpha + rho |e|^2)) omega at nodes of weight w

is a skew-gradient system q. = C pi, pi. = - C^T grad V with V = int K |r''|^2/2 + beta theta'^2/2 quadratic, and Gauss methods
keep its energy. Unknown are the coefficients of r'' and the ends, so nothing but omega is differentiated and no digits are
lost. Integrals with e take 1.5 points a node, which is exact under the field law.

`solve_spectral` refines both. Functions are added in long steps, whose effect is the same on all and drops out of
differences: with d_j the change from m_{j-1} to m_j functions, an error that falls exponentially is d_j (d_j/d_{j-1})^r on m_j
functions, r = (m_j - m_{j-1})/(m_{j-1} - m_{j-2}). When that suffices the steps of "gauss8" are halved. (The corner
s = 0, t = 0, where the initial twist breaks a condition of the ends, leaves waves of wave number q and size q^-6 or less in
theta: in the end no method is faster than that.)
"""

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from continuum.bases import polynomials, waves
from continuum.rod import Scene
from discs import Gauss8, SimulationError, Solution
from discs.integrators.base import Work
from discs.simulation import steps_before
from discs.system import Phase, SkewGradient

SIZES = (19, 27, 37, 51, 71, 97, 135, 187, 259)  # functions; odd, as a series has one more cosine than sines
FEWEST = 16
MOST_STEPS = FEWEST * 2**10
NODES = 513  # of a solution; the splines through them are better than any tolerance that is reached
NEAR = 1e-3  # a slope below which the unit law has lost its heading
FIELDS = ("x", "y", "theta", "omega")
POSITIONS = FIELDS[:3]


class Frame:
    """C at a configuration (or several, with one more axis before): e (n,) and t = 1/sqrt(w (alpha + rho |e|^2)) at the nodes; e'',
    2 e', e (3, F) at the finer points."""

    def __init__(self, rod: "SpectralRod", e: NDArray, t: NDArray, finer: NDArray) -> None:
        self.e, self.t, self.finer, self._rod = e, t, finer, rod
        self._inverses: dict[complex, NDArray] = {}

    @cached_property
    def _stiffness(self) -> NDArray:
        """C^T (grad^2 V) C, (n, n)."""
        rod, n = self._rod, self.t.size
        moves = np.zeros((self.finer.shape[1] + n, n), complex)
        moves[:-n] = (self.finer[:, :, None] * rod.rates).sum(axis=0)
        moves[-n:] = np.diag(self.e)
        xy = (rod.basis.project @ moves.view(float)).reshape(n, n, 2)
        bent = np.einsum("kic,k,kjc->ij", xy, rod.bending, xy, optimize=True)
        return self.t[:, None] * (bent + rod.torsion) * self.t

    def inverse(self, g: complex) -> NDArray:
        """(I + g C^T (grad^2 V) C)^-1, kept for the next solve."""
        if g not in self._inverses:
            self._inverses[g] = np.linalg.inv(np.eye(self.t.size) + g * self._stiffness)
        return self._inverses[g]


class SpectralRod(SkewGradient):
    """The equations of motion of a scene on n functions.

    Rows x, y of a configuration are coefficients of the `basis`, row theta is its values at the nodes.
    """

    rows = ("x", "y", "theta")
    quadratic = True

    def __init__(self, scene: Scene, n: int) -> None:
        rod = scene.rod
        self.n, self._unit, self._radius = n, scene.rolling == "unit", rod.radius
        self.basis = (waves if scene.closed else polynomials)(n, rod.length)
        self.scale = np.array([rod.length, rod.length, 1.0])
        self.bending, self.torsion = rod.bending_stiffness * self.basis.bending, rod.torsion_stiffness * self.basis.torsion
        self.rates = self.basis.rates.reshape(3, -1, n)
        self._rates, self._bends, self._project = (
            np.ascontiguousarray(matrix.T) for matrix in (self.basis.rates, self.basis.bends, self.basis.project)
        )
        self._mass, self._spin = self.basis.w * rod.density, self.basis.w * rod.spin_inertia
        self._shift = complex(*scene.shift) / rod.length  # of a closed rod's line; z is the slope of the rest plus this

    def start(self, scene: Scene) -> Phase:
        """The initial state."""
        s = self.basis.s
        fields = scene.fields(s)
        a = self.basis.fit @ (fields["x"] + 1j * fields["y"] - self._shift * s)
        q = np.array([a.real, a.imag, fields["theta"]])
        return Phase(q, np.zeros_like(q), fields["omega"] / self.frame(q).t)

    def slopes(self, z: Phase) -> NDArray:
        """|r'| at the nodes, (n,)."""
        x, y = (z.hi + z.lo)[:2] @ self.basis.bends[: self.n].T
        return np.hypot(x + self._shift.real, y + self._shift.imag)

    def energy(self, z: Phase) -> float:
        """Kinetic and potential energy."""
        return 0.5 * float(z.pi @ z.pi) + self.potential(z.hi + z.lo)

    def at(self, z: Phase, s: NDArray) -> dict[str, NDArray]:
        """x, y, theta, omega at places s (S,), each (S,)."""
        q = z.hi + z.lo
        line, field = self.basis.line(s), self.basis.field(s)
        x, y = line @ q[0] + self._shift.real * s, line @ q[1] + self._shift.imag * s
        return {"x": x, "y": y, "theta": field @ q[2], "omega": field @ (self.frame(q).t * z.pi)}

    def slip(self, z: Phase) -> float:
        """Largest |r. - e omega| at the nodes: what the projection leaves of the constraint."""
        c = self.frame(z.hi + z.lo)
        rates = self.forward(c, z.pi)
        return float(np.abs(self.basis.line(self.basis.s) @ (rates[0] + 1j * rates[1]) - c.e * rates[2]).max())

    def shape(self, hi: NDArray, lo: NDArray | None = None) -> NDArray:
        return hi if lo is None else hi + lo

    def moved(self, shape: NDArray, dq: NDArray) -> NDArray:
        return shape + dq

    # All of these take several configurations at once, by leading axes

    def frame(self, shape: NDArray) -> Frame:
        xy = shape[..., :2, :] @ self._bends
        z = xy[..., 0, :] + 1j * xy[..., 1, :]
        n, f = self.n, self.basis.project.shape[1] - self.n
        at, slope, bend, bent = z[..., :n] + self._shift, z[..., n : n + f] + self._shift, z[..., n + f : -f], z[..., -f:]
        if self._unit:  # z/|z| = exp(i phi) with phi' = Im(z'/z)
            e, finer = at / np.abs(at), slope / np.abs(slope)
            log = bend / slope
            rate, turning = 1j * log.imag, 1j * (bent / slope - log * log).imag
            fine = np.stack([(turning + rate * rate) * finer, 2 * rate * finer, finer], axis=-2)
        else:
            e, fine = at, np.stack([bent, 2 * bend, slope], axis=-2)
        e = 1j * self._radius * e
        t = 1 / np.sqrt(self._spin + self._mass * (e.real**2 + e.imag**2))
        return Frame(self, e, t, 1j * self._radius * fine)

    def forward(self, c: Frame, p: NDArray) -> NDArray:
        omega = c.t * p
        rates = (omega @ self._rates).reshape(*omega.shape[:-1], 3, -1)
        moves = np.concatenate([(c.finer * rates).sum(axis=-2), c.e * omega], axis=-1)
        out = np.empty((*omega.shape[:-1], 3, self.n))
        out[..., 0, :], out[..., 1, :] = moves.real @ self._project, moves.imag @ self._project
        out[..., 2, :] = omega
        return out

    def back(self, c: Frame, g: NDArray) -> NDArray:
        pull = g[..., :2, :] @ self.basis.project
        pull = pull[..., 0, :] - 1j * pull[..., 1, :]
        fine = (c.finer * pull[..., None, : -self.n]).real
        return c.t * (fine.reshape(*g.shape[:-2], -1) @ self.basis.rates + (c.e * pull[..., -self.n :]).real + g[..., 2, :])

    def frames(self, shape: NDArray, moves: NDArray) -> Frame:
        return self.frame(shape + moves)

    def forwards(self, frames: Frame, p: NDArray) -> NDArray:
        return self.forward(frames, p)

    def forces(self, frames: Frame, shape: NDArray, moves: NDArray) -> NDArray:
        return self.back(frames, self.mean_force(shape + moves))

    def potential(self, shape: NDArray) -> float:
        return 0.5 * float(np.vdot(shape, self.mean_force(shape)))

    def secant(self, shape: NDArray, dq: NDArray) -> NDArray:
        return shape + 0.5 * dq

    def mean_force(self, secant: NDArray) -> NDArray:
        out = secant * self.bending
        out[..., 2, :] = secant[..., 2, :] @ self.torsion
        return out

    def solve(self, secant: NDArray, c: Frame, g: complex, rhs: NDArray) -> NDArray:
        return c.inverse(g) @ rhs


class Course:
    """Runs of a scene on n functions with a number of steps, kept for comparison.

    Parameters
    ----------
    times : (F,), when fields are compared and given.
    tolerance : of the sweeps of a step.
    """

    def __init__(self, scene: Scene, times: NDArray, tolerance: float, bar: tqdm) -> None:
        self._scene, self._times, self._bar = scene, times, bar
        self.tolerance, self._method = tolerance, Gauss8(tolerance=tolerance)
        length = scene.rod.length
        self.s = np.linspace(0, length, NODES) if not scene.closed else length / (NODES - 1) * np.arange(NODES - 1)
        self._found: dict[tuple[int, int], dict[str, Any]] = {}

    def run(self, n: int, steps: int) -> dict[str, Any]:
        """Fields (F, S), energy and slip (F,); SimulationError if the motion cannot go on, or not with these steps."""
        if (n, steps) not in self._found:
            self._bar.set_postfix(functions=n, steps=steps, refresh=False)
            self._bar.update()
            self._found[n, steps] = self._run(n, steps)
        return self._found[n, steps]

    def _run(self, n: int, steps: int) -> dict[str, Any]:
        rod = SpectralRod(self._scene, n)
        h, z, work = self._scene.duration / steps, rod.start(self._scene), Work()
        bound = 10 * rod.energy(z)
        rows: dict[str, list] = {}
        done = 0
        for time in self._times.tolist():
            last, rest = steps_before(time, h)
            for step in range(done + 1, last + 1):
                z = self._method.step(rod, z, h, work)
                self._check(rod, z, work, step, h, bound)
            done = last
            shown = self._method.step(rod, z, rest, work) if rest else z
            found = rod.at(shown, self.s) | {"energy": rod.energy(shown), "rolling_residual": rod.slip(shown)}
            for name, value in found.items():
                rows.setdefault(name, []).append(value)
        return {name: np.array(values) for name, values in rows.items()}

    def _check(self, rod: SpectralRod, z: Phase, work: Work, step: int, h: float, bound: float) -> None:
        """Stop where |r'| vanishes under the unit law, the sweeps of a step do not converge, or energy is not finite."""
        slopes = rod.slopes(z)
        node = int(np.argmin(slopes))
        if self._scene.rolling == "unit" and not slopes[node] > NEAR:
            raise SimulationError(
                "the rod lost its heading: r' = 0, and rolling='unit' has no direction there", step, step * h, node
            )
        if work.unconverged or not rod.energy(z) <= bound:
            raise SimulationError("steps do not converge: the motion is too fast for them", step, step * h, node)

    def effect(self, n: int, steps: int) -> dict[str, float]:
        """Of the steps on n functions: a quarter of what half as many change. (High waves keep the order of the fall near 2.5.)"""
        return {name: d / 4 for name, d in distances(self.run(n, steps), self.run(n, steps // 2)).items()}


def distances(a: dict[str, NDArray], b: dict[str, NDArray]) -> dict[str, float]:
    """Largest difference of each field."""
    return {name: float(np.abs(a[name] - b[name]).max()) for name in FIELDS}


def worst(errors: dict[str, float]) -> float:
    """The largest error of positions and angles."""
    return max(errors[name] for name in POSITIONS)


def possible_steps(course: Course, sizes: tuple[int, ...], steps: int) -> int:
    """So many steps, or twice, four times, ... as many, that the motion can be followed on these numbers of functions."""
    last = None
    while steps <= MOST_STEPS:
        try:
            for n in sizes:
                course.run(n, steps)
            return steps
        except SimulationError as error:
            if last and error.message == last.message and abs(error.time - last.time) < 0.02 * last.time:
                raise  # twice as many steps end there too
            last = error
        steps *= 2
    raise _too_fast()


def enough_steps(course: Course, n: int, steps: int, tol: float) -> int:
    """So many steps, or twice, four times, ... as many, that their effect on n functions is below three tenths of tol."""
    while steps <= MOST_STEPS:
        if worst(course.effect(n, steps)) <= 0.3 * tol:
            return steps
        steps *= 2
    raise _too_fast()


def _too_fast() -> ValueError:
    return ValueError(
        f"tol is not reached in {MOST_STEPS} time steps: the motion is too sensitive or too fast; "
        "ask for a larger tol or a shorter duration"
    )


def solve_spectral(scene: Scene, tol: float, times: NDArray, progress: bool) -> Solution:
    """The fields of a scene with slaved headings at `times` (F,); see `continuum.solve`."""
    with (
        tqdm(desc=f"field to {tol:g}", unit="run", delay=1, disable=not progress) as bar,
        np.errstate(over="ignore", invalid="ignore", divide="ignore"),
    ):
        course = Course(scene, times, min(1e-8, 1e-3 * tol), bar)
        steps, change = FEWEST, np.inf
        for fewest, fewer, n in zip((0, *SIZES), SIZES, SIZES[1:], strict=False):
            steps = possible_steps(course, (fewer, n), steps)
            changes = distances(course.run(n, steps), course.run(fewer, steps))
            fall = min(0.8, (worst(changes) / change) ** ((n - fewer) / (fewer - fewest))) if change > 0 else 0.8
            change = worst(changes)
            space = {name: d * fall for name, d in changes.items()}
            if not fewest or worst(space) > 0.7 * tol:
                continue
            steps = enough_steps(course, n, 2 * steps, tol)
            time, found = course.effect(n, steps), course.run(n, steps)
            rest = course.tolerance * scene.rod.length  # of the sweeps
            estimate = {name: space[name] + time[name] + rest for name in FIELDS}
            stats = {"method": "spectral", "order": None, "functions": n, "dt": scene.duration / steps, "steps": steps}
            return Solution(t=times, s=course.s, error_estimate=estimate, stats=stats, **found)
    raise ValueError(
        f"tol = {tol:g} is not reached on {n} functions, where the estimated error is {worst(space):.1e}; ask for a larger tol"
    )
