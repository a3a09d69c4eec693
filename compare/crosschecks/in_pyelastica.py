r"""PyElastica: a free rod without the ground, bent by a blow, and twisted and let go.

Its rod is a three-dimensional Cosserat rod that also stretches and shears; `continuum.free_rod` is planar and inextensible, with
torsion apart from it: alpha theta.. = beta theta''. A round wire of radius a, the same mass per length rho and bending stiffness K
has Young's modulus 4 K/(pi a^4); what it differs by falls like a^2. Its spin inertia is rho a^2/2 and its torsion stiffness
G pi a^4/2: these are given to our rod for the twist, which is independent of the line while that is straight.
"""

from contextlib import redirect_stdout
from typing import Any

import elastica as untyped
import numpy as np

from compare.crosschecks.both import timed
from compare.crosschecks.table import Row, order
from continuum import Rod, free_rod
from discs.arrays import Float

elastica: Any = untyped  # it names nothing as exported
LENGTH, DENSITY, BENDING, POISSON = 3.7, 1.3, 0.5, 0.3


def straight(s: Float) -> Float:
    """The line at the start."""
    return np.array([s, 0 * s])


def blow(s: Float) -> Float:
    """Velocity at the start, across the line."""
    return np.array([0 * s, 1.2 * np.exp(-(((s - 1.7) / 0.7) ** 2))])


def twist(s: Float) -> Float:
    """Angles at the start."""
    return 0.7 * np.cos(np.pi * s / LENGTH) + 0.2 * np.cos(3 * np.pi * s / LENGTH)


def wire(cells: int, thickness: float) -> tuple[Any, float]:
    """A straight free rod of PyElastica, and its Young's modulus."""
    young = 4 * BENDING / (np.pi * thickness**4)
    axes = np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
    rod = elastica.CosseratRod.straight_rod(
        cells,
        *axes,
        LENGTH,
        thickness,
        DENSITY / (np.pi * thickness**2),
        youngs_modulus=young,
        shear_modulus=young / (2 + 2 * POISSON),
    )
    return rod, young


def march(rod: Any, duration: float, step: float) -> None:
    """PyElastica's position Verlet method, order 2."""

    class Simulator(elastica.BaseSystemCollection):  # type: ignore[misc]
        pass

    simulator = Simulator()
    simulator.append(rod)
    simulator.finalize()
    with redirect_stdout(None):
        elastica.integrate(elastica.PositionVerlet(), simulator, duration, int(np.ceil(duration / step)), progress_bar=False)


def _ours(rod: Rod, v0: Any, theta0: Any, duration: float, n: int, dt: float) -> Any:
    return free_rod(rod, straight, v0, theta0, 0.0, duration, n, dt, frames=1, progress=False, estimate=False)


def bent(cells: int = 48, duration: float = 3.0) -> Row:
    """The largest distance of nodes for three thicknesses."""
    rod = Rod(length=LENGTH, density=DENSITY, spin_inertia=0.6, torsion_stiffness=0.9, bending_stiffness=BENDING, radius=0.7)
    ours, our_seconds = timed(_ours, rod, blow, 0.0, duration, cells + 1, 0.005)
    thicknesses, gaps = np.array([0.08, 0.04, 0.02]), []
    for thickness in thicknesses:
        theirs, young = wire(cells, thickness)
        theirs.velocity_collection[:2] = blow(ours.s)
        turning = np.zeros((3, cells))
        turning[2] = np.diff(theirs.velocity_collection[1]) / ours.s[1]
        theirs.omega_collection[:] = np.einsum("ijk,jk->ik", theirs.director_collection, turning)
        step = 0.3 * LENGTH / cells / np.sqrt(young * np.pi * thickness**2 / DENSITY)
        their_seconds = timed(march, theirs, duration, step)[1]
        gaps.append(float(np.abs(theirs.position_collection[:2] - np.stack([ours.x[-1], ours.y[-1]])).max()))
    return Row(
        "PyElastica free rod",
        f"free rod, {cells} cells, a blow, t = {duration:g}",
        "y of the end s = 0; all nodes",
        float(ours.y[-1, 0]),
        float(theirs.position_collection[1, 0]),
        gaps[-1],
        f"{order(thicknesses, gaps):.1f} in the thickness",
        our_seconds,
        their_seconds,
        "three-dimensional, stretches and shears; its thickness → 0 is our rod",
    )


def twisted(thickness: float = 0.2, duration: float = 2.6) -> Row:
    """The largest difference of the angles for three numbers of cells."""
    sizes, gaps = np.array([16, 32, 64]), []
    for cells in sizes:
        theirs, young = wire(int(cells), thickness)
        torsion = young / (2 + 2 * POISSON) * np.pi * thickness**4 / 2
        rod = Rod(
            length=LENGTH,
            density=DENSITY,
            spin_inertia=DENSITY * thickness**2 / 2,
            torsion_stiffness=torsion,
            bending_stiffness=BENDING,
            radius=0.7,
        )
        middles = LENGTH * (np.arange(cells) + 0.5) / cells
        angle = twist(middles)
        first, second = theirs.director_collection[0].copy(), theirs.director_collection[1].copy()
        theirs.director_collection[0] = np.cos(angle) * first + np.sin(angle) * second
        theirs.director_collection[1] = np.cos(angle) * second - np.sin(angle) * first
        step = 0.1 * LENGTH / cells / np.sqrt(2 * torsion / DENSITY) * thickness
        their_seconds = timed(march, theirs, duration, step)[1]
        n = int(cells) + 1
        ours, our_seconds = timed(_ours, rod, np.zeros((2, n)), twist, duration, n, duration / 20 / n)
        turned = (theirs.director_collection[0] * first).sum(axis=0), (theirs.director_collection[0] * second).sum(axis=0)
        found = np.arctan2(turned[1], turned[0])
        between = 0.5 * (ours.theta[-1, 1:] + ours.theta[-1, :-1])
        gaps.append(float(np.abs(found - between).max()))
    return Row(
        "PyElastica free rod",
        f"free rod, {sizes[-1]} cells, a twist let go, t = {duration:g}",
        "angle of the first cell; all cells",
        float(between[0]),
        float(found[0]),
        gaps[-1],
        f"{order(1 / sizes, gaps):.1f} in the length of cells",
        our_seconds,
        their_seconds,
        "three-dimensional; the line is straight and stays at rest",
    )


def rows() -> list[Row]:
    """Bending and torsion."""
    return [bent(), twisted()]
