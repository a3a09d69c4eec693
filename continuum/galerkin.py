"""The rod with slaved headings by Galerkin's method, with polynomials, or Fourier series on a closed rod.

Admissible velocities and variations are (e psi, psi). With r = x + i y, z = r' and e = i R h(z), h a law of `discs.chains.rolling`,
d'Alembert's principle reads, for every psi,

    int (alpha + rho |e|^2) omega. psi + rho omega Re(conj(e) e.) psi = - int K Re(conj(r'') (e psi)'') + beta theta' psi'.

**Ends.** At a free end r'' does no work on (e psi)', which is kappa psi' = 0. The tangential part of r'' is *not* zero there.
Collocation would replace e psi by the polynomial through its values at the nodes. The slope of this polynomial at the end differs
from that of e psi, the tangential part of r'' does work on the difference, and all fields get an error of first order in the
spacing at the end. Instead, r moves by the projection P(e omega), defined so that int Re(conj(r'') f'') is the same for f and P f
for every r'' that the functions form: (P f)'' is the L2 projection of f''. The two numbers that r'' does not determine are the
values of f at the ends (on a closed rod the one number is the mean). So

    r. = P (e omega),   theta. = omega,   pi = sqrt(w (alpha + rho |e|^2)) omega at nodes of weight w

is a skew-gradient system q. = C pi, pi. = - C^T grad V with the quadratic V = int K |r''|^2/2 + beta theta'^2/2, and Gauss methods
conserve its energy. The unknowns are the coefficients of r'' and the ends, so only omega is differentiated, and no digits are lost.
Integrals with e take 1.5 points per node, which is exact for the field law.

**Parameters that vary** stand in these integrals, rho and alpha at the nodes (`continuum.functions.weighted`), as the density
rho |r.|^2/2 + alpha theta.^2/2 - beta theta'^2/2 - K |r''|^2/2 with functions of s has them. End conditions are natural ones.

**Initial fields** are projected, not sampled at the nodes, so features between the nodes are not missed. With theta =
theta_0(s) + vartheta, the initial twist enters only V = int beta vartheta'^2/2 + K |r''|^2/2 + f . vartheta + const, by its moment
with each function,

    f_k = int beta theta_0' psi_k',

by a quadrature on the pieces that resolve theta_0 (`continuum.initial`). (By parts, without theta_0', digits are lost, as psi_k''
is of the size n^4: 2e-9 of f with 97 functions, which moves the rod by 1e-10.) vartheta is smoother than theta_0, so a twist much
narrower than the functions costs little accuracy where the rod rolls. r is fitted by least squares in s. omega at a node is the
mean of the initial omega weighted by the function of the node.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from continuum.density import Density
from continuum.functions import polynomials, waves, weighted
from continuum.initial import Resolved, resolve
from continuum.kernels.spectral import Spectral
from continuum.kernels.spectral_load import NONE
from continuum.modes import Modes, Pencil
from continuum.rod import Scene
from continuum.weak import weak
from discs.arrays import Complex, Float
from discs.chains.rolling import ROLLING
from discs.skew import Phase, SkewGradient

DATA = 24  # quadrature points per piece of the initial fields, in addition to those for the functions


class Basis(NamedTuple):
    """C at one configuration, or at several with one more leading axis.

    e (n,) and t = 1/sqrt(w (alpha + rho |e|^2)) (n,) at the nodes; finer : e'', 2 e', e (3, F) at the finer points.
    """

    e: Complex
    t: Float
    finer: Complex


class SpectralRod(SkewGradient):
    """The equations of motion of a scene on n functions.

    Rows x, y of a configuration are coefficients of the `functions`. Row theta is the change of theta since the start, at the
    nodes.

    Attributes
    ----------
    scene : the scene. law : its law of rolling. closed : whether the rod is closed.
    shift : mean slope of a closed rod, a complex number.
    twist : (n,), the moment f of the initial twist.
    loads : the loads of the scene, None if there are none.
    crossing : the time in which a wave as long as the rod crosses it, over 2 pi, where it is fastest.
    start : the initial state.
    """

    rows = ("x", "y", "theta")
    quadratic = True

    def __init__(self, scene: Scene, n: int, density: Density | None = None) -> None:
        rod = scene.rod
        self.closed = scene.closed
        self.n, self.law, self.scene = n, ROLLING[scene.rolling], scene
        self.functions = (waves if scene.closed else polynomials)(n, density or Density(rod.length))
        nodes, self._rolls = rod.at(self.functions.s), np.ones(())  # radius at the nodes over self._radius
        mass, bending, torsion, self._radius = nodes.density, nodes.bending_stiffness, nodes.torsion_stiffness, 1.0
        if rod.varying:
            self.functions, self._rolls = weighted(self.functions, rod), nodes.radius
            mass, bending, torsion = mass * nodes.radius**2, np.ones(()), np.ones(())
        else:
            self._radius = float(nodes.radius)
        self.scale = np.array([rod.length, rod.length, 1.0])
        self.bending, self.torsion = bending * self.functions.bending, torsion * self.functions.torsion
        self._rates, self._bends, self._project = (
            np.ascontiguousarray(matrix.T) for matrix in (self.functions.rates, self.functions.bends, self.functions.project)
        )
        self._mass, self._spin = self.functions.w * mass, self.functions.w * nodes.spin_inertia
        stiffest = float(np.max(nodes.torsion_stiffness * rod.length**2 + nodes.bending_stiffness * nodes.radius**2))
        self.crossing = rod.length**2 * np.sqrt(float(np.min(nodes.inertia)) / stiffest) if stiffest else np.inf
        self.shift = complex(*scene.shift) / rod.length  # mean slope of a closed rod; z is the slope of the series plus this
        self.twist, self._offset = np.zeros(n), 0.0
        initial = resolve(scene)
        self.loads = weak(initial, self.functions, DATA + n // 2) if scene.loads else None
        self.start = self._start(initial)

    @cached_property
    def parameters(self) -> Spectral:
        """The parameters of the compiled form; its modes are set before each step."""
        return Spectral(
            bends=self._bends,
            rates=self._rates,
            back=np.ascontiguousarray(self.functions.rates),
            project=self._project,
            pull=np.ascontiguousarray(self.functions.project),
            bending=self.bending,
            torsion=self.torsion,
            twist=self.twist,
            mass=self._mass,
            spin=self._spin,
            scale=self.scale,
            shift=self.shift,
            radius=float(self._radius),
            rolling=self.law.parameters,
            modes=None,
            load=NONE if self.loads is None else self.loads.parameters,
        )

    @cached_property
    def line(self) -> Float:
        """The matrix from coefficients of r to its values at the nodes, (n, n)."""
        return self.functions.line(self.functions.s)

    def _start(self, initial: Resolved) -> Phase:
        """The initial state. Also sets the twist, and the constant of V that makes the energy that of the initial fields."""
        scene, functions, order = self.scene, self.functions, DATA + self.n // 2
        s, w = initial.quadrature(order)
        fields, ends = scene.fields(s), np.array([0.0, scene.rod.length])
        at_ends, beta = scene.fields(ends), scene.rod.at(s).torsion_stiffness
        self.twist = functions.field(s, 1).T @ (w * beta * initial.twist(initial.pieces, order))
        a = np.zeros(self.n, complex)
        if functions.ends:
            a[: functions.ends] = at_ends["x"] + 1j * at_ends["y"]
        root, line = np.sqrt(w), functions.line(s)
        rest = fields["x"] + 1j * fields["y"] - self.shift * s - line[:, : functions.ends] @ a[: functions.ends]
        a[functions.ends :] = np.linalg.lstsq(root[:, None] * line[:, functions.ends :], root * rest, rcond=None)[0]
        q = np.array([a.real, a.imag, np.zeros(self.n)])
        omega = functions.field(s).T @ (w * fields["omega"]) / functions.w
        if self.loads:
            omega[self.loads.held] = self.loads.motors.rates(np.zeros(1))
        start = Phase(q, np.zeros_like(q), omega / self.basis(q).t)
        self._offset = initial.energy + (self.loads.energy if self.loads else 0.0) - self.energy(start)
        return start

    @property
    def start_energy(self) -> float:
        """The energy of the initial fields, by quadrature."""
        return float(self.energies(Phase(*(part[None] for part in self.start)), np.zeros(1))[0])

    def slopes(self, z: Phase) -> Complex:
        """r' at the nodes as complex numbers, (..., n)."""
        xy = (z.hi + z.lo)[..., :2, :] @ self.functions.bends[: self.n].T
        return xy[..., 0, :] + 1j * xy[..., 1, :] + self.shift

    def omega(self, z: Phase) -> Float:
        """omega at the nodes, (..., n), as in `basis` but without the finer points."""
        e = self._radius * self.law.size(np.abs(self.slopes(z)))
        return z.pi / np.sqrt(self._spin + self._mass * e**2)

    def energy(self, z: Phase) -> float:
        """Kinetic and potential energy, but for loads that depend on time."""
        return float(self.energies(z))

    def energies(self, z: Phase, t: Float | None = None) -> Float:
        """The energies of several states, by leading axes; at times t (F,) with loads that depend on time."""
        kinetic: Float = 0.5 * (z.pi * z.pi).sum(axis=-1)
        q = z.hi + z.lo
        energy = kinetic + self._potentials(q)
        return energy if self.loads is None or t is None else energy + self.loads.driven(t, q)

    def _potentials(self, q: Float) -> Float:
        twice: Float = (q * self.mean_force(q)).sum(axis=(-2, -1)) + q[..., 2, :] @ self.twist
        if self.loads:
            twice = twice - (q * self.loads.constant).sum(axis=(-2, -1))
        return 0.5 * twice + self._offset

    def reader(self, s: Float) -> Callable[[Phase], dict[str, Float]]:
        """A function that returns x, y, theta, omega of states at places s, each (..., S). States may have leading axes."""
        line, field, theta = self.functions.line(s), self.functions.field(s), self.scene.fields(s)["theta"]

        def at(z: Phase) -> dict[str, Float]:
            q = z.hi + z.lo
            x, y = q[..., 0, :] @ line.T + self.shift.real * s, q[..., 1, :] @ line.T + self.shift.imag * s
            return {"x": x, "y": y, "theta": theta + q[..., 2, :] @ field.T, "omega": self.omega(z) @ field.T}

        return at

    def slip(self, z: Phase) -> Float:
        """Largest |r. - e omega| at the nodes, the error of the projection in the constraint. States may have leading axes."""
        c = self.basis(z.hi + z.lo)
        rates = self.forward(c, z.pi)
        moved = (rates[..., 0, :] + 1j * rates[..., 1, :]) @ self.line.T
        slip: Float = np.abs(moved - c.e * (self._rolls * rates[..., 2, :])).max(axis=-1)
        return slip

    def shape(self, hi: Float, lo: Float | None = None) -> Float:
        return hi if lo is None else hi + lo

    def moved(self, shape: Float, dq: Float) -> Float:
        return shape + dq

    # The following take several configurations at once, by leading axes

    def basis(self, shape: Float) -> Basis:
        xy = shape[..., :2, :] @ self._bends
        z = xy[..., 0, :] + 1j * xy[..., 1, :]
        n, f = self.n, self.functions.project.shape[1] - self.n
        at, slope, bend, bent = z[..., :n] + self.shift, z[..., n : n + f] + self.shift, z[..., n + f : -f], z[..., -f:]
        e = 1j * self._radius * self.law.jet(at, 0 * at, 0 * at)[0]
        h, h1, h2 = self.law.jet(slope, bend, bent)
        fine = np.stack([h2, 2 * h1, h], axis=-2)
        t = 1 / np.sqrt(self._spin + self._mass * (e.real**2 + e.imag**2))
        return Basis(e, t, 1j * self._radius * fine)

    def forward(self, c: Basis, p: Float) -> Float:
        omega = c.t * p
        rates = (omega @ self._rates).reshape(*omega.shape[:-1], 3, -1)
        moves = np.concatenate([(c.finer * rates).sum(axis=-2), c.e * omega], axis=-1)
        out = np.empty((*omega.shape[:-1], 3, self.n))
        out[..., 0, :], out[..., 1, :] = moves.real @ self._project, moves.imag @ self._project
        out[..., 2, :] = omega
        return out

    def back(self, c: Basis, g: Float) -> Float:
        pull = g[..., :2, :] @ self.functions.project
        pull = pull[..., 0, :] - 1j * pull[..., 1, :]
        fine = (c.finer * pull[..., None, : -self.n]).real
        return c.t * (fine.reshape(*g.shape[:-2], -1) @ self.functions.rates + (c.e * pull[..., -self.n :]).real + g[..., 2, :])

    def bases(self, shape: Float, moves: Float) -> Basis:
        return self.basis(shape + moves)

    def forwards(self, bases: Basis, p: Float) -> Float:
        return self.forward(bases, p)

    def pulls(self, bases: Basis, shape: Float, t: Float, z: Phase, moves: Float, p: Float) -> Float:
        q = shape + moves
        gradient = self.mean_force(q)
        return self.back(bases, gradient if self.loads is None else gradient - self.loads.force(t, q, self.forward(bases, p)))

    def potential(self, shape: Float) -> float:
        return float(self._potentials(shape))

    def secant(self, shape: Float, dq: Float) -> Float:
        return shape + 0.5 * dq

    def mean_force(self, secant: Float) -> Float:
        out = secant * self.bending
        out[..., 2, :] = secant[..., 2, :] @ self.torsion + self.twist
        if self.loads:
            out += self.loads.gradient(secant)
        return out

    def modes(self, c: Basis, t: float = 0.0, q: Any = None) -> Modes | Pencil:
        """The eigenvectors of C^T (grad^2 V) C at the time t; with them (I + g C^T (grad^2 V) C)^-1 takes two matrix products.

        Damping has other eigenvectors: a `Pencil` then has both matrices.
        """
        n, points = self.n, c.finer.shape[1]
        moves = np.zeros((n, points + n), complex)  # e psi of every function
        moves[:, :points] = (c.finer * self.functions.rates.reshape(3, points, n).transpose(2, 0, 1)).sum(axis=1)
        moves[:, points:] = np.diag(c.e)
        xy = np.hstack([moves.real @ self._project, moves.imag @ self._project]).reshape(n, 2, n)
        bent = (xy * self.bending).reshape(n, 2 * n) @ xy.reshape(n, 2 * n).T
        if self.loads:
            bent += self.loads.stiffened(xy, t)
        stiffness = c.t[:, None] * (bent + self.torsion) * c.t
        if self.loads and self.loads.damps:
            return Pencil(stiffness, c.t[:, None] * self.loads.damped(xy, q) * c.t)
        values, vectors = np.linalg.eigh(stiffness)
        return Modes(values, np.ascontiguousarray(vectors), np.ascontiguousarray(vectors.T))

    def solve(self, secant: Float, c: Basis, g: complex, rhs: Float, d: complex = 0.0, t: float = 0.0, q: Any = None) -> Float:
        return self.modes(c, t, q).solve(d, g, rhs)
