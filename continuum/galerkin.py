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
"""

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuum.bases import polynomials, waves
from continuum.rod import Scene
from discs.system import Phase, SkewGradient

NEAR = 1e-3  # a slope below which the unit law has lost its heading


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
        self.near = NEAR if self._unit else -1.0

    @cached_property
    def kernel(self) -> Any:
        """The parameters for the compiled form of steps."""
        from continuum.kernels.spectral import Spectral

        return Spectral(
            bends=self._bends,
            rates=self._rates,
            back=np.ascontiguousarray(self.basis.rates),
            project=self._project,
            pull=np.ascontiguousarray(self.basis.project),
            bending=self.bending,
            torsion=self.torsion,
            mass=self._mass,
            spin=self._spin,
            scale=self.scale,
            shift=self._shift,
            radius=float(self._radius),
            near=self.near,
            unit=self._unit,
        )

    def start(self, scene: Scene) -> Phase:
        """The initial state."""
        s = self.basis.s
        fields = scene.fields(s)
        a = self.basis.fit @ (fields["x"] + 1j * fields["y"] - self._shift * s)
        q = np.array([a.real, a.imag, fields["theta"]])
        return Phase(q, np.zeros_like(q), fields["omega"] / self.frame(q).t)

    def slopes(self, z: Phase, h: float = 0.0) -> NDArray:
        """|r'| at the nodes, (n,); the least of it on the straight way that their velocities lead in a time h."""
        q, bends = z.hi + z.lo, self.basis.bends[: self.n].T
        x, y = q[:2] @ bends
        now = x + self._shift.real + 1j * (y + self._shift.imag)
        if not h:
            return np.abs(now)
        x, y = h * self.forward(self.frame(q), z.pi)[:2] @ bends
        move = x + 1j * y
        return np.abs(now + move * np.clip(-(now.conj() * move).real / np.maximum(np.abs(move) ** 2, 1e-300), 0.0, 1.0))

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
