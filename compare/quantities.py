r"""What a study compares besides positions and angles: velocities, slopes, energy density and the ground's force.

With lambda_i the force on disc i, w_i its share of the length, and the limit of docs/ground-force.md, the errors at the end are

    velocity, slope : the largest over the discs, of both components, length per time and no unit;
    energy inside, force inside : the energy density, and lambda_i/w_i against the force per length, the largest over the discs that
        are an eighth of the length or more away from free ends;
    force weak : sum_i lambda_i eta(s_i) against <lambda, eta>, the largest over the five test functions of
        `continuum.wants.smooth_tests`, cos(k pi s/length) for k = 0 ... 4, and both components;
    end force, end couple : sums over the discs in an eighth of the length at a free end, without the force inside, see
        `discs.mechanics.ground`.

All but the first two are relative to the largest value in the field at that time.

The limit of the end force needs the field's force per length near the end, whose own error is largest there. The field shows it:
contact_moments are computed without that force, and cos(0) + cos(pi s/length) sees one end, cos(0) - cos(pi s/length) the other. By
half as much the parts and the moments differ (`_defect`), and this is added to the field's estimated error of the end force.

Velocity, energy and force per length of discs of order four are those of their elements: the means over each, compared with the
field's mean over the same element. The sum of the energies is that of the chain; lambda_i/w_i alone has order two, see
`discs.mechanics.ground`. Elements have a second branch of waves, in which middles swing against the discs where elements meet. It
starts with displacements of k^4 and frequencies of 1/k: velocities at the discs have order three, the means do not see it.

The energy density of other discs is rho |r.|^2/2 + alpha omega^2/2 + beta theta'^2/2 + K |r''|^2/2, with headings of their own
that of the strains. Strains are taken at the discs: means of the two links beside one, at an end of the link there and a ghost
link. (At the last few discs of a free end theta' is off at first order, and plain ends have no bending spring.)
"""

from collections.abc import Iterable

import numpy as np

from continuum import Scene
from continuum.ground import weights
from continuum.load_places import point_loads
from continuum.solver import spline
from continuum.wants import INSIDE, smooth_tests
from discs import Solution, checks
from discs.arrays import Float
from discs.chains import elements, stencils
from discs.chains.chain import Chain, SteeredChain
from discs.loads import Rest
from discs.mechanics.ground import end_forces, inner, inner_places

PAIRS = {"velocity": ("x_rate", "y_rate"), "slope": ("slope_x", "slope_y")}
WANTS = (*PAIRS, "energy_density", "contact_force")


def check_want(want: Iterable[str], scene: Scene) -> tuple[str, ...]:
    """The names in `want`; ValueError for one that is not compared."""
    given = checks.several("want", want, "names of quantities")
    names = tuple(dict.fromkeys(checks.choice("want", name, WANTS) for name in given))
    if lacking := [name for name in names if name not in offered(scene)]:
        raise ValueError(
            f"want: of this scene {', '.join(offered(scene))} are compared; got {', '.join(lacking)} (true curvature gives "
            "velocity and slope, a load at a point inside no contact_force, a rest shape no energy_density)"
        )
    return names


def offered(scene: Scene) -> tuple[str, ...]:
    """The quantities that both discs and the field of a scene have."""
    if scene.rod.curvature != "linear" and not scene.steered:
        return tuple(PAIRS)  # of a field by extrapolation
    inside = any(scene.closed or 0 < at < scene.rod.length for at in point_loads(scene))
    lacking = {"contact_force"} if inside else set()
    if any(isinstance(load, Rest) for load in scene.loads):
        lacking.add("energy_density")
    return tuple(name for name in WANTS if name not in lacking)


class Limit:
    """The quantities of a field at the end of a scene.

    Attributes
    ----------
    names : of the errors. of_discs : the quantities that runs of discs must have. floors : estimated errors of the field.
    """

    def __init__(self, scene: Scene, field: Solution, want: tuple[str, ...]) -> None:
        self._scene, self._want = scene, want
        self._values: dict[str, Float] = {}
        estimate, floors = field.error_estimate or {}, {}
        for name in want:
            arrays = PAIRS.get(name, (name,))
            if any(getattr(field, array) is None for array in arrays):
                raise ValueError(f"field has no {name}; give solve(scene, tol, want={want!r})")
            values = np.concatenate([np.atleast_2d(getattr(field, array)[-1]) for array in arrays])
            self._values[name] = values
            if name in PAIRS:
                floors[name] = max(estimate[array] for array in arrays)
        away = slice(None) if scene.closed else inner_places(field.s, scene.rod.length)
        for name, error in (("energy_density", "energy inside"), ("contact_force", "force inside")):
            if name in want:
                floors[error] = estimate[name if scene.closed else INSIDE[name]] / _size(self._values[name][:, away])
        if "contact_force" in want:
            for name, array in (("force weak", "contact_moments"), ("end force", "end_force"), ("end couple", "end_couple")):
                if (found := getattr(field, array)) is not None and not (name == "end couple" and scene.steered):
                    self._values[name] = found[-1]
                    more = _defect(field) if name == "end force" else 0.0
                    floors[name] = (estimate[array] + more) / _size(found[-1])
        self._splines = {name: spline(scene, field.s, self._values[name]) for name in want}
        self.names, self.floors = tuple(floors), tuple(floors.values())
        self.of_discs = tuple(dict.fromkeys("velocity" if name == "energy_density" else name for name in want))

    def errors(self, run: Solution) -> list[float]:
        """The errors of a run of discs at its end, in the order of `names`."""
        found: dict[str, float] = {}
        for name in self._want:
            limit = self._splines[name](run.s).T
            if name in PAIRS:
                values = np.stack([getattr(run, array)[-1] for array in PAIRS[name]])
                if name == "velocity" and run.problem is not None and _elements(run.problem.chain):
                    values, limit = simpson(values, self._scene.closed), self._means(name, run.problem.chain)
                found[name] = float(np.abs(values - limit).max())
            elif name == "energy_density":
                found["energy inside"] = self._of_the_energy(run, limit)
            else:
                found |= self._of_the_ground(run, limit)
        return [found[name] for name in self.names]

    def _of_the_energy(self, run: Solution, limit: Float) -> float:
        assert run.problem is not None
        chain, away = run.problem.chain, inner(run)
        density = energy_density(self._scene, run)
        if _elements(chain):
            limit, away = self._means("energy_density", chain), away[1::2]
        return _largest(density[:, away], limit[:, away])

    def _means(self, name: str, chain: Chain | SteeredChain) -> Float:
        """The means of a quantity over the elements of discs of order four, (components, elements)."""
        first = chain.s[: 2 * (chain.n // 2) : 2]
        integral = self._splines[name].antiderivative()
        found: Float = ((integral(first + 2 * chain.k) - integral(first)) / (2 * chain.k)).T
        return found

    def _of_the_ground(self, run: Solution, limit: Float) -> dict[str, float]:
        assert run.problem is not None
        assert run.contact_force is not None
        chain, force, away = run.problem.chain, run.contact_force[-1], inner(run)
        per_length, known = force / chain.w, limit
        if _elements(chain):
            known, away = self._means("contact_force", chain), away[1::2]
            per_length = simpson(per_length, chain.ends == "ring")
        found = {"force inside": _largest(per_length[:, away], known[:, away])}
        tests = smooth_tests(chain.s, chain.length, self._scene.closed)[0]
        found["force weak"] = _largest(force @ tests.T, self._values["force weak"])
        if "end force" in self._values:
            ends = end_forces(run[-1:], limit[None])
            found["end force"] = _largest(ends.force[0], self._values["end force"])
            if "end couple" in self._values:
                found["end couple"] = _largest(ends.couple[0], self._values["end couple"])
        return found


def _defect(field: Solution) -> float:
    """What the force inside and the end forces of a field with free ends lack of its moments, the largest at an end."""
    assert field.contact_force is not None
    assert field.contact_moments is not None
    assert field.end_force is not None
    eta = smooth_tests(field.s, field.s[-1], False)[0, :2]  # without slope at the ends, so without couples
    parts = field.contact_force[-1] @ (eta * weights(field.s, False)).T + field.end_force[-1].T @ eta[:, [0, -1]].T
    whole, between = (parts - field.contact_moments[-1][:, :2]).T
    return float(np.abs([whole + between, whole - between]).max()) / 2


def _elements(chain: Chain | SteeredChain) -> bool:
    return isinstance(chain, SteeredChain) and chain.degree == 2


def simpson(values: Float, ring: bool) -> Float:
    """The means over the elements of discs of order four, (..., elements), of values at the discs, (..., n)."""
    first = values[..., ::2]
    after = np.roll(first, -1, axis=-1) if ring else first[..., 1:]
    found: Float = (first[..., : after.shape[-1]] + 4 * values[..., 1::2] + after) / 6
    return found


def energy_density(scene: Scene, run: Solution) -> Float:
    """The energy density of discs at the last frame, (1, n), energy per length; of order four that of elements, (1, elements)."""
    assert run.problem is not None
    assert run.x_rate is not None
    assert run.y_rate is not None
    chain = run.problem.chain
    k, ends, rod = chain.k, chain.ends, scene.rod.at(chain.s)
    d = stencils.links(np.stack([run.x[-1], run.y[-1]]), ends)
    if scene.closed:
        d[:, -1] += scene.shift
    line = stencils.extended(d, ends)
    slope, bend = (part[0] + 1j * part[1] for part in ((line[:, 1:] + line[:, :-1]) / (2 * k), np.diff(line) / k**2))
    twist = stencils.extended(stencils.links(run.theta[-1], ends), ends) / k
    density = rod.density * (run.x_rate[-1] ** 2 + run.y_rate[-1] ** 2) + rod.spin_inertia * run.omega[-1] ** 2
    density = density + rod.torsion_stiffness * ((twist[1:] + twist[:-1]) / 2) ** 2
    if isinstance(chain, Chain):
        stretch = np.asarray(getattr(rod, "stretch_stiffness", 0.0) or 0.0)
        found: Float = density + chain.link_law.density(np.asarray(rod.bending_stiffness), stretch, slope, bend)
        return 0.5 * found[None]
    assert run.phi is not None
    assert run.phi_rate is not None
    turn = stencils.links(run.phi[-1], ends)
    if ends == "ring":
        turn[-1] += 2 * np.pi * chain.turns
    if chain.degree == 2:
        return _of_elements(scene, chain, run, np.stack([*d, stencils.links(run.theta[-1], ends), turn]))
    turns = stencils.extended(turn, ends) / k
    strain = np.exp(-1j * run.phi[-1]) * slope
    density = density + rod.heading_inertia * run.phi_rate[-1] ** 2 + rod.bending_stiffness * ((turns[1:] + turns[:-1]) / 2) ** 2
    whole: Float = density + rod.stretch_stiffness * (strain.real - 1) ** 2 + rod.shear_stiffness * strain.imag**2
    return 0.5 * whole[None]


def _of_elements(scene: Scene, chain: SteeredChain, run: Solution, d: Float) -> Float:
    """The mean energy density of each element, (1, elements), from links d of x, y, theta and phi (4, n_links)."""
    assert run.x_rate is not None
    assert run.y_rate is not None
    assert run.phi is not None
    assert run.phi_rate is not None
    k, rod, there = chain.k, scene.rod.at(chain.s), scene.rod.at(chain.middles)
    kinetic = rod.density * (run.x_rate[-1] ** 2 + run.y_rate[-1] ** 2) + rod.spin_inertia * run.omega[-1] ** 2
    kinetic = kinetic + rod.heading_inertia * run.phi_rate[-1] ** 2
    first = run.phi[-1] if chain.ends == "ring" else run.phi[-1, :-1]
    slopes, heading = elements.at_points(d, first + d[3] / 2)
    strain, twist, bend = np.exp(-1j * heading) * (slopes[0] + 1j * slopes[1]) / k - 1, slopes[2] / k, slopes[3] / k
    elastic = there.stretch_stiffness * strain.real**2 + there.shear_stiffness * strain.imag**2
    elastic = elastic + there.torsion_stiffness * twist**2 + there.bending_stiffness * bend**2
    found: Float = 0.5 * (simpson(kinetic, chain.ends == "ring") + 0.5 * (elastic[::2] + elastic[1::2]))[None]
    return found


def _largest(found: Float, limit: Float) -> float:
    return float(np.abs(found - limit).max()) / _size(limit)


def _size(values: Float) -> float:
    """The largest absolute value; 1 if all are zero."""
    return float(np.abs(values).max()) or 1.0
