"""The rod on a mesh: second-order finite differences in s, which read as rolling discs."""

from typing import Any

from continuum.rod import Scene, SteeredRod
from discs import Chain, Problem, State, SteeredChain, checks, stencils


def semidiscretise(scene: Scene, n: int, ends: str) -> Problem:
    """The field equations of a scene on n nodes, as the problem of n discs that they are.

    A node with its share of length is a disc, a finite difference of the potential is a spring: with the stencils of
    `discs.stencils` the energy is that of a chain, and the constraint that of rolling discs. A closed scene makes a ring
    whatever `ends` says. Discs with headings of their own (`SteeredRod`) have one kind of free ends, "springs".

    Parameters
    ----------
    n : nodes, both ends counted, or all around a ring.
    ends : "consistent" (second order), "springs" (first order) or "paper" (the paper's, first order).
    """
    checks.choice("ends", ends, stencils.ENDS)
    if ends == "ring" and not scene.closed:
        raise ValueError("ends='ring' needs a closed scene; this one has two free ends: take 'springs' or 'consistent'")
    rod = scene.rod
    common: dict[str, Any] = {
        name: getattr(rod, name)
        for name in ("length", "density", "spin_inertia", "torsion_stiffness", "bending_stiffness", "stretch_stiffness", "radius")
    } | {"n": n, "ends": "ring" if scene.closed else ends, "shift": scene.shift}
    chain: Chain | SteeredChain
    if isinstance(rod, SteeredRod):
        beams: dict[str, Any] = {"shear_stiffness": rod.shear_stiffness, "heading_inertia": rod.heading_inertia}
        chain = SteeredChain(**common, **beams, turns=scene.turns)
    else:
        chain = Chain(**common, rolling=scene.rolling, curvature=rod.curvature)
    return Problem(chain, State(**scene.fields(chain.s)), scene.duration)
