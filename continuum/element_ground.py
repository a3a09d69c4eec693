r"""The ground's force on a rod with headings of its own, and other quantities at places along it; see `continuum.elements`.

With the contact force n and the torsion moment M = beta (theta' - tau_0) + eta omega' the two lines of d'Alembert's principle, for
displacements eta of the line and psi of theta,

    <lambda, eta> = int rho r.. . eta + n . eta' - F . eta,    -<lambda, e psi> = int (alpha omega. + c omega - tau) psi + M psi',

give after integration by parts lambda = rho r.. - n' - F inside and

    force_0 = -n(0) - F_0,   force_l = n(length) - F_l,    no couples,

as no second derivative of the line has energy. The second line has e . lambda = M' + tau - c omega - alpha omega. inside, and
force . e = tau_0 + M(0) or tau_l - M(length). As in `continuum.ground`, the part across the heading is taken from these.
Derivatives are those of the polynomials on the elements, omega. is that of the nodes.
"""

import numpy as np

from continuum.element_loads import INSIDE, SteeredTerms, put
from continuum.elements import Elements
from continuum.ground import across
from continuum.load_terms import spread_and_points
from continuum.wants import smooth_tests
from discs.arrays import Float


class ElementGround:
    """Quantities of a rod on elements at places, by the names of `Solution`.

    Parameters
    ----------
    s : (S,), the places. want : the quantities, see `continuum.wants`.
    """

    def __init__(self, elements: Elements, s: Float, want: tuple[str, ...]) -> None:
        self._elements, self._s, self._want = elements, s, set(want)
        scene, places = elements.scene, elements.grid.places
        self._rod = scene.rod.at(places)
        spread, points = spread_and_points(scene)
        inward = np.zeros(places.shape[1])
        inward[[0, -1]] = INSIDE * scene.rod.length, -INSIDE * scene.rod.length
        self._tests = smooth_tests(places.ravel(), scene.rod.length, scene.closed).reshape(3, -1, *places.shape)
        self._loads = SteeredTerms.along(scene, spread, (places + inward).ravel(), put)
        self._end_loads = SteeredTerms.along(scene, points, np.array([0.0, scene.rod.length]), put)

    def at(self, t: float, q: Float) -> dict[str, Float]:
        """The quantities at a time for unknowns (6, n)."""
        elements, want, rod, grid = self._elements, self._want, self._rod, self._elements.grid
        values = np.empty(0) if elements.loads is None else elements.loads.values(t)
        strain, stress, (heading, *_) = elements.stresses(q, values)
        omega, turn = q[4:, grid.index]
        along = heading[0] + 1j * heading[1]
        e = 1j * rod.radius * along
        v, n = e * omega, along * (stress[0] + 1j * stress[1])
        local: dict[str, Float] = {}
        if "velocity" in want:
            local |= {"x_rate": v.real, "y_rate": v.imag}
        if "slope" in want:
            local |= {"slope_x": heading[0], "slope_y": heading[1]}
        if "energy_density" in want:
            kinetic = rod.inertia * omega**2 + rod.heading_inertia * turn**2
            local["energy_density"] = 0.5 * (kinetic + (elements.stiffness * strain**2).sum(axis=0))
        if "energy_flux" in want:
            local["energy_flux"] = -((n.conj() * v).real + stress[2] * omega + stress[3] * turn)
        found: dict[str, Float] = {}
        if "contact_force" in want:
            faster, reaction = elements.spins(t, q)
            xy, now, shape = elements.local(q)[:2], np.array([t]), omega.shape
            force = self._loads.force(now, (xy[0] + 1j * xy[1]).reshape(1, -1)).reshape(shape)
            torque = self._loads.torque(now, omega.reshape(1, -1)).reshape(shape)
            spin = faster[grid.index]
            slope = grid.slope(np.stack([n.real, n.imag, stress[2]]))
            free = rod.density * (e * spin - rod.radius * along * turn * omega) - force
            eta, eta1 = (grid.w * values for values in self._tests[:2])
            moments = (free * eta + n * eta1).sum(axis=(1, 2))
            inner = across(free - slope[0] - 1j * slope[1], e, slope[2] + torque - rod.spin_inertia * spin)
            local |= {"force_x": inner.real, "force_y": inner.imag}
            if not elements.scene.closed:
                ends, sign = ([0, -1], [0, -1]), np.array([-1.0, 1.0])
                pushed = self._end_loads.force(now, (xy[0] + 1j * xy[1])[ends][None])[0]
                moments = moments - self._tests[0][:, *ends] @ pushed
                rest = sign * n[ends] - pushed
                moment = reaction + self._end_loads.torque(now, omega[ends][None])[0] - sign * stress[2][ends]
                force = across(rest, e[ends], moment)
                found |= {"end_force": np.stack([force.real, force.imag], axis=1), "end_couple": np.zeros((2, 2))}
            found["contact_moments"] = np.stack([moments.real, moments.imag])
        sampled = dict(zip(local, grid.sample(np.stack(list(local.values())), self._s), strict=True)) if local else {}
        if "force_x" in sampled:
            found["contact_force"] = np.stack([sampled.pop("force_x"), sampled.pop("force_y")])
        return sampled | found
