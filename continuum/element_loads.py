r"""The loads of a rod with headings of its own, on spectral elements (`continuum.elements`).

Admissible variations are (e psi, psi, chi) with e = R J d_1(phi). Loads add their virtual work to d'Alembert's principle. Per
length, for every psi and chi,

    torque tau             tau psi, about="turn": tau chi       force F              F . e psi
    Potential V(r)         -grad V . e psi                      Custom (f, g, h)     f . e psi + g psi + h chi
    slope                  rho g . e psi                        spring               -kappa (r - r_a) . e psi
    rolling resistance     -c omega psi                         turning resistance   -c phi. chi
    torsional viscosity    -eta omega' psi'                     bending viscosity    -eta phi.' chi'

and rest strains are subtracted in the energy: A (Gamma_1 - a_0)^2/2 + G (Gamma_2 - g_0)^2/2 + beta (theta' - tau_0)^2/2
+ K (phi' - kappa_0)^2/2, with Gamma + (1, 0) = (cos psi, -sin psi) at rest for a mounting angle psi. Integrals are the sums over
Gauss-Lobatto nodes of the elements. So loads are forces on nodes, and rest strains and viscosities at the nodes of each element.
Integration by parts gives the natural conditions. At s = 0, with a point torque tau and a point force F there,

    e . (n + F) + beta (theta' - tau_0) + eta omega' = -tau,    K (phi' - kappa_0) + eta phi.' = -(torque about the vertical),

and with the opposite sign of the torques and of F at s = length.

**Places.** Elements have edges where patterns jump and where loads act at a point. The field has corners there, and only there, so
errors fall as they do without loads.

**Motors.** A motor prescribes omega (or phi.) at a node, an end or an edge inside the rod. Its torque is what the equation of the
node lacks, tau = M w omega. - f, with f the other forces on omega. Then tau omega = d/dt (M w omega^2/2) - f omega, and the work
needs no derivative of the rate.

**Balance.** energy - energy(0) = work - dissipated. Work is done by the forces with signals, by motors, and by rest strains e that
depend on time: with the stiffness S and the strain a it is the integral of -S (a - e) e., the change of S e^2/2 - S e a plus the
integral of S e a. .
"""

from dataclasses import dataclass
from functools import cached_property, singledispatch
from typing import Any

import numpy as np

from continuum.element_grid import Grid
from continuum.load_places import cut_patterns, point_loads
from continuum.load_terms import ROLL, Terms, X, Y, add
from continuum.motors import Axle, Motors
from continuum.rod import Scene
from continuum.timing import Timing
from discs import checks
from discs.arrays import Float
from discs.loads import Custom, Damping, Motor, Potential, Rest, signals
from discs.loads.binding import ROW

INSIDE = 1e-12  # of the length: patterns are read this far from edges, on the side of the element


@dataclass(eq=False)
class SteeredTerms(Terms):
    """Loads at places along a rod with headings of its own; see `Terms`. The rows of forces are x, y, theta, phi.

    damping : (4, S), rolling and turning resistance times the weights, and viscosities of torsion and bending.
    strain : (4, S), constant rest strains: stretch, shear, twist, curvature; those of drives alike.
    own : densities that are functions of the motion.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        self.damping, self.strain = np.zeros((4, self.s.size)), np.zeros((4, self.s.size))
        self.own: list[Custom | Potential] = []

    def row(self, load: Any) -> int:
        return ROW[checks.choice(f"about of {type(load).__name__}", load.about, ROW)]


@singledispatch
def put(load: Any, to: SteeredTerms) -> None:
    """Add a load to the terms, by its form here or that of `continuum.load_terms`; ValueError for a load that has neither."""
    if add.dispatch(type(load)) is add.dispatch(object):
        raise ValueError(f"{type(load).__name__}: a field has no form of it; simulate(lump(scene, n)) takes it on discs")
    add(load, to)


@put.register
def _(load: Damping, to: SteeredTerms) -> None:
    for row, name in enumerate(("rolling", "turning", "torsion", "bending")):
        to.damping[row] += to.at(load, name, least=0.0) * (to.w if row < 2 else 1.0)


@put.register
def _(load: Rest, to: SteeredTerms) -> None:
    psi = 0.0 if load.mounting_angle is None else checks.number("mounting_angle of Rest", load.mounting_angle)
    strain = np.array([to.at(load, name) for name in ("stretch", "shear", "twist", "curvature")])
    strain[:2] += np.array([[np.cos(psi) - 1], [-np.sin(psi)]])
    if load.signal is None:
        to.strain += strain
    elif strain[:2].any():
        raise ValueError("Rest: stretch, shear and mounting angle take no signal; give them in a Rest of their own")
    else:
        to.drive(load, {}, strain)


@put.register
def _(load: Custom | Potential, to: SteeredTerms) -> None:
    to.own.append(load)


@put.register
def _(load: Motor, to: SteeredTerms) -> None:
    to.axles.append(Axle(to.row(load), load.at, load.signal))


class ElementLoads:
    """The loads of a scene on the nodes of elements.

    Attributes
    ----------
    push : (4, n), constant forces with a potential. stiffness : (n,), of springs on x and y. drag : (2, n), on omega and phi. .
    viscosity : (2, P, p + 1), of torsion and bending. rest : (4, P, p + 1), constant rest strains. offset : energy.
    drives : (L, 4, n), and strains (L, 4, P, p + 1), which signals multiply.
    motors : the motors. driven : (motors,) each, their rows in (omega, phi.) and their nodes.
    own : loads that are functions of the motion, at the nodes.
    """

    def __init__(self, scene: Scene, grid: Grid) -> None:
        self._grid, length = grid, scene.rod.length
        inward = np.zeros(grid.places.shape[1])
        inward[[0, -1]] = INSIDE * length, -INSIDE * length
        points = np.array(point_loads(scene))
        s = np.concatenate([(grid.places + inward).ravel(), points])
        m = grid.places.size
        terms = SteeredTerms(scene, s, np.concatenate([grid.w.ravel(), np.zeros(points.size)]))
        for load in scene.loads:
            put(load, terms)
        nearest = [int(np.argmin(np.abs(grid.places - at))) for at in points]
        owner = np.concatenate([grid.index.ravel(), grid.index.ravel()[nearest]]).astype(int)

        def nodal(values: Float) -> Float:
            """Sums over the places of each node, (..., n)."""
            rows = values.reshape(-1, s.size)
            found = np.array([np.bincount(owner, row, grid.n) for row in rows])
            return found.reshape(*values.shape[:-1], grid.n)

        def local(values: Float) -> Float:
            return values[..., :m].reshape(*values.shape[:-1], *grid.places.shape)

        # the last place of a closed rod is its first, advanced by the shift
        beyond = np.where(scene.closed & (np.abs(s - length) < 2 * INSIDE * length), 1.0, 0.0)
        for row, shift in zip((X, Y), scene.shift, strict=True):
            terms.offset += float(beyond @ (0.5 * terms.stiffness * shift**2 - terms.push[row] * shift))
            terms.push[row] -= terms.stiffness * shift * beyond
        self.push, self.stiffness, self.drag = nodal(terms.push), nodal(terms.stiffness), nodal(terms.damping[:2])
        self.viscosity, self.rest, self.offset = local(terms.damping[2:]), local(terms.strain), terms.offset
        drives = terms.drives
        self.drives = np.array([nodal(drive.push) for drive in drives]).reshape(-1, 4, grid.n)
        strains = [local(np.zeros((4, 1)) * s + drive.strain) for drive in drives]
        self.strains = np.array(strains).reshape(-1, 4, *grid.places.shape)
        self._signals = [(drive.signal, drive.name) for drive in drives] + [(axle.rate, "Motor") for axle in terms.axles]
        ends = [int(grid.index.flat[np.argmin(np.abs(grid.places - axle.at))]) for axle in terms.axles]
        self.driven = np.array([axle.row - ROLL for axle in terms.axles], dtype=int), np.array(ends, dtype=int)
        self.own = [load.over(grid.weights, 4) for load in terms.own]
        self.timing = Timing(scene)
        initial = [scene.fields(np.array([axle.at]))["omega" if axle.row == ROLL else "phi_rate"][0] for axle in terms.axles]
        self.motors = Motors(
            terms.axles, self.timing, scene.duration, np.array(initial), scene.rod.length if scene.closed else np.inf
        )

    def values(self, t: float) -> Float:
        """The signals of the drives, the rates of the motors, and the time, (L + motors + 1,)."""
        return np.array([*(signals.values(signal, np.array([t]), name)[0] for signal, name in self._signals), t])

    @cached_property
    def _actuated(self) -> bool:
        return bool(self.strains.any())

    def at_rest(self, values: Float) -> Float:
        """The rest strains, (4, P, p + 1)."""
        if not self._actuated:
            return self.rest
        found: Float = self.rest + np.tensordot(values[: len(self.strains)], self.strains, 1)
        return found

    def held(self, values: Float, q: Float) -> Float:
        """The unknowns (6, n) with the rates of motors."""
        if self.motors.axles:
            q = q.copy()
            q[4 + self.driven[0], self.driven[1]] = values[len(self.drives) : -1]
        return q

    def force(self, values: Float, q: Float, e: Float) -> Float:
        """The forces on unknowns (6, n), (4, n): all but those of rest strains and viscosities. e : (2, n), contact directions."""
        found: Float = self.push + np.tensordot(values[: len(self.drives)], self.drives, 1)
        found[:2] -= self.stiffness * q[:2]
        found[2:] -= self.drag * q[4:]
        for load in self.own:
            found += load.force(float(values[-1]), q[:4], np.concatenate([e * q[4], q[4:]]))
        return found

    def power(self, values: Float, q: Float, v: Float, stiffness: Float, bent: Float) -> Float:
        """The rates of work and dissipation, (2,), without those of motors.

        q, v : (4, n), x, y, theta, phi and their rates. stiffness : (2, P, p + 1), of torsion and bending. bent : the same, omega',
        phi.'.
        """
        work = float(np.vdot(np.tensordot(values[: len(self.drives)], self.drives, 1), v))
        if self._actuated:
            work += float(np.vdot(self._grid.w, (stiffness * (self.at_rest(values) - self.rest)[2:] * bent).sum(axis=0)))
        work += sum(load.power(float(values[-1]), q, v)[0] for load in self.own)
        lost = float((self.drag * v[2:] ** 2).sum()) + float(np.vdot(self._grid.w, (self.viscosity * bent**2).sum(axis=0)))
        return np.array([work, lost])

    def fastest(self, inertia: Float, radius: float) -> float:
        """A bound of the fastest rate at which loads change the motion: decay by damping, oscillation on springs.

        inertia : (2, n), of rolling and turning at the nodes. radius : the largest.
        """
        drag, grid = self.drag / inertia, self._grid
        strain = self.viscosity * grid.steepest / (inertia / grid.weights)[:, grid.index]
        return float(max(drag.max() + strain.max(), radius * np.sqrt((self.stiffness / inertia[0]).max())))

    def energy(self, q: Float) -> float:
        """The energy of loads that is no elastic energy, of unknowns (6, n)."""
        own = sum(load.potential(0.0, q[:4]) for load in self.own)
        return self.offset + own + float(0.5 * self.stiffness @ (q[:2] ** 2).sum(axis=0) - np.vdot(self.push[:2], q[:2]))


def breaks(scene: Scene) -> list[float]:
    """Places inside the rod at which elements must have edges: points of loads, jumps and corners of patterns."""
    length, cut = scene.rod.length, cut_patterns(scene)
    found = sorted({*point_loads(scene), *(cut.breaks() if cut else ())})
    return [s for s in found if 0 < s < length]
