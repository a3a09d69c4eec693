"""The rod on a mesh: second-order finite differences in s, which are the equations of rolling discs."""

from dataclasses import replace

import numpy as np

from continuum.initial import resolve
from continuum.pieces import POINTS
from continuum.rod import Scene, SteeredRod
from discs import Chain, Problem, State, SteeredChain, checks
from discs.chains import stencils

UNSEEN = 1 / 4  # of an energy: discs that miss more than this do not resolve the initial fields


def semidiscretise(scene: Scene, n: int, ends: str) -> Problem:
    """The field equations of a scene on n nodes, as the problem of n discs.

    A node with its share of length is a disc, a finite difference of the potential is a spring. With the stencils of
    `discs.chains.stencils` the energy is that of a chain, and the constraint that of rolling discs. A closed scene gives a ring for
    any `ends`. Steered discs (of a `SteeredRod`) have one kind of free ends, "springs".

    Parameters
    ----------
    n : number of nodes, both ends counted, or all around a ring.
    ends : "consistent" (second order), "springs" (first order) or "paper" (the paper's, first order).
    """
    if not isinstance(scene, Scene):
        raise ValueError(f"a Scene is wanted, such as untwisting_rod(); got {type(scene).__name__}")
    checks.choice("ends", ends, stencils.ENDS)
    if ends == "ring" and not scene.closed:
        raise ValueError("ends='ring' needs a closed scene; this one has two free ends: take 'springs' or 'consistent'")
    rod = scene.rod
    names = ("length", "density", "spin_inertia", "torsion_stiffness", "bending_stiffness", "stretch_stiffness", "radius")
    common: dict[str, float] = {name: getattr(rod, name) for name in names}
    ends = "ring" if scene.closed else ends
    chain: Chain | SteeredChain
    if isinstance(rod, SteeredRod):
        common |= {"shear_stiffness": rod.shear_stiffness, "heading_inertia": rod.heading_inertia}
        chain = SteeredChain(n=n, ends=ends, shift=scene.shift, turns=scene.turns, **common)
    else:
        chain = Chain(n=n, ends=ends, shift=scene.shift, rolling=scene.rolling, curvature=rod.curvature, **common)
    return Problem(chain, State(**scene.fields(chain.s)), scene.duration, scene.loads)


def unseen(scene: Scene, problem: Problem) -> str:
    """The warning if the discs are too few to resolve the initial fields of a scene; otherwise empty.

    Consider the fields that are linear between the discs. For theta their energy is that of the springs. They are the projection in
    energy, so that

        beta/2 int theta'^2 - sum beta (theta_{i+1} - theta_i)^2/2k = beta/2 int (theta' - its slope between the discs)^2 >= 0.

    So the missing energy measures the missing part of the field, wherever the discs are. Bending and shear are compared in the same
    way. For omega (and the rate of phi) the missing part is M/2 int (omega - linear interpolation)^2, compared with
    M/2 int (omega - mean)^2. A quarter of either, which is half of a field by its root mean square, gives a warning. Parts below a
    millionth of the whole energy are ignored. The paper's twist misses 1.3 % at n = 9; a bump exp(-(s/w)^2) misses a quarter at k =
    w.
    """
    try:
        found = resolve(scene)
    except ValueError as error:
        return f"the discs have no limit as a field: {error}"
    problem = replace(problem, loads=())
    pi = problem.start().pi
    parts = {"potential energy": (abs(found.potential - problem.energy() + 0.5 * float(np.vdot(pi, pi))), found.potential)}
    s, w = found.quadrature(POINTS)
    fields = found.fields(s)
    inertia = {"omega": scene.rod.inertia} | ({"phi_rate": scene.rod.heading_inertia} if isinstance(scene.rod, SteeredRod) else {})
    for name, moment in inertia.items():
        value, period = fields[name], scene.rod.length if scene.closed else None
        between = np.interp(s, problem.chain.s, np.asarray(getattr(problem.initial, name)), period=period)
        about = value - (w @ value) / scene.rod.length
        lost, whole = (float(0.5 * moment * w @ part**2) for part in (value - between, about))
        parts[f"kinetic energy of {name}"] = lost, whole
    missed = [name for name, (lost, whole) in parts.items() if lost > UNSEEN * whole and whole > 1e-6 * found.energy]
    if not missed:
        return ""
    lost, whole = parts[missed[0]]
    where = ""
    enough = 2 * problem.chain.n
    if found.features:
        place, width = min(found.features, key=lambda feature: feature[1])
        where = f", which vary within {width:.2g} at s = {place:.4g}"
        enough = max(enough, int(np.ceil(2 * scene.rod.length / width)))
    return (
        f"{problem.chain.n} discs are too few for the initial fields{where}: they miss {lost:.3g} of {whole:.3g}, the {missed[0]}; "
        f"take n = {enough} or more"
    )
