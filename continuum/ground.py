r"""The force of the ground on a rod on n functions, and other quantities at places along it: `solve(scene, want=...)`.

docs/ground-force.md derives what follows. For any displacement eta of the line, d'Alembert's principle with the ground's force
lambda on the side of the loads reads

    <lambda, eta> = int rho r.. . eta + m . eta'' + N . eta' - F . eta,
    m = K (r'' - kappa_0 J r') + eta_b kappa. J r',   N = kappa_0 J K (r'' - kappa_0 J r') - eta_b kappa. J r'',

with rest curvature kappa_0 and viscosity of bending eta_b. With M = beta (theta' - tau_0) + eta omega' the rolling sections have,
for any psi,

    -<lambda, e psi> = int (alpha omega. + c omega - tau) psi + M psi' - sum_ends tau_end psi.

Integration by parts, with the contact force n = N - m', gives

    lambda = (rho r.. - n' - F) + force_0 delta_0 + force_l delta_l - couple_0 delta'_0 - couple_l delta'_l,
    force_0 = -n(0) - F_0,   couple_0 = -m(0),   force_l = n(length) - F_l,   couple_l = m(length),

and, from the second line,

    e . lambda = M' + tau - c omega - alpha omega.   inside,
    couple . e = 0,   force . e + couple . e' = tau_end + M(0) at s = 0, tau_end - M(length) at s = length.

So the part of lambda across the line needs theta'' only, and it is taken from these. r'''' is needed for the part along the line,
r''' for that of the force at an end, r'' for that of the couple, where `continuum.end_identities` do not have them. omega. is
that of Galerkin's equations.

**Numerics.** r. = E W with E = i h(r') and W = R omega, the polynomial through its values at the nodes, and r.. = E. W + E W. at
each place. m, N and M are interpolated at the nodes and differentiated there, except for theta_0, whose derivatives are those of
the initial fields. `contact_moments` are <lambda, eta> by the first line, without derivatives of m and N.
"""

import numpy as np

from continuum.galerkin import SpectralRod
from continuum.initial import resolve
from continuum.load_terms import Terms, spread_and_points, viscosity
from continuum.wants import smooth_tests
from discs.arrays import Complex, Float
from discs.skew import Phase

SHORT = 0.1  # of the largest |e|: where e is shorter, lambda across the line is taken from the equation of the line too


class Ground:
    """Quantities of a rod on n functions at places along it, by the names of `Solution`.

    Parameters
    ----------
    s : (S,), the places; with free ends the first and the last are the ends.
    want : the quantities, see `continuum.wants`.
    """

    def __init__(self, rod: SpectralRod, s: Float, want: tuple[str, ...]) -> None:
        self._rod, self._s, self._want = rod, s, set(want)
        functions, scene = rod.functions, rod.scene
        nodes = functions.s
        self._nodes, self._here = scene.rod.at(nodes), scene.rod.at(s)
        self._line = [functions.line(s, m).T for m in range(3)]
        self._line_at_nodes = [functions.line(nodes, m).T for m in range(3)]
        self._slope = functions.field(nodes, 1).T
        self._field = [functions.field(s, m).T for m in range(3)]
        spread, points = spread_and_points(scene)
        self._loads, self._loads_at_nodes = Terms.along(scene, spread, s), Terms.along(scene, spread, nodes)
        self._end_loads = Terms.along(scene, points, np.array([0.0, scene.rod.length]))
        self._viscosity = viscosity(scene.loads, nodes)
        initial = resolve(scene)
        self._twist, self._twist1 = initial.at("theta", s, 1), initial.at("theta", s, 2)
        self._tests = smooth_tests(s, scene.rod.length, scene.closed)
        stiffness = self._nodes.torsion_stiffness
        self._stiffer = stiffness @ self._field[1] if stiffness.ndim else 0.0  # beta'

    def at(
        self,
        t: Float,
        z: Phase,
        ends: tuple[Float, Float] | None = None,
        rolling: Float | None = None,
        torques: Float | None = None,
    ) -> dict[str, Float]:
        """The quantities at times (k,) and states with a first axis k.

        ends : the parts of K r'' and of its derivative along r' at the two ends, over |r'|, (k, 2), if they are known.
        rolling, torques : omega and omega. at the nodes, (2, k, n), and the torques of motors, (k, motors); without `rolling` those
            of the states and of Galerkin's equations.
        """
        rod, want, here, field = self._rod, self._want, self._here, self._field
        q = z.hi + z.lo
        omega = rod.omega(z) if rolling is None else rolling[0]
        a: Complex = q[:, 0] + 1j * q[:, 1]
        slope, bend = a @ self._line[1] + rod.shift, a @ self._line[2]
        h, h1, _ = rod.law.jet(slope, bend, 0 * bend)
        e, e1, roll = 1j * h, 1j * h1, self._nodes.radius * omega
        w, w1, rate = roll @ field[0], roll @ field[1], omega @ field[0]
        v: Complex = e * w
        found: dict[str, Float] = {}
        if "velocity" in want:
            found |= {"x_rate": v.real, "y_rate": v.imag}
        if "slope" in want:
            found |= {"slope_x": slope.real, "slope_y": slope.imag}
        if want <= {"velocity", "slope"}:
            return found
        turning: Complex = e1 * w + e * w1  # the rate of r'
        m, n, elastic = self._moments(t, a, roll)
        strain, torsion, torsion1 = self._torsion(t, q, omega)
        contact, moment = n @ field[0] - m @ field[1], m @ field[0]
        if "energy_density" in want:
            kinetic = here.density * np.abs(v) ** 2 + here.spin_inertia * rate**2
            found["energy_density"] = 0.5 * (kinetic + strain**2 + np.abs(elastic @ field[0]) ** 2)
        if "energy_flux" in want:
            found["energy_flux"] = -(_dot(contact, v) + _dot(moment, turning) + torsion * rate)
        if "contact_force" not in want:
            return found
        spin, torques = self._spins(t, z, omega) if rolling is None else (rolling[1], torques)
        r = a @ self._line[0] + rod.shift * self._s
        faster = 1j * _vector(rod.law.rate(_pair(slope), _pair(turning))) * w + e * ((self._nodes.radius * spin) @ field[0])
        free = here.density * faster - self._loads.force(t, r)
        rest = free + m @ field[2] - n @ field[1]
        turn = torsion1 + self._loads.torque(t, rate) - here.spin_inertia * (spin @ field[0])
        radius = here.radius + 0 * self._s
        found["contact_force"] = _split(across(rest, radius * e, turn))
        eta, eta1, eta2 = self._tests * weights(self._s, rod.closed)
        moments = free @ eta.T + moment @ eta2.T + (n @ field[0]) @ eta1.T
        found["contact_moments"] = _split(moments - self._end_loads.force(t, r[:, [0, -1]]) @ self._tests[0][:, [0, -1]].T)
        if rod.closed:
            return found
        i, sign = [0, -1], np.array([-1.0, 1.0])
        e, e1 = (radius * e)[:, i], (radius * e1)[:, i]
        bent, shear = moment[:, i], contact[:, i]
        if ends is not None:
            bent, shear = ends[0] * slope[:, i], -ends[1] * slope[:, i]
        couple = across(sign * bent, e, np.zeros(2))
        reaction = np.zeros((t.size, 2))
        if rod.loads is not None and torques is not None:
            reaction[:, np.minimum(rod.loads.held, 1)] = torques
        rest = sign * shear - self._end_loads.force(t, r[:, i])
        turn = reaction + self._end_loads.torque(t, rate[:, i]) - sign * torsion[:, i] - _dot(couple, e1)
        found["end_force"] = _split(across(rest, e, turn)).swapaxes(1, 2)
        found["end_couple"] = _split(couple).swapaxes(1, 2)
        return found

    def _moments(self, t: Float, a: Complex, roll: Float) -> tuple[Complex, Complex, Complex]:
        """m, N and the elastic part of m over sqrt(K), at the nodes, (k, n)."""
        z, z1 = a @ self._line_at_nodes[1] + self._rod.shift, a @ self._line_at_nodes[2]
        loads, root = self._loads_at_nodes, np.sqrt(self._nodes.bending_stiffness)
        kappa = loads.rest(t, "curvature")
        elastic = root * (z1 - 1j * kappa * z)
        m = root * elastic
        n = 1j * kappa * m
        if self._viscosity.any():
            h, h1, _ = self._rod.law.jet(z, z1, 0 * z1)
            dz = 1j * (h1 * roll + h * (roll @ self._slope))
            drag = self._viscosity * (dz.conj() * z1 + z.conj() * (dz @ self._slope)).imag
            m, n = m + 1j * drag * z, n - 1j * drag * z1
        return m, n, elastic

    def _torsion(self, t: Float, q: Float, omega: Float) -> tuple[Float, Float, Float]:
        """sqrt(beta) (theta' - tau_0), M and M' at the places, (k, S)."""
        nodes, stiffness, value = self._loads_at_nodes, self._here.torsion_stiffness, self._field[0]
        twist = q[:, 2] @ self._slope
        root = np.sqrt(self._nodes.torsion_stiffness)
        own = root * (root * twist - nodes.rest(t, "strain")) + nodes.damping[1] * (omega @ self._slope)  # without theta_0
        strain = np.sqrt(stiffness) * (self._twist + q[:, 2] @ self._field[1]) - self._loads.rest(t, "strain")
        torsion1 = stiffness * self._twist1 + self._stiffer * self._twist + own @ self._field[1]
        return strain, stiffness * self._twist + own @ value, torsion1

    def _spins(self, t: Float, z: Phase, omega: Float) -> tuple[Float, Float | None]:
        """omega. at the nodes, (k, n), and the torques of motors, (k, motors); None without."""
        rod, q, parts = self._rod, z.hi + z.lo, self._rod.parameters
        c = rod.basis(q)
        moves, force = rod.forward(c, z.pi), -rod.mean_force(q)
        if rod.loads:
            force = force + rod.loads.applied(t, q, moves)
        slope, xy = rod.slopes(z), moves[:, :2] @ rod.functions.bends[: rod.n].T
        h = rod.law.jet(slope, 0 * slope, 0 * slope)[0]
        dh = _vector(rod.law.rate(_pair(slope), xy.swapaxes(0, 1)))
        push = rod.back(c, force)
        spin = c.t * push - c.t**2 * parts.mass * parts.radius**2 * omega * _dot(h, dh)
        if not (rod.loads and rod.loads.held.size):
            return spin, None
        held, changes = rod.loads.held, rod.loads.motors.changes(t)
        spin[:, held] = changes
        return spin, (changes / c.t[:, held] - push[:, held]) / c.t[:, held]


def weights(s: Float, closed: bool) -> Float:
    """Weights of a sum over equally spaced places (S,): the trapezoidal rule, at ends with Gregory's terms of order 4."""
    found = np.full(s.size, s[1] - s[0])
    if not closed:
        end = found[0] * np.array([3 / 8, 7 / 6, 23 / 24])
        found[:3], found[-3:] = end, end[::-1]
    return found


def across(rest: Complex, e: Complex, turn: Float) -> Complex:
    """The vectors with the part of `rest` across e, and the product `turn` with e; where e is short they are `rest`."""
    size = np.abs(e)
    unit = e / np.maximum(size, 1e-300)
    other = turn / np.maximum(size, 1e-300) - _dot(unit, rest)
    found: Complex = rest + unit * np.where(size > SHORT * size.max(), other, 0.0)
    return found


def _dot(a: Complex, b: Complex) -> Float:
    product: Float = a.real * b.real + a.imag * b.imag
    return product


def _pair(z: Complex) -> Float:
    return np.stack([z.real, z.imag])


def _split(z: Complex) -> Float:
    """(k, S) -> (k, 2, S)."""
    return np.stack([z.real, z.imag], axis=1)


def _vector(pair: Float) -> Complex:
    found: Complex = pair[0] + 1j * pair[1]
    return found
