"""Quantities that `solve` gives besides x, y, theta and omega where they are wanted, by the names of `Solution`."""

from collections.abc import Iterable

import numpy as np

from continuum.load_places import point_loads
from continuum.rod import Scene
from discs.arrays import Float
from discs.loads import Custom, Potential
from discs.mechanics.ground import inner_places
from discs.running.frames import wanted

ARRAYS = {
    "velocity": ("x_rate", "y_rate"),
    "slope": ("slope_x", "slope_y"),
    "contact_force": ("contact_force", "contact_moments", "end_force", "end_couple"),
    "energy_density": ("energy_density",),
    "energy_flux": ("energy_flux",),
}
INSIDE = {name: f"{name}_inside" for name in ("contact_force", "energy_density")}  # their errors away from free ends
OFFERS = {
    "spectral": tuple(ARRAYS),
    "elements": tuple(ARRAYS),
    "richardson": ("velocity", "slope"),
    "leapfrog": ("velocity", "slope"),
}


def check_want(want: Iterable[str], method: str, scene: Scene) -> tuple[str, ...]:
    """The names in `want`; ValueError for one that the method, or the scene, does not have."""
    names = wanted(want, tuple(ARRAYS))
    for name in names:
        if name not in OFFERS[method]:
            raise ValueError(
                f"want: method={method!r} gives {', '.join(OFFERS[method])}; got {name!r}: take method='spectral' or 'elements' "
                "(own headings), or for the force on discs simulate(lump(scene, n), want=...)"
            )
    if "contact_force" in names:
        own = [type(load).__name__ for load in scene.loads if isinstance(load, Custom | Potential)]
        if own:
            raise ValueError(
                f"want: contact_force of a field with {own[0]} is not known; leave it out, or take that of discs: "
                "simulate(lump(scene, n), want=...)"
            )
        inside = [at for at in point_loads(scene) if scene.closed or 0 < at < scene.rod.length]
        if inside:
            raise ValueError(
                f"want: with a load at the point s = {inside[0]:g} the ground has a force at that point, too, so contact_force is "
                f"no function of s; spread it over a width, as by a pattern like exp(-((s - {inside[0]:g})/"
                f"{scene.rod.length / 40:.2g})^2), or leave 'contact_force' out"
            )
    return names


def with_inside(fields: dict[str, Float], s: Float, closed: bool) -> dict[str, Float]:
    """Fields by name and, with free ends, the parts that `INSIDE` names, an eighth of the length or more from the ends.

    s : (S,), the places, the first and the last at the ends.
    """
    away = inner_places(s, s[-1])
    return fields if closed else fields | {INSIDE[name]: fields[name][..., away] for name in INSIDE if name in fields}


def arrays(want: tuple[str, ...], closed: bool) -> tuple[str, ...]:
    """The arrays of wanted quantities; a closed rod has no end forces."""
    return tuple(name for key in ARRAYS if key in want for name in ARRAYS[key] if not (closed and name.startswith("end_")))


def estimated(want: tuple[str, ...], closed: bool) -> tuple[str, ...]:
    """The names of estimated errors of wanted quantities: their arrays, and what `INSIDE` names."""
    names = arrays(want, closed)
    return (*names, *(INSIDE[name] for name in INSIDE if name in names and not closed))


def smooth_tests(s: Float, length: float, closed: bool) -> Float:
    """The test functions of contact_moments and their first two derivatives at places (S,), (3, 5, S).

    cos(k pi s/length), k = 0 ... 4; on a closed rod 1, cos, sin, cos, sin of 2 pi s/length and of twice that. For discs the moments
    are sums, `run.contact_force @ smooth_tests(chain.s, chain.length, closed)[0].T`.
    """
    q = np.pi / length * (2 * np.array([0, 1, 1, 2, 2]) if closed else np.arange(5))[:, None]
    phase = np.array([0, 0, -np.pi / 2, 0, -np.pi / 2])[:, None] if closed else 0.0
    return np.stack([q**m * np.cos(q * s + phase + m * np.pi / 2) for m in range(3)])
