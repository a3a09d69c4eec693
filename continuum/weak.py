r"""The loads of a scene in Galerkin's method (`continuum.galerkin`).

Admissible variations are (e psi, psi). Loads add their virtual work to d'Alembert's principle. Per length, for every psi,

    torque tau        tau psi                      force F           F . e psi
    slope             rho g . e psi                spring            -kappa (r - r_a) . e psi
    rolling damping   -c omega psi                 torsional viscosity   -eta omega' psi'
    rest twist tau_0  beta tau_0 psi'              from beta (theta' - tau_0)^2/2
    rest curvature, viscosity of bending: see `continuum.curved`, `continuum.viscous`

As for the elastic forces, e psi is replaced by P(e psi), which the functions can form. Then the virtual work is f . C delta for
forces f on the coordinates: with the functions phi_k of the line and psi_k of theta

    f_x,k = int F_x phi_k,   f_theta,k = int tau psi_k + beta tau_0 psi_k' - sum_l D_kl omega_l,
    D_kl = int c psi_k psi_l + eta psi_k' psi_l',

and the equations are pi. = -C^T (grad V - f), the contract of `discs.skew`. Gauss methods balance the energy as they do for discs:
H_1 - H_0 = h sum_i b_i (work_i - dissipated_i), with work f . q. and dissipated omega^T D omega at the stages, as H is quadratic.
Slopes, springs and constant rest twists have a quadratic potential and are part of V. A rest twist with a signal sigma(t) has the
energy sigma^2 beta int tau_0^2/2 - sigma beta int tau_0 theta', and products with other rest twists. Its change is work too.

**Ends.** A point torque tau at an end adds tau psi(0). Integration by parts then gives zero curvature and, with the end force
beta theta' - K e . r''', the value -tau at s = 0 and +tau at s = length: the natural conditions, which need nothing else. A point
force acts by e . F there. A rest twist has beta (theta' - tau_0) for beta theta', viscosity adds eta omega' to it.

**Motors** prescribe omega at an end, where psi = 0 then: no curvature and |r'| = 1 stay there. omega at the end is the unknown of a
node, as those of the other ends and places. Its row of the step is replaced by a stiff damper on omega - rate, as in
`discs.loads.motor`. The torque is what the row lacks, at the stages of a step: with the pull g = C^T (grad V - f) and C's entry t,

    t_j tau_j = g_j + (1/h) sum_i (a^-1)_ji (P_i - pi_n).

**Large steps.** The matrix of a sweep is I + h a C^T D C + (h a)^2 C^T S C, for the eigenvalues a of the Gauss coefficients. So
neither stiff damping nor stiff springs limit steps or sweeps. The two matrices have no common eigenvectors, and a damped rod takes
one inverse matrix for each pair of stages and each step.

Integrals are sums over Gauss points on pieces on which the initial fields and the patterns are smooth. A pattern may jump.
"""

from typing import NamedTuple

import numpy as np

from continuum.curved import Curved, forces, product
from continuum.functions import Functions
from continuum.gauss import gauss
from continuum.initial import Resolved
from continuum.kernels.spectral_load import NONE, Load
from continuum.load_places import cut_patterns, point_loads
from continuum.load_terms import ROLL, TWIST, Terms, X, Y, add, check_taken, viscosity
from continuum.motors import Motors
from continuum.timing import Timing
from continuum.viscous import Viscous
from discs.arrays import Float, Int
from discs.kernels.limits import HELD
from discs.loads import signals
from discs.loads.signals import Signal


class Weak(NamedTuple):
    """Loads on n functions.

    constant : (3, n), forces with a potential. damping : (n, n), D on omega. stiffness : (n, n), of the springs on x and on y.
        Both are (0, 0) if there are none.
    drives : (L, 3, n). signals, names : of the drives. closing (L,), squares (L, L + 1) : energies of rest twists, see `driven`.
    curved, viscous : rest curvature, and viscosity of bending; None for none.
    energy : the energy of the loads with a potential, for the initial fields.
    timing : the pieces of the signals.
    motors : the motors. held : (motors,), their nodes.
    """

    constant: Float
    damping: Float
    stiffness: Float
    drives: Float
    signals: tuple[Signal, ...]
    names: tuple[str, ...]
    closing: Float
    squares: Float
    curved: Curved | None
    viscous: Viscous | None
    energy: float
    timing: Timing
    motors: Motors
    held: Int

    @property
    def matrix(self) -> Float:
        """D with the dampers in the place of motors, (n, n); (0, 0) if there is neither."""
        if not self.held.size:
            return self.damping
        n = self.constant.shape[1]
        matrix = self.damping.copy() if self.damping.size else np.zeros((n, n))
        matrix[self.held, self.held] += HELD
        return matrix

    @property
    def parameters(self) -> Load:
        """The parameters of the compiled form; signals are set before each step. The first pattern is the constant one."""
        motors = np.zeros((self.held.size, *self.constant.shape))
        motors[np.arange(self.held.size), 2, self.held] = HELD
        patterns = np.concatenate([self.constant[None], self.drives, motors])
        load = NONE._replace(patterns=patterns.reshape(len(patterns), -1), damping=self.matrix, stiffness=self.stiffness)
        if self.viscous is None:
            return load
        turns = self.viscous.turns
        return load._replace(viscosity=self.viscous.eta, turns=turns, back=np.ascontiguousarray(turns.T))

    def stages(self, t: Float) -> Load:
        """The parameters for a step with stages at the times (s,)."""
        load = self.parameters._replace(signals=self.at(t))
        return load if self.curved is None else load._replace(bent=self.curved.matrices(self.values(t)))

    def at(self, t: Float) -> Float:
        """The signals of the compiled form at the times of stages (s,)."""
        # C order, whatever their number: one kernel serves rods with and without loads
        return np.ascontiguousarray(np.column_stack([np.ones(t.size), self.values(t), self.motors.rates(t)]))

    def values(self, t: Float) -> Float:
        """The signals at times (m,), (m, L)."""
        found = [signals.values(f, t, name) for f, name in zip(self.signals, self.names, strict=True)]
        return np.stack(found, axis=1) if found else np.empty((t.size, 0))

    def gradient(self, q: Float) -> Float:
        """That of the potential of the loads, (..., 3, n)."""
        out = np.broadcast_to(-self.constant, q.shape).copy()
        if self.stiffness.size:
            out[..., :2, :] += q[..., :2, :] @ self.stiffness
        if self.curved is not None:
            out[..., :2, :] -= forces(self.curved.rest, q)
        return out

    def stiffened(self, xy: Float, t: float) -> Float | float:
        """The matrix (m, m) of the second variation of the potential, at a time, for moves (m, 2, n) of the line."""
        total: Float | float = 0.0
        if self.stiffness.size:
            total = np.einsum("irk,jrk->ij", xy @ self.stiffness, xy)
        if self.curved is not None:
            total = total + product(self.curved.matrices(self.values(np.array([t])))[0], xy)
        return total

    @property
    def damps(self) -> bool:
        """Whether there are dampers or motors."""
        return bool(self.damping.size or self.held.size or self.viscous is not None)

    def damped(self, xy: Float, q: Float | None) -> Float:
        """C^T D C less its factors t, for moves (n, 2, n) of the line by omega at the nodes, at a position (3, n)."""
        matrix = self.matrix if self.matrix.size else np.zeros((len(xy), len(xy)))
        return matrix if self.viscous is None or q is None else matrix + self.viscous.product(q, xy)

    def driven(self, t: Float, q: Float) -> Float:
        """The part of the energy that depends on time, at times (m,) and changes of the positions (m, 3, n)."""
        bent = np.zeros(t.size)
        if self.curved is not None and self.curved.parts:
            bent = self.curved.energies(self.values(t), q) - self.curved.energies(np.zeros((t.size, len(self.signals))), q)
        rest = self.squares.any(axis=1)
        if not rest.any():
            return bent
        values = self.values(t)
        strain = 0.5 * values @ self.squares[:, :-1] + self.squares[:, -1] - np.einsum("lin,min->ml", self.drives, q) - self.closing
        total: Float = bent + (values * strain)[:, rest].sum(axis=1)
        return total

    def power(self, t: Float, q: Float, v: Float) -> Float:
        """The rates of work and dissipation at times (m,), positions and rates (m, 3, n), (m, 2), without those of motors."""
        work = (self.values(t) * np.einsum("lin,min->ml", self.drives, v)).sum(axis=1)
        if self.curved is not None:
            work = work + (self._bent(t, q) * v[:, :2]).sum(axis=(1, 2))
        omega = v[:, 2]
        lost = (omega @ self.damping * omega).sum(axis=1) if self.damping.size else np.zeros(t.size)
        if self.viscous is not None:
            lost = lost + self.viscous.dissipated(q, v)
        return np.stack([work, lost], axis=1)

    def _bent(self, t: Float, q: Float) -> Float:
        """The forces of rest curvatures less those of the constant one, (m, 2, n)."""
        assert self.curved is not None
        return forces(self.curved.matrices(self.values(t)) - self.curved.rest, q)

    def force(self, t: Float, q: Float, v: Float) -> Float:
        """The forces without a potential, and dampers in the place of motors, at times (m,), positions, rates (m, 3, n)."""
        f = self.applied(t, q, v)
        f[:, 2, self.held] += HELD * (self.motors.rates(t) - v[:, 2, self.held])
        return f

    def applied(self, t: Float, q: Float, v: Float) -> Float:
        """The forces without a potential and those of motors, at times (m,), positions and rates (m, 3, n), (m, 3, n)."""
        f: Float = np.einsum("ml,lin->min", self.values(t), self.drives)
        if self.curved is not None:
            f[:, :2] += self._bent(t, q)
        if self.viscous is not None:
            f[:, :2] += self.viscous.force(q, v)
        if self.damping.size:
            f[:, 2] -= v[:, 2] @ self.damping
        return f


def weak(initial: Resolved, functions: Functions, order: int) -> Weak:
    """The loads of a scene on functions, by Gauss quadrature with `order` points on every piece.

    Raises
    ------
    ValueError : for a load that the method does not take, a bad pattern, or one that no pieces resolve.
    """
    scene = initial.scene
    check_taken(scene.loads)
    length, points = scene.rod.length, point_loads(scene)
    cut = cut_patterns(scene)
    edges = initial.pieces if cut is None else np.unique(np.concatenate([initial.pieces, cut.edges]))
    x, w = gauss(order)
    half = np.diff(edges)[:, None] / 2
    s = np.concatenate([(edges[:-1, None] + half * (1 + x)).ravel(), points])
    terms = Terms(scene, s, np.concatenate([(half * w).ravel(), np.zeros(len(points))]))
    for load in scene.loads:
        add(load, terms)
    line, theta, slope = functions.line(s), functions.field(s), functions.field(s, 1)
    straight = np.outer(scene.shift, s) / length  # r of a closed rod less its series

    def project(push: Float) -> Float:
        found: Float = np.stack([push[X] @ line, push[Y] @ line, push[ROLL] @ theta + push[TWIST] @ slope])
        return found

    n, none = theta.shape[1], np.zeros((0, 0))
    strains = np.array([0 * s + drive.strain for drive in terms.drives]).reshape(-1, s.size)
    twisted = np.zeros(s.size)  # theta' of the initial fields, where it is needed
    if strains.any() or terms.strain.any():
        twisted[: s.size - len(points)] = initial.twist(edges, order)
    start = initial.fields(s)
    line_energy = (
        0.5 * terms.stiffness @ (start["x"] ** 2 + start["y"] ** 2) - terms.push[X] @ start["x"] - terms.push[Y] @ start["y"]
    )
    terms.push[:2] -= terms.stiffness * straight
    curved, bent, constant = _curved(terms, functions), 0.0, project(terms.push)
    if curved is not None:  # `bent`: of the initial fields
        constant[:2] -= curved.split()
        z, z1 = (initial.derivative("x", edges, order, m) + 1j * initial.derivative("y", edges, order, m) for m in (1, 2))
        size, kappa = len(z), terms.curvature[: len(z)]
        stiff = terms.w[:size] * scene.rod.at(s[:size]).bending_stiffness
        bent = float(stiff @ (0.5 * np.abs(kappa * z) ** 2 - kappa * (z.conj() * z1).imag))
    timing, places = Timing(scene), [np.array([float(axle.at)]) for axle in terms.axles]
    return Weak(
        constant=constant,
        damping=(theta.T * terms.damping[0]) @ theta + (slope.T * terms.damping[1]) @ slope if terms.damping.any() else none,
        stiffness=(line.T * terms.stiffness) @ line if terms.stiffness.any() else none,
        drives=np.array([project(drive.push) for drive in terms.drives]).reshape(-1, 3, n),
        signals=tuple(drive.signal for drive in terms.drives),
        names=tuple(drive.name for drive in terms.drives),
        closing=np.array([drive.push[TWIST] @ twisted for drive in terms.drives]),
        squares=strains @ np.vstack([strains, terms.strain]).T,
        curved=curved,
        viscous=_viscous(terms, functions),
        energy=terms.offset + bent + float(line_energy + 0.5 * terms.strain @ terms.strain - terms.push[TWIST] @ twisted),
        timing=timing,
        motors=Motors(terms.axles, timing, scene.duration, np.array([initial.fields(at)["omega"][0] for at in places])),
        held=np.array([0 if axle.at == 0 else n - 1 for axle in terms.axles], dtype=int),
    )


def _curved(terms: Terms, functions: Functions) -> Curved | None:
    """The rest curvature of the loads; None for none."""
    kappas = [terms.curvature, *(0 * terms.s + drive.curvature for drive in terms.drives)]
    parts = [i for i, kappa in enumerate(kappas[1:]) if kappa.any()]
    if not parts and not kappas[0].any():
        return None
    weights = terms.w * terms.scene.rod.at(terms.s).bending_stiffness
    slope, bend, mean = functions.line(terms.s, 1), functions.line(terms.s, 2), complex(*terms.scene.shift) / terms.scene.rod.length
    return Curved.of(np.array([kappas[0], *(kappas[1 + i] for i in parts)]), parts, weights, slope, bend, mean)


def _viscous(terms: Terms, functions: Functions) -> Viscous | None:
    """The viscosity of bending of the loads; None for none."""
    eta = viscosity(terms.scene.loads, functions.there)
    return Viscous.of(eta, functions, complex(*terms.scene.shift) / terms.scene.rod.length) if eta.any() else None
